#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Checks that a change affects no picture. Before and after it: gate.py record OUT.json; then:
gate.py compare OLD.json NEW.json

`record` hashes float pictures of every scene in every blend mode, light and method, on every instruction set that this
processor has; `compare` lists the pictures that differ. The scene `features` has every field that the scenes of the
report do not have. Reads SCOLOPAX, SCOLOPAX_DATA_DIR; fails if a scene's data is missing."""
import argparse
import hashlib
import http.client
import itertools
import json
import os
import sys

HERE = os.path.dirname(os.path.abspath(__file__))
os.environ.setdefault("SCOLOPAX", os.path.join(HERE, "../../build/release/scolopax"))
sys.path[:0] = [HERE, os.path.join(HERE, "../server")]
import serving  # noqa: E402
from common import LIGHTS, SCENES, Bench, scratch  # noqa: E402

BLENDS = ("density", "max", "mix", "composite")
# Each with its flag in /proc/cpuinfo. Without the flag, the program would silently use the previous one.
INSTRUCTIONS = {"baseline": None, "avx2": "avx2", "avx512": "avx512f"}
SIZE = {"width": 40, "height": 31}  # not a multiple of tiles or packets


def hashes(name, files, instructions, methods):
    """{"blend light method": hash of the EXR picture} for one scene."""
    with open(Bench.scene(name), encoding="utf-8") as file:
        scene = json.load(file)
    found = {}
    with serving.Server(paths=files, environment={"SCOLOPAX_INSTRUCTIONS": instructions}) as server:
        connection = http.client.HTTPConnection("127.0.0.1", server.port)
        for blend, light, method in itertools.product(BLENDS, LIGHTS, methods):
            shading, shadows = LIGHTS[light]
            body = {**scene, "image": {**scene.get("image", {}), **SIZE}, "blend": {"mode": blend}, "shading": shading,
                    "shadows": shadows, "stop": {"samples": 2},
                    "integrator": {**scene.get("integrator", {}), "method": method}}
            connection.request("POST", "/api/v1/render", json.dumps(body),
                               {"Authorization": f"Bearer {server.token}", "Accept": "image/x-exr",
                                "Content-Type": "application/json"})
            answer = connection.getresponse()
            picture = answer.read()
            if answer.status != 200:
                raise RuntimeError(f"{name} {blend} {light} {method}: {answer.status} {picture[:200]!r}")
            found[f"{blend} {light} {method}"] = hashlib.sha256(picture).hexdigest()[:16]
    return found


def present_instructions():
    with open("/proc/cpuinfo", encoding="utf-8") as file:
        flags = next(line.split() for line in file if line.startswith("flags"))
    return [name for name, flag in INSTRUCTIONS.items() if flag is None or flag in flags]


def methods_of(files):
    with serving.Server(paths=files) as server:
        connection = http.client.HTTPConnection("127.0.0.1", server.port)
        connection.request("GET", "/api/v1/capabilities", headers={"Authorization": f"Bearer {server.token}"})
        return [method["name"] for method in json.load(connection.getresponse())["methods"]]


def record(out, scenes):
    result = {}
    with scratch() as folder:
        bench = Bench(folder, None, quick=False)
        methods = methods_of(bench.orbitals())
        for name in scenes:
            files = bench.orbitals(size=48) if name == "features" else bench.data(name)
            if files is None:
                sys.exit(f"{name} cannot be recorded; leave it out with --scenes")
            for instructions in present_instructions():
                result[f"{name} {instructions}"] = hashes(name, files, instructions, methods)
                print(f"{name} {instructions}: {len(result[f'{name} {instructions}'])} pictures", file=sys.stderr)
    with open(out, "w", encoding="utf-8") as file:
        json.dump(result, file, indent=1)


def compare(before, after):
    """The number of pictures that differ or that only one file has."""
    with open(before, encoding="utf-8") as a, open(after, encoding="utf-8") as b:
        old, new = json.load(a), json.load(b)
    rows = [({f"{scene}: {picture}": bits for scene, found in side.items() for picture, bits in found.items()})
            for side in (old, new)]
    names = sorted(rows[0].keys() | rows[1].keys())
    different = [name for name in names if rows[0].get(name) != rows[1].get(name)]
    print(f"{len(names)} pictures, {len(different)} differ")
    for name in different[:40]:
        print(f"  {name}")
    return len(different)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(dest="command", required=True)
    recording = commands.add_parser("record", help="hash the pictures of a program")
    recording.add_argument("out")
    recording.add_argument("--scenes", default=",".join((*SCENES, "features")), help="names, separated by commas")
    comparing = commands.add_parser("compare", help="list the pictures that differ")
    comparing.add_argument("before")
    comparing.add_argument("after")
    options = parser.parse_args()
    if options.command == "record":
        record(options.out, options.scenes.split(","))
        return 0
    return compare(options.before, options.after) > 0


if __name__ == "__main__":
    sys.exit(main())
