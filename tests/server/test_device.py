#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The option --device: without CUDA and, in a program with a CUDA device, the device's pictures and its failures.
SCOLOPAX_TEST_DEVICE states whether the program has one."""
import os
import sys
import tempfile
import unittest

sys.path.insert(0, os.path.dirname(__file__))
from serving import DEVICE, CommandTest, Server  # noqa: E402

SCENE = {"image": {"width": 48, "height": 40}, "stop": {"samples": 2}, "integrator": {"method": "superposed"}}


def render(server, scene=None):
    return server.call("POST", "/api/v1/render", scene or SCENE, {"Accept": "image/x-exr"})


class Devices(CommandTest):
    def test_are_told_by_info(self):
        told = self.run_command("info", "--devices")
        self.assertEqual(told.returncode, 0, told.stderr)
        lines = told.stdout.splitlines()
        self.assertRegex(lines[0], r"^cpu +\d+ threads, ")
        self.assertRegex(lines[1], r"^cuda:0 .*compute capability" if DEVICE == "cuda" else r"^cuda +none: ")
        self.assertEqual(self.run_command("info").returncode, 2)

    def test_that_do_not_exist_are_refused(self):
        for command in (["render", "--data", self.data[0], "-o", self.path("p.png")], ["serve", self.data[0]]):
            answer = self.run_command(*command, "--device", "cuda:7")
            self.assertEqual(answer.returncode, 1)
            self.assertIn("there is no cuda:7" if DEVICE == "cuda" else "--device cuda:7", answer.stderr)
            for name in ("gpu", "cuda:", "cuda:-1", "cuda:1x", "cuda:99999999999"):
                answer = self.run_command(*command, "--device", name)
                self.assertEqual(answer.returncode, 2, name)
                self.assertIn(f"expected auto, cpu, cuda, cuda:N or all, found {name}", answer.stderr)


@unittest.skipIf(DEVICE != "cuda", "the program has no CUDA device")
class CudaDevices(unittest.TestCase):
    def test_render_what_the_cpu_renders(self):
        with Server() as device, Server(device="cpu") as cpu:
            for method in ("superposed", "raymarch", "hybrid"):
                scene = {**SCENE, "integrator": {"method": method}}
                found, expected = render(device, scene), render(cpu, scene)
                self.assertEqual((found[0], expected[0]), (200, 200), found[2][:200])
                self.assertEqual(found[2], expected[2], method)

    def test_that_fail_leave_rendering_to_the_cpu(self):
        with Server(device="cpu") as cpu:
            expected = render(cpu)
        for call in (12, 40, 60):
            with Server(environment={"FAIL_CALL": str(call)}) as server:
                for _ in range(3):
                    self.assertEqual(render(server)[::2], expected[::2])
                server.log.seek(0)
                self.assertEqual(server.log.read().count("rendering goes on on the CPU"), 1, call)

    def test_that_fail_end_in_words_if_that_is_wanted(self):
        with Server("--when-device-fails", "end", environment={"FAIL_CALL": "40"}) as server:
            status, _, answer = render(server)
            self.assertEqual(status, 503)
            self.assertIn(b"CUDA: ", answer)
            self.assertEqual(render(server)[0], 200)  # another renderer, on a device that works again


    def test_forget_what_nobody_watches_when_memory_is_short(self):
        with tempfile.TemporaryDirectory() as folder:
            paths = []
            for name, depth in (("one", 256), ("other", 255)):
                paths.append(os.path.join(folder, f"{name}_256x256x{depth}_uint8.raw"))
                with open(paths[-1], "wb") as file:
                    file.write(bytes(range(256)) * (256 * depth))
            # For one of them.
            with Server(paths=paths, environment={"DEVICE_BYTES": str(30 << 20)}) as server:
                for dataset in server.json("GET", "/api/v1/datasets")[1]["datasets"]:
                    scene = {**SCENE, "dataset": dataset["id"]}
                    status, session = server.json("POST", "/api/v1/sessions", {"scene": scene})
                    self.assertEqual(status, 201, session)
                    status, _, answer = server.call("GET", f"/api/v1/sessions/{session['id']}/frame?timeout=30")
                    self.assertEqual(status, 200, answer[:200])


if __name__ == "__main__":
    unittest.main()
