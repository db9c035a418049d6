#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Measures every scene in the four configurations of the paper's Figure 8: run.py OUT.json [SCENE...]

Scenes whose data are not there are left out with a message. Reads SCOLOPAX (the program), SCOLOPAX_DATA_DIR."""
import json
import os
import platform
import subprocess
import sys
import tempfile

HERE = os.path.dirname(os.path.abspath(__file__))
PROGRAM = os.environ.get("SCOLOPAX", os.path.join(HERE, "../../build/release/scolopax"))
DATA = os.environ.get("SCOLOPAX_DATA_DIR", os.path.join(HERE, "../../../shared/data"))
CONFIGURATIONS = {"emission-absorption": (False, False), "shading": (True, False), "shadows": (False, True),
                  "both": (True, True)}

TCGA = "multichannel/tcga_du_7294/TCGA-DU-7294_"
# Files below the data folder; a number is that many generated orbitals.
SCENES = {
    "orbitals": 4,
    "tcga": [f"{TCGA}{name}_bet.nii.gz" for name in ("fla", "t1", "t1c", "t2")],
    "stroke": [f"multichannel/stroke_mri/{name}.nii.gz" for name in ("FLAIR", "T1", "T2")],
    "cells": ["multichannel/tiff/xyzc_16bit__spots.tif"],
    "heptane": ["scalar/heptane.nii.gz"],
    "bonsai": ["scalar/bonsai.nii.gz"],
    "many": 12,
}


def processor():
    with open("/proc/cpuinfo", encoding="utf-8") as file:
        names = [line.split(":")[1].strip() for line in file if line.startswith("model name")]
    return f"{names[0]}, {len(names)} threads" if names else platform.processor()


def measure(name, folder):
    source = SCENES[name]
    if isinstance(source, int):
        data = [os.path.join(folder, f"{name}.nrrd")]
        subprocess.run([PROGRAM, "generate", "orbitals", data[0], "--channels", str(source)], check=True)
    else:
        data = [os.path.join(DATA, file) for file in source]
        missing = [file for file in data if not os.path.exists(file)]
        if missing:
            print(f"{name}: left out, there is no {missing[0]}", file=sys.stderr)
            return None
    scene, out = os.path.join(HERE, f"scenes/{name}.json"), os.path.join(folder, "out.json")
    results = {}
    for configuration, (shading, shadows) in CONFIGURATIONS.items():
        print(f"{name}, {configuration}", file=sys.stderr)
        subprocess.run([PROGRAM, "bench", *([scene] if os.path.exists(scene) else []), "--data", *data, "--json", out,
                        "--set", "image.width=96", "--set", "image.height=96", "--samples", "1,16,64",
                        "--set", f"shading={json.dumps(shading)}", "--set", f"shadows={json.dumps(shadows)}"], check=True)
        with open(out, encoding="utf-8") as file:
            results[configuration] = json.load(file)
    return results


def main(out, names):
    with tempfile.TemporaryDirectory() as folder:
        scenes = {name: measure(name, folder) for name in names or SCENES}
    with open(out, "w", encoding="utf-8") as file:
        json.dump({"machine": processor(), "scenes": {name: found for name, found in scenes.items() if found}}, file)


if __name__ == "__main__":
    unknown = [name for name in sys.argv[2:] if name not in SCENES]
    if len(sys.argv) < 2 or unknown:
        sys.exit(f"{__doc__}\nScenes: {', '.join(SCENES)}" + (f"; there is no {unknown[0]}" if unknown else ""))
    main(sys.argv[1], sys.argv[2:])
