#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Compares the speed of two builds: paired.py OLD NEW [--scenes a,b] [--lights emission-absorption,both]

The two programs take turns at `scolopax bench --times-only`. For every scene, light and method it prints the median,
smallest and largest of the ratios new / old of paired runs. Reads SCOLOPAX_DATA_DIR."""
import argparse
import json
import os
import statistics
import subprocess
import sys

sys.path[:0] = [os.path.dirname(os.path.abspath(__file__))]
from common import LIGHTS, SCENES, Bench, assignments, light_settings, scratch  # noqa: E402


def seconds(program, scene, files, out, settings, options):
    """{(method, step): median seconds per sample}."""
    words = [program, "bench", scene, "--data", *files, "--json", out, "--times-only", "--samples", str(options.samples),
             "--steps", options.steps, "--repetitions", "3", "--threads", "1"]
    if options.methods:
        words += ["--methods", options.methods]
    subprocess.run(words + assignments(settings), check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    with open(out, encoding="utf-8") as file:
        return {(point["method"], point.get("step") or 0): point["seconds"] for point in json.load(file)["points"]}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("old")
    parser.add_argument("new")
    parser.add_argument("--scenes", default=",".join(SCENES))
    parser.add_argument("--lights", default=",".join(LIGHTS))
    parser.add_argument("--methods", default="", help="all without this")
    parser.add_argument("--steps", default="1")
    parser.add_argument("--samples", type=int, default=2)
    parser.add_argument("--side", type=int, default=128)
    parser.add_argument("--pairs", type=int, default=5)
    options = parser.parse_args()
    with scratch() as folder:
        bench = Bench(folder, None, quick=False)
        for name in options.scenes.split(","):
            files = bench.data(name)
            for light in options.lights.split(",") if files else ():
                settings = {**light_settings(light), "image.width": options.side, "image.height": options.side}
                ratios = {}
                for pair in range(options.pairs):
                    sides = {}
                    for program in (options.old, options.new) if pair % 2 else (options.new, options.old):
                        sides[program] = seconds(program, bench.scene(name), files, bench.path("paired.json"), settings, options)
                    for key, old in sides[options.old].items():
                        ratios.setdefault(key, []).append(sides[options.new][key] / old)
                for (method, step), found in ratios.items():
                    print(f"{name:9} {light:20} {method:11} {step:5g}  {statistics.median(found):6.3f}  "
                          f"({min(found):.3f} to {max(found):.3f})", flush=True)


if __name__ == "__main__":
    sys.exit(main())
