#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""The simulated devices, frame by frame, with python-can on the bus: on the interface that CBCAN_VCAN names, or else over SLCAN."""

import os
import pathlib
import socket
import sys
import unittest

import can

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
import cases
from simulator import LIMIT, Simulator, program_from_arguments, wait_until

PROGRAM = program_from_arguments(sys.argv)
VCAN = os.environ.get("CBCAN_VCAN")
PLANT = pathlib.Path(__file__).with_name("devices.toml")


def message(frame):
    identifier, data = frame.split("#")
    if data.startswith("R"):
        return can.Message(arbitration_id=int(identifier, 16), is_extended_id=False, is_remote_frame=True, dlc=int(data[1:] or 0))
    return can.Message(arbitration_id=int(identifier, 16), is_extended_id=False, data=bytes.fromhex(data))


class Devices(unittest.TestCase):
    def setUp(self):
        place = ("--can", f"socketcan:{VCAN}") if VCAN else ("--slcan", "127.0.0.1:0")
        self.simulator = Simulator(PROGRAM, "--config", str(PLANT), "--control", "127.0.0.1:0", *place, test=self)
        self.bus = self.open_bus()
        self.addCleanup(self.bus.shutdown)

    def open_bus(self):
        if VCAN:
            return can.Bus(interface="socketcan", channel=VCAN)
        bus = can.Bus(interface="slcan", channel=f"socket://{self.simulator.where['slcan']}", sleep_after_open=0)
        self.assertEqual(bus.get_version(LIMIT), (10, 13))  # O is answered before V: from now on the frames come
        return bus

    def send(self, *frames):
        for frame in frames:
            self.bus.send(message(frame))

    def hear(self, *frames):
        """These are the next frames of their identifiers."""
        for frame in frames:
            wanted = message(frame)
            heard = wait_until(lambda: self.bus.recv(timeout=1), frame)
            while heard.arbitration_id != wanted.arbitration_id:
                heard = wait_until(lambda: self.bus.recv(timeout=1), frame)
            self.assertEqual(heard.data.hex().upper(), wanted.data.hex().upper(), frame)

    def command(self, line):
        host, port = self.simulator.where["control"].rsplit(":", 1)
        with socket.create_connection((host, int(port)), timeout=LIMIT) as control, control.makefile("rw") as lines:
            lines.write(line + "\n")
            lines.flush()
            self.assertEqual(lines.readline(), "ok\n")

    def test_nmt_and_heartbeat(self):
        self.send("000#8142")
        self.hear("742#00")
        self.send("642#2B17100005000000")
        self.hear("5C2#6017100000000000", "742#7F", "742#7F")
        for command, state in (("01", "05"), ("02", "04"), ("80", "7F")):
            self.send(f"000#{command}42", "742#R1")  # where there is heartbeat, nothing answers guarding
            heard = None
            while heard != state:
                heard = self.next(0x742)
        self.send("000#8242")
        while self.next(0x742) != "00":
            pass

    def next(self, identifier):
        heard = wait_until(lambda: self.bus.recv(timeout=1), f"{identifier:X}")
        while heard.arbitration_id != identifier:
            heard = wait_until(lambda: self.bus.recv(timeout=1), f"{identifier:X}")
        return heard.data.hex().upper()

    def test_guarding(self):
        self.send("742#R1", "742#R1", "000#0142", "742#R1")
        self.hear("742#7F", "742#FF", "742#05")

    def test_life_guarding_ends(self):
        self.send("642#2B0C100032000000", "642#2F0D100002000000", "742#R1")  # 50 ms, twice
        self.hear("5C2#600C100000000000", "5C2#600D100000000000", "742#7F", "0C2#3081110000000000")

    def test_event_driven_tpdos_when_operational(self):
        self.send("000#0100")
        self.hear("185#5002", "1C2#5A", "285#500200", "2C2#D204FEFF", "385#500200000000", "485#500200000000")

    def test_sync(self):
        self.send("000#0101", "080#")
        self.hear("181#CD820100")
        self.command("set 1 0x9130:1 101325")
        self.send("080#")
        self.hear("181#CD8B0100")

    def test_every_third_sync(self):
        self.send("601#2F00180203000000", "000#0101", "080#", "080#")
        self.send("601#4000100000000000", "080#")
        self.hear("581#6000180200000000", "581#4300100094010200", "181#CD820100")

    def test_rtr(self):
        self.send("000#0142")
        self.hear("1C2#5A", "2C2#D204FEFF")
        self.send("1C2#R1", "2C2#R4")
        self.hear("1C2#5A", "2C2#D204FEFF")

    def test_an_input_that_changes(self):
        self.send("000#0142")
        self.hear("1C2#5A")
        self.command("set 66 0x6000:1 0x0F")
        self.hear("1C2#0F")

    def test_outputs(self):
        self.send("000#0142", "242#A5", "342#FFFF0080", "642#4000620100000000", "642#4011640100000000", "642#4011640200000000")
        self.hear("5C2#4F006201A5000000", "5C2#4B116401FFFF0000", "5C2#4B11640200800000")

    def test_pdo_of_a_wrong_length(self):
        self.send("000#0142", "342#0102", "342#010203040506", "342#01020304")
        # Too short; too long; no longer too short; neither.
        self.hear("0C2#1082110200000000", "0C2#2082110200000000", "0C2#0000110000000000", "0C2#0000000000000000")

    def test_incident(self):
        self.send("000#0105", "205#0600", "205#0700", "205#0F00")
        self.command("incident 5 overtemperature on")
        self.hear("085#1042090000000000")
        self.send("605#4003100100000000", "605#4001100000000000")
        self.hear("585#4303100110420000", "585#4F01100009000000")
        self.command("incident 5 overtemperature off")
        self.send("205#8000")
        self.hear("085#0000000000000000")

    def test_frames_of_no_use(self):
        self.send("642#", "642#40", "642#40001000000000", "000#01", "000#", "7E5#", "7E5#0401", "100#00", "080#0102030405060708")
        self.send("642#4000100000000000")
        self.hear("5C2#4300100091010F00")


cases.main()
