#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""TLS: pages, calls and streams over it, and the errors for unusable certificate files."""
import asyncio
import http.client
import json
import os
import socket
import ssl
import subprocess
import sys
import tempfile
import threading
import time
import unittest

import websockets

sys.path.insert(0, os.path.dirname(__file__))
from serving import PROGRAM, Server, frame_header, write_volume  # noqa: E402

RENDER = {"image": {"width": 48, "height": 32}, "stop": {"samples": 4}}


def make_certificate(folder, name, *key):
    """Makes a self-signed certificate for 127.0.0.1 and its key, as files."""
    files = [os.path.join(folder, f"{name}.{kind}.pem") for kind in ("cert", "key")]
    subprocess.run(["openssl", "req", "-x509", "-nodes", "-days", "2", "-subj", "/CN=127.0.0.1",
                    "-addext", "subjectAltName=IP:127.0.0.1", "-newkey", *(key or ("rsa:2048",)),
                    "-out", files[0], "-keyout", files[1]], check=True, capture_output=True)
    return files


class Tls(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.cert, cls.key = make_certificate(cls.folder.name, "server")
        cls.context = ssl.create_default_context(cafile=cls.cert)
        cls.server = Server("--tls-cert", cls.cert, "--tls-key", cls.key, tls=cls.context)

    @classmethod
    def tearDownClass(cls):
        cls.server.stop()
        cls.folder.cleanup()

    def test_calls_are_answered_over_it(self):
        status, headers, picture = self.server.call("POST", "/api/v1/render", RENDER, {"Accept": "image/png"})
        self.assertEqual((status, headers["Content-Type"]), (200, "image/png"))
        self.assertTrue(picture.startswith(b"\x89PNG"))
        self.assertEqual(self.server.call("GET", "/api/v1/datasets", token=False)[0], 401)

    def test_the_cookie_is_for_it_alone(self):
        plain = Server()
        self.addCleanup(plain.stop)
        for server, secure in ((self.server, True), (plain, False)):
            connection = (http.client.HTTPSConnection("127.0.0.1", server.port, context=self.context) if secure else
                          http.client.HTTPConnection("127.0.0.1", server.port))
            connection.request("GET", f"/?token={server.token}")
            answer = connection.getresponse()
            self.assertEqual(answer.status, 303)
            cookie = answer.getheader("Set-Cookie")
            self.assertEqual("; Secure" in cookie, secure)
            answer.read()
            # The connection stays open, and the cookie authorises the page's calls.
            connection.request("GET", "/api/v1/datasets", headers={"Cookie": cookie.split(";")[0]})
            self.assertEqual(connection.getresponse().status, 200)
            connection.close()

    def test_a_large_answer_and_a_refused_body_arrive_whole(self):
        large = {"image": {"width": 1500, "height": 1500}, "stop": {"samples": 1}}
        status, headers, picture = self.server.call("POST", "/api/v1/render", large, {"Accept": "image/x-exr"})
        self.assertEqual((status, len(picture)), (200, int(headers["Content-Length"])))
        status, _, answer = self.server.call("POST", "/api/v1/render", b" " * 3_000_000,
                                             {"Content-Type": "application/json"})
        self.assertEqual((status, json.loads(answer)["status"]), (413, 413))

    def test_a_stream_runs_over_it(self):
        async def run():
            session = self.server.json("POST", "/api/v1/sessions", {"scene": RENDER})[1]["id"]
            async with websockets.connect(
                    f"wss://127.0.0.1:{self.server.port}/api/v1/sessions/{session}/stream", ssl=self.context,
                    extra_headers={"Authorization": f"Bearer {self.server.token}",
                                   "Origin": f"https://127.0.0.1:{self.server.port}"}) as stream:
                frame = None
                while not frame or frame["samples"] < 4:
                    message = await asyncio.wait_for(stream.recv(), 60)
                    if isinstance(message, bytes):
                        frame = frame_header(message)
                        await stream.send(json.dumps({"type": "ack", "frame": frame["frame"]}))
                self.assertEqual((frame["width"], frame["height"]), (48, 32))
                # Text messages in both directions at once.
                for _ in range(20):
                    for i in range(200):
                        await stream.send(json.dumps({"type": "ping", "id": i}))
                    pongs = 0
                    while pongs < 200:
                        message = await asyncio.wait_for(stream.recv(), 60)
                        pongs += not isinstance(message, bytes) and json.loads(message)["type"] == "pong"
                await stream.send("x" * 2_000_000)
                with self.assertRaises(websockets.ConnectionClosed) as caught:
                    while True:
                        await asyncio.wait_for(stream.recv(), 60)
                self.assertEqual(caught.exception.code, 1009)
        asyncio.run(run())

    def test_who_speaks_something_else_is_left_and_costs_nobody_else(self):
        silent = socket.create_connection(("127.0.0.1", self.server.port))
        plain = socket.create_connection(("127.0.0.1", self.server.port), timeout=60)
        plain.sendall(b"GET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\n")
        self.assertNotIn(b"200", plain.recv(1000))
        plain.close()
        self.assertEqual(self.server.call("GET", "/healthz", token=False)[0], 200)
        silent.settimeout(60)
        self.assertEqual(silent.recv(1000), b"")  # the time limit of the handshake is over
        silent.close()

    def test_it_stops_in_order(self):
        server = Server(environment={"SCOLOPAX_TLS_CERT": self.cert, "SCOLOPAX_TLS_KEY": self.key}, tls=self.context)
        silent = socket.create_connection(("127.0.0.1", server.port))
        answers = []
        endless = {"stop": {"seconds": 60}, "image": {"width": 512, "height": 512}}
        caller = threading.Thread(
            target=lambda: answers.append(server.call("POST", "/api/v1/render", endless)[0]))
        caller.start()
        time.sleep(0.5)
        self.assertEqual(server.stop(), 0)
        caller.join(60)
        silent.close()
        self.assertEqual(answers, [503])


class Files(unittest.TestCase):
    def run_serve(self, *arguments, environment=None):
        clean = {k: v for k, v in os.environ.items() if not k.startswith("SCOLOPAX_")}
        return subprocess.run([PROGRAM, "serve", "--port", "0", *arguments], capture_output=True, text=True, timeout=60,
                              env={**clean, **(environment or {})})

    def test_one_without_the_other_is_bad_usage(self):
        for arguments, environment in ((["--tls-cert", "c.pem"], {}), (["--tls-key", "k.pem"], {}),
                                       ([], {"SCOLOPAX_TLS_KEY": "k.pem"})):
            result = self.run_serve("x.nrrd", *arguments, environment=environment)
            self.assertEqual(result.returncode, 2)
            self.assertIn("--tls-cert and --tls-key together", result.stderr)

    def test_files_that_cannot_serve_are_named_before_any_volume_is_read(self):
        with tempfile.TemporaryDirectory() as folder:
            cert, key = make_certificate(folder, "a")
            other_key = make_certificate(folder, "b")[1]
            curve_key = make_certificate(folder, "c", "ec", "-pkeyopt", "ec_paramgen_curve:P-256")[1]
            locked = os.path.join(folder, "locked.pem")
            subprocess.run(["openssl", "rsa", "-aes256", "-passout", "pass:secret", "-in", key, "-out", locked],
                           check=True, capture_output=True)
            volume = write_volume(folder)[0]
            for used_cert, used_key, named, why in (
                    ("/nowhere.pem", key, "/nowhere.pem", "No such file"),
                    (cert, "/nowhere.pem", "/nowhere.pem", "No such file"),
                    (volume, key, volume, "expected a PEM certificate"), (cert, volume, volume, "expected a PEM key"),
                    (folder, key, folder, "directory"), (cert, other_key, other_key, "expected the key of"),
                    (cert, curve_key, curve_key, "expected the key of"), (cert, locked, locked, "without a password")):
                result = self.run_serve("/nowhere/brain.nrrd", "--tls-cert", used_cert, "--tls-key", used_key)
                self.assertEqual(result.returncode, 1, result.stderr)
                self.assertIn(named, result.stderr)
                self.assertIn(why, result.stderr)
                self.assertEqual(len(result.stderr.strip().splitlines()), 1, result.stderr)
                self.assertNotIn("brain.nrrd", result.stderr)


if __name__ == "__main__":
    unittest.main()
