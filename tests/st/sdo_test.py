#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""The four SDO blocks, and the two with pointers: every output and every error code, the frames on the bus."""

from st_bench import BUS_OFF, ERROR_PASSIVE, INTERNAL, NODE, OTHER, OVERFLOW, TIMEOUT, BlockTest
import cases
from st_types import Pointer

NO_SUCH_OBJECT, TIMED_OUT, TOO_LONG, READ_ONLY, NO_SEGMENT = 0x06020000, 0x05040000, 0x05040005, 0x06010002, 0x06010000


class Small(BlockTest):
    def test_read_of_one_to_four_bytes(self):
        for index, value, size in ((0x2001, [0x5A], 1), (0x2002, [0x34, 0x12], 2), (0x2003, [0x56, 0x34, 0x12], 3),
                                   (0x2004, [0x78, 0x56, 0x34, 0x12], 4)):
            with self.subTest(size):
                self.good(self.plc.block("SDO_WRITE4", DEVICE=NODE, INDEX=index, DATA=(value + [0xEE] * 4)[:4], DATALENGTH=size))
                block = self.plc.block("SDO_READ4", DEVICE=NODE, INDEX=index)
                self.good(block, DATA=(value + [0] * 4)[:4], DATALENGTH=size, ERRORINFO=0)
                self.off(block, DATA=[0, 0, 0, 0], DATALENGTH=0, ERRORINFO=0)
                self.plc.called.clear()

    def test_the_frames(self):
        self.new_frames()
        self.good(self.plc.block("SDO_WRITE4", DEVICE=NODE, INDEX=0x2003, DATA=[0x56, 0x34, 0x12, 0xEE], DATALENGTH=3))
        self.good(self.plc.block("SDO_READ4", DEVICE=NODE, INDEX=0x1018, SUBINDEX=1))
        self.assertEqual(self.new_frames()[-4:], ["620#2703200056341200", "5A0#6003200000000000", "620#4018100100000000", "5A0#4318100100000000"])

    def test_aborts(self):
        for name, index, abort in (("SDO_READ4", 0x5000, NO_SUCH_OBJECT), ("SDO_READ4", 0x2005, TOO_LONG), ("SDO_WRITE4", 0x1000, READ_ONLY)):
            inputs = {"DATALENGTH": 4} if name == "SDO_WRITE4" else {}
            block = self.plc.block(name, DEVICE=NODE, INDEX=index, **inputs)
            self.bad(block, OTHER, ERRORINFO=abort)
            self.off(block, ERRORINFO=0)

    def test_the_local_device(self):
        block = self.plc.block("SDO_READ4", INDEX=0x3001)
        self.new_frames()
        self.good(block, DATA=[127, 0, 0, 0], DATALENGTH=1)
        self.assertEqual([text for text in self.new_frames() if text.startswith("6")], [])

    def test_invalid_inputs(self):
        for name, inputs in (("SDO_READ4", {}), ("SDO_WRITE4", {"DATALENGTH": 1}), ("SDO_READ_BUFFER", {"DATALENGTH": 1}),
                             ("SDO_WRITE_BUFFER", {"DATALENGTH": 1})):
            wrong = [{"DEVICE": 128}, {"CHANNEL": 0}, {"CHANNEL": 2}]
            if name != "SDO_READ4":
                wrong += [{"DATALENGTH": 0}, {"DATALENGTH": 5 if name == "SDO_WRITE4" else 129}]
            for changes in wrong:
                with self.subTest((name, changes)):
                    block = self.plc.block(name, **{"DEVICE": NODE, "INDEX": 0x2001, **inputs, **changes})
                    self.assertEqual(self.bad(block, INTERNAL, ERRORINFO=0), 1)
                    self.plc.called.clear()
        self.assertEqual(self.plc.registers, [0] * 70)

    def test_an_answer_longer_than_was_asked_for(self):
        for name, inputs, size in (("SDO_READ4", {}, 5), ("SDO_READ_BUFFER", {"DATALENGTH": 3}, 4)):
            block = self.plc.block(name, ENABLE=True, DEVICE=NODE, INDEX=0x2001, **inputs)
            self.plc.scan(1 if name == "SDO_READ_BUFFER" else 3)  # the first one sets 3003h and 3004h
            self.plc.window.write(3705, [size])
            self.plc.run(block)
            self.check(block, False, INTERNAL)
            self.plc.called.clear()
            self.good(self.plc.block("SDO_READ4", DEVICE=NODE, INDEX=0x2001))
            self.plc.called.clear()


class AnySize(BlockTest):
    def write_and_read(self, index, size, mode="AUTO", write="SDO_WRITE_BUFFER"):
        data = [(7 * i + size) % 256 for i in range(size)]
        self.good(self.plc.block(write, DEVICE=NODE, INDEX=index, MODE=mode, DATA=data + [0xEE] * (128 - size), DATALENGTH=size), ERRORINFO=0)
        block = self.plc.block("SDO_READ_BUFFER", DEVICE=NODE, INDEX=index, DATALENGTH=128, DATA=[0xDD] * 128)
        self.good(block, DATALENGTH=size, DATA=data + [0xDD] * (128 - size))
        self.off(block, DATALENGTH=size, DATA=data + [0xDD] * (128 - size))  # the program's own variables stay
        self.plc.called.clear()

    def test_sizes(self):
        for index, size in ((0x2001, 1), (0x2002, 2), (0x2003, 3), (0x2004, 4), (0x2005, 5), (0x2008, 8), (0x200E, 14), (0x207F, 127), (0x2080, 128)):
            with self.subTest(size):
                self.write_and_read(index, size)

    def test_modes_are_set_and_forgotten_again(self):
        for mode, first in (("SEGMENTED", "620#2105200005000000"), ("BLOCK", "620#C605200005000000"), ("AUTO", "620#2105200005000000")):
            with self.subTest(mode):
                self.new_frames()
                self.write_and_read(0x2005, 5, mode)
                self.assertEqual([text for text in self.new_frames() if text.startswith("620#")][0], first)
        self.assertEqual(self.plc.machine.globals["CBCAN"]["SDO_MODE"], 0)

    def test_expedited(self):
        block = self.plc.block("SDO_WRITE_BUFFER", DEVICE=NODE, INDEX=0x2005, MODE="EXPEDITED", DATALENGTH=5)
        self.bad(block, OTHER, ERRORINFO=NO_SEGMENT)
        self.plc.called.clear()
        self.write_and_read(0x2004, 4, "EXPEDITED")

    def test_an_object_larger_than_the_buffer(self):
        block = self.plc.block("SDO_READ_BUFFER", DEVICE=NODE, INDEX=0x2008, DATALENGTH=7, DATA=[1] * 128)
        self.bad(block, OTHER, ERRORINFO=TOO_LONG, DATALENGTH=7, DATA=[1] * 128)

    def test_3003h_and_3004h_are_written_when_they_have_to_be(self):
        """Counted in scans: a local object takes one."""
        block = self.plc.block("SDO_READ4", DEVICE=NODE, INDEX=0x2001, TIMEOUT=500)
        self.assertEqual(self.good(block), 4)  # both, then the object
        self.off(block)
        self.assertEqual(self.plc.transaction(5055, 0, 0x3003, 0, 2), 0)
        self.assertEqual(self.plc.window.read(3706, 1), [500])
        self.assertEqual(self.good(block), 2)  # they are known
        self.off(block)
        block.set(TIMEOUT=0)
        self.assertEqual(self.good(block), 3)  # 3003h alone
        self.off(block)
        self.assertEqual(self.plc.transaction(5055, 0, 0x3003, 0, 2), 0)
        self.assertEqual(self.plc.window.read(3706, 1), [0])

    def test_cancelled_while_they_are_written(self):
        """The module may have done it: 3003h is 200 now, and 3004h 2."""
        block = self.plc.block("SDO_WRITE_BUFFER", DEVICE=NODE, INDEX=0x2005, DATALENGTH=5, TIMEOUT=500)
        self.good(block)
        self.off(block)
        for changes, scans in (({"TIMEOUT": 200}, 1), ({"MODE": "SEGMENTED"}, 1), ({"TIMEOUT": 200, "MODE": "SEGMENTED"}, 2)):
            block.set(ENABLE=True, **changes)
            self.plc.scan(scans)
            block.set(TIMEOUT=500, MODE="AUTO")
            self.off(block)
            self.good(block)
            self.off(block)
            for index, size, value in ((0x3003, 2, 500), (0x3004, 1, 0)):
                self.plc.transaction(5055, 0, index, 0, size)
                self.assertEqual(self.plc.window.read(3706, 1), [value], (changes, f"{index:X}h"))

    def test_what_the_program_writes_there_itself_is_not_relied_on(self):
        read = self.plc.block("SDO_READ4", DEVICE=NODE, INDEX=0x2001)
        self.good(read)
        self.off(read)
        for name, index in (("SDO_WRITE4", 0x3004), ("SDO_WRITE_BUFFER", 0x3004), ("SDO_WRITE4", 0x3003), ("SDO_WRITE_BUFFER", 0x3003)):
            own = self.plc.block(name, INDEX=index, DATALENGTH=0x3005 - index)
            self.good(own)
            self.off(own)
            self.assertEqual(self.good(read), 4)
            self.off(read)
        reset = self.plc.block("NMT", DEVICE=127, STATE=6)
        self.good(reset)
        self.off(reset)
        self.plc.pass_time(1000000)
        self.assertEqual(self.good(read), 4)

    def test_a_1f82h_is_the_modules_nmt_service(self):
        self.new_frames()
        self.good(self.plc.block("SDO_WRITE4", INDEX=0x1F82, SUBINDEX=NODE, DATA=[5, 0, 0, 0], DATALENGTH=1))
        self.assertIn("000#0120", self.new_frames())


class Failures(BlockTest):
    def test_a_node_that_is_not_there(self):
        """The module's own time-out, the same as the block's, begins when the block's turn has come."""
        block = self.plc.block("SDO_READ4", DEVICE=99, INDEX=0x1000, TIMEOUT=200)
        scans = self.bad(block, TIMEOUT)
        self.assertIn(scans, range(201, 206))

    def test_the_module_is_first(self):
        for changes in ({}, {"bus-off": BUS_OFF}, {"error-passive": ERROR_PASSIVE}):
            block = self.plc.block("SDO_READ4", DEVICE=99, INDEX=0x1000, ENABLE=True)
            self.plc.scan(3)
            for fault in changes:
                self.plc.command(f"fault bus {fault}")
            self.plc.window.write(3700, [0])  # another client takes the registers away, to give the module a time-out
            self.plc.transaction(5066, 0, 0x3003, 0, 2, 50)
            self.plc.window.start(5055, 99, 0x1000, 0, 4)
            self.plc.run(block)
            self.check(block, False, list(changes.values())[0] if changes else TIMEOUT, ERRORINFO=TIMED_OUT)
            self.plc.command("clear bus")
            self.off(block)
            self.plc.called.clear()

    def test_kernel_states(self):
        for fault, error in (("bus-off", BUS_OFF), ("error-passive", ERROR_PASSIVE)):
            self.plc.command(f"fault bus {fault}")
            for name in ("SDO_READ4", "SDO_WRITE4", "SDO_READ_BUFFER", "SDO_WRITE_BUFFER"):
                with self.subTest((fault, name)):
                    block = self.plc.block(name, DEVICE=99, INDEX=0x1000, TIMEOUT=50, **({} if name == "SDO_READ4" else {"DATALENGTH": 1}))
                    self.bad(block, error)
                    self.off(block)
                    self.plc.called.clear()
            self.plc.command("clear bus")

    def test_an_overflow(self):
        """No simulated controller gets into this state, so another client writes it into the answer."""
        block = self.plc.block("SDO_READ4", DEVICE=99, INDEX=0x1000, TIMEOUT=50)

        def overflow():
            if self.plc.registers[3] == 0x3002 and self.plc.window.read(3700, 1) == [0]:
                self.plc.window.write(3706, [2])
        self.plc.between = overflow
        self.bad(block, OVERFLOW)

    def test_faults_of_the_node(self):
        for fault, abort in (("answer-other-toggle", 0x05030000), ("answer-other-specifier specifier=7", 0x05040001),
                             ("abort code=0x06090030 step=segment", 0x06090030)):
            with self.subTest(fault):
                block = self.plc.block("SDO_READ_BUFFER", DEVICE=NODE, INDEX=0x200E, DATALENGTH=128, TIMEOUT=500)
                self.plc.command(f"fault 32 {fault} count=1")
                self.bad(block, OTHER, ERRORINFO=abort)
                self.plc.command("clear 32")
                self.plc.called.clear()


class Pointers(BlockTest):
    arguments = {"files": ("cia405.st", "cia405_codesys.st", "ramp.st"), "main": "Read_Write_SDO"}

    def pointer(self, *data):
        memory = {"DATA": list(data)}
        array = self.plc.machine.types["CBCAN_BUFFER"]._replace(high=len(data) - 1)
        return memory, Pointer(memory, "DATA", array, 0)

    def test_both_ways(self):
        memory, where = self.pointer(1, 2, 3, 4, 5, 6, 7, 8, 9)
        self.good(self.plc.block("SDO_WRITE", DEVICE=NODE, INDEX=0x2008, DATA=where, DATALENGTH=8))
        memory, where = self.pointer(*[0] * 10)
        self.good(self.plc.block("SDO_READ", DEVICE=NODE, INDEX=0x2008, DATA=where, DATALENGTH=10), DATALENGTH=8)
        self.assertEqual(memory["DATA"], [1, 2, 3, 4, 5, 6, 7, 8, 0, 0])

    def test_a_buffer_of_more_than_128_bytes(self):
        memory, where = self.pointer(*[9] * 200)
        self.good(self.plc.block("SDO_READ", DEVICE=NODE, INDEX=0x2080, DATA=where, DATALENGTH=200), DATALENGTH=128)
        self.assertEqual(memory["DATA"][128:], [9] * 72)

    def test_invalid_inputs(self):
        _, where = self.pointer(*[0] * 200)
        for name, inputs in (("SDO_READ", {"DATA": None, "DATALENGTH": 4}), ("SDO_READ", {"DATA": where, "DATALENGTH": 0}),
                             ("SDO_WRITE", {"DATA": None, "DATALENGTH": 4}), ("SDO_WRITE", {"DATA": where, "DATALENGTH": 0}),
                             ("SDO_WRITE", {"DATA": where, "DATALENGTH": 129})):
            with self.subTest((name, inputs)):
                self.bad(self.plc.block(name, DEVICE=NODE, INDEX=0x2001, **inputs), INTERNAL)
                self.plc.called.clear()

    def test_an_abort(self):
        _, where = self.pointer(0)
        self.bad(self.plc.block("SDO_READ", DEVICE=NODE, INDEX=0x5000, DATA=where, DATALENGTH=1), OTHER, ERRORINFO=NO_SUCH_OBJECT, DATALENGTH=1)
        self.bad(self.plc.block("SDO_WRITE", DEVICE=NODE, INDEX=0x5000, DATA=where, DATALENGTH=1), OTHER, ERRORINFO=NO_SUCH_OBJECT)


cases.main()
