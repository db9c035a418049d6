# SPDX-License-Identifier: Apache-2.0
"""The experiment `proxies`: what the CUDA kernels execute per ray, counted on the CPU by ptx_costs."""
import json
import os
import subprocess
import sys
import time

from common import PROGRAM, assignments

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
        begin = time.monotonic()
        out = subprocess.run([PTX_COSTS, bench.scene(name), "--data", *data, *assignments(settings)], check=True,
                             stdout=subprocess.PIPE, text=True).stdout
        found[name] = json.loads(out)
        print(f"  {name}: {time.monotonic() - begin:.1f} s", file=sys.stderr, flush=True)
    return found
