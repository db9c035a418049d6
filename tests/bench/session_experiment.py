# SPDX-License-Identifier: Apache-2.0
"""The experiment `sessions`: a large picture that nobody edits goes on converging."""
import json
import os
import subprocess
import sys
import time

from common import HERE, PROGRAM
from store import content_hash

GOAL = 1.5e-4  # claimed error at which a session stops; less than 2e-4 is wanted
FIRST_SAMPLES = 16


def thinned(picture, out, side):
    """A picture of side x side pixels, from the middles of as many blocks of an EXR picture: number n / 2 of n, as of
    `scolopax reference --every`."""
    # From Debian's openimageio-tools.
    subprocess.run(["oiiotool", picture, "--resample:interp=0", f"{side}x{side}", "-o", out], check=True)
    return out


def sessions(bench):
    """Errors, claimed and true, of a session of four MRI contrasts at 1024x1024, by the number of samples, until it claims
    1.5e-4; pixels with an area (box), and points."""
    name, side, truth_side = ("orbitals", 64, 16) if bench.quick else ("tcga", 1024, 32)
    data, found = bench.data(name), {}
    for kind in ("point", "box") if data else ():
        settings = {"image.width": side, "image.height": side, "image.filter": kind}
        truth = bench.truths.picture(bench.scene(name), data, settings, samples_per_axis=1 if kind == "point" else 8,
                                     every=side // truth_side)
        key = {"session": content_hash(bench.scene(name)), "data": list(map(content_hash, data)), "settings": settings,
               "truth": os.path.basename(truth), "goal": GOAL, "first": FIRST_SAMPLES}
        found[kind] = bench.kept(key, lambda kind=kind, truth=truth: converge(bench, name, data, side, kind, truth, truth_side))
        bench.save(found)
    return found


def converge(bench, name, data, side, kind, truth, truth_side):
    """A row for every doubling of the samples."""
    os.environ.setdefault("SCOLOPAX", PROGRAM)
    sys.path[:0] = [os.path.join(HERE, "../server")]
    import serving  # here, because it needs SCOLOPAX

    with open(bench.scene(name), encoding="utf-8") as file:
        scene = json.load(file)
    scene["image"] = {"width": side, "height": side, "filter": kind}
    scene["stop"] = {"error": GOAL, "samples": 1 << 20}
    limit = os.environ.get("SCOLOPAX_INSTRUCTIONS")
    rows, samples, begin = [], FIRST_SAMPLES, time.monotonic()
    with serving.Server(paths=data, environment={"SCOLOPAX_INSTRUCTIONS": limit} if limit else {}) as server:
        _, session = server.json("POST", "/api/v1/sessions", {"scene": scene})
        while not rows or not rows[-1]["final"]:
            status, headers, picture = server.call(
                "GET", f"/api/v1/sessions/{session['id']}/frame?minSamples={samples}&format=exr&timeout=25")
            if status == 204:  # not yet
                continue
            if status != 200:
                raise RuntimeError(f"{name}, {kind}: {status} {picture[:200]!r}")
            rows.append({"seconds": time.monotonic() - begin, "samples": int(headers["Scolopax-Samples"]),
                         "claimed": float(headers["Scolopax-Error"]), "final": headers["Scolopax-Final"] == "1",
                         "true": true_error(bench, picture, truth, truth_side)})
            print(f"  session, {kind}: {rows[-1]}", file=sys.stderr, flush=True)
            samples = 2 * rows[-1]["samples"]
    return rows


def true_error(bench, picture, truth, truth_side):
    """RMSE of the bytes of an EXR picture."""
    path = bench.path("session.exr")
    with open(path, "wb") as file:
        file.write(picture)
    told = bench.run("compare", thinned(path, bench.path("thinned.exr"), truth_side), truth, "--json")
    return json.loads(told)["rmse"]
