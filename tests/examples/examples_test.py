#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""The master and the slave of examples/ on one bus, with the demo plant's pressure transducer; python-can observes. The bus is that of an SLCAN
adapter, or the CAN interface that CBCAN_VCAN names.

usage: examples_test.py CBCAN_SIM SLAVE MASTER
"""

import os
import subprocess

import can

import cases
from done import done
from mcu import die_with_parent
from simulator import LIMIT, Simulator, program_from_arguments, wait_until
from tree import ROOT

SIMULATOR, SLAVE, MASTER = program_from_arguments(3)
VCAN = os.environ.get("CBCAN_VCAN")
PLANT = f"""[module]
enabled = false
[[node]]
id = 1
eds = "{ROOT}/plants/demo/pressure_transducer.eds"
objects = [{{ index = 0x9130, sub = 1, value = 99021 }}]
"""


class Examples(cases.Case):
    def setUp(self):
        plant = self.write("plant.toml", PLANT)
        if VCAN:
            Simulator(SIMULATOR, "--config", plant, "--can", f"socketcan:{VCAN}", log=False, test=self)
            self.words, self.bus = [VCAN], can.Bus(interface="socketcan", channel=VCAN)
        else:
            where = Simulator(SIMULATOR, "--config", plant, "--slcan", "127.0.0.1:0", log=False, test=self).where["slcan"]
            self.words, self.bus = where.split(":"), can.Bus(interface="slcan", channel=f"socket://{where}", sleep_after_open=0)
            self.assertEqual(self.bus.get_version(LIMIT), (10, 13))  # O is answered before
        self.addCleanup(self.bus.shutdown)

    def start(self, program):
        process = subprocess.Popen([program, *self.words], stdout=subprocess.PIPE, text=True, preexec_fn=die_with_parent)
        self.addCleanup(process.stdout.close)
        self.addCleanup(process.wait)
        self.addCleanup(process.kill)
        return process

    def hear(self, frame):
        """Waits for a frame, "742#00"."""
        def heard():
            message = self.bus.recv(timeout=1)
            return message and f"{message.arbitration_id:03X}#{message.data.hex().upper()}" == frame
        wait_until(heard, frame)

    def send(self, identifier, data):
        self.bus.send(can.Message(arbitration_id=identifier, is_extended_id=False, data=bytes.fromhex(data)))

    def test_the_master_boots_two_slaves_and_reports_that_one_is_lost_and_returns(self):
        slave = self.start(SLAVE)
        self.hear("742#00")
        master = self.start(MASTER)
        lines = {master.stdout.readline(), master.stdout.readline()}
        self.assertEqual(lines, {"node 66 runs\n", "node 1 runs\n"})
        self.assertEqual(master.stdout.readline(), "outputs written\n")
        self.assertEqual(master.stdout.readline(), "pressure 99021\n")
        slave.kill()
        self.assertEqual(master.stdout.readline(), "node 66 does not run\n")
        self.start(SLAVE)
        self.assertEqual(master.stdout.readline(), "node 66 runs\n")

    def test_the_slave_sends_its_inputs_after_changes(self):
        self.start(SLAVE)
        self.hear("742#00")
        self.send(0x000, "0142")
        self.hear("1C2#5A")  # its inputs
        self.hear("2C2#D204FEFF")
        self.send(0x642, "2F026001FF000000")  # polarity of the inputs
        self.hear("5C2#6002600100000000")
        self.hear("1C2#A5")
        self.send(0x642, "4000600100000000")
        self.hear("5C2#4F006001A5000000")

    def test_without_a_bus_they_say_so(self):
        for program in (SLAVE, MASTER):
            for arguments, code, text in (([], 2, f"usage: {program} INTERFACE | HOST PORT\n"),
                                          (["none0"], 1, "none0: no such CAN interface; `ip link` lists them\n"),
                                          (["127.0.0.1", "1"], 1, "127.0.0.1 1: nothing listens there; start cbcan-sim --slcan 127.0.0.1:1\n")):
                self.assertEqual(done(program, *arguments, code=code, timeout=LIMIT).stderr, text)

    def test_the_slave_watches_the_master(self):
        self.start(SLAVE)
        self.hear("742#00")
        self.send(0x642, "2316100164007F00")  # node 127 within 100 ms
        self.hear("5C2#6016100100000000")
        self.send(0x77F, "05")
        self.hear("0C2#3081110000000000")


cases.main()
