#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""cbcan-st: programs in Structured Text in the time of a plant, and the search with them.

usage: program_test.py SIMULATOR
"""

import os
import pathlib
import re
from types import SimpleNamespace

from cbcan_plant import GAVE_UP, NotWithin, Plant, Window
from cbcan_st import Program
from cbcan_st.compiled import COMPILERS, available
from cbcan_st.exchange import Address, Exchange, blocks
from cbcan_st.interpreted import Interpreted
from cbcan_st.sources import Sources
import cases
from done import done, ran
from plc import LIBRARY, ROOT
from simulator import LIMIT, program_from_arguments

PROGRAM = program_from_arguments()
CBCAN_ST = ROOT / "tools/python/cbcan-st"
BLOCKS = [LIBRARY / name for name in ("cia405.st", "scanner.st", "openplc.st")]
HERE = pathlib.Path(__file__).resolve().parent
EXPLORE = ROOT / "examples/explore"
TASK = """CONFIGURATION Config0
  {globals}
  RESOURCE Res0 ON PLC
    TASK cyclic (INTERVAL := T#10ms, PRIORITY := 0);
    PROGRAM main WITH cyclic : p;
  END_RESOURCE
END_CONFIGURATION
"""
# Reads or writes 6411h:01 of node 66 by R3700.. and counts its scans.
DIRECT = """PROGRAM p
VAR
  flag AT %MW3700 : WORD; command AT %MW3701 : WORD; node AT %MW3702 : WORD; index AT %MW3703 : WORD; part AT %MW3704 : WORD;
  size AT %MW3705 : UINT; data AT %MW3706 : INT;
END_VAR
VAR
  scans : UINT; last : INT; DONE : BOOL; GAVE_UP : BOOL;
END_VAR
  scans := scans + 1;
  IF scans = 1 THEN
    command := 16#13CA; node := 16#0042; index := 16#6411; part := 16#01; size := 2; data := 300;
    flag := 16#CA0E;
  ELSIF flag <> 16#CA0E THEN
    {end}
  END_IF;
END_PROGRAM
"""


GLOBAL = "VAR_GLOBAL cbcan : CBCAN_WINDOWS; END_VAR"


def direct(end="DONE := TRUE;"):
    return DIRECT.format(end=end) + TASK.format(globals="")


def program(variables, body, globals=""):
    return f"PROGRAM p VAR {variables} END_VAR {body} END_PROGRAM\n{TASK.format(globals=globals)}"


def with_scanner(text):
    return text.replace("    PROGRAM main", "    PROGRAM exchange WITH cyclic : cbcan_exchange;\n    PROGRAM main")


class Programs(cases.Case):
    def run_st(self, *words, plant=("--demo",), code=0):
        """Standard error, and the frames of a run of cbcan-st."""
        log = self.folder / "bus.log"
        ended = done(PROGRAM, *plant, "--clock", "manual", "--log", log, "--", CBCAN_ST, "--engine", "machine", *words, code=code, timeout=LIMIT)
        return ended.stderr, [line.split()[2] for line in log.read_text().splitlines()]

    def run_text(self, text, *options, **arguments):
        return self.run_st(self.write("a.st", text), *options, **arguments)

    def test_a_request_by_words_of_memory(self):
        _, log = self.run_text(direct())
        self.assertEqual(log[-2:], ["642#2B1164012C010000", "5C2#6011640100000000"])

    def test_the_ways_to_end(self):
        self.run_text(direct("GAVE_UP := TRUE;"), code=GAVE_UP)
        self.run_text(direct("GAVE_UP := TRUE; DONE := TRUE;"), code=GAVE_UP)
        _, log = self.run_text(direct(""), "--scans", "3")
        self.assertEqual(log[-1], "5C2#6011640100000000")

    def test_only_changed_words_are_written_so_a_flag_is_one_request(self):
        for fault in ((), ("--fault", "plc:exception after=1 count=1")):  # it keeps CA0Eh in the program until after the result
            _, log = self.run_text(direct("last := data; DONE := scans > 20; IF scans > 9 THEN part := 16#02; END_IF;"), plant=("--demo", *fault))
            self.assertEqual([frame for frame in log if frame.startswith("642#2")], ["642#2B1164012C010000"])

    def test_the_global_of_the_blocks_and_the_scanner_window_send_the_same(self):
        text = program("level : SDO_READ4; DONE : BOOL;", "level(ENABLE := TRUE, TIMEOUT := 1000, DEVICE := 66, INDEX := 16#6401, SUBINDEX := 16#01);"
                       "DONE := level.CONFIRM;", GLOBAL)
        logs = []
        for files, changed in (BLOCKS[:1], text), (BLOCKS, with_scanner(text)):
            logs.append(self.run_st(*files, self.write("a.st", changed))[1])
            window = [3700 in at.registers for at in Interpreted(Sources([*files, str(self.folder / "a.st")])).addresses]
            self.assertEqual(any(window), files == BLOCKS[:1])
        self.assertEqual(logs, 2 * [[*logs[0][:-2], "642#4001640100000000", "5C2#4B01640100000000"]])

    def test_what_the_last_scan_wants_is_sent_by_the_scanner_window(self):
        put = "(ENABLE := {}, TIMEOUT := 1000, DEVICE := 66, INDEX := 16#6200, SUBINDEX := 16#01, DATA := four, DATALENGTH := 1);"
        text = program("one : SDO_WRITE4; two : SDO_WRITE4; four : SDO_DATA4; DONE : BOOL; again : BOOL;",
                       f"one{put.format('NOT again')} IF one.CONFIRM THEN again := TRUE; four[1] := 16#05; END_IF; DONE := again; two{put.format('again')}", GLOBAL)
        self.assertIn("642#2F00620105000000", self.run_st(*BLOCKS, self.write("a.st", with_scanner(text)))[1])

    def test_a_failed_request_keeps_the_inputs_and_a_closed_connection_is_made_again(self):
        for fault in ("exception", "cut", "cut-before", "late"):
            _, log = self.run_text(direct(), plant=("--demo", "--fault", f"plc:{fault} count=1"))
            self.assertEqual(log.count("642#2B1164012C010000"), fault in ("cut", "late"), fault)

    def test_mistakes_and_their_places(self):
        for text, message in (
                (program("x : WORLD;", ""), "a.st:1: WORLD: no such type"),
                ("\n" + program("x AT %IW5 : WORD;", ""), "a.st:2: %IW5: exchanged are %IW100 to 167, %IW168 to 231, %IW232 to 275, %QW100 to "),
                ((LIBRARY / "openplc.st").read_text() + direct(), "a.st:5: no task runs cbcan_exchange; in the CONFIGURATION, PROGRAM exchange WITH"),
                ("PROGRAM p END_PROGRAM", "a CONFIGURATION with a TASK and a PROGRAM is missing; tools/st/configuration.st is one"),
                (program("i : UINT;", "\ni := i - 1;"), "a.st:2: -1: not within UINT")):
            self.assertIn(message, self.run_text(text, code=1)[0])
        self.assertIn("No such file", self.run_st("nowhere.st", code=1)[0])
        alone = ran(CBCAN_ST, self.write("a.st", direct()), env={"PATH": "/usr/bin:/bin"})
        self.assertEqual((alone.returncode, alone.stderr.partition(";")[0]), (1, "cbcan-st: no plant has started this program"))


class Beside(cases.Case):
    """Program, which pytest's fixture `st` is."""

    def start(self, *texts):
        self.plant = self.enterContext(Plant("--demo", program=PROGRAM))
        self.window = self.enterContext(Window(self.plant))
        return self.enterContext(Program(self.plant, *(str(self.write(f"{i}.st", text)) for i, text in enumerate(texts))))

    def test_numbers_and_bits_of_registers(self):
        st = self.start(program(globals="VAR_GLOBAL cbcan : UINT; END_VAR", variables="w AT %MW3711 : WORD; b AT %MX3710.15 : BOOL; r AT %MD3712 : REAL; i AT %MD3714 : DINT; n AT %MW3716 : INT; "
                                "u AT %MD3717 : UDINT; out AT %QX170.3 : BOOL;", body="out := b;"))
        for name, value in (("w", 0xFFFF), ("b", True), ("r", 1.5), ("i", -2), ("n", -3), ("u", 0xFFFFFFFE)):
            st.force(name, value)
        st.scan()
        self.assertEqual(self.window.read(3710, 9), [0x8000, 0xFFFF, 0, 0x3FC0, 0xFFFE, 0xFFFF, 0xFFFD, 0xFFFE, 0xFFFF])
        self.assertEqual(self.window.read(3864), [8])
        for name in "wbrinu":
            st.release(name)
        self.window.write(3710, 0x7FFF, 1, 0, 0xC000, 1, 0x8000, 0x7FFF, 2, 3)
        st.scan()
        self.assertEqual([st[name] for name in "wbrinu"], [1, False, -2.0, -0x7FFFFFFF, 0x7FFF, 0x30002])

    def test_variables_by_name(self):
        st = self.start("TYPE NUMBERS : ARRAY [3..5] OF INT; COLOUR : (RED, GREEN); PAIR : STRUCT A : UINT; B : NUMBERS; END_STRUCT; END_TYPE",
                        program("p : PAIR; c : COLOUR; late : TON; x : UINT;", "late(IN := TRUE, PT := T#25ms); x := x + 1;"))
        st["main.p.b[5]"] = -7
        st["c"], st["MAIN.P.A"] = "GREEN", 4
        self.assertEqual([st["p.B[5]"], st["p.b[3]"], st["main.c"], st["p.a"]], [-7, 0, "GREEN", 4])
        self.assertEqual(st.run("late.Q"), 0.04)  # plant time: scans at 0, 10, 20 and 30 ms
        self.assertEqual(st["late.ET"], 0.025)
        for name, value in (("p.a", -1), ("p.a", True), ("c", "BLUE"), ("late.IN", 1), ("p", 1), ("p.b[3]", 1.5)):
            self.assertRaisesRegex(ValueError, rf"{re.escape(name)}: {value!r} is not a ", st.force, name, value)
        for name in ("y", "p.b[6]", "other.p", "p.a.b", "p.z", "main"):
            self.assertRaisesRegex(LookupError, "no such variable; write main.drive.ins", lambda: st[name])
        self.assertRaisesRegex(NotWithin, "not within 0.1 s", st.run, lambda: st["x"] == 0, within=0.1)

    def test_forced_variables_keep_their_value(self):
        st = self.start(program("x : UINT; y : UINT;", "y := x; x := x + 1;"))
        st["x"] = 5
        st.scan()
        st.force("x", 9)
        st.scan()
        st.scan()
        self.assertEqual([st["x"], st["y"]], [9, 9])
        st.release("x")
        st.scan()
        self.assertEqual([st["x"], st["y"]], [10, 9])


class Engines(cases.Case):
    """MATIEC and STruC++ where they are; tests/st/matiec has a program with its translation by hand, and a replacement of iec2c."""

    FILL = HERE / "matiec/fill.st"

    def environment(self, *folders):
        return os.environ | {"PATH": ":".join([*map(str, folders), "/usr/bin", "/bin"]), "XDG_CACHE_HOME": str(self.folder)}

    def log(self, *words, plant="--demo", **environment):
        log = self.folder / "bus.log"
        done(PROGRAM, *plant.split(), "--clock", "manual", "--log", log, "--", CBCAN_ST, *words, **environment)
        return log.read_bytes()

    def test_the_translation_by_hand_sends_the_same(self):
        tank = f"--config {ROOT}/plants/tank.toml"
        logs = [self.log("--engine", engine, self.FILL, plant=tank, env=self.environment(HERE / "matiec")) for engine in ("machine", "iec2c", "iec2c")]
        self.assertEqual(logs[1:], 2 * logs[:1])
        self.assertGreater(len(logs[0]), 1000)
        self.assertEqual(len([*(self.folder / "cbcan-st").iterdir()]), 1)

    def test_the_search_finds_its_bug(self):
        plant = self.write("plant.toml", f'plant = "{ROOT}/plants/tank.toml"\n[explore]\nalways = "object 20 0x2000 <= 750"\n'
                                         'done = "object 20 0x2000 >= 500"\nsettle = "30s"\n')
        bug = self.write("bug.st", self.FILL.read_text().replace("IF (flag = 16#0000) AND (command <> 16#0000) THEN", "IF TRUE THEN"))
        for program, code, failures in ((self.FILL, 0, 0), (bug, 1, 1)):
            said = done(PROGRAM, "--config", plant, "--explore", "--faults", "request-lost", "--", CBCAN_ST, program,
                        code=code, env=self.environment(HERE / "matiec")).stdout
            self.assertIn(f"distinct failures: {failures}", said)
        self.assertIn("always object 20 0x2000 <= 750: it is 1000.0", said)

    def test_all_engines_send_the_same(self):
        text = program("put : SDO_WRITE4; four : SDO_DATA4; scans : UINT; DONE : BOOL;", """
            scans := scans + 1; four[1] := 16#05;
            put(ENABLE := TRUE, TIMEOUT := 1000, DEVICE := 66, INDEX := 16#6200, SUBINDEX := 16#01, DATA := four, DATALENGTH := 1);
            DONE := put.CONFIRM;""", GLOBAL)
        memory = program("b AT %MX3710.7 : BOOL; r AT %MD3712 : REAL; i AT %MD3714 : DINT; n AT %MW3716 : INT;", "b := NOT b; r := r + 1.5; i := i - 2; n := n - 3;")
        two = memory.replace("    PROGRAM main", "    TASK slow (INTERVAL := T#25ms, PRIORITY := 1);\n    PROGRAM main").replace("WITH cyclic", "WITH slow")
        runs = [([BLOCKS[0], self.write("a.st", text)], []), ([*BLOCKS, self.write("b.st", with_scanner(text))], []), ([*BLOCKS, EXPLORE / "tank.st"], []),
                ([self.write("c.st", memory)], ["--scans", "9"]), ([self.write("d.st", two)], ["--scans", "9"])]
        for engine in filter(available, COMPILERS):
            for files, options in runs:
                frames = [self.log("--engine", name, *options, *files, plant=f"--config {EXPLORE}/tank.toml", env=self.environment(os.environ["PATH"]))
                          for name in ("machine", engine)]
                self.assertEqual(*frames, (engine, files))

    def test_mistakes_and_their_places(self):
        environment = self.environment(self.folder)
        fake = self.write("iec2c", "#!/bin/sh\necho 'program.st:3-5..3-9: error: no' >&2\nexit 1\n")
        fake.chmod(0o755)
        (self.folder / "lib").mkdir()
        files = [self.write("a.st", "PROGRAM p\n"), self.write("b.st", "END_PROGRAM\n")]
        ended = ran(PROGRAM, "--demo", "--clock", "manual", "--", CBCAN_ST, *files, env=environment)
        self.assertEqual((ended.returncode, ended.stderr), (1, f"cbcan-st: iec2c: exit code 1\n{files[1]}:1-5..3-9: error: no\n"))

    def test_plcopen_xml_is_translated_by_xml2st(self):
        file, environment = self.write("plc_program.xml", f"<project/>\n{direct()}"), self.environment(self.folder)
        command = [PROGRAM, "--demo", "--clock", "manual", "--", CBCAN_ST, "--engine", "machine", file]
        self.assertIn("xml2st, which translates PLCopen XML, is not found", ran(*command, env=self.environment()).stderr)
        for script, code, said in (("[ \"$*\" = '--generate-st plc.xml' ] && sed 1d plc.xml >program.st", 0, ""), ("echo why", 1, "has made no program:\nwhy")):
            self.write("xml2st", f"#!/bin/sh\n{script}\n").chmod(0o755)
            self.assertIn(said, done(*command, code=code, env=environment).stderr)

    def test_xml2st_runs_once_and_its_blocks_are_structures_again(self):
        """What xml2st of OpenPLC Editor 4.1.1 makes of types B, A with a B, and an array of A, by its template function_block.st.j2."""
        block = ("FUNCTION_BLOCK {}\n    VAR_INPUT\n        {}\n    END_VAR\n    VAR\n        local_temp : DINT;\n    END_VAR\n    \n"
                 "    local_temp := 0;\nEND_FUNCTION_BLOCK\n\n")
        blocks = block.format("B", "n : UINT := 7;\n        m : BOOL;") + block.format("A", "b : B;")
        script, times, made = self.write("xml2st", f"#!/bin/sh\necho >>{self.folder}/times\ncp {self.folder}/made program.st\n"), self.folder / "times", "made"
        script.chmod(0o755)
        for types, variable in (("TYPE\n  AA : ARRAY [1..2] OF A;\nEND_TYPE\n\n", "x : AA;"), ("", "x : ARRAY [1..2] OF A;")):
            self.write(made, types + blocks + program(f"{variable} DONE : BOOL;", "x[2].b.n := x[1].b.n + 1; DONE := x[2].b.n = 8;"))
            file = self.write("plc.xml", f"<project>{variable}</project>")
            for _ in range(2):
                done(PROGRAM, "--demo", "--clock", "manual", "--", CBCAN_ST, "--engine", "machine", file, env=self.environment(self.folder))
        self.assertEqual(times.read_text(), 2 * "\n")
        self.write(made, program("x : UINT;", "\nx := 70000;"))
        file.write_text("<project/>")
        ended = done(PROGRAM, "--demo", "--clock", "manual", "--", CBCAN_ST, "--engine", "machine", file, code=1, env=self.environment(self.folder))
        self.assertIn("plc.xml as ST:2: 70000: not within UINT", ended.stderr)


class Examples(cases.Case):
    """The programs of examples/explore, and mended ones."""

    def test_each_has_a_bug_that_the_search_finds(self):
        for name, moment, bug, mended, said in (
                ("tank", "66:request-lost@72", "(inlet.CONFIRM OR (inlet.ERROR <> 0));", "inlet.CONFIRM;", "always object 20 0x2000 <= 600: it is 1000.0"),
                ("drive", "16:response-never@10", "value := 16#005F;", "value := 16#001F;", "always object 16 0x6064 <= 8005: it is ")):
            text = (EXPLORE / f"{name}.st").read_text()
            self.assertIn(bug, text)
            for program, code, wanted in ((text, 1, said), (text.replace(bug, mended), 0, "runs: 1, broken: 0")):
                ended = done(PROGRAM, "--config", EXPLORE / f"{name}.toml", "--explore", "--only", moment, "--", CBCAN_ST, *BLOCKS,
                             self.write("a.st", program), code=code)
                self.assertIn(wanted, ended.stdout)


class Parts(cases.Case):
    def test_a_scan_is_one_exchange_and_a_part_ends_with_a_failed_request(self):
        engine = SimpleNamespace(interval=10000, image={501: 7, 3864: 8}, addresses=[Address.of("%QW101"), Address.of("%QW170"), Address.of("%IW100")],
                                 scan=lambda now: None, ended=lambda name: False)
        read, reads = "0302580001", ["modbus", "0302580001"]
        first, second = ["modbus", "100F180001020008"], ["modbus", "1001F50001020007"]
        for written, rest in (("100F180001", [*second, "pass", "10000us", *reads]), ("9004", ["pass", "10000us", *reads])):
            sent, said = [], {read: "03020005", "10000us": "0.01", first[1]: written, second[1]: "1001F50001"}
            plant = SimpleNamespace(now=0.0, send=lambda *lines: sent.append(" ".join(lines).split()), response=lambda line: [said[line.split()[1]]])
            Exchange(plant, engine, alone=True).scan()
            self.assertEqual((sent, engine.image[600]), ([reads, first, rest], 5))

    def test_addresses(self):
        """docs/how-to/plc/openplc.md, schneider.md"""
        for text, registers in (("%IW100", [600]), ("%IW167", [667]), ("%IW168", [3800]), ("%ID230", [3862, 3863]), ("%IW275", [3971]), ("%QW169", [569]),
                                ("%QX170.15", [3864]), ("%MD3706", [3706, 3707]), ("%MW0", [0])):
            self.assertEqual([*Address.of(text).registers], registers, text)
        for text in ("%IW99", "%IW276", "%ID231", "%QW234", "%MD65535", "%MX3700.16"):
            self.assertRaisesRegex(ValueError, f"{text}: exchanged are ", Address.of, text)

    def test_blocks_of_registers(self):
        self.assertEqual(blocks({5, 3, 4, 8}), [range(8, 9), range(3, 6)])
        self.assertEqual(blocks(range(130)), [range(120, 130), range(120)])


cases.main()
