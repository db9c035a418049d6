# SPDX-License-Identifier: Apache-2.0
"""The experiments of the report: one function each, and one list of them. Each takes a common.Bench and returns the
entry of the JSON file under its name."""
import json
import os
import sys
import time
from typing import Callable, NamedTuple

from common import MULTICHANNEL, PROGRAM, SCENES, light_settings, median, resources
from device_experiment import proxies
from session_experiment import sessions
from speed_experiment import estimates, speed
from store import content_hash
from surface_experiment import surfaces


def macrocells(bench):
    """Section 5.1: macrocell sizes 1 to 32."""
    found = {}
    lit = () if bench.quick else ("orbitals", "tcga", "heptane")
    for name in bench.scenes:
        for light in ("emission-absorption", "both") if name in lit else ("emission-absorption",):
            # `speed` measures the marcher with shadows.
            methods = ["superposed", "cumulative", "sync-dda", "n-dda", *(["raymarch"] if light != "both" else [])]
            result = bench.bench(name, light_settings(light), truth=False, macrocells=[1, 2, 4, 8, 16, 32], samples=[1, 4],
                                 methods=methods, steps=[1], longest=0.05 if bench.quick else 0.3)
            if result:
                found.setdefault(name, {})[light] = result
    return found


def channels(bench):
    """Section 5.2: the first 1 to 12 of twelve orbitals."""
    found = {}
    data = bench.orbitals(12)
    for light in bench.lights:
        for count in (1, 4, 12) if bench.quick else (1, 2, 3, 4, 6, 8, 10, 12):
            hidden = {f"channels.{i}.visible": False for i in range(count, 12)}
            # The reference of twelve channels with shadows is slow; `speed` measures errors with it.
            found.setdefault(light, {})[count] = bench.bench(
                "many", {**hidden, **light_settings(light)}, data, truth=light == "emission-absorption",
                samples=[1, 4] if bench.quick else [1, 32], steps=[1], longest=0.05 if bench.quick else 0.5)
    return found


def quality(bench):
    """Section 5.3: trackers with an increasing number of samples, the marcher with decreasing steps."""
    found = {}
    for name in ("bonsai",) if bench.quick else ("orbitals", "tcga", "bonsai"):
        result = bench.bench(name, samples=[1, 4, 16, 64, 256], steps=[8, 4, 2, 1, 0.5, 0.25, 0.125],
                             longest=0.05 if bench.quick else 1.5)
        if result:
            found[name] = result
    return found


def blends(bench):
    """Section 5.4: max, mix and composite against density, on finely marched pictures with negligible noise, as they
    are displayed: 8 bits, clipped."""
    found = {}
    side, samples = (64, 2) if bench.quick else (192, 4)
    for name in MULTICHANNEL:
        data = bench.data(name) if name in bench.scenes else None
        if not data:
            continue

        def measure(name=name, data=data):
            different = {}
            for mode in ("density", "max", "mix", "composite"):
                out = bench.path(f"{mode}.png")
                bench.run("render", bench.scene(name), "--data", *data, "-o", out, "--samples", samples, "--set",
                          f"blend.mode={mode}", "--set", "integrator.method=raymarch", "--set", "integrator.step=0.5", "--set",
                          f"image.width={side}", "--set", f"image.height={side}")
                if mode != "density":
                    told = bench.run("compare", out, bench.path("density.png"), "--json")
                    different[mode] = {key: json.loads(told)[key] for key in ("flip", "psnr", "rmse")}
            return different

        found[name] = bench.kept({"blends": content_hash(bench.scene(name)), "data": list(map(content_hash, data)), "side": side,
                                  "samples": samples}, measure)
    return found


def memory(bench):
    """Table 1: bytes of the data, of macrocells and majorants at the default macrocell size, and of the film."""
    found = {}
    for name in bench.scenes:
        result = bench.bench(name, truth=False, methods=["superposed"], samples=[1], repetitions=2, side=512)
        if result:
            found[name] = result["memory"][0]
    return found


def sizes(bench):
    """Time per ray, time of `auto` to an RMSE of 1e-3, and peak memory for the same content on finer grids: medians of rounds
    with the sizes in turn."""
    rows = {}
    edges = (32, 64) if bench.quick else (64, 128, 256, 512)
    for turn in range(2 if bench.quick else 3):
        for edge in edges:
            data = bench.orbitals(4, edge)
            rays = bench.bench("orbitals", {}, data, truth=False, samples=[16], steps=[1], repetitions=2, longest=1,
                               methods=["superposed", "sync-dda", "raymarch"], side=128, turn=turn)
            row = rows.setdefault(edge, {"memory": rays["memory"][0], "points": {}, "auto": []})
            for point in rays["points"]:
                row["points"].setdefault(point["method"], []).append(point)
            auto = bench.bench("orbitals", {}, data, methods=["auto"], samples=[1], until=1e-3, longest=60, turn=turn)
            if auto["timeToError"][0]["secondsToRmse0.001"] is None:
                sys.exit(f"sizes: auto does not reach 1e-3 within a minute on {edge}^3 voxels")
            row["auto"].append({"seconds": auto["timeToError"][0]["secondsToRmse0.001"],
                                "setSceneSeconds": median([p["setSceneSeconds"] for p in auto["points"]]),
                                "step": auto["points"][-1]["choice"]["step"]})
    for edge, row in rows.items():
        row["points"] = {method: {key: median([p[key] for p in points])
                                  for key in ("nsPerRay", "fetchesPerRay", "cellStepsPerRay")}
                         for method, points in row["points"].items()}
        row["auto"] = {key: median([one[key] for one in row["auto"]]) for key in ("seconds", "setSceneSeconds", "step")}
        data = bench.orbitals(4, edge)
        row["peakBytes"] = bench.kept({"peak": content_hash(bench.scene("orbitals")), "data": list(map(content_hash, data))},
                                      lambda data=data: peak_bytes(bench, data))
    return rows


def peak_bytes(bench, data):
    """Of rendering the orbitals, without the memory that the program and its libraries need before they do anything."""
    command = [PROGRAM, "render", bench.scene("orbitals"), "--data", *data, "-o", bench.path("sizes.exr"), "--samples", "1"]
    return resources(command)[1] - resources([PROGRAM, "--version"])[1]


def threads(bench):
    """Efficiency t1 / (n tn); the numbers of threads take turns in one process."""
    counts, most = [1], os.cpu_count() or 1
    while 2 * counts[-1] <= most:
        counts.append(2 * counts[-1])
    found = {}
    for name in ("orbitals",) if bench.quick else ("orbitals", "tcga", "heptane"):
        for light in ("emission-absorption", "both"):
            # `speed` measures the marcher with shadows.
            methods = ["superposed", "sync-dda", *(["raymarch"] if light != "both" else [])]
            result = bench.bench(name, light_settings(light), truth=False, threads=counts, samples=[4], steps=[1],
                                 methods=methods, side=64 if bench.quick else 256, repetitions=bench.repetitions + 2)
            if result:
                found.setdefault(name, {})[light] = result["points"]
    return found


def loading(bench):
    """Loading (with its histograms, by `scolopax info`) against reading the file's bytes and against decompressing them
    with gzip, all from a warm cache; medians."""
    found = {}
    cases = {"orbitals 128^3, NRRD, not packed": bench.orbitals(4)}
    if not bench.quick:
        cases["orbitals 256^3, NRRD, not packed"] = bench.orbitals(4, 256)
    for name in bench.scenes:
        if not isinstance(SCENES[name], int) and bench.data(name):
            cases[f"{name}, {os.path.basename(bench.data(name)[0]).split('.', 1)[1]}"] = bench.data(name)
    return {case: bench.kept({"loading": list(map(content_hash, files)), "repetitions": bench.repetitions},
                             lambda files=files: load(files, bench.repetitions + 2)) for case, files in cases.items()}


def load(files, repetitions):
    """Medians of seconds."""
    times = {"load": [], "read": [], "gzip": []}
    for _ in range(repetitions):
        times["load"].append(resources([PROGRAM, "info", *files])[0])
        begin = time.monotonic()
        for file in files:
            with open(file, "rb") as opened:
                while opened.read(1 << 20):
                    pass
        times["read"].append(time.monotonic() - begin)
        if files[0].endswith(".gz"):
            times["gzip"].append(resources(["gzip", "-dc", *files])[0])
    return {"bytes": sum(map(os.path.getsize, files)),
            "start": median([resources([PROGRAM, "--version"])[0] for _ in range(5)]),
            **{key: median(values) if values else None for key, values in times.items()}}


class Experiment(NamedTuple):
    run: Callable
    takes: str  # on two quiet cores, with the reference's pictures that others do not need


EXPERIMENTS = {run.__name__: Experiment(run, takes) for run, takes in (
    (macrocells, "2 minutes"), (channels, "5 minutes"), (quality, "3 minutes"), (blends, "1 minute"), (memory, "1 minute"),
    (sizes, "15 minutes"), (threads, "1 minute"), (loading, "1 minute"), (estimates, "1.5 hours"), (sessions, "4 hours"),
    (speed, "up to 20 hours, with --longest 60 some 8; 2 of them for references"), (surfaces, "2 hours"), (proxies, "5 minutes"))}
