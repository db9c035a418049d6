# SPDX-License-Identifier: Apache-2.0
"""`scolopax reference`: the picture that the methods converge to, as a file."""
import json
import unittest

from serving import CommandTest

SMALL = ["--set", "image.width=24", "--set", "image.height=20", "--set", "shading=true", "--set", "shadows=true"]


class Reference(CommandTest):
    def picture(self, command, name, *options):
        done = self.run_command(command, "--data", *self.data, *SMALL, "-o", self.path(name), *options)
        self.assertEqual(done.returncode, 0, done.stderr)
        return done.stdout

    def rmse(self, a, b):
        return json.loads(self.run_command("compare", self.path(a), self.path(b), "--json").stdout)["rmse"]

    def test_is_what_the_marcher_converges_to_through_pixel_centres(self):
        point = ["--set", "image.filter=point"]
        told = self.picture("reference", "truth.exr", *point)
        self.assertIn("noise of the picture 0.00e+00", told)
        errors = []
        for step in (1, 0.125):
            self.picture("render", "marched.exr", *point, "--set", "integrator.method=raymarch",
                         "--set", f"integrator.step={step}", "--samples", "64")
            errors.append(self.rmse("marched.exr", "truth.exr"))
        self.assertLess(errors[1], 1e-3)
        self.assertLess(errors[1], 0.5 * errors[0])

    def test_says_how_much_noise_is_left_in_pixels_that_have_an_area(self):
        noise = []
        for strata, name in (("2", "a.exr"), ("8", "b.exr")):
            told = self.picture("reference", name, "--samples-per-axis", strata)
            noise.append(float(told.split("noise of the picture ")[1].split()[0]))
        self.assertLess(noise[1], 0.5 * noise[0])
        # The difference of the two pictures contains the noise of both.
        expected = (noise[0] ** 2 + noise[1] ** 2) ** 0.5
        self.assertLess(0.7 * expected, self.rmse("a.exr", "b.exr"))
        self.assertGreater(1.4 * expected, self.rmse("a.exr", "b.exr"))

    def test_has_the_tolerance_that_it_is_given(self):
        point = ["--set", "image.filter=point"]
        errors = []
        for tolerance in ((), ("--tolerance", "1e-6")):
            told = self.picture("reference", "truth.exr", *point, *tolerance)
            errors.append(float(told.split("largest error of a ray ")[1].split()[0]))
        self.assertLess(errors[1], 0.1 * errors[0])
        for bad in ("0", "-1", "nan", "1"):
            self.assertEqual(self.run_command("reference", "--data", *self.data, "-o", self.path("t.exr"), "--tolerance",
                                              bad).returncode, 2, bad)

    def test_renders_every_third_pixel_alone(self):
        size = ["--set", "image.width=27", "--set", "image.height=21", "--set", "image.filter=point"]
        self.picture("reference", "few.exr", *size, "--every", "3")
        self.picture("reference", "small.exr", "--set", "image.width=9", "--set", "image.height=7", *size[4:])
        self.assertLess(self.rmse("few.exr", "small.exr"), 1e-6)  # the same rays
        done = self.run_command("reference", "--data", *self.data, *SMALL, "-o", self.path("t.exr"), "--every", "3")
        self.assertEqual(done.returncode, 1)
        self.assertIn("a divisor of the width 24 and the height 20, found 3", done.stderr)

    def test_refuses_what_it_cannot_write(self):
        for out in (self.data[0], self.path("truth.bmp"), self.path("no/truth.exr")):
            done = self.run_command("reference", "--data", *self.data, "-o", out)
            self.assertIn(done.returncode, (1, 2), out)
            self.assertEqual(done.stdout, "")
        with open(self.data[0], "rb") as file:
            self.assertEqual(len(file.read()), 16**3)


if __name__ == "__main__":
    unittest.main()
