#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Fails when a promise of the contract has no id or no test, or a test names an id that does not exist.

    rows.py PROGRAM    PROGRAM: a target of the suite, contract_sim_test

Promises are the rows of docs/reference/contract.md, each with its id in the first cell, <a id="sdo-14"></a>SDO-14, and the rows of the generated
docs/reference/registers.md: there the id is the register or object and the row's first number, [R3700-4]. A test's name begins with the ids that it
proves. Text outside the tables only explains: "must" and "never" fail there.
"""

import collections
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
CONTRACT, REGISTERS = "docs/reference/contract.md", "docs/reference/registers.md"

# Sections without promises to be tested here, and why.
NO_PROMISE = {
    (CONTRACT, "The register contract"): "what the page is, and how it writes numbers",
    (CONTRACT, "Several CAN networks"): "a target has one network; tests/io, tests/modbus, tests/system",
    (REGISTERS, "Registers and codes"): "what the page is",
    (REGISTERS, "The window"): "names for the registers that every test uses; tests/regmap",
    (REGISTERS, "Scanner window"): "its registers; what they do says " + CONTRACT,
    (REGISTERS, "Process data"): "the names of what " + CONTRACT + " says under the same heading",
    (CONTRACT, "Coils and discrete inputs"): "a target has registers; tests/modbus, tests/system",
    (REGISTERS, "Network status"): "the names of what " + CONTRACT + " says under the same heading",
    (REGISTERS, "Requests to nodes"): "the same",
    (REGISTERS, "Diagnostics"): "not of the contract; tests/boards, tests/system",
    (REGISTERS, "Settings of a board"): "likewise",
    (REGISTERS, "SDO abort codes (R3707 and R3706)"): "names: codes of servers pass unchanged, the own ones are in " + CONTRACT,
}

ID_OF_ROW = re.compile(r'\| <a id="([a-z]+-\d+)"></a>([A-Z]+-\d+) \|')
PROMISING = re.compile(r"\b(must|never)\b")
IDS_OF_TEST = re.compile(r"\[([A-Z0-9]+h?-\d+)\]")
NAME_OF_TEST = re.compile(r"(\[[A-Z0-9]+h?-\d+\] )+\S")
REGISTER = re.compile(r"R\d{3,4}$|[0-9A-F]{4}h$")


def rows(name):
    """Yields (line, row, section) of each row with a promise."""
    section, in_table = None, False
    for number, text in enumerate((ROOT / name).read_text().splitlines(), 1):
        if text.startswith("#"):
            section = text.lstrip("# ")
        is_row = text.startswith("|")
        if is_row and in_table and (name, section) not in NO_PROMISE and not set(text) <= set("|-"):
            yield number, text, section
        in_table = is_row


def ids_of_contract(found):
    """(line, id) of each promise."""
    for line, row, _ in rows(CONTRACT):
        cell = ID_OF_ROW.match(row)
        if cell and cell[1] == cell[2].lower():
            yield line, cell[2]
        else:
            found.append(f"{CONTRACT}:{line}: a row that does not begin with its id, | <a id=\"sdo-14\"></a>SDO-14 |: {row}")


def promises_outside_tables(found):
    for number, text in enumerate((ROOT / CONTRACT).read_text().splitlines(), 1):
        if not text.startswith("|") and (word := PROMISING.search(text)):
            found.append(f"{CONTRACT}:{number}: \"{word[0]}\" outside a table: a promise is a row with an id")


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
    promises_outside_tables(found)
    for line, name in ids_of_contract(found):
        places[name].append(f"{CONTRACT}:{line}")
    for line, row, section in rows(REGISTERS):
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
