#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Checks the server against protocol/PROTOCOL.md with a client that was written from it (protocol_client.py), also over
a slow connection. Only counts are checked, no times. The volume is serving.py's: channel 0 is a ball of 200, 1 a box
of 100."""
import asyncio
import json
import os
import sys
import unittest

import websockets

sys.path.insert(0, os.path.dirname(__file__))
from protocol_client import (FINAL, PATIENCE, Frame, Proxy, Viewer, apply_patch, call, call_json, connect,  # noqa: E402
                             png_colors, png_size)
from serving import DEVICE, Server  # noqa: E402

FIXTURES = os.path.join(os.path.dirname(__file__), "..", "..", "protocol", "fixtures")
SMALL = {"width": 64, "height": 48}
ENDLESS = {"samples": 1 << 24}
PICTURES = {"image/jpeg": b"\xff\xd8\xff", "image/png": b"\x89PNG\r\n\x1a\n", "image/x-exr": b"\x76\x2f\x31\x01"}
server = None


def setUpModule():
    global server
    server = Server("--threads", "1", "--max-sessions", "4", "--max-message", "65536")


def tearDownModule():
    if server.stop() != 0:
        raise AssertionError("the server did not end well")


def begin(test, scene):
    """Creates a session that ends with the test."""
    status, session = call_json(server, "POST", "/api/v1/sessions", {"scene": scene})
    test.assertEqual(status, 201, session)
    cleanup = getattr(test, "addAsyncCleanup", None)
    if cleanup:
        cleanup(asyncio.to_thread, call, server, "DELETE", path_of(session))
    else:
        test.addCleanup(call, server, "DELETE", path_of(session))
    return session


def path_of(session, rest=""):
    return f"/api/v1/sessions/{session['id']}{rest}"


class DataSets(unittest.TestCase):
    def setUp(self):
        self.datasets = call_json(server, "GET", "/api/v1/datasets")[1]["datasets"]
        self.path = f"/api/v1/datasets/{self.datasets[0]['id']}"

    def test_are_told_with_grid_world_and_channels(self):
        self.assertEqual(len(self.datasets), 1)
        data = self.datasets[0]
        self.assertEqual((data["dims"], data["spacing"]), ([16, 16, 16], [1, 1, 1]))
        self.assertAlmostEqual(data["diagonal"], 16 * 3**0.5)
        self.assertEqual(len(data["worldFromVoxel"]), 16)
        self.assertEqual([(c["type"], c["minimum"], c["maximum"]) for c in data["channels"]],
                         [("u8", 0, 200), ("u8", 0, 100)])
        self.assertEqual(call_json(server, "GET", self.path), (200, data))
        self.assertEqual(call_json(server, "GET", "/api/v1/datasets/none")[0], 404)

    def test_histograms_count_every_voxel_in_its_bin(self):
        # A ball of radius 16/3 and the cube of the 7^3 voxels less than 4 from the centre.
        ball = sum((x - 8)**2 + (y - 8)**2 + (z - 8)**2 < (16 / 3)**2
                   for x in range(16) for y in range(16) for z in range(16))
        for channel, inside in ((0, ball), (1, 7**3)):
            status, told = call_json(server, "GET", f"{self.path}/histogram?channel={channel}")
            self.assertEqual(status, 200)
            self.assertEqual((told["channel"], told["minimum"], told["maximum"]), (channel, 0, (200, 100)[channel]))
            self.assertEqual((told["finiteCount"], told["nonFiniteCount"]), (16**3, 0))
            self.assertEqual(told["bins"], [16**3 - inside] + [0] * 254 + [inside])
        self.assertEqual(call_json(server, "GET", f"{self.path}/histogram")[1]["channel"], 0)
        self.assertEqual(call_json(server, "GET", f"{self.path}/histogram?channel=2")[0], 422)

    def probe(self, *voxel):
        m = self.datasets[0]["worldFromVoxel"]
        x, y, z = (sum(m[4 * k + row] * v for k, v in enumerate((*voxel, 1))) for row in range(3))
        status, told = call_json(server, "GET", f"{self.path}/probe?x={x}&y={y}&z={z}")
        self.assertEqual(status, 200, told)
        for found, expected in zip(told["voxel"], voxel):
            self.assertAlmostEqual(found, expected)
        return told["inside"], told["values"]

    def test_probes_interpolate_between_centres_and_know_the_box(self):
        self.assertEqual(self.probe(8, 8, 8), (True, [200, 100]))
        self.assertEqual(self.probe(11.25, 8, 8), (True, [200, 75]))
        self.assertEqual(self.probe(-0.5, 0, 0), (True, [0, 0]))
        self.assertEqual(self.probe(-0.6, 0, 0), (False, [None, None]))


class Description(unittest.TestCase):
    def test_capabilities_hold_what_is_documented(self):
        status, told = call_json(server, "GET", "/api/v1/capabilities")
        self.assertEqual((status, told["protocolVersion"], told["backend"]), (200, 1, DEVICE))
        parts = call_json(server, "GET", "/api/v1/schema.json")[1]["$defs"]
        for list_name, part, field in (("methods", "Integrator", "method"), ("blendModes", "Blend", "mode"),
                                       ("filters", "ImageSettings", "filter"),
                                       ("samplings", "Integrator", "sampling"),
                                       ("interpolations", "Channel", "interpolation")):
            self.assertEqual([entry["name"] for entry in told[list_name]], parts[part]["properties"][field]["enum"])
            self.assertTrue(all(entry["doc"] for entry in told[list_name]))
        self.assertEqual({entry["name"]: entry["points"] for entry in told["colormaps"]}["gray"][-1], [1, "#ffffff"])
        self.assertEqual(told["imageFormats"], list(PICTURES))
        self.assertEqual((told["limits"]["sessions"], told["limits"]["messageBytes"]), (4, 65536))
        self.assertEqual(set(told["limits"]), set(
            "bodyBytes messageBytes imageWidth imageHeight imagePixels memoryBytes renders waitingPolls waitingPicks "
            "waitingEdits pickPixels macrocells sessions clients renderSeconds sceneDepth".split()))

    def test_the_schema_is_the_file_beside_the_document(self):
        status, headers, body = call(server, "GET", "/api/v1/schema.json")
        self.assertEqual((status, headers["Content-Type"]), (200, "application/schema+json"))
        with open(os.path.join(FIXTURES, "..", "schema.json"), encoding="utf-8") as file:
            self.assertEqual(json.loads(body), json.load(file))
        status, openapi = call_json(server, "GET", "/api/v1/openapi.json")
        self.assertEqual((status, openapi["openapi"][:4]), (200, "3.1."))

    def test_documented_header_bytes_have_the_documented_fields(self):
        with open(os.path.join(FIXTURES, "frame_headers.json"), encoding="utf-8") as file:
            good = [entry for entry in json.load(file) if entry["header"]]
        self.assertTrue(good)
        for entry in good:
            frame = Frame(bytes.fromhex(entry["hex"]))
            for name, value in entry["header"].items():
                found = getattr(frame, name)
                self.assertEqual(None if found != found else found, value, f"{entry['name']}: {name}")


class Access(unittest.TestCase):
    def test_is_shown_by_head_address_or_cookie_and_else_refused(self):
        for token in (None, "Bearer nonsense"):
            for path in ("/", "/api/v1/datasets", "/api/v1/capabilities", "/metrics"):
                status, headers, body = call(server, "GET", path, authorization=token)
                self.assertEqual((status, headers["Content-Type"]), (401, "application/problem+json"), path)
                self.assertEqual(json.loads(body)["status"], 401)
            self.assertEqual(call(server, "GET", "/healthz", authorization=token)[0], 200)
            self.assertEqual(call(server, "GET", "/readyz", authorization=token)[0], 200)
        self.assertEqual(call(server, "GET", f"/api/v1/datasets?token={server.token}", authorization=None)[0], 200)

        status, headers, _ = call(server, "GET", f"/?token={server.token}", authorization=None)
        cookie, *attributes = headers["Set-Cookie"].split("; ")
        self.assertEqual(status, 303)
        self.assertLessEqual({"HttpOnly", "SameSite=Strict"}, set(attributes))
        own = f"http://127.0.0.1:{server.port}"
        for origin, expected in ((None, 403), ("http://example.org", 403), (own, 200)):
            self.assertEqual(call(server, "POST", "/api/v1/render", {"image": SMALL, "stop": {"samples": 1}},
                                  authorization=None, cookie=cookie, origin=origin)[0], expected, origin)
        self.assertEqual(call(server, "GET", "/api/v1/datasets", authorization=None, cookie=cookie)[0], 200)
        self.assertEqual(call(server, "GET", "/api/v1/datasets", host="example.org")[0], 421)


class Rendering(unittest.TestCase):
    SCENE = {"image": SMALL, "stop": {"samples": 3}, "integrator": {"seed": 5, "method": "sync-dda"}}

    def test_gives_the_same_bytes_twice_in_every_format(self):
        for kind, magic in PICTURES.items():
            answers = [call(server, "POST", "/api/v1/render", self.SCENE, accept=kind) for _ in range(2)]
            for status, headers, body in answers:
                self.assertEqual((status, headers["Content-Type"], body[:len(magic)]), (200, kind, magic))
                self.assertEqual((headers["Scolopax-Samples"], headers["Scolopax-Seed"], headers["Scolopax-Method"]),
                                 ("3", "5", "sync-dda"))
                self.assertGreater(float(headers["Scolopax-Error"]), 0)
            self.assertEqual(answers[0][2], answers[1][2], kind)
            self.assertEqual(answers[0][1]["Scolopax-Scene"], answers[1][1]["Scolopax-Scene"])
        headers = call(server, "POST", "/api/v1/render", self.SCENE, accept=None)[1]
        self.assertEqual(headers["Content-Type"], "image/jpeg")
        self.assertEqual(call(server, "POST", "/api/v1/render", self.SCENE, accept="image/webp")[0], 406)

    def test_of_a_resolved_scene_gives_the_picture_of_the_sparse_one(self):
        resolved = begin(self, self.SCENE)["scene"]
        self.assertNotIn("null", json.dumps(resolved))
        sparse, full = (call(server, "POST", "/api/v1/render", scene, accept="image/png")[2]
                        for scene in (self.SCENE, resolved))
        self.assertEqual(png_size(sparse), (64, 48))
        self.assertGreater(len(png_colors(sparse)), 4)
        self.assertEqual(sparse, full)

    def test_of_nothing_is_exactly_the_background(self):
        scene = {**self.SCENE, "image": {**SMALL, "background": "#3fc780"}, "channels": [{"visible": False}] * 2}
        picture = call(server, "POST", "/api/v1/render", scene, accept="image/png")[2]
        self.assertEqual(png_colors(picture), {(0x3F, 0xC7, 0x80)})

    def test_of_a_bad_scene_leads_to_the_bad_field(self):
        for scene, pointer in (({"channels": [{}, {"gamma": -1}]}, "/channels/1/gamma"),
                               ({"camera": {"fov": 3}}, "/camera/fov"),
                               ({"channels": [{}] * 3}, "/channels/2"),
                               ({"image": {"width": 16384, "height": 16384}}, None)):
            status, headers, body = call(server, "POST", "/api/v1/render", scene)
            problem = json.loads(body)
            self.assertEqual((status, headers["Content-Type"]), (422, "application/problem+json"), scene)
            self.assertEqual(problem["status"], 422)
            if pointer:
                self.assertEqual(problem["pointer"], pointer)
                self.assertTrue(problem["detail"].startswith(pointer + ": "), problem)
        for body, headers, expected in ((b"{", {}, 400), (b"[" * 99, {}, 400), (b'{"dataset": "\xff"}', {}, 400),
                                        (b"{}", {"content_type": "text/plain"}, 415),
                                        (b"{}", {"content_encoding": "gzip"}, 415)):
            status, _, answer = call(server, "POST", "/api/v1/render", body, **headers)
            self.assertEqual((status, json.loads(answer)["status"]), (expected, expected), body)
        self.assertEqual(call(server, "GET", "/api/v1/render")[0], 405)
        self.assertEqual(call(server, "GET", "/api/v1/nothing")[0], 404)


class Sessions(unittest.TestCase):
    def test_keep_a_scene_that_is_read_edited_and_replaced(self):
        session = begin(self, {"image": SMALL, "stop": {"samples": 1}})
        scene = path_of(session, "/scene")
        self.assertEqual((session["revision"], session["stream"]), (1, path_of(session, "/stream")[1:]))
        status, headers, body = call(server, "GET", scene)
        self.assertEqual((status, headers["ETag"], json.loads(body)), (200, '"1"', {"revision": 1,
                                                                                   "scene": session["scene"]}))
        status, told = call_json(server, "PATCH", scene, {"channels": {"1": {"gamma": 2}}}, if_match='"1"',
                                 content_type="application/merge-patch+json")
        self.assertEqual((status, told["revision"]), (200, 2))
        self.assertEqual([channel["gamma"] for channel in told["scene"]["channels"]], [1, 2])
        self.assertEqual(call(server, "PATCH", scene, {"camera": {"fovY": 40}}, if_match='"1"')[0], 409)
        status, problem = call_json(server, "PATCH", scene, {"channels": {"2": {}}})
        self.assertEqual((status, problem["pointer"]), (422, "/channels/2"))
        self.assertEqual(call_json(server, "GET", scene)[1]["revision"], 2)
        status, told = call_json(server, "PUT", scene, {"image": SMALL, "stop": {"samples": 1}})
        self.assertEqual((status, told), (200, {"revision": 3, "scene": session["scene"]}))

    def test_are_as_many_as_capabilities_say(self):
        for _ in range(4):
            begin(self, {"image": SMALL, "stop": {"samples": 1}})
        status, headers, _ = call(server, "POST", "/api/v1/sessions")
        self.assertEqual(status, 503)
        self.assertGreaterEqual(int(headers["Retry-After"]), 0)

    def test_give_their_picture_to_one_who_waits_for_it(self):
        session = begin(self, {"image": {**SMALL, "background": "#102030"}, "stop": {"samples": 6},
                               "channels": [{"visible": False}, {"visible": False}]})
        wait = path_of(session, "/frame")
        status, headers, picture = call(server, "GET", wait + "?minSamples=6&format=png&timeout=25")
        self.assertEqual((status, headers["Scolopax-Samples"], headers["Scolopax-Revision"]), (200, "6", "1"))
        self.assertEqual(png_colors(picture), {(0x10, 0x20, 0x30)})
        number = int(headers["Scolopax-Frame"])
        self.assertEqual(call(server, "GET", f"{wait}?after={number}&timeout=0.1")[::2], (204, b""))
        edit = {"image": {"background": "#ff8000"}}
        self.assertEqual(call(server, "PATCH", path_of(session, "/scene"), edit)[0], 200)
        status, headers, picture = call(server, "GET", f"{wait}?after={number}&format=png")
        self.assertEqual((status, headers["Scolopax-Revision"], png_colors(picture)), (200, "2", {(0xFF, 0x80, 0)}))
        self.assertGreater(int(headers["Scolopax-Frame"]), number)
        for kind, magic in PICTURES.items():
            status, headers, picture = call(server, "GET", f"{wait}?format={kind.replace('x-', '').split('/')[1]}")
            self.assertEqual((status, headers["Content-Type"], picture[:len(magic)]), (200, kind, magic))
        status, headers, _ = call(server, "GET", f"{wait}?minSamples=1000")  # the final picture is enough
        self.assertEqual((status, headers["Scolopax-Samples"]), (200, "6"))
        told = call_json(server, "GET", path_of(session))[1]
        self.assertEqual((told["id"], told["revision"], told["viewers"]), (session["id"], 2, 0))
        self.assertEqual({name: told["frame"][name] for name in ("revision", "samples", "final")},
                         {"revision": 2, "samples": 6, "final": True})

    def test_tell_what_else_is_known_of_the_pixels(self):
        session = begin(self, {"image": SMALL, "stop": {"samples": 4}, "channels": [{}, {"visible": False}]})
        wait = path_of(session, "/frame")
        status, headers, _ = call(server, "GET", f"{wait}?minSamples=4")
        self.assertEqual((status, headers["Scolopax-Final"]), (200, "1"))
        color = session["scene"]["channels"][0]["color"]
        first = tuple(int(color[i:i + 2], 16) for i in (1, 3, 5))
        # The picture is final but was made without AOVs: it restarts, as a new revision.
        status, headers, picture = call(server, "GET", f"{wait}?aov=channel&format=png&minSamples=4")
        self.assertEqual((status, headers["Scolopax-Samples"], headers["Scolopax-Revision"]), (200, "4", "2"))
        self.assertEqual(png_colors(picture), {first, (0, 0, 0)})
        for name in ("depth", "transmittance", "cost"):
            status, _, picture = call(server, "GET", f"{wait}?aov={name}&format=png")
            self.assertEqual((status, png_size(picture)), (200, (SMALL["width"], SMALL["height"])))
            self.assertGreater(len(png_colors(picture)), 2, name)
        status, headers, picture = call(server, "GET", f"{wait}?aov=depth&format=exr")
        self.assertEqual((status, headers["Content-Type"], picture[:4]), (200, "image/x-exr", PICTURES["image/x-exr"]))
        edit = {"channels": {"0": {"visible": False}}}
        self.assertEqual(call(server, "PATCH", path_of(session, "/scene"), edit)[0], 200)
        status, headers, picture = call(server, "GET", f"{wait}?aov=transmittance&format=png")
        self.assertEqual((status, headers["Scolopax-Revision"], png_colors(picture)), (200, "3", {(255, 255, 255)}))
        status, _, problem = call(server, "GET", f"{wait}?aov=normal")
        self.assertEqual(status, 422)
        self.assertIn("depth, transmittance, channel, cost", json.loads(problem)["detail"])
        told = call_json(server, "GET", "/api/v1/capabilities")[1]["aovs"]
        self.assertEqual([one["name"] for one in told], ["depth", "transmittance", "channel", "cost"])

    def test_that_are_deleted_are_not_found(self):
        session = begin(self, {"image": SMALL})
        self.assertEqual(call(server, "DELETE", path_of(session))[::2], (204, b""))
        for method, rest in (("GET", ""), ("GET", "/scene"), ("PATCH", "/scene"), ("GET", "/frame"),
                             ("GET", "/pick?x=1&y=1"), ("DELETE", "")):
            body = {} if method == "PATCH" else None
            self.assertEqual(call(server, method, path_of(session, rest), body)[0], 404, method + rest)


class Stream(unittest.IsolatedAsyncioTestCase):
    SCENE = {"image": SMALL, "stop": ENDLESS}

    async def edit(self, viewer, count):
        """Makes edits, each only when the previous one has appeared in a frame."""
        for _ in range(count):
            number = await viewer.patch({"camera": {"fovY": 30 + len(viewer.frames) % 30}})
            await viewer.frame(lambda frame: frame.patch == number)
        await viewer.frame()  # so that the earlier frames have been offered to the other viewers

    async def closed(self, viewer):
        with self.assertRaises(websockets.ConnectionClosed) as caught:
            await viewer.until(lambda message: False, ack=False)
        return caught.exception.rcvd.code

    async def refused(self, stream, **options):
        with self.assertRaises(websockets.InvalidStatusCode) as caught:
            async with connect(server, stream, **options):
                pass
        return caught.exception.status_code

    async def test_is_refused_without_token_session_or_own_origin(self):
        session = begin(self, self.SCENE)
        stream = session["stream"]
        self.assertEqual(await self.refused(stream, extra_headers={}), 401)
        self.assertEqual(await self.refused(stream, extra_headers={}, query="?token=" + session["token"]), 401)
        for origin in ("http://example.org", "http://127.0.0.1:1", "null"):
            self.assertEqual(await self.refused(stream, origin=origin), 403)
        self.assertEqual(await self.refused("api/v1/sessions/none/stream"), 404)
        own = f"http://127.0.0.1:{server.port}"
        async with connect(server, stream, extra_headers={}, query="?token=" + server.token, origin=own) as socket:
            self.assertEqual(json.loads(await socket.recv())["type"], "hello")
            self.assertEqual(socket.extensions, [])

    async def test_begins_with_hello_and_brings_better_and_better_frames(self):
        session = begin(self, {"image": {**SMALL, "width": 62}, "stop": {"samples": 32}})
        async with Viewer(server, session) as viewer:
            hello = viewer.hello
            self.assertEqual({name: hello[name] for name in ("type", "version", "session", "token")}, {
                "type": "hello", "version": 1, "session": session["id"], "token": session["token"]})
            self.assertEqual(hello["capabilities"], call_json(server, "GET", "/api/v1/capabilities")[1])
            final = await viewer.frame(lambda frame: frame.flags & FINAL)
            self.assertEqual((final.samples, final.revision, final.patch), (32, 1, 0))
            self.assertEqual((final.width, final.height), (62, 48))
            self.assertEqual(await viewer.sent_before_pong(), [])

    async def test_answers_what_it_does_not_take_and_stays_open(self):
        async with Viewer(server, begin(self, self.SCENE)) as viewer:
            for message, status, pointer, number in (
                    ({"type": "patch", "id": 1, "patch": {"camera": {"fovY": 200}}}, 422, "/camera/fovY", 1),
                    ({"type": "patch", "id": 2, "patch": {"channels": {"7": {}}}}, 422, "/channels/7", 2),
                    ({"type": "patch", "id": 3, "patch": {"nonsense": None}}, 422, "/nonsense", 3),
                    ({"type": "sing"}, 422, "/type", None), ({"type": "ack"}, 422, "/frame", None),
                    ({"type": "ping", "song": 1}, 422, "/song", None), ([], 422, None, None),
                    ({"type": "resume", "token": "nonsense"}, 404, "/token", None)):
                await viewer.socket.send(json.dumps(message))
                error = await viewer.text("error")
                self.assertEqual((error["problem"]["status"], error["problem"].get("pointer"), error.get("id")),
                                 (status, pointer, number), message)
            await viewer.socket.send("{")
            self.assertEqual((await viewer.text("error"))["problem"]["status"], 400)
            await viewer.send("ping")
            self.assertEqual((await viewer.text("pong"))["id"], 0)
            await viewer.send("patch", id=4, patch={"camera": {"fovY": 20}})
            self.assertEqual((await viewer.frame(lambda frame: frame.patch == 4)).revision, 2)

    async def test_closes_when_a_message_is_too_large_and_when_the_session_ends(self):
        session = begin(self, self.SCENE)
        async with Viewer(server, session) as large, Viewer(server, session) as other:
            await large.socket.send(json.dumps({"type": "ping"}).ljust(65537))
            self.assertEqual(await self.closed(large), 1009)
            await asyncio.to_thread(call, server, "DELETE", path_of(session))
            self.assertEqual(await self.closed(other), 1001)
        self.assertEqual(await self.refused(session["stream"]), 404)

    async def test_shows_each_edit_in_frames_of_one_revision_alone(self):
        # Only the background, in one of two colours: so there are only two different pictures of a size.
        hidden = {"image": {**SMALL, "background": "#c04010"}, "stop": ENDLESS, "channels": [{"visible": False}] * 2}
        session = begin(self, hidden)
        async with Viewer(server, session) as viewer:
            for number in range(1, 61):
                await viewer.patch({"image": {"background": ("#c04010", "#2080f0")[number % 2]}})
                if number % 3 == 0:
                    await viewer.frame()
            last = await viewer.frame(lambda frame: frame.patch == 60)
            self.assertEqual(last.revision, 61)
            pictures = {}
            for frame in viewer.frames:
                self.assertEqual(frame.revision, 1 + frame.patch)
                pictures.setdefault((frame.width, frame.height, frame.flags & 1), ({}, {}))[frame.patch % 2][
                    frame.image] = frame.patch
            for colors in pictures.values():
                self.assertLessEqual(max(map(len, colors)), 1)
                self.assertFalse(set(colors[0]) & set(colors[1]))
            self.assertGreaterEqual(len({frame.revision for frame in viewer.frames}), 15)

    async def test_tells_a_second_viewer_of_edits_but_not_the_editor(self):
        session = begin(self, self.SCENE)
        async with Viewer(server, session) as editor, Viewer(server, session) as other:
            scene, revision = session["scene"], 1
            for patch in ({"channels": {"1": {"color": "#ff0000", "range": [0, 50]}}}, {"camera": {"orthoHeight": 20}},
                          {"channels": {"1": {"colormap": "fire"}, "0": {"opacity": [[0, 0], [1, 1]]}}},
                          {"channels": {"0": {"opacity": {"1": [0.5, 0.25]}}}},
                          {"channels": {"1": {"gradientOpacity": {"points": [[0, 1], [1, 0]]}}}},
                          {"channels": {"1": {"gradientOpacity": {"range": [1, 2]}}}},
                          {"channels": {"1": {"gradientOpacity": None}}},
                          {"camera": {"fovY": 50, "eye": [1, 2, 30]}}, {"channels": {"1": None}},
                          {"channels": [{"visible": False}]}, {"camera": None, "channels": None}):
                await editor.patch(patch)
                told = await other.text("scene")
                self.assertEqual(told["revision"], revision + 1)
                revision, scene = told["revision"], apply_patch(scene, told["patch"])
                read = await asyncio.to_thread(call_json, server, "GET", path_of(session, "/scene"))
                self.assertEqual(read, (200, {"revision": revision, "scene": scene}), patch)
            self.assertEqual(scene, session["scene"])
            frame = await other.frame(lambda frame: frame.revision == revision)
            self.assertEqual(frame.patch, 0)  # it contains no patch of this viewer
            await editor.frame(lambda frame: frame.revision == revision)
            await asyncio.to_thread(call, server, "PATCH", path_of(session, "/scene"), {"camera": {"fovY": 12}})
            for viewer in (editor, other):  # for the editor this is the first `scene` message
                self.assertEqual((await viewer.text("scene"))["revision"], revision + 1)

    async def test_sends_two_frames_without_ack_and_then_the_newest(self):
        session = begin(self, self.SCENE)
        async with Viewer(server, session) as silent, Viewer(server, session) as busy:
            while len(silent.frames) < 2:
                await silent.receive(ack=False)
            await self.edit(busy, 5)
            await silent.send("ack", frame=999999)  # never sent
            await self.edit(busy, 5)
            self.assertFalse([m for m in await silent.sent_before_pong() if isinstance(m, Frame)])

            await silent.send("ack", frame=silent.frames[1].frame)  # acknowledges both
            for _ in range(2):
                frames = [m for m in await silent.until(lambda m: isinstance(m, Frame), ack=False)]
                self.assertEqual(frames[-1].revision, 11)
            self.assertGreater(silent.frames[2].frame, silent.frames[1].frame + 1)  # frames in between were replaced
            await self.edit(busy, 5)
            self.assertFalse([m for m in await silent.sent_before_pong() if isinstance(m, Frame)])

    async def test_sends_nothing_to_one_who_shows_nothing(self):
        session = begin(self, self.SCENE)
        async with Viewer(server, session) as hidden, Viewer(server, session) as busy:
            await hidden.frame()
            await hidden.send("view", visible=False)
            for _ in range(2):  # frames that were being made then may still arrive
                await hidden.sent_before_pong(ack=True)
                await self.edit(busy, 1)
            await hidden.sent_before_pong(ack=True)
            await self.edit(busy, 6)
            self.assertFalse([m for m in await hidden.sent_before_pong(ack=True) if isinstance(m, Frame)])
            await hidden.send("view", maxFps=60)
            self.assertEqual((await hidden.frame()).revision, 9)

    async def test_continues_with_its_samples_after_the_line_was_cut(self):
        session = begin(self, self.SCENE)
        async with Viewer(server, session) as viewer:
            before = await viewer.frame(lambda frame: frame.samples >= 16)
            viewer.socket.transport.abort()
        async with Viewer(server, session) as viewer:
            frame = await viewer.frame()
            self.assertEqual(frame.revision, before.revision)
            self.assertGreaterEqual(frame.samples, before.samples)

    async def test_continues_another_session_of_which_it_has_the_token(self):
        first, second = begin(self, self.SCENE), begin(self, self.SCENE)
        async with Viewer(server, first) as viewer:
            before = await viewer.frame(lambda frame: frame.samples >= 16)
        async with Viewer(server, second) as viewer:
            await viewer.send("resume", token=second["token"])  # the viewer's current session
            self.assertFalse([m for m in await viewer.sent_before_pong(ack=True) if not isinstance(m, Frame)])
            await viewer.send("resume", token=first["token"])
            hello = await viewer.text("hello")
            self.assertEqual((hello["session"], hello["token"]), (first["id"], first["token"]))
            seen = viewer.frames[-1].frame if viewer.frames else 0
            viewer.frames.clear()  # frames of another scene
            frame = await viewer.frame()
            self.assertGreater(frame.frame, seen)
            self.assertGreaterEqual(frame.samples, before.samples)
            told = await asyncio.to_thread(call_json, server, "GET", path_of(first))
            self.assertEqual(told[1]["viewers"], 1)


class SlowLine(unittest.IsolatedAsyncioTestCase):
    """Viewers over a slow connection. Frames are some tens of kB of noise."""
    SCENE = {"image": {"width": 320, "height": 240}, "stop": ENDLESS}
    TEXT = 4096  # upper bound of the bytes of all other messages

    async def test_of_200_kB_a_second_shows_the_last_edit_within_few_frames(self):
        session = begin(self, self.SCENE)
        async with Proxy(server.port, rate=200_000, deep=True) as proxy:
            async with Viewer(server, session, proxy.port) as viewer:
                await viewer.frame()
                proxy.most_held = proxy.held
                reading = asyncio.create_task(viewer.frame(lambda frame: frame.patch >= 80))
                for _ in range(80):
                    await viewer.patch({"camera": {"fovY": 20 + viewer.patches % 40}})
                    await asyncio.sleep(0.02)
                before = len(viewer.frames)
                await asyncio.wait_for(reading, PATIENCE)
                # Two frames on their way, and at most two that were made before the server read the last edit.
                self.assertLessEqual(len(viewer.frames) - before, 5)
                self.assertEqual(viewer.frames[-1].revision, 81)
                self.assertLessEqual(proxy.most_held, 2 * max(frame.bytes for frame in viewer.frames) + self.TEXT)

    async def test_an_eighth_as_wide_as_needed_skips_frames_and_shows_the_newest(self):
        session = begin(self, self.SCENE)
        async with Proxy(server.port, deep=True) as proxy, Viewer(server, session) as direct:
            await proxy.allow(1 << 20)
            async with Viewer(server, session, proxy.port) as slow:
                await slow.frame()
                proxy.budget, proxy.most_held = 0, proxy.held
                last = asyncio.get_running_loop().create_future()
                reading = asyncio.create_task(slow.frame(lambda frame: last.done() and frame.revision >= last.result()))
                for number in range(1, 65):
                    await direct.patch({"camera": {"fovY": 20 + number % 40}})
                    frame = await direct.frame(lambda frame: frame.patch == number)
                    await proxy.allow(frame.bytes // 8)
                received = len(slow.frames)
                await direct.frame()
                last.set_result(direct.frames[-1].revision)
                await proxy.allow(1 << 30)
                await asyncio.wait_for(reading, PATIENCE)
                # At least 64 pictures were made; the connection passed the bytes of 8 and the rest of the first one.
                self.assertLessEqual(received, 16)
                self.assertLessEqual(len(slow.frames) - received, 3)  # two on their way and the newest
                self.assertEqual(slow.frames[-1].revision, 65)
                self.assertGreater(slow.frames[-1].frame, len(slow.frames) + 16)  # numbers were skipped
                biggest = max(frame.bytes for frame in slow.frames)
                self.assertLessEqual(proxy.most_held, 2 * biggest + self.TEXT)

    async def test_that_stands_still_keeps_nobody_else_from_frames(self):
        session = begin(self, self.SCENE)
        async with Proxy(server.port) as proxy, Viewer(server, session) as direct:
            await proxy.allow(1 << 20)
            async with Viewer(server, session, proxy.port) as stalled:
                await stalled.frame()
                proxy.budget = 0
                for number in range(1, 31):
                    await direct.patch({"camera": {"fovY": 20 + number}})
                    await direct.frame(lambda frame: frame.patch == number)
                await direct.frame()
                self.assertEqual(direct.frames[-1].revision, 31)
                seen = len(stalled.frames)
                await proxy.allow(1 << 30)
                await stalled.frame(lambda frame: frame.revision == 31)
                self.assertLessEqual(len(stalled.frames) - seen, 3)
                self.assertGreater(stalled.frames[-1].frame, len(stalled.frames) + 16)


if __name__ == "__main__":
    unittest.main()
