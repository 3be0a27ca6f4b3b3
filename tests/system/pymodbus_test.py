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

# Objects of node 20h and their sizes in bytes.
OBJECTS = {0x2001: 1, 0x2002: 2, 0x2003: 3, 0x2004: 4, 0x2005: 5, 0x2008: 8, 0x200E: 14, 0x207F: 127, 0x2080: 128}


def words_of(data):
    padded = data + b"\0" * (len(data) % 2)
    return [padded[i] | padded[i + 1] << 8 for i in range(0, len(padded), 2)]


def bytes_of(words, size):
    return b"".join(word.to_bytes(2, "little") for word in words)[:size]


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

    def abort_code(self):
        low, high = self.read(3706, 2)
        return high << 16 | low

    def test_expedited_there_and_back_with_its_frames(self):
        self.assertEqual(self.execute(WRITE, 0x42, 0x6411, 1, 2, 300), 0)
        self.assertEqual(self.execute(READ, 0x42, 0x6411, 1, 2, 0), 0)
        self.assertEqual(self.read(3705, 2), [2, 300])
        self.read(3700)
        self.assertEqual(self.simulator.frames()[-4:], ["642#2B1164012C010000", "5C2#6011640100000000",
                                                        "642#4011640100000000", "5C2#4B1164012C010000"])

    def test_every_size(self):
        for index, size in OBJECTS.items():
            data = bytes((7 * i + size) & 0xFF for i in range(size))
            self.assertEqual(self.execute(WRITE, 0x20, index, 0, size, *words_of(data)), 0)
            self.write(3706, [0xFFFF] * 64)
            self.assertEqual(self.execute(READ, 0x20, index, 0, 128), 0)
            self.assertEqual(self.read(3705), [size])
            words = self.read(3706, 64)
            self.assertEqual(bytes_of(words, size), data)
            used = (size + 1) // 2
            self.assertEqual(words[used:], [0xFFFF] * (64 - used))

    def test_result_codes(self):
        self.assertEqual(self.execute(5054, 0x20, 0x2001, 0, 1), 1)
        self.assertEqual(self.execute(READ, 128, 0x2001, 0, 1), 2)
        for code, words in ((0x06020000, (READ, 0x20, 0x3333, 0, 4)), (0x06010002, (WRITE, 0x20, 0x2200, 0, 4, 1, 1)),
                            (0x06010001, (READ, 0x20, 0x2201, 0, 4)), (0x06070012, (WRITE, 0x20, 0x2001, 0, 2, 1)),
                            (0x06070010, (WRITE, 0x20, 0x2004, 0, 2, 1)), (0x06090011, (READ, 0x20, 0x1018, 9, 4)),
                            (0x06040047, (READ, 0x20, 0x2001, 0, 129)), (0x05040005, (READ, 0x20, 0x2080, 0, 127)),
                            (0x05040005, (READ, 0x20, 0x2100, 0, 128))):
            self.assertEqual(self.execute(*words), 4, words)
            self.assertEqual(self.abort_code(), code, words)

    def test_nobody_there(self):
        self.write(3700, [EXECUTE, WRITE, 0, 0x3003, 0, 2, 20])
        self.assertEqual(self.result(), 0)
        self.assertEqual(self.execute(READ, 99, 0x1000, 0, 4), 4)
        self.assertEqual(self.abort_code(), 0x05040000)
        self.simulator.wait_for_frame("663#8000100000000405")

    def test_nmt_and_states(self):
        self.assertEqual(self.execute(WRITE, 0, 0x1F82, 128, 0, 5), 0)
        for node in (1, 2, 0x20, 0x42):
            self.assertEqual(self.execute(READ, node, 0x300C, 0, 0), 0)
            self.assertEqual(self.read(3705, 2), [1, 5])
        self.assertEqual(self.execute(READ, 99, 0x300C, 0, 0), 0)
        self.assertEqual(self.read(3706), [6])

    def test_registers_one_by_one_in_any_order_execute_last(self):
        for address, word in ((3706, 77), (3705, 1), (3703, 0x2001), (3704, 0), (3702, 0x20), (3701, WRITE), (3700, EXECUTE)):
            self.assertFalse(self.client.write_register(address, word, slave=1).isError())
        self.assertEqual(self.result(), 0)
        self.assertEqual(self.execute(READ, 0x20, 0x2001, 0, 1), 0)
        self.assertEqual(self.read(3706), [77])

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
