# SPDX-License-Identifier: MIT
"""What a PLC does around a program: it exchanges the located words with the module's registers over Modbus, and lets the plant's time pass."""

from __future__ import annotations

import re
import struct
from typing import Callable, Iterable, NamedTuple

from cbcan_plant import Plant, PlantError

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
    program's BOOL of this name is TRUE. `alone`: no other client acts between scans, so the inputs of the next one are read with the outputs written."""

    def __init__(self, plant: Plant, engine, alone: bool = False) -> None:
        self.plant, self.engine, self.alone, self.end = plant, engine, alone, None
        inputs, self.outputs, self.memory = (blocks({r for at in engine.addresses if at.area in areas for r in at.registers}) for areas in ("IM", "Q", "M"))
        self.inputs = [self.read(block) for block in inputs]
        self.now = round(plant.now * 1e6)
        self.exchange(self.inputs if alone else [])

    def scan(self) -> str | None:
        """One scan, and time up to the next one. Returns DONE or GAVE_UP after the last scan, when no time has passed."""
        image = self.engine.image
        if not self.alone:
            self.exchange(self.inputs)
        before = Image(image)
        self.engine.scan(self.now)
        changed = [[register for register in block if image[register] != before[register]] for block in self.memory]
        written = [self.write(block) for block in [*self.outputs, *(range(some[0], some[-1] + 1) for some in changed if some)]]
        if self.end:
            self.left -= 1
        else:
            self.end = next((name for name in ("GAVE_UP", "DONE") if self.engine.ended(name)), None)
            self.left = SCANS_OF_THE_WINDOW if has_scanner(self.engine.addresses) else 0
        if self.end and self.left == 0:
            self.exchange(written)
            return self.end
        self.exchange(written, [(f"pass {self.engine.interval}us", self.take_time)], self.inputs if self.alone else [])
        return None

    def exchange(self, *parts: list[tuple[str, Callable[[str], object]]]) -> None:
        """The requests of a part need a response to the one before, and end with one that fails: the image is as before. Others are sent together."""
        sent: list = []
        for part in parts:
            for request in part:
                if request is not part[0] and not self.finish(sent):
                    break
                sent.append(request)
        self.finish(sent)

    def finish(self, sent: list) -> bool:
        """Whether the last one has succeeded."""
        good = True
        self.plant.send(*(line for line, _ in sent))
        for line, take in sent:
            try:
                take(self.plant.response(line)[0])
                good = True
            except PlantError:
                if not line.startswith("modbus "):
                    raise
                good = False
        sent.clear()
        return good

    def take_time(self, seconds: str) -> None:
        self.now = round(float(seconds) * 1e6)

    def read(self, block: range) -> tuple[str, Callable[[str], object]]:
        return f"modbus 03{block.start:04X}{len(block):04X}", lambda pdu: self.engine.image.update(zip(block, words_of(pdu, 2)))

    def write(self, block: range) -> tuple[str, Callable[[str], object]]:
        words = "".join(f"{self.engine.image[register]:04X}" for register in block)
        return f"modbus 10{block.start:04X}{len(block):04X}{2 * len(block):02X}{words}", words_of


def words_of(pdu: str, header: int = 1) -> tuple[int, ...]:
    """Those after the header of a response; PlantError for an exception."""
    raw = bytes.fromhex(pdu)
    if raw[0] & 0x80:
        raise PlantError(f"Modbus exception {raw[1]}")
    return struct.unpack(f">{(len(raw) - header) // 2}H", raw[header:])
