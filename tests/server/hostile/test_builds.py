#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Scenes that take long to build: they delay no other client, and a build ends when no client needs it."""
import asyncio
import itertools
import json
import os
import signal
import socket
import sys
import threading
import time
import unittest

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from innocent import SESSIONS, HostileTest, Viewer, reading  # noqa: E402

LARGE = {"dataset": "orbitals", "image": {"width": 64, "height": 64}}


GRIDS = 1000  # MiB that the macrocells of all scenes of these tests take
FILMS = 500  # MiB that the pictures of 1920 x 1080 pixels take


class Builds(HostileTest):
    options = ("--max-sessions", "40")

    def toggle(self, over, patches, count=1):
        """Viewers of the large volume, each in a session of its own, that edit ten times a second without waiting."""
        sessions = [self.session(**LARGE) for _ in range(count)]

        async def edit(session):
            async with Viewer(self.server, session) as viewer, reading(viewer):
                for patch in itertools.cycle(patches):
                    if over.is_set():
                        return
                    await viewer.patch(patch)
                    await asyncio.sleep(0.1)

        async def edit_all():
            await asyncio.gather(*map(edit, sessions))
        asyncio.run(edit_all())
        for session in sessions:
            self.server.call("DELETE", f"/api/v1/sessions/{session['id']}")

    def test_a_rebuild_stalls_nobody(self):
        sizes, statuses = itertools.cycle(range(2, 60)), set()

        def attack(over):
            while not over.is_set():
                session = self.session(**LARGE, integrator={"macrocell": next(sizes)})
                statuses.add(self.server.call("GET", f"/api/v1/sessions/{session['id']}/frame?timeout=20")[0])
                self.server.call("DELETE", f"/api/v1/sessions/{session['id']}")
        self.under(attack, GRIDS)
        self.assertIn(200, statuses)

    def test_many_sessions_that_toggle_the_macrocells_keep_nobody_waiting(self):
        patches = [{"integrator": {"macrocell": size}} for size in (2, 3)]
        # All editing clients have an equal share of the time, so any frame may be late.
        self.under(lambda over: self.toggle(over, patches, SESSIONS), GRIDS + FILMS, beside=self.beside(), late_share=1)

    def test_toggling_the_macrocells_stalls_nobody(self):
        self.under(lambda over: self.toggle(over, [{"integrator": {"macrocell": size}} for size in (2, 3)]), GRIDS)

    def test_toggling_the_data_set_stalls_nobody(self):
        small = self.server.json("GET", "/api/v1/datasets")[1]["datasets"][0]["id"]
        self.under(lambda over: self.toggle(over, [{"dataset": small}, {"dataset": "orbitals"}]), GRIDS)

    def test_macrocells_that_only_cost_are_refused(self):
        allowed = [size for size in (1, 2, 3, 4) if (-(-(self.orbitals - 1) // size)) ** 3 * 8 <= 1 << 25]
        for size in (1, 2, 3, 4):
            status, answer = self.server.json(
                "POST", "/api/v1/sessions", {"scene": {**LARGE, "integrator": {"macrocell": size}}})
            if size in allowed:
                self.assertEqual(status, 201)
                self.server.call("DELETE", f"/api/v1/sessions/{answer['id']}")
            else:
                self.assertEqual((status, answer["pointer"]), (422, "/integrator/macrocell"))

    def test_a_client_that_vanishes_frees_its_place(self):
        body = json.dumps({**LARGE, "integrator": {"macrocell": 2}, "stop": {"samples": 1}}).encode()
        head = (f"POST /api/v1/render HTTP/1.1\r\nHost: localhost\r\nAuthorization: Bearer {self.server.token}\r\n"
                f"Content-Type: application/json\r\nContent-Length: {len(body)}\r\n\r\n").encode()
        descriptors, begin, refused = self.descriptors(), time.monotonic(), 0
        for _ in range(10):
            clients = [socket.create_connection(("127.0.0.1", self.server.port)) for _ in range(2)]
            for client in clients:
                client.sendall(head + body)
                client.close()
            for _ in range(100):  # ApplicationTest.EndsTheBuildOf... needs no clock
                if self.server.call("POST", "/api/v1/render", {"image": {"width": 8, "height": 8}, "stop": {"samples": 1}})[0] == 200:
                    break
                refused += 1
                threading.Event().wait(0.05)
            else:
                self.fail("the places are not free again")
        print(f"\nten times two clients that vanish: {time.monotonic() - begin:.2f} s, {refused} times refused")
        self.assert_descriptors_at_most(descriptors + 4)


class Ending(HostileTest):
    def test_a_signal_ends_the_server_while_it_builds(self):
        session = self.session(**LARGE, integrator={"macrocell": 2})
        threads = [threading.Thread(target=self.swallow, args=arguments) for arguments in (
            ("GET", f"/api/v1/sessions/{session['id']}/frame"),
            ("POST", "/api/v1/render", {**LARGE, "integrator": {"macrocell": 3}, "stop": {"seconds": 50}}))]
        for thread in threads:
            thread.start()
        threading.Event().wait(0.2)
        begin = time.monotonic()
        self.server.process.send_signal(signal.SIGTERM)
        # The grace period of 3 s plus the time of thread joins on a busy machine.
        # ApplicationTest.EndsAllBuildsWhenItStops tests without a clock that builds stop.
        self.assertEqual(self.server.process.wait(timeout=10), 0)
        print(f"\nSIGTERM during builds: {time.monotonic() - begin:.2f} s of a grace of 3 s")
        for thread in threads:
            thread.join(60)

    def swallow(self, *arguments):
        try:
            self.server.call(*arguments)
        except OSError:
            pass


if __name__ == "__main__":
    unittest.main()
