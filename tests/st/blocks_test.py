#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Specific to the blocks in Structured Text: their scans and turns, pointers, and registers that another client writes. The rest is in
tests/cia405/scenarios.txt."""

import re

from st_bench import ALL, BUS_OFF, ERROR_PASSIVE, INTERNAL, NODE, OTHER, OVERFLOW, TIMEOUT, BlockTest
import cases
from plc import configuration, source
from recipes import PAGE
from cbcan_st.machine import Machine
from cbcan_st.machine.types import Pointer


class NoResults(BlockTest):
    """Responses that no module gives: another client overwrites the module's response."""

    def check_refused(self, name, changes, local_steps=0, **inputs):
        block = self.plc.block(name, ENABLE=True, **inputs)
        self.plc.scan(1 + local_steps)
        for register, value in changes.items():
            self.plc.window.write(register, [value])
        self.bad(block, INTERNAL)
        self.plc.called.clear()

    def test_a_module_that_restarts_between_two_executions(self):
        """The known value of 3003h is dropped."""
        block = self.plc.block("SDO_READ4", DEVICE=NODE, INDEX=0x2001, TIMEOUT=2000)
        self.good(block)
        self.off(block)
        self.plc.module_restarts()
        self.good(block)
        self.plc.transaction(5055, 0, 0x3003, 0, 2)
        self.assertEqual(self.plc.window.read(3706, 1), [2350])

    def test_of_another_size_or_a_number_that_means_nothing(self):
        for name, changes, steps, inputs in (
                ("RECV_EMCY", {3705: 2}, 0, {}), ("RECV_EMCY", {3705: 9, 3706: 128}, 0, {}), ("RECV_EMCY_DEV", {3705: 2}, 0, {"DEVICE": 5}),
                ("GET_LOCAL_NODE_ID", {3705: 2}, 0, {}), ("GET_LOCAL_NODE_ID", {3705: 1, 3706: 128}, 0, {}),
                ("GET_CANOPEN_KERNEL_STATE", {3705: 2}, 1, {}), ("GET_CANOPEN_KERNEL_STATE", {3705: 1, 3706: 256}, 1, {}),
                ("GET_STATE", {3705: 2}, 0, {"DEVICE": 5}), ("GET_STATE", {3705: 1, 3706: 8}, 0, {"DEVICE": 5}),
                ("GET_STATE", {3706: 0}, 0, {"DEVICE": 0}), ("GET_STATE", {3706: 128}, 0, {"DEVICE": 0}),  # no own node ID
                ("SDO_READ4", {3705: 5}, 2, {"DEVICE": NODE, "INDEX": 0x2001}),  # after 3003h and 3004h: longer than requested
                ("SDO_READ_BUFFER", {3705: 4}, 2, {"DEVICE": NODE, "INDEX": 0x2001, "DATALENGTH": 3})):
            with self.subTest((name, changes)):
                self.check_refused(name, {3700: 0, **changes}, steps, **inputs)

    def test_result_codes(self):
        for code in (1, 2, 3, 4, 5, 0xFFFF):
            with self.subTest(code):
                self.check_refused("GET_LOCAL_NODE_ID", {3700: code})


class TimeOuts(BlockTest):
    """For each block, with a module that never ends a transaction, which exists only in this test."""

    def module(self, kernel):
        """Registers that respond to a read of 3002h at most."""
        memory = [0] * 70
        self.plc.window.read = lambda first, count: list(memory)

        def write(first, words):
            memory[first - 3700:first - 3700 + len(words)] = words
            if kernel is not None and memory[0] == 0xCA0E and memory[3] == 0x3002:
                memory[0], memory[5], memory[6] = 0, 1, kernel
        self.plc.window.write = write
        return memory

    def test_the_kernel_state_is_the_error(self):
        """After 20 ms, a scan for 0 in R3700, and one for the kernel state. None: the cable to the module is unplugged, and R3700 stays CA0Eh, also
        for the 500 ms of the request for the kernel state."""
        for kernel, error in ((0, TIMEOUT), (2, OVERFLOW), (0x10, BUS_OFF), (0x11, ERROR_PASSIVE), (None, TIMEOUT)):
            for name, inputs in ALL.items():
                with self.subTest((name, kernel)):
                    memory = self.module(kernel)
                    block = self.plc.block(name, TIMEOUT=20, **inputs)
                    self.assertEqual(self.bad(block, error), 522 if kernel is None else 23)
                    self.assertEqual(memory[0], 0)
                    self.off(block)
                    self.plc.called.clear()


class Scans(BlockTest):
    def traces(self, block, enables):
        """CONFIRM and ERROR after each scan with this ENABLE."""
        found = []
        for enable in enables:
            block.set(ENABLE=enable)
            self.plc.scan()
            found.append((int(block["CONFIRM"]), block["ERROR"]))
        return found

    def test_done_in_the_scan_after_the_response(self):
        block = self.plc.block("GET_LOCAL_NODE_ID")
        self.assertEqual(self.traces(block, [0, 1, 1, 1, 0, 1, 1]), [(0, 0), (0, 0), (1, 0), (1, 0), (0, 0), (0, 0), (1, 0)])

    def test_the_next_block_starts_a_scan_later(self):
        """R3700 = 0 must have reached the module, or a second CA0Eh would count as the same request."""
        long = self.plc.block("SDO_READ_BUFFER", DEVICE=99, INDEX=0x1000, DATALENGTH=4, ENABLE=True)
        self.plc.scan(5)
        waits = self.plc.block("GET_LOCAL_NODE_ID", ENABLE=True)
        self.plc.scan(3)
        long.set(ENABLE=False)
        written = []
        original = self.plc.window.write
        self.plc.window.write = lambda first, words: (written.append((first, words[0])), original(first, words))
        self.plc.run(waits)
        self.assertEqual([word for first, word in written if first == 3700], [0, 0xCA0E])
        self.check(waits, True, 0, DEVICE=127)


class Turns(BlockTest):
    def test_a_block_that_is_not_called_any_more_loses_its_turn(self):
        owner = self.plc.block("SDO_READ4", DEVICE=99, INDEX=0x1000, ENABLE=True)
        self.plc.scan(5)
        first, second = (self.plc.block("SDO_READ4", DEVICE=NODE, INDEX=0x2001, ENABLE=True) for _ in range(2))
        self.plc.scan(600)  # it keeps its turn as long as it is called
        self.plc.called.remove(owner)
        self.assertIn(self.plc.run(second), range(500, 515))
        self.check(first, True, 0)
        self.check(second, True, 0)
        self.assertEqual([text for text in self.plc.frames() if text.startswith("663#")], ["663#4000100000000000", "663#8000100000000008"])
        self.plc.called.append(owner)
        self.plc.scan()
        self.check(owner, False, INTERNAL)
        self.off(owner)
        owner.set(DEVICE=NODE)
        self.good(owner, DATALENGTH=4)

    def test_so_does_one_that_waits(self):
        owner = self.plc.block("SDO_READ4", DEVICE=99, INDEX=0x1000, ENABLE=True, TIMEOUT=50)
        waits = self.plc.block("SDO_READ4", DEVICE=NODE, INDEX=0x2001, ENABLE=True)
        last = self.plc.block("SDO_READ4", DEVICE=NODE, INDEX=0x1000, ENABLE=True)
        self.plc.scan(20)
        self.plc.called.remove(waits)
        self.plc.run(owner)
        self.assertIn(self.plc.run(last), range(1000, 1010))
        self.check(last, True, 0, DATALENGTH=4)
        self.plc.called.append(waits)  # it has not begun yet, and its turn comes now
        self.plc.run(waits)
        self.check(waits, True, 0, DATALENGTH=1)

    def test_the_highest_ticket(self):
        blocks = [self.plc.block("GET_LOCAL_NODE_ID", ENABLE=True) for _ in range(3)]
        self.plc.machine.globals["CBCAN"][0]["LAST_TICKET"] = 0xFFFFFFFD
        self.plc.scan(10)
        self.assertEqual([block["DEVICE"] for block in blocks], [127] * 3)
        self.assertEqual(self.plc.machine.globals["CBCAN"][0]["LAST_TICKET"], 2)

    def test_a_program(self):
        self.plc.runs_program = True
        self.plc.scan(50)
        self.assertEqual(self.plc.machine.programs["MAIN"][1]["TROUBLE"], 0)
        self.assertIn(self.plc.machine.programs["MAIN"][1]["STATE"], ("UNKNOWN", "NOT_AVAIL"))


class Conversions(BlockTest):
    def test_the_program_of_the_page(self):
        """It doubles 6081h of the drive; tests/st/axis_test.py has the functions' values."""
        text, = re.findall(r"```iecst\n(PROGRAM faster.*?)```", PAGE.read_text(), re.DOTALL)
        self.plc.machine = Machine(*source("cia405.st", "conversions.st"), ("page.st", text), configuration("faster"))
        self.plc.runs_program = True
        self.plc.scan(20)
        self.assertEqual(self.plc.command("get 16 0x6081"), "200000")


class Pointers(BlockTest):
    arguments = {"files": ("cia405.st", "cia405_codesys.st", "ramp.st"), "main": "Read_Write_SDO"}

    def test_an_abort_leaves_the_size(self):
        array = self.plc.machine.types["CBCAN_BUFFER"]._replace(high=0)
        where = Pointer({"DATA": [0]}, "DATA", array, 0)
        self.bad(self.plc.block("SDO_READ", DEVICE=NODE, INDEX=0x5000, DATA=where, DATALENGTH=1), OTHER, DATALENGTH=1)

    # The blocks of today's library

    def buffer(self, size):
        array = self.plc.machine.types["CBCAN_BUFFER"]._replace(high=size - 1)
        self.memory = {"DATA": [0] * size}
        return Pointer(self.memory, "DATA", array, 0)

    def test_data_blocks_of_any_mode_by_any_channel(self):
        write, read = (self.plc.block(name, DEVICE=NODE, INDEX=0x2005) for name in ("SDO_WRITE_DATA", "SDO_READ_DATA"))
        for channel, mode in ((0, "AUTO"), (1, "SEGMENTED"), (0, "BLOCK")):
            text = self.buffer(5)
            text.container["DATA"][:] = b"cbcan"
            self.good(write.set(CHANNEL=channel, MODE=mode, DATA=text, DATALENGTH=5))
            self.good(read.set(CHANNEL=channel, MODE=mode, DATA=self.buffer(20), DATALENGTH=20), DATALENGTH=5)
            self.assertEqual(bytes(self.memory["DATA"][:6]), b"cbcan\0")
            self.off(write)
            self.off(read)

    def test_errors_of_today(self):
        good = {"DEVICE": NODE, "INDEX": 0x2005, "DATALENGTH": 5}
        for inputs, error in (({"NETWORK": 3}, 0x25), ({"DEVICE": 128}, 0x24), ({"CHANNEL": 17}, 0x27), ({"CHANNEL": 2}, INTERNAL), ({"DATA": None}, 0x23),
                              ({"DATALENGTH": 0}, 0x23), ({"TIMEOUT": 65536}, 0x23), ({"INDEX": 0x5000}, OTHER)):
            for name in ("SDO_READ_DATA", "SDO_WRITE_DATA"):
                with self.subTest((name, inputs)):
                    self.bad(self.plc.block(name, **{**good, "DATA": self.buffer(5), **inputs}), error)
                    self.plc.called.clear()


cases.main()
