# SPDX-License-Identifier: Apache-2.0
"""A session that nobody edits goes on converging: the method `auto` leaves no bias."""
import tempfile
import unittest

from serving import Server, write_volume

GOAL = 2e-4
SIZE = {"width": 64, "height": 64}


class ConvergingSession(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.paths = write_volume(folder.name, channels=("a", "b", "c", "d"))

    def test_of_four_channels_falls_below_its_goal_and_has_corrections(self):
        with Server(paths=self.paths) as server:
            for kind in ("point", "box"):
                scene = {"image": {**SIZE, "filter": kind}, "stop": {"error": GOAL, "samples": 4096}}
                status, session = server.json("POST", "/api/v1/sessions", {"scene": scene})
                self.assertEqual(status, 201)
                status, headers = 204, {}
                while status == 204:
                    status, headers, picture = server.call(
                        "GET", f"/api/v1/sessions/{session['id']}/frame?minSamples=4096&format=exr")
                self.assertEqual((status, headers["Scolopax-Final"]), (200, "1"), kind)
                self.assertLessEqual(float(headers["Scolopax-Error"]), GOAL, kind)
                # The same picture without a session, which says of what it is made.
                samples = int(headers["Scolopax-Samples"])
                status, headers, alone = server.call("POST", "/api/v1/render", {**scene, "stop": {"samples": samples}},
                                                     {"Accept": "image/x-exr"})
                self.assertEqual((status, alone), (200, picture), kind)
                self.assertNotEqual(headers["Scolopax-Corrections"], "", kind)


if __name__ == "__main__":
    unittest.main()
