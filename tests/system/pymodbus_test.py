#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""The window through Debian's python3-pymodbus: what a SCADA program in Python does."""

import pathlib
import sys
import unittest

from pymodbus.client import ModbusTcpClient

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
import cases
from simulator import Simulator, program_from_arguments, wait_until

PROGRAM = program_from_arguments(sys.argv)

READ, WRITE, EXECUTE = 5055, 5066, 0xCA0E


class Pymodbus(unittest.TestCase):
    def setUp(self):
        self.simulator = Simulator(PROGRAM, "--demo", test=self)
        self.client = ModbusTcpClient("127.0.0.1", port=self.simulator.port, timeout=60)
        self.assertTrue(self.client.connect())
        self.addCleanup(self.client.close)

    def read(self, address, count=1, unit=1):
        response = self.client.read_holding_registers(address, count, slave=unit)
        self.assertFalse(response.isError(), response)
        return response.registers

    def write(self, address, words, unit=1):
        self.assertFalse(self.client.write_registers(address, words, slave=unit).isError())

    def result(self):
        wait_until(lambda: self.read(3700)[0] != EXECUTE, "a result in R3700")
        return self.read(3700)[0]

    def execute(self, *words):
        self.write(3700, [EXECUTE, *words])
        return self.result()

    def test_expedited_there_and_back_with_its_frames(self):
        self.assertEqual(self.execute(WRITE, 0x42, 0x6411, 1, 2, 300), 0)
        self.assertEqual(self.execute(READ, 0x42, 0x6411, 1, 2, 0), 0)
        self.assertEqual(self.read(3705, 2), [2, 300])
        self.read(3700)
        self.assertEqual(self.simulator.frames()[-4:], ["642#2B1164012C010000", "5C2#6011640100000000",
                                                        "642#4011640100000000", "5C2#4B1164012C010000"])

    def test_mask_write_and_read_write(self):
        self.write(3701, [READ, 0x20, 0x2001, 0, 1])
        response = self.client.mask_write_register(address=3700, and_mask=0x0000, or_mask=EXECUTE, slave=1)
        self.assertFalse(response.isError())
        self.assertEqual(self.result(), 0)
        response = self.client.readwrite_registers(read_address=3701, read_count=2, write_address=3700,
                                                 write_registers=[EXECUTE, READ, 0x42, 0x1000, 0, 4], slave=1)
        self.assertEqual(response.registers, [READ, 0x42])
        self.assertEqual(self.result(), 0)
        self.assertEqual(self.read(3706)[0] & 0xFFFF, 0x0191)  # device profile 401

    def test_the_network_s_units_and_the_edges_of_the_register_file(self):
        for unit in (0, 1, 255):
            self.write(4167, [unit], unit=unit)
            self.assertEqual(self.read(4167, unit=unit), [unit])
        self.assertTrue(self.client.read_holding_registers(4168, 1, slave=1).isError())
        self.assertTrue(self.client.read_coils(0, 1, slave=1).isError())


cases.main()
