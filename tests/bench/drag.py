#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Measures how smooth a drag is: drag.py [PROGRAM...]

Rotates the four-channel MRI (tcga) at 944x770 with 60 edits a second. Prints, as JSON, pictures per second, their
widths and the milliseconds from an edit to its picture: medians of the rounds, and their ratios to the first program's.
Several programs take turns, so that other load on the machine affects all alike. Reads SCOLOPAX, SCOLOPAX_DATA_DIR,
LATENCY_SECONDS, DRAG_ROUNDS."""
import asyncio
import json
import os
import sys

import latency
from common import DATA, PROGRAM, SCENES, median
from latency import quantile, serving

SIZE = 944, 770
ROUNDS = int(os.environ.get("DRAG_ROUNDS", "5"))


def drag(program):
    serving.PROGRAM = program
    with serving.Server(paths=[os.path.join(DATA, file) for file in SCENES["tcga"]]) as server:
        rows = asyncio.run(latency.measure(server, "camera", 60, 1, False, False, SIZE))
    newest = [row for row in rows if row["newest"]]
    times, widths = [row["ms"] for row in rows], [row["width"] for row in newest]
    return {"pictures/s": len(newest) / latency.SECONDS, "width p5": quantile(widths, .05),
            "width p50": quantile(widths, .5), "p50 ms": quantile(times, .5), "p95 ms": quantile(times, .95)}


def main(programs):
    rounds = {program: [] for program in programs}
    for _ in range(ROUNDS):
        for program in programs:
            rounds[program].append(drag(program))
            print(json.dumps({"program": program} | rounds[program][-1]), file=sys.stderr)
    medians = {program: {name: median([one[name] for one in found]) for name in found[0]}
               for program, found in rounds.items()}
    first = medians[programs[0]]
    for program, found in medians.items():
        ratios = {name: round(value / first[name], 2) for name, value in found.items()}
        print(json.dumps({"program": program, "load": os.getloadavg()[0], "medians": found, "to the first": ratios}))


if __name__ == "__main__":
    main([os.path.abspath(program) for program in sys.argv[1:] or [PROGRAM]])
