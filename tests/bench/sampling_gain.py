#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Measures how much low-discrepancy sampling reduces the squared error: sampling_gain.py DATA... prints a table.

The error of N samples is that against 8192 low-discrepancy samples with another seed, mean over several seeds. The
error of those 8192 adds at most 256 / 8192 of the measured error, the same to both columns."""
import json
import os
import subprocess
import sys
import tempfile

PROGRAM = os.environ.get("SCOLOPAX",
                         os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../build/release/scolopax"))
SIZE = 96


def render(data, out, samples, seed, sampling, method):
    subprocess.run([PROGRAM, "render", "--data", *data, "-o", out, "--samples", str(samples),
                    "--set", f"integrator.seed={seed}", "--set", f"integrator.sampling={sampling}",
                    "--set", f"integrator.method={method}",
                    "--set", f"image.width={SIZE}", "--set", f"image.height={SIZE}"], check=True)


def squared_error(a, b):
    out = subprocess.run([PROGRAM, "compare", a, b, "--json"], check=True, capture_output=True, text=True).stdout
    return json.loads(out)["rmse"] ** 2


def main(data):
    print("| method | samples | independent, MSE | low-discrepancy, MSE | gain |\n|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        truth, picture = os.path.join(folder, "truth.exr"), os.path.join(folder, "picture.exr")
        for method in ("superposed", "sync-dda"):
            render(data, truth, 8192, 4000000000, "low-discrepancy", method)
            for samples in (1, 4, 16, 64, 256):
                mean = {}
                seeds = range(1, 1 + max(2, min(16, 256 // samples)))
                for sampling in ("independent", "low-discrepancy"):
                    errors = []
                    for seed in seeds:
                        render(data, picture, samples, seed, sampling, method)
                        errors.append(squared_error(picture, truth))
                    mean[sampling] = sum(errors) / len(errors)
                print(f"| {method} | {samples} | {mean['independent']:.2e} | {mean['low-discrepancy']:.2e} "
                      f"| {mean['independent'] / mean['low-discrepancy']:.2f} |", flush=True)


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    main(sys.argv[1:])
