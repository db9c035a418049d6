# SPDX-License-Identifier: Apache-2.0
"""A client that uses the server while others attack it; measures the effect of the attack on it and on the process."""
import argparse
import asyncio
import contextlib
import itertools
import os
import subprocess
import sys
import tempfile
import threading
import time
import unittest

sys.path.insert(0, os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
from protocol_client import Frame, Viewer, call, call_json  # noqa: E402
from serving import PROGRAM, Server, write_volume  # noqa: E402

# `make check` runs the full attacks, `make test` short ones.
SANITIZED = bool(os.environ.get("SCOLOPAX_SANITIZED"))
FULL = bool(os.environ.get("SCOLOPAX_HOSTILE_FULL"))
SECONDS = 10 if FULL else 3
ORBITALS = 256 if FULL else 128
SESSIONS = 31 if FULL else 8  # of attackers that have many sessions
PERIOD = 0.05  # seconds between two edits
# An edit is late if it takes three times as long as the slowest twentieth without an attack, but at least this long,
# because on a busy machine the system itself delays a few edits.
LATE = 0.09
LATE_SHARE = 0.05  # p95 is within three times the value without an attack
# MiB that sockets, stacks and the allocator may take in addition to the limit for an attack.
SLACK = 100


@contextlib.asynccontextmanager
async def reading(viewer):
    """Reads what the server sends to a viewer, for as long as the context lasts."""
    async def read():
        while True:
            await viewer.receive()
    task = asyncio.create_task(read())
    try:
        yield
    finally:
        task.cancel()


class Innocent:
    """`with Innocent(server) as viewer:` edits a scene of 256 x 256 pixels twenty times a second and records how long
    each edit takes to appear. It has its own process, so that the attackers' work does not delay it."""

    def __init__(self, server, dataset="blob-a-64x64x64-uint8"):
        self.latencies, self.ready = [], threading.Event()
        self.process = subprocess.Popen(
            [sys.executable, os.path.abspath(__file__), str(server.port), server.token, dataset],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self.thread = threading.Thread(target=self.read)

    def __enter__(self):
        self.thread.start()
        self.ready.wait(60)
        return self

    def __exit__(self, *_):
        self.process.stdin.close()
        self.thread.join(60)
        self.process.wait(60)
        self.process.stdout.close()

    def read(self):
        for line in self.process.stdout:
            self.latencies.append(float(line))
            self.ready.set()

    def watch(self, seconds):
        """Latencies of the edits that appear within this time."""
        first = len(self.latencies)
        time.sleep(seconds)
        return self.latencies[first:]


async def work(server, dataset):
    scene = {"dataset": dataset, "image": {"width": 256, "height": 256}}
    session = call_json(server, "POST", "/api/v1/sessions", {"scene": scene})[1]
    over = threading.Event()
    threading.Thread(target=lambda: (sys.stdin.read(), over.set()), daemon=True).start()
    async with Viewer(server, session) as viewer:
        await viewer.frame()
        while not over.is_set():
            begin = time.monotonic()
            number = await viewer.patch({"camera": {"fovY": 30 + viewer.patches % 10}})
            await viewer.until(lambda m, number=number: isinstance(m, Frame) and m.patch >= number)
            print(time.monotonic() - begin, flush=True)
            await asyncio.sleep(max(0, begin + PERIOD - time.monotonic()))
    call(server, "DELETE", f"/api/v1/sessions/{session['id']}")


class Repeated:
    """`with Repeated(action) as work:` repeats the action in a thread and records how long it takes each time."""

    def __init__(self, action):
        self.action, self.seconds, self.over, self.failures = action, [], threading.Event(), []
        self.thread = threading.Thread(target=self.run)

    def __enter__(self):
        self.thread.start()
        return self

    def __exit__(self, *_):
        self.over.set()
        self.thread.join(120)

    def run(self):
        try:
            while not self.over.is_set():
                begin = time.monotonic()
                self.action()
                self.seconds.append(time.monotonic() - begin)
        except Exception as error:  # pylint: disable=broad-except
            self.failures.append(error)


def percentile(values, p):
    return sorted(values)[min(len(values) - 1, int(p * len(values)))] if values else float("inf")


class HostileTest(unittest.TestCase):
    """A test with a server that has a small volume, for Innocent, and a large one."""
    options = ()
    orbitals = ORBITALS

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        large = os.path.join(cls.folder.name, "orbitals.nrrd")
        subprocess.run([PROGRAM, "generate", "orbitals", large, "--size", str(cls.orbitals)], check=True, timeout=300)
        small = write_volume(cls.folder.name, size=64, channels=("a",))
        cls.server = Server(*cls.options, paths=[*small, large])

    @classmethod
    def tearDownClass(cls):
        cls.server.stop()
        cls.folder.cleanup()

    def session(self, **scene):
        status, session = self.server.json("POST", "/api/v1/sessions", {"scene": scene})
        self.assertEqual(status, 201, session)
        return session

    def metric(self, name):
        text = self.server.call("GET", "/metrics")[2].decode()
        return sum(float(line.split()[-1]) for line in text.splitlines() if line.startswith(name))

    def memory(self, field="VmRSS"):
        """A field of the process's status, in MiB."""
        with open(f"/proc/{self.server.process.pid}/status", encoding="utf-8") as file:
            return next(int(line.split()[1]) for line in file if line.startswith(field)) / 1024

    def assert_memory_below(self, found, bound):
        """Does nothing with sanitizers, whose own memory is unknown."""
        if not SANITIZED:
            self.assertLess(found, bound)

    def descriptors(self):
        return len(os.listdir(f"/proc/{self.server.process.pid}/fd"))

    def assert_descriptors_at_most(self, bound):
        """Waits for connections that the server is still closing."""
        for _ in range(200):
            if self.descriptors() <= bound:
                return
            time.sleep(0.05)
        self.fail(f"{self.descriptors()} descriptors, expected at most {bound}")

    def picture(self, session, patch):
        """Edits a session and waits for its picture, like a user who looks at pictures at rest."""
        path = f"/api/v1/sessions/{session['id']}"
        status, _, body = self.server.call("PATCH", path + "/scene", patch)
        self.assertEqual(status, 200, body)
        status = 204
        while status == 204:
            status, _, body = self.server.call("GET", path + "/frame")
        self.assertEqual(status, 200, body)

    def page(self):
        """Opens a page and closes it when its second picture has come."""
        session = self.session(image={"width": 256, "height": 256}, stop={"samples": 1})
        self.picture(session, {"integrator": {"seed": 1}})
        self.server.call("DELETE", f"/api/v1/sessions/{session['id']}")

    def resting(self, width, height, **integrator):
        """Repeatedly waits until its own picture is at rest and changes it."""
        session = self.session(image={"width": width, "height": height}, stop={"samples": 1}, integrator=integrator)
        self.addCleanup(self.server.call, "DELETE", f"/api/v1/sessions/{session['id']}")
        return lambda seeds=itertools.count(1): self.picture(session, {"integrator": {"seed": next(seeds)}})

    def beside(self):
        """The actions of users who wait for pictures at rest. The small pictures use the method auto."""
        return {"page": self.page, "resting": self.resting(256, 256),
                "1920x1080": self.resting(1920, 1080, method="raymarch", step=2)}

    def under(self, attack, memory, seconds=SECONDS, beside=None, late_share=LATE_SHARE):
        """Calls attack(over) while Innocent works. Asserts that it got at least a tenth of the frames that it gets
        without an attack (a server that stalls sends one or none) and, with the full attacks, that no larger share was
        late; that each of the actions `beside` is done, too; that the server took at most `memory` MiB (and SLACK)
        more; and that it closed all descriptors."""
        descriptors, before = self.descriptors(), self.memory()
        with open(f"/proc/{self.server.process.pid}/clear_refs", "w", encoding="utf-8") as file:
            file.write("5")  # resets VmHWM
        self.latencies_under(attack, seconds, beside or {}, late_share)
        print(f"memory: {before:.0f} MiB before, {self.memory():.0f} MiB after, at most {self.memory('VmHWM'):.0f} MiB",
              flush=True)
        self.assert_memory_below(self.memory("VmHWM"), before + memory + SLACK)
        self.assert_descriptors_at_most(descriptors + 4)

    def done(self, works, count):
        """The durations of each work since the last call; waits until each has been done `count` times."""
        for _ in range(1200):
            if all(len(work.seconds) >= count or work.failures for work in works.values()):
                break
            time.sleep(0.1)
        else:
            self.fail(f"in two minutes: { {name: work.seconds for name, work in works.items()} }")
        taken = {name: work.seconds for name, work in works.items()}
        for work in works.values():
            work.seconds = []
        return taken

    def latencies_under(self, attack, seconds, beside, late_share):
        with contextlib.ExitStack() as stack:
            viewer = stack.enter_context(Innocent(self.server))
            works = {name: stack.enter_context(Repeated(action)) for name, action in beside.items()}
            before = viewer.watch(max(2, seconds / 3))
            undisturbed = self.done(works, 1)
            over = threading.Event()
            failures = []

            def run():
                try:
                    attack(over)
                except Exception as error:  # pylint: disable=broad-except
                    failures.append(error)

            thread = threading.Thread(target=run)
            thread.start()
            during = viewer.watch(seconds)
            attacked = self.done(works, 2)  # the first may have begun before the attack
            over.set()
            thread.join(120)
            rate = len(before) / max(2, seconds / 3)
            bar = max(LATE, 3 * percentile(before, .95))
            late = sum(latency > bar for latency in during)
            print(f"\n{self.id().split('.')[-1]}: undisturbed {rate:.1f} frames/s, median {percentile(before, .5) * 1e3:.0f} "
                  f"ms, p95 {percentile(before, .95) * 1e3:.0f} ms; attacked {len(during) / seconds:.1f} frames/s, median "
                  f"{percentile(during, .5) * 1e3:.0f} ms, p95 {percentile(during, .95) * 1e3:.0f} ms, longest "
                  f"{max(during, default=float('inf')) * 1e3:.0f} ms; {late} of {len(during)} later than {bar * 1e3:.0f} ms", flush=True)
            self.assertEqual(failures + sum((work.failures for work in works.values()), []), [])
            for name in works:
                print(f"{name}: undisturbed at most {max(undisturbed[name]):.1f} s, attacked {max(attacked[name]):.1f} s")
            self.assertIsNone(viewer.process.poll())
            self.assertGreaterEqual(len(during), rate * seconds / 10)
            if FULL and not SANITIZED:
                self.assertLessEqual(late, late_share * len(during))


if __name__ == "__main__":
    asyncio.run(work(argparse.Namespace(port=int(sys.argv[1]), token=sys.argv[2]), sys.argv[3]))
