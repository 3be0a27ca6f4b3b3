#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Checks docs/how-to/plc: each page has the same parts, its numbers are those of the register table (or a maker's, listed here), each setting has a
source, and the requests of its table work with cbcan-sim.

usage: plc_pages.py PROGRAM_DIR
"""

import functools
import json
import pathlib
import re
import struct

import cases
import page_blocks
from done import output
from owned_registers import OwnedRegisters
from simulator import Simulator, program_from_arguments, wait_until
from cbcan_st.machine import Machine
from tree import ROOT

BIN = pathlib.Path(program_from_arguments())
PAGES = {path.stem: path.read_text() for path in sorted((ROOT / "docs/how-to/plc").glob("*.md"))}
COMMON = PAGES.pop("README")  # what holds for every controller
TABLE = json.loads(output(BIN / "cbcan-regmap", "json"))
GROUPS = "registers", "scanner", "process_data", "status"
FIRST = {row["name"]: row["first"] for rows in GROUPS for row in TABLE[rows]}
LAST = {row["name"]: row["last"] for rows in GROUPS for row in TABLE[rows]}

MAKERS = {"codesys", "delta", "fatek", "mitsubishi", "omron", "openplc", "rockwell", "schneider", "siemens", "twincat"}
HEADINGS = ["Jobs", "Settings", "Addresses", "Timeouts", "Traps"]  # the last two if there is more than in COMMON
COLUMNS = ["Job", "FC", "Start", "4xxxxx", "Words"]
START_NODE = [5066, 0, 0x1F82, 66, 1, 5]  # words 1 to 6 of the page's check
DONE = "NMT Start Remote Node: node 66: done"


def words_from(first, last):
    return FIRST[first], LAST[last] - FIRST[first] + 1


BLOCKS = {  # each row of the table: the first register and the number of words
    "(a) scanner window: write OUT": words_from("OUT_NUMBER", "OUT_DATA"),
    "(a) read IN": words_from("IN_NUMBER", "IN_DATA"),
    "(b) R3700: write request": words_from("EXECUTE_FLAG", "DATA"),
    "(b) read result": words_from("EXECUTE_FLAG", "DATA"),
    "(c) process data: write outputs": words_from("OUTPUTS", "OUTPUTS"),
    "(c) read inputs": words_from("INPUTS", "INPUTS"),
    "(d) network status: read": words_from("STATUS", "LOST"),
}
HEADER = {"(a) s": FIRST["OUT_DATA"] - FIRST["OUT_NUMBER"], "(a) r": FIRST["IN_DATA"] - FIRST["IN_NUMBER"]}
SHORT = [HEADER["(a) s"] + 2, HEADER["(a) r"] + 2, 8, 8, 8, 8, 4]  # Delta: objects of four bytes, and the summary of the status

BOTH_BY_23 = {"schneider": {"(a)", "(c)"}, "twincat": {"(a)"}}  # one request writes and reads

# What else a page has in numbers of three digits or more, or hexadecimal ones: from the manuals that it names, or of the simulator.
NUMBER = re.compile(r"(?:0x|16#)[0-9A-F]+|[0-9A-F]{4}h\b|\b\d[0-9A-F]{3}\b|\d{3,6}")
EVERYWHERE = "1502 CA0Eh"
OTHERS = {
    "codesys": "",
    "delta": "100 19200 1143 1120 1122 1127 150 604 605 200 1296 1311 507 707 747",
    "fatek": "150 19200 502 574 3701 3706 3707 40001 3300 3500 3840 4047 4167",
    "mitsubishi": "125 123 8412 8432 3000 19200 502 604 605 200",
    "omron": "1023 102 502 200 400",
    "openplc": "1000 100 164",
    "rockwell": "502 3702 5055 3701 0x3001 13810 32767 32768",
    "schneider": "241 251 340 580 1000 255 65535 120 123 125 100",
    "siemens": "1200 1500 123 125 255 1000 7001 7002 80A3 80C8 8200 8383 40001 400001",
    "twincat": "6250 502 16#FF 128 125 121",
}
PLACES = {  # settings that repeat a row's numbers: a pattern, and what its groups are
    "twincat": [(r"`nMBWriteAddr`, `nWriteQuantity` \| (\d+), (\d+)", "w"), (r"`cbSrcLength`, `pSrcAddr` \| (\d+)", "2w"),
                (r"`nMBReadAddr`, `nReadQuantity` \| (\d+), (\d+)", "r"), (r"`cbDestLength`, `pDestAddr` \| (\d+)", "2r")],
    "schneider": [(r"READ: Offset, Length \| (\d+), (\d+)", "r"), (r"WRITE: Offset, Length \| (\d+), (\d+)", "w"),
                  (r"RD ref, length; WR ref, length \| (\d+), (\d+); ", "r"), (r"RD ref.*?; (\d+), (\d+);", "w"),
                  (r"'%MW', (\d+), (\d+), mgmt", "r"), (r"FirstObj, Quantity, Buffer \| MW, (\d+), (\d+) ", "b")],
    "openplc": [(r'offset "(0x\w+)", iec_location "%IW100", len (\d+)', "r"), (r'offset "(0x\w+)", iec_location "%QW100", len (\d+)', "w")],
}
KEY_OF_PLACE = {"w": "(a) scanner window: write OUT", "r": "(a) read IN", "b": "(b) R3700: write request"}


def section(page, heading):
    return re.search(rf"^## {heading}\n(.*?)(?=^## |\Z)", PAGES[page], re.MULTILINE | re.DOTALL)[1]


def plain(text):
    return re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", text)


def rows(page, heading):
    """Cells of a section's table, without links; the heading first."""
    lines = [line for line in section(page, heading).splitlines() if line.startswith("|") and not line.startswith("|---")]
    return [[cell.strip() for cell in plain(line).strip("|").split(" | ")] for line in lines]


def jobs(page):
    """(job, function code, start, words, the maker's cells) for each row."""
    return [(name, int(code), int(start), int(words), rest) for name, code, start, _, words, *rest in rows(page, "Jobs")[1:]]


def starts(page):
    return {name: start for name, _, start, _, _ in jobs(page)}


def plc_settings(page):
    """The options about `plc` in the page's command, and the settings themselves."""
    options = re.findall(r"--set (plc\.\w+)=(\w+)", section(page, "Settings"))
    return [word for key, value in options for word in ("--set", f"{key}={value}")], dict(options)


def in_the_plc(page, form):
    """The module as client: OUT, then IN 70 further; process data has inputs first."""
    settings = plc_settings(page)[1]
    process = int(settings["plc.process_first"])
    first = int(settings.get("plc.first", 500))  # FATEK's page names 500 for (a)
    outputs = process + FIRST["OUTPUTS"] - FIRST["INPUTS"]
    window = form.format(FIRST["EXECUTE_FLAG"]) if "plc.first" not in settings else "none, use (a)"
    return [form.format(first), form.format(first + LAST["OUT_DATA"] - FIRST["OUT_NUMBER"] + 1), window, window,
            form.format(outputs), form.format(process), form.format(settings["plc.status_first"])]


def located(page):
    """Words follow one another, from %QW100 and %IW100 on."""
    at, cells = {"%Q": 100, "%I": 100}, []
    for name, _, _, words, _ in jobs(page):
        area = "%Q" if "write" in name else "%I"
        cells.append("Beremiz only" if "(b)" in name else f"`{area}W{at[area]}` to `{area}W{at[area] + words - 1}`")
        at[area] += 0 if "(b)" in name else words
    return cells


def makers_numbers(page):
    """What the maker's columns have to contain, in order of the rows."""
    each = {
        "codesys": lambda name, code, start, words: ("Write Multiple" if code == 16 else "Read Holding") + " Registers "
        + ("Application" if "(b)" in name else "Cyclic"),
        "twincat": lambda name, code, start, words: str(2 * words),
        "siemens": lambda name, code, start, words: f"{int(code == 16)} {TABLE['registers'][0]['modicon'] - 3700 + start}",
        "schneider": lambda name, code, start, words: f"`%MW{start}`",
        "rockwell": lambda name, code, start, words: f"INT[{words}]`",
        "mitsubishi": lambda name, code, start, words: f"`H{code:X} K{start} K{words} D{start}`",
        "delta": lambda name, code, start, words: f"`K{code} K{start} D",
    }
    if page in each:
        return [each[page](*row[:4]) for row in jobs(page)]
    return located(page) if page == "openplc" else in_the_plc(page, "`Registers[{}]`" if page == "omron" else "R{}")


def explained(page):
    """Numbers that follow from the table, and those in the lists above."""
    derived = {str(number) for _, _, start, words, _ in jobs(page) for number in (start, words, words - 1, 2 * words)}
    return derived | {f"0x{start:04X}" for start in starts(page).values()} | set(f"{EVERYWHERE} {OTHERS[page]}".split())


def of_each_page(check):
    @functools.wraps(check)
    def run(self):
        for page in PAGES:
            with self.subTest(page):
                check(self, page)
    return run


class Parts(cases.Case):
    def test_ten_pages_with_the_same_headings(self):
        self.assertEqual(set(PAGES), MAKERS)
        for page, text in PAGES.items():
            found = re.findall("^## (.*)", text, re.MULTILINE)
            self.assertEqual(found, HEADINGS[:3] + [heading for heading in HEADINGS[3:] if heading in found], page)
            self.assertIn("\n\nFor every controller: [timeouts, traps, check](README.md).\n\n", text, page)
            self.assertIn(f"]({page}.md)", COMMON)

    @of_each_page
    def test_the_table_of_jobs(self, page):
        heading, *table = rows(page, "Jobs")
        self.assertEqual(heading[:5], COLUMNS)
        self.assertEqual([row[0] for row in table], list(BLOCKS))
        for (name, (start, words)), short, row in zip(BLOCKS.items(), SHORT, table):
            code = 23 if name[:3] in BOTH_BY_23.get(page, ()) else 16 if "write" in name else 3
            self.assertEqual(row[1:5], [str(code), str(start), str(400001 + start), str(short if page == "delta" else words)], name)

    @of_each_page
    def test_the_maker_s_columns(self, page):
        for (name, *_, cells), wanted in zip(jobs(page), makers_numbers(page), strict=True):
            self.assertIn(wanted, " ".join(cells), name)

    def test_delta_s_areas_do_not_overlap(self):
        """A reading MODRW puts the response into S, a byte in each register; its words, at most 16, are in D1296 and following."""
        responses, taken = set(), []
        for name, code, _, words, (modrw, then) in jobs("delta"):
            first, count = re.fullmatch(r"`K\d+ K\d+ D(\d+) K(\d+)`", modrw).groups()
            self.assertEqual(int(count), words, name)
            if code == 3:
                responses |= set(range(int(first), int(first) + 3 + 2 * words + 2))
                first, = re.fullmatch(rf"`BMOV D1296 D(\d+) K{words}`", then).groups()
                self.assertLessEqual(words, 1311 - 1296 + 1, name)
            taken += range(int(first), int(first) + words)
        self.assertEqual(len(taken), len(set(taken)))
        self.assertEqual(responses & set(taken), set())

    def test_no_function_code_carries_more(self):
        clients = (ROOT / "docs/how-to/modbus-clients.md").read_text()
        most = {3: int(re.search(r"\| 3 \|.*\| (\d+) \|", clients)[1]), 16: int(re.search(r"\| 16 \|.*\| (\d+) \|", clients)[1])}
        read, written = map(int, re.search(r"\| 23 \|.*\| (\d+) read, (\d+) written \|", clients).groups())
        self.assertEqual((most, read, written), ({3: 125, 16: 123}, 125, 121))  # Modbus Application Protocol V1.1b3, 6.3, 6.12, 6.17
        for page in PAGES:
            told = re.findall(r"at most (\d+)(?: words)? a read, (\d+) a write", PAGES[page])
            for name, code, _, words, _ in jobs(page):
                limits = [most.get(code, written if "write" in name else read), *(int(pair["write" in name]) for pair in told)]
                self.assertLessEqual(words, min(limits), name)

    @of_each_page
    def test_every_other_number_is_explained(self, page):
        text = plain(re.sub(r"^\| \([a-d]\).*\n|192\.168\.1\.5|cia405", "", PAGES[page], flags=re.MULTILINE))
        found = set(NUMBER.findall(text))
        self.assertEqual(sorted(found - explained(page)), [])
        self.assertEqual(sorted(set(OTHERS[page].split()) - found), [], "no longer on the page")

    def test_settings_that_repeat_a_row(self):
        for page, places in PLACES.items():
            for pattern, place in places:
                with self.subTest((page, pattern)):
                    groups = [int(group, 0) for group in re.search(pattern, PAGES[page]).groups()]
                    start, words = BLOCKS[KEY_OF_PLACE[place[-1]]]
                    self.assertEqual(groups, [2 * words] if place[0] == "2" else [start, words])

    @of_each_page
    def test_every_setting_has_a_source(self, page):
        before = PAGES[page].partition("\n## ")[0]
        named = set(re.findall(r"\*\*([A-Z])\*\*: ", before))
        sources = [row[-1] for row in rows(page, "Settings")[1:]]
        used = {source for source in sources if len(source) == 1} | set(re.findall(r"\(([A-Z])\)", PAGES[page]))
        self.assertEqual(used, named)
        self.assertLessEqual(set(sources), named | {"cbcan", "not verified"})
        self.assertTrue(named or "**not verified**" in before)

    @of_each_page
    def test_one_screen(self, page):
        self.assertLessEqual(len(PAGES[page].splitlines()), 85)


class Words(cases.Case):
    def value_of(self, expression, name, first):
        """What a PLC gets from these words of the array by the page's expression."""
        declared = f"TYPE WORDS : ARRAY [0..1023] OF WORD; END_TYPE PROGRAM p VAR {name} : WORDS; i : UINT; d : DWORD; u : UDINT; END_VAR"
        text = f"{declared} {name}[{first}] := 16#CD15; {name}[{first + 1}] := 16#075B; d := {expression}; u := DWORD_TO_UDINT(d); END_PROGRAM\n"
        machine = Machine(("p.st", text), ("c.st", "CONFIGURATION c RESOURCE r ON PLC TASK t (INTERVAL := T#10ms, PRIORITY := 0); "
                                           "PROGRAM main WITH t : p; END_RESOURCE END_CONFIGURATION\n"))
        machine.scan(0)
        return machine.programs["MAIN"][1]["U"]

    def test_expressions_take_the_low_word_first(self):
        tried = set()
        for page in PAGES:
            for found in re.findall(r"`(SHL\([^`]*)`", section(page, "Addresses")):
                expression = re.sub(r"#|IN := |\bN := ", "", " ".join(found.split()))
                name = re.search(r"(\w+)\[", expression)[1]
                first = HEADER["(a) r"] + (70 if name == "Registers" else 0)  # where --plc has IN
                self.assertEqual(self.value_of(expression, name, first), 123456789, page)  # 075BCD15h
                tried.add(page)
        self.assertEqual(tried, {"codesys", "omron", "openplc", "schneider", "siemens", "twincat"})

    def test_pairs_of_registers(self):
        data = HEADER["(a) r"]
        for page in ("mitsubishi", "delta"):
            self.assertIn(f"`DMOV D{starts(page)['(a) read IN'] + data} D200`", PAGES[page])
        self.assertIn(f"`COP(In[{data}], Value, 1)`", PAGES["rockwell"])
        self.assertIn(f"`INT_AS_DINT(ins[{data}], ins[{data + 1}])`", PAGES["schneider"])
        self.assertIn(f"DR{FIRST['DATA']}", PAGES["fatek"])
        at, = (int(cells[0][1:]) for name, *_, cells in jobs("fatek") if name == "(a) read IN")
        self.assertIn(f"it is DR{at + data}", PAGES["fatek"])

    def test_rockwell_s_signed_words(self):
        signed, = struct.unpack(">h", struct.pack(">H", TABLE["execute"]))
        self.assertIn(f"CA0Eh is {signed}, and a number of the scanner window after 32767 is -32768", " ".join(PAGES["rockwell"].split()))


class Played(cases.Case):
    """The check of every controller, with a client that does what the page's table says."""

    def start(self, *options):
        return Simulator(BIN / "cbcan-sim", "--demo", "-v", *options, test=self)

    def ctl(self, simulator, *arguments):
        return output(BIN / "cbcanctl", "--modbus", f":{simulator.port}", *arguments)

    def started(self, simulator, times):
        wait_until(lambda: "\n".join(simulator.errors()).count(DONE) == times, DONE)
        self.assertEqual(self.ctl(simulator, "state", "66"), "66 Operational\n")

    def exchange(self, window, write, read, words):
        """Writes the row's words, the rest 0; returns the words of the other row."""
        (_, code, start, count, _), (_, read_code, read_start, read_count, _) = write, read
        block = [*words, *[0] * (count - len(words))]
        if code != 23:
            window.write(start, block)
            return window.read(read_start, read_count)
        pdu = struct.pack(f">BHHHHB{count}H", 23, read_start, read_count, start, count, 2 * count, *block)
        response = window.request(pdu)
        self.assertEqual((response[:2], read_code), (bytes([23, 2 * read_count]), 23))
        return list(struct.unpack(f">{read_count}H", response[2:]))

    def test_clients(self):
        for page in sorted(MAKERS):
            with self.subTest(page):
                simulator, (out, into, request, result, outputs, inputs, status) = self.start(), jobs(page)
                with simulator.window() as window:
                    for number, wanted in ((1, 5), (2, 0)):  # the module has just started
                        wait_until(lambda: self.exchange(window, out, into, [number, *START_NODE])[:2] == [number, wanted], f"result {wanted}")
                    self.started(simulator, 1)
                    self.exchange(window, request, result, [0xCA0E, *START_NODE])
                    wait_until(lambda: window.read(*result[2:4])[0] == 0, "result 0")
                    self.started(simulator, 2)
                    self.assertEqual(len(self.exchange(window, outputs, inputs, [])), inputs[3])
                    self.assertEqual(len(window.read(*status[2:4])), status[3])
                    self.ctl(simulator, "nmt", "start", "127")
                    self.assertEqual(self.ctl(simulator, "state", "127"), "127 Operational\n")
                simulator.stop()

    def test_a_plc_that_is_the_server(self):
        for page, at, numbers, result in (("omron", 0, (1, 2), 70), ("fatek", 3700, (0xCA0E,), 3700)):
            with self.subTest(page):
                plc = OwnedRegisters()
                simulator = self.start("--plc", f"127.0.0.1:{plc.port}", *plc_settings(page)[0])
                for number in numbers:
                    with plc.changed:
                        plc.write(at + 1, START_NODE)
                        plc.write(at, [number])
                    wait_until(lambda: plc.read(result, 1)[0] == (number if at == 0 else 0), "a result in the PLC")
                self.started(simulator, 1)
                state = int(plc_settings(page)[1]["plc.status_first"]) + FIRST["NODE_STATUS"] - FIRST["STATUS"] + 66
                wait_until(lambda: plc.read(state, 1)[0] == 5, "Operational in the PLC")
                simulator.stop()

    def test_inputs_in_variables(self):
        """OpenPLC's program, with (c) and (d) as its devices."""
        machine = Machine(("process_data.st", (ROOT / "tools/st/process_data.st").read_text()))
        program, values = machine.programs["MAIN"]
        simulator = self.start("--network-file", ROOT / "plants/demo/network.toml", "--set", "node.66.signals+={index=0x6000,sub=1,shape='constant',value=90}")
        inputs, status, outputs = (BLOCKS[key] for key in ("(c) read inputs", "(d) network status: read", "(c) process data: write outputs"))

        def exchange(window):
            words = window.read(*inputs) + window.read(*status)
            values.update((name, words[int(address[3:]) - 100]) for address, name in program.located.items() if address[1] == "I")
            machine.scan(0)
            image = {address: values[name] for address, name in program.located.items()}
            window.write(outputs[0], [image.get(f"%QW{100 + place}", 0) for place in range(outputs[1])])
            return image["%QW100"]

        with simulator.window() as window:
            wait_until(lambda: exchange(window) == 90, "an input in a variable")
            wait_until(lambda: self.ctl(simulator, "read", "66", "0x6200", "1", "--type", "u8") == "90\n", "an output in the node")
        simulator.stop()

    def test_how_to_find_where_an_instruction_counts_from(self):
        simulator = self.start()
        command, = re.findall(r"`cbcanctl (read [^`]*)` R3701 is 5055", PAGES["rockwell"])
        self.ctl(simulator, *command.split())
        with simulator.window() as window:
            self.assertEqual(window.read(3701, 1), [5055])

    def test_the_check_says_so(self):
        words = "5066, 0, 1F82h, 66, 1, 5 into words 1 to 6, then the next number in (a), CA0Eh in (b), into word 0"
        self.assertIn(f"Put {words}. `-v` prints `{DONE}`, and `cbcanctl state 66` `66 Operational`.", " ".join(COMMON.split()))
        for page in PAGES:
            languages = [block.language for block in page_blocks.blocks(ROOT / f"docs/how-to/plc/{page}.md")]
            self.assertEqual(languages, ["sh"] * (page in ("openplc", "fatek", "omron")), page)


cases.main()
