#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Clients that do not read: the data that waits for them is bounded, and they are disconnected."""
import asyncio
import contextlib
import json
import os
import socket
import sys
import time
import unittest

import websockets

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from innocent import FULL, SLACK, HostileTest, Viewer  # noqa: E402
from protocol_client import connect  # noqa: E402

CLIENTS = 8 if FULL else 3
CURVE = [[i / 4096, 0.12345678901] for i in range(4096)]
# MiB that the clients may make the server hold: two texts and a socket's buffers for each.
UNREAD = 64 + 16 * CLIENTS
TEXTS = 6000  # their answers are far more than 256 and what sockets hold


class Unread(HostileTest):
    orbitals = 32

    def stall(self, session):
        """A viewer that reads only when it is asked to."""
        return connect(self.server, session["stream"], max_queue=1, read_limit=1024)

    def assert_closed(self, codes, at_least=CLIENTS):
        """The close code: 1008, or 1006 if a client did not even read the reason for 5 s."""
        self.assertGreaterEqual(len(codes), at_least)
        self.assertIn(1008, codes)
        self.assertLessEqual(set(codes), {1006, 1008})

    async def close_code(self, viewer):
        """Reads all texts; returns how many refusals there were, and the code with which the server closed, or None
        if the connection is open and answers a ping."""
        refusals = 0
        try:
            await viewer.send(json.dumps({"type": "ping", "id": 0}))
            while True:
                message = await asyncio.wait_for(viewer.recv(), 20)
                kind = json.loads(message)["type"] if isinstance(message, str) else "frame"
                if kind == "pong":
                    return refusals, None
                refusals += kind == "error"
        except websockets.ConnectionClosed as closed:
            return refusals, closed.code

    def test_what_is_echoed_to_who_does_not_read_is_little(self):
        session = self.session()
        text = json.dumps({"type": "patch", "id": 1, "patch": {"k" * 1_000_000: 1}})
        refused = []

        async def flood(over):
            async with self.stall(session) as viewer:
                sent = 0
                while sent < 100 and not over.is_set():
                    await asyncio.wait_for(viewer.send(text), 20)
                    sent += 1
                # The answers are so short that all may wait, so the server has not closed the connection.
                await viewer.send(json.dumps({"type": "ping", "id": 0}))
                refusals = 0
                while True:
                    message = await asyncio.wait_for(viewer.recv(), 20)
                    kind = json.loads(message)["type"] if isinstance(message, str) else "frame"
                    refusals += kind == "error"
                    if kind == "pong":
                        break
                refused.append((sent, refusals))

        async def run(over):
            await asyncio.gather(*(flood(over) for _ in range(CLIENTS)))
        self.under(lambda over: asyncio.run(run(over)), UNREAD)
        self.assertEqual(len(refused), CLIENTS)
        for sent, refusals in refused:
            self.assertEqual(sent, refusals)

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

    def test_clients_that_do_not_read_what_they_cause_are_closed(self):
        session = self.session()
        text = json.dumps({"type": "patch", "id": 1, "patch": {"k" * 200: 1}})
        closed = []

        async def flood():
            async with self.stall(session) as viewer:
                with contextlib.suppress(websockets.ConnectionClosed):
                    for _ in range(TEXTS):
                        await asyncio.wait_for(viewer.send(text), 20)
                # Time for a server with sanitizers to answer. It waits 5 s for the reason to be read.
                await asyncio.sleep(3)
                refusals, code = await self.close_code(viewer)
                if code is None:  # a slow server has answered only after the client had begun to read
                    self.assertEqual(refusals, TEXTS)
                else:
                    self.assertLess(refusals, TEXTS)
                    closed.append(code)

        async def run(over):
            rounds = 0
            while not over.is_set() or (len(closed) < CLIENTS and rounds < 20):
                await asyncio.gather(*(flood() for _ in range(CLIENTS)))
                rounds += 1
        self.under(lambda over: asyncio.run(run(over)), UNREAD)
        self.assert_closed(closed)

    def test_viewers_that_do_not_read_what_others_edit_are_closed(self):
        session = self.session(image={"width": 64, "height": 64})
        path = f"/api/v1/sessions/{session['id']}"
        closed = []
        # Encoded in advance, so that the attacker's own work does not delay the others.
        bodies = [json.dumps({"channels": {"0": {"opacity": CURVE[:4000 + i]}}}).encode() for i in range(90)]
        kind = {"Content-Type": "application/json"}

        def unread():
            return self.metric("scolopax_unread_text_bytes")

        async def round_of_edits(over):
            stalled = [await self.stall(session) for _ in range(CLIENTS)]
            most = number = 0
            # The texts of a connection are dropped when it is closed. Until then it holds about most / CLIENTS, unless
            # the kernel's buffers have taken more of them than for the others: then it may still be open afterwards.
            while not over.is_set() and (now := await asyncio.to_thread(unread)) >= most / (2 * CLIENTS):
                most, number = max(most, now), number + 1
                status, _, _ = await asyncio.to_thread(
                    self.server.call, "PATCH", path + "/scene", bodies[number % 90], kind)
                self.assertEqual(status, 200)
            for viewer in stalled:
                code = None if over.is_set() else (await self.close_code(viewer))[1]
                if code is None:
                    viewer.transport.abort()
                else:
                    closed.append(code)

        async def run(over):
            while not over.is_set():
                await round_of_edits(over)
        self.under(lambda over: asyncio.run(run(over)), UNREAD, 20 if FULL else 8)
        self.assert_closed(closed, CLIENTS // 2)


class UnreadAnswers(HostileTest):
    """Answers that are not read take only a small part of the memory."""
    orbitals = 64

    def send(self, connections, head, body=b"", times=1):
        """A socket that has sent a request this many times and reads nothing by itself."""
        client = connections.enter_context(socket.socket())
        client.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        client.settimeout(300)
        client.connect(("127.0.0.1", self.server.port))
        head = (f"{head} HTTP/1.1\r\nHost: localhost\r\nAuthorization: Bearer {self.server.token}\r\n"
                f"Content-Type: application/json\r\nContent-Length: {len(body)}\r\n\r\n")
        client.sendall(times * (head.encode() + body))
        return client

    def check(self, leave_unread):
        """Calls leave_unread(connections). Then the memory for answers is bounded, and others can render."""
        before, used, renders = self.memory(), [], []
        with contextlib.ExitStack() as connections:
            leave_unread(connections)
            # Until the peak of the memory in use has not changed for a while.
            while len(used) < 600 and not (any(used) and max(used) == max(used[:-10], default=0)):
                used.append(self.metric('scolopax_memory_bytes{use="answers"}'))
                renders.append(self.server.call("POST", "/api/v1/render", {
                    "image": {"width": 64, "height": 64}, "stop": {"samples": 1}})[0])
                time.sleep(0.5)
        print(f"\n{self.id().split('.')[-1]}: at most {max(used) / 2**20:.1f} of {self.budget / 4:.0f} MiB of unread answers; "
              f"{before:.0f} MiB before, {self.memory():.0f} MiB after", flush=True)
        self.assertGreater(max(used), 0)
        self.assertLessEqual(max(used), self.budget / 4 * 2**20)
        self.assertEqual(set(renders), {200})
        self.assert_memory_below(self.memory(), before + self.budget + SLACK)


class Pictures(UnreadAnswers):
    budget = 256  # MiB
    options = ("--max-memory", str(budget))

    def test_pictures_that_are_not_read_leave_memory_to_others(self):
        session = self.session(dataset="orbitals", image={"width": 1024, "height": 1024}, stop={"samples": 1})
        path = f"/api/v1/sessions/{session['id']}/frame?timeout=20&format="
        self.assertIn(200, (self.server.call("GET", path + "jpeg")[0] for _ in range(10)))
        statuses = []

        def leave_unread(connections):
            for _ in range(30):
                statuses.append(self.send(connections, "GET " + path + "exr").recv(12, socket.MSG_WAITALL))
        self.check(leave_unread)
        self.assertEqual(set(statuses), {b"HTTP/1.1 200", b"HTTP/1.1 503"})


class Edits(UnreadAnswers):
    budget = 64
    options = ("--max-memory", str(budget))

    def test_edits_whose_answers_are_not_read_leave_memory_to_others(self):
        session = self.session(dataset="orbitals", image={"width": 64, "height": 64})
        path = f"/api/v1/sessions/{session['id']}/scene"
        for channel in range(4):
            self.assertEqual(self.server.call("PATCH", path, {"channels": {str(channel): {
                "opacity": CURVE, "colormap": [[position, "#102030"] for position, _ in CURVE]}}})[0], 200)
        self.assertGreater(len(self.server.call("GET", path)[2]), 800_000)

        def leave_unread(connections):
            for _ in range(100 if FULL else 24):
                self.send(connections, "PATCH " + path, b"{}", times=6)
        self.check(leave_unread)
        # A script that makes an edit always gets the new revision.
        status, answer = self.server.json("PATCH", path, {})
        self.assertEqual(status, 200)
        self.assertGreater(answer["revision"], 5)


if __name__ == "__main__":
    unittest.main()
