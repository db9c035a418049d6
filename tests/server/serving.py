# SPDX-License-Identifier: Apache-2.0
"""Starts the program for the tests in this folder, and speaks HTTP with it."""
import json
import os
import re
import signal
import struct
import subprocess
import tempfile
import unittest
import urllib.error
import urllib.request

PROGRAM = os.environ["SCOLOPAX"]
# The device on which the servers of these tests render.
DEVICE = os.environ.get("SCOLOPAX_TEST_DEVICE", "cpu")


def write_volume(folder, name="blob", size=16, channels=("a", "b")):
    """Writes one u8 raw file per channel: a ball, and a box of half its value."""
    paths = []
    for c, channel in enumerate(channels):
        voxels = bytearray(size**3)
        for z in range(size):
            for y in range(size):
                for x in range(size):
                    d = sum((v - size / 2) ** 2 for v in (x, y, z)) ** 0.5
                    inside = d < size / 3 if c == 0 else max(abs(v - size / 2) for v in (x, y, z)) < size / 4
                    voxels[x + size * (y + size * z)] = (200 if c == 0 else 100) if inside else 0
        path = os.path.join(folder, f"{name}_{channel}_{size}x{size}x{size}_uint8.raw")
        with open(path, "wb") as file:
            file.write(voxels)
        paths.append(path)
    return paths


class CommandTest(unittest.TestCase):
    """Runs the program in a folder with a volume."""

    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.data = write_volume(self.folder.name)

    def path(self, name):
        return os.path.join(self.folder.name, name)

    @staticmethod
    def run_command(command, *options):
        return subprocess.run([PROGRAM, command, *options], capture_output=True, text=True, timeout=300)


class Server:
    """`with Server("--max-sessions", "2") as server:` runs on a free loopback port and is ended by SIGTERM. `tls`: the
    client's context for a server with a certificate."""

    def __init__(self, *options, environment=None, paths=None, port=True, tls=None, device=DEVICE):
        self.tls = tls
        self.folder = tempfile.TemporaryDirectory()
        paths = write_volume(self.folder.name) if paths is None else paths
        command = [PROGRAM, "serve", *paths, *(["--port", "0"] if port else []), "--device", device,
                   *options]
        clean = {k: v for k, v in os.environ.items() if not k.startswith("SCOLOPAX_")}
        self.log = open(os.path.join(self.folder.name, "log"), "w+", encoding="utf-8")
        self.process = subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=self.log, text=True, env={**clean, **(environment or {})})
        self.ready = self.process.stdout.readline()
        found = re.search(("https" if tls else "http") + r"://127\.0\.0\.1:(\d+)/\?token=(\S+)", self.ready)
        if not found:
            self.process.wait()
            self.log.seek(0)
            raise AssertionError(f"no ready line but {self.ready!r}, log {self.log.read()!r}")
        self.port, self.token = int(found[1]), found[2]
        self.base = f"{'https' if tls else 'http'}://127.0.0.1:{self.port}"

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.stop()

    def stop(self, how=signal.SIGTERM):
        if how is not None and self.process.poll() is None:
            self.process.send_signal(how)
        status = self.process.wait(timeout=60)
        self.process.stdout.close()
        self.log.close()
        self.folder.cleanup()
        return status

    def call(self, method, path, body=None, headers=None, token=True):
        """(status, headers, body) of a call; a dict or list as body is sent as JSON."""
        headers = dict(headers or {})
        if token:
            headers.setdefault("Authorization", f"Bearer {self.token}")
        if isinstance(body, (dict, list)):
            body = json.dumps(body).encode()
            headers.setdefault("Content-Type", "application/json")
        request = urllib.request.Request(self.base + path, data=body, method=method, headers=headers)
        try:
            with urllib.request.urlopen(request, timeout=60, context=self.tls) as response:
                return response.status, response.headers, response.read()
        except urllib.error.HTTPError as error:
            with error:
                return error.code, error.headers, error.read()

    def json(self, method, path, body=None, headers=None):
        status, _, answer = self.call(method, path, body, headers)
        return status, json.loads(answer)


HEADER = struct.Struct("<4sHHBBHHHIIIIfIII")
NAMES = ("magic version headerBytes codec flags width height zero frame revision patch samples error rebuildUs "
         "renderUs encodeUs").split()


def frame_header(message):
    return dict(zip(NAMES, HEADER.unpack_from(message)))
