#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Picking as specified in protocol/PROTOCOL.md, on serving.py's volume: channel 0 is a ball of 200, 1 a box of 100."""
import asyncio
import os
import sys
import unittest

sys.path.insert(0, os.path.dirname(__file__))
from protocol_client import Viewer, call_json  # noqa: E402
from serving import Server  # noqa: E402

server = None


def setUpModule():
    global server
    server = Server("--threads", "1")


def tearDownModule():
    if server.stop() != 0:
        raise AssertionError("the server did not end well")


class Picks(unittest.IsolatedAsyncioTestCase):
    """Picks of the ball and the box around voxel (8, 8, 8), seen from +z with parallel rays: the middle pixel shows the
    centre, and a pixel is a quarter of a voxel wide."""
    BOX = [{"visible": False}, {"range": [25, 75], "density": 1e4, "name": "box"}]

    def scene(self, channels):
        data = call_json(server, "GET", "/api/v1/datasets")[1]["datasets"][0]
        m = data["worldFromVoxel"]
        self.world = lambda v: [sum(m[4 * k + row] * c for k, c in enumerate((*v, 1))) for row in range(3)]
        x, y, z = self.world((8, 8, 8))
        return {"image": {"width": 81, "height": 81}, "channels": channels, "stop": {"samples": 1 << 24},
                "camera": {"eye": [x, y, z + 50], "target": [x, y, z], "up": [0, 1, 0], "orthoHeight": 81 / 4}}

    def begin(self, scene):
        status, session = call_json(server, "POST", "/api/v1/sessions", {"scene": scene})
        self.assertEqual(status, 201, session)
        return session

    def ask(self, session, query):
        return call_json(server, "GET", f"/api/v1/sessions/{session['id']}/pick?{query}")

    def pick(self, session, query):
        status, told = self.ask(session, query)
        self.assertEqual(status, 200, told)
        return told

    def test_of_the_box_are_its_face_and_the_values_of_hidden_channels(self):
        # The value falls from 100 to 0 between voxels 11 and 12, and the opacity begins at 25.
        for method in ("auto", "superposed", "cumulative", "sync-dda", "n-dda", "raymarch", "hybrid"):
            scene = self.scene(self.BOX)
            session = self.begin({**scene, "integrator": {"method": method, "step": 0.1}})
            told = self.pick(session, "x=40.5&y=40")
            self.assertEqual([told[member] for member in ("hit", "revision", "channel", "name")], [True, 1, 1, "box"],
                             method)
            for found, expected in zip(told["point"], self.world((8, 8, 11.75))):
                self.assertAlmostEqual(found, expected, delta=0.13)
            self.assertEqual(told["voxel"], [8, 8, 12])
            self.assertAlmostEqual(told["depth"], scene["camera"]["eye"][2] - told["point"][2], places=3)
            x, y, z = told["point"]
            dataset = session["scene"]["dataset"]
            probed = call_json(server, "GET", f"/api/v1/datasets/{dataset}/probe?x={x}&y={y}&z={z}")[1]
            for found, expected in zip(told["values"], probed["values"]):
                self.assertAlmostEqual(found, expected, places=3)
            self.assertEqual(told, self.pick(session, "x=40.01&y=40.99"), "the same pixel")
            self.assertEqual(self.pick(session, "x=0&y=0"), {"revision": 1, "hit": False})

    def test_of_a_rectangle_are_the_voxels_of_the_face(self):
        session = self.begin(self.scene(self.BOX))
        told = self.pick(session, "x=56&y=56&x2=25&y2=25")  # four voxels on every side of the middle
        self.assertFalse(told["truncated"])
        voxels = [tuple(hit["voxel"]) for hit in told["hits"]]
        self.assertEqual(len(set(voxels)), len(voxels))
        self.assertLessEqual({(i, j, 12) for i in range(5, 12) for j in range(5, 12)}, set(voxels))
        told = self.pick(session, "x=0&y=0&x2=80&y2=80")
        self.assertTrue(told["truncated"])
        self.assertLessEqual(len(told["hits"]), 1024)
        self.assertEqual(self.pick(session, "x=0&y=0&x2=3&y2=3"), {"revision": 1, "truncated": False, "hits": []})

    def test_outside_of_the_picture_lead_to_the_parameter(self):
        session = self.begin(self.scene(self.BOX))
        for query, pointer in (("x=81&y=0", "/x"), ("x=0&y=-1", "/y"), ("x=0&y=0&x2=81&y2=0", "/x2"),
                               ("x=0&y=0&x2=1", "/y2"), ("x=one&y=0", None), ("y=0", None)):
            status, problem = self.ask(session, query)
            self.assertEqual((status, problem.get("pointer")), (422, pointer), query)
            self.assertRegex(problem["detail"], "expected .*, found ")

    async def test_are_answered_in_the_stream_as_over_http(self):
        session = self.begin(self.scene(self.BOX))
        async with Viewer(server, session) as viewer:
            await viewer.send("pick", id=7, x=40.5, y=40)
            told = await viewer.text("picked")
            over_http = await asyncio.to_thread(self.pick, session, "x=40.5&y=40")
            self.assertEqual(told, {"type": "picked", "id": 7, **over_http})
            await viewer.send("pick", id=8, x=100, y=40)
            told = await viewer.text("picked")
            self.assertEqual((told["id"], told["problem"]["status"], told["problem"]["pointer"]), (8, 422, "/x"))
            await viewer.patch({"channels": {"1": {"visible": False}}})
            await viewer.send("pick", id=9, x=40.5, y=40)
            self.assertEqual(await viewer.text("picked"), {"type": "picked", "id": 9, "revision": 2, "hit": False})


if __name__ == "__main__":
    unittest.main()
