# SPDX-License-Identifier: Apache-2.0
"""Shared by the experiments: program, scenes and their data, reference pictures, and calls of `scolopax bench`."""
import functools
import json
import os
import platform
import subprocess
import sys
import tempfile
import time

from store import Store, content_hash
from truths import Truths, assignments

HERE = os.path.dirname(os.path.abspath(__file__))
PROGRAM = os.environ.get("SCOLOPAX", os.path.join(HERE, "../../build/release/scolopax"))
DATA = os.environ.get("SCOLOPAX_DATA_DIR", os.path.join(HERE, "../../../shared/data"))
# The four light configurations of the paper's Figure 8: (shading, shadows).
LIGHTS = {"emission-absorption": (False, False), "shading": (True, False), "shadows": (False, True), "both": (True, True)}

TCGA = "multichannel/tcga_du_7294/TCGA-DU-7294_"
# Files relative to the data folder; a number means that many generated orbitals.
SCENES = {
    "orbitals": 4,
    "tcga": [f"{TCGA}{name}_bet.nii.gz" for name in ("fla", "t1", "t1c", "t2")],
    "stroke": [f"multichannel/stroke_mri/{name}.nii.gz" for name in ("FLAIR", "T1", "T2")],
    "cells": ["multichannel/tiff/xyzc_16bit__spots.tif"],
    "heptane": ["scalar/heptane.nii.gz"],
    "bonsai": ["scalar/bonsai.nii.gz"],
    "many": 12,
}
MULTICHANNEL = ("orbitals", "tcga", "stroke", "cells", "many")


def instructions(program=PROGRAM):
    """The vector instructions that the program uses here, "AVX-512" for example. An upper limit is set by
    SCOLOPAX_INSTRUCTIONS; if the processor has fewer, they are what it has."""
    told = subprocess.run([program, "info", "--devices"], check=True, stdout=subprocess.PIPE, text=True).stdout
    return told.splitlines()[0].split(", ", 1)[1]


@functools.lru_cache(maxsize=None)
def processor():
    """Model, threads and instructions."""
    with open("/proc/cpuinfo", encoding="utf-8") as file:
        names = [line.split(":")[1].strip() for line in file if line.startswith("model name")]
    name = f"{names[0]}, {len(names)} threads" if names else platform.processor()
    return f"{name}, {instructions()}"


def median(values):
    return sorted(values)[len(values) // 2]


def light_settings(light):
    return dict(zip(("shading", "shadows"), LIGHTS[light]))


class Bench:
    """Runs the program on scenes; its output goes to `folder`, reference pictures to `truths`, results to `store`."""

    def __init__(self, folder, truths=None, quick=False, store=None, longest=600):
        self.folder, self.quick, self.store = folder, quick, store or Store()
        self.truths = Truths(PROGRAM, truths or folder)
        # A reference picture has only every third pixel, because a ray takes seconds with shadows and many curves.
        self.side, self.truth_side = (48, 16) if quick else (96, 32)
        self.repetitions = 2 if quick else 3
        self.longest = longest  # seconds that a picture of `auto` may take
        self.scenes = [name for name in SCENES if not quick or name in ("orbitals", "cells", "bonsai")]
        self.lights = [light for light in LIGHTS if not quick or light in ("emission-absorption", "both")]
        self.save = lambda found: None  # called with what an experiment has found so far

    def path(self, name):
        return os.path.join(self.folder, name)

    def orbitals(self, channels=4, size=128):
        out = self.path(f"orbitals-{size}-{channels}.nrrd")
        if not os.path.exists(out):
            self.run("generate", "orbitals", out, "--channels", channels, "--size", size)
        return [out]

    def data(self, name):
        """Files of a scene; None, with a message, if one is missing."""
        if isinstance(SCENES[name], int):
            return self.orbitals(SCENES[name])
        return self.present(name, SCENES[name])

    @staticmethod
    def present(name, files):
        """Paths of files of the data folder; None, with a message, if one is missing."""
        paths = [os.path.join(DATA, file) for file in files]
        missing = [path for path in paths if not os.path.exists(path)]
        if missing:
            print(f"{name}: left out, there is no {missing[0]}", file=sys.stderr)
        return None if missing else paths

    @staticmethod
    def scene(name):
        return os.path.join(HERE, f"scenes/{name}.json")

    @staticmethod
    def run(*words):
        return subprocess.run([PROGRAM, *map(str, words)], check=True, stdout=subprocess.PIPE, text=True).stdout

    def kept(self, key, measure, program=PROGRAM):
        """The result of measure(), kept for the next run. The key must hold all that the result depends on, except the
        program and the machine."""
        return self.store.get({"program": content_hash(program), "machine": processor(), **key}, measure)

    def truth(self, scene, data, settings):
        """The reference's picture of a scene file with `settings`."""
        size = {"image.width": self.truth_side, "image.height": self.truth_side, "image.filter": "point"}
        return self.truths.picture(scene, data, {**settings, **size})

    def bench(self, name, settings=None, data=None, truth=True, side=None, turn=0, **options):
        """The JSON that `scolopax bench` writes for a scene with `settings`; None if data is missing. Options, such as
        samples=[1, 4], are passed on. `truth`: a picture instead of the reference's; False: only times are measured, no
        errors. `turn` distinguishes measurements that are repeated."""
        data, settings = data or self.data(name), settings or {}
        if data is None:
            return None
        side, options = side or self.side, {"repetitions": self.repetitions, **options}
        if truth is True:
            truth = self.truth(self.scene(name), data, settings)
        words = ["--truth", truth] if truth else ["--times-only"]
        for option, value in options.items():
            words.append(f"--{option.replace('_', '-')}")
            if value is not True:
                words.append(",".join(map(str, value)) if isinstance(value, (list, tuple)) else value)
        with open(self.scene(name), encoding="utf-8") as file:
            key = {"bench": file.read(), "data": list(map(content_hash, data)), "settings": settings, "options": options,
                   "side": side, "turn": turn, "truth": os.path.basename(truth) if truth else None}

        def measure():
            begin, out = time.monotonic(), self.path("bench.json")
            self.run("bench", self.scene(name), "--data", *data, "--json", out, *words,
                     *assignments({**settings, "image.width": side, "image.height": side}))
            with open(out, encoding="utf-8") as file:
                result = json.load(file)
            result.pop("scene")
            told = {path: value for path, value in settings.items() if not path.startswith("channels")}
            print(f"  {name} {told}: {time.monotonic() - begin:.1f} s", file=sys.stderr, flush=True)
            return result

        return self.kept(key, measure)


def resources(words):
    """(seconds, peak resident bytes) of a command; its output is discarded."""
    begin = time.monotonic()
    with open(os.devnull, "w", encoding="utf-8") as null:
        process = subprocess.Popen(words, stdout=null, stderr=null)
        _, status, used = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode != 0:
        raise RuntimeError(f"{words}: exit status {process.returncode}")
    return time.monotonic() - begin, used.ru_maxrss * 1024


def scratch():
    return tempfile.TemporaryDirectory()
