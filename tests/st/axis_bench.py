# SPDX-License-Identifier: MIT
"""A PLC with axis_program.st, interpreted or translated by MATIEC, and the demo plant's drive with one PDO each way."""

import pathlib
import re
import subprocess

from plc import LIBRARY, ROOT, Plant, source
from recipes import items, tables_of
from cbcan_st.machine import Machine

HERE = pathlib.Path(__file__).resolve().parent
DRIVE, MODULE = 16, 127
FILES = ("cia405.st", "conversions.st", "axis.st", "scanner.st", "openplc.st")
BLOCKS = {"power": 0x01, "again": 0x02, "home": 0x04, "first": 0x08, "other": 0x10, "run": 0x20, "halt": 0x40, "further": 0x80, "report": 0x200}
BITS = {1: "Done", 2: "Busy", 4: "CommandAborted", 8: "Error"}
STATES = "Disabled Standstill Homing DiscreteMotion ContinuousMotion Stopping ErrorStop".split()
# (first register, words, address of the first one), read and written by the master
READ, WRITTEN = ((600, 68, "%IW100"), (3800, 4, "%IW168")), ((500, 70, "%QW100"), (3864, 4, "%QW170"))
PAGE = ROOT / "docs/reference/axis-blocks.md"


def pdo_objects(column):
    """[(index, sub-index, size, value)] of a column of the page's table, in the order of docs/how-to/process-data.md."""
    rows = {row[0]: [int(item, 16) for item in items(row[column])] for row in tables_of(PAGE.read_text())["Map the process data"][1]}
    found = []
    for mapping, pdo in (("1600h", "1400h"), ("1A00h", "1800h")):
        entries, (identifier,) = rows[mapping], rows[f"{pdo}:01"]
        first, second = int(pdo[:4], 16), int(mapping[:4], 16)
        found += [(first, 1, 4, identifier | 1 << 31), (second, 0, 1, 0), *((second, i, 4, entry) for i, entry in enumerate(entries, 1)),
                  (second, 0, 1, len(entries)), *((first, 5, 2, ms) for ms in rows.get(f"{pdo}:05", [])), (first, 1, 4, identifier)]
    return found


def drive_eds(folder):
    """That of the demo plant, and 605Ah, which it lacks."""
    text = (ROOT / "plants/demo/drive.eds").read_text()
    count, = re.findall(r"\[OptionalObjects\]\nSupportedObjects=(\d+)\n", text)
    text = text.replace(f"\nSupportedObjects={count}\n", f"\nSupportedObjects={int(count) + 1}\n{int(count) + 1}=0x605A\n")
    (folder / "drive.eds").write_text(f"{text}\n[605A]\nParameterName=Quick stop option code\nDataType=0x0003\nAccessType=rw\nDefaultValue=2\n")
    return folder / "drive.eds"


def texts(name="axis_program"):
    """Of the program in this file, here or in tools/st."""
    path = next(path for path in (HERE / f"{name}.st", LIBRARY / f"{name}.st") if path.exists())
    text = path.read_text()
    (file, configuration), = source("configuration.st")
    return [*source(*FILES), (path.name, text), (file, configuration.replace("state_of_node_5", re.search(r"PROGRAM (\w+)", text)[1]))]


def names():
    """{name of a word of axis_program.st: its address}"""
    return {name: address for name, address in re.findall(r"(\w+) AT (%[IQ]W\d+)", texts()[-2][1])}


class Interpreted:
    def __init__(self, name):
        self.machine = Machine(*texts(name))

    def close(self):
        pass

    def scan(self, now, words):
        for program, values in self.machine.programs.values():
            values.update((name, words.get(address, 0)) for address, name in program.located.items() if address[1] == "I")
        self.machine.scan(now)
        return {address: values[name] for program, values in self.machine.programs.values() for address, name in program.located.items()}


class Compiled:
    """Translated by MATIEC's iec2c, with the library in its folder, and compiled."""

    def __init__(self, program):
        self.process = subprocess.Popen([program], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        words = self.process.stdout.readline().split()
        self.inputs, self.outputs = ([address for address in words if address[1] == area] for area in "IQ")

    @staticmethod
    def compile(iec2c, folder, name):
        """The program of axis_bench.texts(name)."""
        folder = folder / name
        folder.mkdir()
        (folder / "program.st").write_text("".join(text for _, text in texts(name)))
        library = pathlib.Path(iec2c).resolve().parent / "lib"
        subprocess.run([iec2c, "-I", library, "program.st"], cwd=folder, check=True, stdout=subprocess.DEVNULL)
        located = (folder / "LOCATED_VARIABLES.h").read_text().splitlines()
        (folder / "words.h").write_text("\n".join(line for line in located if line.startswith("__LOCATED_VAR")) + "\n")
        subprocess.run(["gcc", "-w", "-I.", f"-I{library}/C", f"-I{library}", "Config0.c", "Res0.c", HERE / "matiec_main.c", "-o", "run", "-lm"],
                       cwd=folder, check=True)
        return folder / "run"

    def close(self):
        self.process.stdin.close()
        self.process.stdout.close()
        self.process.wait()

    def scan(self, now, words):
        print(now, *(words.get(address, 0) for address in self.inputs), file=self.process.stdin, flush=True)
        return dict(zip(self.outputs, map(int, self.process.stdout.readline().split())))


class AxisPlc(Plant):
    """Scans of 10 ms; the master exchanges all words after each `every`-th one."""

    """`network`: a file with which the module configures both; without, this does."""

    def __init__(self, program, engine, order, every, eds, network=None):
        super().__init__(program, "--node", f"{DRIVE}={eds}", *(["--network-file", network] if network else []), scan_us=10000)
        self.engine, self.order, self.every, self.scans = engine, order.split(), every, 0
        self.words, self.address, self.enabled = {}, names(), 0
        self.forced = {}  # INS of a drive that this test invents
        self.pass_time(100000)
        for node in () if network else (DRIVE, MODULE):
            self.configure(node)

    def close(self):
        self.engine.close()
        super().close()

    def configure(self, node):
        for index, sub, size, value in pdo_objects(1 if node == MODULE else 2):
            assert self.transaction(5066, node % MODULE, index, sub, size, value & 0xFFFF, value >> 16) == 0, hex(index)
        assert self.transaction(5066, 0, 0x1F82, node, 1, 5) == 0

    def transaction(self, *words):
        """Not through the window of the blocks: a channel of its own."""
        self.window.write(3700, [0xCA0E, *words])
        self.pass_time(10000)
        return self.window.read(3700, 1)[0]

    def set(self, **words):
        self.words.update((self.address[name], value & 0xFFFF) for name, value in words.items())

    def set_long(self, name, value):
        self.set(**{f"{name}_low": value, f"{name}_high": value >> 16})

    def __getitem__(self, name):
        return self.words.get(self.address[name], 0)

    def long(self, low, high):
        return self[low] | self[high] << 16

    def read(self):
        for first, count, address in READ:
            self.words.update((f"%IW{int(address[3:]) + i}", word) for i, word in enumerate(self.window.read(first, count)))

    def write(self):
        for first, count, address in WRITTEN:
            self.window.write(first, [self.words[f"%QW{int(address[3:]) + i}"] for i in range(count)])

    def scan(self):
        self.set(enables=self.enabled, **self.forced)
        self.words.update(self.engine.scan(self.now, self.words))
        self.scans += 1
        for step in self.order if self.scans % self.every == 0 else ():
            getattr(self, step)()
        self.pass_time(self.scan_us)

    def restart_module(self):
        """Its registers are 0, its PDOs as after power-on."""
        self.command("fault plc module-restart count=1")
        try:
            self.window.read(3700, 1)
            self.window.write(3700, [0])
        except (ConnectionError, OSError):
            pass
        self.window.socket.close()
        self.window = self.simulator.window()
