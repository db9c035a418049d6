#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Makes the report's tables and plots from run.py's measurements, with the remarks of remarks.md. Needs Debian's
python3-matplotlib."""
import argparse
import json
import os
import re

from common import HERE, processor
from device_sections import machine_of
from plots import save
from sections import REPORT


def remarks():
    """The hand-written remarks on each experiment, by its name."""
    with open(os.path.join(HERE, "remarks.md"), encoding="utf-8") as file:
        parts = re.split(r"^## (\w+)\n", file.read(), flags=re.MULTILINE)
    return {name: text.strip() for name, text in zip(parts[1::2], parts[2::2])}


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("measured", metavar="MEASURED.json", nargs="*", help="files of run.py; later ones replace earlier ones")
    parser.add_argument("--rebuild", metavar="REBUILD.json", help="output of bench_rebuild --json")
    parser.add_argument("--layout", metavar="LAYOUT.json", help="output of bench_layout --json")
    parser.add_argument("--device", metavar="DEVICE.json", help="file of tests/cuda/on_device.sh")
    parser.add_argument("--out", metavar="FOLDER", default=os.path.join(HERE, "report"))
    options = parser.parse_args()
    if not any((options.measured, options.rebuild, options.layout, options.device)):
        parser.error("expected measurements")
    measured = {}
    for path in options.measured:
        with open(path, encoding="utf-8") as file:
            measured.update(json.load(file))
    for name, path in (("rebuild", options.rebuild), ("layout", options.layout)):
        if path:
            with open(path, encoding="utf-8") as file:
                measured[name] = {"found": json.load(file), "tool": f"bench_{name} --json"}
    if options.device:
        with open(options.device, encoding="utf-8") as file:
            found = json.load(file)
        measured["gpu"] = {"machine": machine_of(found), "quick": False, "found": found, "maker": "tests/cuda/on_device.sh"}
    os.makedirs(options.out, exist_ok=True)
    written = remarks()

    def plot(name, figure):
        if isinstance(figure, bytes):  # a JPEG picture
            with open(os.path.join(options.out, f"{name}.jpg"), "wb") as file:
                file.write(figure)
            return f"![{name}]({name}.jpg)"
        save(figure, os.path.join(options.out, f"{name}.svg"))
        return f"![{name}]({name}.svg)"

    for name, (title, sections) in REPORT.items():
        entries = [(section, measured[section.__name__]) for section in sections if section.__name__ in measured]
        if not entries:
            continue
        known = [entry for _, entry in entries if "machine" in entry]
        maker = known[0].get("maker", "tests/bench/run.py") if known else "tests/bench/run.py"
        text = f"# {title}\nMade by `{maker}` and `tests/bench/report.py`; "
        text += f"machine: {known[0]['machine'] if known else processor()}.\n"
        if name in ("speed", "quality", "channels"):
            text += (f"Pictures of {known[0]['side']}x{known[0]['side']} rays through pixel centres; errors over every third "
                     "pixel each way, against the\ndouble-precision reference.\n")
        if any(entry["quick"] for entry in known):
            text += "\n**Made with --quick: a test of the scripts, not a measurement.**\n"
        if not all(entry.get("complete", True) for entry in known):
            text += "\n**Not complete: the measurement was interrupted.**\n"
        for section, entry in entries:
            if len(sections) > 1:
                text += f"\n## {section.__name__.capitalize()}\n"
            if "tool" in entry:
                text += f"\nMeasured by `{entry['tool']}` where the report was made.\n"
            if section.__name__ in written:
                text += "\n" + written[section.__name__] + "\n"
            text += "\n" + section(entry, plot)
        with open(os.path.join(options.out, f"{name}.md"), "w", encoding="utf-8") as file:
            file.write(text)


if __name__ == "__main__":
    main()
