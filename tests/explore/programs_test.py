#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""cbcan-sim --explore and --seeds with PLC programs, correct ones and each with one bug: see plc_programs.cpp."""

import os
import pathlib
import re
import signal
import subprocess
import sys
import tempfile
import unittest
import xml.etree.ElementTree as xml

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests/support"))
sys.path.insert(0, str(ROOT / "tools/python"))
import cases
from cbcan_plant import WRITE, Plant, Window
from simulator import LIMIT, program_from_arguments, wait_until

PROGRAM, PLC = program_from_arguments(sys.argv, 2)
FOLDER = pathlib.Path(__file__).resolve().parent
DRIVE, TANK = FOLDER / "drive.toml", FOLDER / "tank.toml"
ROW = re.compile(r"^(?P<fault>\S.*?)  +(?P<place>\S+) +(?P<numbers>\d+ +\d+ +\d+ +\d+ +\d+)", re.MULTILINE)
COLUMNS = ("tried", "done", "gave up", "broken", "late")


def explore(plant, name, *options, code=0):
    """Standard output; nothing is left of the command afterwards."""
    made = subprocess.run([PROGRAM, *(["--demo"] if plant == "demo" else ["--config", plant]), "--explore", *options, "--", PLC, name], capture_output=True, text=True, timeout=6 * LIMIT)
    assert made.returncode == code, (made.returncode, made.stdout, made.stderr)
    return made.stdout if code != 2 else made.stderr


def rows(output):
    return {(row["fault"], row["place"]): dict(zip(COLUMNS, map(int, row["numbers"].split()))) for row in ROW.finditer(output)}


def count(output, column):
    return sum(row[column] for row in rows(output).values())


def distinct(output):
    return int(re.search(r"distinct failures: (\d+)", output)[1])


class Case(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)


class Programs(Case):
    def test_an_ignored_abort_is_one_failure_and_its_file_fails_the_same(self):
        options = ("--faults", "refuse,request-lost,silent", "--out", self.folder)
        output = explore(DRIVE, "ignored-abort", *options, code=1)
        self.assertEqual(distinct(output), 1)
        self.assertIn("done object 16 0x6081 = 20000: it is 100000", output)
        self.assertEqual(explore(DRIVE, "ignored-abort", *options, code=1), output)
        file = re.search(r"replay: (.*)", output)[1]
        again = explore(file, "ignored-abort", code=1)
        self.assertIn("done object 16 0x6081 = 20000: it is 100000", again)
        self.assertEqual(count(again, "tried"), 1)
        explore(file, "drive")
        with Plant("--config", file, "--http", "127.0.0.1:0", program=PROGRAM) as plant, Window(plant) as window:  # as on the page
            self.assertEqual([window.execute(WRITE, 16, 0x6060, 0, 1, 1), window.execute(WRITE, 16, 0x6081, 0, 4, 20000, 0)], [0, 4])
            self.assertEqual(window.abort, 0x08000020)
        logs = [self.folder / name for name in "ab"]
        for log in logs:
            command = [PROGRAM, "--config", file, "--clock", "manual", "--log", log, "--", PLC, "ignored-abort"]
            self.assertEqual(subprocess.run(command, timeout=LIMIT).returncode, 0)
        self.assertEqual(logs[0].read_bytes(), logs[1].read_bytes())
        self.assertIn(b"581#8081600020000008", logs[0].read_bytes().replace(b"590#", b"581#"))

    def test_a_relative_move_that_is_repeated_is_found(self):
        self.assertIn("always object 16 0x6064 <= 8005: it is ", explore(DRIVE, "relative", "--faults", "response-never", code=1))
        explore(DRIVE, "drive", "--faults", "response-never")

    def test_the_correct_program_is_not_accused(self):
        faults = "response-late,refuse,silent,silent count=0,power for_ms=300,slow,plc-restart"
        self.assertEqual(explore(DRIVE, "drive", "--faults", faults), (FOLDER / "drive_table.txt").read_text())
        if "CBCAN_LONG" in os.environ:
            explore(DRIVE, "drive")

    def test_a_level_that_is_kept_needs_a_fault_that_stays(self):
        explore(TANK, "kept-level", "--faults", "silent")
        self.assertIn("always object 20 0x2000 <= 700", explore(TANK, "kept-level", "--faults", "silent count=0", code=1))
        explore(TANK, "fill", "--faults", "silent count=0")

    def test_a_program_that_gives_up_has_to_survive_some_faults(self):
        power = ("--faults", "power for_ms=300")
        self.assertGreater(count(explore(DRIVE, "gives-up", *power), "gave up"), 0)
        strict = self.folder / "strict.toml"
        strict.write_text(DRIVE.read_text() + 'survive = ["power*", "slow"]\n')
        output = explore(strict, "gives-up", *power, code=1)
        self.assertIn("survive: it gave up", output)
        self.assertEqual(count(output, "gave up"), 0)
        explore(strict, "drive", *power)
        explore(strict, "gives-up", "--faults", "power")  # without limit: nothing survives that
        self.assertIn("survive: it gave up", explore(strict, "no-wait", "--faults", "slow", code=1))
        explore(strict, "drive", "--faults", "slow")

    def test_a_program_that_is_too_quick_fails_with_typical_times(self):
        lost, typical = ("--faults", "request-lost"), ("--timing", "typical")
        explore(DRIVE, "no-wait", *lost)
        self.assertIn("without faults: gave up", explore(DRIVE, "no-wait", *lost, *typical, code=2))
        explore(DRIVE, "drive", *lost, *typical)

    def test_a_second_try_that_is_not_looked_at_needs_two_faults(self):
        lost = ("--faults", "request-lost")
        explore(DRIVE, "second-try", *lost)
        output = explore(DRIVE, "second-try", *lost, "--together", "2", code=1)
        self.assertIn("16:request-lost@2+16:request-lost@3\n  done object 16 0x6081 = 20000: it is 100000", output)
        self.assertEqual(distinct(output), 1)
        explore(DRIVE, "drive", *lost, "--together", "2")


class Refused(Case):
    def test_a_program_that_polls_while_no_time_passes(self):
        self.assertIn("without faults: the program ends: 100000 Modbus requests while no time passed", explore(DRIVE, "polls", code=2))

    def test_a_program_that_fails_without_faults(self):
        self.assertIn("without faults: the exit code is 0 or 75: it is 3", explore(DRIVE, "fails", code=2))

    def test_a_program_that_depends_on_more_than_the_plant(self):
        self.assertRegex(explore("demo", "time-of-day", code=2), "two runs without faults differ, .* one had .* 610#23816000")

    def test_a_program_that_leaves_a_process(self):
        explore("demo", "leaves-a-process", "--faults", "request-lost", "--nodes", "16")
        left = subprocess.run(["pgrep", "-f", f"{PLC} leaves-a-process"], capture_output=True, text=True)
        self.assertEqual(left.stdout, "")

    def test_a_search_that_is_ended_leaves_nothing(self):
        for number in (signal.SIGTERM, signal.SIGKILL):
            search = subprocess.Popen([PROGRAM, "--config", DRIVE, "--explore", "--state", self.folder / f"state{number}", "--", PLC, "drive"],
                                      stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True)
            wait_until(lambda: (self.folder / f"state{number}").exists() and "verdict" in (self.folder / f"state{number}").read_text(), "first run")
            search.send_signal(number)
            search.wait(LIMIT)
            wait_until(lambda: not subprocess.run(["pgrep", "-f", f"{PLC} drive$"], capture_output=True).stdout, "no process")

    def test_mistakes(self):
        for text, message in (("fault = 1", "explore.fault: no such key; did you mean faults?"),
                              ('always = "objekt 16 1 = 1"', "objekt"),
                              ('settle = "5 minutes"', 'write settle = "100ms"'),
                              ('only = "16:silent"', None),
                              ('only = "17:silent"', "17: there is no such node in the plant"),
                              ('only = "silent@3"', "silent@3: must be PLACE:FAULT@NUMBER, such as 16:response-never@149"),
                              ('faults = "sillent"', "did you mean silent?")):
            plant = self.folder / "plant.toml"
            plant.write_text(f'plant = "demo"\n[explore]\n{text}\n')
            output = explore(plant, "drive", "--list", code=0 if message is None else 2)
            if message:
                self.assertIn(message, output)


class TheSameTable(Case):
    OPTIONS = ("--faults", "refuse,request-lost")

    def test_with_any_number_of_jobs_parts_and_pauses(self):
        whole = explore(DRIVE, "ignored-abort", *self.OPTIONS, "-j", "1", code=1)
        self.assertEqual(explore(DRIVE, "ignored-abort", *self.OPTIONS, "-j", "8", code=1), whole)
        parts = [subprocess.run([PROGRAM, "--config", DRIVE, "--explore", *self.OPTIONS, "--shard", f"{part}/3", "--", PLC, "ignored-abort"],
                                capture_output=True, text=True, timeout=LIMIT).stdout for part in (1, 2, 3)]
        joined = {key: {column: sum(rows(part).get(key, row)[column] if key in rows(part) else 0 for part in parts) for column in COLUMNS}
                  for key, row in rows(whole).items()}
        self.assertEqual(joined, rows(whole))
        state = ("--state", self.folder / "state")
        first = subprocess.run([PROGRAM, "--config", DRIVE, "--explore", *self.OPTIONS, *state, "--budget", "100ms", "--junit",
                                self.folder / "results.xml", "--", PLC, "ignored-abort"], capture_output=True, text=True, timeout=LIMIT)
        self.assertRegex(first.stdout, r"not tried: \d+")
        self.assertTrue(list(xml.parse(self.folder / "results.xml").iter("skipped")))
        self.assertEqual(explore(DRIVE, "ignored-abort", *self.OPTIONS, *state, code=1), whole)
        self.assertIn("is of another program, plant, command or version", explore(DRIVE, "drive", *self.OPTIONS, *state, code=2))

    def test_junit(self):
        explore(DRIVE, "ignored-abort", *self.OPTIONS, "--junit", self.folder / "results.xml", code=1)
        results = {f'{case.get("classname")}/{case.get("name")}': [child.tag for child in case] for case in xml.parse(self.folder / "results.xml").iter("testcase")}
        self.assertEqual(results, {"16/refuse": ["failure"], "16/request-lost": ["failure"]})


class Seeds(Case):
    def test_of_a_command(self):
        command = [PROGRAM, "--config", DRIVE, "--fault", "16:request-lost probability=0.3 index=0x6081"]
        made = subprocess.run([*command, "--seeds", "1..20", "--", PLC, "ignored-abort"], capture_output=True, text=True, timeout=LIMIT)
        self.assertEqual(made.returncode, 1, made.stderr)
        found = re.search(r"with (\d+) of 20 seeds:((?: \d+)+)", made.stdout)
        failed = [int(seed) for seed in found[2].split()]
        self.assertTrue(1 < int(found[1]) < 19, made.stdout)
        self.assertIn(f"replay: cbcan-sim ... --seeds {failed[0]} -- {PLC} ignored-abort", made.stdout)
        self.assertIn("done object 16 0x6081 = 20000: it is 100000", made.stdout)
        for seed in range(1, failed[1] + 1):
            again = subprocess.run([*command, "--seeds", str(seed), "--", PLC, "ignored-abort"], capture_output=True, text=True, timeout=LIMIT)
            self.assertEqual(again.returncode, int(seed in failed), again.stdout)


if __name__ == "__main__":
    cases.main()
