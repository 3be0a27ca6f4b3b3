#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""CAN adapters over sockets: python-can's slcan interface."""

import pathlib
import sys
import unittest

import can

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
import cases
from simulator import LIMIT, Simulator, program_from_arguments, wait_until

PROGRAM = program_from_arguments(sys.argv)
READ = 5055


class PythonCan(unittest.TestCase):
    def start(self, *options, slcan="127.0.0.1:0", **keywords):
        self.simulator = Simulator(PROGRAM, "--slcan", slcan, *options, **keywords, test=self)
        self.slcan = self.simulator.ready.split("slcan=")[1]

    def python_can(self, **options):
        bus = can.Bus(interface="slcan", channel=f"socket://{self.slcan}", sleep_after_open=0, **options)
        self.addCleanup(bus.shutdown)
        # O is answered before V: frames are received from now on.
        self.assertEqual(bus.get_version(LIMIT), (10, 13))
        return bus

    def test_a_node_and_its_heartbeat(self):
        self.start("--demo")
        bus = self.python_can(bitrate=500000)
        bus.send(can.Message(arbitration_id=0x620, is_extended_id=False, data=bytes.fromhex("4018100000000000")))
        self.assertEqual(self.next(bus, 0x5A0).data.hex(), "4f18100004000000")
        self.assertEqual(bus.get_serial_number(LIMIT), "CB01")

    def next(self, bus, identifier):
        message = wait_until(lambda: bus.recv(timeout=1), "a frame")
        while message.arbitration_id != identifier:
            message = wait_until(lambda: bus.recv(timeout=1), f"a frame {identifier:X}")
        return message

    def test_a_node_played_by_python_can(self):
        self.start()
        bus = self.python_can()
        with self.simulator.window() as window:
            window.start(READ, 0x33, 0x2000, 1, 4)
            self.assertEqual(self.next(bus, 0x633).data.hex(), "4000200100000000")
            bus.send(can.Message(arbitration_id=0x5B3, is_extended_id=False, data=bytes.fromhex("43002001EFBEADDE")))
            self.assertEqual(window.result(), 0)
            self.assertEqual(window.read(3705, 3), [4, 0xBEEF, 0xDEAD])

    def test_every_kind_of_frame_between_two(self):
        self.start()
        left, right = self.python_can(), self.python_can(bitrate=250000)
        for message in (can.Message(arbitration_id=0x7FF, is_extended_id=False, data=bytes(range(8))),
                        can.Message(arbitration_id=0x1ABCDEF0, is_extended_id=True, data=b"\xff"),
                        can.Message(arbitration_id=0x42, is_extended_id=False, is_remote_frame=True, dlc=1),
                        can.Message(arbitration_id=0x42, is_extended_id=True, is_remote_frame=True, dlc=8)):
            left.send(message)
            heard = self.next(right, message.arbitration_id)
            self.assertTrue(heard.equals(message, timestamp_delta=None, check_direction=False), heard)


cases.main()
