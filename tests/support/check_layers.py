#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Fails if a folder includes a folder on which it must not depend, or a library reserved for other files."""
import pathlib
import re
import sys

ROOT = pathlib.Path(sys.argv[1])
# The top-level folders that each folder may include.
MAY_INCLUDE = {
    "renderer": {"renderer"},
    "protocol": {"protocol"},
    "cuda": {"cuda", "renderer"},
    "server": {"server", "renderer", "protocol", "cuda"},
}
# Within renderer: the reference shares no code with the kernels; kernels include nothing that allocates.
FORBIDDEN = [
    ("renderer/reference/", r"renderer/(kernel|cpu)/"),
    ("renderer/kernel/", r"renderer/(?!kernel/|core/)"),
    ("renderer/data/", r"renderer/(io|cpu|engine|reference)/|renderer/(renderer|launcher)\.h"),
    ("renderer/kernel/trackers/", r"renderer/kernel/(analog|shade|raymarch|strata)\.h"),
    ("renderer/kernel/segment", r"renderer/kernel/trackers/"),
    ("renderer/kernel/shade.h", r"renderer/kernel/trackers/"),
    ("renderer/io/", r"renderer/(kernel|cpu|reference)/"),
    ("server/net/", r"(renderer|protocol)/"),
]
# Libraries kept behind one folder or file (prefix of the including file).
LIBRARIES = [
    (r"boost/(?!crc\.hpp)", ["server/net/"]),
    (r"httplib\.h", ["server/net/"]),
    (r"OpenImageIO/", ["renderer/io/", "renderer/data/colormap.cpp"]),
    (r"nifti|teem/", ["renderer/io/"]),
    (r"(hdf5|netcdf|blosc|zstd|lz4|zip)\.h|openvdb/|gdcm|curl/", ["renderer/io/"]),
    (r"turbojpeg\.h", ["server/encoder.cpp"]),
    (r"tbb/|oneapi/", ["renderer/", "cuda/"]),
]
INCLUDE = re.compile(r'^\s*#\s*include\s*[<"]([^>"]+)[>"]', re.M)

errors = []
for folder, allowed in MAY_INCLUDE.items():
    for path in sorted((ROOT / folder).rglob("*")):
        if path.suffix not in {".h", ".cpp", ".cu"}:
            continue
        name = path.relative_to(ROOT).as_posix()
        for target in INCLUDE.findall(path.read_text(encoding="utf-8")):
            top = target.split("/")[0]
            if "/" in target and top in set(MAY_INCLUDE) | {"tests"} and top not in allowed:
                errors.append(f"{name}: includes {target}; {folder}/ may include only {sorted(allowed)}")
            for prefix, pattern in FORBIDDEN:
                if name.startswith(prefix) and re.match(pattern, target):
                    errors.append(f"{name}: includes {target}, which {prefix} must not know")
            for pattern, homes in LIBRARIES:
                if re.match(pattern, target) and not any(name.startswith(home) for home in homes):
                    errors.append(f"{name}: includes {target}, which belongs behind {homes}")
if errors:
    sys.exit("\n".join(errors))
