# SPDX-License-Identifier: MIT
"""What a PLC does around a program: it exchanges the located words with the module's registers over Modbus, and lets the plant's time pass."""

from __future__ import annotations

import re
from typing import Iterable, NamedTuple

from cbcan_plant import Plant, PlantError, Window

# By area: the first word's number, how many, the register of the first. docs/how-to/plc/openplc.md and schneider.md have them.
AREAS = {"I": ((100, 68, 600), (168, 64, 3800), (232, 44, 3928)), "Q": ((100, 70, 500), (170, 64, 3864)), "M": ((0, 65536, 0),)}
OUT = range(500, 570)  # the scanner window
MOST = 120  # words in a request
SCANS_OF_THE_WINDOW = 2  # openplc.st copies a request before the program writes it: what the last scan wants is sent in the next ones


class Address(NamedTuple):
    """%QX170.3 and the like: bits of a register, or two registers, the low word first."""

    area: str
    size: str  # X, W or D
    register: int
    bit: int

    @property
    def registers(self) -> range:
        return range(self.register, self.register + 1 + (self.size == "D"))

    @classmethod
    def of(cls, text: str) -> Address:
        found = re.fullmatch(r"%([IQM])([XWD])(\d+)(?:\.(\d+))?", text)
        first, words = int(found[3]) if found else -1, 1 + (found is not None and found[2] == "D")
        bit = int(found[4] or 0) if found else 16
        for start, count, register in AREAS[found[1]] if found else ():
            if start <= first <= start + count - words and bit < 16:
                return cls(found[1], found[2], first - start + register, bit)
        raise ValueError(f"{text}: exchanged are {', '.join(f'%{area}W{start} to {start + count - 1}' for area in AREAS for start, count, _ in AREAS[area])}")


def has_scanner(addresses: Iterable[Address]) -> bool:
    return any(at.register in OUT for at in addresses)


class Image(dict):
    """Words by register, between program and module: 0 at first."""

    def __missing__(self, register: int) -> int:
        return 0

    def read(self, at: Address) -> int:
        bits = self[at.register] | (self[at.register + 1] << 16 if at.size == "D" else 0)
        return bits >> at.bit & 1 if at.size == "X" else bits

    def write(self, at: Address, bits: int) -> None:
        if at.size == "X":
            bits = self.read(at._replace(size="W")) & ~(1 << at.bit) | bits << at.bit
        self.update((register, bits >> 16 * i & 0xFFFF) for i, register in enumerate(at.registers))


def blocks(registers) -> list[range]:
    """Consecutive registers, as many as fit in a request; the highest first, so that R3700 is written last."""
    found: list[range] = []
    for register in sorted(registers):
        if found and found[-1].stop == register and len(found[-1]) < MOST:
            found[-1] = range(found[-1].start, register + 1)
        else:
            found.append(range(register, register + 1))
    return found[::-1]


class Exchange:
    """The scans of an engine, at a plant. The engine has `interval` in microseconds, `addresses`, an `image`, scan(now), and ended(name): whether a
    program's BOOL of this name is TRUE."""

    def __init__(self, plant: Plant, engine) -> None:
        self.plant, self.engine, self.window, self.end = plant, engine, None, None
        self.inputs, self.outputs, self.memory = (blocks({r for at in engine.addresses if at.area in areas for r in at.registers}) for areas in ("IM", "Q", "M"))
        self.now = round(plant.now * 1e6)

    def scan(self) -> str | None:
        """One scan, and time up to the next one. Returns DONE or GAVE_UP after the last scan, when no time has passed."""
        image = self.engine.image
        self.request(self.read)
        before = Image(image)
        self.engine.scan(self.now)
        changed = [[register for register in block if image[register] != before[register]] for block in self.memory]
        self.request(self.write, [*self.outputs, *(range(some[0], some[-1] + 1) for some in changed if some)])
        if self.end:
            self.left -= 1
        else:
            self.end = next((name for name in ("GAVE_UP", "DONE") if self.engine.ended(name)), None)
            self.left = SCANS_OF_THE_WINDOW if has_scanner(self.engine.addresses) else 0
        if self.end and self.left == 0:
            return self.end
        self.now = round(float(self.plant.command(f"pass {self.engine.interval}us")[0]) * 1e6)
        return None

    def request(self, requests, *arguments) -> None:
        """After a failure the image is as before; a closed connection is opened again in the next scan."""
        try:
            self.window = self.window or Window(self.plant)
            requests(*arguments)
        except OSError:
            self.close()
        except PlantError:
            pass

    def close(self) -> None:
        if self.window:
            self.window.socket.close()
        self.window = None

    def read(self) -> None:
        for block in self.inputs:
            self.engine.image.update(zip(block, self.window.read(block.start, len(block))))

    def write(self, written) -> None:
        for block in written:
            self.window.write(block.start, *(self.engine.image[register] for register in block))
