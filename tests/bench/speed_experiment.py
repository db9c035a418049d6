# SPDX-License-Identifier: Apache-2.0
"""The experiments `speed` and `estimates`: how soon a picture has an error, and whether the renderer knows its error."""
import os
import shutil

from common import LIGHTS, PROGRAM, light_settings, processor
from store import content_hash, key_hash
from truths import assignments

TARGET = 1e-5  # RMSE at which `speed` stops
LONGEST = 5  # seconds of a picture whose time to an error is extrapolated
STEPS = [4, 2, 1, 1 / 2, 1 / 4, 1 / 8, 1 / 16, 1 / 32, 1 / 64, 0]


def speed(bench):
    """Time against error of `auto`, trackers and single steps, on all scenes and lights (the paper's Figure 8). Trackers are
    extrapolated from pictures of 5 s, steps from those that have little more than their bias; `auto` goes to an RMSE of
    1e-5 or to --longest."""
    found = {}
    for name in bench.scenes:
        for light in bench.lights:
            # Without light, hybrid is raymarch.
            methods = ["auto", "superposed", "sync-dda", "raymarch", *(["hybrid"] if any(LIGHTS[light]) else [])]
            limits = {"longest": 0.05, "auto_longest": 0.2} if bench.quick else {"longest": LONGEST, "auto_longest": bench.longest}
            result = bench.bench(name, light_settings(light), methods=methods, samples=[1],
                                 steps=[4, 1, 0] if bench.quick else STEPS, until=TARGET, **limits)
            if result:
                found.setdefault(name, {})[light] = result
                bench.save(found)
    return found


ESTIMATED_SAMPLES = (16, 64, 512)
# Samples of the pictures from which errors of pixels with an area are counted. Their noise adds 1/16 to the squared error of
# 512 samples, and less to that of fewer. The reference would need hours for so many rays.
SMOOTH_SAMPLES = 8192


def smooth_picture(bench, name, data, settings):
    """Path of a picture of `auto` with many samples, with a seed that bench does not use."""
    samples = 64 if bench.quick else SMOOTH_SAMPLES
    settings = {**settings, "integrator.seed": 4_000_000_000, "image.width": bench.truth_side, "image.height": bench.truth_side,
                "image.filter": "box"}
    key = {"program": content_hash(PROGRAM), "machine": processor(), "scene": content_hash(bench.scene(name)),
           "data": list(map(content_hash, data)), "settings": settings, "samples": samples}
    out = os.path.join(bench.truths.folder, f"smooth-{key_hash(key)}.exr")
    if not os.path.exists(out):
        part = bench.path("smooth.exr")
        bench.run("render", bench.scene(name), "--data", *data, "-o", part, "--samples", samples, *assignments(settings))
        shutil.move(part, out)
    return out


def estimates(bench):
    """The error that `auto` claims beside its true error, after 16, 64 and 512 samples, on all scenes and lights, through the
    pixels' centres and with pixels that have an area: medians of ten seeds."""
    found = {}
    options = {"methods": ["auto"], "samples": ESTIMATED_SAMPLES[:2 if bench.quick else 3], "repetitions": 2 if bench.quick else 10,
               "side": bench.truth_side, "longest": 600}  # all pixels have a true error, because the claim is of all pixels
    for name in bench.scenes:
        data = bench.data(name)
        for light in bench.lights if data else ():
            settings = light_settings(light)
            point = bench.bench(name, settings, data, **options)
            box = bench.bench(name, {**settings, "image.filter": "box"}, data, truth=smooth_picture(bench, name, data, settings),
                              scene_filter=True, **options)
            found.setdefault(name, {})[light] = {"point": point["points"], "box": box["points"]}
            bench.save(found)
    return found
