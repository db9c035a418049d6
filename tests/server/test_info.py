#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""scolopax info, and how the command line names what is in a file."""
import functools
import http.server
import json
import os
import sys
import threading
import unittest

sys.path.insert(0, os.path.dirname(__file__))
from serving import CommandTest  # noqa: E402

HEADER = b"NRRD0005\ntype: uint8\ndimension: 4\nencoding: raw\nspace units: \"um\" \"um\" \"um\"\n"


class Series(CommandTest):
    def write(self, name, data):
        with open(self.path(name), "wb") as file:
            file.write(data)
        return self.path(name)

    def series(self):
        """Two times of 2x1x1 voxels: 1, 2 and 3, 9."""
        return self.write("run_s.nrrd", HEADER + b"sizes: 2 1 1 2\nkinds: domain domain domain time\n"
                          b"spacings: 2 1 1 5\nunits: \"\" \"\" \"\" \"ms\"\n\n\x01\x02\x03\x09")


class Info(Series):
    def info(self, *arguments):
        result = self.run_command("info", *arguments)
        self.assertEqual(result.returncode, 0, result.stderr)
        return result.stdout

    def test_tells_grid_times_and_ranges(self):
        lines = self.info(self.series()).splitlines()
        self.assertRegex(lines[0], r"^run-s: 2 x 1 x 1 voxels, spacing 2 x 1 x 1 um, diagonal [\d.]+ um$")
        self.assertEqual(lines[1], "  2 times: 0 .. 5 ms")
        self.assertRegex(lines[2], r"^   0 run_s +u8 +1 \.\. 2$")

    def test_of_headers_reads_no_voxels(self):
        path = self.path("large_4096x4096x4096_float64.raw")
        with open(path, "wb") as file:
            file.truncate(1 << 39)
        lines = self.info("--headers", path).splitlines()
        self.assertRegex(lines[0], r"^large-.*: 4096 x 4096 x 4096 voxels, spacing 1 x 1 x 1, diagonal")
        self.assertRegex(lines[1], r"^   0 \S+ +float64 *$")
        self.assertEqual(lines[2], f"  needs at most {1 << 38} bytes of memory")
        told = json.loads(self.info("--headers", "--json", path))[0]
        self.assertEqual((told["dims"], told["memoryBytes"]), ([4096] * 3, 1 << 38))
        self.assertNotIn("minimum", told["channels"][0])

    def test_as_json_is_what_the_server_tells(self):
        told = json.loads(self.info("--json", self.series()))[0]
        self.assertEqual(told["worldUnit"], "um")
        self.assertEqual(told["times"], {"count": 2, "values": [0, 5], "unit": "ms"})
        self.assertEqual(told["channels"], [{"name": "run_s", "unit": "", "type": "u8", "minimum": 1, "maximum": 2}])

    def test_a_fourth_axis_can_be_seen_as_channels(self):
        told = json.loads(self.info("--json", "--fourth-axis", "channel", self.series()))[0]
        self.assertEqual([(c["minimum"], c["maximum"]) for c in told["channels"]], [(1, 2), (3, 9)])
        self.assertEqual(told["times"]["count"], 1)
        result = self.run_command("info", "--fourth-axis", "what", self.series())
        self.assertEqual(result.returncode, 2)
        self.assertIn("--fourth-axis", result.stderr)

    def test_a_channel_is_chosen_after_a_colon(self):
        path = self.series()
        told = json.loads(self.info("--json", "--fourth-axis", "channel", path + ":run_s 1"))[0]
        self.assertEqual([c["minimum"] for c in told["channels"]], [3])
        result = self.run_command("info", path + ":what")
        self.assertEqual(result.returncode, 1)
        self.assertIn('run_s.nrrd: expected one of run_s after the colon, found "what"', result.stderr)

    def test_a_url_is_read_from_an_allowed_host_only(self):
        folder = self.path("a.zarr")
        os.mkdir(folder)
        array = {"zarr_format": 2, "shape": [1, 1, 2], "chunks": [1, 1, 2], "dtype": "|u1", "fill_value": 0,
                 "compressor": None, "filters": None, "order": "C"}
        self.write("a.zarr/.zarray", json.dumps(array).encode())
        self.write("a.zarr/0.0.0", b"\x03\x07")
        handler = functools.partial(http.server.SimpleHTTPRequestHandler, directory=os.path.dirname(folder))
        with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
            threading.Thread(target=server.serve_forever, daemon=True).start()
            host = f"127.0.0.1:{server.server_port}"
            result = self.run_command("info", f"http://{host}/a.zarr")
            self.assertEqual(result.returncode, 1)
            self.assertIn("--allow-host", result.stderr)
            told = json.loads(self.info("--json", "--allow-host", host, f"http://{host}/a.zarr"))[0]
            server.shutdown()
        self.assertEqual([(c["minimum"], c["maximum"]) for c in told["channels"]], [(3, 7)])

    def test_an_unknown_file_is_refused_with_the_known_formats(self):
        result = self.run_command("info", self.write("a.what", b"x"))
        self.assertEqual(result.returncode, 1)
        self.assertRegex(result.stderr, r"a\.what: expected one of .*NIfTI \(\.nii, .*NRRD")
        self.assertEqual(len(result.stderr.splitlines()), 1)


class Times(Series):
    def test_are_rendered_by_their_index(self):
        scene = ["--set", "channels.0.range=[0,9]", "--set", "channels.0.color=#ffffff", "--set", "image.width=8",
                 "--set", "image.height=8", "--samples", "1", "--stats", self.path("s.json")]
        pictures = []
        for time in ("0", "1"):
            out = self.path(time + ".exr")
            result = self.run_command("render", "--data", self.series(), "--time", time, "-o", out, *scene)
            self.assertEqual(result.returncode, 0, result.stderr)
            with open(out, "rb") as file:
                pictures.append(file.read())
        self.assertNotEqual(*pictures)
        result = self.run_command("render", "--data", self.series(), "--time", "2", "-o", self.path("x.exr"))
        self.assertEqual(result.returncode, 1)
        self.assertIn("time: expected 0 to 1, found 2", result.stderr)


if __name__ == "__main__":
    unittest.main()
