#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Wireshark's CANopen dissector reads cbcan-sim's log of a session with simulated devices."""

import collections
import pathlib
import re
import subprocess

import cases
from done import output
from simulator import LIMIT, Simulator, program_from_arguments

PROGRAM = program_from_arguments()
PLANT = pathlib.Path(__file__).with_name("devices.toml")

EXPEDITED = ("620#2F01200011000000", "620#2B02200011220000", "620#2703200011223300", "620#2304200011223344",
             "620#4001200000000000", "620#4004200000000000")
# "fourteen bytes"
SEGMENTED = ("620#210E20000E000000", "620#00666F7572746565", "620#116E206279746573",
             "620#400E200000000000", "620#6000000000000000", "620#7000000000000000")
BLOCK = ("620#C60E20000E000000", "620#01666F7572746565", "620#826E206279746573", "620#C1B2440000000000",
         "620#A40E20007F000000", "620#A300000000000000", "620#A2027F0000000000", "620#A100000000000000")
ABORTS = ("642#4033330000000000", "642#2B00100000000000", "642#4008100000000000", "642#8008100000000008")
GUARDING = ("742#R1", "742#R1")
FASTSCAN = ("7E5#5100000000800000", "7E5#5100000000000000")
SELECT = ("7E5#402B000000000000", "7E5#41EEFFC000000000", "7E5#4202000100000000", "7E5#4301000080000000")
INQUIRE = ("7E5#5A00000000000000", "7E5#5B00000000000000", "7E5#5C00000000000000", "7E5#5D00000000000000", "7E5#5E00000000000000")
CONFIGURE = ("7E5#1130000000000000", "7E5#1300020000000000", "7E5#1700000000000000", "7E5#0400000000000000")
IDENTIFY = ("7E5#462B000000000000", "7E5#47EEFFC000000000", "7E5#4800000000000000", "7E5#49FFFFFFFF000000",
            "7E5#4A00000000000000", "7E5#4BFFFFFFFF000000", "7E5#4C00000000000000")
HEARTBEAT = ("620#2B1710000A000000", "pass 25ms", "620#2B17100000000000")
PROCESS = ("000#0100", "080#", "080#01", "100#409C00000A42", "1C2#R1", "342#0102", "342#01020304", "242#A5", "205#0600")
NMT = ("000#8042", "000#0242", "000#8242", "000#8120")


def record(log, *lines):
    """Sends these frames on a manual clock, each after all frames that the previous one has caused."""
    with Simulator(PROGRAM, "--config", str(PLANT), "--slcan", "127.0.0.1:0", "--clock", "manual", "--log", str(log), log=False,
                   stdin=subprocess.PIPE) as simulator:
        with simulator.connect("slcan") as adapter:
            adapter.sendall(b"O\r")
            for line in lines:
                if line.startswith("pass "):
                    simulator.say(line)
                else:
                    adapter.sendall(slcan(line) + b"V\r")
                    heard = b""
                    while b"V1013\r" not in heard:
                        heard += adapter.recv(65536)


def slcan(frame):
    identifier, data = frame.split("#")
    if data.startswith("R"):
        return f"r{identifier}{data[1:]}\r".encode()
    return f"t{identifier}{len(data) // 2}{data}\r".encode()


def dissect(log, *fields):
    """These fields of each frame, as tshark prints them."""
    arguments = [argument for field in fields for argument in ("-e", field)]
    lines = output("tshark", "-r", log, "-d", "can.subdissector=canopen", "-T", "fields", *arguments, timeout=LIMIT, env={"PATH": "/usr/bin", "TZ": "UTC"})
    return [tuple(line.split("\t")) for line in lines.split("\n")[:-1]]


def kind(info):
    return re.split(r" \[|, |: 0x|Length: ", info)[0]


class Dissected(cases.Case):
    def setUp(self):
        self.log = self.folder / "bus.log"

    def kinds(self, *session):
        record(self.log, *session)
        frames = dissect(self.log, "_ws.malformed", "_ws.expert.message", "frame.protocols", "can.flags.rtr", "can.len",
                         "_ws.col.Protocol", "_ws.col.Info")
        self.assertEqual(len(frames), len(self.log.read_text().splitlines()))
        found = collections.Counter()
        for malformed, expert, layers, remote, size, protocol, info in frames:
            self.assertEqual((malformed, expert), ("", ""), info)
            # Wireshark leaves remote frames to CAN.
            self.assertEqual(protocol, "CAN" if remote == "1" else "CANopen", info)
            if remote == "0" and size != "0":
                self.assertEqual(layers.split(":")[-1], "canopen", info)
            found["remote frame" if remote == "1" else kind(info)] += 1
        boot_ups = found.pop("NMT Error Control: Boot-up")
        return boot_ups, dict(found)

    def column(self, field):
        return [value for value, in dissect(self.log, field) if value]

    def test_expedited(self):
        boot_ups, kinds = self.kinds(*EXPEDITED)
        self.assertEqual((boot_ups, kinds), (4, {
            "Default-SDO (rx): Initiate download request": 4, "Default-SDO (tx): Initiate download response": 4,
            "Default-SDO (rx): Initiate upload request": 2, "Default-SDO (tx): Initiate upload response": 2}))
        self.assertEqual(self.column("canopen.sdo.main_idx"),
                         [index for index in ("0x2001", "0x2002", "0x2003", "0x2004", "0x2001", "0x2004") for _ in range(2)])

    def test_segmented(self):
        self.assertEqual(self.kinds(*SEGMENTED)[1], {
            "Default-SDO (rx): Initiate download request": 1, "Default-SDO (tx): Initiate download response": 1,
            "Default-SDO (rx): Download segment request": 2, "Default-SDO (tx): Download segment response": 2,
            "Default-SDO (rx): Initiate upload request": 1, "Default-SDO (tx): Initiate upload response": 1,
            "Default-SDO (rx): Upload segment request": 2, "Default-SDO (tx): Upload segment response": 2})

    def test_block(self):
        # The dissector takes each frame alone: it shows the segments of a block according to what their first byte means elsewhere.
        self.assertEqual(self.kinds(*BLOCK)[1], {
            "Default-SDO (rx): Block download": 2, "Default-SDO (tx): Block download": 3,
            "Default-SDO (rx): Block upload": 4, "Default-SDO (tx): Block upload": 2,
            "Default-SDO (rx): Download segment request": 1, "Default-SDO (rx): Abort transfer": 1,
            "Default-SDO (tx): Upload segment response": 1, "Default-SDO (tx): Abort transfer": 1})

    def test_aborts(self):
        self.assertEqual(self.kinds(*ABORTS)[1], {
            "Default-SDO (rx): Initiate upload request": 2, "Default-SDO (rx): Initiate download request": 1,
            "Default-SDO (tx): Abort transfer": 2, "Default-SDO (tx): Initiate upload response": 1,
            "Default-SDO (rx): Abort transfer": 1})
        self.assertEqual(self.column("canopen.sdo.abort_code"), ["0x06020000", "0x06010002", "0x08000000"])

    def test_guarding_heartbeat_nmt(self):
        boot_ups, kinds = self.kinds(*GUARDING, *HEARTBEAT, *NMT)
        self.assertEqual((boot_ups, kinds), (6, {
            "remote frame": 2, "NMT Error Control: Pre-operational": 4,
            "Default-SDO (rx): Initiate download request": 2, "Default-SDO (tx): Initiate download response": 2,
            "NMT: Enter pre-operational state": 1, "NMT: Stop remote node": 1, "NMT: Reset communication": 1, "NMT: Reset node": 1}))
        self.assertEqual(self.column("canopen.nmt_guard.toggle"), list("0000010000"))  # boot-ups and heartbeats too

    def test_process_data_and_emergencies(self):
        # Four nodes report 8240h: the second SYNC has a counter, and according to 1019h there is none.
        self.assertEqual(self.kinds(*PROCESS)[1], {
            "NMT: Start remote node": 1, "SYNC": 2, "TIME STAMP": 1, "EMCY": 6, "remote frame": 1,
            "PDO1 (tx)": 6, "PDO2 (tx)": 3, "PDO3 (tx)": 2, "PDO4 (tx)": 2, "PDO1 (rx)": 2, "PDO2 (rx)": 2})
        self.assertEqual(self.column("canopen.em.err_code"), ["0x8240"] * 4 + ["0x8210", "0x0000"])
        self.assertEqual(self.column("canopen.em.err_reg"), ["0x11"] * 6)
        self.assertEqual(self.column("canopen.sync.counter"), ["1"])
        self.assertIn("Apr 15, 2030 00:00:40", self.column("canopen.time_stamp")[0])

    def test_lss(self):
        both = [f"Inquire identity {part} protocol" for part in ("vendor-ID", "product code", "revision number", "serial number")]
        both += ["Inquire node-ID protocol", "Configure node-ID protocol", "Store configuration protocol"]
        expected = {f"LSS ({side}): {name}": 1 for side in ("Master", "Slave") for name in both} | {
            "LSS (Master): LSS Fastscan protocol": 2, "LSS (Slave): Identify slave protocol": 2,
            "LSS (Master): Switch state selective protocol": 4, "LSS (Slave): Switch state selective protocol": 1,
            "LSS (Master): Configure bit timing protocol: 500 kbit/s": 1, "LSS (Slave): Configure bit timing protocol": 1,
            "LSS (Master): Switch state global protocol: Waiting state": 1,
            "LSS (Master): Identify remote slave protocol": 6, "LSS (Master): Identify non-configured remote slave protocol": 1}
        self.assertEqual(self.kinds(*FASTSCAN, *SELECT, *INQUIRE, *CONFIGURE, *IDENTIFY), (5, expected))
        self.assertEqual(self.column("canopen.lss.addr.serial"), ["0x80000001", "0x80000001"])

    def test_a_cut_frame_is_seen(self):
        record(self.log, "605#4017")
        malformed = [bad for bad, identifier in dissect(self.log, "_ws.malformed", "can.id") if identifier == str(0x605)]
        self.assertEqual(len(malformed), 1)
        self.assertNotEqual(malformed[0], "")


cases.main()
