#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Fails when a promise of the contract has no test that quotes it, or a test quotes what is no longer there.

    rows.py PROGRAM    PROGRAM: a target of the suite, contract_core_test

Promises are the rows and the sentences of docs/contract.md, and the rows of docs/registers.md. A test's name is the heading,
": " and the promise, without markdown, "(decision)" and the full stop, a row with its cells joined by " | "; behind " -- "
it may say more. A sentence that ends in a colon only leads to what follows it.
"""

import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
CONTRACT, REGISTERS = "docs/contract.md", "docs/registers.md"

# Sections that promise nothing to be tested here: why.
NO_PROMISE = {
    (CONTRACT, "The register contract"): "what the page is, and how it writes numbers",
    (CONTRACT, "Several CAN networks"): "a target has one network; tests/io, tests/modbus, tests/system",
    (REGISTERS, "Registers and codes"): "what the page is",
    (REGISTERS, "The window"): "names for the registers that every test uses; tests/regmap",
    (REGISTERS, "Process data"): "the names of what " + CONTRACT + " says under the same heading",
    (REGISTERS, "Diagnostics of the firmware images"): "not of the contract: one target alone has them; tests/boards",
    (REGISTERS, "SDO abort codes (R3707 and R3706)"): "names: codes of servers pass unchanged, the own ones are in " + CONTRACT,
}

NOTE = re.compile(r"\s*\(decisions?\b[^)]*\)")
LINK = re.compile(r"\[([^]]*)\]\([^)]*\)")
LIST_ITEM = re.compile(r"(\* |\d+\. )")
SENTENCE_END = re.compile(r'(?<=\.)\s+(?=[A-Z0-9"*`])')


def plain(text):
    return " ".join(LINK.sub(r"\1", NOTE.sub("", text)).replace("*", "").replace("`", "").split())


def row_of(line):
    return " | ".join(plain(cell) for cell in line.strip().strip("|").split("|"))


def sentences(block, number):
    """(line, text) of each sentence of a paragraph or list item that starts on line `number`."""
    start = LIST_ITEM.match(block)
    position = start.end() if start else 0
    for match in [*SENTENCE_END.finditer(block, position), None]:
        end = match.start() if match else len(block)
        text = plain(block[position:end])
        if text and not text.endswith(":"):
            yield number + block.count("\n", 0, position), text.removesuffix(".")
        position = match.end() if match else end


def blocks(lines):
    """(line, text): each heading, table row, list item and paragraph."""
    text, first = "", 0
    for number, line in enumerate([*lines, ""], 1):
        whole_line = not line.strip() or line.startswith(("#", "|"))
        if text and (whole_line or LIST_ITEM.match(line)):
            yield first, text
            text = ""
        if whole_line and line.strip():
            yield number, line
        elif line.strip():
            first, text = (first, text + "\n" + line) if text else (number, line)


def promises(name):
    """(line, quote) of each promise of a page."""
    found, section, in_table = [], None, False
    for number, text in blocks((ROOT / name).read_text().splitlines()):
        if text.startswith("#"):
            section = plain(text.lstrip("#"))
        is_row = text.startswith("|")
        is_head = is_row and not in_table
        in_table = is_row
        if (name, section) in NO_PROMISE or text.startswith("#") or is_head or set(text) <= set("|-"):
            continue
        promised = [(number, row_of(text))] if is_row else sentences(text, number)
        found += [(line, f"{section}: {quote}") for line, quote in promised]
    return found


def test_names(program):
    """Catch2 2 and 3 list names by different options."""
    for options in (["--list-test-names-only"], ["--list-tests", "--verbosity", "quiet"]):
        listed = subprocess.run([program, *options], capture_output=True, text=True)
        if listed.stdout.strip() and not listed.stderr.strip():
            return [plain(line.partition(" -- ")[0]) for line in listed.stdout.splitlines() if line.strip()]
    sys.exit(f"{program}: does not list its tests: {listed.stderr.strip()}")


def main():
    names = test_names(sys.argv[1])
    quotes, found = [], []
    for page in (CONTRACT, REGISTERS):
        for number, quote in promises(page):
            quotes.append(quote)
            if quote not in names:
                found.append(f'{page}:{number}: no test quotes: "{quote}"')
    for name in names:
        if name not in quotes:
            found.append(f'the test "{name}" quotes a row or sentence that {CONTRACT} and {REGISTERS} do not have')
    print("\n".join(found) if found else f"{len(quotes)} promises, {len(names)} tests that quote them")
    sys.exit(1 if found or len(quotes) < 80 else 0)


if __name__ == "__main__":
    main()
