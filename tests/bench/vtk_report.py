#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Tables of vtk.py's measurements, as Markdown: vtk_report.py IN.json > OUT.md"""
import json
import sys

from tables import table

BAR = 5  # the goal: this many times faster than VTK


def reaching(points, rmse):
    """Scolopax's fastest point with at most this error."""
    return min((p for p in points if p["rmse"] <= rmse), key=lambda p: p["seconds"], default=None)


def within(points, seconds):
    """Scolopax's most accurate point that takes no longer than this."""
    return min((p for p in points if p["seconds"] <= seconds), key=lambda p: p["rmse"], default=None)


def named(point):
    return f"{point['method']}, step {point['step']:g}" if point["step"] else f"{point['method']} x{point['samples']}"


def milliseconds(seconds):
    return f"{1e3 * seconds:.3g} ms"


def times_less(ratio):
    """The ratio, in bold if it is below BAR."""
    return f"{ratio:.3g}" if ratio >= BAR else f"**{ratio:.3g}**"


def error_rows(found):
    for vtk in found["vtk"]:
        fast = reaching(found["scolopax"], vtk["rmse"])
        good = within(found["scolopax"], vtk["seconds"])
        yield [f"{vtk['voxels']}, step {vtk['step']:g}", milliseconds(vtk["seconds"]), f"{vtk['rmse']:.2e}",
               f"{milliseconds(fast['seconds'])} ({named(fast)})" if fast else "-",
               times_less(vtk["seconds"] / fast["seconds"]) if fast else "-",
               f"{good['rmse']:.2e} ({named(good)})" if good else "-",
               f"{vtk['rmse'] / good['rmse']:.3g}" if good else "-"]


def frame_rows(light):
    points = {p["step"]: p for p in light["scolopax"] if p["method"] == "raymarch"}
    for vtk in light["vtk"]:
        ours = points[vtk["step"]]
        yield ["shaded" if light["shading"] else "unshaded", f"{vtk['step']:g}", milliseconds(vtk["seconds"]),
               milliseconds(ours["seconds"]), times_less(vtk["seconds"] / ours["seconds"])]


def summary(rows, ratio, what):
    """One sentence with the numbers; their interpretation is written by hand."""
    ratios = [float(row[ratio].strip("*")) for row in rows if row[ratio] != "-"]
    missed = len(rows) - sum(value >= BAR for value in ratios)
    return (f"Of {len(rows)} {what}, {len(rows) - missed} are at least {BAR} times faster here; "
            f"the ratio is {min(ratios):.3g} to {max(ratios):.3g}.")


def floor(measured):
    """A sentence with the smallest errors of both."""
    singles = [found for found in measured if "lights" not in found]
    vtk = [min(point["rmse"] for point in found["vtk"]) for found in singles]
    ours = [min(point["rmse"] for point in found["scolopax"]) for found in singles]
    return (f"Smallest error measured: VTK's {min(vtk):.1e} to {max(vtk):.1e}, "
            f"Scolopax's {min(ours):.1e} to {max(ours):.1e}.")


def drift(measured):
    """Largest ratio of VTK's median times before and after Scolopax's turn."""
    points = [point for found in measured for light in found.get("lights", [found]) for point in light["vtk"]]
    return max(max(point["drift"], 1 / point["drift"]) for point in points)


def one_channel(measured):
    parts, all_rows = [], []
    for found in measured:
        rows = list(error_rows(found))
        all_rows += rows
        parts.append(f"### {found['volume']}, {found['size']}x{found['size']}\n" +
                     table(["VTK", "time", "RMSE", "time here to that RMSE", "ratio of times", "RMSE here in that time",
                            "ratio of errors"], rows))
    return (f"""## One channel: speed against error
Emission and absorption. The curve rises from 15 % of the range to an extinction of 0.05 per voxel. An empty layer around
the volume makes both boxes end at the same place. Errors are against the double-precision reference, with rays through
pixel centres. VTK also gets the volume as 16 bits (u16), which is slower and more accurate, because it interpolates in
the voxels' type. In bold: less than {BAR} times faster. -: no measured step is that accurate or that fast.

{summary(all_rows, 4, "errors that VTK reaches")} {floor(measured)}
VTK adds 15-bit numbers, which it looks up by rounded values. Its error has a floor, which smaller steps do not lower. The
marcher here keeps converging. Its start is jittered per pixel: at large steps its error is a blur along the ray and some
noise, while VTK's pictures have rings.

""" + "\n".join(parts))


def channels_together(measured):
    rows = [row for found in measured for light in found["lights"] for row in frame_rows(light)]
    size = measured[0]["size"]
    return f"""## Four channels: time per frame at equal step
MRI (tcga_du_7294: fla, t1, t1c, t2; i16) at {size}x{size}, one sample a pixel. VTK gets one volume of four independent
components. It sums them in its own way, so only times are compared. Its normals are computed and quantised before the
first frame, which is not counted, and then looked up. Here, gradients are computed where they are needed.

{summary(rows, 4, "frames")}

{table(["light", "step", "VTK", "here", "ratio"], rows)}"""


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
