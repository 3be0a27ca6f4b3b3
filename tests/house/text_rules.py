#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Fails on a source file without an SPDX line, with too many lines, or naming a file that does not exist."""

import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests/support"))
import tree

SOURCES = {".hpp", ".cpp", ".h", ".c", ".py", ".cmake", ".sh", ".mjs"}
MOST_LINES = 500
# A file or folder, or the beginning of its name, in comments and messages; capitals such as TARGET are placeholders.
PATH = re.compile(r"(?<![\w./{}$*-])(?:bench|docs|examples|firmware|hostsim|tests|tools)/(?:[\w.-]+/)*[\w.-]*\w")
PLACEHOLDER = re.compile(r"/[A-Z]+\b(?!\.md)")


def tracked_files():
    listed = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True)
    return [ROOT / name for name in listed.stdout.splitlines()] if listed.returncode == 0 else tree.files()


def is_source(path):
    if path.suffix in SOURCES or path.name == "CMakeLists.txt":
        return True
    with path.open("rb") as file:
        return file.read(2) == b"#!"


def main():
    files = [f for f in tracked_files() if f.is_file() and is_source(f)]
    found = []
    for path in files:
        lines = path.read_text().splitlines()
        name = path.relative_to(ROOT)
        if not any("SPDX-License-Identifier: MIT" in line for line in lines[:3]):
            found.append(f"{name}:1: no line `SPDX-License-Identifier: MIT`")
        for number, line in enumerate(lines, 1):
            found += [f"{name}:{number}: no such file: {path}" for path in PATH.findall(line)
                      if not PLACEHOLDER.search(path) and not any(ROOT.glob(path + "*"))]
        if len(lines) > MOST_LINES:
            found.append(f"{name}: {len(lines)} lines; {MOST_LINES} is the most, split it by what it is about")
    print("\n".join(found) if found else f"{len(files)} source files are in order")
    sys.exit(1 if found or len(files) < 50 else 0)


main()
