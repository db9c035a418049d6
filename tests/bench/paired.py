#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Compares the speed of two builds: paired.py OLD NEW [--scenes a,b] [--lights emission-absorption,both]

The two programs take turns at `scolopax bench --times-only`. For every scene, light and method it prints the median,
smallest and largest of the ratios new / old of paired runs. With the same program twice, --old-instructions baseline
compares packets of rays with single rays. Reads SCOLOPAX_DATA_DIR."""
import argparse
import json
import os
import statistics
import subprocess
import sys

sys.path[:0] = [os.path.dirname(os.path.abspath(__file__))]
from common import LIGHTS, SCENES, Bench, light_settings, scratch  # noqa: E402
from truths import assignments  # noqa: E402


def seconds(program, instructions, scene, files, out, settings, options):
    """{(method, step): median seconds per sample}."""
    words = [program, "bench", scene, "--data", *files, "--json", out, "--times-only", "--samples", str(options.samples),
             "--steps", options.steps, "--repetitions", "3", "--threads", "1"]
    if options.methods:
        words += ["--methods", options.methods]
    environment = {**os.environ, "SCOLOPAX_INSTRUCTIONS": instructions} if instructions else None
    subprocess.run(words + assignments(settings), check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                   env=environment)
    with open(out, encoding="utf-8") as file:
        return {(point["method"], point.get("step") or 0): point["seconds"] for point in json.load(file)["points"]}


def ratios(bench, name, files, settings, options):
    """{(method, step): ratios new / old of paired runs}."""
    found = {}
    for pair in range(options.pairs):
        sides = {}
        for side in ("old", "new") if pair % 2 else ("new", "old"):
            program, instructions = (options.old, options.old_instructions) if side == "old" else (options.new, "")
            sides[side] = seconds(program, instructions, bench.scene(name), files, bench.path("paired.json"), settings, options)
        for key, old in sides["old"].items():
            found.setdefault(key, []).append(sides["new"][key] / old)
    return found


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
    parser.add_argument("--blends", default="", help="blend modes instead of the scenes' own, separated by commas")
    parser.add_argument("--old-instructions", default="", help="baseline or avx2: an upper limit for OLD")
    options = parser.parse_args()
    with scratch() as folder:
        bench = Bench(folder, None, quick=False)
        for name in options.scenes.split(","):
            files = bench.data(name)
            for light in options.lights.split(",") if files else ():
                for blend in options.blends.split(","):
                    settings = {**light_settings(light), "image.width": options.side, "image.height": options.side,
                                **({"blend.mode": blend} if blend else {})}
                    for (method, step), found in ratios(bench, name, files, settings, options).items():
                        print(f"{name:9} {light:20} {blend:9} {method:11} {step:5g}  {statistics.median(found):6.3f}  "
                              f"({min(found):.3f} to {max(found):.3f})", flush=True)


if __name__ == "__main__":
    sys.exit(main())
