# SPDX-License-Identifier: Apache-2.0
"""The experiment `surfaces`: figures 3 to 7 and tables 1 and 2 of Knoll et al. 2009 with their methods (bench_peaks) and
ours. Every picture is timed in turns with the others of its scene, and ours marches one ray at a time, too."""
import base64
import json
import os
import subprocess
import sys
import time

from common import PROGRAM
from store import content_hash
from surface_scenes import VOLUMES, scene, vti_to_nrrd, with_isovalues

PEAKS = os.path.join(os.path.dirname(PROGRAM), "bench_peaks")
TILE = 160  # edge of a picture in the contact sheets
# The paper's step is 4 pixel footprints, for pictures about this high. Ours are smaller, with the same step.
PAPER_HEIGHT, PAPER_FOOTPRINTS = 1024, 4


def setting(name, method, truth, **options):
    """`truth`: `peaks` of the reference."""
    return {"name": name, "method": method, "truth": truth, **options}


def post(name, peaks="off", truth=None, **options):
    """The paper's own: postclassification, with or without peak finding."""
    return setting(name, "postclassified", truth or ("both" if peaks == "either" else peaks), peaks=peaks, **options)


def marched(name, peaks, truth=None, **options):
    return setting(name, "raymarch", truth or peaks, peaks=peaks, step=1, **options)


def automatic(name, peaks):
    return setting(name, "auto", peaks, peaks=peaks, samples=16)


def preintegrated(size, **options):
    return setting(f"preintegrated, {size}^2", "preintegrated", "off", table=size, **options)


B_SPLINE = {"interpolation": "cubic"}


def footprints(side, count=PAPER_FOOTPRINTS):
    return {"footprints": count * side / PAPER_HEIGHT}


def files_of(bench, volume):
    """None, with a message, if the volume is missing."""
    files = bench.present(volume, [VOLUMES[volume]["file"]])
    if files and files[0].endswith(".vti"):
        out = bench.path(f"{volume}.nrrd")
        if not os.path.exists(out):
            vti_to_nrrd(files[0], out, 256)
        return [out]
    return files


def run_peaks(bench, made, files, settings, repetitions):
    paths = [bench.path("surfaces.json"), bench.path("settings.json")]
    for path, content in zip(paths, (made, {"repetitions": repetitions, "settings": settings})):
        with open(path, "w", encoding="utf-8") as file:
            json.dump(content, file)
    out = subprocess.run([PEAKS, *paths, *files], check=True, stdout=subprocess.PIPE, text=True,
                         env={**os.environ, "SCOLOPAX_INSTRUCTIONS": "baseline"}).stdout
    return json.loads(out)


def measure(bench, label, files, made, settings):
    """The settings with times, counts and errors."""
    path = bench.path("truth.json")
    with open(path, "w", encoding="utf-8") as file:
        json.dump(made, file)
    asked = [{**one, "truth": bench.truth(path, files, {"channels.0.peaks": one["truth"],
                                                        "channels.0.interpolation": one.get("interpolation", "trilinear")})}
             for one in settings]

    def run():
        begin = time.monotonic()
        found = run_peaks(bench, made, files, asked, bench.repetitions)
        print(f"  {label}: {time.monotonic() - begin:.1f} s", file=sys.stderr, flush=True)
        return [{**one, **result} for one, result in zip(settings, found)]

    key = {"surfaces": made, "data": list(map(content_hash, files)), "repetitions": bench.repetitions,
           "settings": [{**one, "truth": os.path.basename(one["truth"])} for one in asked]}
    return bench.kept(key, run, PEAKS)


def draw(bench, name, files, made, settings):
    """Paths of pictures of the scene."""
    paths = [bench.path(f"{name}-{i}.png") for i in range(len(settings))]
    asked = [{**{key: value for key, value in one.items() if key != "truth"}, "picture": path}
             for one, path in zip(settings, paths)]
    run_peaks(bench, made, files, asked, 0)
    return paths


def sheet(bench, paths, columns):
    """The pictures side by side, as a JPEG file in base64."""
    out = bench.path("sheet.jpg")
    rows = (len(paths) + columns - 1) // columns
    # From Debian's openimageio-tools.
    subprocess.run(["oiiotool", *paths, "--mosaic:pad=4", f"{columns}x{rows}", "--nosoftwareattrib", "--compression", "jpeg:75",
                    "-o", out], check=True)
    with open(out, "rb") as file:
        return base64.b64encode(file.read()).decode()


def integral_settings():
    """The curve alone. Equal steps of one voxel show only the effect of classification."""
    return [post("postclassification", step=1), preintegrated(256, step=1), preintegrated(1024, step=1),
            marched("raymarch", "off"), automatic("auto", "off")]


def sharp_settings():
    return [*integral_settings(), post("peak finding, both", "both", step=1), post("peak finding, either", "either", step=1),
            marched("raymarch, both", "both"), automatic("auto, both", "both"), post("peak finding, only", "only", step=1),
            marched("raymarch, only", "only")]


def figure3(bench, volumes):
    """Peaks of widths 1e-1 to 1e-5 of the range beside a smooth part."""
    found, pictures = [], []
    for volume, files in volumes.items():
        first = volume == next(iter(volumes))
        widths = (1e-2, 1e-4) if bench.quick or not first else (1e-1, 1e-2, 1e-3, 1e-4, 1e-5)
        for shading in (False, True) if first else (True,):
            for width in widths:
                light = "shading" if shading else "unlit"
                rows = measure(bench, f"figure 3, {volume}, {light}, {width:g}", files,
                               scene(volume, bench.side, width=width, shading=shading), sharp_settings())
                found.append({"volume": volume, "light": light, "width": width, "rows": rows})
        if first:
            shown = [one for one in sharp_settings() if one["name"] in
                     ("postclassification", "preintegrated, 1024^2", "peak finding, either", "auto, both")]
            for width in (1e-2, 1e-4):
                pictures += draw(bench, f"figure3-{width}", files, scene(volume, TILE, width=width), shown)
    return {"found": found, "sheet": sheet(bench, pictures, 4)}


def spikes(bench, volumes):
    """Peaks of constant area: narrower peaks are denser, so that the integral stays the same."""
    volume, files = next(iter(volumes.items()))
    return [{"volume": volume, "light": "unlit", "width": width,
             "rows": measure(bench, f"spikes, {width:g}", files,
                             scene(volume, bench.side, width=width, extinction=0.005 / width, shading=False),
                             integral_settings())}
            for width in ((1e-2, 1e-4) if bench.quick else (1e-1, 1e-2, 1e-3, 1e-4, 1e-5))]


def figure4(bench, volumes):
    """Noisy data: three narrow peaks and haze, against semi-transparent surfaces alone."""
    volume = "embryo" if "embryo" in volumes else next(iter(volumes))
    peaks, look = [0.15, 0.25, 0.35], {"width": 1e-3, "extinction": 0.3, "smooth": 0.02}
    settings = [post("postclassification", step=1), preintegrated(1024, step=1), post("peak finding, either", "either", step=1),
                marched("raymarch, both", "both"), marched("raymarch, only", "only"), automatic("auto, both", "both")]
    rows = measure(bench, f"figure 4, {volume}", volumes[volume], scene(volume, bench.side, peaks, **look), settings)
    shown = [settings[2], settings[1], settings[4], settings[5]]
    pictures = draw(bench, "figure4", volumes[volume], scene(volume, TILE, peaks, **look), shown)
    return {"volume": volume, "found": rows, "sheet": sheet(bench, pictures, 4)}


def figure5(bench, volumes):
    """Left: peaks close to each other, one or four a segment, at a wide step. Right: the effect of peak finding where
    the curve is smooth; ours with 16 times the peaks' extinction."""
    volume, files = next(iter(volumes.items()))
    base = VOLUMES[volume]["peak"]
    near = {"peaks": [base + 0.02 * i for i in range(6)], "width": 1e-3, "extinction": 0.3, "smooth": 0.02}
    several = [post("one peak", "either", step=2, most=1), post("four peaks", "either", step=2), marched("raymarch, both", "both"),
               automatic("auto, both", "both")]
    wide = {"width": 0.2, "extinction": 0.03, "smooth": 0.03}
    smooth = [post("postclassification", step=1), post("peak finding, either", "either", "off", step=1),
              post("peak finding, both", "both", "off", step=1), post("peak finding, only", "only", step=1),
              marched("raymarch, off", "off"), marched("raymarch, both", "both", truth="off")]
    stronger = [setting("isovalues of 16 times the extinction", "raymarch", "off", step=1)]
    found = {"several": measure(bench, "figure 5, left", files, scene(volume, bench.side, **near), several),
             "smooth": measure(bench, "figure 5, right", files, scene(volume, bench.side, **wide), smooth)}
    pictures = draw(bench, "figure5-left", files, scene(volume, TILE, **near), several)
    pictures += draw(bench, "figure5-right", files, scene(volume, TILE, **wide), [smooth[0], smooth[1], smooth[3]])
    pictures += draw(bench, "figure5-strong", files, with_isovalues(scene(volume, TILE, **wide), 16), stronger)
    return {"volume": volume, "found": found, "sheet": sheet(bench, pictures, 4)}


RATES = {"width": 1e-2}


def sampling(bench, volumes, view, names):
    """Figures 6 and 7, table 2: equal steps against differential sampling, by number of samples, with trilinear
    interpolation and with B-splines."""
    steps, counts = ((2, 1, 0.5), (8, 4)) if bench.quick else ((4, 2, 1, 0.5, 0.25, 0.125), (16, 8, 4, 2, 1))
    found, pictures = [], []
    for volume in (name for name in names if name in volumes):
        made, shown = scene(volume, bench.side, view=view, **RATES), []
        for name, peaks, options in (("postclassification", "off", {}), ("postclassification, B-spline", "off", B_SPLINE),
                                     ("peak finding", "either", {}), ("peak finding, B-spline", "either", B_SPLINE)):
            equal = [post("uniform", peaks, step=step, **options) for step in steps]
            growing = [{**post("differential", peaks, **footprints(bench.side, count), **options), "count": count} for count in counts]
            rows = measure(bench, f"{view} view, {volume}, {name}", volumes[volume], made, equal + growing)
            found.append({"volume": volume, "view": view, "name": name, "rows": rows})
            # Equal steps with about as many samples as the paper's differential sampling.
            wanted = next(row for row in rows if row.get("count") == PAPER_FOOTPRINTS)["samplesPerPixel"]
            nearest = min(rows[:len(equal)], key=lambda row: abs(row["samplesPerPixel"] - wanted))
            shown += [post("uniform", peaks, step=nearest["step"], **options)] if not options else []
            shown += [post("differential", peaks, **footprints(TILE), **options)]
        pictures += draw(bench, f"{view}-{volume}", volumes[volume], scene(volume, TILE, view=view, **RATES), shown)
    return {"found": found, "sheet": sheet(bench, pictures, 6)} if found else None


def table1(bench, volumes):
    """The paper's settings (differential sampling, either) on every volume, with rates by macrocell and with B-splines, and
    ours."""
    found = []
    step = footprints(bench.side)
    settings = [post("postclassification", **step), preintegrated(256, **step), post("peak finding", "either", **step),
                post("peak finding, rates by macrocell", "either", adaptive="variance", **step),
                post("peak finding, B-spline", "either", **step, **B_SPLINE), marched("raymarch, both", "both"),
                marched("raymarch, both, B-spline", "both", **B_SPLINE), automatic("auto, both", "both")]
    for volume, files in volumes.items():
        for view in ("far", "close"):
            if view in VOLUMES[volume]:
                rows = measure(bench, f"table 1, {volume}, {view}", files, scene(volume, bench.side, view=view), settings)
                found.append({"volume": volume, "view": view, "rows": rows})
    return found


def adaptive(bench, volumes):
    """Steps that follow the data or the ray, on a smooth curve, with preintegration, so that errors of classification
    do not count. All are multiples of a quarter of a voxel."""
    steps = (4, 1, 0.25) if bench.quick else (8, 4, 2, 1, 0.5, 0.25)
    switches = {"variance": (0,), "bounds": (1e-2,) if bench.quick else (1e-1, 1e-2, 1e-3, 1e-4), "opacity": (0,),
                "gradient": (0.03,) if bench.quick else (0.1, 0.03, 0.01, 0.003)}
    settings = [{**preintegrated(1024, step=step), "name": "uniform"} for step in steps]
    settings += [{**preintegrated(1024, adaptive=by, tolerance=value, step=0.25), "name": f"by {by}" + (f", {value:g}" if value else "")}
                 for by, values in switches.items() for value in values]
    settings += [{**preintegrated(1024, opaque=opaque, step=0.25), "name": f"rays end at {opaque:g}"} for opaque in (0.05, 0.01)]
    settings += [{**preintegrated(1024, step=0.25, leaps=False), "name": "no leaps over empty blocks"}]
    settings += [{**marched("raymarch, whole cells", "off"), "step": 0}, automatic("auto", "off")]
    return [{"volume": volume, "rows": measure(bench, f"adaptive steps, {volume}", files,
                                               scene(volume, bench.side, [], smooth=0.2, shading=False), settings)}
            for volume, files in volumes.items()]


def surfaces(bench):
    """Sharp transfer functions (Knoll et al. 2009)."""
    if not os.path.exists(PEAKS):
        sys.exit(f"surfaces: there is no {PEAKS}; build the target bench_peaks")
    wanted = ("bonsai",) if bench.quick else VOLUMES
    volumes = {volume: files for volume in wanted if (files := files_of(bench, volume))}
    if not volumes:
        sys.exit("surfaces: there is none of the volumes")
    return {"figure3": figure3(bench, volumes), "spikes": spikes(bench, volumes), "figure4": figure4(bench, volumes),
            "figure5": figure5(bench, volumes), "figure6": sampling(bench, volumes, "close", ("bonsai", "engine")),
            "figure7": sampling(bench, volumes, "far", ("bonsai", "embryo")), "table1": table1(bench, volumes),
            "adaptive": adaptive(bench, volumes)}
