# SPDX-License-Identifier: MIT
"""Common to the tests of the function blocks."""

import unittest

from plc import Plc
from simulator import program_from_arguments

PROGRAM = program_from_arguments()
NODE = 0x20  # the generic node of the demo plant
# The ten blocks, with inputs that succeed.
ALL = {"NMT": {"STATE": 5}, "RECV_EMCY": {}, "RECV_EMCY_DEV": {"DEVICE": 5}, "GET_LOCAL_NODE_ID": {}, "GET_CANOPEN_KERNEL_STATE": {},
       "GET_STATE": {}, "SDO_READ4": {"DEVICE": NODE, "INDEX": 0x2001},
       "SDO_READ_BUFFER": {"DEVICE": NODE, "INDEX": 0x2005, "DATALENGTH": 5},
       "SDO_WRITE_BUFFER": {"DEVICE": NODE, "INDEX": 0x2005, "DATALENGTH": 5},
       "SDO_WRITE4": {"DEVICE": NODE, "INDEX": 0x2001, "DATALENGTH": 1}}
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
        """One successful execution."""
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
