# SPDX-License-Identifier: MIT
"""Data types, their initial values, and units with variables."""

import copy
import math
import struct
from typing import NamedTuple


class Type(NamedTuple):
    kind: str  # bool, bits, int, real, time, enum, array, struct, pointer, block, or literal: a number that takes the type it meets
    name: str
    low: int = 0    # of a number or an index
    high: int = 0
    of: object = None  # elements of an array or a pointer: a Type; enum: names; struct: {NAME: (Type, first value)}

    def first(self):
        """The default initial value."""
        if self.kind == "array":
            return [self.of.first() for _ in range(self.low, self.high + 1)]
        if self.kind == "struct":
            return {name: copy.deepcopy(value) for name, (_, value) in self.of.items()}
        return {"bool": False, "enum": self.of and self.of[0], "pointer": None, "real": 0.0}.get(self.kind, 0)

    def takes(self, number):
        return self.kind in ("int", "bits") and self.low <= number <= self.high


def number(kind, name, bits):
    return Type(kind, name, 0, 2 ** bits - 1)


def signed(name, bits):
    return Type("int", name, -2 ** (bits - 1), 2 ** (bits - 1) - 1)


def single(value):
    """The nearest REAL; past the largest one it is Inf."""
    try:
        return struct.unpack("<f", struct.pack("<f", value))[0]
    except OverflowError:
        return math.copysign(math.inf, value)


BOOL = Type("bool", "BOOL")
BYTE, WORD, DWORD = number("bits", "BYTE", 8), number("bits", "WORD", 16), number("bits", "DWORD", 32)
USINT, UINT, UDINT = number("int", "USINT", 8), number("int", "UINT", 16), number("int", "UDINT", 32)
SINT, INT, DINT = signed("SINT", 8), signed("INT", 16), signed("DINT", 32)
REAL = Type("real", "REAL")
TIME = Type("time", "TIME", 0, 2 ** 63)
LITERAL = Type("literal", "a number")
ADDRESS = Type("pointer", "an address")
ELEMENTARY = {t.name: t for t in (BOOL, BYTE, WORD, DWORD, USINT, UINT, UDINT, SINT, INT, DINT, REAL, TIME)}
LOCATED = {"X": (BOOL,), "W": (WORD, INT, UINT), "D": (DWORD, DINT, UDINT, REAL)}  # by the letter of an address


class Pointer(NamedTuple):
    """The n-th byte of a variable, low byte first."""
    container: object  # a list or a dict
    key: object
    type: Type
    offset: int

    def element(self):
        """(container, key, type, offset) of the number that the byte belongs to; IndexError after the end of the variable"""
        if self.type.kind == "array":
            size = bytes_of(self.type.of)
            place = self.offset // size
            if not 0 <= place < len(self.container[self.key]):
                raise IndexError
            return self.container[self.key], place, self.offset % size
        if not 0 <= self.offset < bytes_of(self.type):
            raise IndexError
        return self.container, self.key, self.offset

    def read(self):
        container, key, offset = self.element()
        return container[key] >> 8 * offset & 0xFF

    def write(self, value):
        container, key, offset = self.element()
        container[key] = container[key] & ~(0xFF << 8 * offset) | value << 8 * offset

    def moved(self, count):
        return self._replace(offset=self.offset + count)


def bytes_of(a_type):
    return (a_type.high - a_type.low).bit_length() // 8


class Block:
    """A FUNCTION_BLOCK, PROGRAM or FUNCTION: the variables of an instance, and its body."""

    def __init__(self, kind, name):
        self.kind, self.name = kind, name
        self.sections = {}   # NAME: section
        self.types = {}      # NAME: Type or Block
        self.initial = {}    # NAME: value, or a Block to make an instance of
        self.located = {}    # address: NAME
        self.run = None      # of (the variables, the time)
        self.result = None   # Type of a FUNCTION

    def declare(self, name, section, a_type, first):
        self.sections[name], self.types[name] = section, a_type
        if section != "VAR_EXTERNAL":
            self.initial[name] = None if section == "VAR_IN_OUT" else first

    def instance(self):
        return {name: value.instance() if isinstance(value, Block) else copy.deepcopy(value) if isinstance(value, (list, dict)) else value
                for name, value in self.initial.items()}

    def names(self, *sections):
        return [name for name, section in self.sections.items() if section in sections]


class Timer(Block):
    """TON of IEC 61131-3, 2.5.2.3.4."""

    def __init__(self):
        super().__init__("FUNCTION_BLOCK", "TON")
        for name, section, a_type in (("IN", "VAR_INPUT", BOOL), ("PT", "VAR_INPUT", TIME), ("Q", "VAR_OUTPUT", BOOL), ("ET", "VAR_OUTPUT", TIME)):
            self.declare(name, section, a_type, a_type.first())
        self.run = self.pass_time

    @staticmethod
    def pass_time(values, now):
        if not values["IN"]:
            values["since"], values["ET"] = None, 0
        elif values.get("since") is None:
            values["since"] = now
        if values["IN"]:
            values["ET"] = min(now - values["since"], values["PT"])
        values["Q"] = values["IN"] and values["ET"] >= values["PT"]
