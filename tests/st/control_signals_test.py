#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""ENABLE, CONFIRM, ERROR and TIMEOUT over time: the three execution diagrams of CiA 405, cancelling at every frame, blocks that wait."""

from st_bench import ALL, GENERIC, INTERNAL, NODE, OTHER, TIMEOUT, BlockTest
import cases

SLOW = ("--node", f"{NODE}={GENERIC}", "--bit-rate", "10000")  # a frame of eight bytes takes more than 10 ms


class Diagrams(BlockTest):
    def traces(self, block, enables):
        """CONFIRM and ERROR after each scan with ENABLE so."""
        found = []
        for enable in enables:
            block.set(ENABLE=enable)
            self.plc.scan()
            found.append((int(block["CONFIRM"]), block["ERROR"]))
        return found

    def test_done(self):
        for name, inputs in ALL.items():
            with self.subTest(name):
                block = self.plc.block(name, **inputs)
                self.good(block)
                self.assertEqual(self.traces(block, [1, 1, 1, 0, 0]), [(1, 0)] * 3 + [(0, 0)] * 2)
                self.good(block)  # ready for a new start
                self.off(block)
                self.plc.called.clear()

    def test_done_in_the_scan_after_the_answer(self):
        block = self.plc.block("GET_LOCAL_NODE_ID")
        self.assertEqual(self.traces(block, [0, 1, 1, 1, 0, 1, 1]), [(0, 0), (0, 0), (1, 0), (1, 0), (0, 0), (0, 0), (1, 0)])

    def test_cancelled(self):
        for name, inputs in ALL.items():
            with self.subTest(name):
                block = self.plc.block(name, **inputs)
                self.assertEqual(self.traces(block, [1, 0, 0, 0]), [(0, 0)] * 4)
                self.good(block)
                self.off(block)
                self.plc.called.clear()

    def test_cancelled_in_every_phase(self):
        """3003h, 3004h, the transfer, the time-out, the kernel state."""
        other = self.plc.block("SDO_READ4", DEVICE=NODE, INDEX=0x2001)
        block = self.plc.block("SDO_READ4", DEVICE=99, INDEX=0x1000, TIMEOUT=10)
        for scans in range(1, 16):
            with self.subTest(scans):
                block.set(ENABLE=True)
                self.plc.scan(scans)
                self.off(block)
                self.good(other, DATALENGTH=1)
                self.off(other)

    def test_ended_on_an_error(self):
        block = self.plc.block("SDO_READ4", DEVICE=NODE, INDEX=0x5000)
        self.bad(block, OTHER)
        self.assertEqual(self.traces(block, [1, 1, 0, 0]), [(0, OTHER)] * 2 + [(0, 0)] * 2)
        self.bad(block, OTHER)
        block.set(INDEX=0x2001)
        self.assertEqual(self.traces(block, [1, 0]), [(0, OTHER), (0, 0)])
        self.good(block)

    def test_aborted_on_a_time_out(self):
        block = self.plc.block("SDO_READ4", DEVICE=99, INDEX=0x1000, TIMEOUT=20)
        self.bad(block, TIMEOUT)
        self.assertEqual(self.traces(block, [1, 1, 0, 0]), [(0, TIMEOUT)] * 2 + [(0, 0)] * 2)

    def test_wrong_inputs_matter_at_the_start_only(self):
        block = self.plc.block("GET_STATE", DEVICE=200)
        self.bad(block, INTERNAL)
        block.set(DEVICE=5)
        self.assertEqual(self.traces(block, [1, 0]), [(0, INTERNAL), (0, 0)])
        self.good(block)
        block.set(DEVICE=200)
        self.assertEqual(self.traces(block, [1]), [(1, 0)])


class Cancelled(BlockTest):
    options = SLOW

    def transfers(self):
        """Expedited, segmented, block."""
        return [("SDO_READ4", {"INDEX": 0x1018, "SUBINDEX": 1}, "80181001"),
                ("SDO_WRITE4", {"INDEX": 0x2002, "DATALENGTH": 2}, "80022000"),
                ("SDO_READ_BUFFER", {"INDEX": 0x200E, "DATALENGTH": 128}, "800E2000"),
                ("SDO_WRITE_BUFFER", {"INDEX": 0x200E, "DATALENGTH": 14}, "800E2000"),
                ("SDO_WRITE_BUFFER", {"INDEX": 0x200E, "DATALENGTH": 14, "MODE": "BLOCK"}, "800E2000")]

    def test_at_every_frame(self):
        for name, inputs, abort in self.transfers():
            plc = self.plc = self.start(*SLOW)
            block = plc.block(name, DEVICE=NODE, **inputs)
            other = plc.block("SDO_READ4", DEVICE=NODE, INDEX=0x2001)
            self.good(block)
            self.good(other)
            self.off(other)
            self.off(block)
            self.new_frames()
            self.good(block)
            whole = self.new_frames()
            self.off(block)
            seen = set()
            for scans in range(1, 200):
                block.set(ENABLE=True)
                plc.scan(scans)
                count = len(self.new_frames())
                if count == len(whole):
                    break
                seen.add(count)
                block.set(ENABLE=False)
                plc.scan()
                plc.pass_time(1500000)  # an answer that comes late has come, and quarantine is over
                self.check_cancelled(block, other, whole, f"620#{abort}00000008")
                self.new_frames()
            self.assertEqual(seen, set(range(len(whole))), "cancelled in the middle of every frame")

    def check_cancelled(self, block, other, whole, abort):
        """What was on its way has come; then one abort, and nothing of the transfer any more."""
        frames = self.plc.frames()
        start = max(i for i, text in enumerate(frames) if text == whole[0])
        transfer = frames[start:]
        self.assertEqual((block["CONFIRM"], block["ERROR"]), (False, 0))
        aborts = [text for text in transfer if text.startswith("620#80")]
        self.assertEqual(aborts, [abort], transfer)
        before = transfer.index(aborts[0])
        self.assertEqual([text for text in transfer[before + 1:] if text.startswith("620#")], [])
        self.assertEqual(transfer[:before], whole[:before])
        self.good(other)
        self.off(other)

    def test_an_answer_that_comes_late_is_ignored(self):
        block, other = (self.plc.block("SDO_READ4", DEVICE=NODE, INDEX=index) for index in (0x1018, 0x2001))
        block.set(SUBINDEX=3)
        self.plc.command(f"fault {NODE} answer-late delay_ms=300 index=0x1018 count=1")
        block.set(ENABLE=True)
        self.plc.scan(30)
        block.set(ENABLE=False)
        self.good(other, DATA=[0, 0, 0, 0], DATALENGTH=1)
        self.check(block, False, 0, DATA=[0, 0, 0, 0], DATALENGTH=0)
        self.assertIn("5A0#4318100300000100", self.plc.frames())

    def test_the_next_block_starts_a_scan_later(self):
        """R3700 = 0 has to have reached the module: it would take a second CA0Eh for the same request."""
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

    def test_a_block_that_waits(self):
        first = self.plc.block("SDO_READ_BUFFER", DEVICE=NODE, INDEX=0x200E, DATALENGTH=128, ENABLE=True)
        gone = self.plc.block("GET_LOCAL_NODE_ID", ENABLE=True)
        last = self.plc.block("GET_LOCAL_NODE_ID", ENABLE=True)
        self.plc.scan(4)
        gone.set(ENABLE=False)
        self.plc.run(last)
        self.assertTrue(first["CONFIRM"])
        self.check(gone, False, 0, DEVICE=0)
        self.check(last, True, 0, DEVICE=127)


class Together(BlockTest):
    def test_ten_blocks_at_once(self):
        blocks = [self.plc.block(name, ENABLE=True, **inputs) for name, inputs in ALL.items()]
        order = []
        for _ in range(200):
            self.plc.scan()
            order += [block for block in blocks if block.ended() and block not in order]
        self.assertEqual([block.block.name for block in order], list(ALL))
        self.assertEqual([block["ERROR"] for block in blocks], [0] * 10)

    def test_first_come_first_served_wherever_they_are_called(self):
        """They are called in one order, and enabled in another, in one scan each."""
        blocks = [self.plc.block("SDO_READ4", DEVICE=99, INDEX=0x2001, TIMEOUT=60)]
        blocks += [self.plc.block("SDO_READ4", DEVICE=NODE, INDEX=0x2001) for _ in range(5)]
        enabled = [0, 4, 2, 5, 1, 3]
        for number in enabled:
            blocks[number].set(ENABLE=True)
            self.plc.scan()
        order = []
        for _ in range(200):
            self.plc.scan()
            order += [number for number, block in enumerate(blocks) if block.ended() and number not in order]
        self.assertEqual(order, enabled)

    def test_nobody_waits_longer_than_the_others(self):
        blocks = [self.plc.block("SDO_READ4", DEVICE=NODE, INDEX=0x2001) for _ in range(5)]
        done = [0] * 5
        for _ in range(300):
            for number, block in enumerate(blocks):
                done[number] += block["CONFIRM"]
                block.set(ENABLE=not block.ended())
            self.plc.scan()
        self.assertGreater(min(done), 20)
        self.assertLessEqual(max(done) - min(done), 1, done)

    def test_one_that_waits_has_a_time_out_too(self):
        self.plc.block("SDO_READ4", DEVICE=99, INDEX=0x1000, ENABLE=True)
        waits = self.plc.block("GET_LOCAL_NODE_ID", TIMEOUT=30)
        self.assertEqual(self.bad(waits, TIMEOUT), 31)

    def test_a_block_that_is_not_called_any_more_loses_its_turn(self):
        owner = self.plc.block("SDO_READ4", DEVICE=99, INDEX=0x1000, ENABLE=True)
        self.plc.scan(5)
        first, second = (self.plc.block("SDO_READ4", DEVICE=NODE, INDEX=0x2001, ENABLE=True) for _ in range(2))
        self.plc.scan(600)  # as long as it is called it keeps its turn
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
        self.plc.called.append(waits)  # it has not begun yet, and has its turn now
        self.plc.run(waits)
        self.check(waits, True, 0, DATALENGTH=1)

    def test_a_program_that_stands_still_goes_on(self):
        blocks = [self.plc.block("SDO_READ4", DEVICE=NODE, INDEX=0x2001, ENABLE=True) for _ in range(3)]
        self.plc.scan(2)
        self.plc.pass_time(5000000)
        self.plc.scan(20)
        self.assertEqual([block["CONFIRM"] for block in blocks], [True] * 3)

    def test_the_highest_ticket(self):
        blocks = [self.plc.block("GET_LOCAL_NODE_ID", ENABLE=True) for _ in range(3)]
        self.plc.machine.globals["CBCAN"]["LAST_TICKET"] = 0xFFFFFFFD
        self.plc.scan(10)
        self.assertEqual([block["DEVICE"] for block in blocks], [127] * 3)
        self.assertEqual(self.plc.machine.globals["CBCAN"]["LAST_TICKET"], 2)

    def test_a_program(self):
        self.plc.runs_program = True
        self.plc.scan(50)
        self.assertEqual(self.plc.machine.programs["MAIN"][1]["TROUBLE"], 0)
        self.assertIn(self.plc.machine.programs["MAIN"][1]["STATE"], ("UNKNOWN", "NOT_AVAIL"))


cases.main()
