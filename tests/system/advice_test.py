#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Advice names each mistake of a program in its first run, and a correct program gets none in a minute of the plant's time, or ten with CBCAN_LONG."""

import os
import pathlib
import random
import re
import struct
import sys

from tree import ROOT
sys.path.insert(0, str(ROOT / "tools/python"))
import cases
from advice_ladder import Ladder
from cbcan_plant import EXECUTE, READ, WRITE, Plant, Window
from done import ran
from simulator import LIMIT, program_from_arguments

PROGRAM = program_from_arguments()
LADDER = pathlib.Path(__file__).with_name("advice_ladder.py")
END = 600 if cases.LONG else 60  # seconds
MISTAKES = re.findall(r'^    \{\d+, "([\w-]+)"', (ROOT / "regmap/include/cbcan/mistakes.hpp").read_text(), re.MULTILINE)
ENVIRONMENT = os.environ | {"PYTHONPATH": str(ROOT / "tools/python"), "CBCAN_SIM": PROGRAM}
TEST = """import sys
sys.path.insert(0, {folder!r})
from advice_ladder import Ladder

pytest_plugins = ["cbcan_plant"]

def test_ladder(plant, window):
    Ladder(plant, window, {mistake!r}).run()
"""


class Mistakes(cases.Case):
    def kinds(self, mistake, *options):
        """In order, of the ladder program with this mistake."""
        with Plant("--demo", *options, program=PROGRAM) as plant, Window(plant) as window:
            Ladder(plant, window, mistake).run()
            return [line.split()[0] for line in plant.command("advice end")]

    def test_each_is_named_first_and_the_correct_program_gets_none(self):
        self.assertEqual(len(MISTAKES), 16)
        for timing in ("at-once", "typical"):
            for mistake in (None, *MISTAKES):
                with self.subTest(mistake=mistake, timing=timing):
                    kinds = self.kinds(mistake, "--timing", timing)
                    self.assertEqual(kinds[:1] if mistake == "address" else kinds, [mistake] if mistake else [])  # with "address" nothing is executed, and the own node not started

    @cases.in_long
    def test_explore_fails_without_a_fault(self):
        for mistake in (None, *MISTAKES):
            with self.subTest(mistake=mistake):
                ended = ran(PROGRAM, "--demo", "--explore", "--list", "--", sys.executable, LADDER, *([mistake] if mistake else []), env=ENVIRONMENT, timeout=LIMIT)
                self.assertEqual(ended.returncode, 2 if mistake else 0, ended.stderr)
                if mistake:
                    self.assertIn(f"without faults: advice {mistake}: ", ended.stderr)

    def test_pytest_warns_and_may_fail(self):
        for mistake, options, code in (("busy", (), 0), ("busy", ("-W", "error::cbcan_plant.Advice"), 1), (None, ("-W", "error::cbcan_plant.Advice"), 0)):
            with self.subTest(mistake=mistake, options=options):
                test = self.write("test_ladder.py", TEST.format(folder=str(LADDER.parent), mistake=mistake))
                ended = ran(sys.executable, "-m", "pytest", "-p", "no:cacheprovider", *options, test, env=ENVIRONMENT, cwd=self.folder, timeout=LIMIT)
                self.assertEqual(ended.returncode, code, ended.stdout)
                self.assertEqual("Advice: busy 1 1 not executed: #" in ended.stdout, mistake is not None, ended.stdout)


class Strangers(cases.Case):
    """Programs of others."""

    def setUp(self):
        self.plant = Plant("--demo", "--timing", "typical", program=PROGRAM)
        self.addCleanup(self.plant.stop)
        self.window = self.client()
        self.plant.advance("5s")
        self.random = random.Random(1)

    def tearDown(self):
        self.assertGreaterEqual(self.plant.now, END)
        self.assertEqual(self.plant.command("advice end"), [])

    def client(self, unit=1):
        window = Window(self.plant, unit)
        self.addCleanup(window.socket.close)
        return window

    def a_request(self):
        return self.random.choice([(READ, 66, 0x6000, 1, 1), (WRITE, 66, 0x6411, 1, 2, self.random.randrange(1000)), (READ, 16, 0x6041, 0, 2),
                                   (READ, 32, 0x3333, 0, 4), (READ, 0, 0x3001, 0, 1), (READ, 16, 0x300C, 0, 1), (WRITE, 0, 0x1F82, 66, 2, 5)])

    def scans(self):
        while self.plant.now < END:
            self.plant.advance("20ms")
            yield

    def test_a_cyclic_scanner(self):
        """About 500 requests in ten minutes. It prepares words in an earlier scan, writes 0 between, restarts, and looks at the diagnostics now and then."""
        out, number, restarts, wait = [0] * 8, 0, True, 0
        for scan, _ in enumerate(self.scans()):
            image = self.window.read(600, 6)
            if scan % 50 == 0:
                self.window.read(4100, 42)
                self.plant.advice()
            if restarts:
                out, restarts = [0] * 8, image[1] == 0 and image[2] == 0
                number = image[2]
            elif wait:
                wait -= 1
            elif out[0] and image[0] != out[0]:
                pass
            elif scan % 900 == 899:
                restarts = True
            elif self.random.random() < 0.2:
                out[0] = 0
                wait = 2
            else:
                out[1:] = [*self.a_request(), 0, 0][:7]
                self.window.write(500, *out)
                wait = self.random.randrange(3)
                for _ in range(wait):
                    self.plant.advance("20ms")
                    self.window.write(500, *out)
                    self.plant.advice()  # as the page asks
                number = number % 65535 + 1
                out[0] = number
                wait = 40
            self.window.write(500, *out)
        self.assertGreater(number, END * 2 // 3)

    def test_a_master_that_repeats_requests(self):
        """After 100 ms, on a new connection."""
        for _ in self.scans():
            words = self.a_request()
            for _ in range(self.random.randrange(1, 4)):
                self.window.start(*words)
                self.plant.advance("100ms")
                self.window.socket.close()
                self.window = self.client()
            while self.window.read(3700)[0] == EXECUTE:
                self.plant.advance("100ms")

    def test_masters_that_read_all_registers_and_one_that_writes(self):
        readers = [self.client() for _ in range(4)]
        for _ in self.scans():
            for reader in readers:
                reader.read(3700, 70)
                for first in range(3800, 4100, 100):
                    reader.read(first, 100)
            if self.window.read(3700)[0] != EXECUTE:
                self.window.start(*self.a_request())
            self.plant.advance("200ms")

    def test_a_program_that_waits_for_a_fixed_time(self):
        for _ in self.scans():
            self.window.start(*self.a_request())
            self.plant.advance("200ms")
            self.window.read(3700, 8)

    def test_function_code_6_alone(self):
        for _ in self.scans():
            for register, word in [*enumerate(self.a_request(), 3701), (3700, EXECUTE)]:
                self.window._request(struct.pack(">BHH", 6, register, word))
                self.plant.advance("20ms")
            while self.window.read(3700)[0] == EXECUTE:
                self.plant.advance("20ms")

    def test_function_code_23(self):
        """Each request writes words and reads all; the next one, with the outputs, reads the result."""
        def exchange(register, *words):
            pdu = struct.pack(f">BHHHHB{len(words)}H", 23, 3700, 70, register, len(words), 2 * len(words), *words)
            return struct.unpack_from(">H", self.window._request(pdu), 2)[0]

        self.assertEqual(self.window.execute(WRITE, 0, 0x1F82, 127, 2, 5), 0)
        for _ in self.scans():
            exchange(3700, EXECUTE, *self.a_request())
            while exchange(3864, self.random.randrange(100)) == EXECUTE:
                self.plant.advance("20ms")

    def test_a_program_that_cancels(self):
        for _ in self.scans():
            self.window.start(*self.a_request())
            self.plant.advance(self.random.choice(["1ms", "5ms", "100ms"]))
            self.window.write(3700, 0)
            self.plant.advance("20ms")

    def test_a_scan_of_all_nodes_and_of_objects(self):
        for node in range(1, 128):
            self.window.execute(READ, node, 0x300C, 0, 1)
            self.plant.advice()
        for index in (*range(0x1780, 0x17A0), *range(0x6030, 0x6050)):
            self.window.execute(READ, 16, index, 0, 128)
        self.plant.advance(f"{END}s")

    def test_commands_are_not_the_program(self):
        for words in ("read 42 0x300C 0 1", "read 16 6041 0 2", "write 0 0x1F82 0 2 5", "read 16 0x6064 0 2"):
            self.plant.command(f"trigger {words}")
        self.plant.command("write 3800 1 2 3")
        self.plant.command("write 3864 1 2 3")
        self.plant.advance(f"{END}s")


cases.main()
