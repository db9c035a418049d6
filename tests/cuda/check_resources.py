# SPDX-License-Identifier: Apache-2.0
"""check_resources.py FILE.ptx...: what each kernel needs of a device, by ptxas; fails beyond the limits below. Devices:
the variable SCOLOPAX_ARCHITECTURES; sm_90 by default, because each takes 10 minutes."""
import os
import re
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

ARCHITECTURES = os.environ.get("SCOLOPAX_ARCHITECTURES", "sm_90").split()
# What the kernels need at present: (registers, bytes of spills, bytes of stack) at most. Whoever raises a limit says
# why. A block of 128 threads leaves 168 registers where three are to fit, 128 for four. Kernels of plain scenes may take
# every register (kBlocksAtOnce in cuda/pixel_kernels.h), so that those of quadrature with light spill none. The stack
# holds arrays with an entry for each of 32 channels: the ends of a segment and, where the largest extinction hides the
# others, the visible part of each channel; the cubics of a voxel cell; with light, what a stratum remembers, and a
# segment of the shadow ray; in scenes that are not plain, the next surface of each channel. Kernels of all scenes save
# registers around calls of what few scenes need, which counts as spills; those of plain scenes are compiled apart so
# that they need not.
LIMITS = {
    # plain scene, integrator, lit, extinctions add up
    (True, "tracker", False, True): (168, 144, 96),
    (True, "tracker", False, False): (168, 144, 88),
    (True, "tracker", True, True): (168, 232, 224),
    (True, "tracker", True, False): (168, 300, 248),
    (True, "EqualSteps", False, True): (128, 12, 528),
    (True, "EqualSteps", False, False): (128, 0, 2312),
    (True, "EqualSteps", True, True): (168, 540, 2624),
    (True, "EqualSteps", True, False): (168, 452, 6144),
    (True, "VoxelCells", False, True): (128, 0, 3600),
    (True, "VoxelCells", False, False): (96, 128, 5504),
    (True, "VoxelCells", True, True): (255, 350, 7408),
    (True, "VoxelCells", True, False): (128, 366, 11008),
    (False, "tracker", False, True): (255, 56, 3408),
    (False, "tracker", False, False): (255, 64, 3424),
    (False, "tracker", True, True): (255, 1542, 3888),
    (False, "tracker", True, False): (168, 1560, 3888),
    (False, "EqualSteps", False, True): (250, 0, 4080),
    (False, "EqualSteps", False, False): (248, 0, 5872),
    (False, "EqualSteps", True, True): (168, 1258, 9072),
    (False, "EqualSteps", True, False): (168, 1250, 14432),
    (False, "VoxelCells", False, True): (168, 236, 6912),
    (False, "VoxelCells", False, False): (128, 152, 8768),
    (False, "VoxelCells", True, True): (168, 796, 16768),
    (False, "VoxelCells", True, False): (128, 944, 22272),
}
OTHERS = (32, 0, 0)  # kernels that render nothing


def limits_of(name):
    if "renderPixels" not in name:
        return OTHERS
    marcher = re.search("EqualSteps|VoxelCells", name)
    sums = re.search("BlendDensity|BlendComposite", name) is not None
    return LIMITS["PlainSceneView" in name, marcher[0] if marcher else "tracker", "5UnlitE" not in name, sums]


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
for (architecture, _), results in zip(jobs, found):
    for name, stack, spill, registers in results:
        kernels += 1
        for what, used, limit in zip(("registers", "spills", "stack"), (registers, spill, stack), limits_of(name)):
            if int(used) > limit:
                excesses.append(f"{architecture} {name}: {what} {used}, at most {limit}")
print(kernels, "kernels for", *ARCHITECTURES)
if kernels == 0 or excesses:
    sys.exit("\n".join(excesses) or "no kernels")
