#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Tests of the program as a process: options, HTTP, limits, streams, resuming, stopping."""
import asyncio
import json
import os
import select
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import unittest

import websockets

sys.path.insert(0, os.path.dirname(__file__))
from serving import PROGRAM, Server, frame_header, write_volume  # noqa: E402

RENDER = {"image": {"width": 48, "height": 32}, "stop": {"samples": 4}}
INTERACTIVE, FINAL = 1, 2


def connect(server, session):
    return websockets.connect(
        f"ws://127.0.0.1:{server.port}/api/v1/sessions/{session}/stream",
        extra_headers={"Authorization": f"Bearer {server.token}"}, max_size=None)


async def read(socket, wanted):
    """The first wanted message; acknowledges frames. Frames and texts are both dicts."""
    while True:
        message = await asyncio.wait_for(socket.recv(), 60)
        if isinstance(message, bytes):
            message = {"type": "frame", **frame_header(message), "image": message[48:]}
            await socket.send(json.dumps({"type": "ack", "frame": message["frame"]}))
        else:
            message = json.loads(message)
        if wanted(message):
            return message


def is_type(name):
    return lambda message: message["type"] == name


def is_final(revision):
    return lambda m: m["type"] == "frame" and m["revision"] == revision and m["flags"] & FINAL


def run(*arguments, environment=None):
    clean = {k: v for k, v in os.environ.items() if not k.startswith("SCOLOPAX_")}
    return subprocess.run([PROGRAM, *arguments], capture_output=True, text=True, timeout=60,
                          env={**clean, **(environment or {})})


class CommandLine(unittest.TestCase):
    def run_serve(self, *arguments, environment=None):
        return run("serve", *arguments, environment=environment)

    def test_without_a_path_it_is_bad_usage_with_a_hint(self):
        result = self.run_serve()
        self.assertEqual(result.returncode, 2)
        self.assertIn("generate orbitals", result.stderr)

    def test_a_missing_file_fails_with_its_name(self):
        result = self.run_serve("/nowhere/brain.nrrd", "--port", "0")
        self.assertEqual(result.returncode, 1)
        self.assertIn("/nowhere/brain.nrrd", result.stderr)

    def test_help_names_every_limit(self):
        result = self.run_serve("--help")
        self.assertEqual(result.returncode, 0)
        for option in ("--host", "--port", "--token-file", "--data-root", "--threads", "--log-level", "--max-sessions",
                       "--max-clients", "--max-image", "--max-render-seconds", "--max-body", "--config",
                       "--trusted-proxy"):
            self.assertIn(option, result.stdout)
        self.assertIn("by default, a new random token at each start", " ".join(result.stdout.split()))

    def test_a_path_outside_the_data_root_is_refused(self):
        with tempfile.TemporaryDirectory() as root:
            result = self.run_serve("../etc/passwd", "--data-root", root, "--port", "0")
        self.assertEqual(result.returncode, 1)
        self.assertIn("--data-root", result.stderr)

    def test_the_command_line_wins_over_the_environment_and_that_over_the_file(self):
        with tempfile.TemporaryDirectory() as folder:
            config = os.path.join(folder, "scolopax.toml")
            with open(config, "w", encoding="utf-8") as file:
                file.write("max-sessions = 3\nmax-clients = 4\n[serve]\nmax-renders = 5\n")
            with Server("--config", config, "--max-clients", "6",
                        environment={"SCOLOPAX_MAX_SESSIONS": "7", "SCOLOPAX_MAX_CLIENTS": "8"}) as server:
                limits = server.json("GET", "/api/v1/capabilities")[1]["limits"]
        self.assertEqual((limits["sessions"], limits["clients"], limits["renders"]), (7, 6, 5))

    def test_a_configuration_file_with_an_unknown_name_is_bad_usage(self):
        with tempfile.TemporaryDirectory() as folder:
            config = os.path.join(folder, "scolopax.toml")
            with open(config, "w", encoding="utf-8") as file:
                file.write("max-seshuns = 3\n")
            result = self.run_serve("x.nrrd", "--config", config)
        self.assertEqual(result.returncode, 2)
        self.assertIn("max-seshuns", result.stderr)

    def test_the_environment_is_read_only_by_the_command_that_uses_it(self):
        bad = {"SCOLOPAX_PORT": "abc", "SCOLOPAX_THREADS": "abc", "SCOLOPAX_CONFIG": "/nowhere"}
        with tempfile.TemporaryDirectory() as folder:
            volume, picture = os.path.join(folder, "o.nrrd"), os.path.join(folder, "o.png")
            for arguments in (["generate", "orbitals", volume, "--size", "4"], ["info", volume],
                              ["render", "--data", volume, "-o", picture, "--samples", "1"],
                              ["compare", picture, picture]):
                used = bad if arguments[0] != "render" else {**bad, "SCOLOPAX_THREADS": "1"}
                result = run(*arguments, environment=used)
                self.assertEqual((result.returncode, result.stderr), (0, ""), arguments)
            # The option takes precedence over the environment.
            render = ["render", "--data", volume, "-o", picture, "--samples", "1"]
            result = run(*render, environment={"SCOLOPAX_THREADS": "abc"})
            self.assertEqual(result.returncode, 2)
            self.assertIn("SCOLOPAX_THREADS", result.stderr)
            self.assertEqual(run(*render, "--threads", "1", environment={"SCOLOPAX_THREADS": "abc"}).returncode, 0)
        for name, value in bad.items():
            result = self.run_serve("x.nrrd", environment={name: value})
            self.assertEqual(result.returncode, 2)
            self.assertIn(name, result.stderr)

    def test_bad_usage_names_what_is_wrong(self):
        with tempfile.TemporaryDirectory() as folder:
            picture = os.path.join(folder, "a.png")
            render = ["render", "--data", *write_volume(folder), "-o", picture]
            for word, *arguments in (
                    ("bogus", "bogus"), ("bogus", "generate", "bogus"), ("--bogus", "--bogus"),
                    (folder, "serve", "x.nrrd", "--config", folder),
                    ("nan", *render, "--error", "nan"), ("inf", *render, "--seconds", "inf"),
                    ("nan", "serve", "x.nrrd", "--keep-session", "nan"),
                    ("lab.example", "serve", "x.nrrd", "--trusted-proxy", "127.0.0.1", "--trusted-proxy", "lab.example"),
                    ("camera.=1", *render, "--set", "camera.=1"), ("a..b=1", *render, "--set", "a..b=1"),
                    (".a=1", *render, "--set", ".a=1")):
                result = run(*arguments)
                self.assertEqual(result.returncode, 2, arguments)
                self.assertIn(word, result.stderr)
            self.assertFalse(os.path.exists(picture))

    def test_a_place_that_cannot_be_written_to_is_refused_before_rendering(self):
        with tempfile.TemporaryDirectory() as folder:
            picture = os.path.join(folder, "a.png")
            data = ["--data", "/nowhere/brain.nrrd"]  # must not even be opened
            for out, place in ((["-o", "/nowhere/x.png"], "/nowhere/x.png"), (["-o", folder + "/x.png/y.png"], "y.png"),
                               (["-o", picture, "--stats", "/nowhere/s.json"], "/nowhere/s.json"),
                               (["-o", picture, "--stats", folder], folder)):
                result = run("render", *data, *out)
                self.assertEqual(result.returncode, 1)
                self.assertIn(place, result.stderr)
                self.assertNotIn("brain.nrrd", result.stderr)
            self.assertEqual(os.listdir(folder), [])

    def wait_until_it_catches(self, process, how):
        while process.poll() is None:
            with open(f"/proc/{process.pid}/status", encoding="utf-8") as file:
                caught = next(line for line in file if line.startswith("SigCgt"))
            if int(caught.split()[1], 16) >> (how - 1) & 1:
                return
            threading.Event().wait(0.02)
        self.fail(process.communicate()[1])

    def test_a_signal_ends_a_render_with_the_picture_as_it_stands(self):
        for how in (signal.SIGINT, signal.SIGTERM):
            with tempfile.TemporaryDirectory() as folder:
                picture, stats = os.path.join(folder, "a.png"), os.path.join(folder, "s.json")
                process = subprocess.Popen(
                    [PROGRAM, "render", "--data", *write_volume(folder), "-o", picture, "--stats", stats, "--seconds", "600",
                     "--set", "image.width=16", "--set", "image.height=16"], stderr=subprocess.PIPE, text=True)
                self.wait_until_it_catches(process, how)
                threading.Event().wait(0.5)
                process.send_signal(how)
                _, said = process.communicate(timeout=60)
                self.assertEqual(process.returncode, -how, said)
                with open(stats, encoding="utf-8") as file:
                    samples = json.load(file)["samples"]
                self.assertGreater(samples, 0)
                self.assertIn(f"interrupted after {samples} samples", said)
                with open(picture, "rb") as file:
                    self.assertTrue(file.read().startswith(b"\x89PNG"))

    def test_a_signal_before_the_first_sample_leaves_no_picture(self):
        with tempfile.TemporaryDirectory() as folder:
            picture = os.path.join(folder, "a.png")
            with open(picture, "w", encoding="utf-8") as file:
                file.write("before")
            process = subprocess.Popen(
                [PROGRAM, "render", "--data", *write_volume(folder, size=32), "-o", picture, "--threads", "1",
                 "--set", "image.width=4096", "--set", "image.height=4096"], stderr=subprocess.PIPE, text=True)
            self.wait_until_it_catches(process, signal.SIGINT)
            process.send_signal(signal.SIGINT)
            _, said = process.communicate(timeout=60)
            self.assertEqual(process.returncode, -signal.SIGINT)
            self.assertIn("no picture is written", said)
            with open(picture, encoding="utf-8") as file:
                self.assertEqual(file.read(), "before")

    def test_what_else_is_known_of_the_pixels_goes_into_files(self):
        with tempfile.TemporaryDirectory() as folder:
            at = lambda name: os.path.join(folder, name)
            render = ["render", "--data", *write_volume(folder), "-o", at("a.png"), "--samples", "4",
                      "--set", "image.width=16", "--set", "image.height=16"]
            result = run(*render, "--aov", "depth=" + at("d.exr"), "--aov", "cost=" + at("c.png"))
            self.assertEqual((result.returncode, result.stderr), (0, ""))
            with open(at("d.exr"), "rb") as depth, open(at("c.png"), "rb") as cost, open(at("a.png"), "rb") as picture:
                self.assertTrue(depth.read().startswith(b"\x76\x2f\x31\x01"))
                self.assertNotEqual(cost.read(), picture.read())
            for bad in ("depth", "depth=", "=a.exr", "normal=a.exr"):
                result = run(*render, "--aov", bad)
                self.assertEqual(result.returncode, 2, bad)
                self.assertIn("depth, transmittance, channel, cost", result.stderr)
            self.assertEqual(run(*render, "--aov", "depth=" + at("d.gif")).returncode, 1)
            for twice in (["--aov", "cost=" + at("a.png")], ["--aov", "cost=" + at("c.exr"), "--stats", at("c.exr")],
                          ["--stats", render[2]]):
                self.assertEqual(run(*render, *twice).returncode, 2, twice)
            self.assertEqual(run(*render, "--aov", "depth=" + at("none/d.exr")).returncode, 1)

    def test_a_number_out_of_range_is_said_in_few_digits(self):
        with tempfile.TemporaryDirectory() as folder:
            for field in ("integrator.step=1e308", "camera.fovY=1e308", "camera.fovY=-1e308"):
                result = run("render", "--data", *write_volume(folder), "-o", os.path.join(folder, "a.png"),
                             "--set", field)
                self.assertEqual(result.returncode, 1)
                self.assertIn("1e+308", result.stderr)
                self.assertLess(len(result.stderr), 200)

    def test_an_allowed_origin_may_be_the_name_of_a_proxy_in_front(self):
        name = {"Host": "lab.example"}
        with Server() as server:
            self.assertEqual(server.call("GET", "/api/v1/datasets", headers=name)[0], 421)
        with Server("--allow-origin", "https://lab.example") as server:
            self.assertEqual(server.call("GET", "/api/v1/datasets", headers=name)[0], 200)

    def test_the_token_of_a_file_is_used(self):
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "token")
            with open(path, "w", encoding="utf-8") as file:
                file.write("a-token-of-my-own-choice\n")
            with Server("--token-file", path) as server:
                self.assertEqual(server.token, "a-token-of-my-own-choice")
                self.assertEqual(server.call("GET", "/api/v1/datasets")[0], 200)


class Http(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.server = Server("--max-image", "40000", "--max-body", "20000", "--max-sessions", "3")

    @classmethod
    def tearDownClass(cls):
        cls.server.stop()

    def problem(self, *call, **more):
        status, headers, body = self.server.call(*call, **more)
        self.assertEqual(headers["Content-Type"], "application/problem+json")
        problem = json.loads(body)
        self.assertEqual(problem["status"], status)
        return status, problem.get("pointer", ""), problem.get("detail", "")

    def test_only_health_is_open(self):
        for path in ("/healthz", "/readyz"):
            self.assertEqual(self.server.call("GET", path, token=False)[0], 200)
        for path in ("/metrics", "/api/v1/datasets", "/api/v1/openapi.json"):
            self.assertEqual(self.server.call("GET", path, token=False)[0], 401)

    def test_the_address_of_the_ready_line_opens_the_page_or_says_how_to_build_it(self):
        self.assertEqual(self.server.call("GET", "/", token=False)[0], 401)
        status, headers, body = self.server.call("GET", "/")
        self.assertEqual(status, 200)
        if headers["Content-Type"].startswith("text/plain"):
            self.assertIn(b"npm run build", body)
        else:
            self.assertIn(b"<script", body)

    def test_files_of_one_grid_are_channels_of_one_data_set(self):
        status, answer = self.server.json("GET", "/api/v1/datasets")
        self.assertEqual(status, 200)
        self.assertEqual(len(answer["datasets"]), 1)
        dataset = answer["datasets"][0]
        self.assertEqual(dataset["dims"], [16, 16, 16])
        self.assertEqual(len(dataset["channels"]), 2)
        path = f"/api/v1/datasets/{dataset['id']}"
        self.assertEqual(self.server.json("GET", path)[1], dataset)
        histogram = self.server.json("GET", path + "/histogram?channel=0")[1]
        self.assertEqual(sum(histogram["bins"]), 16**3)
        self.assertEqual(self.server.json("GET", path + "/probe?x=8&y=8&z=8")[1]["values"], [200, 100])

    def test_the_same_render_gives_the_same_bytes(self):
        for accept, magic in (("image/jpeg", b"\xff\xd8"), ("image/png", b"\x89PNG"), ("image/x-exr", b"v/1\x01")):
            first = self.server.call("POST", "/api/v1/render", RENDER, {"Accept": accept})
            second = self.server.call("POST", "/api/v1/render", RENDER, {"Accept": accept})
            self.assertEqual(first[0], 200)
            self.assertTrue(first[2].startswith(magic))
            self.assertEqual(first[2], second[2])
            self.assertEqual(first[1]["Content-Type"], accept)
            self.assertEqual(first[1]["Scolopax-Samples"], "4")
        other = self.server.call("POST", "/api/v1/render", {**RENDER, "integrator": {"seed": 1}})
        self.assertNotEqual(other[2], self.server.call("POST", "/api/v1/render", RENDER)[2])

    def test_what_is_wrong_is_named(self):
        bad = {"channels": [{}, {"opacity": [[0, 0], [0.5, 2]]}]}
        self.assertEqual(self.problem("POST", "/api/v1/render", bad)[:2], (422, "/channels/1/opacity/1/1"))
        self.assertEqual(self.problem("POST", "/api/v1/render", {"image": {"width": 201, "height": 200}})[:2],
                         (422, "/image"))
        self.assertEqual(self.problem("POST", "/api/v1/render", {**RENDER, "stop": {"seconds": 1e6}})[:2], (422, "/stop/seconds"))
        self.assertEqual(self.problem("POST", "/api/v1/render", RENDER, {"Accept": "text/html"})[0], 406)
        self.assertEqual(self.problem("POST", "/api/v1/render", b"{}", {"Content-Type": "text/plain"})[0], 415)
        self.assertEqual(self.problem("POST", "/api/v1/render", b"{", {"Content-Type": "application/json"})[0], 400)
        self.assertEqual(self.problem("POST", "/api/v1/render", b" " * 20001,
                                      {"Content-Type": "application/json"})[0], 413)
        deep = b"[" * 100 + b"]" * 100
        self.assertEqual(self.problem("POST", "/api/v1/render", deep, {"Content-Type": "application/json"})[0], 400)
        self.assertEqual(self.problem("GET", "/api/v1/datasets/none")[0], 404)
        self.assertEqual(self.problem("GET", "/api/v1/nonsense")[0], 404)
        self.assertEqual(self.problem("DELETE", "/api/v1/render")[0], 405)

    def test_a_session_is_edited_and_watched_by_a_script(self):
        status, session = self.server.json("POST", "/api/v1/sessions", {"scene": RENDER})
        self.assertEqual(status, 201)
        path = f"/api/v1/sessions/{session['id']}"
        status, headers, picture = self.server.call("GET", path + "/frame?minSamples=4&format=png")
        self.assertEqual((status, headers["Scolopax-Samples"], headers["Scolopax-Final"]), (200, "4", "1"))
        self.assertTrue(picture.startswith(b"\x89PNG"))
        status, scene = self.server.json("PATCH", path + "/scene", {"channels": {"1": {"color": "#ff0000"}}},
                                         {"Content-Type": "application/merge-patch+json", "If-Match": "\"1\""})
        self.assertEqual((status, scene["revision"], scene["scene"]["channels"][1]["color"]), (200, 2, "#ff0000"))
        self.assertEqual(self.problem("PATCH", path + "/scene", {}, {"If-Match": "\"1\""})[0], 409)
        self.assertEqual(self.problem("PATCH", path + "/scene", {"channels": {"7": {}}})[0], 422)
        status, headers, other = self.server.call("GET", path + "/frame?minSamples=4&format=png")
        self.assertEqual(headers["Scolopax-Revision"], "2")
        self.assertNotEqual(other, picture)
        self.assertEqual(self.server.call("DELETE", path)[0], 204)
        self.assertEqual(self.problem("GET", path)[0], 404)

    def test_a_render_ends_when_its_client_goes(self):
        endless = json.dumps({"stop": {"seconds": 60}, "image": {"width": 100, "height": 100}}).encode()
        head = (f"POST /api/v1/render HTTP/1.1\r\nHost: localhost\r\nAuthorization: Bearer {self.server.token}\r\n"
                f"Content-Type: application/json\r\nContent-Length: {len(endless)}\r\n\r\n").encode()

        def begin():
            client = socket.create_connection(("127.0.0.1", self.server.port))
            client.sendall(head + endless)
            return client

        clients = [begin() for _ in range(2)]
        call = ("POST", "/api/v1/render", RENDER)
        try:
            for _ in range(600):
                if self.server.call(*call)[0] == 503:  # both slots are taken
                    break
                for i, client in enumerate(clients):  # a client may have been refused while this call had its slot
                    if select.select([client], [], [], 0)[0]:
                        client.close()
                        clients[i] = begin()
                threading.Event().wait(0.05)
            else:
                self.fail("the renders never began")
        finally:
            for client in clients:
                client.close()
        for _ in range(200):
            if self.server.call(*call)[0] == 200:
                return
            threading.Event().wait(0.05)
        self.fail("the renders go on")

    def test_sessions_are_limited(self):
        made = [self.server.json("POST", "/api/v1/sessions", {"scene": RENDER})[1]["id"] for _ in range(3)]
        status, headers, _ = self.server.call("POST", "/api/v1/sessions", {"scene": RENDER})
        self.assertEqual(status, 503)
        self.assertIn("Retry-After", headers)
        for session in made:
            self.assertEqual(self.server.call("DELETE", f"/api/v1/sessions/{session}")[0], 204)

    def test_it_describes_itself(self):
        paths = self.server.json("GET", "/api/v1/openapi.json")[1]["paths"]
        for path in ("/api/v1/render", "/api/v1/sessions/{id}/frame", "/healthz"):
            self.assertIn(path, paths)
        for method, path, statuses in (("post", "/api/v1/sessions", {"201"}), ("delete", "/api/v1/sessions/{id}", {"204"}),
                                       ("get", "/api/v1/sessions/{id}/frame", {"200", "204"})):
            self.assertEqual(set(paths[path][method]["responses"]) - {"default"}, statuses)
        self.assertIn("properties", self.server.json("GET", "/api/v1/schema.json")[1])
        capabilities = self.server.json("GET", "/api/v1/capabilities")[1]
        self.assertIn("superposed", [method["name"] for method in capabilities["methods"]])
        metrics = self.server.call("GET", "/metrics")[2].decode()
        self.assertIn('scolopax_http_requests_total{status="200"}', metrics)


class Stream(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.server = Server()

    @classmethod
    def tearDownClass(cls):
        cls.server.stop()

    def session(self, scene=None):
        return self.server.json("POST", "/api/v1/sessions", {"scene": scene or RENDER})[1]

    def test_a_picture_converges_and_an_edit_begins_anew(self):
        async def run():
            async with connect(self.server, self.session()["id"]) as socket:
                hello = await read(socket, lambda m: True)
                self.assertEqual((hello["type"], hello["version"]), ("hello", 1))
                first = await read(socket, is_type("frame"))
                self.assertEqual((first["magic"], first["headerBytes"], first["codec"]), (b"SCLX", 48, 1))
                self.assertTrue(first["image"].startswith(b"\xff\xd8"))
                final = first if first["flags"] & FINAL else await read(socket, is_final(1))
                self.assertEqual((final["samples"], final["width"], final["height"]), (4, 48, 32))
                await socket.send(json.dumps(
                    {"type": "patch", "id": 7, "patch": {"channels": {"0": {"color": "#00ff00"}}}}))
                edited = await read(socket, lambda m: m["type"] == "frame" and m["revision"] == 2)
                self.assertEqual(edited["patch"], 7)
                final = await read(socket, is_final(2))
                self.assertFalse(final["flags"] & INTERACTIVE)
        asyncio.run(run())

    def test_a_bad_edit_is_answered_and_changes_nothing(self):
        async def run():
            session = self.session()["id"]
            async with connect(self.server, session) as socket:
                await socket.send(json.dumps({"type": "patch", "id": 3, "patch": {"image": {"width": "wide"}}}))
                error = await read(socket, is_type("error"))
                self.assertEqual((error["id"], error["problem"]["pointer"]), (3, "/image/width"))
                await socket.send("nonsense")
                self.assertEqual((await read(socket, is_type("error")))["problem"]["status"], 400)
                await socket.send(json.dumps({"type": "ping", "id": 5}))
                self.assertEqual((await read(socket, is_type("pong")))["id"], 5)
            self.assertEqual(self.server.json("GET", f"/api/v1/sessions/{session}/scene")[1]["revision"], 1)
        asyncio.run(run())

    def test_other_viewers_are_told(self):
        async def run():
            session = self.session()["id"]
            async with connect(self.server, session) as editor, connect(self.server, session) as other:
                await read(other, is_type("hello"))
                await editor.send(json.dumps({"type": "patch", "id": 1, "patch": {"blend": {"mode": "density"},
                                                                                  "integrator": {"seed": 4}}}))
                told = await read(other, is_type("scene"))
                self.assertEqual((told["revision"], told["patch"]), (2, {"integrator": {"seed": 4}}))
                await read(other, is_final(2))
        asyncio.run(run())

    def test_a_session_is_resumed_with_its_samples(self):
        async def run():
            first = self.session({**RENDER, "stop": {"samples": 100000}})
            async with connect(self.server, first["id"]) as socket:
                seen = await read(socket, lambda m: m["type"] == "frame" and m["samples"] >= 8)
            async with connect(self.server, self.session()["id"]) as socket:
                await socket.send(json.dumps({"type": "resume", "token": first["token"]}))
                await read(socket, lambda m: m["type"] == "hello" and m["session"] == first["id"])
                resumed = await read(socket, is_type("frame"))
                self.assertGreaterEqual(resumed["samples"], seen["samples"])
                self.assertEqual(resumed["revision"], 1)
                await socket.send(json.dumps({"type": "resume", "token": "no such token"}))
                self.assertEqual((await read(socket, is_type("error")))["problem"]["status"], 404)
        asyncio.run(run())

    def test_a_hidden_view_gets_no_frames(self):
        async def run():
            async with connect(self.server, self.session()["id"]) as socket:
                await read(socket, is_final(1))
                await socket.send(json.dumps({"type": "view", "visible": False}))
                await socket.send(json.dumps({"type": "patch", "id": 1, "patch": {"integrator": {"seed": 2}}}))
                await socket.send(json.dumps({"type": "ping", "id": 1}))
                await read(socket, is_type("pong"))
                await socket.send(json.dumps({"type": "view", "visible": True}))
                self.assertEqual((await read(socket, is_type("frame")))["revision"], 2)
        asyncio.run(run())

    def test_an_unknown_session_has_no_stream(self):
        async def run():
            with self.assertRaises(websockets.InvalidStatusCode) as caught:
                async with connect(self.server, "none"):
                    pass
            self.assertEqual(caught.exception.status_code, 404)
        asyncio.run(run())

    def test_edits_from_many_clients_never_mix(self):
        async def run():
            session = self.session({**RENDER, "stop": {"samples": 8}})["id"]

            async def client(number):
                async with connect(self.server, session) as socket:
                    for i in range(1, 31):
                        await socket.send(json.dumps(
                            {"type": "patch", "id": i, "patch": {"integrator": {"seed": 1000 * number + i}}}))
                    return await read(socket, lambda m: m["type"] == "frame" and m["patch"] == 30)

            last = await asyncio.gather(*(client(n) for n in range(4)))
            self.assertLessEqual(max(frame["revision"] for frame in last), 121)
            self.assertEqual(self.server.json("GET", f"/api/v1/sessions/{session}/scene")[1]["revision"], 121)
        asyncio.run(run())


class Ending(unittest.TestCase):
    def test_a_session_ends_some_time_after_its_last_client(self):
        with Server("--keep-session", "0.2") as server:
            session = server.json("POST", "/api/v1/sessions", {})[1]["id"]
            for _ in range(600):
                # A request for metrics does not keep the session alive.
                if "scolopax_sessions 0" in server.call("GET", "/metrics")[2].decode():
                    break
                threading.Event().wait(0.1)
            self.assertEqual(server.call("GET", f"/api/v1/sessions/{session}")[0], 404)

    def test_a_signal_ends_streams_polls_and_renders(self):
        for how in (signal.SIGTERM, signal.SIGINT):
            server = Server()
            answers = {}

            def call(name, *arguments):
                try:
                    answers[name] = server.call(*arguments)[0]
                except OSError as error:
                    answers[name] = error

            async def run():
                scene = {"stop": {"samples": 1}, "image": {"width": 8, "height": 8}}
                session = server.json("POST", "/api/v1/sessions", {"scene": scene})[1]["id"]
                endless = {"stop": {"seconds": 60}, "image": {"width": 512, "height": 512}}
                threads = [
                    threading.Thread(target=call, args=(
                        "poll", "GET", f"/api/v1/sessions/{session}/frame?after=1000000")),
                    threading.Thread(target=call, args=("render", "POST", "/api/v1/render", endless))]
                async with connect(server, session) as socket:
                    await read(socket, is_type("frame"))
                    for thread in threads:
                        thread.start()
                    await asyncio.sleep(0.5)
                    server.process.send_signal(how)
                    with self.assertRaises(websockets.ConnectionClosed) as caught:
                        await read(socket, lambda m: False)
                    self.assertEqual(caught.exception.code, 1001)
                for thread in threads:
                    thread.join(60)

            asyncio.run(run())
            self.assertEqual(server.stop(None), 0)
            self.assertEqual(answers, {"poll": 503, "render": 503})


if __name__ == "__main__":
    unittest.main()
