#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Events on standard error, and in Wireshark's dissectors."""

import json
import re
import subprocess

import cases
from done import output, ran
from simulator import LIMIT, READ, WRITE, Simulator, program_from_arguments

PROGRAM, CTL = program_from_arguments(2)


def transactions(simulator):
    """Three transactions: successful, refused by the node, and without response because of a fault."""
    with simulator.window() as window:
        assert window.execute(READ, 0x42, 0x1000, 0, 4) == 0
        assert window.execute(WRITE, 0x42, 0x1000, 0, 4, 1, 0) == 4
        assert window.execute(WRITE, 0, 0x3003, 0, 2, 20) == 0  # SDO time-out
        assert window.execute(READ, 0x20, 0x1000, 0, 4) == 4
    return simulator


class Verbose(cases.Case):
    def lines(self, *options):
        simulator = transactions(Simulator(PROGRAM, "--demo", "--fault", "0x20:response-never", *options))
        self.assertEqual(simulator.stop()[0], 0)
        return [re.sub(r"^cbcan-sim: \d+\.\d{6} |, [0-9.]+ ms$", "", line) for line in simulator.error.splitlines()]

    def test_v(self):
        lines = self.lines("-v")
        self.assertEqual(lines[:5], [f"node {node} pre-operational" for node in (66, 1, 2, 16, 32)])
        self.assertEqual(lines[6:], [
            "#1 read node 66 1000h:00 Device type = 983441: done",
            "#2 write node 66 1000h:00 Device type: 0601 0002h attempt to write a read-only object",
            "#3 write node 0 3003h:00 = 20: done",
            "node 32: fault 1: response-never: 5A0#4300100000000000",
            "#4 read node 32 1000h:00 Device type: 0504 0000h SDO service timed out",
            "transactions 4, failed 2, cancelled 0", lines[-2], lines[-1]])

    def test_v_of_a_boot(self):
        lines = self.lines("-v", "--network-file", self.write("network.toml", """
            node = [
              { id = 2, objects = [ { index = 0x1018, sub = 2, value = 1, type = "u32" } ] },
              { id = 16, device_type = 0x191 },
            ]"""))
        self.assertEqual(sorted(line for line in lines if " (" in line), [
            "node 16: device type 00020192h, the network file wants 00000191h (C); it is not started",
            "node 2: configuration failed at 1018h:02 Product code: 0601 0002h attempt to write a read-only object (J); it is not started"])

    def test_vv(self):
        lines = self.lines("-vv")
        self.assertIn("#1 642#4000100000000000 SDO node 66: read 1000h:00 Device type", lines)
        self.assertIn("#4 620#8000100000000405 SDO node 32: abort 1000h:00 Device type: 0504 0000h SDO service timed out", lines)
        self.assertLess(lines.index("#1 5C2#4300100091010F00 SDO node 66: value of 1000h:00 Device type = 983441"),
                        lines.index("#1 read node 66 1000h:00 Device type = 983441: done"))


class Handshake(cases.Case):
    def test_state_all_on_a_healthy_plant_shows_no_failure(self):
        with Simulator(PROGRAM, "--demo", "-v", "--http", ":0") as simulator:
            self.assertEqual(len(output(CTL, "--modbus", f":{simulator.port}", "state", "all", timeout=LIMIT).splitlines()), 6)
            self.assertEqual(http_json(simulator, "/api/transactions?failed=1")["events"], [])
            ended = http_json(simulator, "/api/transactions")["events"]
            self.assertEqual([event["ok"] for event in ended if event["result"] == 5], [True] * 15)
            simulator.stop()
            self.assertEqual(simulator.error.count(": handshake after a start of the coprocessor: the number is not executed"), 15)
            self.assertRegex(simulator.error, r"transactions \d+, failed 0, cancelled 0\n")


class TwoWriters(cases.Case):
    """Two clients of one scanner window: both write their block and read the other, and each takes the other's results for its own."""

    def exchange(self, simulator, *windows):
        for number in range(1, 101):
            for window in windows:
                window.write(500, [number, 5066, 0x20, 0x2001, 0, 1, number])
                self.assertEqual(window.read(600, 2)[0], number)

    def test_is_counted_and_told(self):
        with Simulator(PROGRAM, "--demo", "-v", "--http", ":0") as simulator:
            with simulator.window() as first, simulator.window() as second:
                self.exchange(simulator, first, second)
                self.assertEqual(len([line for line in simulator.frames() if line.startswith("620#")]), 99)  # of 200
                self.assertEqual(first.read(4140, 1), [99])
                self.assertEqual(http_json(simulator, "/api/time")["networks"][0]["second_writers"], 99)
                seen, = http_json(simulator, "/api/advice")["advice"]
            simulator.stop()
            told = "clients 1 and 2 write to the scanner window of channel 1, and each takes the other's results for its own; use one writer, or " \
                "a channel for each"
            self.assertEqual((seen["rule"], seen["client"], seen["count"], seen["words"]), ("two-writers", 1, 99, told))
            self.assertLess(seen["last"], LIMIT)  # of the plant's time
            self.assertEqual(simulator.error.count(told), 1)
            self.assertIn("\nadvice two-writers: 99 times by client 1\n", simulator.error)

    def test_a_plc_that_connects_again_is_one_writer(self):
        with Simulator(PROGRAM, "--demo", "-v") as simulator:
            for _ in range(3):
                with simulator.window() as window:
                    self.exchange(simulator, window)
            with simulator.window() as window, simulator.window() as reader:
                self.exchange(simulator, window)
                self.assertEqual(reader.read(4140, 1), [0])
            simulator.stop()
            self.assertNotIn("advice", simulator.error)


class Pcap(cases.Case):
    def setUp(self):
        self.file = self.folder / "both.pcapng"

    def dissect(self, *fields):
        arguments = [argument for field in fields for argument in ("-e", field)]
        lines = output("tshark", "-r", self.file, "-d", "can.subdissector=canopen", "-T", "fields", *arguments, timeout=LIMIT, env={"PATH": "/usr/bin"})
        return [line.split("\t") for line in lines.split("\n")[:-1]]

    def test_both_protocols_on_one_clock_with_comments(self):
        transactions(Simulator(PROGRAM, "--demo", "--fault", "0x20:response-never", "--pcap", str(self.file))).stop()
        packets = self.dissect("_ws.malformed", "_ws.expert.severity", "_ws.col.Protocol", "frame.interface_name", "frame.comment",
                               "_ws.col.Info", "frame.time_epoch")
        self.assertEqual([packet for packet in packets if packet[0]], [])
        self.assertEqual({(protocol, interface) for _, _, protocol, interface, *_ in packets}, {("CANopen", "can1"), ("Modbus/TCP", "modbus")})
        times = [float(packet[6]) for packet in packets]  # events have the time at which they were due, so they are not sorted
        self.assertLess(max(times) - min(times), LIMIT)
        comments = [comment for *_, comment, _, _ in packets]
        for number in range(1, 5):
            self.assertTrue(any(re.search(fr"^transaction {number}$|\\ntransaction {number}$", comment) for comment in comments), number)
            self.assertTrue(any(f"#{number} " in comment and "begun" in comment for comment in comments) or number == 3, number)
        self.assertIn("fault 1: response-never: 5A0#", "".join(comments))
        frames = [(comment, info) for _, _, protocol, _, comment, info, _ in packets if protocol == "CANopen" and comment]
        self.assertTrue(any("transaction 1" in comment and "Initiate upload request" in info for comment, info in frames), frames)

    def test_standard_output(self):
        process = subprocess.Popen([PROGRAM, "--demo", "--modbus", "127.0.0.1:0", "--pcap", "-"], stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        self.assertTrue(process.stderr.readline().startswith(b"ready modbus="))
        process.terminate()
        self.file.write_bytes(process.communicate(timeout=LIMIT)[0])
        self.assertEqual(len(self.dissect("can.id")), 6)  # boot-up messages
        self.assertEqual(ran(PROGRAM, "--demo", "--pcap", "-", "--clock", "manual").returncode, 2)


def http_json(simulator, path):
    return json.loads(output("curl", "-sS", "--fail-with-body", f"http://{simulator.where['http']}{path}", timeout=LIMIT))


cases.main()
