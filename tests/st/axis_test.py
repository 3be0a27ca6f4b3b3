#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""The motion blocks of tools/st/axis.st by the table of axis_scenarios.txt, and the conversions.

usage: axis_test.py SIMULATOR [IEC2C]      interpreted here, or translated by MATIEC's iec2c
"""

import pathlib
import re
import sys
import tempfile

from axis_bench import BITS, BLOCKS, HERE, MODULE, PAGE, STATES, AxisPlc, Compiled, Interpreted, drive_eds
import cases
from simulator import program_from_arguments

PROGRAM = program_from_arguments()
IEC2C = sys.argv.pop(1) if len(sys.argv) > 1 else None
EXCHANGES = (("write read", 1), ("read write", 9))[: 1 + cases.LONG]
CONVERSIONS = 0x100
MOST = 1500  # scans until something happens
LONG = {"to": "first", "then": "other", "by": "other", "speed": "speed"}
# Bytes; UDINT; DINT < 0, INT < 0; UINT; bytes of the REAL that is made of them; hundred thousandths of it
NUMBERS = (
    ("00000000", 0, 0, 0, "00000000", 0), ("15CD5B87", 2270940437, 3, 0xCD15, "15CD5B87", 0), ("FFFFFFFF", 0xFFFFFFFF, 3, 0xFFFF, "FFFF7FFF", None),
    ("C3F54840", 0x4048F5C3, 2, 0xF5C3, "C3F54840", 314000), ("000020BE", 0xBE200000, 1, 0, "000020BE", -15625), ("0000803F", 0x3F800000, 0, 0, "0000803F", 100000),
    ("01000000", 1, 0, 1, "01000000", 0), ("00000080", 0x80000000, 1, 0, "00000000", 0), ("0000807F", 0x7F800000, 0, 0, "FFFF7F7F", None),
    ("FFFF7F7F", 0x7F7FFFFF, 2, 0xFFFF, "FFFF7F7F", None), ("000080FF", 0xFF800000, 1, 0, "FFFF7FFF", None), ("FFFF7F00", 0x007FFFFF, 2, 0xFFFF, "FFFF7F00", 0))


def chapters(text):
    found = {}
    for chapter in re.split(r"\n(?=\w)", text)[1:]:
        heading, *lines = [line.strip() for line in chapter.splitlines() if line.strip() and not line.startswith("#")]
        each = re.fullmatch(r"each (\d+)\.\.(\d+)", lines[0])
        times = range(int(each[1]), int(each[2]) + 1) if each else [0]
        found[heading] = times, [step for line in lines[bool(each):] for step in line.split("; ")]
    return found


class Run:
    def __init__(self, case, plc):
        self.case, self.plc, self.begun = case, plc, 0

    def play(self, step):
        first, *rest = step.split()
        if first[0] in "+-":
            self.enable(first[1:], first[0] == "+", rest)
        elif rest[:1] == ["->"]:
            self.until(lambda: self.shows(first, rest[1:]))
        elif rest[:1] == ["is"]:
            self.case.assertTrue(self.shows(first, rest[1:]), self.outputs(first))
        else:
            getattr(self, "step_" + first)(*rest)

    def enable(self, block, on, inputs):
        for name, _, value in (word.partition("=") for word in inputs):
            self.plc.set(homing=int(value)) if name == "homing" else self.plc.set_long(LONG[name], int(value))
        bit = BLOCKS[block]
        self.plc.enabled = self.plc.enabled | bit if on else self.plc.enabled & ~bit
        self.scan()

    def outputs(self, block):
        bits = self.plc[f"{block}_bits"]
        return {text for bit, text in BITS.items() if bits & bit}, self.plc[f"{block}_id"]

    def shows(self, block, words):
        """In velocity the block is Busy, too."""
        names, code = words[0].split("+"), int(words[1], 16) if len(words) > 1 else 0
        wanted = {"nothing": set(), "InVelocity": {"Done", "Busy"}}.get(words[0], set(names))
        return self.outputs(block) == (wanted, code)

    def scan(self):
        self.plc.scan()
        for block in BLOCKS:
            outputs, code = self.outputs(block)
            self.case.assertTrue(len(outputs) <= 1 or block in ("run", "report") and outputs - {"Error"} in ({"Done", "Busy"}, {"Busy"}), (block, outputs))
            self.case.assertEqual(code != 0, "Error" in outputs, (block, code))
        valid = self.plc["report_bits"] & 1
        self.case.assertEqual(self.plc["shown"], valid << self.plc["state"])  # in the order of STATES

    def until(self, condition):
        """Scans until it holds."""
        for _ in range(MOST):
            if condition():
                return
            self.scan()
        raise AssertionError({block: self.outputs(block) for block in BLOCKS} | {"state": STATES[self.plc["state"]]})

    def object(self, index):
        return int(self.plc.command(f"get 16 {index}"))

    def step_state(self, name):
        self.until(lambda: STATES[self.plc["state"]] == name)

    def step_in(self, name):
        self.case.assertEqual(STATES[self.plc["state"]], name)

    def step_scans(self, count):
        for _ in range(int(count)):
            self.scan()

    def step_object(self, index, _, value):
        self.case.assertEqual(self.object(index), int(value))

    def step_control(self, word):
        self.case.assertEqual(self.plc["control"], int(word, 16))

    def step_reaches(self, word):
        self.until(lambda: self.plc["control"] == int(word, 16))

    def step_say(self, *words):
        self.plc.command(" ".join(words))

    def step_frames(self, begin, count):
        self.case.assertEqual(sum(frame.startswith(begin) for frame in self.plc.frames()), int(count))

    def step_stays(self, index):
        """After the ramp of a stop."""
        self.step_scans(10)
        before = self.object(index)
        self.step_scans(10)
        self.case.assertEqual(self.object(index), before)

    def step_abort(self, code):
        self.case.assertEqual(self.plc.long("abort_low", "abort_high"), int(code, 16))

    def step_drive(self, status, mode, position=None):
        """INS of another drive, from now on."""
        self.plc.forced = {"status": int(status, 16), "mode": int(mode)}
        if position:
            self.plc.forced.update(position0=int(position), position1=int(position) >> 16)

    def step_target(self, position):
        self.case.assertEqual(self.plc.long("target0", "target1"), int(position) & 0xFFFFFFFF)

    def step_offline(self, value):
        self.plc.set(offline=int(value))

    def step_restart_module(self):
        self.plc.restart_module()

    def step_configure_module(self):
        self.plc.configure(MODULE)


class Axis(cases.Case):
    @classmethod
    def setUpClass(cls):
        cls.folder, cls.programs = pathlib.Path(cls.enterClassContext(tempfile.TemporaryDirectory())), {}
        cls.eds = drive_eds(cls.folder)

    def engine(self, name):
        if not IEC2C:
            return Interpreted(name)
        if name not in self.programs:
            self.programs[name] = Compiled.compile(IEC2C, self.folder, name)
        return Compiled(self.programs[name])

    def plc(self, order, every, program="axis_program", network=None):
        plc = AxisPlc(PROGRAM, self.engine(program), order, every, self.eds, network)
        self.addCleanup(plc.close)
        return plc

    def carry_out(self, times, steps):
        for order, every in EXCHANGES:
            run = Run(self, self.plc(order, every))
            for time in times:
                for step in steps:
                    try:
                        run.play(step.replace("EACH", str(time)))
                    except Exception as error:
                        raise AssertionError(f"{step}    {order} {every} {time}") from error

    def test_the_example(self):
        network = self.eds.with_name("network.toml")
        network.write_text(re.search(r"```toml\n(.*?)```", PAGE.read_text(), re.DOTALL)[1])
        for file in (network, None):
            plc = self.plc("read write", 1, "axis_example", file)
            for _ in range(400):
                plc.scan()
            self.assertEqual(plc.command("get 16 0x6064"), "8000")
            self.assertEqual([frame for frame in plc.frames() if re.match("610#(2F98|2381)", frame)], ["610#2F98600023000000", "610#23816000204E0000"])
            plc.close()

    def test_conversions(self):
        plc = self.plc("read write", 1)
        plc.enabled = CONVERSIONS
        for text, unsigned, signs, word, real, rounded in NUMBERS:
            with self.subTest(text):
                data = bytes.fromhex(text)
                plc.set(b12=data[0] | data[1] << 8, b34=data[2] | data[3] << 8)
                plc.scan()
                found = [plc.long("u12", "u34"), plc.long("d12", "d34"), plc["signs"], plc["word12"], plc.long("r12", "r34").to_bytes(4, "little").hex().upper()]
                self.assertEqual(found, [unsigned, unsigned, signs, word, real])
                if rounded is not None:
                    self.assertEqual(plc.long("rounded12", "rounded34"), rounded & 0xFFFFFFFF)


for heading, (times, steps) in chapters((HERE / "axis_scenarios.txt").read_text()).items():
    setattr(Axis, "test_" + re.sub(r"\W+", "_", heading), lambda self, times=times, steps=steps: self.carry_out(times, steps))

cases.main()
