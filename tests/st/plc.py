# SPDX-License-Identifier: MIT
"""A PLC that runs the function blocks of tools/st against cbcan-sim, on a clock that stands still but for the scans."""

import pathlib
import socket
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests/support"))
from simulator import LIMIT, Simulator
from st_machine import Machine

LIBRARY = ROOT / "tools/st"
FIRST, COUNT = 3700, 70


def source(*names):
    """[(name, text)] of files in tools/st."""
    return [(name, (LIBRARY / name).read_text()) for name in names]


def configuration(program):
    """That of tools/st, with another program."""
    (name, text), = source("configuration.st")
    return name, text.replace("state_of_node_5", program)


class Plant:
    """cbcan-sim with time that stands still but for the scans of a program."""

    def __init__(self, program, *options, scan_us=1000):
        self.simulator = Simulator(program, "--clock", "manual", *options, stdin=subprocess.PIPE)
        self.window = self.simulator.window()
        self.log, self.heard = self.simulator.log_path.open(), []
        self.scan_us, self.now = scan_us, 0  # the program's time

    def close(self):
        self.log.close()
        self.window.socket.close()
        self.simulator.stop()

    def command(self, line):
        """docs/control.md; the response's value"""
        self.simulator.process.stdin.write(line + "\n")
        self.simulator.process.stdin.flush()
        response = self.simulator.process.stdout.readline().rstrip("\n")
        while not response.startswith(("ok", "error", "at ")):
            response = self.simulator.process.stdout.readline().rstrip("\n")
        assert not response.startswith("error"), f"{line}: {response}"
        return response[3:]

    def pass_time(self, microseconds):
        self.command(f"pass {microseconds}us")
        self.now += microseconds

    def frames(self):
        """All until now, as `605#4017100000000000`."""
        self.heard += [line.split()[2] for line in self.log]
        return self.heard

    def transaction(self, *words):
        """One of the test's own."""
        return self.window.execute(*words)

    def send(self, frame):
        """Puts "0A0#1122" on the bus, by an adapter at the place that --slcan names."""
        host, port = self.simulator.where["slcan"].rsplit(":", 1)
        identifier, data = frame.split("#")
        with socket.create_connection((host, int(port)), timeout=LIMIT) as adapter:
            adapter.sendall(f"O\rt{identifier}{len(data) // 2}{data}\r".encode())
            assert [adapter.recv(1) for _ in range(3)] == [b"\r", b"z", b"\r"]
        self.pass_time(1000)


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
    """Between two scans all registers are exchanged and some time passes."""

    def __init__(self, program, *options, files=("cia405.st", "example.st"), main="state_of_node_5"):
        super().__init__(program, *options)
        self.machine = Machine(*source(*files), configuration(main))
        self.called, self.runs_program = [], False

    @property
    def registers(self):
        return self.machine.globals["REGS"]

    def block(self, name, **inputs):
        """Called in every scan from now on, behind those that are there."""
        self.called.append(Instance(self.machine.blocks[name]).set(**inputs))
        return self.called[-1]

    def scan(self, count=1):
        for _ in range(count):
            self.registers[:] = self.window.read(FIRST, COUNT)
            before = list(self.registers)
            for block in self.called:
                block.block.run(block.values, self.now)
            if self.runs_program:
                self.machine.scan(self.now)
            self.write_back(before)
            self.pass_time(self.scan_us)

    def write_back(self, before):
        """What has changed, in one request."""
        changed = [i for i in range(COUNT) if self.registers[i] != before[i]]
        if changed:
            self.window.write(FIRST + changed[0], self.registers[changed[0]:changed[-1] + 1])

    def run(self, block, most=10000):
        """Until the block is done; returns how many scans it took."""
        for count in range(1, most + 1):
            self.scan()
            if block.ended():
                return count
        raise AssertionError(f"{block.block.name}: neither CONFIRM nor ERROR after {most} scans")
