# SPDX-License-Identifier: MIT
"""What the tests of the function blocks have in common."""

import socket
import sys
import unittest

from plc import ROOT, Plc
from simulator import LIMIT, program_from_arguments

PROGRAM = program_from_arguments(sys.argv)
NODE = 0x20  # the generic node of the demo plant
# The ten blocks, with inputs that they end well with.
ALL = {"NMT": {"STATE": 5}, "RECV_EMCY": {}, "RECV_EMCY_DEV": {"DEVICE": 5}, "GET_LOCAL_NODE_ID": {}, "GET_CANOPEN_KERNEL_STATE": {},
       "GET_STATE": {}, "SDO_READ4": {"DEVICE": NODE, "INDEX": 0x2001},
       "SDO_READ_BUFFER": {"DEVICE": NODE, "INDEX": 0x2005, "DATALENGTH": 5},
       "SDO_WRITE_BUFFER": {"DEVICE": NODE, "INDEX": 0x2005, "DATALENGTH": 5},
       "SDO_WRITE4": {"DEVICE": NODE, "INDEX": 0x2001, "DATALENGTH": 1}}
GENERIC = str(ROOT / "plants/demo/generic.eds")
OK, OTHER, OVERFLOW, TIMEOUT, BUS_OFF, ERROR_PASSIVE, INTERNAL = 0, 1, 2, 3, 0x10, 0x11, 0x21


class BlockTest(unittest.TestCase):
    options = ("--demo",)
    arguments = {}

    def setUp(self):
        self.plc = self.start(*self.options, **self.arguments)

    def start(self, *options, **arguments):
        plc = Plc(PROGRAM, *options, **arguments)
        self.addCleanup(plc.close)
        plc.pass_time(100000)  # boot-up messages
        return plc

    def check(self, block, confirm, error, **outputs):
        found = {name: block[name] for name in outputs}
        self.assertEqual((block["CONFIRM"], block["ERROR"], found), (confirm, error, outputs), block.block.name)

    def good(self, block, **outputs):
        """One execution that ends well."""
        block.set(ENABLE=True)
        scans = self.plc.run(block)
        self.check(block, True, OK, **outputs)
        return scans

    def bad(self, block, error, **outputs):
        block.set(ENABLE=True)
        scans = self.plc.run(block)
        self.check(block, False, error, **outputs)
        return scans

    def off(self, block, **outputs):
        """ENABLE = FALSE: all outputs are 0."""
        block.set(ENABLE=False)
        self.plc.scan()
        self.check(block, False, OK, **outputs)

    def new_frames(self):
        """Those since this was asked last."""
        frames = self.plc.frames()
        found, self.seen = frames[getattr(self, "seen", 0):], len(frames)
        return found

    def send(self, frame):
        """Puts "0A0#1122" on the bus, by an adapter at the place that --slcan names."""
        host, port = self.plc.simulator.where["slcan"].rsplit(":", 1)
        identifier, data = frame.split("#")
        with socket.create_connection((host, int(port)), timeout=LIMIT) as adapter:
            adapter.sendall(f"O\rt{identifier}{len(data) // 2}{data}\r".encode())
            self.assertEqual([adapter.recv(1) for _ in range(3)], [b"\r", b"z", b"\r"])
        self.plc.pass_time(1000)
