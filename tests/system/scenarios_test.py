#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""cbcan-sim run: the scenarios of cbcan, results, parts, and reproducible logs."""

import hashlib
import os
import pathlib
import pty
import subprocess
import tempfile
import time
import xml.etree.ElementTree as ElementTree

import cases
from done import ran
from owned_registers import OwnedRegisters
from serial_line import SerialLine
from simulator import STANDING, Simulator, program_from_arguments
from tree import ROOT

PROGRAM = program_from_arguments()
SHIPPED = sorted((ROOT / "scenarios").glob("*.toml"))
DIGESTS = pathlib.Path(__file__).with_name("scenario_logs.sha256")  # in the format of sha256sum
FAILS = """plant = "demo"

[[step]]
do = "trigger read 99 0x1000 0 4"
wait = "transaction ended"
expect = "register 3700 = 0"
"""


def run(*arguments):
    return ran(PROGRAM, "run", *arguments)


class Shipped(cases.Case):
    def test_all_pass(self):
        begin = time.monotonic()
        done = run(ROOT / "scenarios")
        took = time.monotonic() - begin
        self.assertEqual((done.returncode, done.stderr), (0, ""), done.stdout)
        self.assertEqual(done.stdout.splitlines()[-1], f"{len(SHIPPED)} passed")
        print(f"{len(SHIPPED)} scenarios in {took:.3f} s")

    def test_a_module_boots_all_nodes_of_a_network_in_a_second(self):
        """With 3 checks, 20 writes and a heartbeat of 100 ms each, at 1 Mbit/s; and those beside 16 that are not there."""
        node = f'[[node]]\nid = {{}}\neds = "{ROOT}/plants/demo/io_module.eds"\n'
        objects = ", ".join(f"{{ index = 0x6206, sub = 1, value = {value} }}" for value in range(1, 20))
        for missing in (set(), set(range(8, 127, 8)) | {126}):
            there = [number for number in range(1, 127) if number not in missing]
            files = {
                "network.toml": "".join(node.format(number) + f"identity = [0, 0x191, 0x10000]\nheartbeat_ms = 100\nobjects = [{objects}]\n" for number in range(1, 127)),
                "plant.toml": '[can]\nbit_rate = 1000000\n[module]\nnetwork = "network.toml"\n' + "".join(map(node.format, there)),
                "boot.toml": 'plant = "plant.toml"\n[[step]]\nat = "1s"\nexpect = '
                             + str([text for number in there for text in (f"state {number} operational", f"object {number} 0x6206:1 = 19")]),
            }
            with self.subTest(missing=len(missing)), tempfile.TemporaryDirectory() as folder:
                for name, text in files.items():
                    (pathlib.Path(folder) / name).write_text(text)
                done = run(pathlib.Path(folder) / "boot.toml")
                self.assertEqual(done.returncode, 0, done.stdout)

    def test_again_and_again(self):
        for _ in range(int(os.environ.get("CBCAN_RUNS", "5"))):
            self.assertEqual(run("-j", 4, ROOT / "scenarios").returncode, 0)

    def test_the_log_is_the_same_every_time_and_from_every_compiler(self):
        logs = []
        for options in ([], ["-j", "4"]):
            with tempfile.TemporaryDirectory() as folder:
                self.assertEqual(run("--log", folder, *options, ROOT / "scenarios").returncode, 0)
                logs.append({path.name: path.read_text() for path in pathlib.Path(folder).iterdir()})
        self.assertEqual(logs[0], logs[1])
        digests = "".join(f"{hashlib.sha256(log.encode()).hexdigest()}  {name}\n" for name, log in sorted(logs[0].items()))
        self.assertEqual(digests, DIGESTS.read_text(), "if the buses should differ, write these digests to " + DIGESTS.name)
        self.assertEqual(len(logs[0]), len(SHIPPED) + 1)
        self.assertIn("(0000000001.000000) virtual 663#8000100000000405\n", logs[0]["silent_node.log"])
        self.assertTrue(logs[0]["two_networks.2.log"])

    def test_a_module_that_restarts_is_no_success(self):
        class Module(OwnedRegisters):
            """Its registers contain CA0Eh at the first read and 0 afterwards."""

            def read(self, first, count):
                words = super().read(first, count)
                if self.registers.get(3700) == 0xCA0E:
                    self.write(3700, [0] * 70)
                return words

        module = Module()
        self.addCleanup(module.stop)
        plain = self.write("plain.toml", '[[step]]\ndo = "trigger write 5 0x2000 0 4 1"\nwait = "transaction ended"\nexpect = "register 3700 = 0"\n')
        done = run("--target", f"127.0.0.1:{module.port}", plain)
        self.assertEqual(done.returncode, 2)
        self.assertIn("the module has restarted, or another program has written to R3701..R3704", done.stdout)

    def test_in_real_time(self):
        begin = time.monotonic()
        self.assertEqual(run("--real-time", ROOT / "scenarios/own_objects.toml").stdout,
                         f"passed {ROOT}/scenarios/own_objects.toml: 2.200000 s\n1 passed\n")
        self.assertGreaterEqual(time.monotonic() - begin, 2.2)

    def test_on_another_implementation_of_the_registers(self):
        line = SerialLine()
        self.addCleanup(line.close)
        with Simulator(PROGRAM, "--demo", "--sdo-timeout", "200", "--rtu", line.ends[0], "--set", "rtu.baud=115200") as simulator:
            plain = self.write("plain.toml", 'plant = "demo"\n[[step]]\ndo = "trigger read 99 0x1000 0 4"\nwait = "transaction ended"\n'
                               'expect = ["took >= 200ms", "register 3700 = 4", "register 3706 = 0 0x0504"]\n')
            done = run("--target", f"127.0.0.1:{simulator.port}", plain, *(ROOT / f"scenarios/{name}.toml" for name in (
                "an_hour_of_heartbeats", "checks", "nmt_and_state", "node_lost", "sdo_sizes_and_modes", "silent_node")))
            by_rtu = run("--target", f"rtu:{line.ends[1]},115200,E", *(ROOT / f"scenarios/{name}.toml" for name in (
                "checks", "nmt_and_state", "sdo_sizes_and_modes", "transaction_read_and_write")))
        self.assertIn("\n4 passed\n", by_rtu.stdout)
        self.assertEqual(done.returncode, 0, done.stdout)
        self.assertIn("an_hour_of_heartbeats.toml: line 9: nothing of what the step expects can be seen there\n", done.stdout)
        self.assertRegex(done.stdout, r"(?m)^passed .*/checks.toml: 0\.\d+ s; 5 expectations of nodes, frames or exact times left out$")
        self.assertRegex(done.stdout, rf"(?m)^passed {plain}: 0\.[2-9]\d+ s$")
        self.assertIn("node_lost.toml: nodes and frames cannot be seen there: --target has registers alone\n", done.stdout)
        self.assertIn("\n4 passed, 3 skipped\n", done.stdout)
        done = run("--target", f"127.0.0.1:{simulator.port}", ROOT / "scenarios/silent_node.toml")
        self.assertEqual(done.returncode, 2)
        self.assertIn(f"127.0.0.1:{simulator.port}", done.stdout)


class FromOutside(cases.Case):
    def test_a_session_becomes_a_scenario(self):
        recorded = self.folder / "session.toml"
        with Simulator(PROGRAM, "--demo", "--record", str(recorded), "--control", "127.0.0.1:0", "--sdo-timeout", "1000") as simulator:
            with simulator.window() as window, simulator.connect("control") as control:
                self.assertEqual(window.execute(5066, 0x42, 0x6411, 1, 2, 300), 0)
                self.assertEqual(window.execute(5055, 0x42, 0x6411, 1, 2), 0)
                control.sendall(b"fault 0x42 abort code=0x08000021\nget 0x42 0x1000\n")
                replies = control.makefile()
                self.assertEqual([replies.readline() for _ in range(2)], ["ok 1\n", "ok 983441\n"])
                self.assertEqual(window.execute(5055, 0x42, 0x6411, 1, 2), 4)
                self.assertEqual(window.execute(5055, 99, 0x6411, 1, 2), 4)
                control.sendall(b"set 99 0x6401:1 5\nincident 1 no-such on\nset 0x42 0x6401:1 5\n")
                self.assertEqual([replies.readline()[:2] for _ in range(3)], ["er", "er", "ok"])
                for number in (1, 2):
                    window.write(700, [number, 5055, 0x42, 0x6411, 1, 2])
                    self.assertEqual(window.read(800, 1), [number])
        text = recorded.read_text()
        self.assertTrue(text.startswith('plant = "demo"\n\n[[step]]\nat = "'), text)
        self.assertIn('do = "write 3700 51726 5066 66 25617 1 2 300"\n', text)
        self.assertIn('expect = ["register 3700 = 0", "register 3705 = 2 300"]\n', text)
        self.assertIn('do = "fault 0x42 abort code=0x08000021"\n', text)
        self.assertIn('expect = ["register 3700 = 4", "register 3706 = 33 2048"]\n', text)
        self.assertNotIn("get", text)
        self.assertNotIn("set 99", text)
        self.assertNotIn("incident", text)
        self.assertIn('do = "set 0x42 0x6401:1 5"\n', text)
        self.assertIn('wait = "register 800 = 1"\nexpect = ["register 801 = 5"]\n', text)
        self.assertIn('wait = "register 800 = 2"\nexpect = ["register 801 = 4", "register 804 = 33 2048"]\n', text)
        self.assertIn("\n# #2 read node 66 6411h:01 Channel 1 = 300: done\n", text)
        self.assertEqual(run(recorded).returncode, 0, run(recorded).stdout)
        recorded.write_text(text.replace("= 2 300", "= 2 301"))
        self.assertIn("expected register 3705 = 2 301: it is 2 300\n", run(recorded).stdout)

    def test_a_log_is_played_onto_the_bus(self):
        (self.folder / "bus.log").write_text("(1436509052.500000) can0 000#0142\n\n(1436509053.750000) can0 642#4000100000000000\n")
        scenario = self.write("replay.toml", 'plant = "demo"\n[can]\nreplay = "bus.log"\n[[step]]\nat = "0us"\n[[step]]\nwait = "frame 5C2#43*"\n'
                              'expect = ["took = 1250ms", "state 0x42 operational"]\n')
        self.assertEqual(run(scenario).stdout, f"passed {scenario}: 1.250000 s\n1 passed\n")
        (self.folder / "bus.log").write_text("(1436509052.500000) can0 000#0142\n(1436509051.750000) can0 642#\n")
        self.assertIn(f"can.replay: {self.folder}/bus.log:2: not a line of candump -L, or earlier than the one before\n", run(scenario).stdout)
        done = ran(PROGRAM, *STANDING, "--set", "can.replay=none.log", input="")
        self.assertEqual((done.returncode, done.stderr), (2, "can.replay: none.log: cannot be read\n"))


class Outcomes(cases.Case):
    def test_a_failure_has_its_place_what_is_seen_registers_and_frames(self):
        path = self.write("wrong.toml", FAILS)
        done = run(path)
        self.assertEqual(done.returncode, 1)
        self.assertEqual(done.stdout, f"""FAILED {path}
{path}:6: expected register 3700 = 0: it is 4
  at 1.000000
  R3700..: 4 5055 99 4096 0 4 0 1284 0 0
  the last frames:
    0.000000 663#4000100000000000
    1.000000 663#8000100000000405
0 passed, 1 failed
""")

    def test_a_failure_has_what_nodes_and_faults_reported(self):
        done = run(self.write("said.toml", FAILS.replace('"trigger read 99', '["fault 0x42 response-never", "trigger read 0x42').replace('4"', '4"]')))
        self.assertIn("\n  said 0.000000 node 66: fault 1: response-never: 5C2#4300100091010F00\n", done.stdout)

    def test_what_is_no_scenario(self):
        for text, problem in ((FAILS.replace("trigger", "triger"), ':4: "triger": no such command; did you mean trigger?'),
                              (FAILS.replace("demo", "none.toml"), f":1: plant {self.folder}/none.toml: cannot be read; paths are relative "
                               "to this file")):
            path = self.write("wrong.toml", text)
            for options in ([], ["--check"]):
                done = run(*options, path)
                self.assertEqual((done.returncode, done.stdout), (2, f"WRONG {path}\n{path}{problem}\n0 passed, 1 wrong\n"))

    def test_check_plays_nothing(self):
        done = run("--check", self.write("wrong.toml", FAILS))
        self.assertEqual((done.returncode, done.stdout.splitlines()[-1]), (0, "1 passed"))

    def test_junit(self):
        self.write("a.toml", FAILS)
        self.write("b.toml", FAILS.replace("= 0", "= 4"))
        self.write("c.toml", FAILS.replace("read", "reed"))
        self.write("plant.toml", "[can]\nbit_rate = 0\n")
        results = self.folder / "results.xml"
        done = run(self.folder, "--junit", results)
        self.assertEqual(done.returncode, 2)
        self.assertIn("\n1 passed, 1 failed, 1 wrong\n", done.stdout)
        suite = ElementTree.parse(results).getroot()
        self.assertEqual([suite.get(key) for key in ("tests", "failures", "errors", "skipped")], ["3", "1", "1", "0"])
        self.assertEqual([case.get("name") for case in suite], ["a.toml", "b.toml", "c.toml"])
        self.assertEqual(suite[0][0].get("message"), f"{self.folder}/a.toml:6: expected register 3700 = 0: it is 4")
        self.assertIn("663#8000100000000405", suite[0][0].text)
        self.assertEqual(len(suite[1]), 0)
        self.assertEqual(suite[2][0].tag, "error")
        os.mkfifo(self.folder / "pipe")
        self.assertEqual(run(self.folder / "b.toml", "--junit", self.folder / "pipe").returncode, 0)
        done = run(self.folder / "b.toml", "--junit", "/nonexistent/x")
        self.assertEqual((done.returncode, done.stdout), (3, ""))
        self.assertEqual(done.stderr, "cbcan-sim: --junit /nonexistent/x: No such file or directory; write another file\n")

    def test_parts_together_are_the_whole_each_once(self):
        whole = run(ROOT / "scenarios").stdout.splitlines()[:-1]
        parts = [run("--shard", f"{i}/3", "-j", "2", ROOT / "scenarios").stdout.splitlines()[:-1] for i in (1, 2, 3)]
        self.assertEqual(sorted(sum(parts, [])), sorted(whole))
        self.assertTrue(all(parts))
        self.assertEqual(run("--shard", "4/3", ROOT / "scenarios").returncode, 2)

    def test_seeds_in_turn(self):
        path = self.write("chance.toml", 'plant = "demo"\n[[step]]\ndo = "fault 66 response-never probability=0.3"\n[[step]]\n'
                          'do = "trigger read 66 0x1000 0 4"\nwait = "register 3700 != 51726"\nexpect = "register 3700 = 0"\n')
        failed = [seed for seed in range(1, 31) if run("--seeds", str(seed), path).returncode == 1]
        self.assertTrue(0 < len(failed) < 21)
        outputs = {run("-j", jobs, "--seeds", "1..30", path).stdout for jobs in ("1", "4")}
        self.assertEqual(len(outputs), 1)
        lines = outputs.pop().splitlines()
        self.assertEqual(lines[:3], [f"FAILED {path}", f"with {len(failed)} of 30 seeds: " + " ".join(map(str, failed)),
                                     f"replay: cbcan-sim run --seeds {failed[0]} {path}"])
        self.assertEqual(lines[3:], run("--seeds", str(failed[0]), path).stdout.splitlines()[1:])
        self.assertEqual(run("--seeds", "1..30", self.write("b.toml", FAILS.replace("= 0", "= 4"))).stdout.splitlines()[1], "1 passed")
        self.assertIn("every run would write the same file", run("--seeds", "1..2", "--log", self.folder, path).stderr)

    def test_progress_on_a_terminal_alone(self):
        master, terminal = pty.openpty()
        with os.fdopen(terminal, "wb") as err:
            ran(PROGRAM, "run", ROOT / "scenarios/checks.toml", capture_output=False, stdout=subprocess.DEVNULL, stderr=err)
        written = b"\r1 of 1, 0 failed\x1b[K\r\x1b[K"
        with os.fdopen(os.dup(master), "rb") as screen:
            self.assertEqual(screen.read(len(written)), written)
        os.close(master)

    def test_every_goes_on_while_the_steps_below_do(self):
        path = self.write("every.toml", 'plant = "demo"\n[[step]]\nat = "1s"\nevery = "100ms"\ndo = "send 605#00"\n[[step]]\nat = "2s"\n'
                          'expect = "10 frame 605#00"\n[[step]]\nat = "1s"\n')
        done = run(path)
        self.assertIn(f"{path}:9: at: it is 2.000000 already\n", done.stdout)

    def test_a_folder_for_logs_that_cannot_be_made(self):
        done = run("--log", "/dev/null/logs", *sorted((ROOT / "scenarios").glob("*.toml")))
        self.assertEqual((done.returncode, done.stdout), (2, ""))
        self.assertEqual(done.stderr, "cbcan-sim: --log /dev/null/logs: Not a directory; name another folder\n")

    def test_usage(self):
        for arguments, told in (((), "FILE|FOLDER... is missing: Scenarios; of a folder all files *.toml that have a [[step]], in it and below; usage: "
                                 "cbcan-sim run [OPTION...] FILE|FOLDER..."),
                                (("--junti", "x"), "--junti: no such option; did you mean --junit?"),
                                (("-j",), "-j: needs an argument, N"),
                                (("--faults", "silent", "x"), "--faults is for --explore; add it"),
                                (("-j0", "x"), "--jobs 0: must be 1..1000"),
                                (("--seeds", "9..7", "x"), "--seeds 9..7: must be A..B, such as 1..1000, or one number, of 0..4294967295"),
                                (("--shard", "5", "x"), "--shard 5: must be I/N, the I-th part of N, such as 1/4")):
            done = run(*arguments)
            self.assertEqual((done.returncode, done.stderr.splitlines()[0]), (2, f"cbcan-sim run: {told}"))
        self.assertEqual(run(self.folder).stderr, f"cbcan-sim: {self.folder}: no file *.toml in it has a [[step]]\n")
        self.assertEqual(run("--help").returncode, 0)
        for line in run("--help").stdout.splitlines():
            self.assertLessEqual(len(line), 80)


cases.main()
