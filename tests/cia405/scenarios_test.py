#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Every scenario of scenarios.txt with cbcan-sim, in virtual time: with the blocks of the C++ library, those in Structured Text, or
the recipes of docs/reference/ladder-recipes.md.

usage: scenarios_test.py SIMULATOR PROGRAM     (PROGRAM: cia405_block_program, "st" or "recipes")
"""

import re
import subprocess
import sys

import cases
from plc import ROOT, Plant, Plc
from recipes import Recipes
from cbcan_st.machine.types import Pointer

SIMULATOR, PROGRAM = sys.argv[1:3]
del sys.argv[1:3]
GENERIC = f"{ROOT}/plants/demo/generic.eds"
# The outputs that are 0 after ENABLE = FALSE, in addition to CONFIRM and ERROR; the buffer and its size belong to the program.
OUTPUTS = {"NMT": (), "RECV_EMCY": ("DEVICE", "ERRORINFO"), "RECV_EMCY_DEV": ("ERRORINFO",), "GET_LOCAL_NODE_ID": ("DEVICE",),
           "GET_CANOPEN_KERNEL_STATE": ("STATE", "DEVICE"), "GET_STATE": ("STATE",), "SDO_READ": ("ERRORINFO",),
           "SDO_READ4": ("DATA", "DATALENGTH", "ERRORINFO"), "SDO_WRITE": ("ERRORINFO",), "SDO_WRITE4": ("ERRORINFO",)}
STATES = ("INIT", "RESET_COMM", "RESET_APP", "PRE_OPERATIONAL", "STOPPED", "OPERATIONAL", "UNKNOWN", "NOT_AVAIL")
MODES = ("AUTO", "EXPEDITED", "SEGMENTED", "BLOCK")


def number(text):
    for words in (STATES, MODES):
        if text in words:
            return words.index(text)
    return int(text[:-1], 16) if text.endswith("h") else int(text)


def data(text):
    """`6745`, `EE*3` or `01..80`"""
    first, dots, last = text.partition("..")
    byte, star, times = text.partition("*")
    return bytes(range(int(first, 16), int(last, 16) + 1)) if dots else bytes.fromhex(byte) * int(times or 1)


def values(words):
    """{name: value} of `NAME=VALUE` words, `CONFIRM` is 1. DATA, and an EMCY message in ERRORINFO, are bytes."""
    found = {}
    for name, _, text in (word.partition("=") for word in words):
        found[name] = data(text) if name == "DATA" or name == "ERRORINFO" and len(text) == 16 else number(text or "1")
    return found


class Block:
    """A block of a scenario: common to the three programs."""

    def __init__(self, program, kind):
        self.program, self.kind, self.room = program, kind, 4 if kind == "SDO_WRITE4" else 0
        self.given = bytes(4) if kind == "SDO_READ4" else b""  # DATA before the execution
        self.enabled, self.told = False, False
        self.begun, self.ended_at = 0, None

    def set(self, inputs):
        self.given = inputs.pop("DATA", self.given)
        if self.kind in ("SDO_READ", "SDO_WRITE"):
            self.room = inputs.get("DATALENGTH", self.room)
        if self.room or "DATALENGTH" in inputs:
            self.given = inputs["DATA"] = self.given.ljust(self.room, b"\0")[:self.room]
        for name, value in inputs.items():
            self.put(name, value)


class StBlock(Block):
    def __init__(self, program, kind):
        super().__init__(program, kind)
        self.instance, self.array = program.block(kind), program.machine.types["CBCAN_BUFFER"]

    def put(self, name, value):
        if isinstance(value, bytes):
            value = list(value)
        if name == "DATA" and "POINTER" in self.instance.block.types["DATA"].name:
            self.buffer = {"DATA": value}
            value = Pointer(self.buffer, "DATA", self.array._replace(high=len(value) - 1), 0)
        self.instance.set(**{name: MODES[value] if name == "MODE" else value})

    def __getitem__(self, name):
        value = self.instance[name]
        if isinstance(value, Pointer):
            value = self.buffer["DATA"]
        if isinstance(value, dict):
            value = [value["EMCY_ERROR_CODE"] & 255, value["EMCY_ERROR_CODE"] >> 8, value["ERROR_REGISTER"], *value["ERROR_FIELD"]]
        return bytes(value) if isinstance(value, list) else STATES.index(value) if isinstance(value, str) else int(value)


class StProgram(Plc):
    def __init__(self, *options):
        super().__init__(SIMULATOR, *options, files=("cia405.st", "cia405_codesys.st", "ramp.st"), main="Read_Write_SDO")

    def new(self, kind):
        return StBlock(self, kind)

    def clear(self):
        self.called.clear()


class OtherProgram(Plant):
    def __init__(self, *options):
        super().__init__(SIMULATOR, *options)
        self.blocks = []

    def new(self, kind):
        self.blocks.append(self.kind_of_block(self, kind))
        return self.blocks[-1]

    def clear(self):
        self.blocks.clear()


class CppBlock(Block):
    def __init__(self, program, kind):
        super().__init__(program, kind)
        self.number, self.members = len(program.blocks), {}  # after the last cycle
        program.tell("new", kind)

    def put(self, name, value):
        if (self.kind, name) not in (("SDO_READ", "DATALENGTH"), ("SDO_WRITE", "DATALENGTH")):  # follows from the size of DATA
            self.program.tell("set", self.number, name, value.hex().upper() if isinstance(value, bytes) else int(value))

    def __getitem__(self, name):
        return self.members[name]


class CppProgram(OtherProgram):
    kind_of_block = CppBlock

    def __init__(self, *options):
        super().__init__(*options)
        self.process = subprocess.Popen([PROGRAM, str(self.simulator.port)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)

    def close(self):
        self.process.stdin.close()
        self.process.stdout.close()
        assert self.process.wait() == 0
        super().close()

    def tell(self, *words):
        print(*words, file=self.process.stdin)

    def clear(self):
        super().clear()
        self.tell("clear")

    def scan(self):
        self.tell("cycle", self.now)
        self.process.stdin.flush()
        for block in self.blocks:
            block.members = values(self.process.stdout.readline().split())
        self.pass_time(self.scan_us)


class RecipeBlock(Block):
    """An execution is one call. Missing outputs are 0."""

    def __init__(self, program, kind):
        super().__init__(program, kind)
        self.inputs, self.outputs, self.runs = {}, {}, False

    def put(self, name, value):
        self.inputs[name] = value

    def call(self, recipes):
        if not self.inputs.get("ENABLE"):
            self.outputs = {}
        elif not self.runs:
            data = self.inputs.get("DATA", b"")
            self.outputs = recipes.run(self.kind, **{**self.inputs, "DATA": data[:self.inputs.get("DATALENGTH", 0)]})
            if self.kind == "SDO_READ":
                found = bytes(self.outputs.pop("DATA", b""))
                self.inputs["DATA"] = found + data[len(found):]
        self.runs = self.inputs.get("ENABLE")

    def __getitem__(self, name):
        if name == "ERRORINFO" and "EMCY" in self.kind:
            code = self["EMCY_ERROR_CODE"]
            return bytes([code & 255, code >> 8, self["ERROR_REGISTER"], *(self[f"ERROR_FIELD[{i}]"] for i in range(1, 6))])
        return self.outputs.get(name, self.inputs.get("DATA", bytes(4)) if name == "DATA" else 0)


class RecipeProgram(OtherProgram):
    kind_of_block = RecipeBlock

    def __init__(self, *options):
        super().__init__(*options)
        self.recipes = Recipes(self)

    def scan(self):
        for block in self.blocks:
            block.call(self.recipes)
        self.pass_time(self.scan_us)


PROGRAMS = {"st": StProgram, "recipes": RecipeProgram}


def microseconds(text):
    return round(float(text) * 1000)


class Run:
    """One row of a scenario; a step begins with a block's name, or with a word that is a method."""

    def __init__(self, case, plant):
        self.case, self.plant, self.blocks, self.order = case, plant, {}, []
        self.mark = 0
        self.mark = len(self.new_frames())

    def step(self, line):
        subject, arrow, outputs = line.partition(" -> ")
        first, *rest = subject.split()
        name, nameless = first.rstrip(":"), first in OUTPUTS
        if nameless or rest and rest[0] in OUTPUTS:
            self.blocks[name] = self.plant.new(name if nameless else rest.pop(0))
        if nameless or first.endswith(":"):
            self.blocks[name].set(values(rest))
        elif rest[:1] == ["is"]:
            self.check(self.blocks[name], rest[1:])
        elif not arrow:
            getattr(self, "step_" + name)(*rest)
        if arrow:
            self.run_to_end(self.blocks[name], outputs)
        if nameless:
            self.off(self.blocks[name])

    def enable(self, block, value):
        block.begun, block.ended_at, block.enabled, block.told = self.plant.now, None, value, False
        block.put("ENABLE", value)

    def scan(self, count=1):
        for _ in range(count):
            self.plant.scan()
            for name, block in self.blocks.items():
                if block.enabled and block.ended_at is None and (block["CONFIRM"] or block["ERROR"]):
                    block.ended_at = self.plant.now - self.plant.scan_us
                    self.order.append(name)

    def scan_until(self, condition):
        for _ in range(100000):
            if condition():
                return
            self.scan()
        raise AssertionError("this does not happen")

    def run_to_end(self, block, outputs):
        if block.told:
            self.off(block)
        if not block.enabled:
            self.enable(block, True)
        self.scan_until(lambda: block.ended_at is not None)
        block.told = True
        outputs, _, time = outputs.partition(" in ")
        least, _, most = time.partition("..")
        taken = block.ended_at - block.begun
        self.case.assertTrue(not time or microseconds(least) <= taken <= microseconds(most or least), f"after {taken} us")
        self.check(block, outputs.split())

    def check(self, block, words):
        expected = {"CONFIRM": 0, "ERROR": 0, **values(words)}
        found = {name: block[name] for name in expected}
        if "DATA" in expected:  # the bytes after the object are unchanged
            expected["DATA"], found["DATA"] = (data + block.given[len(data):] for data in (expected["DATA"], bytes(found["DATA"])))
        self.case.assertEqual(found, expected)

    def off(self, *blocks):
        for block in blocks:
            self.enable(block, False)
        self.scan()
        for block in blocks:
            found = {name: block[name] for name in ("CONFIRM", "ERROR", *OUTPUTS[block.kind])}
            self.case.assertEqual([name for name, value in found.items() if value not in (0, bytes(4), bytes(8))], [])

    def new_frames(self, begin=""):
        self.plant.pass_time(0)
        return [frame[len(begin):] for frame in self.plant.frames()[self.mark:] if frame.startswith(begin)]

    def step_on(self, *names):
        for name in names:
            self.enable(self.blocks[name], True)
        self.scan()

    def step_off(self, *names):
        self.off(*(self.blocks[name] for name in names))

    def step_cycles(self, count):
        self.scan(int(count))

    def step_cycle_time(self, ms):
        self.plant.scan_us = microseconds(ms)

    def step_pass(self, ms):
        self.plant.pass_time(microseconds(ms))

    def step_behind(self, ms):
        """The program's clock falls behind by this time."""
        self.step_pass(ms)
        self.plant.now -= microseconds(ms)

    def step_say(self, *words):
        """A line of docs/reference/commands.md."""
        self.plant.command(" ".join(words))

    def step_until(self, begin):
        self.scan_until(lambda: self.new_frames(begin))

    def step_frames(self, begin, *expected):
        found = self.new_frames(begin[:-1])
        if expected[-1:] == ("...",):
            expected = expected[:-1]
            found = found[:len(expected)]
        self.case.assertEqual(found, list(expected))

    def step_order(self, *names):
        """The order in which the executions ended."""
        self.case.assertEqual(self.order, list(names))

    def step_write(self, *words):
        """INDEX SIZE NUMBER: a local object, by another program"""
        index, size, value = map(number, words)
        self.case.assertEqual(self.plant.transaction(5066, 0, index, 0, size, value), 0)

    def step_module_restarts_in(self, ms):
        self.plant.module_restarts_at = self.plant.now + microseconds(ms)

    def step_module(self, index, expected):
        self.plant.transaction(5055, 0, number(index), 0, 2)
        self.case.assertEqual(self.plant.window.read(3706, 1), [number(expected)])

    def step_untouched(self):
        self.case.assertEqual(self.plant.window.read(3700, 70), [0] * 70)

    def step_turns(self, cycles, least, *names):
        """Blocks that restart as soon as they have ended get the same number of executions, more than `least`."""
        done = dict.fromkeys(names, 0)
        for _ in range(int(cycles)):
            for name in names:
                ended = self.blocks[name].ended_at is not None
                done[name] += ended
                self.enable(self.blocks[name], not ended)
            self.scan()
        self.case.assertGreater(min(done.values()), int(least))
        self.case.assertLessEqual(max(done.values()) - min(done.values()), 1, done)


def every(cells):
    """A row `1..9` of one cell is nine rows."""
    numbers = re.fullmatch(r"(\d+)\.\.(\d+)", cells[0]) if len(cells) == 1 else None
    return [[str(n)] for n in range(int(numbers[1]), int(numbers[2]) + 1)] if numbers else [cells]


def scenarios(text):
    """{heading: (steps, rows)}, a row is {name: cell}"""
    found, tables = {}, {}
    for chapter in re.split(r"\n(?=\w)", text)[1:]:
        heading, *lines = [line.strip() for line in chapter.splitlines() if line.strip()[:1] not in ("", "#")]
        table = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines if line.startswith("|")]
        rows = [dict(zip(table[0], cells)) for row in table[1:] for cells in every(row)]
        steps = [step for line in lines if not line.startswith("|") for step in line.split("; ")]
        if not steps and not rows:
            if PROGRAM == "recipes" or PROGRAM == "st" and "C++" in heading:
                break
        elif not steps:
            tables[heading] = rows
        elif steps[0].startswith("for "):
            found[heading] = steps[1:], tables["table" + steps[0][3:]]
        else:
            found[heading] = steps, rows or [{}]
    return found


class Scenarios(cases.Case):
    def carry_out(self, steps, rows):
        options = steps[0].replace("GENERIC", GENERIC).split()[1:] if steps[0].startswith("plant ") else []
        plant = PROGRAMS.get(PROGRAM, CppProgram)("--node", f"5={GENERIC}", *options)
        plant.mistakes = "timeout", "size", "unit"  # are what some of the scenarios are about
        self.addCleanup(plant.close)
        plant.pass_time(100000)  # boot-up messages
        for row in rows:
            run, step = Run(self, plant), ""
            try:
                for step in steps[bool(options):]:
                    for name, cell in row.items():
                        step = step.replace(f"{{{name}}}", cell)
                    run.step(step)
            except Exception as error:
                raise AssertionError(f"{step}    {row}") from error
            run.off(*run.blocks.values())
            plant.clear()


for heading, (steps, rows) in scenarios((ROOT / "tests/cia405/scenarios.txt").read_text()).items():
    setattr(Scenarios, "test_" + heading, lambda self, steps=steps, rows=rows: self.carry_out(steps, rows))

cases.main()
