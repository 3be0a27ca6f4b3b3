#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Every address of a PLC's own memory in docs/how-to/plc, in pages and programs for the same PLCs, and in their commands, lies where its maker
leaves room (plc_memory.txt)."""

import collections
import re

import cases
from tree import ROOT

PAGES = {path.stem: path.read_text() for path in (ROOT / "docs/how-to/plc").glob("*.md") if path.stem != "README"}
ROWS = [[cell.strip() for cell in line.split("|")] for line in (ROOT / "tests/docs/plc_memory.txt").read_text().splitlines()
        if line and not line.startswith("#")]
MEMORY = collections.defaultdict(lambda: collections.defaultdict(list))  # page, area: (first, last, use)
for page, area, first, last, use, source in ROWS:
    MEMORY[page][area].append((int(first), int(last), use))

WORDS = {"window": 70, "scanner": 138, "plc.process_first": 128, "plc.status_first": 172}  # contract: R3700..R3769, OUT + IN, PDO-1, registers.md
MAKERS = {"FATEK": "fatek", "OpenPLC": "openplc", "Omron": "omron", "CODESYS": "codesys", "Siemens": "siemens", "Beckhoff": "twincat"}
WIRE = {"fatek": "R", "omron": "Registers["}  # where the numbers of plc.first are those of the area
LEAST = {"codesys": 1, "delta": 20, "fatek": 22, "mitsubishi": 12, "omron": 14, "openplc": 150, "schneider": 6, "siemens": 2, "twincat": 1}
# What looks like an address in a PLC: an area that the file lacks is a mistake.
ADDRESS = re.compile(r"%[IQMS]\w*\d|\bDR?\d{2,}|\bRegisters\[\d|P#M\d|\bDB\d")

Use = collections.namedtuple("Use", "area first words text")


def unlinked(text):
    return re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", text)


def token(area):
    one = (r"\b[DR]*?" if area.isalpha() else "") + re.escape(area) + r"(\d+)\b" + (r"\]" if "[" in area else "")
    return rf"{one}(?:`?(?: to |\.\.)`?{one})?"


def words_of(found, line):
    """How many registers an address stands for: up to the one after it, those of its block or instruction, or its own."""
    before, after = line[:found.start()], line[found.end():]
    if found[2]:
        return int(found[2]) - int(found[1]) + 1
    if bits := re.match(r"\.0 WORD (\d+)", after):
        return 2 * int(bits[1])  # bytes
    if counted := re.match(r"(?: D\d+)? K(\d+)|\", len (\d+)", after):
        raw = re.search(r"\bK3 K\d+ $", before)  # Delta: the response, a byte in each register, with 3 in front of the data and 2 after it
        return 5 + 2 * int(counted[1]) if raw else int(counted[1] or counted[2])
    if counted := re.search(r"\bH\w+ K\d+ K(\d+) $", before):
        return int(counted[1])
    if job := re.match(r"\| \([a-d]\).*?\| \d+ \| \d+ \| \d+ \| (\d+) \|", line):
        return int(job[1])
    return 2 if found[0].startswith("DR") or re.search(r"\bDMOV (?:D\d+ )?$", before) else 1


def settings(line):
    """(key, number) of --set, of `first = N`, and of a row that lists keys and then their numbers."""
    found = re.findall(r"(plc\.\w+)=(\d+)", line) + [("plc." + key, number) for key, number in re.findall(r"`(\w*first) = (\d+)`", line)]
    if row := re.match(r"\|[^|]*?(`plc\.[^|]*)\| ([^|]*) \|", line):
        found += zip(re.findall(r"plc\.\w+", row[1]), row[2].split(", "))
    return [(key, int(number)) for key, number in found if key.endswith("first")]


def placed(page, line):
    """The blocks that the module's client takes in the PLC."""
    layout = "window" if page == "fatek" and "(a)" not in line and "scanner" not in line else "scanner"
    return [Use(WIRE.get(page, "register"), first, WORDS[layout if key == "plc.first" else key], line) for key, first in settings(line)]


def used(page, text):
    found = []
    for line in unlinked(text).replace(" \\\n", " ").splitlines():
        found += placed(page, line)
        line = line.replace("(b) R3700:", "(b):")  # the job's name
        for area in MEMORY[page]:
            found += [Use(area, int(each[1]), words_of(each, line), line) for each in re.finditer(token(area), line)]
    return found


def elsewhere():
    """(page, use) in plc-owns-registers.md, ladder-recipes.md, cbcanctl.md and the programs of tools/st."""
    for line in unlinked((ROOT / "docs/how-to/plc-owns-registers.md").read_text()).splitlines():
        makers = [page for name, page in MAKERS.items() if name in line] or ["fatek"]  # the first command is for one
        yield from ((page, use) for page in makers for use in placed(page, line))
        if "FATEK" in line:
            yield from (("fatek", use) for use in used("fatek", line))
    yield from (("fatek", use) for use in used("fatek", (ROOT / "docs/reference/ladder-recipes.md").read_text()))
    maps = (ROOT / "docs/reference/cbcanctl.md").read_text()
    row, = re.findall(r"^\| `xsy` \|.*?`%MW(\d+)`", maps, re.MULTILINE)
    yield "schneider", Use("%MW", int(row), 64 + 64 + 44 + 67, "xsy")  # inputs, outputs, status
    for program in sorted((ROOT / "tools/st").glob("*.st")):
        yield from (("openplc", use) for use in used("openplc", re.sub(r"\(\*.*?\*\)", "", program.read_text(), flags=re.DOTALL)))


def wrong(page, use):
    """The registers of this use that the maker does not leave to it."""
    registers = set(range(use.first, use.first + use.words))
    rows = MEMORY[page][use.area]
    if any((use.first, use.first + use.words - 1) == (first, last) or kind == "named" and registers <= set(range(first, last + 1))
           for first, last, kind in rows if kind != "free"):
        return set()
    for first, last, kind in rows:
        if kind == "free":
            registers -= set(range(first, last + 1))
    return registers


def all_wrong(page, text):
    return set().union(*(wrong(page, use) for use in used(page, text)))


class Memory(cases.Case):
    def test_every_address_is_free(self):
        count = collections.Counter()
        for page, use in [*((page, use) for page, text in PAGES.items() for use in used(page, text)), *elsewhere()]:
            count[page] += 1
            self.assertEqual(sorted(wrong(page, use)), [], f"{page}: {use}")
        self.assertEqual({page: least for page, least in LEAST.items() if count[page] < least}, {}, f"seen: {count}")
        self.assertEqual(set(LEAST), {page for page, *_ in ROWS})

    def test_every_area_is_in_the_file(self):
        for page, text in PAGES.items():
            text = unlinked(text)
            seen = [range(*each.span()) for area in MEMORY[page] for each in re.finditer(token(area), text)]
            self.assertEqual([found[0] for found in ADDRESS.finditer(text) if not any(found.start() in each for each in seen)], [], page)

    def test_every_row_has_a_source(self):
        self.assertEqual([row for row in ROWS if len(row) != 6 or not row[5] or row[4] not in ("free", "reserved", "named")], [])
        self.assertEqual(set(PAGES) - {page for page, *_ in ROWS}, {"rockwell"})  # tags, without addresses


class Control(cases.Case):
    """Pages as they were, and each kind of address, are found."""

    def test_the_old_fatek_page(self):
        old = PAGES["fatek"].replace("=3300", "=3800").replace("=3500", "=3928")
        self.assertEqual(sorted(all_wrong("fatek", old)), list(range(3840, 4100)))
        for line in ("| `plc.process_first`, `plc.status_first` | 3800, 3928 | cbcan |", "| (d) network status: read | 3 | 3928 | 403929 | 44 | R3928 |",
                     "R3839 and DR3839", "write 0 to R4100", "R3840 to R4166"):
            self.assertTrue(all_wrong("fatek", line), line)
        self.assertFalse(all_wrong("fatek", "R3840 to R4167, R4047"))

    def test_other_makers(self):
        for page, line in (("delta", "`K3 K600 D990 K6`"), ("delta", "`BMOV D1296 D600 K17`"), ("delta", "`BMOV D1296 D999 K2`"), ("delta", "`DMOV D999 D0`"),
                           ("mitsubishi", "`H3 K3928 K44 D7960`"),
                           ("omron", "`Registers[1000]` to `Registers[1024]`"), ("omron", "--set plc.status_first=900"), ("openplc", "`%IW99`"),
                           ("openplc", "`%QW1000` to `%QW1024`"), ("siemens", "`P#M4000.0 WORD 70`"), ("siemens", "`P#M0.0 WORD 1`"),
                           ("schneider", "| (d) x | 3 | 3928 | 403929 | 44 | `%MW7990` | scanner |")):
            self.assertTrue(all_wrong(page, line), (page, line))
        for page, first in (("openplc", 1911), ("twincat", 32887), ("siemens", 1), ("codesys", 1)):
            self.assertTrue(wrong(page, placed(page, f"`first = {first}`")[0]), page)


cases.main()
