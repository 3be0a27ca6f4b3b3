#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""NMT, EMCY, node ID and states: every output and every error code of these blocks, against cbcan-sim."""

from st_bench import ALL, BUS_OFF, ERROR_PASSIVE, INTERNAL, OTHER, OVERFLOW, TIMEOUT, BlockTest
import cases

NO_EMCY = {"EMCY_ERROR_CODE": 0, "ERROR_REGISTER": 0, "ERROR_FIELD": [0, 0, 0, 0, 0]}


def emcy(code, register, *field):
    return {"EMCY_ERROR_CODE": code, "ERROR_REGISTER": register, "ERROR_FIELD": list(field)}


class Nmt(BlockTest):
    def check_frame(self, device, state, frame):
        block = self.plc.block("NMT", DEVICE=device, STATE=state)
        self.new_frames()
        self.good(block)
        self.assertEqual([text for text in self.new_frames() if text.startswith("000#")], [frame])

    def test_the_five_transitions(self):
        for state, frame in ((5, "000#0120"), (4, "000#0220"), (0x7F, "000#8020"), (6, "000#8120"), (7, "000#8220")):
            with self.subTest(state):
                self.check_frame(0x20, state, frame)

    def test_device_0_is_all(self):
        self.check_frame(0, 5, "000#0100")

    def test_what_is_no_transition_or_no_node(self):
        self.new_frames()
        for device, state in ((5, 0x800), (5, 0), (5, 1), (5, 128), (128, 5), (255, 5)):
            with self.subTest((device, state)):
                self.bad(self.plc.block("NMT", DEVICE=device, STATE=state), INTERNAL)
        self.assertEqual(self.new_frames(), [])

    def test_bus_off(self):
        self.plc.command("fault bus bus-off")
        self.plc.transaction(5066, 0, 0x3003, 0, 2, 20)
        self.bad(self.plc.block("NMT", STATE=5), BUS_OFF)

    def test_bus_off_before_the_module_gives_up(self):
        self.plc.command("fault bus bus-off")
        scans = self.bad(self.plc.block("NMT", STATE=5, TIMEOUT=50), BUS_OFF)
        self.assertIn(scans, range(52, 56))


class Emcy(BlockTest):
    options = ("--demo", "--slcan", "127.0.0.1:0")

    def test_of_a_node(self):
        block = self.plc.block("RECV_EMCY_DEV", DEVICE=0x20)
        self.good(block, ERRORINFO=NO_EMCY)
        self.off(block, ERRORINFO=NO_EMCY)
        self.plc.command("fault 32 emcy-storm code=0x8130 count=1")
        self.bad(block, OTHER, ERRORINFO=emcy(0x8130, 1, 0, 0, 0, 0, 0))
        self.off(block, ERRORINFO=NO_EMCY)
        self.plc.command("fault 32 emcy-storm code=0 count=1")
        self.good(block, ERRORINFO=emcy(0, 1, 0, 0, 0, 0, 0))

    def test_all_bytes(self):
        self.plc.command("incident 16 overtemperature on")
        frame, = [text for text in self.plc.frames() if text.startswith("090#")]
        data = bytes.fromhex(frame[4:])
        self.assertEqual(data[:3].hex(), "104209")
        block = self.plc.block("RECV_EMCY_DEV", DEVICE=0x10)
        self.bad(block, OTHER, ERRORINFO=emcy(0x4210, 9, *data[3:]))
        self.bad(self.plc.block("RECV_EMCY"), OTHER, DEVICE=0x10, ERRORINFO=emcy(0x4210, 9, *data[3:]))

    def test_the_own_one(self):
        self.good(self.plc.block("RECV_EMCY_DEV", DEVICE=0), ERRORINFO=NO_EMCY)

    def test_every_byte_has_its_place(self):
        self.send("0C2#1122334455667788")
        expected = emcy(0x2211, 0x33, 0x44, 0x55, 0x66, 0x77, 0x88)
        self.bad(self.plc.block("RECV_EMCY_DEV", DEVICE=0x42), OTHER, ERRORINFO=expected)
        self.bad(self.plc.block("RECV_EMCY"), OTHER, DEVICE=0x42, ERRORINFO=expected)

    def test_the_scan(self):
        block = self.plc.block("RECV_EMCY")
        self.good(block, DEVICE=0, ERRORINFO=NO_EMCY)
        self.off(block)
        self.plc.command("fault 32 emcy-storm code=0x1000 count=1")
        self.plc.command("fault 66 emcy-storm code=0x2310 count=1")
        for device, code in ((0x20, 0x1000), (0x42, 0x2310), (0x20, 0x1000)):  # again in each round
            self.bad(block, OTHER, DEVICE=device, ERRORINFO=emcy(code, 1, 0, 0, 0, 0, 0))
            self.off(block, DEVICE=0, ERRORINFO=NO_EMCY)
        self.plc.command("fault 66 emcy-storm code=0 count=1")
        self.good(block, DEVICE=0x42, ERRORINFO=NO_EMCY)
        self.off(block)
        self.bad(block, OTHER, DEVICE=0x20)
        self.off(block)
        self.bad(block, OTHER, DEVICE=0x20)


class States(BlockTest):
    options = ("--demo", "--node-id", "100")

    def test_the_own_node_id(self):
        block = self.plc.block("GET_LOCAL_NODE_ID")
        self.good(block, DEVICE=100)
        self.off(block, DEVICE=0)

    def test_the_kernel(self):
        block = self.plc.block("GET_CANOPEN_KERNEL_STATE")
        for fault, state in ((None, 0), ("bus-off", BUS_OFF), ("error-passive", ERROR_PASSIVE)):
            if fault:
                self.plc.command(f"fault bus {fault}")
            self.good(block, STATE=state, DEVICE=100)
            self.off(block, STATE=0, DEVICE=0)
            self.plc.command("clear bus")

    def test_an_overflow(self):
        """Whatever the kernel state is, the block hands it on."""
        block = self.plc.block("GET_CANOPEN_KERNEL_STATE", ENABLE=True)
        self.plc.scan(2)
        self.plc.window.write(3706, [2])
        self.plc.run(block)
        self.check(block, True, 0, STATE=2)

    def test_states_of_a_node(self):
        block = self.plc.block("GET_STATE", DEVICE=0x20)
        self.good(block, STATE="UNKNOWN")
        self.off(block, STATE="INIT")
        self.plc.transaction(5066, 0, 0x1016, 1, 4, 500, 0x20)
        self.plc.transaction(5066, 0x20, 0x1017, 0, 2, 100)
        for service, state in ((5, "OPERATIONAL"), (4, "STOPPED"), (0x7F, "PRE_OPERATIONAL")):
            self.plc.transaction(5066, 0, 0x1F82, 0x20, 1, service)
            self.plc.pass_time(200000)
            self.good(block, STATE=state)
            self.off(block)
        self.plc.command("fault 32 silent")
        for service, state in ((7, "RESET_COMM"), (6, "RESET_APP")):
            self.plc.transaction(5066, 0, 0x1F82, 0x20, 1, service)
            self.good(block, STATE=state)
            self.off(block)
        self.plc.pass_time(1000000)
        self.good(block, STATE="NOT_AVAIL")
        self.off(block)
        self.plc.command("clear 32")
        self.plc.transaction(5066, 0, 0x1F82, 0x20, 1, 6)
        self.good(block, STATE="INIT")

    def test_the_own_state(self):
        block = self.plc.block("GET_STATE", DEVICE=0)
        for service, state in ((5, "OPERATIONAL"), (4, "STOPPED"), (0x7F, "PRE_OPERATIONAL")):
            self.plc.transaction(5066, 0, 0x1F82, 100, 1, service)
            self.good(block, STATE=state)
            self.off(block)


class InvalidInputs(BlockTest):
    def test_what_all_blocks_have(self):
        for name, valid in ALL.items():
            for inputs in ({"NETWORK": 0}, {"NETWORK": 2}, {"TIMEOUT": 65536}):
                with self.subTest((name, inputs)):
                    self.assertEqual(self.bad(self.plc.block(name, **valid, **inputs), INTERNAL), 1)
                    self.plc.called.clear()
        self.assertEqual(self.plc.registers, [0] * 70)

    def test_the_longest_time_out(self):
        self.good(self.plc.block("GET_LOCAL_NODE_ID", TIMEOUT=65535), DEVICE=127)

    def test_node_ids(self):
        for name in ("RECV_EMCY_DEV", "GET_STATE"):
            self.assertEqual(self.bad(self.plc.block(name, DEVICE=128), INTERNAL), 1)


class NoResults(BlockTest):
    """Answers that no module gives, written over its own by another client."""

    def check_refused(self, name, changes, local_steps=0, **inputs):
        block = self.plc.block(name, ENABLE=True, **inputs)
        self.plc.scan(1 + local_steps)
        for register, value in changes.items():
            self.plc.window.write(register, [value])
        self.bad(block, INTERNAL)
        self.plc.called.clear()

    def test_of_another_size(self):
        for name, steps in (("RECV_EMCY", 0), ("RECV_EMCY_DEV", 0), ("GET_LOCAL_NODE_ID", 0), ("GET_CANOPEN_KERNEL_STATE", 1), ("GET_STATE", 0)):
            with self.subTest(name):
                self.check_refused(name, {3700: 0, 3705: 2}, steps, **({"DEVICE": 5} if name in ("RECV_EMCY_DEV", "GET_STATE") else {}))

    def test_numbers_that_mean_nothing(self):
        for name, value, steps in (("RECV_EMCY", 128, 0), ("GET_LOCAL_NODE_ID", 128, 0), ("GET_CANOPEN_KERNEL_STATE", 256, 1), ("GET_STATE", 8, 0)):
            with self.subTest(name):
                self.check_refused(name, {3700: 0, 3705: 9 if name == "RECV_EMCY" else 1, 3706: value}, steps,
                                   **({"DEVICE": 5} if name == "GET_STATE" else {}))

    def test_no_own_node_id(self):
        for value in (0, 128):
            self.check_refused("GET_STATE", {3706: value}, DEVICE=0)

    def test_result_codes(self):
        for code in (1, 2, 3, 4, 5, 0xFFFF):
            with self.subTest(code):
                self.check_refused("GET_LOCAL_NODE_ID", {3700: code})


class TimeOuts(BlockTest):
    """Of each block, with a module that never gets done: it exists in this test only."""

    def module(self, kernel):
        """Registers that answer a read of 3002h, if at all."""
        memory = [0] * 70
        self.plc.window.read = lambda first, count: list(memory)

        def write(first, words):
            memory[first - 3700:first - 3700 + len(words)] = words
            if kernel is not None and memory[0] == 0xCA0E and memory[3] == 0x3002:
                memory[0], memory[5], memory[6] = 0, 1, kernel
        self.plc.window.write = write
        return memory

    def test_the_kernel_state_is_the_error(self):
        for kernel, error in ((0, TIMEOUT), (2, OVERFLOW), (0x10, BUS_OFF), (0x11, ERROR_PASSIVE)):
            for name, inputs in ALL.items():
                with self.subTest((name, kernel)):
                    self.module(kernel)
                    block = self.plc.block(name, TIMEOUT=20, **inputs)
                    self.assertEqual(self.bad(block, error), 23)  # 20 ms, a scan for 0 in R3700, one for the kernel state
                    self.off(block)
                    self.plc.called.clear()

    def test_nobody_serves_the_registers(self):
        """The cable to the module is out: R3700 stays CA0Eh, and so it does when the kernel state is asked for."""
        for name, inputs in ALL.items():
            with self.subTest(name):
                memory = self.module(None)
                block = self.plc.block(name, TIMEOUT=20, **inputs)
                self.assertEqual(self.bad(block, TIMEOUT), 522)  # 500 ms for the kernel state
                self.assertEqual(memory[0], 0)
                self.off(block)
                self.plc.called.clear()


cases.main()
