# SPDX-License-Identifier: Apache-2.0
"""The experiments `speed` and `estimates`: how soon a picture has an error, and whether the renderer knows its error."""
from common import LIGHTS, light_settings

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


def estimates(bench):
    """The error that `auto` claims beside its true error, after 16, 64 and 512 samples, on all scenes and lights: medians of
    ten seeds."""
    found = {}
    for name in bench.scenes:
        for light in bench.lights:
            # All pixels have a true error, because the claim is of all pixels.
            result = bench.bench(name, light_settings(light), methods=["auto"], samples=ESTIMATED_SAMPLES[:2 if bench.quick else 3],
                                 repetitions=2 if bench.quick else 10, side=bench.truth_side, longest=600)
            if result:
                found.setdefault(name, {})[light] = result["points"]
                bench.save(found)
    return found
