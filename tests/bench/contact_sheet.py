#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""One scene in the four blend modes (columns), unlit and lit (rows), as one picture: contact_sheet.py OUT.jpg"""
import os
import subprocess
import sys
import tempfile

HERE = os.path.dirname(os.path.abspath(__file__))
PROGRAM = os.environ.get("SCOLOPAX", os.path.join(HERE, "../../build/release/scolopax"))


def main(out):
    with tempfile.TemporaryDirectory() as folder:
        data = os.path.join(folder, "orbitals.nrrd")
        subprocess.run([PROGRAM, "generate", "orbitals", data], check=True)
        pictures = []
        for light in ("false", "true"):
            for blend in ("density", "max", "mix", "composite"):
                pictures.append(os.path.join(folder, f"{light}-{blend}.png"))
                subprocess.run(
                    [PROGRAM, "render", os.path.join(HERE, "scenes/orbitals.json"), "--data", data, "-o", pictures[-1],
                     "--samples", "160", "--set", f"blend.mode={blend}", "--set", f"shading={light}",
                     "--set", f"shadows={light}"], check=True)
        # oiiotool, from Debian's openimageio-tools, places pictures side by side.
        subprocess.run(["oiiotool", *pictures, "--mosaic:pad=4", "4x2", "--nosoftwareattrib", "--compression", "jpeg:88", "-o", out],
                       check=True)


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main(sys.argv[1])
