#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Checks that docs/reference/devices.md names every device and every object that a device uses, and that docs/reference/function-blocks.md has a row
for every block with its members, and for every error."""

import re
import sys

import cases
from tree import ROOT

DEVICES = (ROOT / "docs/reference/devices.md").read_text()
LIST = (ROOT / "hostsim/devices/devices.cpp").read_text()
BLOCKS = (ROOT / "docs/reference/function-blocks.md").read_text()
HEADER = (ROOT / "tools/cia405/include/cbcan/cia405.hpp").read_text()


def devices():
    listed = re.findall(r'^ *\{"(\w+)",', LIST, re.MULTILINE)
    if len(listed) < 3:
        yield "hostsim/devices/devices.cpp: this test does not find the names in it"
    for name in listed:
        if not re.search(rf"^## `{name}`", DEVICES, re.MULTILINE):
            yield f"docs/reference/devices.md: no heading for the device `{name}`"


def objects():
    for path in sorted((ROOT / "hostsim/devices").rglob("*.?pp")):
        for index in re.findall(r"(?:= |\{d, |dictionary(?:\(\))?, )0x([69]\w{3})\b", path.read_text()):
            if f"{index}h" not in DEVICES:
                yield f"docs/reference/devices.md: nothing about {index}h, which {path.name} uses"


def blocks():
    declared = re.findall(r"class (\w+) final : public \w+ \{(.*?)private:", HEADER, re.DOTALL)
    if len(declared) != 10:
        yield f"{len(declared)} blocks in cia405.hpp; this test does not find them"
    for name, body in declared:
        row = re.search(rf"^\| `{name}` .*$", BLOCKS, re.MULTILINE)
        if not row:
            yield f"docs/reference/function-blocks.md: no row for `{name}`"
        for member in re.findall(r"^  [\w:<>, ]+ (\w+)(?: = [^;(]*|\{\});", body, re.MULTILINE):
            if not row or f"`{member}`" not in row[0]:
                yield f"docs/reference/function-blocks.md: the row of `{name}` has no `{member}`"


def errors():
    enumeration = re.search(r"enum class KernelError.*?\};", HEADER, re.DOTALL)[0]
    for name, number in re.findall(r"(k\w+) = 0x(\w\w)", enumeration):
        if not re.search(rf"^\| {number}h \| `{name}` \|", BLOCKS, re.MULTILINE):
            yield f"docs/reference/function-blocks.md: no row for {number}h `{name}`"


def main():
    checks = (devices, objects, blocks, errors)
    found = [line for check in checks for line in check()]
    print("\n".join(found))
    sys.exit(0 if cases.any_ran(len(checks)) and not found else 1)


main()
