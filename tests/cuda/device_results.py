#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""device_results.py LOGS: prints as one JSON document what the steps of on_device.sh have left in a folder.

Each step has {"status": ..., "seconds": ...}: ok, failed, timed out, absent (its tool), no time left, or not run; what
failed has the end of its output, too."""
import csv
import json
import os
import re
import sys

STEPS = ["configure", "build", "parity", "bench", "memcheck", "ncu_auto", "ncu_superposed", "racecheck"]
# Below this share of what the device can do, of either kind, neither limits a kernel: it waits.
BUSY = 60


def read(folder, name):
    try:
        with open(os.path.join(folder, name), encoding="utf-8", errors="replace") as file:
            return file.read()
    except FileNotFoundError:
        return ""


def step_of(folder, name):
    text = read(folder, f"{name}.status").strip()
    if not re.fullmatch(r"\d+ \d+", text):
        return {"status": text or "not run"}
    code, seconds = map(int, text.split())
    # timeout's own statuses: 137 where the command had to be killed.
    status = "ok" if code == 0 else "timed out" if code in (124, 137) else "failed"
    found = {"status": status, "seconds": seconds}
    if status == "failed":
        found["output"] = (read(folder, f"{name}.out")[-1500:] + read(folder, f"{name}.log")[-1500:]).strip()
    return found


def processor():
    names = re.findall(r"^model name\s*:\s*(.*)$", read("/proc", "cpuinfo"), re.MULTILINE)
    return f"{names[0]}, {len(names)} threads" if names else "unknown"


def document(text):
    """What a JSON text holds; None if a program ended while it was writing it."""
    try:
        return json.loads(text)
    except ValueError:
        return None


def parity(folder):
    """Of the report that gtest writes."""
    report = document(read(folder, "parity.json"))
    if not report:
        return {}
    suites = [(suite["name"], test) for suite in report["testsuites"] for test in suite["testsuite"]]
    return {"tests": report["tests"], "skipped": sum(test["result"] == "SKIPPED" for _, test in suites),
            "failed": [f"{suite}.{test['name']}" for suite, test in suites if test.get("failures")]}


def sanitizer(folder, name):
    """What the summary of memcheck or racecheck says; null: it has none."""
    found = re.findall(r"(?:ERROR SUMMARY: (\d+) error|RACECHECK SUMMARY: (\d+) hazard)",
                       read(folder, f"{name}.out") + read(folder, f"{name}.log"))
    return {"found": int(found[-1][0] or found[-1][1]) if found else None}


def metrics_of(text):
    """{name: {unit: value}} of ncu's page of details, in which a name may stand for a share and for a rate."""
    lines = text.splitlines()
    header = next((i for i, line in enumerate(lines) if line.startswith('"ID"')), len(lines))
    found = {}
    for row in csv.DictReader(lines[header:]):
        try:
            value = float(row["Metric Value"].replace(",", ""))
        except (ValueError, AttributeError):
            continue
        found.setdefault(row["Metric Name"], {})[row["Metric Unit"]] = value
    return found


def bound(folder, name):
    """What limits a kernel, as ncu's section "Speed of light" tells it."""
    metrics = metrics_of(read(folder, f"{name}.csv"))
    compute, memory, *levels = (metrics.get(metric, {}).get("%") for metric in (
        "Compute (SM) Throughput", "Memory Throughput", "DRAM Throughput", "L2 Cache Throughput", "L1/TEX Cache Throughput"))
    if compute is None or memory is None:
        return {}
    limit = "latency" if max(compute, memory) < BUSY else "memory" if memory > compute else "instructions"
    kept = ("Duration", "Registers Per Thread", "Achieved Occupancy", "L1/TEX Hit Rate", "L2 Hit Rate",
            "Avg. Active Threads Per Warp", "Warp Cycles Per Issued Instruction", "Executed Instructions")
    return {"bound": limit, "computePercent": compute, "memoryPercent": memory,
            "levelPercents": dict(zip(("DRAM", "L2", "L1"), levels)),
            "metrics": {metric: metrics[metric] for metric in kept if metric in metrics},
            "frame": document(read(folder, f"{name}.out"))}


def results(folder):
    steps = {name: step_of(folder, name) for name in STEPS}
    steps["parity"].update(parity(folder))
    for name in ("memcheck", "racecheck"):
        steps[name].update(sanitizer(folder, name) if steps[name]["status"] in ("ok", "failed") else {})
    for name in ("ncu_auto", "ncu_superposed"):
        steps[name].update(bound(folder, name))
    return {"device": document(read(folder, "probe.out")), "processor": processor(), "steps": steps,
            "bench": document(read(folder, "bench.out"))}


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    json.dump(results(sys.argv[1]), sys.stdout, indent=1)
    print()
