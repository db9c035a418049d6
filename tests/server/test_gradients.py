#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Histograms of gradients and opacity by the gradient, over HTTP. The volume is serving.py's: its voxels near the
border are 0."""
import os
import sys
import unittest

sys.path.insert(0, os.path.dirname(__file__))
from protocol_client import Viewer  # noqa: E402
from serving import Server  # noqa: E402


def value_at(channel, x, y, z):
    """A voxel's value: a ball of radius 16/3, and the cube of the 7^3 voxels less than 4 from the centre."""
    inside = (x - 8)**2 + (y - 8)**2 + (z - 8)**2 < (16 / 3)**2 if channel == 0 else max(map(abs, (x - 8, y - 8, z - 8))) < 4
    return ((200, 100) if inside else (0, 0))[channel]


def steepness_at(channel, *voxel):
    """|gradient| by central differences."""
    def shifted(axis, by):
        return value_at(channel, *(v + by * (i == axis) for i, v in enumerate(voxel)))
    return sum(((shifted(axis, 1) - shifted(axis, -1)) / 2)**2 for axis in range(3))**0.5


VOXELS = [(x, y, z) for x in range(16) for y in range(16) for z in range(16)]


class Gradients(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.server = Server()
        cls.dataset = cls.server.json("GET", "/api/v1/datasets")[1]["datasets"][0]
        cls.path = f"/api/v1/datasets/{cls.dataset['id']}"

    @classmethod
    def tearDownClass(cls):
        cls.server.stop()

    def test_are_counted_for_every_voxel_in_its_bin(self):
        for channel in (1, 0):
            steep = [steepness_at(channel, *voxel) for voxel in VOXELS]
            bins = [[0] * 256, [0] * 256]
            for voxel, steepness in zip(VOXELS, steep):
                bins[value_at(channel, *voxel) > 0][min(255, int(steepness / max(steep) * 256))] += 1
            status, told = self.server.json("GET", f"{self.path}/gradient-histogram?channel={channel}&joint=true")
            self.assertEqual(status, 200, told)
            self.assertAlmostEqual(told.pop("maximum"), max(steep))
            joint = told.pop("joint")
            self.assertEqual(told, {"channel": channel, "name": self.dataset["channels"][channel]["name"], "unit": "",
                                    "finiteCount": 16**3, "nonFiniteCount": 0,
                                    "bins": [sum(both) for both in zip(*bins)]})
            self.assertEqual(joint, [bins[0]] + [[0] * 256] * 254 + [bins[1]])
        status, told = self.server.json("GET", f"{self.path}/gradient-histogram")
        self.assertEqual((status, told["channel"], "joint" in told), (200, 0, False))
        for query in ("channel=2", "channel=x", "joint=1"):
            self.assertEqual(self.server.json("GET", f"{self.path}/gradient-histogram?{query}")[0], 422)

    def test_of_what_has_opacity_choose_the_range_which_then_stays(self):
        scene = {"image": {"width": 64, "height": 48}, "stop": {"samples": 1}, "channels": [{"range": [0, 200]}]}
        session = self.server.json("POST", "/api/v1/sessions", {"scene": scene})[1]
        path = f"/api/v1/sessions/{session['id']}/scene"
        self.assertNotIn("gradientOpacity", session["scene"]["channels"][0])

        def edit(channel):
            status, told = self.server.json("PATCH", path, {"channels": {"0": channel}})
            self.assertEqual(status, 200, told)
            return told["scene"]["channels"][0].get("gradientOpacity")
        most = max(steepness_at(0, *voxel) for voxel in VOXELS)
        counted = sorted(min(255, int(steepness_at(0, *voxel) / most * 256)) for voxel in VOXELS if value_at(0, *voxel))
        rank = 0.995 * len(counted)
        last = counted[int(rank)]
        share = (rank - counted.index(last)) / counted.count(last)
        chosen = edit({"gradientOpacity": {}})
        self.assertEqual((chosen["range"][0], chosen["points"]), (0, [[0, 0], [1, 1]]))
        self.assertAlmostEqual(chosen["range"][1], (last + share) / 256 * most)
        # With another curve all voxels would count, whose gradients are smaller; the chosen range stays.
        bent = edit({"range": [-1, 200], "gradientOpacity": {"points": [[0, 1], [1, 0]]}})
        self.assertEqual(bent, {"range": chosen["range"], "points": [[0, 1], [1, 0]]})
        anew = edit({"gradientOpacity": {"range": None}})
        self.assertLess(anew["range"][1], chosen["range"][1])
        self.assertEqual(edit({"gradientOpacity": {"range": [1, 2]}}), {"range": [1, 2], "points": [[0, 1], [1, 0]]})
        self.assertIsNone(edit({"gradientOpacity": None}))
        status, problem = self.server.json("PATCH", path, {"channels": {"0": {"gradientOpacity": {"range": [1]}}}})
        self.assertEqual((status, problem["pointer"]), (422, "/channels/0/gradientOpacity/range"))


class Waiting(unittest.IsolatedAsyncioTestCase):
    async def test_edits_wait_in_their_order_for_what_they_need_and_other_sessions_do_not(self):
        with Server() as server:  # a server that has measured nothing yet
            scene = {"image": {"width": 64, "height": 48}}
            sessions = [server.json("POST", "/api/v1/sessions", {"scene": scene})[1] for _ in range(2)]
            async with Viewer(server, sessions[0]) as viewer, Viewer(server, sessions[1]) as other:
                await viewer.patch({"channels": {"0": {"gradientOpacity": {}}, "1": {"gradientOpacity": {}}}})
                last = await viewer.patch({"integrator": {"seed": 7}})
                theirs = await other.patch({"integrator": {"seed": 8}})
                await other.frame(lambda frame: frame.patch == theirs)
                await viewer.frame(lambda frame: frame.patch == last)
            told = server.json("GET", f"/api/v1/sessions/{sessions[0]['id']}/scene")[1]
            self.assertEqual((told["revision"], told["scene"]["integrator"]["seed"]), (3, 7))
            for channel in told["scene"]["channels"]:
                self.assertGreater(channel["gradientOpacity"]["range"][1], 0)


if __name__ == "__main__":
    unittest.main()
