#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Large pictures: they delay no other client, and their memory is bounded."""
import asyncio
import json
import os
import sys
import threading
import unittest

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from innocent import FULL, HostileTest, Viewer, reading  # noqa: E402

SIDE = 4096 if FULL else 2048
BUDGET = 3072 if FULL else 1024  # MiB
# MiB for what the budget does not count: stacks, sockets, JSON, memory that the allocator keeps.
SLACK = 300


class Large(HostileTest):
    options = ("--max-memory", str(BUDGET))
    orbitals = 64

    def large(self, **more):
        session = self.session(image={"width": SIDE, "height": SIDE}, **more)
        self.addCleanup(self.end, session)
        return session

    def end(self, session):
        self.server.call("DELETE", f"/api/v1/sessions/{session['id']}")

    def test_a_large_picture_that_is_waited_for_stalls_nobody(self):
        session = self.large()

        def attack(over):
            after = 0
            while not over.is_set():
                status, headers, _ = self.server.call(
                    "GET", f"/api/v1/sessions/{session['id']}/frame?after={after}&timeout=5")
                if status == 200:
                    after = int(headers["Scolopax-Frame"])
        self.under(attack, BUDGET, 12 if FULL else 5)
        # The large picture makes progress too, if slowly; only a server that never shows it takes this long.
        statuses = {self.server.call("GET", f"/api/v1/sessions/{session['id']}/frame?timeout=1")[0]}
        for _ in range(300):
            if 200 in statuses:
                break
            statuses.add(self.server.call("GET", f"/api/v1/sessions/{session['id']}/frame?timeout=1")[0])
        self.assertIn(200, statuses)

    def test_a_large_picture_that_is_edited_stalls_nobody(self):
        session = self.large()

        async def edit(over):
            async with Viewer(self.server, session) as viewer, reading(viewer):
                while not over.is_set():
                    await viewer.patch({"integrator": {"seed": viewer.patches}})
                    await asyncio.sleep(0.7)  # pause between edits, so that whole pictures are rendered
        self.under(lambda over: asyncio.run(edit(over)), BUDGET, 12 if FULL else 5)

    def test_memory_stays_within_the_budget_and_refusals_tell_the_numbers(self):
        before, descriptors = self.memory(), self.descriptors()
        sessions = [self.large() for _ in range(4)]
        answers, peaks = [], []
        over = threading.Event()

        def poll(number):
            session = sessions[number % len(sessions)]
            form = ("jpeg", "png", "exr")[number % 3] + ("&aov=depth" if number % 4 == 0 else "")
            answers.append(self.server.call("GET", f"/api/v1/sessions/{session['id']}/frame?timeout=20&format={form}"))

        def render():
            answers.append(self.server.call("POST", "/api/v1/render", {
                "image": {"width": SIDE, "height": SIDE}, "stop": {"samples": 1}, "integrator": {"method": "superposed"}},
                {"Accept": "image/x-exr"}))

        def watch():
            while not over.wait(0.02):
                peaks.append(self.memory())

        watching = threading.Thread(target=watch)
        watching.start()
        threads = [threading.Thread(target=poll, args=(i,)) for i in range(8)] + [
            threading.Thread(target=render) for _ in range(2)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join(120)
        over.set()
        watching.join()
        print(f"\n{before:.0f} MiB before, at most {max(peaks):.0f} MiB, with a budget of {BUDGET} MiB; answers "
              f"{sorted(answer[0] for answer in answers)}")
        self.assert_memory_below(max(peaks), before + BUDGET + SLACK)
        refusals = [json.loads(body)["detail"] for status, _, body in answers if status in (422, 503)]
        self.assertTrue(refusals)
        for detail in refusals:
            self.assertRegex(detail, "MiB|too many|renders at once")
        self.assertTrue(any("MiB" in detail for detail in refusals))
        for session in sessions:
            self.end(session)
        # Sessions that end release their memory, also in the budget's accounting.
        for _ in range(200):
            if sum(self.metric(f'scolopax_memory_bytes{{use="{use}"}}') for use in ("films", "pictures", "encodings")) == 0:
                break
            threading.Event().wait(0.05)
        else:
            self.fail(self.server.call("GET", "/metrics")[2].decode())
        self.assert_descriptors_at_most(descriptors + 4)


if __name__ == "__main__":
    unittest.main()
