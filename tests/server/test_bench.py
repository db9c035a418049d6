# SPDX-License-Identifier: Apache-2.0
"""`scolopax bench`: its numbers agree with each other and with what is known of the methods."""
import json
import os
import subprocess
import tempfile
import unittest

from serving import PROGRAM, write_volume

SMALL = ["--set", "image.width=24", "--set", "image.height=20"]


class Bench(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.data = write_volume(self.folder.name)

    def path(self, name):
        return os.path.join(self.folder.name, name)

    def bench(self, *options):
        return subprocess.run([PROGRAM, "bench", "--data", *self.data, *SMALL, *options], capture_output=True, text=True,
                              timeout=300)

    def test_measures_every_method_against_the_reference(self):
        done = self.bench("--samples", "64,4,64", "--steps", "2,0.25", "--json", self.path("b.json"))
        self.assertEqual(done.returncode, 0, done.stderr)
        with open(self.path("b.json"), encoding="utf-8") as file:
            told = json.load(file)
        points = {(p["method"], p["samples"], p["step"]): p for p in told["points"]}
        self.assertEqual(len(points), 4 * 2 + 2)
        for (method, samples, step), p in points.items():
            self.assertGreater(p["rmse"], 0)
            self.assertAlmostEqual(p["nsPerRay"], p["seconds"] * 1e9 / (24 * 20 * samples), delta=1e-6 * p["nsPerRay"])
            self.assertGreater(p["cellStepsPerRay"], 0)
            if method == "sync-dda":
                self.assertEqual(p["efficiencyToSyncDda"], 1)
            self.assertEqual(step is None, method != "raymarch")
        for method in ("superposed", "cumulative", "sync-dda", "n-dda"):
            # 16 times the samples: about a quarter of the error, or less.
            self.assertLess(points[method, 64, None]["rmse"], 0.4 * points[method, 4, None]["rmse"])
            # Every point is measured from its first sample on.
            self.assertEqual(points[method, 64, None]["samplesTimed"], 64)
            self.assertEqual(points[method, 4, None]["samplesTimed"], 4)
        self.assertLess(points["raymarch", 1, 0.25]["rmse"], points["raymarch", 1, 2]["rmse"])
        self.assertGreater(points["raymarch", 1, 0.25]["fetchesPerRay"], 4 * points["raymarch", 1, 2]["fetchesPerRay"])
        self.assertEqual([t["method"] for t in told["timeToError"]],
                         ["superposed", "cumulative", "sync-dda", "n-dda", "raymarch"])

    def test_takes_the_methods_that_it_is_given(self):
        done = self.bench("--methods", "superposed", "--samples", "1")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("superposed", done.stdout)
        self.assertNotIn("raymarch", done.stdout)
        for bad in (["--methods", "magic"], ["--steps", "nan"], ["--samples", "0"], ["--json", self.data[0]]):
            self.assertEqual(self.bench(*bad).returncode, 2, bad)


if __name__ == "__main__":
    unittest.main()
