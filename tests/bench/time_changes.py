#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""How long a change of time takes, from the patch to the frame that shows it: plays a series of STEPS generated steps of
SIZE^3 voxels, in memory, at 512 x 512. Usage: SCOLOPAX=build/release/scolopax time_changes.py [--size N] [--steps N]"""
import argparse
import asyncio
import math
import os
import statistics
import sys
import tempfile
import time

sys.path.insert(0, os.path.join(os.path.dirname(__file__), "..", "server"))
from protocol_client import Viewer  # noqa: E402
from serving import Server  # noqa: E402


def write_series(path, size, steps):
    """A blob that turns around the middle of the volume."""
    with open(path, "wb") as file:
        file.write(f"NRRD0004\ntype: uint8\ndimension: 4\nsizes: {size} {size} {size} {steps}\n"
                   "kinds: domain domain domain time\nencoding: raw\n\n".encode())
        for step in range(steps):
            angle = 2 * math.pi * step / steps
            x0, y0 = size * (0.5 + 0.25 * math.cos(angle)), size * (0.5 + 0.25 * math.sin(angle))
            rows = [[math.exp(-((x - x0) ** 2 + (y - y0) ** 2) / (size / 6) ** 2) for x in range(size)]
                    for y in range(size)]
            for z in range(size):
                share = 255 * math.exp(-(((z - size / 2) / (size / 4)) ** 2))
                file.write(bytes(int(share * v) for row in rows for v in row))


async def measure(server, rounds, steps):
    status, session = server.json("POST", "/api/v1/sessions", {"scene": {"image": {"width": 512, "height": 512}}})
    if status != 201:
        raise AssertionError(session)
    first, later = [], []
    async with Viewer(server, session) as viewer:
        await viewer.frame()
        for turn in range(rounds):
            for step in range(steps):
                begin = time.monotonic()
                patch = await viewer.patch({"time": step})
                await viewer.frame(lambda frame, patch=patch: frame.patch >= patch)
                (later if turn > 0 else first).append(1000 * (time.monotonic() - begin))
    return first, later


def told(name, values):
    values = sorted(values)
    print(f"{name}: median {statistics.median(values):.0f} ms, p95 {values[int(0.95 * (len(values) - 1))]:.0f} ms, "
          f"most {values[-1]:.0f} ms, {len(values)} changes")


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--size", type=int, default=64)
    parser.add_argument("--steps", type=int, default=12)
    parser.add_argument("--rounds", type=int, default=5)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "series.nrrd")
        write_series(path, options.size, options.steps)
        with Server(paths=[path]) as server:
            first, later = asyncio.run(measure(server, options.rounds, options.steps))
    told("first round, loaded in advance", first)
    told("in memory", later)


if __name__ == "__main__":
    main()
