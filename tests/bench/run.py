#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Measures everything in the report, into one JSON file for report.py; experiments.py lists the experiments.

Every measurement is also kept in the folder OUT.json.parts, one file each. What was measured with the same program, scene,
data and settings on the same machine is taken from there, so that a run that was interrupted continues where it stopped;
--again measures anew. Leave the machine alone meanwhile: times are only comparable if nothing else runs."""
import argparse
import json
import os
import sys
import textwrap

from common import PROGRAM, Bench, processor, scratch
from experiments import EXPERIMENTS
from store import Store, content_hash, write_json


def experiments_help():
    """A line for each experiment: what it measures, and for how long."""
    lines = [line for name, experiment in EXPERIMENTS.items()
             for line in textwrap.wrap(f"{name} ({experiment.takes}): {' '.join(experiment.run.__doc__.split())}", 118,
                                       initial_indent="  ", subsequent_indent="    ")]
    return "\n".join(["experiments, and how long they take on two quiet cores with the reference's pictures:", *lines, "",
                      "Scenes whose data are absent are left out with a message. Reads SCOLOPAX (the program) and "
                      "SCOLOPAX_DATA_DIR."])


def main():
    parser = argparse.ArgumentParser(description=__doc__, epilog=experiments_help(),
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", metavar="OUT.json", help="written after every experiment; what it has of others is kept")
    parser.add_argument("experiments", nargs="*", metavar="EXPERIMENT", help="all without any")
    parser.add_argument("--quick", action="store_true", help="small pictures, few scenes: tests the scripts, measures nothing")
    parser.add_argument("--again", action="store_true", help="measure anew what has been measured before")
    parser.add_argument("--longest", type=float, default=600, metavar="SECONDS",
                        help="time limit for a picture of `auto` in speed (default: 600); the experiment may take 100 times as long")
    parser.add_argument("--truths", metavar="FOLDER",
                        help="where the reference's pictures are kept (default: in OUT.json.parts); others may use them, too")
    options = parser.parse_intermixed_args()
    if unknown := set(options.experiments) - set(EXPERIMENTS):
        parser.error(f"there is no experiment {unknown.pop()}")
    measured = {}
    if os.path.exists(options.out):
        with open(options.out, encoding="utf-8") as file:
            measured = json.load(file)
    parts = options.out + ".parts"
    store = Store(parts, options.again)
    with scratch() as folder:
        bench = Bench(folder, options.truths or os.path.join(parts, "truths"), options.quick, store, options.longest)
        for name in options.experiments or EXPERIMENTS:
            measure(bench, name, measured, options.out)


def measure(bench, name, measured, out):
    """Adds an experiment to `measured` and writes that to `out`, already while it is underway."""
    def save(found, complete=False):
        measured[name] = {"machine": processor(), "program": content_hash(PROGRAM), "quick": bench.quick,
                          "complete": complete, "seconds": bench.store.seconds, "side": bench.side,
                          "truthSide": bench.truth_side, "found": found}
        write_json(out, measured)

    print(name, file=sys.stderr, flush=True)
    bench.store.reset()
    bench.save = save
    save(EXPERIMENTS[name].run(bench), complete=True)
    print(f"{name}: {measured[name]['seconds']:.0f} s", file=sys.stderr, flush=True)


if __name__ == "__main__":
    main()
