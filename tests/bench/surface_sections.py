# SPDX-License-Identifier: Apache-2.0
"""The report's section of the experiment `surfaces`: what Knoll et al. 2009 show in figures 3 to 7 and tables 1 and 2."""
import base64
import math

from plots import lines
from tables import number, table

# Table 1 of the paper: samples per ray with peak finding and without, frames per second with peak finding,
# postclassification and preintegration.
PAPER_TABLE1 = [("heptane (f. 3)", 190, 120, 7.1, 11.6, 8.8), ("heptane (f. 5b)", 117, 58, 8.2, 17.0, 12.3),
                ("heptane (f. 5c)", 230, 54, 10.6, 18.0, 12.7), ("zebrafish (f. 4)", 1030, 165, 2.1, 2.0, 1.7),
                ("aneurism (f. 6)", 561, 342, 5.3, 8.6, 7.0), ("fireset (f. 6)", 336, 193, 6.6, 9.5, 7.3),
                ("backpack (f. 7)", 1078, 633, 2.1, 2.9, 2.1)]
# Table 2, converged: samples per ray and frames per second, uniform and differential.
PAPER_TABLE2 = [("aneurism, close", "postclassification", 1433, 483, 2.0, 6.4),
                ("aneurism, close", "peak finding", 1419, 700, 2.4, 4.2),
                ("fireset, close", "postclassification", 2123, 772, 1.1, 3.1),
                ("fireset, close", "peak finding", 1441, 527, 2.2, 4.6),
                ("aneurism, far", "postclassification", 343, 113, 5.8, 13),
                ("aneurism, far", "peak finding", 471, 174, 4.3, 7.1),
                ("backpack, far", "postclassification", 640, 748, 2.7, 2.4),
                ("backpack, far", "peak finding", 1794, 1865, 1.6, 1.6)]
PAPER_COUNT = 4  # s_k of the paper


def error(row):
    return f"{row['rmse']:.1e}"


def times(row, base):
    return f"x{number(row['seconds'] / base['seconds'], 2)}"


def picture(figure, name, plot):
    return plot(f"surfaces-{name}", base64.b64decode(figure["sheet"])) + "\n\n"


def by_name(rows):
    return {row["name"]: row for row in rows}


def errors_and_times(found, names):
    """A table of RMSE and of times relative to the first setting of each run."""
    rows = []
    for entry in found:
        named = by_name(entry["rows"])
        rows.append([f"{entry['volume']}, {entry['light']}", f"{entry['width']:g}",
                     *(f"{error(named[name])} ({times(named[name], entry['rows'][0])})" for name in names)])
    return table(["volume", "width", *names], rows)


def one_scene(rows):
    """A table with a row for each setting: errors, fetches, and time relative to the first."""
    return table(["method", "RMSE", "largest error", "fetches per pixel", "time"],
                 [[row["name"], error(row), f"{row['max']:.2g}", number(row["fetchesPerPixel"]), times(row, rows[0])]
                  for row in rows])


def figure3(found, plot):
    names = [row["name"] for row in found["figure3"]["found"][0]["rows"]]
    return ("## Figure 3: a narrow peak beside a smooth part\n" + picture(found["figure3"], "figure3", plot) +
            "Columns: postclassification, preintegration, peak finding (either), ours (auto, peaks both). Rows: peaks of width "
            "1e-2 and 1e-4 of the range.\n\nRMSE, and in brackets the time relative to postclassification (the paper, heptane: "
            "peak finding x1.6, preintegration x1.3).\nAgainst the curve's integral:\n\n" +
            errors_and_times(found["figure3"]["found"], names[:5]) +
            "\nAgainst the reference with surfaces at the peaks, beside the curve or, the last two, alone:\n\n" +
            errors_and_times(found["figure3"]["found"], names[5:]) +
            "\nPeaks of one area, the narrower the denser, against the curve's integral:\n\n" +
            errors_and_times(found["spikes"], names[:5]))


def figure4(found, plot):
    figure = found["figure4"]
    return (f"\n## Figure 4: noisy data ({figure['volume']})\n" + picture(figure, "figure4", plot) +
            "Peak finding (either), preintegration, ours with surfaces alone, ours (auto) with surfaces and curve. The first "
            "two against the\ncurve's integral, the others against the reference with surfaces (the paper, relative to preintegration: "
            "peak finding x0.95,\nsurfaces alone x0.47).\n\n" + one_scene(figure["found"]))


def figure5(found, plot):
    figure = found["figure5"]
    return (f"\n## Figure 5: several peaks, and a smooth curve ({figure['volume']})\n" + picture(figure, "figure5", plot) +
            "Above: six peaks at a step of two voxels, of which one or four are found in a segment; ours, raymarch and auto. Below: "
            "a smooth curve with\npostclassification, peak finding, and surfaces alone; ours with isovalues of 16 times the peak's "
            "extinction.\n\nSeveral peaks, against the reference with surfaces (the paper: four peaks x1.3 of one):\n\n" +
            one_scene(figure["found"]["several"]) +
            "\nSmooth curve, against its integral, to which surfaces are a bias; `only` against surfaces alone (the paper: peak "
            "finding x1.8,\nsurfaces alone x1.3):\n\n" + one_scene(figure["found"]["smooth"]))


def between(points, x, y, wanted):
    """y where x has the wanted value, interpolated in logarithms between the points around it; None outside."""
    ordered = sorted(((point[x], point[y]) for point in points), key=lambda pair: pair[0])
    for (x0, y0), (x1, y1) in zip(ordered, ordered[1:]):
        if x0 <= wanted <= x1 and x0 < x1:
            w = math.log(wanted / x0) / math.log(x1 / x0)
            return math.exp((1 - w) * math.log(y0) + w * math.log(y1))
    return None


def ratio(value, base):
    return "-" if value is None else f"x{number(value / base)}"


def rates(found):
    """Rows of equal steps compared with differential sampling: at the same number of samples, and at the same error."""
    rows = []
    for entry in found:
        equal = [row for row in entry["rows"] if row["name"] == "uniform"]
        growing = next(row for row in entry["rows"] if row.get("count") == PAPER_COUNT)
        rows.append([f"{entry['volume']}, {entry['view']}", entry["name"], number(growing["samplesPerPixel"]), error(growing),
                     ratio(between(equal, "samplesPerPixel", "rmse", growing["samplesPerPixel"]), growing["rmse"]),
                     ratio(between(equal, "rmse", "samplesPerPixel", growing["rmse"]), growing["samplesPerPixel"]),
                     ratio(between(equal, "rmse", "seconds", growing["rmse"]), growing["seconds"])])
    return rows


def panels(found):
    return [(f"{entry['volume']}, {entry['name']}",
             [(kind, [row["samplesPerPixel"] for row in entry["rows"] if row["name"] == kind],
               [row["rmse"] for row in entry["rows"] if row["name"] == kind]) for kind in ("uniform", "differential")])
            for entry in found]


def differential(found, plot):
    text, rows = "", []
    for name, title in (("figure6", "Figure 6: close views"), ("figure7", "Figure 7: far views")):
        if not found[name]:
            continue
        text += (f"\n## {title}\n" + picture(found[name], name, plot) +
                 "Columns: postclassification with equal steps, with differential sampling (s_k = 4) of about as many samples, and the "
                 "same with\nB-splines; peak finding with the same three.\n\n" +
                 plot(f"surfaces-{name}-rates", lines(panels(found[name]["found"]), "samples per ray", "RMSE")) + "\n")
        rows += rates(found[name]["found"])
    rows += [[f"paper: {scene}", kind, growing, "", "", f"x{number(equal / growing)}", f"x{number(growing_fps / equal_fps)}"]
             for scene, kind, equal, growing, equal_fps, growing_fps in PAPER_TABLE2]
    return (text + "\n## Table 2: equal steps against differential sampling\nSamples per ray and RMSE of differential sampling at "
            "s_k = 4. Relative to them, equal steps: their RMSE at as many samples, and\ntheir samples and time at the same RMSE "
            "(interpolated; -: outside of what was measured). The paper judged by eye which pictures\nare alike.\n\n" +
            table(["scene", "method", "samples", "RMSE", "RMSE of equal steps", "samples of equal steps", "time of equal steps"], rows))


def table1(found):
    rows, names = [], []
    for entry in found:
        named = by_name(entry["rows"])
        plain, peaks = named.pop("postclassification"), named.pop("peak finding")
        names = list(named)
        rows.append([f"{entry['volume']}, {entry['view']}", number(peaks["samplesPerPixel"]), number(plain["samplesPerPixel"]),
                     error(peaks), times(plain, peaks), *(f"{times(row, peaks)} ({error(row)})" for row in named.values())])
    rows += [[f"paper: {scene}", samples, plain, "", f"x{number(pf / pc, 2)}", f"x{number(pf / pi, 2)}", *[""] * (len(names) - 1)]
             for scene, samples, plain, pf, pc, pi in PAPER_TABLE1]
    return ("\n## Table 1: samples and times\nDifferential sampling, s_k = 4, peak finding `either`, peaks of width 1e-4. Times are "
            "relative to peak finding's in the same run; in\nbrackets the RMSE, of preintegration against the curve's integral, of "
            "the others against the reference with surfaces.\n\n" +
            table(["scene", "samples, peak finding", "samples, without", "RMSE, peak finding", "postclassification", *names], rows))


def adaptive(found):
    text = ("\n## Adaptive steps\nA smooth curve with preintegration; steps are multiples of a quarter of a voxel that follow the "
            "variance of a macrocell's voxels (section\n6.2), our bounds of the error of linear interpolation, the light that is "
            "left, or the change of the value from one sample to the\nnext. Without leaps: as uniform, 0.25, but every macrocell of an "
            "empty block is visited. The last columns: what equal steps\nneed for the same error.\n")
    for entry in found:
        equal = [row for row in entry["rows"] if row["name"] == "uniform"]
        rows = []
        for row in entry["rows"]:
            is_equal = row["name"] == "uniform"
            compared = ["", ""] if is_equal or row["samplesPerPixel"] is None else [
                ratio(between(equal, "rmse", key, row["rmse"]), row[key]) for key in ("samplesPerPixel", "seconds")]
            rows.append([f"uniform, {row['step']:g}" if is_equal else row["name"], number(row["samplesPerPixel"]), error(row), *compared])
        text += f"\n{entry['volume']}:\n\n" + table(["steps", "samples", "RMSE", "samples of equal steps", "time of equal steps"], rows)
    return text


def surfaces(entry, plot):
    found = entry["found"]
    return ("The paper's methods are in `tests/bench/peaks/`: postclassification, preintegration in a table of 256^2 or 1024^2 "
            "entries, peak finding\nwith a table of 128^2, three secant steps and four peaks a segment, and differential sampling. "
            "They skip the same macrocells as ours,\nhave its shading, and like ours march one ray at a time here (ours can march "
            "sixteen). The paper's equations for differential\nsampling are missing from our text; here the step is s_k footprints, "
            "of pictures 1024 pixels high, where the volume is nearest and\nwhere it is farthest. Of the paper's volumes we have "
            "heptane. B-splines are the scene's `interpolation` cubic, against the reference with the same. `either` is the paper's "
            "exclusive-or,\n`both` its default. Errors are over every third pixel each way.\n\n" +
            figure3(found, plot) + figure4(found, plot) + figure5(found, plot) +
            differential(found, plot) + table1(found["table1"]) + adaptive(found["adaptive"]))
