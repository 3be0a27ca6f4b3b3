#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Faults of the PLC: its Modbus requests, its program and the module's power."""

import os
import subprocess
import sys

from tree import ROOT
sys.path.insert(0, str(ROOT / "tools/python"))
import cases
from cbcan_plant import READ, Plant, PlantError, Window
from simulator import LIMIT, program_from_arguments

PROGRAM = program_from_arguments()
CLOSED = "the plant has closed the Modbus connection"


class Faults(cases.Case):
    def plant(self, *faults):
        plant = Plant("--demo", *(word for fault in faults for word in ("--fault", f"plc:{fault}")), program=PROGRAM)
        self.addCleanup(plant.stop)
        return plant

    def window(self, plant):
        window = Window(plant)
        self.addCleanup(window.socket.close)
        return window

    def test_cut_executes_the_request_and_has_no_response(self):
        plant = self.plant("cut count=1")
        self.assertRaisesRegex(PlantError, CLOSED, self.window(plant).write, 3710, 7)
        self.assertEqual(self.window(plant).read(3710), [7])

    def test_cut_before_does_not_execute_it(self):
        plant = self.plant("cut-before count=1")
        self.assertRaisesRegex(PlantError, CLOSED, self.window(plant).write, 3710, 7)
        self.assertEqual(self.window(plant).read(3710), [0])

    def test_exception_does_not_execute_it(self):
        plant = self.plant("exception count=1", "exception code=6 after=1 count=1")
        window = self.window(plant)
        self.assertRaisesRegex(PlantError, "Modbus exception 4", window.write, 3710, 7)
        self.assertRaisesRegex(PlantError, "Modbus exception 6", window.write, 3710, 8)
        self.assertEqual(window.read(3710), [0])

    def test_late_lets_the_time_of_the_plant_pass(self):
        plant = self.plant("late count=1")
        window = self.window(plant)
        window.start(READ, 66, 0x1000, 0, 4)
        self.assertEqual(plant.now, 0.5)
        self.assertEqual(window.result(), 0)

    def test_matching_are_changes_and_the_first_read_after_each(self):
        plant = self.plant("cut after=3")
        window = self.window(plant)
        for _ in range(5):
            window.read(3700)
        window.write(3710, 1)  # the first
        for _ in range(5):
            window.write(3710, 1)  # changes nothing, as do FC 6, FC 22, FC 15 and FC 23
            for pdu in (b"\x06\x0E\x7E\x00\x01", b"\x16\x0E\x7E\xFF\xFF\x00\x00", b"\x0F\x00\x00\x00\x08\x01\x00", b"\x17\x0E\x74\x00\x01\x0E\x7E\x00\x01\x02\x00\x01"):
                window._request(pdu)
        for _ in range(5):
            window.read(3700)  # the second, and four that do not count
        window.write(3710, 2)  # the third
        self.assertRaisesRegex(PlantError, CLOSED, window.read, 3700)

    def test_restart_of_the_module(self):
        plant = self.plant("module-restart after=2 count=1")
        window = self.window(plant)
        self.assertEqual(window.execute(READ, 66, 0x1000, 0, 4), 0)
        self.assertRaisesRegex(PlantError, CLOSED, window.write, 3720, 5)
        self.assertEqual(self.window(plant).read(3700, 21), [0] * 21)
        self.assertEqual(self.window(plant).execute(READ, 66, 0x1000, 0, 4), 0)

    def test_restart_of_the_program(self):
        started = self.folder / "started"
        program = ("import os, sys\nfrom cbcan_plant import Plant, Window\nplant = Plant.around()\nwindow = Window(plant)\n"
                   f"open({str(started)!r}, 'a').write(f'{{plant.now}} {{window.read(3710)[0]}}\\n')\n"
                   "plant.advance('1s')\nwindow.write(3710, 7)\nsys.exit(3)")
        made = subprocess.run([PROGRAM, "--demo", "--clock", "manual", "--fault", "plc:plc-restart count=1", "--", sys.executable, "-c", program],
                              env={**os.environ, "PYTHONPATH": str(ROOT / "tools/python")}, timeout=LIMIT)
        self.assertEqual(made.returncode, 3)
        self.assertEqual(started.read_text(), "0.0 0\n1.0 7\n")
        started.unlink()
        program = program.replace("plant.advance('1s')\nwindow.write(3710, 7)", "plant.send('modbus 060E7E0007', 'pass 1s', 'modbus 060E7E0008')\nplant.response('')")
        subprocess.run([PROGRAM, "--demo", "--clock", "manual", "--fault", "plc:plc-restart count=1", "--", sys.executable, "-c", program],
                       env={**os.environ, "PYTHONPATH": str(ROOT / "tools/python")}, timeout=LIMIT)
        self.assertEqual(started.read_text(), "0.0 0\n0.0 7\n")  # what it has sent after the request is dropped

    def test_of_a_command_and_its_scan_in_one_exchange(self):
        plant = self.plant("cut-before after=1 count=1", "exception after=2 count=1")
        self.assertEqual(plant.command("modbus 060E7E0007"), ["060E7E0007"])
        self.assertRaisesRegex(PlantError, "no response: a fault would close the connection", plant.command, "modbus 060E7E0008")
        self.assertEqual(plant.command("modbus 060E7E0009"), ["8604"])
        self.assertEqual(plant.command("modbus 030E7E0001"), ["03020007"])
        for pdu, why in (("", "modbus PDU"), ("0", "write a PDU"), ("xy", "write a PDU"), (254 * "00", "write a PDU"), ("2/03", "must be 1..1")):
            self.assertRaisesRegex(PlantError, why, plant.command, f"modbus {pdu}")
        plant.control.sendall(b"modbus 060E7E000A\npass 100ms\nmodbus 030E7E0001\ntime\n")
        self.assertEqual([plant.lines.readline() for _ in range(4)], ["ok 060E7E000A\n", "at 0.100000\n", "ok 0302000A\n", "ok 0.100000\n"])

    def test_at_run_time_and_where_they_cannot_be(self):
        plant = self.plant()
        window = self.window(plant)
        self.assertEqual(plant.fault("plc", "exception"), 1)
        self.assertRaisesRegex(PlantError, "Modbus exception 4", window.write, 3710, 7)
        plant.clear("plc")
        window.write(3710, 7)
        self.assertRaisesRegex(PlantError, "cut", plant.fault, 66, "cut")
        self.assertRaisesRegex(PlantError, "silent", plant.fault, "plc", "silent")


if __name__ == "__main__":
    cases.main()
