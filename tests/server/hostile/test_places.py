#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Clients without a token cannot use up the connections of those with one. A token does not make forbidden input
valid."""
import asyncio
import os
import socket
import sys
import threading
import unittest

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from innocent import HostileTest, Viewer  # noqa: E402


class Places(HostileTest):
    orbitals = 32

    def test_half_sent_heads_take_nobodys_place(self):
        statuses = []

        def attack(over):
            strangers = []
            for _ in range(540):
                stranger = socket.create_connection(("127.0.0.1", self.server.port))
                stranger.sendall(b"GET / HTTP/1.1\r\nHost: localhost\r\n")
                strangers.append(stranger)
            while not over.wait(0.1):
                statuses.append(self.server.call("GET", "/api/v1/datasets")[0])
            for stranger in strangers:
                stranger.close()
        self.under(attack, 64)
        self.assertEqual(set(statuses), {200})

    def test_a_patch_that_cannot_be_rendered_is_refused_as_a_whole(self):
        session = self.session()
        path = f"/api/v1/sessions/{session['id']}"
        patch = {"blend": {"mode": "max"}, "lights": [{"type": "point", "position": [1e308, 1e308, 0]}], "shading": True}
        status, problem = self.server.json("PATCH", path + "/scene", patch)
        self.assertEqual((status, problem["pointer"]), (422, "/lights/0"))
        scene = self.server.json("GET", path + "/scene")[1]
        self.assertEqual((scene["revision"], scene["scene"]["blend"]["mode"]), (1, "density"))

    def test_the_smallest_rate_is_no_rate_without_bound(self):
        session = self.session(stop={"samples": 100000}, image={"width": 64, "height": 64})

        async def run():
            async with Viewer(self.server, session) as viewer:
                await viewer.send("view", maxFps=1e-12)
                await viewer.sent_before_pong()
                before = len(viewer.frames)
                for _ in range(10):
                    await viewer.patch({"integrator": {"seed": viewer.patches}})
                    await asyncio.sleep(0.05)
                    await viewer.sent_before_pong(ack=True)
                return len(viewer.frames) - before
        self.assertLessEqual(asyncio.run(run()), 1)

    def test_only_pages_of_the_server_write_with_the_cookie(self):
        cookie = self.cookie()
        for origin, expected in (("http://127.0.0.1:{}", 201), ("ftp://127.0.0.1:{}", 403), ("http://u@127.0.0.1:{}", 403),
                                 ("http://127.0.0.1:{}/", 403)):
            status = self.server.call("POST", "/api/v1/sessions", {}, {
                "Cookie": cookie, "Origin": origin.format(self.server.port)}, token=False)[0]
            self.assertEqual(status, expected, origin)

    def test_only_names_of_this_machine_are_a_host(self):
        for host, expected in (("localhost", 200), ("[::1]:80", 200), ("[::1].evil.com", 421),
                               ("localhost:80@evil.com", 421)):
            self.assertEqual(self.server.call("GET", "/api/v1/datasets", headers={"Host": host})[0], expected, host)

    def cookie(self):
        """The cookie that a browser gets at the address of the ready line."""
        with socket.create_connection(("127.0.0.1", self.server.port)) as client:
            client.sendall(f"GET /?token={self.server.token} HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n".encode())
            head = b""
            while piece := client.recv(4096):
                head += piece
        line = next(line for line in head.decode().split("\r\n") if line.lower().startswith("set-cookie:"))
        return line.split(":", 1)[1].split(";")[0].strip()


if __name__ == "__main__":
    unittest.main()
