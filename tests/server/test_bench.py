# SPDX-License-Identifier: Apache-2.0
"""`scolopax bench`: its numbers are consistent with each other and with the known properties of the methods."""
import json
import os
import unittest

from serving import CommandTest

SMALL = ["--set", "image.width=24", "--set", "image.height=20"]


class Bench(CommandTest):
    def bench(self, *options):
        return self.run_command("bench", "--data", *self.data, *SMALL, *options)

    def test_measures_every_method_against_the_reference(self):
        done = self.bench("--samples", "64,4,64", "--steps", "2,0.25", "--json", self.path("b.json"))
        self.assertEqual(done.returncode, 0, done.stderr)
        with open(self.path("b.json"), encoding="utf-8") as file:
            told = json.load(file)
        points = {(p["method"], p["samples"], p["step"]): p for p in told["points"]}
        self.assertEqual(len(points), 4 * 2 + 2 * 2 * 2)
        for (method, samples, step), p in points.items():
            self.assertGreater(p["rmse"], 0)
            self.assertAlmostEqual(p["nsPerRay"], p["seconds"] * 1e9 / (24 * 20 * samples), delta=1e-6 * p["nsPerRay"])
            self.assertGreater(p["cellStepsPerRay"], 0)
            if method == "sync-dda":
                self.assertEqual(p["efficiencyToSyncDda"], 1)
            self.assertEqual(step is None, method not in ("raymarch", "hybrid"))
        for method in ("superposed", "cumulative", "sync-dda", "n-dda"):
            # 16 times the samples: about a quarter of the error, or less.
            self.assertLess(points[method, 64, None]["rmse"], 0.4 * points[method, 4, None]["rmse"])
            # Times include every sample of a point.
            self.assertEqual(points[method, 64, None]["samplesTimed"], 64)
            self.assertEqual(points[method, 4, None]["samplesTimed"], 4)
        self.assertLess(points["raymarch", 64, 0.25]["rmse"], points["raymarch", 64, 2]["rmse"])
        self.assertGreater(points["raymarch", 4, 0.25]["fetchesPerRay"], 4 * points["raymarch", 4, 2]["fetchesPerRay"])
        self.assertEqual([t["method"] for t in told["timeToError"]],
                         ["superposed", "cumulative", "sync-dda", "n-dda", "raymarch", "hybrid"])
        for t in told["timeToError"][:4]:
            # For a tenth of the error, a tracker needs a hundred times the samples.
            self.assertAlmostEqual(t["secondsToRmse0.001"], 100 * t["secondsToRmse0.01"], delta=t["secondsToRmse0.01"])

    def measured(self, *options):
        done = self.bench(*options, "--json", self.path("b.json"))
        self.assertEqual(done.returncode, 0, done.stderr)
        with open(self.path("b.json"), encoding="utf-8") as file:
            return json.load(file)

    def test_counts_the_choice_and_the_corrections_of_auto(self):
        told = self.measured("--methods", "auto", "--samples", "1,64")
        first, last = told["points"]
        self.assertEqual(first["choice"]["corrections"], [])
        self.assertGreater(len(last["choice"]["corrections"]), 0)
        self.assertGreater(last["fetchesPerRay"], 1.1 * first["fetchesPerRay"])
        self.assertEqual([first["samplesCounted"], last["samplesCounted"]], [1, 64])
        # An error that the first point has.
        self.assertLess(first["rmse"], 1e-2)
        self.assertAlmostEqual(told["timeToError"][0]["secondsToRmse0.01"], first["seconds"] + first["setSceneSeconds"])
        self.assertIn(told["instructions"], ("baseline", "avx2", "avx512"))
        # Estimates are of two samples and more.
        self.assertNotIn("estimateToError", first)
        self.assertGreater(last["estimatedError"], 0)
        self.assertGreater(last["estimateToError"], 0)

    def test_doubles_samples_until_an_error(self):
        told = self.measured("--methods", "auto,superposed,raymarch", "--samples", "1", "--steps", "1", "--until", "1e-3",
                             "--longest", "0.2", "--auto-longest", "60")
        points = {}
        for point in told["points"]:
            points.setdefault(point["method"], []).append(point)
        for method, ascending in points.items():
            self.assertEqual([p["samples"] for p in ascending], [2**n for n in range(len(ascending))], method)
            for point in ascending[:-1]:
                self.assertGreater(point["rmse"], 1e-3, method)
        self.assertLessEqual(points["auto"][-1]["rmse"], 1e-3)
        # The bias of the step remains, so that samples are not doubled for ever.
        self.assertGreater(points["raymarch"][-1]["rmse"], 1e-3)
        self.assertLess(len(points["raymarch"]), 8)
        self.assertEqual(self.bench("--until", "1e-3", "--times-only").returncode, 2)

    def test_takes_its_truth_from_a_picture_of_the_same_pixel_centres(self):
        truth = []
        for width, height in ((24, 20), (8, 4), (12, 10)):
            truth.append(self.path(f"{width}.exr"))
            done = self.run_command("reference", "--data", *self.data, "-o", truth[-1], "--set", "image.filter=point",
                                    "--set", f"image.width={width}", "--set", f"image.height={height}")
            self.assertEqual(done.returncode, 0, done.stderr)
        told = {}
        for name, options in {"rendered": [], "read": ["--truth", truth[0]], "times": ["--times-only"],
                              "smaller": ["--truth", truth[1], "--set", "image.height=12"]}.items():
            done = self.bench("--methods", "raymarch", "--samples", "4", "--steps", "0.25", *options, "--json", self.path("b.json"))
            self.assertEqual(done.returncode, 0, done.stderr)
            with open(self.path("b.json"), encoding="utf-8") as file:
                told[name] = json.load(file)["points"][0]
        self.assertEqual(told["read"]["rmse"], told["rendered"]["rmse"])
        self.assertNotIn("rmse", told["times"])
        # Rays other than those of the reference picture would give errors as large as its detail, about 0.1.
        self.assertLess(told["smaller"]["rmse"], 3 * told["rendered"]["rmse"])
        done = self.bench("--truth", truth[2])
        self.assertEqual(done.returncode, 1)
        self.assertIn("expected 24x20 pixels, or fewer by an odd factor, found 12x10", done.stderr)

    def test_spreads_samples_over_pixels_where_its_truth_is_spread(self):
        done = self.run_command("render", "--data", *self.data, *SMALL, "-o", self.path("box.exr"), "--samples", "512")
        self.assertEqual(done.returncode, 0, done.stderr)
        options = ["--methods", "auto", "--samples", "64", "--truth", self.path("box.exr")]
        spread, centred = self.measured(*options, "--scene-filter"), self.measured(*options)
        self.assertLess(spread["points"][0]["rmse"], 0.5 * centred["points"][0]["rmse"])
        done = self.bench(*options, "--scene-filter", "--set", "image.width=72", "--set", "image.height=60")
        self.assertEqual(done.returncode, 1)
        self.assertIn("expected 72x60 pixels, found 24x20", done.stderr)
        self.assertEqual(self.bench("--scene-filter").returncode, 2)

    def test_varies_macrocells_and_threads_and_tells_the_memory(self):
        done = self.bench("--methods", "sync-dda", "--samples", "4", "--macrocells", "8,2", "--threads", "1,2", "--json",
                          self.path("b.json"))
        self.assertEqual(done.returncode, 0, done.stderr)
        with open(self.path("b.json"), encoding="utf-8") as file:
            told = json.load(file)
        points = {(p["macrocell"], p["threads"]): p for p in told["points"]}
        self.assertEqual(sorted(points), [(2, 1), (2, 2), (8, 1), (8, 2)])
        for count in ("fetchesPerRay", "cellStepsPerRay"):
            self.assertEqual(points[2, 1][count], points[2, 2][count])
        self.assertGreater(points[2, 1]["cellStepsPerRay"], 2 * points[8, 1]["cellStepsPerRay"])
        self.assertGreaterEqual(points[8, 1]["fetchesPerRay"], points[2, 1]["fetchesPerRay"])
        if os.environ.get("SCOLOPAX_SANITIZED"):
            self.skipTest("a sanitizer's heap is not counted")
        memory = {m["macrocell"]: m for m in told["memory"]}
        self.assertEqual(memory[2]["data"], 2 * 16**3)
        # 8^3 cells of two channels, at least two bytes each; with larger cells a 64th of that.
        self.assertGreaterEqual(memory[2]["macrocells"], 8**3 * 2 * 2)
        self.assertLess(memory[8]["macrocells"], memory[2]["macrocells"])

    def test_leaves_out_what_would_take_too_long_but_never_all(self):
        done = self.bench("--methods", "n-dda", "--samples", "1,16777216", "--longest", "0.1")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("skipped 1 points that would take longer than 0.1 s", done.stderr)
        self.assertEqual(done.stdout.count("n-dda"), 1)

    def test_takes_the_methods_that_it_is_given(self):
        done = self.bench("--methods", "superposed", "--samples", "1")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("superposed", done.stdout)
        self.assertNotIn("raymarch", done.stdout)
        for bad in (["--methods", "magic"], ["--steps", "nan"], ["--samples", "0"], ["--json", self.data[0]]):
            self.assertEqual(self.bench(*bad).returncode, 2, bad)


if __name__ == "__main__":
    unittest.main()
