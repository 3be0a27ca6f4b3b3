#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Fails when a promise of the contract has no id or no test, or a test names an id that is not there.

    rows.py PROGRAM    PROGRAM: a target of the suite, contract_sim_test

Promises are the rows and the sentences of docs/reference/contract.md, each with an id of its own at its end, <sub>[SDO-14]</sub>, and the rows of the
generated docs/reference/registers.md: there the id is the register or object and the row's first number, [R3700-4]. A test's name begins with the ids of what it
shows. A sentence that ends in a colon only leads to what follows it.
"""

import collections
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
CONTRACT, REGISTERS = "docs/reference/contract.md", "docs/reference/registers.md"

# Sections that promise nothing to be tested here: why.
NO_PROMISE = {
    (CONTRACT, "The register contract"): "what the page is, and how it writes numbers",
    (CONTRACT, "Several CAN networks"): "a target has one network; tests/io, tests/modbus, tests/system",
    (REGISTERS, "Registers and codes"): "what the page is",
    (REGISTERS, "The window"): "names for the registers that every test uses; tests/regmap",
    (REGISTERS, "Scanner window"): "its registers; what they do says " + CONTRACT,
    (REGISTERS, "Process data"): "the names of what " + CONTRACT + " says under the same heading",
    (REGISTERS, "Diagnostics"): "not of the contract; tests/boards, tests/system",
    (REGISTERS, "Settings of a board"): "likewise",
    (REGISTERS, "SDO abort codes (R3707 and R3706)"): "names: codes of servers pass unchanged, the own ones are in " + CONTRACT,
}

NOTE = re.compile(r"\(decisions?\b[^)]*\)")
LIST_ITEM = re.compile(r"(\* |\d+\. )")
SENTENCE_END = re.compile(r'(?:(?<=\.)|(?<=</sub>))\s+(?=[A-Z0-9"*`])')
ID_AT_END = re.compile(r"<sub>\[([A-Z]+-\d+)\]</sub>[\s|]*$")
IDS_OF_TEST = re.compile(r"\[([A-Z0-9]+h?-\d+)\]")
NAME_OF_TEST = re.compile(r"(\[[A-Z0-9]+h?-\d+\] )+\S")
REGISTER = re.compile(r"R\d{3,4}$|[0-9A-F]{4}h$")


def sentences(block, number):
    """(line, text) of each sentence of a paragraph or list item that starts on line `number`."""
    block = NOTE.sub(lambda note: "\n" * note[0].count("\n"), block)
    start = LIST_ITEM.match(block)
    position = start.end() if start else 0
    for match in [*SENTENCE_END.finditer(block, position), None]:
        end = match.start() if match else len(block)
        text = block[position:end].strip()
        if text and not text.endswith(":"):
            yield number + block.count("\n", 0, position), text
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
    """(line, text, section) of each promise of a page."""
    section, in_table = None, False
    for number, text in blocks((ROOT / name).read_text().splitlines()):
        if text.startswith("#"):
            section = text.lstrip("# ")
        is_row = text.startswith("|")
        is_head = is_row and not in_table
        in_table = is_row
        if (name, section) in NO_PROMISE or text.startswith("#") or is_head or set(text) <= set("|-"):
            continue
        for line, promise in [(number, text)] if is_row else sentences(text, number):
            yield line, promise, section


def id_of_row(row, section):
    """[R3700-4]: the last register or object that the heading names, and the first cell."""
    places = [word for word in re.split(r"[ (),]+", section) if REGISTER.match(word)]
    return f"{places[-1]}-{row.strip('| ').split(' ')[0]}"


def test_names(program):
    """Catch2 2 and 3 list names by different options."""
    for options in (["--list-test-names-only"], ["--list-tests", "--verbosity", "quiet"]):
        listed = subprocess.run([program, *options], capture_output=True, text=True)
        if listed.stdout.strip() and not listed.stderr.strip():
            return [line.strip() for line in listed.stdout.splitlines() if line.strip()]
    sys.exit(f"{program}: does not list its tests: {listed.stderr.strip()}")


def main():
    found, places = [], collections.defaultdict(list)
    for line, promise, _ in promises(CONTRACT):
        ids = ID_AT_END.findall(promise)
        if not ids or promise.count("<sub>") > 1:
            found.append(f"{CONTRACT}:{line}: a promise that has not one id at its end: {' '.join(promise.split())}")
        for name in ids:
            places[name].append(f"{CONTRACT}:{line}")
    for line, row, section in promises(REGISTERS):
        places[id_of_row(row, section)].append(f"{REGISTERS}:{line}")
    found += [f"{' and '.join(lines)}: both are [{name}]" for name, lines in places.items() if len(lines) > 1]

    names = test_names(sys.argv[1])
    tested = collections.Counter(name for test in names for name in IDS_OF_TEST.findall(test))
    found += [f'the test "{test}" does not begin with an id and go on with words' for test in names if not NAME_OF_TEST.match(test)]
    found += [f"{lines[0]}: no test is for [{name}]" for name, lines in places.items() if not tested[name]]
    found += [f"a test is for [{name}], which {CONTRACT} and {REGISTERS} do not have" for name in tested if name not in places]
    print("\n".join(found) if found else f"{len(places)} promises, {len(names)} tests that show them")
    sys.exit(1 if found or len(places) < 80 else 0)


if __name__ == "__main__":
    main()
