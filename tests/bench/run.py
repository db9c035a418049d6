#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Measures everything in the report, into one JSON file for report.py; experiments.py lists the experiments."""
import argparse
import json
import os
import sys
import time

from common import Bench, processor, scratch
from experiments import EXPERIMENTS


def main():
    parser = argparse.ArgumentParser(description=__doc__, epilog="Scenes whose data are not there are left out with a message. "
                                     "Reads SCOLOPAX (the program) and SCOLOPAX_DATA_DIR.")
    parser.add_argument("out", metavar="OUT.json", help="written after every experiment; what is there of others is kept")
    parser.add_argument("experiments", nargs="*", metavar="EXPERIMENT", help=f"of {', '.join(EXPERIMENTS)}; all without any")
    parser.add_argument("--quick", action="store_true", help="small pictures, few scenes: tests the scripts, measures nothing")
    parser.add_argument("--truths", metavar="FOLDER",
                        help="keep the reference's pictures there and use those that are; empty it when the reference changes")
    options = parser.parse_intermixed_args()
    if unknown := set(options.experiments) - set(EXPERIMENTS):
        parser.error(f"there is no experiment {unknown.pop()}")
    measured = {}
    if os.path.exists(options.out):
        with open(options.out, encoding="utf-8") as file:
            measured = json.load(file)
    with scratch() as folder:
        bench = Bench(folder, options.truths, options.quick)
        for name in options.experiments or EXPERIMENTS:
            begin = time.monotonic()
            print(name, file=sys.stderr, flush=True)
            found = EXPERIMENTS[name](bench)
            measured[name] = {"machine": processor(), "quick": options.quick, "seconds": time.monotonic() - begin,
                              "side": bench.side, "truthSide": bench.truth_side, "found": found}
            print(f"{name}: {measured[name]['seconds']:.0f} s", file=sys.stderr, flush=True)
            with open(options.out + ".part", "w", encoding="utf-8") as file:
                json.dump(measured, file)
            os.replace(options.out + ".part", options.out)


if __name__ == "__main__":
    main()
