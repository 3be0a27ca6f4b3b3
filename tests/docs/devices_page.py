#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Checks that docs/reference/devices.md names every device and every object that a device uses."""

import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests/support"))
import cases

PAGE = (ROOT / "docs/reference/devices.md").read_text()
LIST = (ROOT / "hostsim/devices/devices.cpp").read_text()


def names(found):
    listed = re.findall(r'^ *\{"(\w+)",', LIST, re.MULTILINE)
    if len(listed) < 3:
        found.append("hostsim/devices/devices.cpp: this test does not find the names in it")
    found += [f"docs/reference/devices.md: no heading for the device `{name}`" for name in listed
              if not re.search(rf"^## `{name}`", PAGE, re.MULTILINE)]


def objects(found):
    for path in sorted((ROOT / "hostsim/devices").rglob("*.?pp")):
        for index in re.findall(r"(?:= |\{d, |dictionary(?:\(\))?, )0x([69]\w{3})\b", path.read_text()):
            if f"{index}h" not in PAGE:
                found.append(f"docs/reference/devices.md: nothing about {index}h, which {path.name} uses")


def main():
    found, checks = [], (names, objects)
    for check in checks:
        check(found)
    print("\n".join(found))
    sys.exit(0 if cases.enough(len(checks)) and not found else 1)


main()
