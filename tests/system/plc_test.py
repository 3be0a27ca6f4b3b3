#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""PLCs that own their registers, over TCP with our server and with pymodbus's, and on a serial line with libmodbus's, and cbcan-sim as
their module."""

import asyncio
import contextlib
import ctypes
import logging
import os
import subprocess
import threading
import tty

from pymodbus.datastore import ModbusServerContext, ModbusSlaveContext
from pymodbus.server.async_io import ModbusTcpServer

import cases
from mcu import with_crc
from owned_registers import OwnedRegisters
from serial_line import SerialLine
from simulator import LIMIT, Simulator, program_from_arguments, wait_until

PROGRAM = program_from_arguments()
logging.disable()  # pymodbus logs every closed connection


class Plc(OwnedRegisters):
    """A PLC with the registers `first`.. and a program in this thread."""

    def __init__(self, first):
        super().__init__()
        self.first = first

    def set(self, at, words):
        with self.changed:
            self.write(self.first + at, words)

    def get(self, at, count):
        return self.read(self.first + at, count)

    def until(self, at, words):
        with self.changed:
            found = self.changed.wait_for(lambda: self.get(at, len(words)) == words, LIMIT)
        assert found, f"{self.get(at, len(words))} instead of {words}"

    def execute(self, *words):
        with self.changed:
            self.write(self.first, [0xCA0E, *words])
            assert self.changed.wait_for(lambda: self.get(0, 1)[0] != 0xCA0E, LIMIT)
        return self.get(0, 1)[0]


class Pymodbus(Plc):
    """The same registers and program with pymodbus's server: its data block is this object."""

    def __init__(self, first):
        self.serves = threading.Event()
        super().__init__(first)
        assert self.serves.wait(LIMIT)

    def serve(self):
        self.listener.close()  # its port is pymodbus's
        asyncio.run(self.serve_by_pymodbus())

    async def serve_by_pymodbus(self):
        self.loop, self.end = asyncio.get_running_loop(), asyncio.Event()
        context = ModbusServerContext({1: ModbusSlaveContext(hr=self, zero_mode=True)}, single=False)
        server = ModbusTcpServer(context, address=("127.0.0.1", self.port), allow_reuse_address=True)
        serving = asyncio.ensure_future(server.serve_forever())
        await server.serving
        self.serves.set()
        await self.end.wait()
        await server.server_close()
        serving.cancel()

    def stop(self):
        with contextlib.suppress(RuntimeError):  # it has been stopped
            self.loop.call_soon_threadsafe(self.end.set)

    def validate(self, address, count):
        return address + count <= 65536

    def getValues(self, address, count):
        with self.changed:
            return self.read(address, count)

    def setValues(self, address, values):
        with self.changed:
            self.write(address, values)


class Mapping(ctypes.Structure):
    """modbus_mapping_t"""
    _fields_ = [*((name, ctypes.c_int) for name in "bits bits_from inputs inputs_from input_registers input_registers_from count first".split()),
                *((name, ctypes.c_void_p) for name in ("tab_bits", "tab_inputs", "tab_input_registers")), ("words", ctypes.POINTER(ctypes.c_uint16))]


class LinePlc:
    """libmodbus's RTU server. Station 1 has holding registers from 3700 on, and a program that runs after each request."""

    def __init__(self, device, program):
        self.library = ctypes.CDLL("libmodbus.so.5")
        self.library.modbus_new_rtu.restype = ctypes.c_void_p
        self.library.modbus_mapping_new_start_address.restype = ctypes.POINTER(Mapping)
        self.context = ctypes.c_void_p(self.library.modbus_new_rtu(device.encode(), 19200, ctypes.c_char(b"E"), 8, 1))
        self.library.modbus_set_slave(self.context, 1)
        assert self.library.modbus_connect(self.context) == 0
        self.mapping = self.library.modbus_mapping_new_start_address(0, 0, 0, 0, 3700, 600, 0, 0)
        self.program = program

    def serve(self):
        """Until the program has ended."""
        request = (ctypes.c_uint8 * 260)()
        words = self.mapping.contents.words
        while self.program(words):
            size = self.library.modbus_receive(self.context, request)
            if size > 0:
                self.library.modbus_reply(self.context, request, size, self.mapping)

    def stop(self):
        self.library.modbus_close(self.context)
        self.library.modbus_free(self.context)
        self.library.modbus_mapping_free(self.mapping)


class OnTheNet(cases.Case):
    plc = Plc

    def start(self, plc, *options, **rest):
        self.addCleanup(plc.stop)
        simulator = Simulator(PROGRAM, "--demo", "--plc", f"127.0.0.1:{plc.port}", "--set", f"plc.first={plc.first}", *options, **rest, test=self)
        self.assertEqual(simulator.where["plc"], f"127.0.0.1:{plc.port}")
        return simulator

    def test_a_transaction_and_its_frames(self):
        plc = self.plc(3700)
        simulator = self.start(plc)
        self.assertEqual(plc.execute(5066, 0x42, 0x6411, 1, 2, 300), 0)
        plc.set(6, [0xFFFF, 0xFFFF])
        self.assertEqual(plc.execute(5055, 0x42, 0x6411, 1, 2), 0)
        self.assertEqual(plc.get(5, 3), [2, 300, 0xFFFF])
        self.assertEqual(plc.execute(5055, 0x20, 0x3333, 0, 4), 4)
        self.assertEqual(plc.get(6, 2), [0x0000, 0x0602])
        self.assertEqual(simulator.frames()[-6:], ["642#2B1164012C010000", "5C2#6011640100000000", "642#4011640100000000",
                                                   "5C2#4B1164012C010000", "620#4033330000000000", "5A0#8033330000000206"])

    def test_a_restart_of_the_module_executes_what_it_finds_once_more_or_refuses_it(self):
        for more, result, frames in (((), 0, ["000#0142"]), (("--set", "plc.at_start=execute"), 0, ["000#0142"]),
                                     (("--set", "plc.at_start=refuse"), 5, [])):
            plc = self.plc(3700)
            plc.set(0, [0xCA0E, 5066, 0, 0x1F82, 0x42, 0, 5])
            simulator = self.start(plc, *more)
            plc.until(0, [result])
            self.assertEqual(plc.execute(5055, 0x42, 0x1000, 0, 4), 0)
            self.assertEqual([line for line in simulator.frames() if line.startswith("000#")], frames, more)

    def test_the_scanner_layout_with_process_data(self):
        plc = self.plc(1024)
        simulator = self.start(plc, "--set", "module.scanner_out_first=700", "--set", "module.channels=1",
                               "--set", "plc.layout=scanner", "--set", "plc.process_first=1174")
        plc.until(71, [5])
        plc.set(0, [1])
        plc.until(70, [1, 5, 1])
        plc.set(1, [5055, 0x42, 0x1000, 0, 4])
        plc.set(0, [2])
        plc.until(70, [2])
        self.assertEqual(plc.get(71, 5), [0, 2, 4, 0x0191, 0x000F])
        plc.set(150 + 64, [0x1234])
        with simulator.window() as window:
            wait_until(lambda: window.read(3864, 1) == [0x1234], "the output")
            window.write(3801, [77])
        plc.until(151, [77])

    def test_a_plc_that_is_gone_is_seen_on_the_bus(self):
        plc = self.plc(3700)
        simulator = self.start(plc, "--set", "module.plc_timeout_ms=200")
        self.assertEqual(plc.execute(5066, 0, 0x1017, 0, 2, 20), 0)  # the own heartbeat
        self.assertEqual(plc.execute(5066, 0, 0x1F82, 127, 0, 5), 0)
        simulator.wait_for_frame("77F#05")
        self.assertEqual(plc.execute(5055, 0, 0x300C, 0, 1), 0)
        self.assertEqual(plc.get(6, 1), [5])
        plc.stop()
        wait_until(lambda: [line for line in simulator.frames() if line.startswith("77F#")][-1] == "77F#7F", "pre-operational")

    def test_time_that_stands_still(self):
        plc = self.plc(3700)
        self.start(plc, "--clock", "manual", "--set", "plc.period_ms=1", stdin=subprocess.PIPE)
        self.assertEqual(plc.execute(5055, 0x42, 0x1000, 0, 4), 0)


class WithPymodbus(OnTheNet):
    plc = Pymodbus


class OnALine(cases.Case):
    def test_what_is_no_response_is_told_once_and_asked_again(self):
        master, slave = os.openpty()
        tty.setraw(slave)
        self.addCleanup(os.close, master)
        self.addCleanup(os.close, slave)
        device = os.ttyname(slave)
        with Simulator(PROGRAM, "--demo", "--set", f"plc.device={device}", "--set", "plc.baud=115200", "--set", "plc.parity=N",
                       "--set", "plc.unit=9") as simulator:
            read_all = with_crc("09030E740046")
            for response in (b"", with_crc("09038C0000"), with_crc("0A038C" + "0000" * 70)):
                self.assertEqual(os.read(master, 100), read_all)
                os.write(master, response)
            self.assertEqual(os.read(master, 100), read_all)
            os.write(master, with_crc("09038C" + "0000" * 70))
            self.assertEqual(os.read(master, 100), read_all)
            self.assertEqual(simulator.errors(), [f"cbcan-sim: plc {device}: no response; it is retried", f"cbcan-sim: plc {device}: answers again"])

    def test_requests_one_after_the_other(self):
        line = SerialLine()
        self.addCleanup(line.close)
        requests = [(5055, 0x42, 0x1000, 0, 4), (5066, 0x42, 0x6411, 1, 2, 300), (5055, 0x42, 0x6411, 1, 128), (5055, 0x20, 0x3333, 0, 4)]
        results = []

        def program(words):
            if words[0] == 0xCA0E:
                return True
            if words[1]:
                results.append(words[:8])
            if len(results) == len(requests):
                return False
            for at, word in enumerate(requests[len(results)], 1):
                words[at] = word
            words[0] = 0xCA0E
            return True

        plc = LinePlc(line.ends[1], program)
        self.addCleanup(plc.stop)
        with Simulator(PROGRAM, "--demo", "--set", f"plc.device={line.ends[0]}", "--set", "plc.baud=19200", "--set", "plc.parity=E",
                       "--set", "plc.unit=1") as simulator:
            self.assertEqual(simulator.where["plc"], line.ends[0])
            plc.serve()
            self.assertEqual(results, [[0, 5055, 0x42, 0x1000, 0, 4, 0x0191, 0x000F], [0, 5066, 0x42, 0x6411, 1, 2, 300, 0x000F],
                                       [0, 5055, 0x42, 0x6411, 1, 2, 300, 0x000F], [4, 5055, 0x20, 0x3333, 0, 4, 0x0000, 0x0602]])
            self.assertEqual(simulator.errors(), [])

    def test_inputs_and_status_are_written_again_and_again(self):
        line = SerialLine()
        self.addCleanup(line.close)
        counts = {"requests": 0, "all": 0}

        def program(words):
            counts["requests"] += 1
            places = (100, 300, 300 + 123)
            if all(words[at] != 0xFFFF for at in places):
                counts["all"] += 1
                for at in places:
                    words[at] = 0xFFFF
            return counts["all"] < 4 and counts["requests"] < 2000

        plc = LinePlc(line.ends[1], program)
        self.addCleanup(plc.stop)
        with Simulator(PROGRAM, "--demo", *(f"--set=plc.{setting}" for setting in (
                f"device={line.ends[0]}", "baud=19200", "parity=E", "period_ms=1", "process_first=3800", "status_first=4000"))):
            plc.serve()
        self.assertEqual(counts["all"], 4)


cases.main()
