#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""cbcan-sim --explore and --seeds with PLC programs, correct ones and each with one bug: see plc_programs.cpp."""

import json
import os
import pathlib
import re
import resource
import signal
import subprocess
import sys
import xml.etree.ElementTree as xml

from tree import ROOT
sys.path.insert(0, str(ROOT / "tools/python"))
import cases
from cbcan_plant import WRITE, Plant, Window
from done import done, ran
from simulator import LIMIT, program_from_arguments, wait_until

PROGRAM, PLC, IMPATIENT = program_from_arguments(3)
FOLDER = pathlib.Path(__file__).resolve().parent
DRIVE, TANK, SCANS = (FOLDER / f"{name}.toml" for name in ("drive", "tank", "scans"))
ROW = re.compile(r"^(?P<fault>\S.*?)  +(?P<place>\S+) +(?P<numbers>\d+ +\d+ +\d+ +\d+ +\d+)", re.MULTILINE)
COLUMNS = ("tried", "done", "gave up", "broken", "late")


def explore(plant, name, *options, code=0):
    """Standard output; nothing is left of the command afterwards."""
    where = ["--demo"] if plant == "demo" else ["--config", plant]
    made = done(PROGRAM, *where, "--explore", *options, "--", PLC, name, code=code, timeout=6 * LIMIT)
    return made.stdout if code != 2 else made.stderr


def explore_command(command, *options, plant=DRIVE, program=PROGRAM):
    return ran(program, "--config", plant, "--explore", *options, "--", *command, errors="replace", timeout=6 * LIMIT)


def elements(path):
    """Of each test case in a JUnit file: the tag in it, if any."""
    return {case.get("name"): [child.tag for child in case] for case in xml.parse(path).iter("testcase")}


def rows(output):
    return {(row["fault"], row["place"]): dict(zip(COLUMNS, map(int, row["numbers"].split()))) for row in ROW.finditer(output)}


def count(output, column):
    return sum(row[column] for row in rows(output).values())


def distinct(output):
    return int(re.search(r"distinct failures: (\d+)", output)[1])


class Programs(cases.Case):
    def test_an_ignored_abort_is_one_failure_and_its_file_fails_the_same(self):
        options = ("--faults", "refuse,request-lost,silent", "--out", self.folder)
        output = explore(DRIVE, "ignored-abort", *options, code=1)
        self.assertEqual(distinct(output), 1)
        self.assertIn("done object 16 0x6081 = 20000: it is 100000", output)
        self.assertEqual(explore(DRIVE, "ignored-abort", *options, code=1), output)
        file = re.search(r"replay: (.*)", output)[1]
        self.assertEqual(pathlib.Path(file).read_text().splitlines()[1:3],
                         [f"# PYTHONPATH={os.environ['PYTHONPATH']} cbcan-sim --config {file} --explore -- {PLC} ignored-abort",
                          f'plant = "{os.path.relpath(DRIVE, self.folder)}"'])
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
        explore(DRIVE, "drive")

    def test_the_order_of_faults_does_not_matter(self):
        tables = [rows(explore(DRIVE, "drive", "--faults", faults)) for faults in ("refuse,slow", "slow,refuse")]
        self.assertEqual(tables[0], tables[1])
        self.assertEqual(tables[0]["refuse", "16"]["tried"], 13)

    def test_a_level_that_is_kept_needs_a_fault_that_stays(self):
        explore(TANK, "kept-level", "--faults", "silent")
        self.assertIn("always object 20 0x2000 <= 700", explore(TANK, "kept-level", "--faults", "silent count=0", code=1))
        explore(TANK, "fill", "--faults", "silent count=0")

    def test_a_program_that_gives_up_has_to_survive_some_faults(self):
        power = ("--faults", "power for_ms=300")
        self.assertGreater(count(explore(DRIVE, "gives-up", *power), "gave up"), 0)
        strict = self.write("strict.toml", DRIVE.read_text() + 'survive = ["power*", "slow"]\nadvice = "ignore"\n')
        output = explore(strict, "gives-up", *power, code=1)
        self.assertIn("survive: it gave up", output)
        self.assertEqual(count(output, "gave up"), 0)
        explore(strict, "drive", *power)
        explore(strict, "gives-up", "--faults", "power")  # without limit: nothing survives that
        self.assertIn("survive: it gave up", explore(strict, "no-wait", "--faults", "slow", code=1))
        explore(strict, "drive", "--faults", "slow")

    def test_typical_times_are_a_row_of_every_search(self):
        quick = self.write("quick.toml", DRIVE.read_text() + 'advice = "statusword"\n')
        options = ("--faults", "slow,typical", "--junit", self.folder / "junit.xml", "--out", self.folder / "out")
        self.assertEqual(rows(explore(DRIVE, "drive", *options))["typical", "all"], dict(zip(COLUMNS, (1, 1, 0, 0, 0))))
        self.assertEqual(elements(self.folder / "junit.xml"), {"slow": [], "typical": []})
        output = explore(quick, "no-wait", *options, code=1)
        self.assertIn("\nall:typical\n  survive: it gave up\n", output)
        self.assertEqual(elements(self.folder / "junit.xml"), {"slow": [], "typical": ["failure"]})
        self.assertEqual(explore(quick, "no-wait", *options, "--jobs", "1", code=1), output)
        file = re.search(r"replay: (.*)", output)[1]
        self.assertIn("runs: 1, broken: 1", explore(file, "no-wait", code=1))
        explore(file, "drive")
        self.assertIn("runs: 1, broken: 1", explore(quick, "no-wait", "--only", "all:typical", code=1))
        self.assertEqual(done(PROGRAM, "--config", quick, "--clock", "manual", "--only", "all:typical", "--", PLC, "no-wait", code=75).stdout, "")

    def test_typical_times_that_are_left_out(self):
        self.assertEqual(explore(DRIVE, "drive", "--list").splitlines()[0], "all:typical")
        for options in (("--faults", "slow"), ("--timing", "typical"), ("--timing", "at-once"), ("--set", "node.66.timing=typical")):
            self.assertNotIn("typical", explore(DRIVE, "drive", "--list", *options))
        self.assertIn("faults: typical: the plant sets timing itself", explore(DRIVE, "drive", "--faults", "typical", "--timing", "typical", code=2))

    def test_typical_times_in_parts_in_pairs_and_kept(self):
        options, state = ("--faults", "slow,typical,refuse"), self.folder / "state"
        parts = [explore(DRIVE, "drive", *options, "--shard", f"{part}/3") for part in (1, 2, 3)]
        self.assertEqual(sum(("typical", "all") in rows(part) for part in parts), 1)
        kept = [explore(DRIVE, "drive", *options, "--state", state) for _ in range(2)]
        self.assertEqual(kept, 2 * [explore(DRIVE, "drive", *options)])
        self.assertEqual(state.read_text().count('["all:typical",'), 1)
        pairs = explore(DRIVE, "drive", "--faults", "typical,refuse", "--together", "2")
        self.assertEqual(rows(pairs)["typical", "all"]["tried"], 1)
        self.assertGreater(rows(pairs)["typical + refuse", "all+16"]["tried"], 0)

    def test_a_program_that_is_too_quick_fails_with_typical_times(self):
        lost, typical = ("--faults", "request-lost"), ("--timing", "typical")
        self.assertIn("without faults: advice statusword: 06h, 07h and 0Fh were written", explore(DRIVE, "no-wait", *lost, code=2))
        others = self.write("others.toml", DRIVE.read_text() + 'advice = ["busy", "unread"]\n')
        self.assertIn("without faults: advice statusword: ", explore(others, "no-wait", *lost, code=2))
        this = self.write("this.toml", DRIVE.read_text() + 'advice = "statusword"\n')
        explore(this, "no-wait", *lost)
        self.assertIn("without faults: gave up", explore(this, "no-wait", *lost, *typical, code=2))
        explore(DRIVE, "drive", *lost, *typical)

    def test_a_second_try_that_is_not_looked_at_needs_two_faults(self):
        lost = ("--faults", "request-lost")
        explore(DRIVE, "second-try", *lost)
        output = explore(DRIVE, "second-try", *lost, "--together", "2", code=1)
        self.assertIn("16:request-lost@2+16:request-lost@3\n  done object 16 0x6081 = 20000: it is 100000", output)
        self.assertEqual(distinct(output), 1)
        explore(DRIVE, "drive", *lost, "--together", "2")


class Cyclic(cases.Case):
    """A program that never ends, with a scan in one exchange."""

    def test_it_is_ended_and_judged_and_each_repeat_is_one_failure(self):
        faults = ("--faults", "response-never,silent count=0")
        self.assertEqual(count(explore(SCANS, "scans", "--faults", "response-*,refuse,cut,cut-before"), "broken"), 0)
        output = explore(SCANS, "scans-blindly", *faults, code=1)
        self.assertEqual(output, explore(SCANS, "scans-blindly", *faults, "--jobs", "1", code=1))
        self.assertGreater(count(output, "broken"), 50)
        self.assertEqual(distinct(output), 1)
        self.assertIn("66:silent count=0@1\n  always object 20 0x2000 <= 700: it is ", output)
        self.assertIn("  in: read node 66 6401h:01\n", output)  # whatever the level was

    def test_faults_come_up_to_its_end_and_then_it_settles(self):
        last = lambda output: max(int(moment.rsplit("@", 1)[1]) for moment in output.split())
        listed = [last(explore(self.write("plant.toml", SCANS.read_text().replace("../../plants", str(ROOT / "plants")).replace('"20s"', f'"{ends}"\nsettle = "{settle}"')),
                               "scans", "--faults", "request-lost", "--list")) for ends, settle in (("20s", "5s"), ("20s", "15s"), ("25s", "0s"))]
        self.assertEqual(listed[0], listed[1])
        self.assertEqual(listed[2], listed[0] + 50)  # a request in each scan of 100 ms

    def test_a_moment_of_the_plc_shows_its_request(self):
        output = explore(DRIVE, "ignored-abort", "--faults", "cut-before", code=1)
        self.assertRegex(output, r"plc:cut-before@\d+\n  done .*\n  in: .*\n  fault in: FC16 R3700..R3701 = 0 119\n")


class Refused(cases.Case):
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
                              ('always = "objekt 16 1 = 1"', "plant.toml:3: explore.always: \"objekt\""),
                              ('reached = "object 16 0x9999 = 1"', "plant.toml:3: explore.reached: 9999h:00: node 16 has no such object"),
                              ('settle = "5 minutes"', 'write settle = "100ms"'),
                              ('only = "16:silent"', None),
                              ('only = "17:silent"', "17: there is no such node in the plant"),
                              ('only = "silent@3"', "silent@3: must be PLACE:FAULT@NUMBER, such as 16:response-never@149"),
                              ('advice = "bussy"', 'plant.toml:3: explore.advice: "bussy": must be busy, flag-first, '),
                              ('faults = "sillent"', "did you mean silent?")):
            plant = self.write("plant.toml", f'plant = "demo"\n[explore]\n{text}\n')
            output = explore(plant, "drive", "--list", code=0 if message is None else 2)
            if message:
                self.assertIn(message, output)


KILLS_THE_PLANT = "kill -9 $(cut -d' ' -f4 /proc/$PPID/stat)"  # the parent is the guard


class NothingJudged(cases.Case):
    """A search that has shown nothing is no success."""

    def test_nothing_to_try(self):
        bare = self.write("bare.toml", 'plant = "demo"\n')
        self.assertIn("the command has sent no Modbus request", explore_command(["true"], plant=bare).stderr)
        for command, options, message in ((["true"], (), "without faults: done object"),
                                          ([PLC, "drive"], ("--nodes", "99"), "nodes: 99: there is no such node in the plant"),
                                          ([PLC, "drive"], ("--faults", "refuse", "--nodes", "66"), "no frame matches one of these")):
            made = explore_command(command, *options)
            self.assertEqual((made.returncode, made.stdout), (2, ""), made)
            self.assertIn(message, made.stderr)

    def test_one_moment_that_never_comes(self):
        made = explore_command([PLC, "drive"], "--only", "16:silent@9999")
        self.assertEqual(made.returncode, 1, made)
        self.assertIn("16:silent@9999: it never happened, so nothing has been shown", made.stdout)
        self.assertEqual(explore_command([PLC, "drive"], "--only", "16:silent@3").returncode, 0)

    def test_an_empty_part_has_the_verdict_of_all(self):
        empty = ("--faults", "refuse", "--shard", "999999/1000000")
        made = explore_command([PLC, "ignored-abort"], *empty)
        self.assertEqual(made.returncode, 0, made)
        self.assertIn("runs: 0, broken: 0", made.stdout)
        state = ("--state", self.folder / "state")
        self.assertEqual(explore_command([PLC, "ignored-abort"], "--faults", "refuse", *state).returncode, 1)
        self.assertEqual(explore_command([PLC, "ignored-abort"], *empty, *state).returncode, 1)

    def test_a_plant_whose_process_dies(self):
        junit = self.folder / "results.xml"
        made = explore_command(["sh", "-c", KILLS_THE_PLANT], "--junit", junit)
        self.assertEqual(made.returncode, 3, made)
        self.assertIn("was ended by signal 9", made.stderr)
        self.assertEqual(elements(junit), {"error": ["error"]})
        made = explore_command(["sh", "-c", f"{PLC} gives-up || {KILLS_THE_PLANT}"], "--faults", "refuse count=0", "--junit", junit, "-j", "1")
        self.assertEqual(made.returncode, 3, made)
        self.assertRegex(made.stderr, r"16:refuse count=0@\d+: the process with the plant was ended by signal 9")
        self.assertIn(["error"], elements(junit).values())

    def test_a_program_that_hangs(self):
        junit = self.folder / "results.xml"
        command = ["sh", "-c", f"{PLC} gives-up || {{ echo lost >&2; while :; do sleep 1; done; }}"]
        made = explore_command(command, "--only", "16:refuse count=0@1", "--junit", junit, program=IMPATIENT)
        self.assertEqual(made.returncode, 1, made)
        self.assertRegex(made.stdout, r"16:refuse count=0@1\n  hangs: no end within 5 s of this machine's time, also alone\n  \| lost\n")
        self.assertEqual(elements(junit)["refuse count=0"], ["failure"])


class Messages(cases.Case):
    def test_a_command_that_does_not_start(self):
        made = explore_command([self.folder / "nothere"])
        self.assertEqual(made.returncode, 2, made)
        self.assertRegex(made.stderr, r"without faults: the exit code is 0 or 75: it is 127\n  \| cbcan-sim: .*nothere: No such file")
        self.assertNotIn("#", made.stderr)  # no frames
        made = explore_command([sys.executable, "-c", "import no_such_module"])
        self.assertIn("  | ModuleNotFoundError: No module named 'no_such_module'", made.stderr)

    def test_what_a_failing_run_has_said_and_asked(self):
        made = explore_command(["sh", "-c", f"{PLC} gives-up || {{ echo 'no \33[31mway' >&2; exit 3; }}"], "--only", "16:refuse count=0@1")
        self.assertEqual(made.returncode, 1, made)
        self.assertIn("  | no  [31mway\n", made.stdout)
        self.assertRegex(made.stdout, r"  last request: #\d+ Modbus unit \d+: FC\d+ R37\d\d")

    def test_a_file_to_play_with_any_command(self):
        command = ["sh", "-c", f"# \n\x1b[31m \udcff\nexec {PLC} ignored-abort"]
        made = explore_command(command, "--faults", "refuse", "--out", self.folder)
        file = re.search(r"replay: (.*)", made.stdout)[1]
        self.assertEqual(subprocess.run([PROGRAM, "--config", file, "--check"]).returncode, 0)
        self.assertIn("done object 16 0x6081 = 20000", explore_command(command, plant=file).stdout)

    def test_a_mistake_in_a_condition_names_its_line(self):
        plant = self.write("plant.toml", 'plant = "demo"\n[explore]\ndone = "object 16 0x6081 >= 20O00"\n')
        for made in (explore_command([PLC, "drive"], plant=plant), subprocess.run([PROGRAM, "--config", plant, "--check"], capture_output=True, text=True)):
            self.assertEqual(made.returncode, 2, made)
            self.assertIn(f'{plant}:3: explore.done: "20O00": must be a number', made.stderr)
        plant.write_text(plant.read_text() + '[[step]]\nafter = "1s"\n')
        self.assertEqual(subprocess.run([PROGRAM, "run", "--check", plant], capture_output=True).returncode, 2)


class Files(cases.Case):
    """A search changes no file of the plant."""

    def test_parameters_are_copies_and_logs_are_not_written(self):
        self.check_files("log", "record")

    def test_captures_are_not_written(self):
        self.check_files("pcap")

    def check_files(self, *names):
        files = "".join(f'{"file" if name == "log" else name} = "{name}"\n' for name in names)
        plant = self.write("plant.toml", f'[log]\n{files}[module]\nparameters = "m.txt"\n'
                           f'[[node]]\nid = 66\neds = "{ROOT}/plants/demo/io_module.eds"\nparameters = "p66.txt"\n')
        stored = self.write("p66.txt", "1017:00 = E803\n")
        live = subprocess.run([PROGRAM, "--config", plant, "--clock", "manual", "--", PLC, "stores"], timeout=LIMIT)
        self.assertEqual(live.returncode, 0)
        self.assertIn("1017:00 = F401", stored.read_text())
        for name in names:
            (self.folder / name).unlink()
        stored.write_text("1017:00 = E803\n")
        made = explore_command([PLC, "stores"], "--faults", "request-lost", plant=plant)
        self.assertEqual(made.returncode, 0, made)
        seeds = subprocess.run([PROGRAM, "--config", plant, "--seeds", "1..3", "--", PLC, "stores"], capture_output=True, timeout=LIMIT)
        self.assertEqual(seeds.returncode, 0, seeds)
        self.assertEqual(stored.read_text(), "1017:00 = E803\n")
        self.assertEqual(sorted(path.name for path in self.folder.iterdir()), ["p66.txt", "plant.toml"])


class TheSameTable(cases.Case):
    OPTIONS = ("--faults", "refuse,request-lost")

    def test_with_any_number_of_jobs_parts_and_pauses(self):
        whole = explore(DRIVE, "ignored-abort", *self.OPTIONS, "-j", "1", code=1)
        self.assertEqual(explore(DRIVE, "ignored-abort", *self.OPTIONS, "-j", "8", code=1), whole)
        for part in range(1, 5):
            subprocess.run([PROGRAM, "--config", DRIVE, "--explore", *self.OPTIONS, "--shard", f"{part}/4", "--state", self.folder / f"state{part}", "--", PLC, "ignored-abort"],
                           stdout=subprocess.DEVNULL, timeout=LIMIT)
        joined = self.write("joined", "".join((self.folder / f"state{part}").read_text() for part in (3, 1, 4, 2, 1)))
        before, junit = joined.read_bytes(), ("--junit", self.folder / "junit.xml")
        self.assertEqual(explore(DRIVE, "ignored-abort", *self.OPTIONS, "--state", joined, *junit, code=1), whole)
        self.assertEqual(joined.read_bytes(), before)  # nothing was left to run
        merged = (self.folder / "junit.xml").read_text()
        self.assertEqual(explore(DRIVE, "ignored-abort", *self.OPTIONS, *junit, code=1), whole)
        self.assertEqual((self.folder / "junit.xml").read_text(), merged)
        state = ("--state", self.folder / "state")
        first = subprocess.run([PROGRAM, "--config", DRIVE, "--explore", *self.OPTIONS, *state, "--budget", "100ms", "--junit",
                                self.folder / "results.xml", "--", PLC, "ignored-abort"], capture_output=True, text=True, timeout=LIMIT)
        self.assertRegex(first.stdout, r"not tried: \d+")
        self.assertTrue(list(xml.parse(self.folder / "results.xml").iter("skipped")))
        self.assertEqual(explore(DRIVE, "ignored-abort", *self.OPTIONS, *state, code=1), whole)
        self.assertIn("has results of another command; name a new file", explore(DRIVE, "drive", *self.OPTIONS, *state, code=2))

    def kept(self):
        """Moments in the file of --state, once each; its last line may still be written."""
        lines = [json.loads(line) for line in (self.folder / "state").read_text().rpartition("\n")[0].splitlines()]
        return {line[0] for line in lines if isinstance(line[1], dict)}

    def test_two_at_a_time_keep_their_results_in_one_file(self):
        command = [PROGRAM, "--config", DRIVE, "--explore", *self.OPTIONS, "--state", self.folder / "state", "-j", "1"]
        both = [subprocess.Popen([*command, "--shard", f"{part}/2", "--", PLC, "ignored-abort"], stdout=subprocess.DEVNULL) for part in (1, 2)]
        self.assertIn(1, [one.wait(6 * LIMIT) for one in both])
        whole = explore(DRIVE, "ignored-abort", *self.OPTIONS, code=1)
        self.assertEqual(len(self.kept()), count(whole, "tried"))
        before = (self.folder / "state").read_text()
        self.assertEqual(explore(DRIVE, "ignored-abort", *self.OPTIONS, "--state", self.folder / "state", code=1), whole)
        self.assertEqual((self.folder / "state").read_text(), before)  # nothing was left to do

    def test_a_file_outlives_the_end_of_the_program_and_of_its_last_line(self):
        options = (*self.OPTIONS, "--state", self.folder / "state")
        kept = set()
        for _ in range(5):
            search = subprocess.Popen([PROGRAM, "--config", DRIVE, "--explore", *options, "-j", "1", "--", PLC, "ignored-abort"], stdout=subprocess.DEVNULL)
            wait_until(lambda: (self.folder / "state").exists() and len(self.kept()) > len(kept), "another result")
            search.kill()
            search.wait(LIMIT)
            self.assertLess(kept, self.kept())
            kept = self.kept()
        most = (self.folder / "state").stat().st_size // 2  # a file that is written again dies here
        subprocess.run([PROGRAM, "--config", DRIVE, "--explore", *options, "--", PLC, "ignored-abort"], stdout=subprocess.DEVNULL, timeout=LIMIT,
                       preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (most, most)))
        self.assertEqual(self.kept(), kept)
        with (self.folder / "state").open("a") as file:
            file.write('["16:refuse@9",{"dura')
        whole = explore(DRIVE, "ignored-abort", *self.OPTIONS, code=1)
        self.assertEqual(explore(DRIVE, "ignored-abort", *options, code=1), whole)
        self.assertEqual(len(self.kept()), count(whole, "tried"))

    def test_a_damaged_file_is_refused_and_left_as_it_is(self):
        state = self.folder / "state"
        explore(DRIVE, "ignored-abort", *self.OPTIONS, "--state", state, code=1)
        damaged = state.read_text().replace('"verdict":0', '"verdict":77', 1)
        state.write_text(damaged)
        self.assertRegex(explore(DRIVE, "ignored-abort", *self.OPTIONS, "--state", state, code=2), r"state:\d+: is no result of this version; remove the line")
        self.assertEqual(state.read_text(), damaged)

    def test_junit(self):
        explore(DRIVE, "ignored-abort", *self.OPTIONS, "--junit", self.folder / "results.xml", code=1)
        results = {f'{case.get("classname")}/{case.get("name")}': [child.tag for child in case] for case in xml.parse(self.folder / "results.xml").iter("testcase")}
        self.assertEqual(results, {"16/refuse": ["failure"], "16/request-lost": ["failure"]})


class Seeds(cases.Case):
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
