#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""CAN adapters over sockets: python-can's slcan interface as a client that nobody here wrote, and bare sockets for what it cannot do."""

import pathlib
import socket
import struct
import sys
import unittest

import can

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
import cases
from healthy import Healthy
from simulator import LIMIT, Simulator, program_from_arguments, wait_until

PROGRAM = program_from_arguments(sys.argv)
READ = 5055


class Adapter:
    """A connection for whatever characters."""

    def __init__(self, address):
        host, port = address.rsplit(":", 1)
        self.socket = socket.create_connection((host, int(port)))
        self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.socket.settimeout(LIMIT)

    def send(self, text):
        self.socket.sendall(text.encode("latin-1"))

    def receive(self, count):
        text = b""
        while len(text) < count:
            part = self.socket.recv(count - len(text))
            if not part:
                break
            text += part
        return text.decode("latin-1")

    def ask(self, text, count):
        self.send(text)
        return self.receive(count)

    def leave(self):
        self.socket.close()

    def reset(self):
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        self.socket.close()


class Case(unittest.TestCase):
    def start(self, *options, slcan="127.0.0.1:0", **keywords):
        self.simulator = Simulator(PROGRAM, "--slcan", slcan, *options, **keywords, test=self)
        self.slcan = self.simulator.ready.split("slcan=")[1]

    def adapter(self):
        adapter = Adapter(self.slcan)
        self.addCleanup(adapter.leave)
        return adapter

    def python_can(self, **options):
        bus = can.Bus(interface="slcan", channel=f"socket://{self.slcan}", sleep_after_open=0, **options)
        self.addCleanup(bus.shutdown)
        # O is answered before V: from now on the frames come.
        self.assertEqual(bus.get_version(LIMIT), (10, 13))
        return bus


class PythonCan(Case):
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


class Serving(Case):

    def test_nodes_without_a_module(self):
        self.start("--demo", "--no-module")
        self.assertRegex(self.simulator.ready, r"\Aready can=virtual slcan=127\.0\.0\.1:\d+\Z")
        adapter = self.adapter()
        self.assertEqual(adapter.ask("O\rt62084018100000000000\r", 1 + 2 + 22), "\rz\rt5A084F18100004000000\r")
        self.assertEqual(adapter.ask("t67F84000100000000000\rV\r", 2 + 6), "z\rV1013\r")  # nobody has node ID 127


class Abuse(Case):
    def setUp(self):
        self.start("--demo")
        self.healthy = Healthy(self.simulator.port)
        self.witness = self.adapter()
        self.assertEqual(self.witness.ask("L\r", 1), "\r")

    def tearDown(self):
        self.healthy.wait_for(5)
        self.healthy.finish()
        self.assertIsNone(self.simulator.process.poll(), "the simulator has ended")
        self.assertEqual(self.simulator.stop(), (0, ""))

    def check_served(self):
        adapter = self.adapter()
        self.assertEqual(adapter.ask("V\rO\rt7E5100\rC\r", 10), "V1013\r\rz\r\r")
        adapter.leave()

    def test_resets_and_reconnects(self):
        for i in range(300):
            adapter = Adapter(self.slcan)
            adapter.send(("", "O\r", "O\rt12", "O\r" + 50 * "t7E50\r")[i % 4])
            adapter.reset() if i % 2 else adapter.leave()
        self.check_served()

    def test_300_adapters(self):
        self.healthy.pause()
        adapters = [Adapter(self.slcan) for _ in range(300)]
        for adapter in adapters:
            self.assertEqual(adapter.ask("O\r", 1), "\r")
        adapters[0].send("t7E50\r")
        for adapter in adapters[1:]:
            self.assertEqual(adapter.receive(6), "t7E50\r")
        self.healthy.go_on()
        for adapter in adapters:
            adapter.leave()
        self.check_served()


cases.main()
