#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Measures how long an edit takes to appear: latency.py OUT.json [CLIENTS...], and latency.py --report IN.json > OUT.md

Times are from sending a patch to receiving the first frame whose header says that it contains the patch. All clients
are one process on the same machine; its own time is included. Reads SCOLOPAX, SCOLOPAX_DATA_DIR."""
import asyncio
import json
import math
import os
import sys
import time

HERE = os.path.dirname(os.path.abspath(__file__))
os.environ.setdefault("SCOLOPAX", os.path.join(HERE, "../../build/release/scolopax"))
sys.path[:0] = [HERE, os.path.join(HERE, "../server")]
import protocol_client  # noqa: E402
import serving  # noqa: E402
from common import DATA, SCENES, processor  # noqa: E402

SECONDS = float(os.environ.get("LATENCY_SECONDS", "6"))
SIZE = 512
RATES = {"10 a second": 10, "60 a second": 60, "as fast as answered": None}
CLIENTS = (1, 4, 16)


def camera(step, volume):
    """An orbit of 2 degrees a step, like a drag."""
    centre, distance = volume
    angle = math.radians(2 * step)
    eye = [centre[0] + distance * math.sin(angle), centre[1] - distance * math.cos(angle), centre[2]]
    return {"camera": {"eye": eye, "target": centre, "up": [0, 0, 1]}}


def curve(step, _):
    """Moves a point of the first channel's opacity curve back and forth."""
    return {"channels": {"0": {"opacity": [[0, 0], [0.3 + 0.2 * math.sin(0.2 * step), 0], [1, 1]]}}}


EDITS = {"camera": camera, "curve": curve}


class Client:
    """A viewer that records when each patch was sent, and when the first frame that contains it arrived."""

    def __init__(self, viewer, base=None):
        self.viewer, self.base = viewer, base  # base: revision before the first patch, to count others' patches
        self.sent, self.rows, self.answered, self.wake = {}, [], 0, asyncio.Event()

    async def read(self):
        while True:
            frame = await self.viewer.receive()
            if not isinstance(frame, protocol_client.Frame):
                if frame["type"] == "error":
                    raise AssertionError(frame)
                continue
            now = time.perf_counter()
            contained = frame.patch if self.base is None else max(0, frame.revision - self.base)
            for patch in range(self.answered + 1, contained + 1):
                self.rows.append({"ms": 1000 * (now - self.sent[patch]), "newest": patch == contained,
                                  "rebuild": frame.rebuildUs / 1000, "render": frame.renderUs / 1000,
                                  "encode": frame.encodeUs / 1000, "width": frame.width})
            self.answered = max(self.answered, contained)
            self.viewer.frames = self.viewer.frames[-1:]
            self.wake.set()

    async def edit(self, make, volume, rate, phase):
        await asyncio.sleep(phase)
        begin = time.perf_counter()
        while time.perf_counter() < begin + SECONDS:
            step = self.viewer.patches + 1
            self.sent[step] = time.perf_counter()
            await self.viewer.patch(make(step, volume))
            if rate:
                await asyncio.sleep(max(0, begin + step / rate - time.perf_counter()))
            else:
                while self.answered < step:
                    self.wake.clear()
                    await self.wake.wait()
        while self.answered < self.viewer.patches:
            self.wake.clear()
            await self.wake.wait()


async def measure(server, edit, rate, clients, shared, stalled, size=(SIZE, SIZE)):
    """Rows of all clients. `shared`: all view one session, which the first one edits."""
    width, height = size
    sessions, viewers = [], []
    for _ in range(1 if shared else clients):
        status, session = protocol_client.call_json(
            server, "POST", "/api/v1/sessions", {"scene": {"image": {"width": width, "height": height}}})
        if status != 201:
            raise AssertionError(session)
        sessions.append(session)
    cam = sessions[0]["scene"]["camera"]
    volume = cam["target"], math.dist(cam["eye"], cam["target"])
    for i in range(clients):
        viewers.append(await protocol_client.Viewer(server, sessions[i % len(sessions)]).__aenter__())
    if stalled:  # a viewer that never reads and never acknowledges
        viewers.append(await protocol_client.Viewer(server, sessions[0]).__aenter__())
    everyone = [Client(viewer, sessions[0]["revision"] if shared else None) for viewer in viewers[:clients]]
    for one in everyone[1:] if shared else []:
        one.sent = everyone[0].sent
    readers = [asyncio.create_task(one.read()) for one in everyone]
    await asyncio.sleep(1)
    editors = everyone[:1] if shared else everyone
    work = asyncio.gather(*(one.edit(EDITS[edit], volume, rate, 0.1 * i / len(editors))
                            for i, one in enumerate(editors)))
    done, _ = await asyncio.wait([work, *readers], return_when=asyncio.FIRST_COMPLETED, timeout=120)
    if not work.done():
        raise AssertionError(f"not every patch was answered: {[task.exception() for task in done]}")
    await work
    await asyncio.sleep(0.2)
    for reader in readers:
        reader.cancel()
    for viewer in viewers:
        viewer.socket.transport.abort()
    for session in sessions:
        protocol_client.call(server, "DELETE", f"/api/v1/sessions/{session['id']}")
    return [row for one in everyone for row in one.rows]


def quantile(values, q):
    ordered = sorted(values)
    return ordered[min(len(ordered) - 1, int(q * len(ordered)))]


def summary(rows):
    found = {name: quantile([row["ms"] for row in rows], q) for name, q in (("p50", .5), ("p95", .95), ("p99", .99))}
    newest = [row for row in rows if row["newest"]]
    for part in ("rebuild", "render", "encode", "width"):
        found[part] = quantile([row[part] for row in newest], .5)
    found["rest"] = quantile([row["ms"] - row["rebuild"] - row["render"] - row["encode"] for row in newest], .5)
    return found | {"patches": len(rows), "frames": len(newest)}


def cases(counts):
    for clients in counts:
        for shared in (False, True) if clients > 1 else (False,):
            for stalled in (False, True):
                for edit in EDITS:
                    for name, rate in RATES.items():
                        case = {"clients": clients, "shared": shared, "stalled": stalled, "edit": edit, "rate": name}
                        yield case, rate


def main(out, counts):
    paths = [os.path.join(DATA, file) for file in SCENES["tcga"]]
    results, load = [], os.getloadavg()[1]  # the load by other processes
    with serving.Server(paths=paths) as server:
        for case, rate in cases(counts):
            rows = asyncio.run(measure(server, case["edit"], rate, case["clients"], case["shared"], case["stalled"]))
            results.append(case | summary(rows))
            print(json.dumps(results[-1]), file=sys.stderr)
    with open(out, "w", encoding="utf-8") as file:
        json.dump({"machine": processor(), "load": load, "seconds": SECONDS, "size": SIZE, "results": results}, file)


def report(path):
    from sections import table  # needs matplotlib, which measuring does not

    with open(path, encoding="utf-8") as file:
        measured = json.load(file)
    rows = [[str(r["clients"]) + (" of one session" if r["shared"] else ""), "one more" if r["stalled"] else "-",
             r["edit"], r["rate"], *(f"{r[name]:.0f}" for name in ("p50", "p95", "p99")),
             *(f"{r[name]:.1f}" for name in ("rebuild", "render", "encode", "rest")), str(r["width"]),
             f"{r['frames'] / measured['seconds'] / r['clients']:.0f}"] for r in measured["results"]]
    header = ["clients", "stalled", "edit", "edits", "p50", "p95", "p99", "rebuild", "render", "encode", "rest", "width",
              "frames/s"]
    size = measured["size"]
    print(f"# From an edit to its picture\nMachine: {measured['machine']}, load average {measured['load']:.1f} before. "
          f"Four-channel MRI (tcga) at {size}x{size}.\nThe columns p50 to p99 are milliseconds from sending a patch to receiving "
          "the first frame that contains it. The next ones\nare medians: the times in that frame's header, the rest, its "
          "width, and the number of frames with a new edit that each\nclient got per second. All clients are one Python "
          "process on the same processors. Made by\n`tests/bench/latency.py out.json` and "
          "`tests/bench/latency.py --report out.json`.\n\n"
          "Interactive pictures are not denoised. On this scene (RMSE after cubic enlargement, 256x256, one sample a "
          "pixel)\na bilateral filter of 5x5 raises the marcher's error from 0.0027 to at least 0.0028. It lowers a tracker's "
          "error of 0.084\nonly as far as it ignores edges, to 0.026 as a plain blur. A marcher at a third of the width has a "
          f"smaller error (0.0050\nat 171x171).\n\n{table(header, rows)}", end="")


if __name__ == "__main__":
    if len(sys.argv) == 3 and sys.argv[1] == "--report":
        report(sys.argv[2])
    elif len(sys.argv) >= 2 and not sys.argv[1].startswith("-"):
        main(sys.argv[1], [int(count) for count in sys.argv[2:]] or CLIENTS)
    else:
        sys.exit(__doc__)
