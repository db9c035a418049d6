#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Clients that do not read: the data that waits for them is bounded, and they are disconnected."""
import asyncio
import json
import os
import sys
import unittest

import websockets

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from innocent import FULL, HostileTest, Viewer  # noqa: E402
from protocol_client import connect  # noqa: E402

CLIENTS = 8 if FULL else 3
CURVE = [[i / 4096, 0.12345678901] for i in range(4096)]
# For each client, two texts and a socket's buffers; and what the allocator keeps.
BOUND = 64 + 16 * CLIENTS  # MiB


class Unread(HostileTest):
    orbitals = 32

    async def flood(self, session, text, count, over):
        """Sends without ever reading; True if the server has closed the connection."""
        async with connect(self.server, session["stream"], max_queue=1, read_limit=1024) as socket:
            for _ in range(count):
                if over.is_set():
                    break
                try:
                    await asyncio.wait_for(socket.send(text), 20)
                except (websockets.ConnectionClosed, asyncio.TimeoutError):
                    return True
        return False

    def test_what_is_echoed_to_who_does_not_read_is_little(self):
        before = self.memory()
        session = self.session()
        text = json.dumps({"type": "patch", "id": 1, "patch": {"k" * 1_000_000: 1}})

        def attack(over):
            async def run():
                await asyncio.gather(*(self.flood(session, text, 100, over) for _ in range(CLIENTS)))
            asyncio.run(run())
        self.under(attack)
        print(f"\n{before:.0f} MiB before, {self.memory():.0f} MiB after, at most {self.memory('VmHWM'):.0f} MiB")
        self.assert_memory_below(self.memory("VmHWM"), before + BOUND + 64)

    def test_a_refusal_repeats_no_more_than_a_line(self):
        session = self.session()

        async def run():
            async with Viewer(self.server, session) as viewer:
                await viewer.send("patch", id=1, patch={"k" * 500_000: 1})
                while True:
                    message = await viewer.socket.recv()
                    if isinstance(message, str) and json.loads(message)["type"] == "error":
                        return len(message)
        self.assertLess(asyncio.run(run()), 2000)
        status, _, body = self.server.call("PATCH", f"/api/v1/sessions/{session['id']}/scene", {"k" * 500_000: 1})
        self.assertEqual(status, 422)
        self.assertLess(len(body), 2000)

    def test_viewers_that_do_not_read_what_others_edit_are_closed(self):
        before = self.memory()
        session = self.session()
        path = f"/api/v1/sessions/{session['id']}"

        def attack(over):
            async def run():
                stalled = [await connect(self.server, session["stream"], max_queue=1, read_limit=1024)
                           for _ in range(CLIENTS)]
                for number in range(200):
                    if over.is_set():
                        break
                    curve = CURVE[:4000 + number % 90]
                    await asyncio.get_running_loop().run_in_executor(
                        None, self.server.call, "PATCH", path + "/scene", {"channels": {"0": {"opacity": curve}}})
                for socket in stalled:
                    socket.transport.abort()
            asyncio.run(run())
        self.under(attack)
        print(f"\n{before:.0f} MiB before, {self.memory():.0f} MiB after, at most {self.memory('VmHWM'):.0f} MiB")
        self.assert_memory_below(self.memory("VmHWM"), before + BOUND + 64)


if __name__ == "__main__":
    unittest.main()
