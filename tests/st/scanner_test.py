#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""The blocks with the adapter for the scanner window, and a master that writes and reads whole blocks repeatedly, as OpenPLC's does; and the
recipe of docs/reference/ladder-recipes.md for that window."""

import re

from st_bench import ALL, INTERNAL, NODE, PROGRAM, TIMEOUT, BlockTest
import cases
from plc import ROOT, Instance, Plant, Plc, configuration, source
from recipes import PAGE, items, tables_of
from cbcan_st.machine import Machine

OUT, IN = (500, 70), (600, 68)


class ScannerPlc(Plc):
    """OUT and IN are the located words of openplc.st."""

    def __init__(self, program, *options, order="read write", every=1):
        super().__init__(program, *options, files=("cia405.st", "scanner.st", "openplc.st"), main="cbcan_exchange")
        self.order, self.every, self.scans, self.online = order.split(), every, 0, True
        self.images = {"%IW": [0] * IN[1]}
        self.restart_plc()

    def restart_plc(self):
        self.machine = Machine(*source("cia405.st", "scanner.st", "openplc.st"), configuration("cbcan_exchange"))
        self.program, self.values = self.machine.programs["MAIN"]
        self.images = {"%QW": [0] * OUT[1], "%IW": self.images["%IW"]}
        self.called = []

    def restart_module(self, *options):
        self.close()
        Plant.__init__(self, PROGRAM, *options)
        self.windows = [self.window]

    def words(self, area, image):
        return [(self.program.located[f"{area}{100 + i}"], i) for i in range(len(image))]

    def scan(self, count=1):
        for _ in range(count):
            for name, i in self.words("%IW", self.images["%IW"]):
                self.values[name] = self.images["%IW"][i]
            self.machine.scan(self.now)
            for block in self.called:
                block.block.run(block.values, self.now)
            self.images["%QW"] = [self.values[name] for name, _ in self.words("%QW", self.images["%QW"])]
            self.scans += 1
            for step in self.order if self.online and self.scans % self.every == 0 else ():
                getattr(self, step)()
            self.pass_time(self.scan_us)

    def read(self):
        self.images["%IW"] = self.window.read(*IN)

    def write(self):
        self.window.write(OUT[0], self.images["%QW"])


class Adapter(BlockTest):
    def start(self, *options, **arguments):
        plc = ScannerPlc(PROGRAM, *options, **arguments)
        self.addCleanup(lambda: plc.close())
        plc.pass_time(100000)
        return plc

    def transfers(self):
        return [frame for frame in self.plc.frames() if frame.startswith("620#40")]

    def test_every_block_in_either_order_fast_and_slow(self):
        for order in ("read write", "write read"):
            for every in (1, 7):
                self.plc = self.start(*self.options, order=order, every=every)
                for name, inputs in ALL.items():
                    with self.subTest((name, order, every)):
                        self.good(self.plc.block(name, TIMEOUT=2000, **inputs))
                        self.plc.called.clear()

    def test_each_execution_is_one_transfer_with_its_own_result(self):
        for order in ("read write", "write read"):
            for slow in (0, 120):
                self.plc = self.start(*self.options, order=order, every=50)  # 50 ms
                self.plc.command(f"fault {NODE} response-late delay_ms={slow}")
                written, read = (self.plc.block(name, DEVICE=NODE, INDEX=0x2001) for name in ("SDO_WRITE4", "SDO_READ4"))
                for i in range(10):
                    self.good(written.set(DATA=[i + 1, 0, 0, 0], DATALENGTH=1))
                    self.good(read, DATA=[i + 1, 0, 0, 0], DATALENGTH=1)
                    written.set(ENABLE=False)
                    read.set(ENABLE=False)
                    self.plc.scan(3)
                self.assertEqual(len(self.transfers()), 10, (order, slow))

    def test_cancelled_and_timed_out(self):
        cancelled, timed_out = (self.plc.block("SDO_READ4", DEVICE=node, INDEX=0x1000, TIMEOUT=300) for node in (NODE, 99))
        self.plc.command(f"fault {NODE} silent")
        cancelled.set(ENABLE=True)
        self.plc.scan(50)
        self.off(cancelled)
        self.plc.scan(5)
        self.assertEqual(self.plc.frames()[-1], f"{0x600 + NODE:03X}#8000100000000008")
        self.bad(timed_out, TIMEOUT)
        for node in (NODE, 99):
            self.assertEqual(self.plc.frames().count(f"{0x600 + node:03X}#8000100000000008"), 1)
        self.plc.called.clear()
        self.good(self.plc.block("GET_LOCAL_NODE_ID"), DEVICE=127)

    def test_a_timeout_that_the_first_transaction_needs_itself(self):
        """Exchanges of 100 ms, and four of them for the start of the scanner window, 3003h, 3004h and the transfer."""
        for order in ("read write", "write read"):
            self.plc = self.start(*self.options, order=order, every=100)
            block, confirmed = self.plc.block("SDO_READ4", DEVICE=NODE, INDEX=0x2001, TIMEOUT=400), []
            for _ in range(8):
                self.plc.run(block.set(ENABLE=True))
                confirmed.append(block["CONFIRM"])
                self.off(block)
            self.assertEqual(confirmed[2:], [True] * 6, order)

    def executions(self, order, period, node_ms, timeout, blocks=1):
        """Milliseconds of each execution of blocks that start together: [first], [later ones]."""
        self.plc = self.start(*self.options, order=order, every=period)
        self.plc.command(f"fault {NODE} response-late delay_ms={node_ms}")
        running = [self.plc.block("SDO_READ4", DEVICE=NODE, INDEX=0x2001, TIMEOUT=timeout) for _ in range(blocks)]
        each = []
        for pause in range(1, 6):
            ends, begun = {}, self.plc.now
            for block in running:
                block.set(ENABLE=True)
            while len(ends) < blocks:
                self.plc.scan()
                ends |= {i: self.plc.now - begun for i, block in enumerate(running) if block.ended() and i not in ends}
            self.assertTrue(all(block["CONFIRM"] for block in running), (order, period, node_ms, timeout))
            each.append([end // 1000 for end in ends.values()])
            for block in running:
                block.set(ENABLE=False)
            self.plc.scan(pause)
        return each[0], [end for ends in each[1:] for end in ends]

    @cases.in_long
    def test_the_page_s_rule_for_timeout(self):
        """Its table, and its least TIMEOUT with up to three blocks on the channel."""
        page = PAGE.read_text()
        exchanges, each_block, margin = map(int, re.search(r"TIMEOUT >= (\d+) T \+ q \((\d+) T \+ C\) \+ (\d+)\*\*", page).groups())
        rows = re.findall(r"^\| (read|write), then (read|write) \| (\d+) \| (\d+) \| (\d+) \| (\d+) \|$", page, re.MULTILINE)
        self.assertEqual(len(rows), 3)
        for first_step, second, *numbers in rows:
            period, node_ms, first, later = map(int, numbers)
            for blocks in (1, 3):
                timeout = exchanges * period + blocks * (each_block * period + node_ms) + margin
                begun, others = self.executions(f"{first_step} {second}", period, node_ms, timeout, blocks)
                self.assertLessEqual(max(begun), timeout)
                self.assertLessEqual(max(others), blocks * (each_block * period + node_ms))
                if blocks == 1:
                    self.assertEqual((begun, max(others)), ([first], later))

    def test_a_module_that_restarts_repeats_nothing(self):
        block = self.plc.block("NMT", DEVICE=NODE, STATE=5)
        self.good(block)
        self.off(block)
        self.plc.online = False
        block.set(ENABLE=True)
        self.plc.scan(3)
        self.plc.restart_module(*self.options)
        self.plc.online = True
        self.bad(block, INTERNAL)  # unknown whether it was executed
        self.assertNotIn("000#0120", self.plc.frames())
        self.off(block)
        self.good(block)
        self.assertEqual(self.plc.frames().count("000#0120"), 1)

    def test_a_plc_that_restarts_believes_no_old_result(self):
        """At each step of an execution, with an old IN: from the previous program, or from the start."""
        for every in (1, 7):
            self.plc = self.start(*self.options, every=every)
            zeros = list(self.plc.images["%IW"])
            for cut in range(0, 40, 5):
                for image in (None, zeros):
                    self.good(self.plc.block("GET_LOCAL_NODE_ID"), DEVICE=127)
                    self.plc.called.clear()
                    self.plc.block("SDO_READ4", DEVICE=NODE, INDEX=0x1000, ENABLE=True)
                    self.plc.scan(cut)
                    self.plc.images["%IW"] = image or self.plc.images["%IW"]
                    self.plc.restart_plc()
                    self.good(self.plc.block("SDO_READ4", DEVICE=NODE, INDEX=0x2001), DATALENGTH=1)
                    self.plc.called.clear()

    def test_a_plc_that_restarts_with_a_master_that_only_reads_at_first(self):
        self.good(self.plc.block("GET_LOCAL_NODE_ID"), DEVICE=127)
        self.plc.block("SDO_READ4", DEVICE=99, INDEX=0x1000, ENABLE=True)  # 3 and 4: 3003h and 3004h; 5 is in progress
        self.plc.scan(20)
        self.assertEqual(self.plc.images["%IW"][:3:2], [4, 5])
        self.plc.order = ["read"]
        self.plc.images["%IW"][:3] = [3, 0, 3]  # older
        self.plc.restart_plc()
        first = self.plc.block("RECV_EMCY_DEV", DEVICE=5, ENABLE=True)
        self.plc.scan(5)
        self.plc.order = ["read", "write"]
        self.good(first)
        self.good(self.plc.block("SDO_READ4", DEVICE=NODE, INDEX=0x2001), DATALENGTH=1)

    def test_after_65535_comes_1(self):
        block = self.plc.block("GET_LOCAL_NODE_ID")
        self.good(block)
        self.off(block)
        scanner = self.plc.values["SCANNER"]
        scanner["NUMBER"] = 65534
        for number in (65535, 1):
            self.good(block, DEVICE=127)
            self.off(block)
            self.assertEqual(scanner["NUMBER"], number)


class ChannelsPlc(Plc):
    """A program like the page's, but with ten nodes or blocks, with adapters for the first channels; the master exchanges 8 and 6 words of
    each."""

    def __init__(self, program, *options, channels=16, channel=0):
        Plant.__init__(self, program, *options)
        declared = "".join(f"r{n} : SDO_READ4; " for n in range(10))
        called = "".join(f"r{n}(ENABLE := TRUE, TIMEOUT := 1000, DEVICE := {11 + n}, CHANNEL := {channel}, INDEX := 16#1000);\n" for n in range(10))
        text = f"PROGRAM many_nodes VAR {declared} END_VAR\n{called}END_PROGRAM\n"
        self.machine = Machine(*source("cia405.st", "scanner.st"), ("many_nodes.st", text), configuration("many_nodes"))
        self.windows, self.called, self.runs_program = [self.window], [], False
        self.scanners = [Instance(self.machine.blocks["CBCAN_SCANNER"]).set(CHANNEL=n + 1) for n in range(channels)]

    def scan(self, count=1):
        for _ in range(count):
            for scanner in self.scanners:
                scanner.block.run(scanner.values, self.now)
            for block in self.called:
                block.block.run(block.values, self.now)
            if self.runs_program:
                self.machine.scan(self.now)
            for n, scanner in enumerate(self.scanners):
                self.window.write(OUT[0] + 200 * n, scanner["OUTS"][:8])
                scanner["INS"][:6] = self.window.read(IN[0] + 200 * n, 6)
            self.pass_time(self.scan_us)


class Channels(BlockTest):
    options = [word for node in range(11, 21) for word in ("--node", f"{node}={ROOT}/plants/demo/generic.eds")]

    def start(self, *options, **arguments):
        plc = ChannelsPlc(PROGRAM, *options, **arguments)
        self.addCleanup(plc.close)
        plc.pass_time(100000)
        return plc

    def blocks(self, name, count, **inputs):
        return [self.plc.block(name, INDEX=0x2004, **{"DEVICE": 11 + i % 10, **inputs}) for i in range(count)]

    def test_ten_blocks_and_ten_nodes_of_50_ms(self):
        def scans(channel):
            self.plc = self.start(*self.options, channel=channel)
            for node in range(11, 21):
                self.plc.command(f"fault {node} response-late delay_ms=50")
            self.plc.runs_program = True
            main, begun = self.plc.machine.programs["MAIN"][1], self.plc.now
            while not all(main[f"R{i}"]["CONFIRM"] for i in range(10)):
                self.plc.scan()
            return (self.plc.now - begun) // 1000
        told = re.search(r"after (\d+) to (\d+)\s+ms;\s+with `CHANNEL := 1` after (\d+) to (\d+)\s+ms", PAGE.read_text())
        first, last, slow_first, slow_last = map(int, told.groups())
        self.assertIn(scans(1), range(slow_first, slow_last + 1))
        self.assertIn(scans(0), range(first, last + 1))
        self.assertGreater(slow_first, 7 * last)

    def test_a_channel_of_its_own_and_one_that_nobody_serves(self):
        self.plc = self.start(*self.options, channels=3)
        slow, fast, unserved = self.blocks("SDO_READ4", 3)
        self.plc.command("fault 11 silent")
        slow.set(CHANNEL=3, TIMEOUT=400, ENABLE=True)
        self.plc.scan(10)
        self.assertLess(self.good(fast.set(CHANNEL=2)), 12)
        self.bad(unserved.set(CHANNEL=4), INTERNAL)
        self.plc.run(slow)
        self.check(slow, False, TIMEOUT)

    def test_a_module_with_one_channel(self):
        self.plc = self.start("--set", "module.channels=1", *self.options)
        any_one, second = self.blocks("SDO_READ4", 2)
        self.good(any_one.set(CHANNEL=0))
        self.bad(second.set(CHANNEL=2, TIMEOUT=100), TIMEOUT)

    def test_more_blocks_than_channels_have_turns(self):
        self.plc = self.start(*self.options, channels=3)
        blocks, done = self.blocks("SDO_READ4", 9, CHANNEL=0), [0] * 9
        for _ in range(600):
            for i, block in enumerate(blocks):
                done[i] += block.ended() and not block["ERROR"]
                block.set(ENABLE=not block.ended())
            self.plc.scan()
        self.assertGreater(min(done), max(60, 0.8 * max(done)), done)

    def test_a_reset_of_the_module_s_node_is_known_on_all_channels(self):
        self.plc = self.start(*self.options, channels=2)
        read, = self.blocks("SDO_READ4", 1, CHANNEL=2, TIMEOUT=2000)
        reset = self.plc.block("NMT", DEVICE=127, STATE=6)
        self.good(read)
        self.off(read)
        self.good(reset)
        self.plc.command("fault 11 silent")
        self.plc.scan_us = 10000
        self.bad(read, TIMEOUT)  # with 3003h as after a reset: the module's own 0504 0000h after 1000 ms


class Recipe(Plant):
    """The rungs of the page, and a master that exchanges the blocks every 5 scans."""

    def __init__(self):
        super().__init__(PROGRAM, "--demo")
        self.rungs, = tables_of(PAGE.read_text())["On the scanner window"]
        self.restart_plc()

    def restart_plc(self):
        self.words = {OUT[0] + i: 0 for i in range(OUT[1])} | {IN[0] + i: 0 for i in range(IN[1])}
        self.bits = {"FIRST": 1, "READY": 0, "BUSY": 0, "START": 0, "TWICE": 0, "RESULT": 256, "N": 0, "OVER": 0}
        self.busy_since = self.scans = 0

    def value(self, text):
        text = re.sub(r"R(\d+)", lambda m: str(self.words[int(m[1])]), text)
        text = re.sub(r"[A-Z]+", lambda m: str(self.bits[m[0]]), text)
        assert re.fullmatch(r"[\d +=>andmo]*", text), text
        return eval(re.sub(r"(?<!>)=", "==", text).replace("mod", "%"))  # only numbers and operators, as checked above

    def scan(self):
        was_busy = self.bits["BUSY"]
        self.bits["OVER"] = int(was_busy and self.now - self.busy_since >= 300000)
        for _, when, then in self.rungs:
            if self.value(items(when)[0]):
                for name, text in (item.split(" = ") for item in items(then)):
                    words = name[1:].isdigit()
                    (self.words if words else self.bits)[int(name[1:]) if words else name] = self.value(text)
        if self.bits["BUSY"] and not was_busy:
            self.busy_since = self.now
        self.bits["FIRST"] = 0
        self.scans += 1
        if self.scans % 5 == 0:
            self.window.write(OUT[0], [self.words[OUT[0] + i] for i in range(OUT[1])])
            self.words.update(enumerate(self.window.read(*IN), IN[0]))
        self.pass_time(1000)

    def request(self, *words, twice):
        self.words.update(enumerate(words, OUT[0] + 1))
        self.bits.update(START=1, TWICE=int(twice), RESULT=256)
        for _ in range(2000):
            self.scan()
            if self.bits["RESULT"] != 256 and not self.bits["START"]:
                return self.bits["RESULT"]
        raise AssertionError("no result")


class ScannerRecipe(BlockTest):
    def start(self, *_, **__):
        plc = Recipe()
        self.addCleanup(plc.close)
        plc.pass_time(100000)
        return plc

    def test_after_its_start_the_module_does_not_carry_out_the_first_one(self):
        self.assertEqual(self.plc.request(5066, 0, 0x1F82, NODE, 1, 5, twice=False), 5)
        self.assertNotIn("000#0120", self.plc.frames())
        self.assertEqual(self.plc.request(5066, 0, 0x1F82, NODE, 1, 5, twice=False), 0)
        self.assertEqual(self.plc.frames().count("000#0120"), 1)

    def test_abort_time_out_and_a_plc_that_restarts(self):
        self.assertEqual(self.plc.request(5055, 0, 0x3001, 0, 1, twice=True), 0)  # requested again after 5
        self.assertEqual([self.plc.words[603], self.plc.words[604]], [1, 127])
        self.assertEqual(self.plc.request(5055, NODE, 0x3333, 0, 4, twice=False), 4)
        self.assertEqual([self.plc.words[604], self.plc.words[605]], [0, 0x0602])
        self.assertEqual(self.plc.request(5055, 99, 0x1000, 0, 4, twice=False), 255)
        self.plc.restart_plc()
        self.assertEqual(self.plc.request(5055, NODE, 0x2001, 0, 4, twice=False), 0)
        self.assertEqual(self.plc.words[603], 1)
        self.assertIn("663#8000100000000008", self.plc.frames())


cases.main()
