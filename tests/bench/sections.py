# SPDX-License-Identifier: Apache-2.0
"""The report's sections: Markdown tables and plots of an experiment's results. One function each, and one list of them.
Every function gets the experiment's entry of run.py's file, and a function that saves a plot and returns its link."""
from device_sections import gpu, proxies
from plots import lines
from speed_sections import bold, by_method, estimates, most_samples, sessions, speed
from surface_sections import surfaces
from tables import number, table


def macrocells(entry, plot):
    text = ""
    for light in ("emission-absorption", "both"):
        panels, rows = [], []
        for scene, lights in entry["found"].items():
            if light not in lights:
                continue
            series = []
            for method, points in by_method(lights[light]["points"]).items():
                best = {size: most_samples([p for p in points if p["macrocell"] == size]) for size in
                        sorted({p["macrocell"] for p in points})}
                series.append((method, list(best), [p["nsPerRay"] for p in best.values()]))
                if method in ("superposed", "sync-dda", "raymarch"):
                    rows.append([scene, method, *(f"{number(p['nsPerRay'])} · {number(p['fetchesPerRay'])} · "
                                                  f"{number(p['cellStepsPerRay'])}" for p in best.values())])
            panels.append((scene, series))
        if panels:
            text += (f"## {light}\n{plot('macrocells-' + light, lines(panels, 'macrocell edge, voxels', 'ns/ray'))}\n\n"
                     "ns/ray · fetches/ray · cells/ray by macrocell edge:\n\n" +
                     table(["scene", "method", "1", "2", "4", "8", "16", "32"], rows) + "\n")
    rows = []
    for scene, lights in entry["found"].items():
        found = next(iter(lights.values()))
        rows.append([scene, *(f"{100 * m['macrocells'] / m['data']:.3g} + {100 * m['majorants'] / m['data']:.3g}"
                              for m in found["memory"])])
    return text + ("## Memory\nMacrocells + majorants, percent of the data, by macrocell edge (small data have a part that does "
                   "not shrink):\n\n" + table(["scene", "1", "2", "4", "8", "16", "32"], rows))


def channels(entry, plot):
    panels, text = [], ""
    for light, counts in entry["found"].items():
        series, rows = {}, []
        for count, found in counts.items():
            points = {m: most_samples(p) for m, p in by_method(found["points"]).items()}
            for method, point in points.items():
                xs, ys = series.setdefault(method, ([], []))
                xs.append(int(count))
                ys.append(point["nsPerRay"])
            sync = points["sync-dda"]
            rows.append([count] + [f"{number(p['nsPerRay'])} (x{number(sync['nsPerRay'] / p['nsPerRay'])})"
                                   for p in points.values()] +
                        [number(points["superposed"].get("efficiencyToSyncDda")), number(points["superposed"]["fetchesPerRay"]),
                         number(sync["fetchesPerRay"])])
        panels.append((light, [(m, *xy) for m, xy in series.items()]))
        text += (f"## {light}\nns/ray, and in brackets how many times less than sync-dda; the ratio of 1 / (MSE x seconds) of superposed "
                 "and sync-dda, if\nthere is a reference picture; fetches per ray:\n\n" +
                 table(["channels", *series, "efficiency", "fetches, superposed", "fetches, sync-dda"], rows) + "\n")
    return plot("channels", lines(panels, "channels", "ns/ray", logx=False)) + "\n\n" + text


def quality(entry, plot):
    text = ""
    for measure, name in (("rmse", "RMSE"), ("flip", "FLIP"), ("psnr", "PSNR")):
        panels = []
        for scene, found in entry["found"].items():
            series = []
            for method, points in by_method(found["points"]).items():
                chosen = sorted((p for p in points if p["step"] is None or p["samples"] == 1),
                                key=lambda p: (p["samples"], -(p["step"] or 0)))
                series.append((method, [1e3 * p["seconds"] for p in chosen], [p[measure] for p in chosen]))
            panels.append((scene, series))
        text += plot(f"quality-{measure}", lines(panels, "ms a picture", name, logy=measure != "psnr")) + "\n"
    rows = []
    for scene, found in entry["found"].items():
        for point in sorted((p for p in found["points"] if p["method"] in ("superposed", "sync-dda", "raymarch", "hybrid")),
                            key=lambda p: (p["method"], -(p["step"] or 0), p["samples"])):
            rows.append([scene, point["method"], point["samples"], number(point["step"]), f"{1e3 * point['seconds']:.3g}",
                         f"{point['rmse']:.1e}", f"{point['flip']:.4f}", f"{point['psnr']:.1f}"])
    return text + "\n" + table(["scene", "method", "samples", "step", "ms", "RMSE", "FLIP", "PSNR, dB"], rows)


def blends(entry, plot):
    rows = [[scene, *(f"{100 * modes[mode]['flip']:.0f} %, {modes[mode]['psnr']:.1f} dB" for mode in ("composite", "mix", "max"))]
            for scene, modes in entry["found"].items()]
    rows += [[f"paper: {name}", *cells] for name, *cells in
             (("NYX", "47 %, 16.6 dB", "21 %, 23.0 dB", "13 %, 22.9 dB"), ("Hurricane", "77 %, 11.6 dB", "33 %, 19.8 dB", "24 %, 23.0 dB"),
              ("Zebrafish", "34 %, 16.9 dB", "6 %, 34.6 dB", "6 %, 34.1 dB"))]
    return "Mean FLIP and PSNR to density, emission and absorption:\n\n" + table(["scene", "composite", "mix", "max"], rows)


def memory(entry, plot):
    rows = []
    for scene, m in entry["found"].items():
        voxels, data = m["voxels"] * m["channels"], m["data"]
        rows.append([f"{scene} ({m['channels']})", f"{data / 1e6:.2f}", f"{m['macrocells'] / 1e6:.3f}", f"{m['majorants'] / 1e6:.3f}",
                     f"{100 * (m['macrocells'] + m['majorants']) / data:.2f} %", f"{data / voxels:.3g}",
                     f"{m['macrocells'] / voxels:.3g}", f"{m['majorants'] / voxels:.3g}", f"{m['film'] / m['pixels']:.0f}"])
    rows += [[f"paper: {name}", *cells, "", "", "", ""] for name, *cells in (
        ("NASA ROI (4)", "2990", "375.98", "187.99", "18.86 %"), ("NYX (4)", "2048", "64.00", "32.00", "4.69 %"),
        ("Hurricane (4)", "381.47", "11.92", "5.96", "4.69 %"), ("Miranda (4)", "576", "18.00", "9.00", "4.69 %"),
        ("Zebrafish (3)", "567.15", "2.19", "1.01", "0.56 %"))]
    return ("Growth of the heap in MB and, in the last columns, bytes per voxel and channel (film: per pixel), with macrocells of "
            "4 voxels:\n\n" + table(["scene (channels)", "data", "macrocells", "majorants", "share", "data B", "macrocells B",
                                     "majorants B", "film B"], rows))


def rebuild(entry, plot):
    rows = entry["found"]
    return table(list(rows[0]), [[number(v) if isinstance(v, float) else v for v in row.values()] for row in rows])


def layout(entry, plot):
    rows = [[row["type"], str(row["channels"]), row["rays"],
             *("-" if row[kind] == 0 else number(row[kind])
               for kind in ("planar", "planar8", "interleaved", "bricked", "onePlanar", "oneInterleaved"))] for row in entry["found"]]
    return ("ns per point for all channels, and, last two columns, for one channel that changes from point to point:\n\n" +
            table(["type", "channels", "rays along", "planar", "planar, 8 points at once", "interleaved, 4 channels at once",
                   "planar bricks of 8^3", "one of planar", "one of interleaved"], rows))


def sizes(entry, plot):
    found = entry["found"]
    panels = [("orbitals, 4 channels", [(m, [int(e) for e in found], [row["points"][m]["nsPerRay"] for row in found.values()])
                                        for m in next(iter(found.values()))["points"]])]
    rows = [[f"{edge}^3", *(number(p["nsPerRay"]) for p in row["points"].values()),
             *(number(p["cellStepsPerRay"]) for m, p in row["points"].items() if m == "superposed"),
             f"{row['peakBytes'] / 1e6:.0f}", f"{row['peakBytes'] / row['memory']['voxels'] / row['memory']['channels']:.2f}",
             f"{row['memory']['data'] / row['memory']['voxels'] / row['memory']['channels']:.0f}"] for edge, row in found.items()]
    autos = {edge: row["auto"] for edge, row in found.items()}
    growth = autos[max(autos, key=int)]["seconds"] / autos[min(autos, key=int)]["seconds"]
    return (plot("sizes", lines(panels, "voxels per edge", "ns/ray")) + "\n\nTime of `auto` to an RMSE of 1e-3, with its choice, of "
            f"{entry['side']}x{entry['side']} pixels. From the smallest to the largest volume it grows "
            f"{bold(f'{growth:.3g} times', growth > 1.5)}\n(goal: at most 1.5).\n\n" +
            table(["volume", "time to 1e-3", "of that the choice", "step"],
                  [[f"{edge}^3", f"{1e3 * auto['seconds']:.3g} ms", f"{1e3 * auto['setSceneSeconds']:.3g} ms", number(auto["step"])]
                   for edge, auto in autos.items()]) +
            "\nPeak: resident memory of `scolopax render` at "
            "256x256, above that of the program that has just started.\n\n" +
            table(["volume", *(f"{m}, ns/ray" for m in next(iter(found.values()))["points"]), "cells/ray, superposed",
                   "peak, MB", "bytes per voxel and channel", "of them data"], rows))


def threads(entry, plot):
    rows = []
    for scene, lights in entry["found"].items():
        for light, points in lights.items():
            for method, of_method in by_method(points).items():
                times = {p["threads"]: p["nsPerRay"] for p in of_method}
                rows.append([scene, light, method, *(f"{number(t)}" + (f" ({times[1] / (n * t):.2f})" if n > 1 else "")
                                                     for n, t in times.items())])
    counts = sorted({p["threads"] for lights in entry["found"].values() for points in lights.values() for p in points})
    return ("ns/ray, and in brackets the efficiency t1 / (n tn); numbers of threads take turns:\n\n" +
            table(["scene", "light", "method", *(f"{n} threads" if n > 1 else "1 thread" for n in counts)], rows))


def loading(entry, plot):
    rows = []
    for case, t in entry["found"].items():
        load = max(t["load"] - t["start"], 0)
        rows.append([case, f"{t['bytes'] / 1e6:.2f}", f"{1e3 * t['read']:.2f}", "-" if t["gzip"] is None else f"{1e3 * t['gzip']:.0f}",
                     f"{1e3 * load:.0f}", f"x{number(load / t['read'])}", "-" if t["gzip"] is None else f"x{number(load / t['gzip'])}"])
    start = 1e3 * next(iter(entry["found"].values()))["start"]
    return (f"Warm cache, medians, milliseconds, without the program's own start of {start:.0f} ms:\n\n" +
            table(["files", "MB", "read", "gzip -d", "load", "load / read", "load / gzip"], rows))


# File -> (title, experiments).
REPORT = {
    "speed": ("Speed against error", [speed]),
    "estimates": ("Estimated errors", [estimates, sessions]),
    "macrocells": ("Macrocell sizes (section 5.1 of the paper)", [macrocells]),
    "channels": ("Channels (section 5.2)", [channels]),
    "quality": ("Quality and performance (section 5.3)", [quality]),
    "blending": ("Blend functions (section 5.4)", [blends]),
    "memory": ("Memory and rebuild times (Table 1)", [memory, rebuild]),
    "layout": ("Layout of the voxels", [layout]),
    "scaling": ("Scaling", [sizes, threads, loading]),
    "proxies": ("What CUDA kernels execute", [proxies]),
    "gpu": ("CUDA devices", [gpu]),
    "surfaces": ("Sharp transfer functions and surfaces (Knoll et al. 2009)", [surfaces]),
}
