# SPDX-License-Identifier: Apache-2.0
"""check_resources.py FILE.ptx...: what each kernel needs of a device, by ptxas; fails beyond the limits below."""
import os
import re
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

ARCHITECTURES = ["sm_75", "sm_90"]
# What the kernels need at present: whoever raises a limit says why. A block of 128 threads leaves 168 registers
# where three are to fit. Kernels of plain scenes stay within 128 where no light falls, unless a tracker keeps a process
# per channel or channels are apart: there the close look at thick cells needs more. With light, shading indexes
# vectors, strata remember what they hold, and shadows march once more. Kernels of all scenes call what opacity by the
# gradient needs, and save their registers around the calls: those of plain scenes are compiled apart so that they
# need not. Those of plain scenes still need more than before there was opacity by the gradient: spill 144 instead of
# 112 without light, spill 520 instead of 416 and stack 432 instead of 336 with it. The reason has not been found yet;
# nor is it known why, since clip planes and crop, trackers of all scenes spill up to 384 (304 before) on sm_90 only.
PLAIN = {"registers": 128, "spill": 144, "stack": 96}
PLAIN_APART = {"registers": 168, "spill": 144, "stack": 96}
PLAIN_LIT = {"registers": 168, "spill": 520, "stack": 432}
ALL = {"registers": 168, "spill": 384, "stack": 216}
ALL_LIT = {"registers": 168, "spill": 1336, "stack": 600}


def is_unlit(name):
    return "5UnlitE" in name


def limits_of(name):
    plain = "PlainSceneView" in name
    if not is_unlit(name):
        return PLAIN_LIT if plain else ALL_LIT
    if not plain:
        return ALL
    return PLAIN_APART if "RayMarch" not in name and re.search("NDda|SyncDda|BlendComposite", name) else PLAIN


def marching_arrays(name):
    """Bytes that quadrature keeps per channel, at most 32, and indexes: SegmentEnds, Hidden, Strata::Memory."""
    if "RayMarch" not in name:
        return 0
    point, part, optical, color, number = 8, 20, 16, 12, 4  # CurvePoint, PartOf, Optical, Vec, Float
    factor = 0 if "PlainSceneView" in name else number
    sums = "BlendDensity" in name or "BlendComposite" in name
    segment = 32 * (2 * (point + factor) + (0 if sums else part + 2 * optical + number))
    strata = 32 * (part + number + color)
    return segment if is_unlit(name) else 2 * segment + strata  # shadow rays have a segment too


KERNEL = re.compile(r"entry function '(\w+)'.*?(\d+) bytes stack frame, (\d+) bytes spill stores.*?Used (\d+) registers",
                    re.DOTALL)


def needs(architecture, file):
    """(name, stack, spill, registers) of every kernel in the file."""
    result = subprocess.run(["ptxas", "-v", f"-arch={architecture}", file, "-o", "/dev/null"],
                            capture_output=True, text=True, check=True)
    return KERNEL.findall(result.stderr)


jobs = [(architecture, file) for architecture in ARCHITECTURES for file in sys.argv[1:]]
with ThreadPoolExecutor(os.cpu_count()) as pool:
    found = list(pool.map(lambda job: needs(*job), jobs))
kernels, excesses = 0, []
for architecture in ARCHITECTURES:
    largest = {"registers": 0, "spill": 0, "stack": 0}
    for job, results in zip(jobs, found):
        for name, stack, spill, registers in results if job[0] == architecture else ():
            kernels += 1
            used = {"registers": int(registers), "spill": int(spill), "stack": int(stack) - marching_arrays(name)}
            for what, limit in limits_of(name).items():
                largest[what] = max(largest[what], used[what])
                if used[what] > limit:
                    excesses.append(f"{architecture} {name}: {what} {used[what]}, at most {limit}")
    print(architecture, "at most", largest)
print(kernels, "kernels")
if kernels == 0 or excesses:
    sys.exit("\n".join(excesses) or "no kernels")
