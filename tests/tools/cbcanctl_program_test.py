#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""cbcanctl program, with simulated nodes that have 1F50h; and a fleet of them in a scenario. In virtual time."""

import binascii

import cases
import ctl
from ctl import ABSENT, CBCANCTL, DONE, REFUSED, USAGE
from done import ran
from simulator import Simulator, program_from_arguments
from tree import ROOT

CBCAN_SIM = program_from_arguments()
EDS = ROOT / "examples/slave/updatable.eds"
IMAGE = "0123456789abcdef" * 80 + "the end"
CRC = binascii.crc32(IMAGE.encode())

FLEET = """
node = [ {{ id = 5, eds = "{eds}" }}, {{ id = 6, eds = "{eds}" }} ]
step = [
  {{ do = "trigger write 5 0x1F51 1 1 0", wait = ["transaction ended", "frame 705#00"] }},
  {{ do = "trigger write 6 0x1F51 1 1 0", wait = ["transaction ended", "frame 706#00"] }},
  {{ do = "trigger write 5 0x1F51 1 1 3", wait = "transaction ended" }},
  {{ do = "trigger write 6 0x1F51 1 1 3", wait = "transaction ended", expect = "register 3700 = 0" }},
  {{ do = "trigger write 5 0x1F50 1 4 1 2", wait = "transaction ended", expect = ["register 3700 = 0", "took > 300ms"] }},
  {{ do = ["power 6 off", "power 6 on"], expect = "frame 706#00" }},  # before its download
  {{ do = "trigger write 5 0x1F51 1 1 1", wait = ["transaction ended", "frame 705#00"] }},
  {{ do = "trigger read 5 0x1F51 1 1", wait = "transaction ended", {must} = "register 3705 = 1 1" }},
  {{ do = "trigger read 6 0x1F51 1 1", wait = "transaction ended", expect = "register 3705 = 1 0" }},
]
"""


class Program(ctl.Case):
    def plant(self, faults):
        return self.write("plant.toml", f"""
            can.bit_rate = 0
            node = [ {{ id = 5, eds = "{EDS}", faults = [ {faults} ] }}, {{ id = 6, eds = "{ROOT}/plants/demo/generic.eds" }} ]""")

    def update(self, *arguments, faults=""):
        """In virtual time: (exit code, standard output, standard error)."""
        done = ran(CBCAN_SIM, "--config", self.plant(faults), "--clock", "manual", "--", CBCANCTL, "program", *map(str, arguments))
        return done.returncode, done.stdout, done.stderr

    def test_a_program_is_replaced(self):
        image = self.write("image.bin", IMAGE)
        self.assertEqual(self.update(5, image)[:2], (DONE, f"5 runs its new program: 1287 bytes, CRC {CRC:08X}h\n"))
        self.assertEqual(self.update(5, image, "--json")[:2], (DONE, f'{{"node": 5, "bytes": 1287, "crc": {CRC}}}\n'))

    def test_with_faults_of_the_node(self):
        image = self.write("image.bin", IMAGE)
        for faults, code, said in (
                ('{ kind = "response-never", index = 0x1F51, after = 1, count = 1 }', DONE, ""),  # it restarts before it responds
                ('{ kind = "response-other-specifier", specifier = 3, index = 0x1F51, after = 2, count = 1 }', DONE, ""),  # to the stop
                ('{ kind = "power", after = 3, for_ms = 50, count = 1 }', DONE, ""),  # it restarts and loses the stop
                ('{ kind = "refuse", index = 0x1F51, code = 0x08000022, after = 1, count = 3 }', DONE, ""),
                ('{ kind = "refuse", index = 0x1F51, code = 0x08000022, after = 1, count = 4 }', REFUSED,
                 "cbcanctl: node 5: clear: 0800 0022h ABORT_DEVICE_STATE"),
                ('{ kind = "abort", index = 0x1F50, code = 0x06060000, after = 30, count = 1 }', REFUSED,
                 "cbcanctl: node 5: 1F50h, byte 128; does it take pieces of 128 bytes?: 0606 0000h"),
                ('{ kind = "power", after = 60, for_ms = 50, count = 1 }', REFUSED, "cbcanctl: node 5: 1F50h, byte "),
                ('{ kind = "silent", after = 100 }', ABSENT, "cbcanctl: node 5: 1F50h, byte 512: 0504 0000h")):
            with self.subTest(faults):
                done = self.update(5, image, faults=faults)
                self.assertEqual(done[0], code, done)
                self.assertIn(said, done[2])

    def test_refusals(self):
        image, empty = self.write("image.bin", IMAGE), self.write("empty.bin", "")
        for arguments, code, said in (
                ((6, image), REFUSED, "cbcanctl: node 6: 1F51h:01: 0602 0000h"),
                ((9, image), ABSENT, "cbcanctl: node 9: 1F51h:01: 0504 0000h"),
                ((0, image), USAGE, "cbcanctl: NODE 0: write 1..127\n"),
                ((5, empty), USAGE, f"cbcanctl: {empty}: is empty\n"),
                ((5, "none.bin"), USAGE, "cbcanctl: none.bin: cannot be read")):
            with self.subTest(arguments):
                done = self.update(*arguments)
                self.assertEqual((done[0], done[1]), (code, ""), done)
                self.assertTrue(done[2].startswith(said), done)

    def test_an_interrupt_says_what_it_leaves_and_the_next_update_works(self):
        image = self.write("image.bin", IMAGE)
        simulator = Simulator(CBCAN_SIM, "--config", self.plant('{ kind = "response-never", index = 0x1F50, count = 1 }'), test=self)
        control = ctl.start(simulator.port, "program", 5, image, "--timeout", 60000)
        simulator.wait_for_frame("605#21501F0180000000")
        self.check_interrupted(control, "cbcanctl: cancelled: 0 written to R3700; node 5 may have no program now\n")
        ctl.run(simulator.port, "nmt", "reset-node", 5)  # its boot-up message ends the quarantine of 60 s
        self.assertEqual(ctl.run(simulator.port, "program", 5, image).returncode, DONE)

    def test_a_fleet_in_a_scenario_with_a_cut_in_the_middle(self):
        done = ran(CBCAN_SIM, "run", self.write("fleet.toml", FLEET.format(eds=EDS, must="expect")))
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)

    def test_a_search_finds_a_cut_that_leaves_a_node_without_its_program(self):
        done = ran(CBCAN_SIM, "run", self.write("fleet.toml", FLEET.format(eds=EDS, must="must")), "--explore")
        self.assertIn("register 3705 = 1 1", done.stdout + done.stderr)
        self.assertEqual(done.returncode, 1, done.stdout + done.stderr)


if __name__ == "__main__":
    cases.main()
