#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Scenes in which a single ray takes long: they delay no other client."""
import asyncio
import itertools
import os
import sys
import time
import unittest

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from innocent import SESSIONS, HostileTest, Viewer, reading  # noqa: E402

# Thousands of short steps, and as many for every shadow ray from each lit part to each light.
SLOW = {
    "dataset": "orbitals", "image": {"width": 256, "height": 256}, "shadows": True, "shading": True,
    "integrator": {"method": "raymarch", "step": 0.01},
    "channels": [{"density": 0.02, "opacity": [[0, 0.5], [1, 1]]} for _ in range(4)],
    "lights": [{"type": "directional", "direction": [0.1 * i - 0.4, 0.3, -1]} for i in range(8)],
}
# The same for picks, which are not lit: every step takes many values, and no ray ends early.
PICKED = {
    "dataset": "orbitals", "image": {"width": 256, "height": 256}, "integrator": {"method": "raymarch", "step": 0.01},
    "channels": [{"density": 1e-6, "opacity": [[0, 1]], "interpolation": "cubic", "gradientOpacity": {}} for _ in range(4)],
}
# All points of the curves are in one small part of the range, and the data is next to that part.
CROWDED = [[0.5 + i / 1e7, i % 2] for i in range(4096)]


FILMS = 500  # MiB that the pictures of 1920 x 1080 pixels take
# MiB of a session that picks: 64^3 cells with 13 floats (bounds and majorants of four channels, and their sum), and a
# film that records what is visible.
PICKING = 20


class Rays(HostileTest):
    options = ("--max-sessions", "40")

    def edit(self, scene, patch_of):
        """Continuously edits a session and requests its pictures."""
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

    def test_that_ever_new_sessions_have(self):
        async def edit_once():
            session = self.session(**SLOW)
            async with Viewer(self.server, session) as viewer, reading(viewer):
                await viewer.patch({"camera": {"fovY": 31}})
                await asyncio.sleep(0.3)
                self.server.call("DELETE", f"/api/v1/sessions/{session['id']}")

        def attack(over):
            while not over.is_set():
                asyncio.run(edit_once())
        # The first ray of each may delay others, but only until the server sees that it takes long (0.3 s).
        self.under(attack, 64, late_share=1)

    def test_that_many_sessions_have(self):
        async def watch(over, session):
            async with Viewer(self.server, session) as viewer, reading(viewer):
                while not over.is_set():
                    await asyncio.sleep(0.1)

        async def watch_all(over, sessions):
            await asyncio.gather(*(watch(over, session) for session in sessions))

        def attack(over):
            sessions = [self.session(**SLOW) for _ in range(SESSIONS)]
            asyncio.run(watch_all(over, sessions))
            for session in sessions:
                self.server.call("DELETE", f"/api/v1/sessions/{session['id']}")
        self.under(attack, 8 * SESSIONS + FILMS, beside=self.beside())

    def hovering(self):
        """Repeatedly asks what is visible at a pixel of its own picture."""
        session = self.session(image={"width": 256, "height": 256})
        self.addCleanup(self.server.call, "DELETE", f"/api/v1/sessions/{session['id']}")

        def ask():
            status, told = self.server.json("GET", f"/api/v1/sessions/{session['id']}/pick?x=128&y=128")
            self.assertEqual(status, 200, told)
            time.sleep(0.05)
        return ask

    def test_of_picks_that_many_sessions_ask_for(self):
        async def ask(over, session):
            async with Viewer(self.server, session) as viewer, reading(viewer):
                await viewer.send("view", visible=False)
                for number in itertools.count(1):
                    if over.is_set():
                        break
                    await viewer.send("pick", id=number, x=0, y=0, x2=255, y2=255)
                    await asyncio.sleep(0.1)

        async def ask_all(over, sessions):
            await asyncio.gather(*(ask(over, session) for session in sessions))

        def attack(over):
            sessions = [self.session(**PICKED) for _ in range(SESSIONS)]
            asyncio.run(ask_all(over, sessions))
            for session in sessions:
                self.server.call("DELETE", f"/api/v1/sessions/{session['id']}")
        self.under(attack, PICKING * SESSIONS, beside={"hovering": self.hovering(), "resting": self.resting(256, 256)})

    def test_over_curves_with_all_points_in_one_place(self):
        self.edit({"dataset": "orbitals"}, lambda number: {"channels": {"0": {"range": [-1, 1], "opacity": CROWDED[number % 9:]}}})


if __name__ == "__main__":
    unittest.main()
