#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Tables of what run.py has measured, as Markdown: report.py IN.json > OUT.md"""
import json
import sys


def table(header, rows):
    lines = ["| " + " | ".join(header) + " |", "|" + "---|" * len(header)]
    return "\n".join(lines + ["| " + " | ".join(row) + " |" for row in rows]) + "\n"


def seconds(value):
    return "-" if value is None else f"{value:.3g} s"


def times(scenes):
    """Time to an error, and how many times less that is than sync-dda's."""
    rows = []
    for scene, configurations in scenes.items():
        for configuration, found in configurations.items():
            by_method = {row["method"]: row for row in found["timeToError"]}
            for target in ("secondsToRmse0.01", "secondsToRmse0.001"):
                yardstick = by_method["sync-dda"][target]
                cells = []
                for method in ("sync-dda", "superposed", "cumulative", "n-dda", "raymarch"):
                    value = by_method[method][target]
                    cells.append(seconds(value) + (f" (x{yardstick / value:.3g})" if value and method != "sync-dda" else ""))
                rows.append([scene, configuration, target.removeprefix("secondsToRmse"), *cells])
    return table(["scene", "light", "RMSE", "sync-dda", "superposed", "cumulative", "n-dda", "raymarch"], rows)


def counts(scenes):
    """What does not depend on the machine, at the largest number of samples or the step of one voxel."""
    rows = []
    for scene, configurations in scenes.items():
        for configuration, found in configurations.items():
            most = max(point["samples"] for point in found["points"])
            for point in found["points"]:
                if point["step"] == 1 or (point["step"] is None and point["samples"] == most):
                    rows.append([scene, configuration, point["method"], f"{point['nsPerRay']:.0f}", f"{point['rmse']:.2e}",
                                 f"{point['flip']:.4f}", f"{point['bias']:.1e}", f"{point['fetchesPerRay']:.2f}",
                                 f"{point['cellStepsPerRay']:.1f}", f"{point['randomBlocksPerRay']:.2f}"])
    return table(["scene", "light", "method", "ns/ray", "RMSE", "FLIP", "bias", "fetches/ray", "cells/ray", "randoms/ray"],
                 rows)


def main(path):
    with open(path, encoding="utf-8") as file:
        measured = json.load(file)
    image = next(iter(next(iter(measured["scenes"].values())).values()))["scene"]["image"]
    print(f"# Speed against error\nMachine: {measured['machine']}. Pictures of {image['width']}x{image['height']} through "
          "pixel centres, errors against the "
          "double-precision\nreference. Made by `tests/bench/run.py out.json` and `tests/bench/report.py out.json`.\n\n"
          "## Time to an error\nOf trackers by the law of their noise from the most samples measured; of the marcher by "
          "its fastest step\nthat is good enough (-: none of 4, 2, 1, 0.5 is). In brackets: how many times less than "
          f"sync-dda in the same run.\n\n{times(measured['scenes'])}\n## Counts and errors\n{counts(measured['scenes'])}",
          end="")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main(sys.argv[1])
