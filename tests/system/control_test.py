#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Commands at run time: over a socket on a running clock, and between `pass` lines on a standing one; signals, faults and stored
parameters of a plant file."""

import os
import pathlib
import socket
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
import cases
from simulator import LIMIT, Simulator, program_from_arguments, wait_until

PROGRAM = program_from_arguments(sys.argv)
EDS = pathlib.Path(__file__).resolve().parents[2] / "plants/demo"
READ, WRITE = 5055, 5066

PLANT = """
[modbus]
port = 0

[[node]]
id = 5
eds = "{eds}/io_module.eds"
parameters = "module.par"
signals = [ {{ index = 0x6401, sub = 1, shape = "ramp", from = 0, to = 1000, duration_ms = 1000, sample_ms = 100 }} ]
faults = [ {{ kind = "response-never", index = 0x6411, count = 1 }} ]
"""


class Commands:
    """A client of the control socket."""

    def __init__(self, address):
        if address.startswith("unix:"):
            self.socket = socket.socket(socket.AF_UNIX)
            self.socket.settimeout(LIMIT)
            self.socket.connect(address[len("unix:"):])
        else:
            host, port = address.rsplit(":", 1)
            self.socket = socket.create_connection((host, int(port)), timeout=LIMIT)
        self.lines = self.socket.makefile("r")

    def __call__(self, line):
        self.socket.sendall(line.encode() + b"\n")
        response = [self.lines.readline()]
        while not response[-1].startswith(("ok", "error: ")):
            response.append(self.lines.readline())
        return "".join(response)

    def close(self):
        self.lines.close()
        self.socket.close()


class OverASocket(unittest.TestCase):
    def start(self, *options):
        simulator = Simulator(PROGRAM, "--demo", *options, test=self)
        commands = Commands(simulator.where["control"])
        self.addCleanup(commands.close)
        return simulator, commands

    def test_what_a_command_has_brought_about_is_on_the_bus_when_it_is_answered(self):
        simulator, commands = self.start("--control", "127.0.0.1:0")
        window = simulator.window()
        self.addCleanup(window.socket.close)
        self.assertEqual(commands("incident 0x42 output-short-circuit on"), "ok\n")
        self.assertIn("0C2#2023030000000000", simulator.frames())
        self.assertEqual(window.execute(READ, 0x42, 0x1001, 0, 1), 0)
        self.assertEqual(commands("incident 0x42 output-short-circuit off"), "ok\n")
        self.assertIn("0C2#0000000000000000", simulator.frames())

    def test_a_fault_is_told_on_standard_error_each_time(self):
        simulator, commands = self.start("--control", "127.0.0.1:0")
        window = simulator.window()
        self.addCleanup(window.socket.close)
        self.assertEqual(commands("fault 0x42 abort code=0x08000021 count=2"), "ok 1\n")
        for _ in range(2):
            self.assertEqual(window.execute(READ, 0x42, 0x1000, 0, 4), 4)
            self.assertEqual(window.abort_code(), 0x08000021)
        self.assertEqual(window.execute(READ, 0x42, 0x1000, 0, 4), 0)
        self.assertEqual(commands("faults 0x42"), "0x42 1 abort code=0x08000021 count=2 occasions=2 fired=2\nok\n")
        told = [line.split(" ", 2)[2] for line in simulator.errors()]
        self.assertEqual(told, 2 * ["node 66: fault 1: abort code=0x08000021 count=2: 5C2#4300100091010F00"])

    def test_a_unix_socket_that_is_taken_away_again(self):
        with tempfile.TemporaryDirectory() as folder:
            path = f"{folder}/control"
            simulator, commands = self.start("--control", f"unix:{path}")
            os.umask(umask := os.umask(0))
            self.assertEqual(pathlib.Path(path).stat().st_mode & 0o777, 0o777 & ~umask)  # as SECURITY.md says
            self.assertEqual(commands("get 1 0x9130:1"), "ok 99021\n")
            self.assertEqual(simulator.stop()[0], 0)
            self.assertFalse(pathlib.Path(path).exists())

    def test_a_unix_socket_of_somebody_else_stays(self):
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "control"
            simulator, _ = self.start("--control", f"unix:{path}")
            path.unlink()
            with socket.socket(socket.AF_UNIX) as other:
                other.bind(str(path))
                self.assertEqual(simulator.stop()[0], 0)
                self.assertTrue(path.exists())

    def test_many_long_lists_in_one_packet(self):
        simulator, commands = self.start("--control", "127.0.0.1:0")
        for _ in range(1000):
            commands("fault 0x42 response-never index=0x5FFF")
        greedy = Commands(simulator.where["control"])
        self.addCleanup(greedy.close)
        greedy.socket.sendall(585 * b"faults\n")
        before = self.memory(simulator)
        for _ in range(100):
            self.assertEqual(commands("time")[:3], "ok ")
        self.assertLess(self.memory(simulator) - before, 10_000)
        for _ in range(585 * 1001):
            last = greedy.lines.readline()
        self.assertEqual(last, "ok\n")

    def memory(self, simulator):
        """The most that it has had, in KiB."""
        status = pathlib.Path(f"/proc/{simulator.process.pid}/status").read_text()
        return int(status.split("VmHWM:")[1].split()[0])

    def test_a_wait_is_answered_when_it_is_over_and_holds_back_the_lines_behind_it(self):
        simulator, commands = self.start("--control", "127.0.0.1:0", "--sdo-timeout", "100")
        other = Commands(simulator.where["control"])
        self.addCleanup(other.close)
        other.socket.sendall(b"wait transaction started\nwait transaction ended\nread 3700\n")
        self.assertEqual(commands("trigger read 99 0x1000 0 4"), "ok\n")
        self.assertEqual([other.lines.readline()[:3] for _ in range(2)], ["ok ", "ok "])
        self.assertEqual(other.lines.readline(), "ok 4\n")
        self.assertEqual(commands("wait register 3700 = 0 within 1ms"),
                         "error: not within 0.001000 s: register 3700 = 0: it is 4\n")

    def test_who_leaves_while_it_waits_is_forgotten(self):
        simulator, commands = self.start("--control", "127.0.0.1:0")
        for line in (b"wait time 1000s within 1000s\n", b"wait emcy 1\n" + 100_000 * b"time\n"):
            with socket.create_connection(simulator.where["control"].split(":"), timeout=LIMIT) as other:
                other.sendall(line)
        self.assertEqual(commands("send 605#4017100000000000"), "ok\n")
        self.assertEqual(commands("get 0x42 0x1017"), "ok 0\n")

    def test_shutdown(self):
        simulator, commands = self.start("--control", "127.0.0.1:0")
        self.assertEqual(commands("shutdown"), "ok\n")
        self.assertEqual(simulator.process.wait(timeout=LIMIT), 0)

    def test_pass_on_a_clock_that_runs_waits(self):
        simulator, commands = self.start("--control", "127.0.0.1:0")
        before = float(commands("time").split()[1])
        self.commands_at(commands, "pass 20ms", before + 0.02)

    def commands_at(self, commands, line, at_least):
        commands.socket.sendall(line.encode() + b"\n")
        word, at = commands.lines.readline().split()
        self.assertEqual(word, "at")
        self.assertGreaterEqual(float(at), at_least)

    def test_garbage_is_answered_and_nobody_else_notices(self):
        simulator, commands = self.start("--control", "127.0.0.1:0")
        other = Commands(simulator.where["control"])
        other.socket.sendall(bytes(range(256)) * 100 + b"\n" + b"x" * 100_000 + b"\n")
        self.assertTrue(other.lines.readline().startswith("error: "))
        other.close()
        self.assertEqual(commands("time")[:3], "ok ")
        self.assertEqual(commands("get 0x42"), "error: write get NODE INDEX[:SUB]|output:N\n")


class OnAStandingClock(unittest.TestCase):
    def run_plant(self, lines, folder):
        plant = pathlib.Path(folder) / "plant.toml"
        plant.write_text(PLANT.format(eds=EDS))
        log = pathlib.Path(folder) / "bus.log"
        done = subprocess.run([PROGRAM, "--config", str(plant), "--clock", "manual", "--log", str(log)], input=lines,
                              capture_output=True, text=True, timeout=LIMIT)
        return done, log.read_text()

    def test_commands_between_passes(self):
        with tempfile.TemporaryDirectory() as folder:
            done, log = self.run_plant("get 5 0x6401:1\npass 500ms\nget 5 0x6401:1\npass 2s\nget 5 0x6401:1\ntime\n"
                                       "incident 5 input-voltage-low on\n", folder)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.assertEqual(done.stdout.splitlines()[1:], ["ok 0", "at 0.500000", "ok 500", "at 2.500000", "ok 1000", "ok 2.500000", "ok"])
        self.assertIn("(0000000002.500000) virtual 085#2031050000000000\n", log)

    def test_a_run_is_the_same_every_time(self):
        lines = "fault bus frame-loss probability=0.3\nfault 5 response-late delay_ms=7 probability=0.5\n" + \
            "".join(f"set 5 0x6000:1 {step % 256}\npass 13ms\n" for step in range(50))
        with tempfile.TemporaryDirectory() as folder:
            runs = [self.run_plant(lines, folder) for _ in range(2)]
        self.assertEqual(runs[0][0].stderr, runs[1][0].stderr)
        self.assertEqual(runs[0][1], runs[1][1])

    def test_stored_values_that_do_not_fit_are_told(self):
        with tempfile.TemporaryDirectory() as folder:
            stored = pathlib.Path(folder) / "module.par"
            stored.write_text("1017:00 = E803\n1018:01 = 01000000\n1029:01 = 0000\n5FFF:00 = 01\n")
            done, _ = self.run_plant("get 5 0x1017\n", folder)
        self.assertEqual(done.stdout.splitlines()[1:], ["ok 1000"])
        self.assertEqual(done.stderr, f"cbcan-sim: {stored}: left out, as the node has no such parameter of this length: 1018:01, "
                                      "1029:01, 5FFF:00\n")

    def test_stored_parameters_outlive_the_program(self):
        with tempfile.TemporaryDirectory() as folder:
            plant = pathlib.Path(folder) / "plant.toml"
            plant.write_text(PLANT.format(eds=EDS))
            for heartbeat in (0, 1234):
                simulator = Simulator(PROGRAM, "--config", str(plant), test=self)
                with simulator.window() as window:
                    self.assertEqual(window.execute(READ, 5, 0x1017, 0, 2), 0)
                    self.assertEqual(window.read(3706, 1), [heartbeat])
                    if heartbeat == 0:
                        self.assertEqual(window.execute(WRITE, 5, 0x1017, 0, 2, 1234), 0)
                        self.assertEqual(window.execute(WRITE, 5, 0x1010, 1, 4, 0x6173, 0x6576), 0)
                simulator.stop()
            self.assertIn("1017:00 = D204\n", (pathlib.Path(folder) / "module.par").read_text())

    def test_a_parameter_file_that_is_broken_is_told_with_its_line(self):
        with tempfile.TemporaryDirectory() as folder:
            (pathlib.Path(folder) / "module.par").write_text("# mine\n1017 = 5\n")
            plant = pathlib.Path(folder) / "plant.toml"
            plant.write_text(PLANT.format(eds=EDS))
            done = subprocess.run([PROGRAM, "--config", str(plant)], capture_output=True, text=True, timeout=LIMIT)
        self.assertEqual(done.returncode, 2)
        self.assertIn(f'{folder}/module.par:2: "1017 = 5": write INDEX:SUB = BYTES', done.stderr)

    def test_a_fault_of_the_plant_file_happens_at_the_first_occasion(self):
        with tempfile.TemporaryDirectory() as folder:
            plant = pathlib.Path(folder) / "plant.toml"
            plant.write_text(PLANT.format(eds=EDS))
            simulator = Simulator(PROGRAM, "--config", str(plant), "--sdo-timeout", "20", test=self)
            with simulator.window() as window:
                window.start(READ, 5, 0x6411, 1, 2)
                wait_until(lambda: window.read(3700, 1) == [4], "the timeout")
                self.assertEqual(window.abort_code(), 0x05040000)
                window.start(READ, 5, 0x6411, 1, 2)
                wait_until(lambda: window.read(3700, 1) == [0], "the response after quarantine")


cases.main()
