#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Data sets are loaded when they are first shown, within --memory; time series; folders."""
import os
import sys
import tempfile
import threading
import time
import unittest

sys.path.insert(0, os.path.dirname(__file__))
from serving import Server, write_volume  # noqa: E402

SCENE = {"image": {"width": 48, "height": 48}, "stop": {"samples": 4}}
PNG = {"Accept": "image/png"}


def nrrd(path, size, steps):
    """Writes an NRRD file of size^3 voxels, with a cube that moves along x with each step."""
    head = "NRRD0004\ntype: uint8\ndimension: {}\nsizes: {}{}\n{}encoding: raw\n\n"
    with open(path, "wb") as file:
        several = len(steps) > 1
        file.write(head.format(4 if several else 3, f"{size} {size} {size}", f" {len(steps)}" if several else "",
                               "kinds: domain domain domain time\n" if several else "").encode())
        for step in steps:
            rows = [bytes(200 if abs(x - 3 - step) < 2 and abs(y - size // 2) < 3 else 0 for x in range(size))
                    for y in range(size)]
            file.write(b"".join(rows) * size)
    return path


class Data(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = folder.name

    def path(self, name):
        return os.path.join(self.folder, name)

    def serve(self, *options, paths):
        server = Server(*options, paths=paths)
        self.addCleanup(server.stop)
        return server

    def states(self, server):
        return {one["id"]: one["state"] for one in server.json("GET", "/api/v1/datasets")[1]["datasets"]}

    def render(self, server, **scene):
        status, _, picture = server.call("POST", "/api/v1/render", {**SCENE, **scene}, PNG)
        self.assertEqual(status, 200, picture)
        return picture

    def test_only_what_is_shown_is_loaded(self):
        server = self.serve(paths=[nrrd(self.path("a.nrrd"), 16, [0]), nrrd(self.path("b.nrrd"), 20, [0])])
        self.assertEqual(self.states(server), {"a": "stored", "b": "stored"})
        told = server.json("GET", "/api/v1/datasets/b")[1]
        self.assertNotIn("maximum", told["channels"][0])
        self.assertEqual((told["dims"], told["memoryBytes"]), ([20, 20, 20], 8000))
        self.render(server, dataset="b")
        self.assertEqual(self.states(server), {"a": "stored", "b": "loaded"})
        self.assertEqual(server.json("GET", "/api/v1/datasets/b")[1]["channels"][0]["maximum"], 200)
        server.json("GET", "/api/v1/datasets/a/histogram")
        self.assertEqual(self.states(server), {"a": "loaded", "b": "loaded"})

    def test_each_step_has_the_picture_of_its_own_file(self):
        steps = [0, 3, 6, 9]
        series = self.serve(paths=[nrrd(self.path("series.nrrd"), 16, steps)])
        scene = {"channels": [{"range": [0, 200], "density": 0.3}],
                 "camera": {"eye": [8, 8, 60], "target": [8, 8, 8], "up": [0, 1, 0], "orthoHeight": 20}}
        self.assertEqual(series.json("GET", "/api/v1/datasets/series")[1]["times"]["count"], 4)
        pictures = set()
        for time_, step in enumerate(steps):
            alone = self.serve(paths=[nrrd(self.path(f"alone{step}.nrrd"), 16, [step])])
            picture = self.render(series, time=time_, **scene)
            self.assertEqual(picture, self.render(alone, **scene), f"step {time_}")
            pictures.add(picture)
        self.assertEqual(len(pictures), 4)

    def test_a_step_that_is_not_there_is_refused(self):
        server = self.serve(paths=[nrrd(self.path("series.nrrd"), 8, [0, 1, 2]), nrrd(self.path("one.nrrd"), 8, [0])])
        status, problem = server.json("POST", "/api/v1/render", {**SCENE, "time": 3})
        self.assertEqual((status, problem["pointer"], problem["detail"]),
                         (422, "/time", "time: expected 0 to 2, found 3"))
        for value in (-1, 0.5, "1", 1 << 40):
            status, problem = server.json("POST", "/api/v1/render", {**SCENE, "time": value})
            self.assertEqual((status, problem["pointer"]), (422, "/time"), value)
        self.assertEqual(server.json("GET", "/api/v1/datasets/series/probe?x=0&y=0&z=0&time=3")[0], 422)

    def test_a_data_set_of_one_step_is_the_same_at_all_times(self):
        server = self.serve(paths=[nrrd(self.path("one.nrrd"), 8, [0])])
        self.assertEqual(self.render(server), self.render(server, time=1000))

    def test_values_are_those_of_the_step(self):
        server = self.serve(paths=[nrrd(self.path("series.nrrd"), 16, [0, 8])])
        probe = "/api/v1/datasets/series/probe?x=3&y=8&z=8&time={}"
        self.assertEqual([server.json("GET", probe.format(t))[1]["values"][0] for t in (0, 1)], [200, 0])

    def test_memory_is_shared_in_turns(self):
        # Each needs 0.94 MiB of the one MiB.
        paths = [nrrd(self.path(name), size, [0]) for name, size in (("a.nrrd", 99), ("b.nrrd", 98))]
        server = self.serve("--memory", "1", paths=paths)
        first = {name: self.render(server, dataset=name) for name in "ab"}
        self.assertEqual(self.states(server), {"a": "stored", "b": "loaded"})
        for name in "ababab":
            self.assertEqual(self.render(server, dataset=name), first[name])
        self.assertEqual(sorted(self.states(server).values()), ["loaded", "stored"])

    def test_what_can_never_fit_is_refused_with_the_numbers_before_it_is_read(self):
        server = self.serve("--memory", "1", paths=[nrrd(self.path("big.nrrd"), 102, [0])])
        status, problem = server.json("POST", "/api/v1/render", SCENE)
        self.assertEqual(status, 422)
        self.assertIn("big.nrrd: needs 1061208 bytes of memory, expected at most 1048576 bytes (--memory)",
                      problem["detail"])

    def test_a_session_whose_data_has_gone_loads_it_again(self):
        paths = [nrrd(self.path(name), size, [0]) for name, size in (("a.nrrd", 99), ("b.nrrd", 98))]
        server = self.serve("--memory", "1", paths=paths)
        status, session = server.json("POST", "/api/v1/sessions", {"scene": {**SCENE, "dataset": "a"}})
        self.assertEqual(status, 201, session)
        frame = f"/api/v1/sessions/{session['id']}/frame?minSamples=4&after={{}}"
        status, headers, _ = server.call("GET", frame.format(0), headers=PNG)
        self.assertEqual(status, 200)
        # The session rests, so its renderer gives way.
        self.render(server, dataset="b")
        self.assertEqual(self.states(server), {"a": "stored", "b": "loaded"})
        status, _ = server.json("PATCH", f"/api/v1/sessions/{session['id']}/scene", {"channels": {"0": {"density": 0.5}}})
        self.assertEqual(status, 200)
        status, _, picture = server.call("GET", frame.format(headers["Scolopax-Frame"]), headers=PNG)
        self.assertEqual(status, 200)
        self.assertEqual(self.states(server)["a"], "loaded")

    def test_folders_offer_what_is_in_them(self):
        os.mkdir(self.path("run"))
        for step in (9, 10, 11):
            nrrd(self.path(f"run/out_{step:03}.nrrd"), 8, [step - 8])
        write_volume(self.folder)
        with open(self.path("readme.txt"), "w", encoding="utf-8") as file:
            file.write("not a volume")
        server = self.serve(paths=[self.folder])
        told = server.json("GET", "/api/v1/datasets")[1]["datasets"]
        self.assertEqual([(one["dims"], len(one["channels"]), one["times"]["count"]) for one in told],
                         [([16, 16, 16], 2, 1), ([8, 8, 8], 1, 3)])
        self.assertEqual(told[1]["times"]["values"], [9, 10, 11])
        self.assertEqual({one["state"] for one in told}, {"stored"})

    def test_a_file_that_vanishes_is_an_error_of_those_who_ask_for_it(self):
        paths = [nrrd(self.path("a.nrrd"), 8, [0]), nrrd(self.path("b.nrrd"), 9, [0])]
        server = self.serve(paths=paths)
        os.remove(paths[0])
        status, problem = server.json("POST", "/api/v1/render", {**SCENE, "dataset": "a"})
        self.assertGreaterEqual(status, 400)
        self.assertIn("a.nrrd", problem["detail"])
        self.render(server, dataset="b")

    def test_many_who_ask_at_once_share_one_load(self):
        server = self.serve(paths=[nrrd(self.path("a.nrrd"), 64, [0])])
        answers = []
        threads = [threading.Thread(target=lambda: answers.append(server.call("GET", "/api/v1/datasets/a/histogram")[0]))
                   for _ in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        self.assertEqual(answers, [200] * 4)

    def test_playing_shows_every_step_that_is_asked_for(self):
        server = self.serve(paths=[nrrd(self.path("series.nrrd"), 16, list(range(10)))])
        status, session = server.json("POST", "/api/v1/sessions", {"scene": SCENE})
        self.assertEqual(status, 201, session)
        revision, frame = 1, 0
        for time_ in list(range(10)) * 2:
            status, told = server.json("PATCH", f"/api/v1/sessions/{session['id']}/scene", {"time": time_})
            self.assertEqual(status, 200, told)
            status, headers, _ = server.call("GET", f"/api/v1/sessions/{session['id']}/frame?minSamples=1&after={frame}")
            self.assertEqual(status, 200)
            self.assertGreater(int(headers["Scolopax-Frame"]), frame)
            self.assertGreaterEqual(int(headers["Scolopax-Revision"]), revision)
            revision, frame = int(headers["Scolopax-Revision"]), int(headers["Scolopax-Frame"])
        deadline = time.monotonic() + 30
        while time.monotonic() < deadline and self.states(server)["series"] != "loaded":
            time.sleep(0.1)
        self.assertEqual(self.states(server)["series"], "loaded")


if __name__ == "__main__":
    unittest.main()
