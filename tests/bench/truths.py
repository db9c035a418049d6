# SPDX-License-Identifier: Apache-2.0
"""The reference's pictures, from which errors are counted. They take long, so they are kept in a folder."""
import glob
import json
import os
import subprocess

from store import content_hash, key_hash

HERE = os.path.dirname(os.path.abspath(__file__))
# Errors of 1e-5 are measured. Without light, the reference's own tolerance is smaller still.
TOLERANCE, LIT_TOLERANCE = 1e-7, 1e-6


def reference_version():
    """Hash of the reference's source."""
    files = sorted(glob.glob(os.path.join(HERE, "../../renderer/reference/*.*")))
    return key_hash([content_hash(path) for path in files])


def is_lit(scene, settings):
    return any(settings.get(field, scene.get(field, False)) for field in ("shading", "shadows"))


class Truths:
    """`program` renders them into `folder`."""

    def __init__(self, program, folder):
        self.program, self.folder = program, folder
        os.makedirs(folder, exist_ok=True)

    def picture(self, scene, data, settings, samples_per_axis=1, every=1):
        """Path of the reference's picture of a scene file with `settings` (of paths of fields, the size and the filter
        among them). Every so many pixels along x and along y, as in `scolopax reference`."""
        with open(scene, encoding="utf-8") as file:
            text = file.read()
        tolerance = LIT_TOLERANCE if is_lit(json.loads(text), settings) else TOLERANCE
        key = {"scene": text, "data": [content_hash(path) for path in data], "settings": settings, "tolerance": tolerance,
               "samplesPerAxis": samples_per_axis, "every": every, "reference": reference_version()}
        out = os.path.join(self.folder, key_hash(key) + ".exr")
        if not os.path.exists(out):
            # Under another name until it is complete.
            part = os.path.join(self.folder, f"part-{os.getpid()}.exr")
            subprocess.run([self.program, "reference", scene, "--data", *data, "-o", part, "--tolerance", str(tolerance),
                            "--samples-per-axis", str(samples_per_axis), "--every", str(every), *assignments(settings)],
                           check=True, stdout=subprocess.DEVNULL)
            os.replace(part, out)
        return out


def assignments(settings):
    """Arguments of the program that set fields of the scene."""
    return [word for path, value in settings.items() for word in ("--set", f"{path}={json.dumps(value)}")]
