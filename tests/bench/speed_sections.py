# SPDX-License-Identifier: Apache-2.0
"""The report's sections of the experiments `speed`, `estimates` and `sessions`: how soon a picture has an error, and whether
the renderer knows its error. In bold: what misses its goal."""
from tables import number, table

TARGETS = ("0.01", "0.001", "0.0001", "1e-05")
STEPS = ("raymarch", "hybrid")
# Goal of the time of `auto`, relative to that of the best step, which is known only with hindsight.
RATIO_GOALS = {"0.01": 1.5, "0.001": 1.5, "0.0001": 0.5}
# Goal of the estimated error by number of samples: the share by which it may differ from the true one.
ESTIMATE_GOALS = {16: 0.25, 64: 0.2, 512: 0.2}
JUDGED = 1e-5  # smaller true errors are those of rounding and of the reference, which nobody estimates
SESSION_GOAL = 2e-4  # claimed error of a session at rest


def by_method(rows):
    found = {}
    for row in rows:
        found.setdefault(row["method"], []).append(row)
    return found


def most_samples(points):
    return max(points, key=lambda p: p["samples"])


def scenes_and_lights(entry):
    """(scene, light, what was found) of every scene and light."""
    return [(scene, light, found) for scene, lights in entry["found"].items() for light, found in lights.items()]


def bold(text, missed):
    return f"**{text}**" if missed else text


def best_step(times, target):
    """The row of raymarch or hybrid that reaches the error soonest; None if none does."""
    rows = [times[method] for method in STEPS if method in times and times[method][f"secondsToRmse{target}"] is not None]
    return min(rows, key=lambda row: row[f"secondsToRmse{target}"], default=None)


def ratio_to_best_step(times, target, without=0):
    """Time of `auto`, less the seconds `without`, divided by that of the best step; None if one of them does not reach the
    error."""
    own, best = times["auto"][f"secondsToRmse{target}"], best_step(times, target)
    return (own - without) / best[f"secondsToRmse{target}"] if own is not None and best else None


def misses(times, target):
    """Whether `auto` misses its goal: also if it does not reach the error, but not if only the steps do not."""
    if times["auto"][f"secondsToRmse{target}"] is None:
        return True
    ratio = ratio_to_best_step(times, target)
    return ratio is not None and ratio > RATIO_GOALS[target]


def choice_of(points):
    """What `auto` chose, and the seconds before its first sample."""
    last = most_samples([p for p in points if p["method"] == "auto"])
    chosen = last["choice"]
    step = "" if chosen["step"] is None else f", step {chosen['step']:g}" if chosen["step"] else ", whole cells"
    return f"{chosen['method']}{step}", last["setSceneSeconds"]


def smallest_error(points):
    return min(p["rmse"] for p in points if p["method"] == "auto")


def against_steps(entry):
    """The time of `auto` relative to the best step."""
    rows, unreached = [], []
    met, met_without = ({target: 0 for target in RATIO_GOALS} for _ in range(2))
    for scene, light, found in scenes_and_lights(entry):
        times = {row["method"]: row for row in found["timeToError"]}
        chosen, before = choice_of(found["points"])
        cells = []
        for target in RATIO_GOALS:
            own, best, ratio = times["auto"][f"secondsToRmse{target}"], best_step(times, target), ratio_to_best_step(times, target)
            without = ratio_to_best_step(times, target, before)
            met[target] += not misses(times, target)
            met_without[target] += own is not None and (without is None or without <= RATIO_GOALS[target])
            text = "-" if own is None else f"{number(own)} s, no step" if best is None else (
                f"x{number(ratio)} (x{number(without)}; {number(own)} s; {best['method']}, step {best[f'stepToRmse{target}']:g}: "
                f"{number(best[f'secondsToRmse{target}'])} s)")
            cells.append(bold(text, misses(times, target)))
        if times["auto"]["secondsToRmse0.001"] is None:
            unreached.append(f"{scene} ({light}): {smallest_error(found['points']):.1e}")
        rows.append([scene, light, chosen, f"{number(1e3 * before)} ms", *cells, f"{smallest_error(found['points']):.1e}"])
    count = len(rows)
    text = "; ".join(f"to {float(target):.0e} at most {goal:g} times its time: {met[target]} of {count} ({met_without[target]})"
                     for target, goal in RATIO_GOALS.items())
    reach = f"1e-3 is reached by {count - len(unreached)} of {count}" + (f"; not by {', '.join(unreached)}" if unreached else "") + "."
    return (f"## `auto` against the best step\nThe best step of raymarch or hybrid is known only with hindsight. Times include what "
            "precedes the first sample, for `auto` its choice;\nin brackets first: without it. In bold: misses its goal. Goals, and how "
            f"many meet them: {text}.\n{reach}\n\n" + table(["scene", "light", "chosen", "before the first sample",
                                    *(f"RMSE {float(target):.0e}" for target in RATIO_GOALS), "smallest RMSE measured"], rows))


def to_error(entry, target):
    """A table of the times of all methods to one error."""
    rows, methods = [], list(dict.fromkeys(row["method"] for *_, found in scenes_and_lights(entry) for row in found["timeToError"]))
    for scene, light, found in scenes_and_lights(entry):
        times = {row["method"]: row for row in found["timeToError"]}
        sync, cells = times["sync-dda"][f"secondsToRmse{target}"], []
        for method in (m for m in methods if m != "sync-dda"):
            value = times[method][f"secondsToRmse{target}"] if method in times else None
            step = times[method][f"stepToRmse{target}"] if method in times and method in STEPS else None
            cells.append("-" if value is None else f"x{number(sync / value)} ({number(value)} s" +
                         ("" if step is None else f", step {step:g}") + ")")
        rows.append([scene, light, f"{number(sync)} s", *cells])
    return table(["scene", "light", "sync-dda", *(m for m in methods if m != "sync-dda")], rows)


def costs(entry):
    """Counts and errors of the most samples measured."""
    rows = []
    for scene, light, found in scenes_and_lights(entry):
        for method, points in by_method(found["points"]).items():
            chosen = [p for p in points if p["step"] in (None, 1)] or points
            best = most_samples([p for p in chosen if "efficiencyToSyncDda" in p] or chosen)
            rows.append([scene, light, method, best["samples"], number(best["nsPerRay"]), f"{best['rmse']:.1e}",
                         f"{best['flip']:.4f}", f"{best['bias']:.0e}", number(best["fetchesPerRay"]), number(best["cellStepsPerRay"]),
                         number(best["randomBlocksPerRay"]), number(best.get("efficiencyToSyncDda"))])
    return table(["scene", "light", "method", "samples", "ns/ray", "RMSE", "FLIP", "bias", "fetches", "cells", "randoms", "to sync"],
                 rows)


def speed(entry, plot):
    return (against_steps(entry) + "".join(f"\n## Time to RMSE {float(target):.0e}\n\n{to_error(entry, target)}" for target in TARGETS) +
            "\nThe time of sync-dda, and how many times less the other methods take in the same run. For trackers it is extrapolated "
            "by the law of\ntheir noise from the most samples measured. For methods with a step it is that of the best measured step "
            "(0: whole voxel cells),\nwhere more samples reduce the noise if the bias is small enough. For `auto` it lies between two "
            "measured points. -: not reached.\n\n## Counts and errors\nThe most samples measured, steps of one voxel; where possible, as "
            "many samples as of sync-dda. Fetches, macrocells and random blocks\nare per ray, with those of corrections as far as they "
            "were counted. The last column is the ratio of 1 / (MSE x seconds) to that of\nsync-dda.\n\n" + costs(entry))


def estimates(entry, plot):
    """Claimed error divided by the true one."""
    rows, missed, count = [], 0, 0
    filters = [(scene, light, kind, points) for scene, light, kinds in scenes_and_lights(entry) for kind, points in kinds.items()]
    for scene, light, kind, points in filters:
        cells = []
        for point in points:
            ratio = point["estimateToError"]
            judged = point["rmse"] >= JUDGED
            off = judged and abs(ratio - 1) > ESTIMATE_GOALS[point["samples"]]
            missed, count = missed + off, count + judged
            cells += [f"{point['rmse']:.1e}", bold(f"{ratio:.2f}", off)]
        rows.append([scene, light, kind, choice_of(points)[0], *cells])
    counts = [point["samples"] for point in filters[0][3]]
    goals = ", ".join(f"{100 * share:.0f} % at {samples}" for samples, share in ESTIMATE_GOALS.items())
    return (f"RMSE of ten pictures with seeds of their own, and the median of their claimed errors divided by their true ones. Goals: "
            f"within {goals}\nsamples. In bold: off by more, {missed} of {count}. Errors below {JUDGED:.0e} are not judged: through "
            "pixel centres (point),\nunlit pictures have hardly any noise. Pixels with an area (box) are compared with pictures of 8192 "
            "samples, whose noise adds at most\n1/16 to squared errors.\n\n" +
            table(["scene", "light", "filter", "chosen",
                   *(text for n in counts for text in (f"RMSE, {n} samples", "claimed / true"))], rows))


def sessions(entry, plot):
    rows, sentences = [], []
    for kind, found in entry["found"].items():
        rows += [[kind, row["samples"], number(row["seconds"]), f"{row['claimed']:.2e}", f"{row['true']:.2e}"] for row in found]
        last = found[-1]
        sentences.append(bold(f"{kind}: {last['claimed']:.1e} claimed and {last['true']:.1e} true after {last['samples']} samples.",
                              last["claimed"] >= SESSION_GOAL))
    return (f"The claimed error should fall below {SESSION_GOAL:g}. {' '.join(sentences)}\nTrue errors are over one pixel in a block of "
            "32 x 32. The reference of pixels with an area (box) has 128 rays in each, and noise of its\nown. A session without `stop` "
            "ends at 4096 samples.\n\n" + table(["filter", "samples", "seconds", "claimed error", "true error"], rows))
