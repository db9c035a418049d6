# SPDX-License-Identifier: Apache-2.0
"""The experiment `proxies`: what the CUDA kernels execute per ray, counted on the CPU by ptx_costs."""
import json
import os
import subprocess
import sys
import time

from common import PROGRAM
from store import content_hash
from truths import assignments

PTX_COSTS = os.environ.get("SCOLOPAX_PTX_COSTS", os.path.join(os.path.dirname(PROGRAM), "ptx_costs"))


def proxies(bench):
    """Instructions, loads and bytes per ray of every scene, light and method, and of the paper's sync-dda as printed."""
    if not os.path.exists(PTX_COSTS):
        sys.exit(f"proxies: there is no {PTX_COSTS}; build the target ptx_costs, or set SCOLOPAX_PTX_COSTS")
    found = {}
    side = 16 if bench.quick else 48  # whole blocks of threads
    settings = {"image.width": side, "image.height": side, "integrator.step": 1}
    for name in bench.scenes:
        data = bench.data(name)
        if data is None:
            continue
        key = {"proxies": content_hash(bench.scene(name)), "data": list(map(content_hash, data)), "settings": settings}
        found[name] = bench.kept(key, lambda name=name, data=data: count(bench.scene(name), data, settings), PTX_COSTS)
        bench.save(found)
    return found


def count(scene, data, settings):
    begin = time.monotonic()
    out = subprocess.run([PTX_COSTS, scene, "--data", *data, *assignments(settings)], check=True,
                         stdout=subprocess.PIPE, text=True).stdout
    print(f"  {os.path.basename(scene)}: {time.monotonic() - begin:.1f} s", file=sys.stderr, flush=True)
    return json.loads(out)
