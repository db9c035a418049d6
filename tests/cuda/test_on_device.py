# SPDX-License-Identifier: Apache-2.0
"""What can be tested of on_device.sh without a GPU: packing, skipping, the benchmark on the substitute runtime
(DEVICE_BENCH), and how results are read."""
import json
import os
import shutil
import subprocess
import sys
import tempfile
import unittest

from device_results import results

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.append(os.path.join(HERE, "../bench"))
from device_sections import gpu, machine_of  # noqa: E402

BENCH = os.environ.get("DEVICE_BENCH")

# As ncu 2025.3 writes it, with most rows left out.
NCU = '''==PROF== Connected to process 7
"ID","Process ID","Kernel Name","Section Name","Metric Name","Metric Unit","Metric Value","Rule Name"
"0","7","renderPixels","GPU Speed Of Light Throughput","DRAM Throughput","%","12.50",""
"0","7","renderPixels","GPU Speed Of Light Throughput","Duration","us","1,234.50",""
"0","7","renderPixels","GPU Speed Of Light Throughput","Memory Throughput","%","71.00",""
"0","7","renderPixels","GPU Speed Of Light Throughput","Compute (SM) Throughput","%","40.25",""
"0","7","renderPixels","Memory Workload Analysis","Memory Throughput","Gbyte/s","512.30",""
"0","7","renderPixels","Launch Statistics","Registers Per Thread","register/thread","128",""
"0","7","renderPixels","GPU Speed Of Light Throughput","","","","SOLBottleneck"
'''


class Results(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)

    def write(self, **files):
        for name, text in files.items():
            with open(os.path.join(self.folder.name, name.replace("__", ".")), "w", encoding="utf-8") as file:
                file.write(text)

    def steps(self):
        return results(self.folder.name)["steps"]

    def test_tell_how_each_step_ended(self):
        self.write(configure__status="0 3\n", build__status="1 200\n", build__log="x" * 5000 + "the error",
                   parity__status="124 90\n", memcheck__status="absent\n", racecheck__status="no time left\n")
        steps = self.steps()
        self.assertEqual([steps[name]["status"] for name in
                          ("configure", "build", "parity", "bench", "memcheck", "racecheck")],
                         ["ok", "failed", "timed out", "not run", "absent", "no time left"])
        self.assertTrue(steps["build"]["output"].endswith("the error"))
        self.assertLess(len(steps["build"]["output"]), 2000)
        self.assertEqual(steps["build"]["seconds"], 200)

    def test_hold_what_sanitizers_and_tests_have_found(self):
        report = {"tests": 3, "testsuites": [{"name": "Of/Pictures", "testsuite": [
            {"name": "A", "result": "COMPLETED"}, {"name": "B", "result": "COMPLETED", "failures": [{"failure": "no"}]},
            {"name": "C", "result": "SKIPPED"}]}]}
        self.write(parity__status="1 9", parity__json=json.dumps(report), memcheck__status="0 9",
                   memcheck__out="========= ERROR SUMMARY: 0 errors\n", racecheck__status="9 9",
                   racecheck__log="========= RACECHECK SUMMARY: 2 hazards displayed (2 errors, 0 warnings)\n")
        steps = self.steps()
        self.assertEqual((steps["parity"]["tests"], steps["parity"]["skipped"], steps["parity"]["failed"]),
                         (3, 1, ["Of/Pictures.B"]))
        self.assertEqual((steps["memcheck"]["found"], steps["racecheck"]["found"]), (0, 2))

    def test_name_what_limits_a_kernel(self):
        self.write(ncu_auto__status="0 20", ncu_auto__csv=NCU, ncu_auto__out='{"method": "raymarch", "step": 1, "rays": 4}',
                   ncu_superposed__csv=NCU.replace("71.00", "31.00"))
        found = self.steps()["ncu_auto"]
        self.assertEqual((found["bound"], found["memoryPercent"], found["computePercent"]), ("memory", 71, 40.25))
        self.assertEqual(found["levelPercents"], {"DRAM": 12.5, "L2": None, "L1": None})
        self.assertEqual(found["metrics"]["Duration"], {"us": 1234.5})
        self.assertEqual(found["frame"]["method"], "raymarch")
        self.assertEqual(self.steps()["ncu_superposed"]["bound"], "latency")

    def test_of_nothing_and_of_what_was_cut_short_are_results_too(self):
        self.write(bench__out='{"edge": 2', ncu_auto__csv="==ERROR== no permission\n", parity__json="{")
        found = results(self.folder.name)
        self.assertEqual((found["device"], found["bench"]), (None, None))
        self.assertNotIn("bound", found["steps"]["ncu_auto"])
        self.assertNotIn("tests", found["steps"]["parity"])


DEVICE = {"name": "A device", "capability": "9.0", "memoryBytes": 2**37, "driver": 13000, "runtime": 13010}
FRAME = {"channels": 4, "width": 1024, "height": 1024, "macrocell": 4, "kernelMs": 2, "frameMs": 4}


def report_of(found):
    return gpu({"found": found}, None)


class Report(unittest.TestCase):
    def setUp(self):
        with tempfile.TemporaryDirectory() as nothing:
            self.found = {**results(nothing), "device": DEVICE, "processor": "A processor, 2 threads"}

    def test_says_that_no_device_has_been_measured(self):
        text = report_of({"skipped": "no CUDA device"})
        self.assertIn("No device has been measured yet (no CUDA device", text)
        self.assertIn("| 504 | (500) | 286 |", text)
        self.assertEqual(machine_of({"skipped": "no CUDA device"}), "none")

    def test_names_the_machine(self):
        self.assertEqual(machine_of(self.found), "A device, compute capability 9.0, 128 GiB, CUDA 13.1, driver for 13.0; "
                                                 "A processor, 2 threads")

    def test_of_a_run_that_measured_nothing_says_what_failed(self):
        self.found["steps"]["build"] = {"status": "failed", "seconds": 3, "output": "much\nthe reason"}
        text = report_of(self.found)
        self.assertIn("build: the reason", text)
        self.assertIn("not profiled (not run)", text)

    def test_has_frames_a_second(self):
        self.found["bench"] = {"edge": 256, "complete": False, "parity": [{"pixels": 9, "different": 1}], "edits": [],
                               "rebuild": [], "frames": [{**FRAME, "light": "both", "method": "superposed"},
                                          {**FRAME, "light": "both", "method": "superposed", "macrocell": 8, "kernelMs": 5}]}
        text = report_of(self.found)
        self.assertIn("| orbitals (4) | 1024x1024 | superposed | - | - | - | 500 (250) |", text)
        self.assertIn("| 4 | both | superposed | 500 | 200 |", text)
        self.assertIn("1 of 9 pixels differ", text)
        self.assertIn("The time was not enough", text)


# Stand for the tools of a machine with a GPU: shell scripts, by name.
TOOLS = {
    "nvcc": """cp "$(dirname "$0")/probe" "$2" """,
    "probe": """echo '{"name": "A device", "capability": "9.0"}'""",
    "cmake": """case $1 in
-S) echo "$@" > "$4.options"; mkdir -p "$4" ;;
--build) for name in tests_cuda_device device_bench; do cp "$(dirname "$0")/$name" "$2/"; done ;;
esac""",
    "tests_cuda_device": """for word; do case $word in
--gtest_output=json:*) echo '{"tests": 1, "testsuites": []}' > "${word#*json:}" ;;
esac; done""",
    "device_bench": """echo '{"asked": "'"$*"'"}'""",
    "compute-sanitizer": "echo '========= ERROR SUMMARY: 0 errors'",
    "ncu": """while [ "$1" != --log-file ]; do shift; done; cp "$NCU_CSV" "$2" """,
}


class Script(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.folder.cleanup)
        cls.packed, cls.out = os.path.join(cls.folder.name, "device"), os.path.join(cls.folder.name, "out.json")
        subprocess.run([os.path.join(HERE, "on_device.sh"), "pack", cls.packed], check=True, stdout=subprocess.PIPE)

    def run_script(self, **environment):
        """(what it printed, what it wrote)"""
        told = subprocess.run([os.path.join(self.packed, "tests/cuda/on_device.sh"), self.packed, self.out], text=True,
                              capture_output=True, env={**os.environ, **environment})
        self.assertEqual(told.returncode, 0, told.stderr)
        with open(self.out, encoding="utf-8") as file:
            return told.stdout, json.load(file)

    def put_tools(self, *left_out):
        self.bin = tempfile.mkdtemp(dir=self.folder.name)
        for name in TOOLS.keys() - set(left_out):
            with open(os.path.join(self.bin, name), "w", encoding="utf-8") as file:
                file.write("#!/bin/sh\n" + TOOLS[name])
            os.chmod(os.path.join(self.bin, name), 0o755)
        csv = os.path.join(self.bin, "ncu.csv")
        with open(csv, "w", encoding="utf-8") as file:
            file.write(NCU)
        return {"PATH": self.bin + os.pathsep + os.environ["PATH"], "NCU_CSV": csv}

    def test_packs_all_that_it_needs(self):
        self.assertLess(os.path.getsize(self.packed + ".tar.gz"), 64 << 20)
        for needed in ("third_party/include/glm/glm.hpp", "third_party/include/tbb/parallel_for.h",
                       "third_party/lib/libtbb.so.12", "third_party/googletest/src/gtest_main.cc",
                       "tests/support/volumes.h", "tests/cuda/device_bench.cpp", "renderer/engine/engine.cpp"):
            self.assertTrue(os.path.exists(os.path.join(self.packed, needed)), needed)

    def test_skips_visibly_without_a_device(self):
        printed, written = self.run_script(CUDA_VISIBLE_DEVICES="")
        self.assertRegex(printed, r"(?m)^no (CUDA device|nvcc): skipped$")
        self.assertRegex(written["skipped"], "no (CUDA device|nvcc)")

    def test_takes_all_steps_where_there_is_a_device(self):
        _, written = self.run_script(**self.put_tools())
        self.assertEqual({name: step["status"] for name, step in written["steps"].items()},
                         dict.fromkeys(written["steps"], "ok"))
        self.assertEqual(written["device"]["name"], "A device")
        self.assertEqual(written["steps"]["ncu_auto"]["bound"], "memory")
        self.assertEqual(written["steps"]["ncu_auto"]["levelPercents"]["DRAM"], 12.5)
        self.assertEqual(written["bench"]["asked"], "--seconds 60")
        with open(os.path.join(self.packed, "build.options"), encoding="utf-8") as file:
            self.assertIn("-DSCOLOPAX_CUDA_DEVICES=sm_90", file.read())

    @unittest.skipIf(shutil.which("ncu") or shutil.which("compute-sanitizer"), "they are not absent")
    def test_marks_tools_that_are_absent(self):
        with tempfile.TemporaryDirectory() as nothing:
            _, written = self.run_script(**self.put_tools("ncu", "compute-sanitizer"), NSIGHT_COMPUTE=nothing)
        for name in ("ncu_auto", "ncu_superposed", "memcheck", "racecheck"):
            self.assertEqual(written["steps"][name], {"status": "absent"})
        self.assertEqual(written["steps"]["bench"]["status"], "ok")

    def test_reports_a_build_that_fails(self):
        environment = self.put_tools()
        with open(os.path.join(self.bin, "cmake"), "w", encoding="utf-8") as file:
            file.write("#!/bin/sh\necho the reason; exit 1\n")
        _, written = self.run_script(**environment)
        self.assertEqual(written["steps"]["configure"]["output"], "the reason")
        self.assertEqual(written["steps"]["parity"]["status"], "not run")


@unittest.skipUnless(BENCH, "DEVICE_BENCH is not set")
class Benchmark(unittest.TestCase):
    def test_measures_everything_on_the_substitute_runtime(self):
        told = subprocess.run([BENCH, "--quick"], check=True, stdout=subprocess.PIPE, text=True)
        found = json.loads(told.stdout)
        self.assertTrue(found["complete"])
        self.assertEqual([point["different"] for point in found["parity"]], [0] * len(found["parity"]))
        self.assertEqual({point["method"] for point in found["frames"]}, {point["method"] for point in found["parity"]})
        self.assertEqual({point["macrocell"] for point in found["frames"]}, {2, 4})
        self.assertEqual(len(found["frames"]), 2 * 4 * 5)  # macrocells, lights, methods
        self.assertEqual(len(found["rebuild"]), 2)
        self.assertEqual({point["method"] for point in found["edits"]}, {"superposed", "raymarch", "auto"})
        with tempfile.TemporaryDirectory() as nothing:
            self.assertIn("## Rebuilding majorants", report_of({**results(nothing), "bench": found}))
        for rows in ("frames", "rebuild", "edits"):
            for point in found[rows]:
                self.assertTrue(all(value > 0 for name, value in point.items() if name.endswith("Ms") and name != "rebuildMs"),
                                point)

    def test_renders_frames_of_one_method_for_a_profiler(self):
        told = subprocess.run([BENCH, "--quick", "--frames", "auto", "1"], check=True, stdout=subprocess.PIPE, text=True)
        self.assertNotEqual(json.loads(told.stdout)["method"], "auto")
        refused = subprocess.run([BENCH, "--frames", "bogus", "1"], capture_output=True, text=True)
        self.assertEqual(refused.returncode, 1)
        self.assertIn("bogus", refused.stderr)
        self.assertEqual(subprocess.run([BENCH, "--bogus"], capture_output=True).returncode, 2)


if __name__ == "__main__":
    unittest.main()
