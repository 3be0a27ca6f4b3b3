# SPDX-License-Identifier: MIT
"""The engine that needs no compiler: the machine of tools/st."""

from __future__ import annotations

import re
import struct
from typing import Any

from .exchange import Address, Image, has_scanner
from .machine import Machine
from .machine.lexer import StError
from .machine.types import REAL, WORD, Block
from .sources import Sources


def value_of(bits, a_type):
    if a_type is REAL:
        return struct.unpack("<f", struct.pack("<I", bits))[0]
    if a_type.kind == "bool":
        return bool(bits)
    return bits if bits <= a_type.high else bits - 2 * (a_type.high + 1)


def bits_of(value, a_type):
    return struct.unpack("<I", struct.pack("<f", value))[0] if a_type is REAL else int(value) & 0xFFFFFFFF


class Interpreted(Machine):
    def __init__(self, sources: Sources) -> None:
        super().__init__(*sources.texts)
        if not self.programs:
            raise StError(sources.texts[-1][0], "a CONFIGURATION with a TASK and a PROGRAM is missing; tools/st/configuration.st is one")
        self.image, self.forced = Image(), {}
        self.located = {}  # by program: (address, type, variables, name)
        for instance, (block, values) in self.programs.items():
            self.located[instance] = [(sources.address(at), block.types[name], values, name) for at, name in block.located.items()]
        self.stored = {instance: [each for each in located if each[0].area != "I"] for instance, located in self.located.items()}
        self.addresses = [at for each in self.located.values() for at, _, _, _ in each]
        has_window = getattr(self.global_types.get("CBCAN"), "name", "") == "CBCAN_WINDOWS" and not has_scanner(self.addresses)
        registers = self.globals["CBCAN"][0]["REGS"] if has_window else []
        self.window = [(Address.of(f"%MW{3700 + i}"), WORD, registers, i) for i in range(len(registers))]
        self.addresses += [at for at, _, _, _ in self.window]

    def load(self, located):
        for at, a_type, values, name in located:
            values[name] = self.image[at.register] if a_type is WORD else value_of(self.image.read(at), a_type)

    def store(self, located):
        for at, a_type, values, name in located:
            if a_type is WORD:
                self.image[at.register] = values[name]
            else:
                self.image.write(at, bits_of(values[name], a_type))

    def scan(self, now: int) -> None:
        self.load(self.window)
        for instance in self.due():
            block, values = self.programs[instance]
            self.load(self.located[instance])
            self.force()
            block.run(values, now)
            self.force()
            self.store(self.stored[instance])
        self.store(self.window)

    def ended(self, name: str) -> bool:
        return any(values.get(name) is True for _, values in self.programs.values())

    # ---- Variables by name, for tests

    def variable(self, path: str) -> tuple[Any, Any, Any]:
        """(container, key, type) of main.drive.ins[0]; `main`, the program's instance, may be missing."""
        first, *rest = re.findall(r"\w+", path.upper())
        programs = {name: (values, block.types) for name, (block, values) in self.programs.items()}
        try:
            if first in programs:
                container, types = programs[first]
                key, *rest = rest
            else:
                container, types = next(place for place in [*programs.values(), (self.globals, self.global_types)] if first in place[0])
                key = first
            a_type = types[key]
            for word in rest:
                container = container[key]
                if isinstance(a_type, Block):
                    key, a_type = word, a_type.types[word]
                elif a_type.kind == "array":
                    key, a_type = range(a_type.low, a_type.high + 1).index(int(word)), a_type.of
                else:
                    key, a_type = word, a_type.of[word][0]
            container[key]
        except (LookupError, ValueError, TypeError, StopIteration):
            raise LookupError(f"{path}: no such variable; write main.drive.ins[0], with the program's name in the configuration") from None
        return container, key, a_type

    def get(self, path: str) -> Any:
        container, key, a_type = self.variable(path)
        return container[key] / 1e6 if a_type.kind == "time" else container[key]

    def set(self, path: str, value: Any) -> None:
        container, key, a_type = self.variable(path)
        if a_type.kind == "time":
            value = round(value * 1e6)
        fits = {"bool": isinstance(value, bool), "real": isinstance(value, (int, float)), "enum": value in (a_type.of or ()),
                "time": True}.get(a_type.kind, type(value) is int and a_type.takes(value))
        if not fits:
            raise ValueError(f"{path}: {value!r} is not a {a_type.name}")
        container[key] = value

    def force(self) -> None:
        for path, value in self.forced.items():
            self.set(path, value)
