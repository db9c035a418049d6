#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Tables of vtk.py's measurements, as Markdown: vtk_report.py IN.json > OUT.md"""
import json
import sys

from tables import table

# The goals: so many times faster than VTK where its error is at most FINE, and elsewhere.
FINE, FINE_GOAL, COARSE_GOAL = 2e-3, 5, 2.5
FRAME_GOAL = 5  # of frames at equal steps
NAMES = {"baseline": "baseline", "avx2": "AVX2", "avx512": "AVX-512"}


def goal(rmse):
    return FINE_GOAL if rmse <= FINE else COARSE_GOAL


def seconds(point):
    """From a changed scene to the picture: also what precedes the first sample, such as the choice of `auto`."""
    return point["setSceneSeconds"] + point["seconds"]


def instruction_sets(points):
    return list(dict.fromkeys(point["instructions"] for point in points))


def of_set(points, instructions):
    return [point for point in points if point["instructions"] == instructions]


def reaching(points, rmse):
    """Scolopax's fastest point with at most this error."""
    return min((p for p in points if p["rmse"] <= rmse), key=seconds, default=None)


def within(points, limit):
    """Scolopax's most accurate point that takes no longer than this."""
    return min((p for p in points if seconds(p) <= limit), key=lambda p: p["rmse"], default=None)


def named(point):
    step = "" if point["step"] is None else f", step {point['step']:g}"
    return f"{point['method']}{step}" + (f", {point['samples']} samples" if point["samples"] > 1 else "")


def milliseconds(value):
    return f"{1e3 * value:.3g} ms"


def times_less(ratio, wanted):
    """The ratio, in bold if it misses the goal; 0: none."""
    if ratio == 0:
        return "**-**"
    return f"{ratio:.3g}" if ratio >= wanted else f"**{ratio:.3g}**"


def ratio_of(vtk, points):
    """How many times faster the error of a point of VTK is reached; 0 if no measured point reaches it."""
    fast = reaching(points, vtk["rmse"])
    return vtk["seconds"] / seconds(fast) if fast else 0


def error_rows(found):
    sets = instruction_sets(found["scolopax"])
    for vtk in found["vtk"]:
        cells = []
        for points in (of_set(found["scolopax"], name) for name in sets):
            fast = reaching(points, vtk["rmse"])
            cells += [f"{milliseconds(seconds(fast))} ({named(fast)})" if fast else "-",
                      times_less(ratio_of(vtk, points), goal(vtk["rmse"]))]
        good = within(of_set(found["scolopax"], sets[0]), vtk["seconds"])
        yield [f"{vtk['voxels']}, step {vtk['step']:g}", milliseconds(vtk["seconds"]), f"{vtk['rmse']:.2e}", *cells,
               f"{good['rmse']:.2e} ({named(good)})" if good else "-"]


def frame_rows(light, sets):
    for vtk in light["vtk"]:
        cells = []
        for name in sets:
            ours = next(p for p in of_set(light["scolopax"], name) if p["step"] == vtk["step"])
            cells += [milliseconds(seconds(ours)), times_less(vtk["seconds"] / seconds(ours), FRAME_GOAL)]
        yield ["shaded" if light["shading"] else "unshaded", f"{vtk['step']:g}", milliseconds(vtk["seconds"]), *cells]


def goals_met(measured):
    """Sentences for each instruction set and goal."""
    sentences = []
    for name in instruction_sets(measured[0]["scolopax"]):
        ratios = {FINE_GOAL: [], COARSE_GOAL: []}
        for found in measured:
            for vtk in found["vtk"]:
                ratios[goal(vtk["rmse"])].append(ratio_of(vtk, of_set(found["scolopax"], name)))
        for (wanted, some), which in zip(ratios.items(), (f"up to {FINE:g}", f"above {FINE:g}")):
            if some:
                sentences.append(f"{NAMES[name]}: of {len(some)} errors {which}, {sum(ratio >= wanted for ratio in some)} are reached at "
                                 f"least {wanted:g} times faster; ratios {min(some):.3g} to {max(some):.3g}.")
    return "\n".join(sentences)


def floor(measured):
    """A sentence with the smallest errors of both."""
    vtk = [min(point["rmse"] for point in found["vtk"]) for found in measured]
    ours = [min(point["rmse"] for point in found["scolopax"]) for found in measured]
    return (f"Smallest error measured: VTK's {min(vtk):.1e} to {max(vtk):.1e}, "
            f"Scolopax's {min(ours):.1e} to {max(ours):.1e}.")


def drift(measured):
    """Largest ratio of VTK's median times before and after Scolopax's turn."""
    points = [point for found in measured for light in found.get("lights", [found]) for point in light["vtk"]]
    return max(max(point["drift"], 1 / point["drift"]) for point in points)


def set_columns(sets, *columns):
    return [f"{column}, {NAMES[name]}" for name in sets for column in columns]


def one_channel(measured):
    sets = instruction_sets(measured[0]["scolopax"])
    parts = [f"### {found['volume']}, {found['size']}x{found['size']}\n" +
             table(["VTK", "time", "RMSE", *set_columns(sets, "time here to that RMSE", "ratio of times"),
                    f"RMSE here in that time, {NAMES[sets[0]]}"], list(error_rows(found))) for found in measured]
    return (f"""## One channel: speed against error
Emission and absorption. The curve rises from 15 % of the range to an extinction of 0.05 per voxel. An empty layer around
the volume makes both boxes end at the same place. Errors are against the double-precision reference, with rays through
pixel centres. VTK also gets the volume as 16 bits (u16), which is slower and more accurate, because it interpolates in
the voxels' type. Times here are those from a changed scene to its picture, with the choice of `auto`. Goals: {FINE_GOAL:g} times
faster at every error of VTK up to {FINE:g}, {COARSE_GOAL:g} times at every other. In bold: misses its goal. -: no measured point is that
accurate or that fast.

{goals_met(measured)}
{floor(measured)}
VTK adds 15-bit numbers, which it looks up by rounded values. Its error has a floor, which smaller steps do not lower. The
marcher here keeps converging. Its start is jittered per pixel: at large steps its error is a blur along the ray and some
noise, while VTK's pictures have rings.

""" + "\n".join(parts))


def channels_together(measured):
    sets = instruction_sets(measured[0]["lights"][0]["scolopax"])
    rows = [row for found in measured for light in found["lights"] for row in frame_rows(light, sets)]
    size = measured[0]["size"]
    met = "; ".join(f"{NAMES[name]}: {sum('*' not in row[4 + 2 * i] for row in rows)} of {len(rows)}" for i, name in enumerate(sets))
    return f"""## Four channels: time per frame at equal step
MRI (tcga_du_7294: fla, t1, t1c, t2; i16) at {size}x{size}, one sample a pixel. VTK gets one volume of four independent
components. It sums them in its own way, so only times are compared. Its normals are computed and quantised before the
first frame, which is not counted, and then looked up. Here, gradients are computed where they are needed.

Frames that are at least {FRAME_GOAL} times faster here: {met}.

{table(["light", "step", "VTK", *set_columns(sets, "here", "ratio")], rows)}"""


def main(path):
    with open(path, encoding="utf-8") as file:
        found = json.load(file)
    measured = found["measured"]
    parts = [f"""# Beside VTK
Machine: {found['machine']}. VTK {found['vtk']}, vtkFixedPointVolumeRayCastMapper on all threads: only the time of its
ray casting, without display. All times are medians. VTK has as many rounds before Scolopax as after it; their medians
differ by {100 * (drift(measured) - 1):.0f} % at most. Steps in voxels. Made by `tests/bench/vtk.py out.json` and
`tests/bench/vtk_report.py out.json`.
"""]
    singles = [part for part in measured if "lights" not in part]
    multiples = [part for part in measured if "lights" in part]
    if singles:
        parts.append(one_channel(singles))
    if multiples:
        parts.append(channels_together(multiples))
    print("\n".join(parts), end="")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main(sys.argv[1])
