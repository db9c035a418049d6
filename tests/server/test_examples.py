#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The examples for GPU nodes (server/examples, server/Containerfile): what they call exists, and the batch script runs, with
a stand-in for Slurm."""
import os
import re
import shlex
import shutil
import signal
import stat
import subprocess
import sys
import tempfile
import unittest
import urllib.request

sys.path.insert(0, os.path.dirname(__file__))
from serving import PROGRAM, Server, write_volume  # noqa: E402

ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "../..")
EXAMPLES = os.path.join(ROOT, "server/examples")
CONTAINERFILE = os.path.join(ROOT, "server/Containerfile")
# Starts the task at once, with srun's own options left out.
SRUN = """#!/bin/sh
while [ "${1#--}" != "$1" ]; do shift; done
exec "$@"
"""


def read(path):
    with open(path, encoding="utf-8") as file:
        return file.read()


def example(name):
    return read(os.path.join(EXAMPLES, name))


def help_of(command):
    return subprocess.run([PROGRAM, command, "--help"], check=True, capture_output=True, text=True).stdout


def calls(text):
    """(command, its options) wherever a text calls the program."""
    lines = text.replace("\\\n", " ").splitlines()
    for line in lines:
        called = re.search(r'(?:\bscolopax|:-scolopax}")\s+(serve|render|info|generate)\b(.*)', line.lstrip("# "))
        if called:
            words = shlex.split(called[2].split(" > ")[0].split("`")[0], comments=True)
            yield called[1], [word for word in words if word.startswith("--")]


class Examples(unittest.TestCase):
    def test_call_the_program_with_options_that_it_has(self):
        found = [call for name in ("README.md", "scolopax.sbatch", "nginx.conf") for call in calls(example(name))]
        self.assertGreaterEqual(len(found), 6)
        told = {command: help_of(command) for command, _ in found}
        for command, options in found:
            for option in options:
                self.assertRegex(told[command], rf"{option}\b", command)

    def test_name_options_and_variables_that_the_server_has(self):
        told = help_of("serve")
        for path in (CONTAINERFILE, *(os.path.join(EXAMPLES, name) for name in os.listdir(EXAMPLES))):
            for variable in re.findall(r"\bSCOLOPAX_[A-Z_]*[A-Z]\b", read(path)):
                self.assertIn(variable, told, path)
        for option in re.findall(r"`(--[a-z-]+)`", example("README.md")):
            if option not in ("--device", "--gpus", "--publish"):  # of containers, too
                self.assertIn(option, told)

    def test_copy_into_the_image_what_there_is(self):
        copied = [word for line in re.findall(r"(?m)^COPY (?!--)(.*)$", read(CONTAINERFILE)) for word in line.split()[:-1]]
        self.assertIn("renderer", copied)
        for path in copied:
            self.assertTrue(os.path.exists(os.path.join(ROOT, path)), path)

    @unittest.skipUnless(shutil.which("dpkg") and shutil.which("readelf") and
                         'VERSION_ID="12"' in (read("/etc/os-release") if os.path.exists("/etc/os-release") else ""),
                         "Debian 12 tells which packages hold the libraries")
    def test_install_the_libraries_that_the_program_needs(self):
        installed = re.search(r"debian:12-slim\nRUN .*?--no-install-recommends \\\n(.*?)\\\n  &&", read(CONTAINERFILE), re.S)[1]
        needed = re.findall(r"NEEDED.*\[(.*)\]", subprocess.run(["readelf", "-d", PROGRAM], check=True, capture_output=True,
                                                               text=True).stdout)
        for library in needed:
            found = subprocess.run(["dpkg", "-S", f"*/{library}"], capture_output=True, text=True).stdout
            packages = {line.split(":")[0] for line in found.splitlines()}
            if packages & {"libc6", "libstdc++6", "libgcc-s1"} or library == "libz.so.1":
                continue  # which the image has, or another of them needs
            self.assertTrue(packages & set(installed.split()), f"{library}: {packages}")

    def test_proxies_are_let_through_by_the_option_that_they_name(self):
        host = {"Host": "viz.example.org"}
        for path in ("nginx.conf", "README.md"):
            self.assertIn("--allow-origin https://viz.example.org", example(path))
        with Server("--allow-origin", "https://viz.example.org") as server:
            self.assertEqual(server.call("GET", "/api/v1/datasets", headers=host)[0], 200)
        with Server() as server:
            self.assertEqual(server.call("GET", "/api/v1/datasets", headers=host)[0], 421)

    def test_of_nginx_has_only_whole_directives(self):
        text = re.sub(r"(?m)#.*$", "", example("nginx.conf"))
        self.assertEqual(text.count("{"), text.count("}"))
        for line in filter(None, map(str.strip, text.splitlines())):
            self.assertIn(line[-1], ";{}", line)


class Slurm(unittest.TestCase):
    SCRIPT = os.path.join(EXAMPLES, "scolopax.sbatch")

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.home = folder.name
        srun = os.path.join(self.home, "bin/srun")
        os.mkdir(os.path.dirname(srun))
        with open(srun, "w", encoding="utf-8") as file:
            file.write(SRUN)
        os.chmod(srun, 0o755)
        clean = {k: v for k, v in os.environ.items() if not k.startswith("SCOLOPAX_")}
        self.environment = {**clean, "PATH": os.path.dirname(srun) + os.pathsep + clean["PATH"], "HOME": self.home,
                            "SLURM_JOB_ID": "7", "SLURM_CPUS_PER_TASK": "1", "SCOLOPAX": PROGRAM, "SCOLOPAX_DEVICE": "cpu"}

    def start(self, *paths):
        job = subprocess.Popen(["bash", self.SCRIPT, *paths], env=self.environment, stdout=subprocess.PIPE,
                               stderr=subprocess.DEVNULL, text=True, start_new_session=True)
        self.addCleanup(job.stdout.close)
        return job

    def test_serves_with_a_token_that_only_the_owner_can_read(self):
        job = self.start(*write_volume(self.home))
        told = []
        for line in job.stdout:
            told.append(line)
            if line.startswith("To stop"):
                break
        log = "".join(told)
        try:
            self.assertIn("scancel 7", log)
            token_file = re.search(r"ssh LOGIN cat (\S+)", log)[1]
            self.assertEqual(stat.S_IMODE(os.stat(token_file).st_mode), 0o600)
            self.assertEqual(stat.S_IMODE(os.stat(os.path.dirname(token_file)).st_mode), 0o700)
            token = read(token_file)
            self.assertGreaterEqual(len(token), 43)
            self.assertNotIn(token, log)
            port = re.search(r"-L 8080:127\.0\.0\.1:(\d+) ", log)[1]
            request = urllib.request.Request(f"http://127.0.0.1:{port}/api/v1/datasets",
                                             headers={"Authorization": f"Bearer {token}"})
            with urllib.request.urlopen(request, timeout=60) as answer:
                self.assertEqual(answer.status, 200)
        finally:
            os.killpg(job.pid, signal.SIGTERM)
            job.wait(timeout=60)
        self.assertFalse(os.path.exists(os.path.dirname(token_file)))

    def test_ends_when_the_server_does_not_start(self):
        job = self.start("/nowhere/brain.nrrd")
        self.assertEqual(job.stdout.read(), "The server has not started.\n")
        self.assertEqual(job.wait(timeout=60), 1)


if __name__ == "__main__":
    unittest.main()
