# SPDX-License-Identifier: Apache-2.0
"""`scolopax render`: its options have their effect."""
import json
import unittest

from serving import CommandTest

SMALL = ["--set", "image.width=24", "--set", "image.height=20"]


class Render(CommandTest):
    def stats(self, *options):
        done = self.run_command("render", "--data", *self.data, *SMALL, "-o", self.path("p.exr"), "--stats",
                                self.path("s.json"), *options)
        self.assertEqual(done.returncode, 0, done.stderr)
        with open(self.path("s.json"), encoding="utf-8") as file:
            return json.load(file)

    def test_reaches_an_error_below_the_bias_of_its_step(self):
        told = {}
        for error in (2e-2, 2e-4):
            told[error] = self.stats("--error", str(error), "--seconds", "60", "--set", "image.filter=point")
            self.assertEqual(told[error]["method"], "raymarch")
            self.assertLessEqual(told[error]["estimatedError"], error)
        # The step depends only on the scene; its remaining bias is corrected.
        self.assertEqual(told[2e-4]["step"], told[2e-2]["step"])
        for level in told[2e-4]["corrections"]:
            self.assertGreater(level["passes"], 0)
        biased = self.stats("--samples", str(told[2e-4]["samples"]), "--set", "image.filter=point",
                            "--set", "integrator.method=raymarch", "--set", f"integrator.step={told[2e-4]['step'] or 0}")
        self.assertGreater(biased["estimatedError"], told[2e-4]["estimatedError"])


if __name__ == "__main__":
    unittest.main()
