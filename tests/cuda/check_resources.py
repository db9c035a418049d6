# SPDX-License-Identifier: Apache-2.0
"""check_resources.py FILE.ptx...: what each kernel needs of a device, by ptxas; fails beyond the limits below."""
import re
import subprocess
import sys

ARCHITECTURES = ["sm_75", "sm_90"]
# Without light all but three of twenty kernels (mix by n-dda and sync-dda, composite by raymarch) stay within 104
# registers, 64 bytes of spilling and 64 of stack. With light, shading indexes vectors and shadows march once more.
LIMITS = {"registers": 128, "spill": 112, "stack": 80}
LIMITS_LIT = {"registers": 168, "spill": 400, "stack": 320}


def marching_arrays(name):
    """Bytes that quadrature keeps per channel of 32, or per place of a segment, and indexes (raymarch.h, segments.h)."""
    if "RayMarch" not in name:
        return 0
    sums = "BlendDensity" in name or "BlendComposite" in name
    segment = 268 + (0 if sums else 68)  # positions at both ends; which channel is largest
    lit = re.search(r"LightFeaturesILb(\d)ELb(\d)E", name)
    strata = 768 if lit.group(1) + lit.group(2) != "00" else 0
    return segment + strata + (segment if lit.group(2) == "1" else 0)  # shadow rays have a segment too


KERNEL = re.compile(r"entry function '(\w+)'.*?(\d+) bytes stack frame, (\d+) bytes spill stores.*?Used (\d+) registers",
                    re.DOTALL)

kernels, excesses = 0, []
for architecture in ARCHITECTURES:
    largest = {"registers": 0, "spill": 0, "stack": 0}
    for file in sys.argv[1:]:
        result = subprocess.run(["ptxas", "-v", f"-arch={architecture}", file, "-o", "/dev/null"],
                                capture_output=True, text=True, check=True)
        for name, stack, spill, registers in KERNEL.findall(result.stderr):
            kernels += 1
            used = {"registers": int(registers), "spill": int(spill), "stack": int(stack)}
            limits = LIMITS if "LightFeaturesILb0ELb0E" in name else LIMITS_LIT
            used["stack"] -= marching_arrays(name)
            for what, amount in used.items():
                largest[what] = max(largest[what], amount)
                if amount > limits[what]:
                    excesses.append(f"{architecture} {name}: {what} {amount}, at most {limits[what]}")
    print(architecture, "at most", largest)
print(kernels, "kernels")
if kernels == 0 or excesses:
    sys.exit("\n".join(excesses) or "no kernels")
