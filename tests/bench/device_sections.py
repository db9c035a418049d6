# SPDX-License-Identifier: Apache-2.0
"""The report's sections on CUDA devices: measured on one (tests/cuda/on_device.sh), and counted without (ptx_costs)."""
from tables import number, table

LIGHTS = ("emission-absorption", "shading", "shadows", "both")
# Frames a second on an RTX 4090 with the paper's fastest method, 1-DDA, at the best size of macrocells (section 5.1).
# Shading: only that it takes 0.9 % longer on average; neither the pictures' size nor both effects together are given.
PAPER = {"NASA DYAMOND ROI (4)": (170, 118), "NYX (4)": (291, 178), "Hurricane (4)": (504, 286), "Miranda (4)": (453, 299),
         "Zebrafish (3)": (686, 577)}


def paper_rows():
    return [[f"paper, RTX 4090: {name}", "", "1-DDA", number(plain), f"({number(plain / 1.009)})", number(shadows), "-"]
            for name, (plain, shadows) in PAPER.items()]


def fps(ms):
    return "-" if ms is None else number(1000 / ms)


def machine_of(found):
    """The machine's name, for the head of the report."""
    device = found.get("device")
    if not device:
        return "none"
    driver, runtime = (f"{device[name] // 1000}.{device[name] % 1000 // 10}" for name in ("driver", "runtime"))
    return (f"{device['name']}, compute capability {device['capability']}, {device['memoryBytes'] / 2**30:.0f} GiB, "
            f"CUDA {runtime}, driver for {driver}; {found['processor']}")


def speeds(bench):
    """Frames a second by light; the paper's beside them."""
    rows = []
    frames = bench["frames"] if bench else []
    found = {(f["channels"], f["width"], f["height"], f["method"], f["macrocell"], f["light"]): f for f in frames}
    for channels, width, height, method, macrocell in dict.fromkeys(key[:5] for key in found):
        if macrocell != 4:
            continue
        cells = []
        for light in LIGHTS:
            frame = found.get((channels, width, height, method, macrocell, light))
            cells.append(f"{fps(frame['kernelMs'])} ({fps(frame['frameMs'])})" if frame else "-")
        rows.append([f"orbitals ({channels})", f"{width}x{height}", method, *cells])
    if not rows:
        rows = [["orbitals (4), (12)", "1024x1024, 2560x1440", "superposed, sync-dda, ...", "", "", "", ""]]
    return (table(["data (channels)", "picture", "method", *LIGHTS], rows + paper_rows()) +
            "\nThe paper's 1-DDA is sync-dda; in brackets: its rate without shading, less the 0.9 % that shading costs on average.\n")


def by_macrocell(bench):
    found = {}
    for f in bench["frames"]:
        if f["light"] in ("emission-absorption", "both") and (f["width"], f["height"]) == (1024, 1024):
            found.setdefault((f["channels"], f["light"], f["method"]), {})[f["macrocell"]] = f["kernelMs"]
    sizes = sorted({size for row in found.values() for size in row})
    return table(["channels", "light", "method", *(f"{size} voxels" for size in sizes)],
                 [[*key, *(fps(row.get(size)) for size in sizes)] for key, row in found.items()])


def edits(bench):
    rows = [[e["channels"], e["light"], e["method"] + (f" ({e['chosen']})" if e["method"] == "auto" else ""),
             *(number(e[name]) for name in ("frameMs", "frameP95Ms", "sceneMs", "rebuildMs"))] for e in bench["edits"]]
    return table(["channels", "light", "method", "edit to frame, ms", "p95", "scene set after", "majorants, host"], rows)


def rebuilding(bench):
    rows = [[r["channels"], r["macrocell"], r["cells"], number(r["hostMs"]), number(r["kernelMs"]), number(r["sceneMs"])]
            for r in bench["rebuild"]]
    return table(["channels", "macrocell", "cells", "host, ms", "kernel, ms", "until the scene is on the device, ms"], rows)


def bounds(steps):
    text = ""
    for name in ("ncu_auto", "ncu_superposed"):
        found = steps[name]
        if "bound" not in found:
            text += f"- {name.removeprefix('ncu_')}: not profiled ({found['status']}).\n"
            continue
        metrics = ", ".join(f"{metric} {number(value)} {unit}" for metric, values in found["metrics"].items()
                            for unit, value in values.items())
        levels = ", ".join(f"{level} {number(value)} %" for level, value in found["levelPercents"].items())
        frame = found["frame"] or {"method": name.removeprefix("ncu_"), "step": None}
        step = f", step {frame['step']:g}" if frame["method"] in ("raymarch", "hybrid") and frame["step"] is not None else ""
        chosen = "auto's choice, " if name == "ncu_auto" else ""
        text += (f"- {chosen}{frame['method']}{step}: bound by **{found['bound']}**; instructions "
                 f"{number(found['computePercent'])} % of the peak, memory {number(found['memoryPercent'])} % ({levels}). {metrics}.\n")
    return text


def checks(found):
    steps, bench = found["steps"], found["bench"]
    parity = steps["parity"]
    rows = [["pictures have the CPU's bits", parity["status"] if "tests" not in parity else
             f"{parity['status']}: {parity['tests']} tests, {len(parity['failed'])} failed, {parity['skipped']} skipped"]]
    if bench:
        different = sum(p["different"] for p in bench["parity"])
        rows.append(["so have larger ones", f"{different} of {sum(p['pixels'] for p in bench['parity'])} pixels differ"])
    for name in ("memcheck", "racecheck"):
        count = steps[name].get("found")
        rows.append([name, steps[name]["status"] + ("" if count is None else f": {count} found")])
    failed = [f"{name}: {step['output'].splitlines()[-1]}" for name, step in steps.items() if step.get("output")]
    return table(["check", "outcome"], rows) + "".join(f"\n{line}\n" for line in failed)


def gpu(entry, plot):
    found = entry["found"]
    if "skipped" in found:
        return (f"No device has been measured yet ({found['skipped']} where `tests/cuda/on_device.sh` ran): our columns are "
                "empty. The kernels are\nchecked bit for bit without a device (tests/README.md).\n\n## Frames a second\n\n" +
                speeds(None))
    bench = found["bench"]
    text = f"## Checks\n\n{checks(found)}\n## Frames a second\n"
    if bench:
        text += (f"\nVolumes of {bench['edge']}^3 voxels of 16 bits, macrocells of 4 voxels, marchers' steps of one voxel. One "
                 "sample a pixel in one kernel, left on\nthe device, as the paper's; in brackets as the server renders it, with "
                 "its copy and sum in the host's memory." +
                 ("" if bench["complete"] else " The time was not enough\nfor all points.") + "\n")
    text += "\n" + speeds(bench)
    if bench:
        text += (f"\n## Sizes of macrocells\n\nThe same kernels a second, at 1024x1024.\n\n{by_macrocell(bench)}\n## Edits\n\n"
                 f"Of one curve, at 1024x1024, until the frame is in the host's memory.\n\n{edits(bench)}\n"
                 f"## Rebuilding majorants\n\nAfter that edit.\n\n{rebuilding(bench)}")
    return (text + "\n## What bounds the kernels\n\n4 channels, emission and absorption, 1024x1024.\n\n" +
            bounds(found["steps"]))


PRINTED = "sync-dda, as printed"


def proxies(entry, plot):
    def cell(point, printed):
        fewer = number(printed["instructions"] / point["instructions"])
        return f"{number(point['instructions'])} ({fewer}) · {number(point['loads'])} · {number(point['bytes'])}"

    text = ""
    for light in LIGHTS:
        rows, methods = [], []
        for scene, found in entry["found"].items():
            points = {p["method"]: p for p in found["points"] if p["light"] == light}
            methods = [PRINTED, *(m for m in points if m != PRINTED)]
            rows.append([f"{scene} ({found['channels']})", *(cell(points[m], points[PRINTED]) for m in methods)])
        text += f"## {light}\n\n{table(['scene (channels)', *methods], rows)}\n"
    first = next(iter(entry["found"].values()))
    points = [p for found in entry["found"].values() for p in found["points"] if p["bytes"]]
    local = max((p["localBytes"] / p["bytes"] for p in points), default=0)
    return (f"Per ray of {first['width']}x{first['height']} pixels, macrocells of the scene ({first['macrocell']}), steps of one voxel, "
            f"PTX by {first['compiler']}: instructions (and how many times fewer\nthan the printed listing takes) · loads · "
            f"bytes from global memory. Local memory adds at most {number(local)} times those bytes.\n\n" + text)
