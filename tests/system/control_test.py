#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Commands at run time: over a socket on the real clock, and between `pass` lines on a manual clock; signals, faults and stored parameters of a
plant file."""

import subprocess

import cases
from done import ran
from simulator import LIMIT, READ, WRITE, Simulator, connect, program_from_arguments
from tree import ROOT

PROGRAM = program_from_arguments()
EDS = ROOT / "plants/demo"

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
        self.socket = connect(address)
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


class OverASocket(cases.Case):
    def start(self, *options, **more):
        simulator = Simulator(PROGRAM, "--demo", *options, test=self, **more)
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

    def test_what_a_delayed_command_waited_for_is_in_the_log_when_it_is_answered(self):
        simulator, commands = self.start("--control", "127.0.0.1:0", "--verbose")
        self.assertEqual(commands("fault 0x42 response-late delay_ms=2"), "ok 1\n")
        for number in range(1, 101):
            self.assertEqual(commands("trigger read 0x42 0x1000 0 4\nwait transaction ended"), "ok\n")
            self.assertRegex(commands.lines.readline(), r"^ok \d")
            self.assertIn(f"#{number} read node 66 ", "".join(simulator.errors()[-1:]))

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

    def test_who_leaves_while_it_waits_is_forgotten(self):
        simulator, commands = self.start("--control", "127.0.0.1:0")
        for line in (b"wait time 1000s within 1000s\n", b"wait emcy 1\n" + 100_000 * b"time\n"):
            with simulator.connect("control") as other:
                other.sendall(line)
        self.assertEqual(commands("send 605#4017100000000000"), "ok\n")
        self.assertEqual(commands("get 0x42 0x1017"), "ok 0\n")

    def test_shutdown(self):
        simulator, commands = self.start("--control", "127.0.0.1:0")
        self.assertEqual(commands("shutdown"), "ok\n")
        self.assertEqual(simulator.process.wait(timeout=LIMIT), 0)

    def test_shutdown_that_was_sent_behind_a_pass(self):
        simulator, commands = self.start("--control", "127.0.0.1:0", "--clock", "manual", stdin=subprocess.PIPE)
        commands.socket.sendall(b"pass 1s\nshutdown\n")
        self.assertEqual(commands.lines.read(), "at 1.000000\nok\n")
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


class OnAStandingClock(cases.Case):
    def run_plant(self, lines):
        plant = self.write("plant.toml", PLANT.format(eds=EDS))
        log = self.folder / "bus.log"
        return ran(PROGRAM, "--config", plant, "--clock", "manual", "--log", log, input=lines), log.read_text()

    def test_commands_between_passes(self):
        done, log = self.run_plant("get 5 0x6401:1\npass 500ms\nget 5 0x6401:1\npass 2s\nget 5 0x6401:1\ntime\n"
                                   "incident 5 input-voltage-low on\n")
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.assertEqual(done.stdout.splitlines()[1:], ["ok 0", "at 0.500000", "ok 500", "at 2.500000", "ok 1000", "ok 2.500000", "ok"])
        self.assertIn("(0000000002.500000) virtual 085#2031050000000000\n", log)

    def test_stored_parameters_outlive_the_program(self):
        plant = self.write("plant.toml", PLANT.format(eds=EDS))
        for heartbeat in (0, 1234):
            simulator = Simulator(PROGRAM, "--config", str(plant), test=self)
            with simulator.window() as window:
                self.assertEqual(window.execute(READ, 5, 0x1017, 0, 2), 0)
                self.assertEqual(window.read(3706, 1), [heartbeat])
                if heartbeat == 0:
                    self.assertEqual(window.execute(WRITE, 5, 0x1017, 0, 2, 1234), 0)
                    self.assertEqual(window.execute(WRITE, 5, 0x1010, 1, 4, 0x6173, 0x6576), 0)
            simulator.stop()
        self.assertIn("1017:00 = D204\n", (self.folder / "module.par").read_text())


cases.main()
