#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Clients with very many or large requests: these wait for each other and delay no other client."""
import asyncio
import contextlib
import http.client
import json
import os
import sys
import threading
import unittest

import websockets

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from innocent import FULL, HostileTest, Viewer, reading  # noqa: E402

CONNECTIONS = 200 if FULL else 40
SIDE = 4096 if FULL else 1024
BUDGET = 2048  # MiB


class Floods(HostileTest):
    options = ("--max-memory", str(BUDGET))
    orbitals = 64

    def large_scene(self):
        """A session whose scene takes half a megabyte in JSON."""
        curve = [[i / 4096, 0.123456789] for i in range(4096)]
        return self.session(dataset="orbitals", image={"width": 64, "height": 64},
                            channels={str(i): {"opacity": curve} for i in range(4)})

    def get_on(self, connections, path, over, statuses):
        """Many connections that get `path` again and again."""
        def run():
            connection = http.client.HTTPConnection("127.0.0.1", self.server.port, timeout=120)
            while not over.is_set():
                connection.request("GET", path, headers={"Authorization": f"Bearer {self.server.token}"})
                answer = connection.getresponse()
                answer.read()
                statuses.append(answer.status)
            connection.close()
        threads = [threading.Thread(target=run) for _ in range(connections)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join(120)

    def test_requests_for_one_sessions_scene_stall_nobody(self):
        path = f"/api/v1/sessions/{self.large_scene()['id']}/scene"
        statuses = []
        self.under(lambda over: self.get_on(CONNECTIONS, path, over, statuses), 4 * CONNECTIONS)
        self.assertLessEqual(set(statuses), {200, 503})
        self.assertIn(200, statuses)

    def test_streams_that_edit_one_slow_session_stall_nobody(self):
        session = self.large_scene()
        patch = json.dumps({"type": "patch", "id": 1, "patch": {"integrator": {"seed": 1}}})

        async def edit(over):
            while not over.is_set():
                # A client that reads too slowly is closed, and comes again.
                with contextlib.suppress(websockets.ConnectionClosed):
                    async with Viewer(self.server, session) as viewer, reading(viewer):
                        while not over.is_set():
                            await viewer.socket.send(patch)
                            await asyncio.sleep(0)

        async def run(over):
            await asyncio.gather(*(edit(over) for _ in range(8)))
        self.under(lambda over: asyncio.run(run(over)), 256)

    def test_pictures_that_take_long_to_encode_stall_nobody(self):
        session = self.session(image={"width": SIDE, "height": SIDE}, stop={"samples": 1})
        path = f"/api/v1/sessions/{session['id']}/frame?timeout=20&format="
        first = [204]
        while first[-1] == 204 and len(first) < 10:  # 16 million pixels take a while
            first.append(self.server.call("GET", path + "jpeg")[0])
        self.assertEqual(first[-1], 200)
        statuses = []

        def attack(over):
            threads = [threading.Thread(target=self.get_on, args=(6, path + form, over, statuses)) for form in ("png", "exr")]
            for thread in threads:
                thread.start()
            for thread in threads:
                thread.join(240)
        self.under(attack, BUDGET)
        self.assertLessEqual(set(statuses), {200, 503})
        self.assertIn(200, statuses)

    def test_polls_that_wait_keep_nobody_out(self):
        sessions = [self.session(image={"width": 16, "height": 16}, stop={"samples": 1}) for _ in range(8)]
        statuses, others = [], []

        def attack(over):
            threads = [threading.Thread(target=self.get_on, args=(
                8, f"/api/v1/sessions/{session['id']}/frame?after=1000000&timeout=2", over, statuses)) for session in sessions]
            for thread in threads:
                thread.start()
            while not over.wait(0.1):
                others.append(self.server.call("POST", "/api/v1/render", {
                    "image": {"width": 8, "height": 8}, "stop": {"samples": 1}})[0])
            for thread in threads:
                thread.join(120)
        self.under(attack, 128)
        self.assertEqual((set(statuses), set(others)), ({204}, {200}))


if __name__ == "__main__":
    unittest.main()
