#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Scenes of which a single ray takes long: they keep nobody else waiting."""
import os
import sys
import unittest

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from innocent import HostileTest  # noqa: E402

# Thousands of short steps, and as many again for every shadow ray from each lit part to each light.
SLOW = {
    "dataset": "orbitals", "image": {"width": 256, "height": 256}, "shadows": True, "shading": True,
    "integrator": {"method": "raymarch", "step": 0.01},
    "channels": [{"density": 0.02, "opacity": [[0, 0.5], [1, 1]]} for _ in range(4)],
    "lights": [{"type": "directional", "direction": [0.1 * i - 0.4, 0.3, -1]} for i in range(8)],
}
# All points of the curves are in one small part of the range, beside which the data is.
CROWDED = [[0.5 + i / 1e7, i % 2] for i in range(4096)]


class Rays(HostileTest):
    def edit(self, scene, patch_of):
        """Edits a session all the time, and asks for its pictures."""
        session = self.session(**scene)
        path = f"/api/v1/sessions/{session['id']}"

        def attack(over):
            for number in range(1000):
                if over.is_set():
                    break
                status, _, body = self.server.call("PATCH", path + "/scene", patch_of(number))
                self.assertEqual(status, 200, body)
                self.server.call("GET", path + "/frame?timeout=1")
            self.server.call("DELETE", path)
        self.under(attack, 64)

    def test_that_take_millions_of_steps(self):
        self.edit(SLOW, lambda number: {"camera": {"fovY": 30 + number % 10}})

    def test_over_curves_with_all_points_in_one_place(self):
        self.edit({"dataset": "orbitals"}, lambda number: {"channels": {"0": {"range": [-1, 1], "opacity": CROWDED[number % 9:]}}})


if __name__ == "__main__":
    unittest.main()
