#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""The example program of CiA 405's SoMachine library: a ramp to two drives, read back from one of them."""

from st_bench import BlockTest
import cases
from plc import ROOT

EDS = str(ROOT / "tests/st/plant/ramp_drive.eds")


class Ramp(BlockTest):
    options = ("--node", f"1={EDS}", "--node", f"2={EDS}")
    arguments = {"files": ("cia405.st", "cia405_codesys.st", "ramp.st"), "main": "Read_Write_SDO"}

    def setUp(self):
        super().setUp()
        self.plc.runs_program = True
        self.program = self.plc.machine.programs["MAIN"][1]

    def written(self, node):
        """The values sent to the node, from the bus log."""
        head = f"60{node}#2B3C2002"
        return [int(text[14:16] + text[12:14], 16) for text in self.plc.frames() if text.startswith(head)]

    def test_until_the_ramp_has_wrapped(self):
        self.plc.scan(20)
        self.assertEqual((self.program["SDOWRITE_DATA"], self.written(1), self.plc.registers[0]), (0, [], 0))
        self.program["START_TEST"] = True
        read = []
        for _ in range(1100):
            self.plc.scan()
            if self.program["READSDO_ATV31"]["CONFIRM"]:
                read.append(self.program["SDOREAD_DATA"])
            for name in ("WRITESDO_ATV31", "WRITESDO_ATV71", "READSDO_ATV31"):
                self.assertEqual(self.program[name]["ERROR"], 0, name)
        for node in (1, 2):
            values = self.written(node)
            wraps = [i for i in range(1, len(values)) if values[i] < values[i - 1]]
            self.assertEqual(len(wraps), 2, f"node {node}: 1100 scans are two rounds of 501 and a part of the third")
            self.assertGreater(min(values[i - 1] for i in wraps), 480)
            self.assertLessEqual(max(values), 500)
            self.assertGreater(len(values), 100)
        # Node 1 is read after each write: the values read are those written, in the same order.
        sent = self.written(1)
        self.assertTrue(set(read) <= {0, *sent})
        self.assertGreater(len(read), 100)
        self.assertLessEqual(abs(len(self.written(1)) - len(self.written(2))), 1, "the blocks take turns")
        self.program["START_TEST"] = False
        self.plc.scan(50)
        count = len(self.written(1))
        self.plc.scan(50)
        self.assertEqual(len(self.written(1)), count)


cases.main()
