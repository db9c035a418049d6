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

    def test_takes_a_step_that_the_error_asked_for_allows(self):
        # With a step chosen for another error, the estimate, which includes the bias, would never reach this error.
        steps = []
        for error in (2e-2, 5e-4):
            told = self.stats("--error", str(error), "--seconds", "60")
            self.assertEqual(told["method"], "raymarch")
            self.assertLessEqual(told["estimatedError"], error)
            steps.append(told["step"])
            # A scene that sets this error gets the same step.
            self.assertEqual(self.stats("--samples", "1", "--set", f"stop.error={error}")["step"], steps[-1])
        self.assertLess(steps[1], steps[0])


if __name__ == "__main__":
    unittest.main()
