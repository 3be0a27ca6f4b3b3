#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Checks that docs/reference/function-blocks.md has a row for every block with its members, and for every error."""

import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests/support"))
import cases

PAGE = (ROOT / "docs/reference/function-blocks.md").read_text()
HEADER = (ROOT / "tools/cia405/include/cbcan/cia405.hpp").read_text()


def blocks(found):
    declared = re.findall(r"class (\w+) final : public \w+ \{(.*?)private:", HEADER, re.DOTALL)
    if len(declared) != 10:
        found.append(f"{len(declared)} blocks in cia405.hpp; this test does not find them")
    for name, body in declared:
        row = re.search(rf"^\| `{name}` .*$", PAGE, re.MULTILINE)
        members = re.findall(r"^  [\w:<>, ]+ (\w+)(?: = [^;(]*|\{\});", body, re.MULTILINE)
        found += [f"the row of `{name}` has no `{member}`" for member in members
                  if not row or f"`{member}`" not in row[0]]
        if not row:
            found.append(f"no row for `{name}`")


def errors(found):
    enumeration = re.search(r"enum class KernelError.*?\};", HEADER, re.DOTALL)[0]
    for name, number in re.findall(r"(k\w+) = 0x(\w\w)", enumeration):
        if not re.search(rf"^\| {number}h \| `{name}` \|", PAGE, re.MULTILINE):
            found.append(f"no row for {number}h `{name}`")


def main():
    found, checks = [], (blocks, errors)
    for check in checks:
        check(found)
    print("\n".join(f"docs/reference/function-blocks.md: {text}" for text in found))
    sys.exit(0 if cases.enough(len(checks)) and not found else 1)


main()
