# SPDX-License-Identifier: MIT
"""A PLC that runs the function blocks of tools/st with cbcan-sim, with a clock that advances only in scans."""

import subprocess

from simulator import Simulator
from cbcan_st.machine import Machine
from tree import ROOT

LIBRARY = ROOT / "tools/st"
FIRST, COUNT = 3700, 70


def source(*names):
    """[(name, text)] of files in tools/st."""
    return [(name, (LIBRARY / name).read_text()) for name in names]


def configuration(program):
    """The configuration of tools/st with a different program."""
    (name, text), = source("configuration.st")
    return name, text.replace("state_of_node_5", program).replace("    PROGRAM exchange WITH cyclic : cbcan_exchange;\n", "")


class Plant:
    """cbcan-sim, whose time advances only in the scans of a program. It has no advice for the program, except on mistakes of these kinds."""

    mistakes = ()

    def __init__(self, program, *options, scan_us=1000):
        self.simulator = Simulator(program, "--clock", "manual", *options, stdin=subprocess.PIPE)
        self.window = self.simulator.window()
        self.log, self.heard = self.simulator.log_path.open(), []
        self.scan_us, self.now = scan_us, 0  # the program's time
        self.module_restarts_at = None

    def close(self):
        self.log.close()
        self.window.socket.close()
        advice = [] if self.simulator.process.poll() is not None else self.simulator.say("advice end").splitlines()[:-1]
        self.simulator.stop()
        assert [line for line in advice if line.split()[0] not in self.mistakes] == []

    def command(self, line):
        """Executes a command of docs/reference/commands.md; returns the response's value."""
        *_, response = self.simulator.say(line).splitlines()
        assert not response.startswith("error"), f"{line}: {response}"
        return response[3:]

    def pass_time(self, microseconds):
        self.command(f"pass {microseconds}us")
        self.now += microseconds
        if self.module_restarts_at and self.now >= self.module_restarts_at:
            self.module_restarts_at = None
            self.module_restarts()

    def module_restarts(self):
        """A restart as a PLC sees it through a gateway: the connection stays, R3700..R3769 and 3003h are as after a start."""
        self.window.write(FIRST, [0])
        self.transaction(5066, 0, 0x3003, 0, 2, 1000)
        self.window.write(FIRST, [0] * COUNT)

    def frames(self):
        """All frames so far, as `605#4017100000000000`."""
        self.heard += [line.split()[2] for line in self.log]
        return self.heard

    def transaction(self, *words):
        """A program of the test's own."""
        return self.window.execute(*words)


class Instance:
    """A function block that a program would call: instance["CONFIRM"] is one of its outputs."""

    def __init__(self, block):
        self.block, self.values, self.memory = block, block.instance(), {}
        for name in block.names("VAR_IN_OUT"):
            self.memory[name] = block.types[name].first()
            self.values[name] = (self.memory, name)

    def set(self, **inputs):
        for name, value in inputs.items():
            assert self.block.sections[name] in ("VAR_INPUT", "VAR_IN_OUT"), name
            where = self.memory if name in self.memory else self.values
            where[name] = value
        return self

    def __getitem__(self, name):
        return self.memory[name] if name in self.memory else self.values[name]

    def ended(self):
        return self["CONFIRM"] or self["ERROR"] != 0


class Plc(Plant):
    """Exchanges all registers and lets some time pass between two scans."""

    def __init__(self, program, *options, files=("cia405.st", "example.st"), main="state_of_node_5"):
        super().__init__(program, *options)
        self.machine = Machine(*source(*files), configuration(main))
        self.called, self.runs_program = [], False
        self.windows = [self.window, *([self.simulator.window(2)] if "--network" in options else [])]

    def close(self):
        self.windows[-1].socket.close()
        super().close()

    @property
    def registers(self):
        return self.machine.globals["CBCAN"][0]["REGS"]

    def block(self, name, **inputs):
        """Adds a block, called in every scan from now on, after the others."""
        self.called.append(Instance(self.machine.blocks[name]).set(**inputs))
        return self.called[-1]

    def scan(self, count=1):
        for _ in range(count):
            images = [(window, network["REGS"]) for window, network in zip(self.windows, self.machine.globals["CBCAN"])]
            for window, registers in images:
                registers[:] = window.read(FIRST, COUNT)
            before = [list(registers) for _, registers in images]
            for block in self.called:
                block.block.run(block.values, self.now)
            if self.runs_program:
                self.machine.scan(self.now)
            for (window, registers), old in zip(images, before):
                self.write_back(window, registers, old)
            self.pass_time(self.scan_us)

    def write_back(self, window, registers, before):
        """Writes the changed registers in one request."""
        changed = [i for i in range(COUNT) if registers[i] != before[i]]
        if changed:
            window.write(FIRST + changed[0], registers[changed[0]:changed[-1] + 1])

    def run(self, block, most=10000):
        """Scans until the block is done; returns the number of scans."""
        for count in range(1, most + 1):
            self.scan()
            if block.ended():
                return count
        raise AssertionError(f"{block.block.name}: neither CONFIRM nor ERROR after {most} scans")
