# SPDX-License-Identifier: Apache-2.0
"""A client written from protocol/PROTOCOL.md alone, and a TCP proxy that makes its connection slow. The client checks
in every frame the promises that the document makes for all frames."""
import asyncio
import http.client
import json
import math
import socket
import struct
import zlib

import websockets

PATIENCE = 30  # seconds to wait for an answer; only a server that hangs takes so long
INTERACTIVE, FINAL = 1, 2

# "Frame header": offset, type.
HEADER = {"magic": (0, "4s"), "version": (4, "H"), "headerBytes": (6, "H"), "codec": (8, "B"), "flags": (9, "B"),
          "width": (10, "H"), "height": (12, "H"), "method": (14, "B"), "zero": (15, "B"), "frame": (16, "I"), "revision": (20, "I"),
          "patch": (24, "I"), "samples": (28, "I"), "error": (32, "f"), "rebuildUs": (36, "I"), "renderUs": (40, "I"),
          "encodeUs": (44, "I")}


class Frame:
    type = "frame"

    def __init__(self, message):
        for name, (offset, kind) in HEADER.items():
            setattr(self, name, struct.unpack_from("<" + kind, message, offset)[0])
        self.bytes = len(message)
        self.image = message[self.headerBytes:]

    def problems(self, before):
        """Names of the broken promises, given the stream's previous frame (or None)."""
        size = jpeg_size(self.image) if self.codec == 1 else png_size(self.image)
        found = {
            "magic": self.magic == b"SCLX", "version": self.version == 1, "headerBytes": self.headerBytes >= 48,
            "codec": self.codec in (1, 2), "flags": self.flags < 4, "method": self.method >= 2, "offset 15": self.zero == 0,
            "size": size == (self.width, self.height), "samples": self.samples >= 1,
            "error": math.isnan(self.error) == (self.samples < 2),
            "frame": self.frame > (before.frame if before else 0),
            "revision": self.revision >= (before.revision if before else 1),
            "patch": self.patch >= (before.patch if before else 0),
            "samples within a revision": not before or before.revision != self.revision
            or self.samples >= before.samples or (self.width > before.width and before.flags & INTERACTIVE),
            "final": not before or before.revision != self.revision or not before.flags & FINAL}
        return [name for name, good in found.items() if not good]


def jpeg_size(image):
    """(width, height) from the frame segment (SOF0 to SOF2) of a complete JPEG."""
    if image[:2] != b"\xff\xd8" or image[-2:] != b"\xff\xd9":
        return None
    at = 2
    while image[at] == 0xFF and image[at + 1] not in (0xC0, 0xC1, 0xC2):
        at += 2 + struct.unpack_from(">H", image, at + 2)[0]
    height, width = struct.unpack_from(">HH", image, at + 5)
    return width, height


def png_size(image):
    return struct.unpack_from(">II", image, 16) if image[:8] == b"\x89PNG\r\n\x1a\n" else None


def png_colors(image):
    """The set of the (r, g, b) of all pixels of an 8-bit RGB picture that is not interlaced."""
    width, height = png_size(image)
    if tuple(image[24:29]) != (8, 2, 0, 0, 0):
        raise ValueError("not 8-bit RGB")
    data, at = b"", 8
    while at < len(image):
        length, kind = struct.unpack_from(">I4s", image, at)
        data += image[at + 8:at + 8 + length] if kind == b"IDAT" else b""
        at += 12 + length
    data, colors, above = zlib.decompress(data), set(), bytes(3 * width)
    for y in range(height):
        kind, *line = data[y * (1 + 3 * width):(y + 1) * (1 + 3 * width)]
        for x in range(3 * width):
            left, corner = (line[x - 3], above[x - 3]) if x >= 3 else (0, 0)
            p = left + above[x] - corner
            paeth = min((abs(p - v), i, v) for i, v in enumerate((left, above[x], corner)))[2]
            line[x] = (line[x] + (0, left, above[x], (left + above[x]) // 2, paeth)[kind]) % 256
        colors.update(zip(line[0::3], line[1::3], line[2::3]))
        above = line
    return colors


def apply_patch(scene, patch):
    """Section "Patches", for a resolved scene, whose lists are complete; null removes a member."""
    if isinstance(scene, list) and isinstance(patch, dict):
        result = list(scene)
        for index, value in patch.items():
            result[int(index)] = apply_patch(scene[int(index)], {} if value is None else value)
        return result
    if not isinstance(patch, dict):
        return patch
    result = dict(scene) if isinstance(scene, dict) else {}
    for one, other in (("fovY", "orthoHeight"), ("orthoHeight", "fovY"), ("color", "colormap"), ("colormap", "color")):
        if one in patch and other not in patch:
            result.pop(other, None)
    for name, value in patch.items():
        if value is None:
            result.pop(name, None)
        else:
            result[name] = apply_patch(result.get(name), value)
    return result


def call(server, method, path, body=None, **headers):
    """(status, headers, body) of a call on a new connection; a header of None, as `content_type=None`, is omitted."""
    send = {"Authorization": f"Bearer {server.token}", "Content-Type": "application/json"}
    send.update((name.replace("_", "-").title(), value) for name, value in headers.items())
    connection = http.client.HTTPConnection("127.0.0.1", server.port, timeout=PATIENCE)
    body = body if body is None or isinstance(body, bytes) else json.dumps(body)
    try:
        connection.request(method, path, body, {name: value for name, value in send.items() if value is not None})
        answer = connection.getresponse()
        return answer.status, answer.headers, answer.read()
    finally:
        connection.close()


def call_json(server, method, path, body=None, **headers):
    status, _, answer = call(server, method, path, body, **headers)
    return status, json.loads(answer)


def connect(server, stream, port=None, query="", **options):
    """The WebSocket at a session's address `stream`, by default with the token in the head."""
    options.setdefault("extra_headers", {"Authorization": f"Bearer {server.token}"})
    return websockets.connect(f"ws://127.0.0.1:{port or server.port}/{stream}{query}", max_size=None,
                              ping_interval=None, open_timeout=PATIENCE, **options)


class Viewer:
    """A viewer of a session; `async with Viewer(server, session) as viewer:` has read `hello`."""

    def __init__(self, server, session, port=None):
        self.opening = connect(server, session["stream"], port)
        self.frames, self.patches, self.pings = [], 0, 0

    async def __aenter__(self):
        self.socket = await self.opening.__aenter__()
        self.hello = await self.text("hello")
        return self

    async def __aexit__(self, *error):
        return await self.opening.__aexit__(*error)

    async def send(self, kind, **members):
        await self.socket.send(json.dumps({"type": kind, **members}))

    async def patch(self, patch):
        self.patches += 1
        await self.send("patch", id=self.patches, patch=patch)
        return self.patches

    async def receive(self, ack=True):
        """The next message; a frame is checked and, with `ack`, acknowledged."""
        message = await self.socket.recv()
        if isinstance(message, str):
            return json.loads(message)
        frame = Frame(message)
        problems = frame.problems(self.frames[-1] if self.frames else None)
        if problems:
            raise AssertionError(f"frame with bad {problems}: {vars(frame) | {'image': None}}")
        self.frames.append(frame)
        if ack:
            await self.send("ack", frame=frame.frame)
        return frame

    async def until(self, wanted, ack=True):
        """All messages up to the first one that is `wanted` (a type or a predicate)."""
        messages = []
        async with asyncio.timeout(PATIENCE):
            while True:
                message = await self.receive(ack)
                messages.append(message)
                kind = message.type if isinstance(message, Frame) else message["type"]
                if kind == wanted if isinstance(wanted, str) else wanted(message):
                    return messages
                if kind == "error":
                    raise AssertionError(f"{message}")

    async def text(self, kind):
        return (await self.until(kind))[-1]

    async def frame(self, wanted=lambda frame: True):
        return (await self.until(lambda m: isinstance(m, Frame) and wanted(m)))[-1]

    async def sent_before_pong(self, ack=False):
        """The messages before the answer to a ping: all that were on their way when the server read the ping."""
        self.pings += 1
        await self.send("ping", id=self.pings)
        *before, pong = await self.until("pong", ack)
        if pong["id"] != self.pings:
            raise AssertionError(f"the answer to ping {self.pings} is {pong}")
        return before


class Proxy:
    """`async with Proxy(port) as proxy:` is a connection to the server. Only as many bytes as are allowed pass back:
    by `allow`, and by `rate` (bytes a second) if that is given. What cannot pass stays in small buffers or, if `deep`,
    is buffered without bound, as some proxies and tunnels do."""

    def __init__(self, target, rate=None, deep=False):
        self.target, self.rate, self.deep = target, rate, deep
        self.budget, self.held, self.most_held = 0, 0, 0
        self.changed, self.tasks, self.writers = asyncio.Condition(), [], []

    async def __aenter__(self):
        self.listener = await asyncio.start_server(self.serve, "127.0.0.1", 0)
        self.port = self.listener.sockets[0].getsockname()[1]
        if self.rate:
            self.tasks.append(asyncio.create_task(self.feed()))
        return self

    async def __aexit__(self, *_):
        self.listener.close()
        for task in self.tasks:
            task.cancel()
        for writer in self.writers:
            writer.close()
        await asyncio.gather(*self.tasks, return_exceptions=True)

    async def allow(self, count):
        async with self.changed:
            self.budget += count
            self.changed.notify_all()

    async def feed(self):
        while True:
            await asyncio.sleep(0.01)
            if self.budget < self.rate / 10:  # an unused allowance does not accumulate
                await self.allow(self.rate // 100)

    async def serve(self, reader, writer):
        upstream = socket.socket()
        upstream.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 8192)
        upstream.setblocking(False)
        await asyncio.get_running_loop().sock_connect(upstream, ("127.0.0.1", self.target))
        server_reader, server_writer = await asyncio.open_connection(sock=upstream, limit=4096)
        self.writers += [writer, server_writer]
        pieces = asyncio.Queue()
        self.tasks += [asyncio.create_task(work) for work in (
            self.pass_on(reader, server_writer), self.take_in(server_reader, pieces), self.let_out(pieces, writer))]

    async def pass_on(self, reader, writer):
        while piece := await reader.read(65536):
            writer.write(piece)
            await writer.drain()
        writer.close()

    async def take_in(self, reader, pieces):
        while True:
            async with self.changed:
                await self.changed.wait_for(lambda: self.deep or (self.budget > 0 and self.held == 0))
            piece = await reader.read(4096)
            self.held += len(piece)
            self.most_held = max(self.most_held, self.held)
            pieces.put_nowait(piece)
            if not piece:
                return

    async def let_out(self, pieces, writer):
        while piece := await pieces.get():
            while piece:
                async with self.changed:
                    await self.changed.wait_for(lambda: self.budget > 0)
                    now, piece = piece[:self.budget], piece[self.budget:]
                    self.budget -= len(now)
                    self.held -= len(now)
                    self.changed.notify_all()
                writer.write(now)
                await writer.drain()
        writer.close()
