#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Compares Scolopax with VTK's CPU ray caster, in turns: vtk.py OUT.json [--only NAME,...] [--size PIXELS,...]
Takes some 45 minutes on two quiet cores, twice as long with AVX-512. A run that was interrupted continues where it stopped.

One channel: speed against error, both against the double-precision reference. Four channels: time per frame at
equal step. Missing volumes are skipped with a message. Reads SCOLOPAX (the program), SCOLOPAX_DATA_DIR."""
import argparse
import json
import os
import statistics
import struct
import subprocess
import sys
import tempfile

import numpy
from common import DATA, PROGRAM, SCENES, processor
from store import Store, content_hash
from vtk_mapper import VERSION, VtkMapper, read_nifti

SINGLE = {name: [f"scalar/{name}.nii.gz"] for name in ("heptane", "bonsai", "engine")}
MULTIPLE = {"tcga": SCENES["tcga"]}
STEPS = [8, 4, 2, 1, 0.5]  # in voxels
FRAME_STEPS = STEPS[1:]  # with four channels
BETWEEN = [6, 3, 1.5, 0.75, 0.25, 0.125, 0]  # further steps of Scolopax (0: whole voxel cells)
SAMPLES = [1, 4, 16, 64]  # of Scolopax
LONGEST = 0.5  # seconds of a picture with more than one sample
ROUNDS = 5  # of VTK before Scolopax's turn, and as many after it
COLORS = ["#ff4030", "#40c060", "#4080ff", "#ffd040"]


def padded(voxels):
    """Adds an empty layer. VTK's box ends at the centres of the outer voxels, Scolopax's half a voxel beyond. With an
    empty border both show the same."""
    return numpy.pad(voxels, 1, constant_values=0)


def wider(voxels):
    """8-bit voxels as 16 bits: the mapper interpolates in the type of the voxels."""
    return voxels.astype(numpy.uint16) * 257


def scene_of(channels, size):
    """A scene: opacity ramps from 15 % of the range up to an extinction of 0.05 per voxel, colours that change with the
    value, and a camera such that everything visible fills the picture."""
    seen = numpy.argwhere(numpy.any([channel > 0.15 * channel.max() for channel in channels], axis=0))[:, ::-1]
    low, high = seen.min(axis=0), seen.max(axis=0)
    middle = (low + high) / 2
    eye = middle + numpy.array([-0.6, -0.8, 0.45]) * 1.5 * numpy.linalg.norm(high - low)
    looks = []
    for channel, color in zip(channels, COLORS):
        hi = float(channel.max())
        looks.append({"range": [0.0, hi], "opacity": [[0, 0], [0.15, 0], [1, 1]], "density": 0.05,
                      "colormap": [[0, color], [1, "#ffffff"]]})
    return {"channels": looks, "shading": False, "image": {"width": size, "height": size, "filter": "point"},
            "camera": {"eye": eye.tolist(), "target": middle.tolist(), "up": [0, 0, 1], "fovY": 34},
            "integrator": {"seed": 1}}


def write_nrrd(path, voxels):
    kind = {"uint8": "uint8", "int16": "int16"}[voxels.dtype.name]
    with open(path, "wb") as file:
        file.write(f"NRRD0004\ntype: {kind}\ndimension: 3\nsizes: {' '.join(map(str, voxels.shape[::-1]))}\n"
                   "space dimension: 3\nspace directions: (1,0,0) (0,1,0) (0,0,1)\nspace origin: (0,0,0)\n"
                   "endian: little\nencoding: raw\n\n".encode())
        file.write(voxels.tobytes())


def write_tiff(path, picture):
    """Writes premultiplied RGBA as 32-bit floats: a header, the pixels in one strip, four words 32 (bits per sample),
    four words 3 (float samples), and the directory."""
    pixels = numpy.ascontiguousarray(picture).astype("<f4").tobytes()
    words = 8 + len(pixels)
    entries = [(256, 4, 1, picture.shape[1]), (257, 4, 1, picture.shape[0]), (258, 3, 4, words), (259, 3, 1, 1),
               (262, 3, 1, 2), (273, 4, 1, 8), (277, 3, 1, 4), (278, 4, 1, picture.shape[0]), (279, 4, 1, len(pixels)),
               (338, 3, 1, 1), (339, 3, 4, words + 8)]
    with open(path, "wb") as file:
        file.write(struct.pack("<2sHI", b"II", 42, words + 16) + pixels + struct.pack("<8H", *[32] * 4, *[3] * 4))
        file.write(struct.pack("<H", len(entries)) + b"".join(struct.pack("<HHII", *entry) for entry in entries))
        file.write(bytes(4))


class Workplace:
    """A folder with a volume and its scene as files for the program."""

    def __init__(self, folder, channels):
        self.folder = folder
        self.data = [self.path(f"{n}.nrrd") for n in range(len(channels))]
        for path, channel in zip(self.data, channels):
            write_nrrd(path, channel)

    def path(self, name):
        return os.path.join(self.folder, name)

    def run(self, command, scene, *options, environment=None):
        with open(self.path("scene.json"), "w", encoding="utf-8") as file:
            json.dump(scene, file)
        subprocess.run([PROGRAM, command, self.path("scene.json"), "--data", *self.data, *options], check=True,
                       stdout=subprocess.DEVNULL, env={**os.environ, **(environment or {})})

    def reference(self, scene):
        self.run("reference", scene, "-o", self.path("truth.exr"), "--samples-per-axis", "1")

    def error(self, picture):
        write_tiff(self.path("picture.tif"), picture)
        out = subprocess.run([PROGRAM, "compare", self.path("picture.tif"), self.path("truth.exr"), "--json"],
                             check=True, capture_output=True, text=True).stdout
        return {name: json.loads(out)[name] for name in ("rmse", "psnr")}

    def bench(self, scene, *options):
        """Points of Scolopax, with the instructions that it takes here and, if these are AVX-512, also with AVX2."""
        points = self.bench_with({}, scene, *options)
        if points[0]["instructions"] == "avx512":
            points += self.bench_with({"SCOLOPAX_INSTRUCTIONS": "avx2"}, scene, *options)
        return points

    def bench_with(self, environment, scene, *options):
        self.run("bench", scene, "--repetitions", str(2 * ROUNDS), "--json", self.path("bench.json"), *options,
                 environment=environment)
        with open(self.path("bench.json"), encoding="utf-8") as file:
            told = json.load(file)
        if environment and told["instructions"] != environment["SCOLOPAX_INSTRUCTIONS"]:
            sys.exit(f"vtk.py: asked for {environment['SCOLOPAX_INSTRUCTIONS']}, the program used {told['instructions']}")
        return [{**point, "instructions": told["instructions"]} for point in told["points"]]


def take_turns(mappers, steps, bench):
    """Seconds of every VTK mapper and step, in two halves (rounds before and after Scolopax's turn), and Scolopax's
    points."""
    seconds = {(name, step): ([], []) for name in mappers for step in steps}

    def rounds(half):
        for count in range(ROUNDS + 1):
            for (name, step), halves in seconds.items():
                time = mappers[name].draw(step)
                if count > 0:  # the first round warms up
                    halves[half].append(time)

    rounds(0)
    points = bench()
    rounds(1)
    return seconds, points


def row(voxels, step, halves, error):
    """A row of VTK's results. `drift` is the ratio of the medians after and before Scolopax's turn."""
    before, after = map(statistics.median, halves)
    return {"voxels": voxels, "step": step, "seconds": statistics.median(halves[0] + halves[1]),
            "drift": after / before, **error}


def single(channels, scene, folder):
    """Results for one channel. VTK also gets the volume as 16 bits: its interpolation rounds to the voxels' type."""
    place = Workplace(folder, channels)
    mappers = {"u8": VtkMapper(channels, scene)}
    wide = json.loads(json.dumps(scene))
    wide["channels"][0]["range"][1] *= 257
    mappers["u16"] = VtkMapper([wider(channels[0])], wide)
    place.reference(scene)
    errors = {}
    for name, mapper in mappers.items():
        for step in STEPS:
            mapper.draw(step)
            errors[name, step] = place.error(mapper.picture())
    truth = place.path("truth.exr")
    # No tracker comes near VTK's errors in VTK's time.
    options = ["--methods", "auto,raymarch", "--steps", ",".join(map(str, STEPS + BETWEEN)), "--samples",
               ",".join(map(str, SAMPLES)), "--longest", str(LONGEST), "--truth", truth]
    seconds, points = take_turns(mappers, STEPS, lambda: place.bench(scene, *options))
    return {"vtk": [row(*key, halves, errors[key]) for key, halves in seconds.items()], "scolopax": points}


def multiple(channels, scene, folder):
    place = Workplace(folder, channels)
    found = []
    for shading in (False, True):
        scene["shading"] = shading
        mapper = VtkMapper(channels, scene)
        options = ["--methods", "raymarch", "--steps", ",".join(map(str, FRAME_STEPS)), "--samples", "1", "--times-only"]
        seconds, points = take_turns({"i16": mapper}, FRAME_STEPS, lambda: place.bench(scene, *options))
        found.append({"shading": shading, "vtk": [row(*key, halves, {}) for key, halves in seconds.items()],
                      "scolopax": points})
    return {"lights": found}


def measure(name, sizes, store):
    files = [os.path.join(DATA, file) for file in {**SINGLE, **MULTIPLE}[name]]
    missing = [file for file in files if not os.path.exists(file)]
    if missing:
        print(f"{name}: left out, there is no {missing[0]}", file=sys.stderr)
        return []
    channels = [padded(read_nifti(file)) for file in files]
    found = []
    for size in sizes or ((256, 1024) if name in SINGLE else (512,)):
        print(f"{name}, {size}x{size}", file=sys.stderr)
        scene = scene_of(channels, size)

        def compare(scene=scene):
            with tempfile.TemporaryDirectory() as folder:
                return (single if name in SINGLE else multiple)(channels, {**scene}, folder)

        key = {"program": content_hash(PROGRAM), "machine": processor(), "vtk": VERSION, "script": content_hash(__file__),
               "data": list(map(content_hash, files)), "scene": scene}
        result = store.get(key, compare)
        found.append({"volume": name, "voxels": list(channels[0].shape[::-1]), "size": size, **result})
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", metavar="OUT.json")
    parser.add_argument("--only", type=lambda text: text.split(","), default=[*SINGLE, *MULTIPLE], metavar="NAME,...",
                        help="volumes of " + ", ".join([*SINGLE, *MULTIPLE]))
    parser.add_argument("--size", type=lambda text: [int(size) for size in text.split(",")], metavar="PIXELS,...",
                        help="edges of the pictures instead of 256 and 1024, of tcga 512")
    parser.add_argument("--again", action="store_true", help="measure anew what OUT.json.parts has from an interrupted run")
    options = parser.parse_args()
    unknown = [name for name in options.only if name not in SINGLE and name not in MULTIPLE]
    if unknown:
        parser.error(f"there is no {unknown[0]}")
    store = Store(options.out + ".parts", options.again)
    measured = [found for name in options.only for found in measure(name, options.size, store)]
    if not measured:
        sys.exit("vtk.py: nothing was measured")
    with open(options.out, "w", encoding="utf-8") as file:
        json.dump({"machine": processor(), "vtk": VERSION, "measured": measured}, file, indent=1)


if __name__ == "__main__":
    main()
