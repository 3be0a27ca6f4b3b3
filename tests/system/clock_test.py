#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""cbcan-sim on a manual clock."""

import os
import pty
import signal
import socket
import subprocess
import tempfile

import cases
from done import ran
from mcu import receive
from simulator import EXECUTE, LIMIT, READ, STANDING, Simulator, program_from_arguments, wait_until

PROGRAM = program_from_arguments()


def run(lines, *options):
    return ran(PROGRAM, *STANDING, *options, input=lines)


class Lines(cases.Case):
    def test_each_pass_is_answered_by_the_time(self):
        done = run("pass 100ms\npass 0us\npass 1us\npass 2s")
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.assertEqual(done.stdout.splitlines()[1:], ["at 0.100000", "at 0.100000", "at 0.100001", "at 2.100001"])

    def test_a_file_of_steps(self):
        with tempfile.TemporaryFile("w+") as steps:
            steps.write(1000 * "pass 1ms\n")
            steps.seek(0)
            done = ran(PROGRAM, *STANDING, stdin=steps)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.assertEqual(done.stdout.splitlines()[1:], [f"at {i // 1000}.{i % 1000:03}000" for i in range(1, 1001)])

    def test_a_line_that_means_nothing_ends_it(self):
        done = run("pass 1ms\nhurry 5s\npass 1ms\n")
        self.assertEqual(done.returncode, 2)
        self.assertEqual(done.stdout.splitlines()[1:], ["at 0.001000"])
        self.assertEqual(done.stderr, 'cbcan-sim: standard input: "hurry": no such command; help lists them\n')

    def test_a_wait_in_vain_is_a_check_that_failed(self):
        done = run("wait state 0x42 operational within 2s\npass 1s\n")
        self.assertEqual(done.returncode, 1)
        self.assertEqual(done.stderr, "cbcan-sim: standard input: not within 2.000000 s: state 0x42 operational: it is pre-operational\n")

    def test_a_background_job_leaves_the_terminal_to_its_shell(self):
        place = f"{self.folder}/control"
        pid, terminal = pty.fork()
        if pid == 0:
            os.execvp("bash", ["bash", "-mc", f"{PROGRAM} --demo --clock manual --modbus 127.0.0.1:0 --control unix:{place} & wait"])
        with os.fdopen(terminal, "r+b", buffering=0) as line, socket.socket(socket.AF_UNIX) as client:
            read = b""
            while b"ready" not in read:
                read += line.read(100)
            line.write(b"for the shell\n")
            while b"for the shell" not in read:  # its echo: the line can be read now
                read += line.read(100)
            client.settimeout(LIMIT)
            client.connect(place)
            client.sendall(b"pass 1s\nshutdown\n")
            self.assertEqual(client.makefile().read(), "at 1.000000\nok\n")
            self.assertEqual(os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]), 0)

    def test_standard_input_that_cannot_be_used(self):
        with open(os.devnull, "w") as write_only:
            done = ran(PROGRAM, *STANDING, stdin=write_only)
        self.assertEqual((done.returncode, done.stderr), (3, "cbcan-sim: standard input: Bad file descriptor\n"))
        done = run(f"pass {998 * '0'}1us\n")
        self.assertEqual((done.returncode, done.stderr), (2, "cbcan-sim: standard input: a line of more than 1000 characters\n"))

    def test_shutdown(self):
        done = run("nmt stop 1\nshutdown\npass 1s\n")
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.assertEqual(done.stdout.splitlines()[1:], ["ok", "ok"])


class Standing(cases.Case):
    def setUp(self):
        self.simulator = Simulator(PROGRAM, "--demo", "--clock", "manual", "--slcan", "127.0.0.1:0", stdin=subprocess.PIPE, test=self)
        self.window = self.simulator.window()
        self.addCleanup(self.window.socket.close)

    def pass_time(self, duration, at):
        self.assertEqual(self.simulator.say(f"pass {duration}"), f"at {at}\n")

    def test_requests_are_served_while_time_stands(self):
        self.assertEqual(self.window.execute(READ, 0x42, 0x1000, 0, 4), 0)
        self.pass_time("0us", "0.000000")

    def test_a_timeout_to_the_microsecond(self):
        self.window.start(READ, 99, 0x1000, 0, 4)
        self.pass_time("999999us", "0.999999")
        self.assertEqual(self.window.read(3700, 1), [EXECUTE])
        self.pass_time("1us", "1.000000")
        self.assertEqual(self.window.read(3700, 1), [4])
        self.assertEqual(self.window.abort_code(), 0x05040000)

    def command(self, line):
        print(line, file=self.simulator.process.stdin, flush=True)

    def test_time_stands_while_it_is_the_PLCs_turn(self):
        self.command("wait transaction started")
        self.command("wait transaction ended")
        self.window.start(READ, 99, 0x1000, 0, 4)
        self.assertEqual([self.simulator.process.stdout.readline() for _ in range(2)], ["ok 0.000000\n", "ok 1.000000\n"])
        self.assertEqual(self.window.read(3700, 1), [4])

    def test_who_waits_for_the_PLC_in_vain_waits_by_the_clock_on_the_wall(self):
        self.command("wait transaction started within 50ms")
        self.assertEqual(self.simulator.process.wait(timeout=LIMIT), 1)

    def test_what_has_come_is_dealt_with_before_time_passes(self):
        """The client does not wait for responses: all requests are in the sockets when the simulator reads the line."""
        with self.simulator.connect("slcan") as adapter:
            adapter.sendall(b"O\rV\r")
            self.assertEqual(receive(adapter, 7), b"\rV1013\r")
            self.simulator.process.send_signal(signal.SIGSTOP)
            adapter.sendall(5000 * b"t7E50\r")
            self.command("pass 1s")
            self.simulator.process.send_signal(signal.SIGCONT)
            self.assertEqual(self.simulator.process.stdout.readline(), "at 1.000000\n")
            self.assertEqual(receive(adapter, 10000), 5000 * b"z\r")
        marks = [line for line in self.simulator.log_path.read_text().splitlines() if line.endswith(" 7E5#")]
        self.assertEqual((len(marks), set(marks)), (5000, {"(0000000000.000000) virtual 7E5#"}))

    def test_however_much_time_passes_no_frame_is_lost(self):
        with self.simulator.connect("slcan") as adapter:
            # 1017h of node 42h = 1000
            adapter.sendall(b"O\rt64282B171000E8030000\r")
            receive(adapter, len("\rz\rt5C286017100000000000\r"))
            self.pass_time("86400s", "86400.000000")
            self.assertEqual(receive(adapter, 8 * 86400), 86400 * b"t74217F\r")

    def test_signals_while_time_passes(self):
        for number in (signal.SIGTERM, signal.SIGINT):
            simulator = Simulator(PROGRAM, "--demo", "--clock", "manual", "--set", "node.0x42.heartbeat_ms=1", stdin=subprocess.PIPE, test=self)
            print("pass 2592000s", file=simulator.process.stdin, flush=True)
            wait_until(lambda path=simulator.log_path: path.stat().st_size > 0, "time to pass")
            self.assertEqual(simulator.stop(number), (0, ""))


cases.main()
