# SPDX-License-Identifier: Apache-2.0
"""The report's harness: what it keeps, what it measures again, and what it makes of the numbers. A stand-in for the program
counts how often it is asked."""
import json
import os
import stat
import subprocess
import sys
import tempfile
import unittest

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path[:0] = [HERE]
import speed_sections  # noqa: E402
import vtk_report  # noqa: E402
from store import Store  # noqa: E402
from truths import Truths  # noqa: E402

# Writes what it is asked for, a line for each call into `calls`, and fails at the bench calls that `fail` numbers.
STAND_IN = f"#!{sys.executable}" + """
import json, os, sys
folder = os.path.dirname(os.path.abspath(__file__))
with open(os.path.join(folder, "calls"), "a") as file:
    file.write(json.dumps(sys.argv[1:]) + "\\n")
with open(os.path.join(folder, "calls")) as file:
    benches = sum(json.loads(line)[0] == "bench" for line in file)
option = lambda name: sys.argv[sys.argv.index(name) + 1]
if sys.argv[1] == "info":
    print("cpu      2 threads, " + os.environ.get("SCOLOPAX_INSTRUCTIONS", "AVX-512"))
elif sys.argv[1] == "generate":
    open(sys.argv[3], "w").write("voxels")
elif sys.argv[1] == "reference":
    open(option("-o"), "w").write("picture")
elif sys.argv[1] == "bench":
    if str(benches) == os.environ.get("FAIL"):
        sys.exit(1)
    json.dump({"scene": {}, "points": [], "timeToError": [], "call": benches}, open(option("--json"), "w"))
"""


class WithFolder(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = folder.name

    def path(self, name):
        return os.path.join(self.folder, name)

    def write(self, name, text):
        with open(self.path(name), "w", encoding="utf-8") as file:
            file.write(text)
        return self.path(name)


class StandIn(WithFolder):
    def setUp(self):
        super().setUp()
        self.program = self.write("stand-in", STAND_IN)
        os.chmod(self.program, stat.S_IRWXU)

    def calls(self, command):
        if not os.path.exists(self.path("calls")):
            return []
        with open(self.path("calls"), encoding="utf-8") as file:
            return [words for words in map(json.loads, file) if words[0] == command]


class Kept(WithFolder):
    def test_is_not_measured_twice_but_with_another_key(self):
        measured = []

        def measure(what):
            measured.append(what)
            return {"found": what}

        for _ in range(2):  # two runs
            store = Store(self.path("parts"))
            self.assertEqual(store.get({"scene": "a", "steps": [1, 2]}, lambda: measure(1)), {"found": 1})
            self.assertEqual(store.get({"steps": [1, 2], "scene": "a"}, lambda: measure(2)), {"found": 1})
            self.assertEqual(store.get({"scene": "a", "steps": [2, 1]}, lambda: measure(3)), {"found": 3})
        self.assertEqual(measured, [1, 3])
        again = Store(self.path("parts"), again=True)
        self.assertEqual(again.get({"scene": "a", "steps": [1, 2]}, lambda: measure(4)), {"found": 4})
        self.assertEqual(again.get({"scene": "a", "steps": [1, 2]}, lambda: measure(5)), {"found": 4})
        self.assertEqual(Store(None).get({}, lambda: 6), 6)

    def test_is_nothing_of_a_measurement_that_failed(self):
        store = Store(self.path("parts"))
        with self.assertRaises(ZeroDivisionError):
            store.get({}, lambda: 1 / 0)
        self.assertEqual(os.listdir(self.path("parts")), [])
        self.assertEqual(store.get({}, lambda: 1), 1)

    def test_has_the_seconds_of_when_it_was_measured(self):
        first, second = Store(self.path("parts")), Store(self.path("parts"))
        for store in (first, second):
            store.get({}, lambda: sum(range(10**6)))
        self.assertEqual(first.seconds, second.seconds)
        self.assertGreater(first.seconds, 0)


class TruthPictures(StandIn):
    def test_are_rendered_once_for_all_that_they_depend_on(self):
        scene, data = self.write("scene.json", '{"shading": true}'), self.write("a.raw", "1234")
        truths = Truths(self.program, self.path("truths"))
        first = truths.picture(scene, [data], {"image.width": 8})
        self.assertEqual(truths.picture(scene, [data], {"image.width": 8}), first)
        self.assertEqual(len(self.calls("reference")), 1)
        others = [truths.picture(scene, [data], {"image.width": 9}), truths.picture(scene, [data], {"image.width": 8}, every=2),
                  truths.picture(scene, [data], {"image.width": 8}, samples_per_axis=2)]
        self.write("a.raw", "1235")  # other voxels in a file of the same name and size
        os.utime(data, ns=(1, 1))
        others.append(truths.picture(scene, [data], {"image.width": 8}))
        self.write("scene.json", "{}")
        others.append(truths.picture(scene, [data], {"image.width": 8}))
        self.assertEqual(len({first, *others}), 6)
        self.assertEqual(len(self.calls("reference")), 6)

    def test_are_a_hundred_times_as_exact_in_light_as_the_errors_measured_need(self):
        truths, scene = Truths(self.program, self.path("truths")), self.write("scene.json", "{}")
        for settings, tolerance in (({"shading": True}, 1e-6), ({"shadows": True}, 1e-6), ({"shadows": False}, 1e-7)):
            truths.picture(scene, [], settings)
            words = self.calls("reference")[-1]
            self.assertEqual(float(words[words.index("--tolerance") + 1]), tolerance)


class Run(StandIn):
    def run_speed(self, *options, **environment):
        """The exit status. Without the data sets, the scenes are those of orbitals."""
        clean = {name: value for name, value in os.environ.items() if not name.startswith("SCOLOPAX")}
        return subprocess.run([sys.executable, os.path.join(HERE, "run.py"), self.path("out.json"), "speed", "--quick", *options],
                              env={**clean, "SCOLOPAX": self.program, "SCOLOPAX_DATA_DIR": self.path("none"), **environment},
                              stderr=subprocess.DEVNULL, check=False).returncode

    def measured(self):
        with open(self.path("out.json"), encoding="utf-8") as file:
            return json.load(file)["speed"]

    def test_that_was_interrupted_continues_where_it_stopped(self):
        self.assertNotEqual(self.run_speed(FAIL="2"), 0)
        self.assertFalse(self.measured()["complete"])
        self.assertEqual(list(self.measured()["found"]["orbitals"]), ["emission-absorption"])
        self.assertEqual(self.run_speed(), 0)
        self.assertTrue(self.measured()["complete"])
        found = self.measured()["found"]["orbitals"]
        self.assertEqual({light: result["call"] for light, result in found.items()}, {"emission-absorption": 1, "both": 3})
        self.assertEqual(len(self.calls("reference")), 2)
        self.assertEqual(self.run_speed(), 0)
        self.assertEqual(len(self.calls("bench")), 3)
        self.assertEqual(self.run_speed("--again"), 0)
        self.assertEqual(len(self.calls("bench")), 5)

    def test_measures_anew_what_another_program_or_other_instructions_measured(self):
        self.assertEqual(self.run_speed(), 0)
        self.assertIn("AVX-512", self.measured()["machine"])
        self.assertEqual(self.run_speed(SCOLOPAX_INSTRUCTIONS="AVX2"), 0)
        self.assertEqual(len(self.calls("bench")), 4)
        self.assertIn("AVX2", self.measured()["machine"])
        self.write("stand-in", STAND_IN + "# a new build\n")
        self.assertEqual(self.run_speed(), 0)
        self.assertEqual(len(self.calls("bench")), 6)
        self.assertEqual(len(self.calls("reference")), 2)  # those of the first run

    def test_passes_on_what_speed_asks_for(self):
        self.assertEqual(self.run_speed(), 0)
        words = self.calls("bench")[0]
        for option, value in (("--until", "1e-05"), ("--auto-longest", "0.2"), ("--methods", "auto,superposed,sync-dda,raymarch")):
            self.assertEqual(words[words.index(option) + 1], value)


def times(method, seconds, step=None):
    """A row of "timeToError": seconds to 1e-2, 1e-3, 1e-4 and 1e-5."""
    row = {"method": method}
    for target, value in zip(speed_sections.TARGETS, seconds):
        row.update({f"secondsToRmse{target}": value, f"stepToRmse{target}": step})
    return row


def auto_point(**values):
    return {"method": "auto", "samples": 1, "setSceneSeconds": 0.5, "rmse": 2e-3, "step": None,
            "choice": {"method": "raymarch", "step": 2, "corrections": []}, **values}


class SpeedTables(unittest.TestCase):
    def test_compare_auto_with_the_best_step_and_mark_what_misses_its_goal(self):
        rows = {row["method"]: row for row in (
            times("auto", (3, 10, 5, None)), times("raymarch", (4, 6, None, None), 1), times("hybrid", (1, 8, 9, None), 2),
            times("sync-dda", (1, 1, 1, 1)))}
        self.assertEqual(speed_sections.ratio_to_best_step(rows, "0.01"), 3)
        self.assertAlmostEqual(speed_sections.ratio_to_best_step(rows, "0.001"), 10 / 6)
        self.assertAlmostEqual(speed_sections.ratio_to_best_step(rows, "0.0001"), 5 / 9)
        self.assertEqual([speed_sections.misses(rows, target) for target in speed_sections.RATIO_GOALS], [True, True, True])
        rows["auto"] = times("auto", (1.5, 9, 4.5, None))
        self.assertEqual([speed_sections.misses(rows, target) for target in speed_sections.RATIO_GOALS], [False, False, False])
        rows["hybrid"] = times("hybrid", (1, None, None, None), 2)
        rows["raymarch"] = times("raymarch", (None,) * 4, 2)
        self.assertFalse(speed_sections.misses(rows, "0.001"))  # only auto reaches it
        rows["auto"] = times("auto", (1, None, None, None))
        self.assertTrue(speed_sections.misses(rows, "0.001"))

    def test_name_the_scenes_that_do_not_reach_a_thousandth(self):
        entry = {"found": {"cells": {
            "shading": {"timeToError": [times("auto", (1, None, None, None)), times("raymarch", (1, 2, 3, 4), 1)],
                        "points": [auto_point()]},
            "shadows": {"timeToError": [times("auto", (1, 1, 1, None)), times("raymarch", (1, 2, 3, 4), 1)],
                        "points": [auto_point(rmse=1e-4)]}}}}
        text = speed_sections.against_steps(entry)
        self.assertIn("to 1e-04 at most 0.5 times its time: 1 of 2 (1)", text)
        self.assertIn("1e-3 is reached by 1 of 2; not by cells (shading): 2.0e-03.", text)
        self.assertIn("| cells | shading | raymarch, step 2 | 500 ms | x1 (x0.5; 1 s; raymarch, step 1: 1 s) | **-** | **-** |", text)

    def test_mark_estimates_that_are_off(self):
        points = [auto_point(samples=samples, estimateToError=ratio) for samples, ratio in ((16, 1.24), (64, 1.24), (512, 0.79))]
        text = speed_sections.estimates({"found": {"cells": {"both": {"box": points}}}}, None)
        self.assertIn("| 1.24 | 2.0e-03 | **1.24** | 2.0e-03 | **0.79** |", text)
        self.assertIn("2 of 3", text)
        points[1]["rmse"] = 1e-6
        text = speed_sections.estimates({"found": {"cells": {"both": {"box": points}}}}, None)
        self.assertIn("| 1.0e-06 | 1.24 |", text)
        self.assertIn("1 of 2", text)

    def test_mark_sessions_that_claim_too_much(self):
        row = {"samples": 64, "seconds": 1, "true": 1e-4}
        text = speed_sections.sessions({"found": {"point": [{**row, "claimed": 1e-4}], "box": [{**row, "claimed": 3e-4}]}}, None)
        self.assertIn("point: 1.0e-04 claimed", text)
        self.assertIn("**box: 3.0e-04 claimed", text)


class VtkTables(unittest.TestCase):
    def test_have_two_goals_and_count_what_precedes_the_first_sample(self):
        ours = [{"instructions": name, "method": "auto", "samples": 4, "step": None, "rmse": 1e-3, "seconds": 0.01 * slower,
                 "setSceneSeconds": 0.01} for name, slower in (("avx512", 1), ("avx2", 2))]
        vtk = [{"voxels": "u8", "step": step, "seconds": 0.08, "rmse": rmse, "drift": 1} for step, rmse in ((4, 5e-3), (1, 2e-3))]
        rows = list(vtk_report.error_rows({"vtk": vtk, "scolopax": ours}))
        self.assertEqual([row[4] for row in rows], ["4", "**4**"])
        self.assertEqual([row[6] for row in rows], ["2.67", "**2.67**"])
        text = vtk_report.goals_met([{"vtk": vtk, "scolopax": ours}])
        self.assertIn("AVX-512: of 1 errors up to 0.002, 0 are reached at least 5 times faster", text)
        self.assertIn("AVX2: of 1 errors above 0.002, 1 are reached at least 2.5 times faster", text)


if __name__ == "__main__":
    unittest.main()
