#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""The window through mbpoll, 1-based as it is by default and 0-based with -0."""

import pathlib
import re
import subprocess
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
import cases
from simulator import Simulator, program_from_arguments

PROGRAM = program_from_arguments(sys.argv)


class Mbpoll(unittest.TestCase):
    def setUp(self):
        self.simulator = Simulator(PROGRAM, "--demo", test=self)

    def mbpoll(self, *arguments):
        command = ["mbpoll", "-q", "-m", "tcp", "-p", str(self.simulator.port), "-1", "-o", "10", *arguments]
        done = subprocess.run(command, capture_output=True, text=True, timeout=60)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        # A value above 32767 is followed by its signed reading.
        return [int(value) for value in re.findall(r"^\[\d+\]:\s+(\d+)", done.stdout, re.MULTILINE)]

    def test_write_then_read_counted_from_0(self):
        self.mbpoll("-0", "-r", "3700", "127.0.0.1", str(0xCA0E), "5066", "66", str(0x6411), "1", "2", "300")
        self.assertEqual(self.mbpoll("-0", "-r", "3700", "-c", "1", "127.0.0.1"), [0])
        self.mbpoll("-0", "-r", "3700", "127.0.0.1", str(0xCA0E), "5055", "66", str(0x6411), "1", "128")
        self.assertEqual(self.mbpoll("-0", "-r", "3700", "-c", "7", "127.0.0.1"), [0, 5055, 66, 0x6411, 1, 2, 300])

    def test_read_counted_from_1(self):
        self.mbpoll("-r", "3701", "127.0.0.1", str(0xCA0E), "5055", "32", str(0x3333), "0", "4")
        self.assertEqual(self.mbpoll("-r", "3701", "-c", "1", "127.0.0.1"), [4])
        self.assertEqual(self.mbpoll("-r", "3707", "-c", "2", "127.0.0.1"), [0x0000, 0x0602])


cases.main()
