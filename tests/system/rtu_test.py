#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Modbus RTU on a pseudo-terminal and over TCP, next to Modbus TCP, with clients of other projects: mbpoll (libmodbus) and pymodbus."""

import os
import re
import socket
import tty

from pymodbus.client import ModbusTcpClient
from pymodbus.framer.rtu_framer import ModbusRtuFramer

import cases
from done import output
from mcu import with_crc
from serial_line import SerialLine
from simulator import LIMIT, Simulator, program_from_arguments, wait_until
from tree import ROOT

PROGRAM = program_from_arguments()

READ_TYPE = [0xCA0E, 5055, 66, 0x1000, 0, 4]  # 1000h of the I/O module: 000F 0191h
TYPE = [0, 5055, 66, 0x1000, 0, 4, 0x0191, 0x000F]


class OnALine(cases.Case):
    def setUp(self):
        self.line = SerialLine()
        self.addCleanup(self.line.close)

    def start(self, *options):
        return Simulator(PROGRAM, "--demo", "--rtu", self.line.ends[0], "--set", "rtu.baud=19200", "--set", "rtu.parity=E", "--set", "rtu.station=1",
                         *options, test=self)

    def mbpoll(self, *arguments, station=1):
        said = output("mbpoll", "-q", "-m", "rtu", "-b", "19200", "-P", "even", "-a", station, "-0", "-1", "-o", "5", *arguments[:-1],
                      self.line.ends[1], *arguments[-1], timeout=LIMIT)
        return [int(value) for value in re.findall(r"^\[\d+\]:\s+(\d+)", said, re.MULTILINE)]

    def test_mbpoll_reads_and_writes(self):
        self.assertEqual(self.start().where["rtu"], self.line.ends[0])
        self.mbpoll("-r", "3700", READ_TYPE)
        self.assertEqual(self.mbpoll("-r", "3700", "-c", "8", []), TYPE)
        self.assertEqual(self.mbpoll("-r", "3700", "-c", "8", "-t", "3", []), TYPE)  # FC 4

    def test_the_next_networks_are_the_next_stations(self):
        simulator = self.start("--network", "2", "--set", "module.node_id=9")
        with simulator.window(2) as window:
            self.mbpoll("-r", "3700", [51726, 5055, 0, 12289, 0, 1], station=2)  # 3001h: the own node ID
            self.assertEqual((window.result(), window.read(3706, 1)), (0, [9]))

    def test_the_scanner_window_by_rtu(self):
        self.start()
        self.mbpoll("-r", "500", [1, 5055, 66, 4096, 0, 4])
        self.assertEqual(self.mbpoll("-r", "600", "-c", "3", []), [1, 5, 1])  # the first number after the start is not executed
        self.mbpoll("-r", "500", [2, 5055, 66, 4096, 0, 4])
        self.assertEqual(self.mbpoll("-r", "600", "-c", "6", []), [2, 0, 2, 4, 0x0191, 0x000F])


class AtTheOtherEnd(cases.Case):
    def open(self):
        master, slave = os.openpty()
        tty.setraw(slave)
        return master, slave, os.ttyname(slave)

    def test_a_port_that_is_gone_is_told_once_and_taken_again(self):
        link = self.folder / "line"
        master, slave, name = self.open()
        link.symlink_to(name)
        with Simulator(PROGRAM, "--demo", "--rtu", f"{link}", "--set", "rtu.baud=115200") as simulator:
            os.write(master, with_crc("010310150001"))
            self.assertEqual(os.read(master, 100), with_crc("0103020000"))
            link.unlink()  # another test may get its number
            os.close(slave)
            os.close(master)
            wait_until(simulator.errors, "a line about it")
            master, slave, name = self.open()
            link.symlink_to(name)
            wait_until(lambda: len(simulator.errors()) == 2, "the port again")
            os.write(master, with_crc("010310150001"))
            self.assertEqual(os.read(master, 100), with_crc("0103020000"))
            self.assertEqual(simulator.errors(), [
                f"cbcan-sim: rtu {link}: is gone; plug it in again, it is looked for every second",
                f"cbcan-sim: rtu {link}: is there again"])
            with simulator.window() as window:
                self.assertEqual(window.read(3700, 1), [0])
        os.close(master)
        os.close(slave)


class OverTcp(cases.Case):
    def setUp(self):
        # With a listener to what is exchanged.
        self.simulator = Simulator(PROGRAM, "--demo", "--http", "127.0.0.1:0", "--set", "rtu.listen=127.0.0.1:0", test=self)
        self.port = int(self.simulator.where["rtu_tcp"].rsplit(":", 1)[1])

    def test_pymodbus(self):
        client = ModbusTcpClient("127.0.0.1", port=self.port, framer=ModbusRtuFramer, timeout=LIMIT)
        self.assertTrue(client.connect())
        self.addCleanup(client.close)
        self.assertFalse(client.write_registers(3700, READ_TYPE, slave=1).isError())
        self.assertEqual(client.read_holding_registers(3700, 8, slave=1).registers, TYPE)
        self.assertEqual(client.read_input_registers(3700, 8, slave=1).registers, TYPE)
        self.assertTrue(client.read_holding_registers(4168, 1, slave=1).isError())

    def test_noise_costs_no_more_than_a_request(self):
        request, response = with_crc("010310150001"), with_crc("0103020000")
        for noise in (b"\x55", b"\x01", with_crc("090300000001")[:-1] + b"\x00", with_crc("09080000A537"), with_crc("092B0E0100"), with_crc("09641234")):
            with socket.create_connection(("127.0.0.1", self.port), timeout=LIMIT) as line:
                line.sendall(request + noise)
                received = b""
                for _ in range(20):
                    line.sendall(request)
                while len(received) < 20 * len(response):  # the first one, and 19 of 20
                    received += line.recv(300)
                self.assertEqual(set(received[i:i + len(response)] for i in range(0, len(received), len(response))), {response}, noise.hex())

    def test_coils_and_discrete_inputs(self):
        modbus = int(self.simulator.where["modbus"].rsplit(":", 1)[1])
        for client in (ModbusTcpClient("127.0.0.1", port=modbus, timeout=LIMIT),
                       ModbusTcpClient("127.0.0.1", port=self.port, framer=ModbusRtuFramer, timeout=LIMIT)):
            self.assertTrue(client.connect())
            self.addCleanup(client.close)
            self.assertFalse(client.write_coils(3, [True, False, True], slave=1).isError())
            self.assertFalse(client.write_coil(31, True, slave=1).isError())
            self.assertEqual(client.read_holding_registers(3864, 2, slave=1).registers, [0x0028, 0x8000])
            self.assertEqual(client.read_coils(2, 4, slave=1).bits[:4], [False, True, False, True])
            self.assertEqual(client.read_discrete_inputs(1024 + 0x42, 2, slave=1).bits[:2], [True, False])  # HEARD: node 42h, not 43h
            self.assertTrue(client.read_coils(1023, 2, slave=1).isError())
            client.write_registers(3864, [0, 0], slave=1)

    def test_function_codes_are_those_of_the_pages_by_tcp_and_rtu(self):
        table = {1: "00000010", 2: "00000010", 3: "0000000a", 4: "0000000a", 5: "0000FF00", 6: "10150001", 15: "0000000801FF", 16: "10150001020001", 22: "1015FFFF0000", 23: "00000001101500010200 01", 43: "0E0100"}
        pages = "".join(page.read_text() for page in (ROOT / "docs").rglob("*.md"))
        rows = re.search(r"^\| FC \| Function .*\n((?:\|.*\n)*)", pages, re.M)[1]
        self.assertEqual(sorted(map(int, re.findall(r"^\| (\d+)", rows, re.M))), sorted(table))
        listed = re.search(r"Function codes ([^.]+)\.", (ROOT / "README.md").read_text())[1]
        self.assertEqual(sorted(map(int, re.findall(r"\d+", listed.replace("/14", "")))), sorted(table))
        with self.simulator.window() as window, socket.create_connection(("127.0.0.1", self.port), timeout=LIMIT) as line:
            for function in range(1, 128):
                refused = window.request(bytes([function]) + bytes.fromhex(table.get(function, "00000001"))) == bytes([function | 0x80, 1])
                self.assertEqual(refused, function not in table, function)
            for function in table:
                line.sendall(with_crc(f"01{function:02X}" + table.get(function, "00000001")))
                response = line.recv(300)
                self.assertEqual(response[1:3] == bytes([function | 0x80, 1]), function == 43, (function, response.hex()))


cases.main()
