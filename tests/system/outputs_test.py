#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""The output of cbcan-sim is not read, or the disk is full: it continues, and ends on request."""

import contextlib
import os
import pathlib
import signal
import subprocess

import cases
from done import done, ran
from healthy import Healthy
from mcu import die_with_parent
from simulator import LIMIT, READ, STANDING, Simulator, program_from_arguments, wait_until

PROGRAM = program_from_arguments()
FULL = "No space left on device; make room, or send it elsewhere\n"


class StuckPipe:
    """A pipe without room, until it is read."""

    def __init__(self):
        self.out, self.into = os.pipe()
        os.set_blocking(self.into, False)
        self.filling = 0
        with contextlib.suppress(BlockingIOError):
            while True:
                self.filling += os.write(self.into, bytes(4096))
        os.set_blocking(self.into, True)

    def read_until(self, end):
        """The output after the filling, up to this text."""
        with os.fdopen(os.dup(self.out), "rb", buffering=0) as pipe:
            text = b""
            while not text[self.filling:].endswith(end.encode()):
                text += pipe.read(65536)
        return text[self.filling:].decode()

    def close(self):
        os.close(self.out)
        os.close(self.into)


class Unread(cases.Case):
    def setUp(self):
        self.pipe = StuckPipe()
        self.addCleanup(self.pipe.close)

    def start(self, *options):
        simulator = Simulator(PROGRAM, "--demo", *options, log=False, before_start=lambda: os.set_inheritable(self.pipe.into, True),
                              close_fds=False, test=self)
        return simulator

    def check_served_and_ended(self, simulator):
        with simulator.window() as window:
            self.assertEqual(window.execute(READ, 0x42, 0x1000, 0, 4), 0)
        self.assertEqual(simulator.stop()[0], 0)

    def test_log_into_a_fifo_without_a_reader(self):
        os.mkfifo(f"{self.folder}/fifo")
        simulator = self.start("--log", f"{self.folder}/fifo")
        with simulator.window() as window:
            self.assertEqual(window.execute(READ, 0x42, 0x1000, 0, 4), 0)
            with open(f"{self.folder}/fifo", encoding="ascii") as fifo:
                frames = [fifo.readline().split()[2] for _ in range(8)]
        self.assertIn("642#4000100000000000", frames)
        self.check_served_and_ended(simulator)

    def test_log_is_whole_once_it_is_read(self):
        simulator = self.start("--log", f"/dev/fd/{self.pipe.into}")
        with simulator.window() as window:
            self.assertEqual(window.execute(READ, 0x42, 0x1000, 0, 4), 0)
        self.assertRegex(self.pipe.read_until("5C2#4300100091010F00\n"), r"\A(\(\d{10}\.\d{6}\) virtual [0-9A-F]{3}#[0-9A-F]{0,16}\n)+\Z")
        self.assertEqual(simulator.stop(), (0, ""))

    def test_frames_that_nobody_reads_are_counted_and_told(self):
        simulator = self.start("--log", f"/dev/fd/{self.pipe.into}")
        healthy = Healthy(simulator.port)
        healthy.wait_for(1000)  # 36 frames of 40 characters each, and 1 MiB waits
        healthy.finish()
        with os.fdopen(os.dup(self.pipe.out), "rb", buffering=0) as pipe:
            os.set_blocking(self.pipe.out, False)
            def told():
                pipe.read(65536)
                return simulator.errors()
            self.assertRegex(wait_until(told, "a line about missing frames")[0], r": \d{4,} frames are missing: they were not read in time\Z")
        self.check_served_and_ended(simulator)

    def test_standard_error(self):
        simulator = Simulator(PROGRAM, "--demo", "--control", "127.0.0.1:0", stderr=self.pipe.into, test=self)
        with simulator.connect("control") as control:
            control.sendall(b"fault 0x42 abort code=0x08000021 count=1\n")
            self.assertEqual(control.recv(100), b"ok 1\n")
        with simulator.window() as window:
            self.assertEqual(window.execute(READ, 0x42, 0x1000, 0, 4), 4)
        self.assertIn("node 66: fault 1: abort", self.pipe.read_until("5C2#4300100091010F00\n"))
        self.assertEqual(simulator.stop()[0], 0)

    def start_on_a_manual_clock(self, folder):
        process = subprocess.Popen([PROGRAM, *STANDING, "--control", f"unix:{folder}/control"], stdin=subprocess.PIPE, stdout=self.pipe.into,
                                   text=True, preexec_fn=die_with_parent)
        self.addCleanup(process.wait)
        self.addCleanup(process.stdin.close)
        self.addCleanup(process.kill)
        wait_until(lambda: pathlib.Path(f"{folder}/control").exists(), "it to listen")
        return process

    def test_standard_output_stuck(self):
        process = self.start_on_a_manual_clock(self.folder)
        process.stdin.write(100 * "pass 1s\n")
        process.stdin.flush()
        process.send_signal(signal.SIGTERM)
        self.assertEqual(process.wait(LIMIT), 0)

    def test_standard_output_read_late(self):
        process = self.start_on_a_manual_clock(self.folder)
        process.stdin.write(5000 * "pass 1s\n")
        process.stdin.flush()
        lines = self.pipe.read_until("at 5000.000000\n").splitlines()
        self.assertEqual(lines[1:], [f"at {second}.000000" for second in range(1, 5001)])


class Full(cases.Case):
    def run_into_full(self, *options, lines=""):
        with open("/dev/full", "w", encoding="ascii") as full:
            return ran(PROGRAM, *options, input=lines, capture_output=False, stdout=full, stderr=subprocess.PIPE)

    def test_standard_output(self):
        for options in (["--help"], ["--demo", "--modbus", "127.0.0.1:0"]):
            done = self.run_into_full(*options)
            self.assertEqual((done.returncode, done.stderr), (3, "cbcan-sim: standard output: " + FULL))

    def test_a_recording_that_cannot_be_written_or_is_not_read(self):
        fifo = self.folder / "fifo"
        os.mkfifo(fifo)
        reader = os.open(fifo, os.O_RDONLY | os.O_NONBLOCK)
        self.addCleanup(os.close, reader)
        for path, reason, lines in (("/dev/full", "No space left on device", "pass 1s\n"),
                                    (fifo, "it is not read", 40_000 * "set 0x42 0x6401:1 5\n")):
            done = ran(PROGRAM, *STANDING, "--record", path, input=lines)
            self.assertEqual((done.returncode, done.stderr.partition("cbcan-sim: ")[2]),
                             (0, f"record {path}: {reason}; the recording ends here, the simulation goes on; make room, or "
                                 "record into another file\n"))

    def test_standard_error_is_nobodys_business(self):
        with open("/dev/full", "w", encoding="ascii") as full:
            done = ran(PROGRAM, *STANDING, "--verbose", input="pass 1s\n", capture_output=False, stdout=subprocess.PIPE, stderr=full)
        self.assertEqual((done.returncode, done.stdout.splitlines()[1:]), (0, ["at 1.000000"]))


class AWeekOfLogs(cases.Case):
    def lines(self, name):
        return (self.folder / name).read_text().splitlines()

    def test_a_log_turns_over_at_its_size(self):
        done(PROGRAM, "--demo", "--no-module", "--clock", "manual", "--log", self.folder / "bus.log", "--set", "log.rotate_mb=1",
             input="fault 66 boot-up-storm interval_ms=1\npass 36s\n")
        older = self.folder / "bus.log.1"
        self.assertTrue(900_000 < older.stat().st_size <= 1_000_000, older.stat())
        self.assertEqual(sum(line.endswith(" 742#00") for line in self.lines(older) + self.lines("bus.log")), 36_002)

    def test_the_next_program_continues_a_log(self):
        for number in (1, 2):
            Simulator(PROGRAM, "--demo", "--log", self.folder / "bus.log", log=False).stop()
            self.assertEqual(sum(line.endswith(" 742#00") for line in self.lines("bus.log")), number)


class StandardOutput(cases.Case):
    def test_the_log_on_standard_output(self):
        process = subprocess.Popen([PROGRAM, "--demo", "--modbus", "127.0.0.1:0", "--log", "-"], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                                   text=True)
        self.assertTrue(process.stderr.readline().startswith("ready modbus="))
        self.assertRegex(process.stdout.readline(), r"^\(\d{10}\.\d{6}\) virtual 701#00\n$")
        process.terminate()
        process.communicate(timeout=LIMIT)


cases.main()
