# SPDX-License-Identifier: MIT
"""Calls of functions: those of the standard that tools/st uses, ADR, and those that a file declares."""

import re

from st_lexer import StError
from st_types import ADDRESS, ELEMENTARY, Pointer


def checked(compute, a_type, place):
    """What does not fit into its type is an error here; the standard leaves it to each system (2.5.1.5.2)."""
    if a_type.kind not in ("int", "bits", "time"):
        return compute

    def run(values):
        value = compute(values)
        if not a_type.low <= value <= a_type.high:
            raise StError(place, f"{value}: not within {a_type.name}")
        return value
    return run


def call_of(compiler, place, name, operands):
    """(type, function that gives the value) of a call"""
    conversion = re.fullmatch(r"([A-Z]+)_TO_([A-Z]+)", name)
    if conversion and conversion[1] in ELEMENTARY and conversion[2] in ELEMENTARY:
        return convert(compiler, place, name, operands, *conversion.groups())
    standard = {"SHL": shift, "SHR": shift, "MIN": choose, "MAX": choose, "ADR": address}.get(name)
    if standard:
        return standard(compiler, place, name, operands)
    block = compiler.machine.blocks.get(name)
    if block is None or block.kind != "FUNCTION":
        raise StError(place, f"{name}: no such function in this subset")
    return declared(compiler, place, block, operands)


def take(place, name, operands, count):
    if len(operands) != count:
        raise StError(place, f"{name}: {count} arguments, not {len(operands)}")
    return operands


def note(compiler, place, name):
    compiler.machine.uses.setdefault(f"function {name}", place)


def convert(compiler, place, name, operands, source, target):
    note(compiler, place, name)
    operand, = take(place, name, operands, 1)
    return ELEMENTARY[target], checked(compiler.value_as(operand, ELEMENTARY[source], place), ELEMENTARY[target], place)


def shift(compiler, place, name, operands):
    note(compiler, place, name)
    value, count = take(place, name, operands, 2)
    a_type, value = compiler.expression(value)
    if a_type.kind != "bits":
        raise StError(place, f"{name}: no bits but {a_type.name}")
    count_type, count = compiler.expression(count)
    if count_type.kind not in ("int", "literal"):
        raise StError(place, f"{name}: no number of bits but {count_type.name}")
    if name == "SHL":
        return a_type, lambda values: value(values) << count(values) & a_type.high
    return a_type, lambda values: value(values) >> count(values)


def choose(compiler, place, name, operands):
    note(compiler, place, name)
    left, right = take(place, name, operands, 2)
    a_type = compiler.expression(left)[0]
    if a_type.kind != "int":
        raise StError(place, f"{name}: no integer but {a_type.name}")
    left, right = compiler.value_as(left, a_type, place), compiler.value_as(right, a_type, place)
    function = {"MIN": min, "MAX": max}[name]
    return a_type, lambda values: function(left(values), right(values))


def address(compiler, place, name, operands):
    operand, = take(place, name, operands, 1)
    a_type, where = compiler.writable(operand)
    number = a_type.of if a_type.kind == "array" else a_type
    if number.kind not in ("int", "bits"):
        raise StError(place, f"ADR: of numbers only in this subset, not of {a_type.name}")
    return ADDRESS, lambda values: Pointer(*where(values), a_type, 0)


def declared(compiler, place, block, operands):
    inputs = block.names("VAR_INPUT")
    take(place, block.name, operands, len(inputs))
    operands = [compiler.value_as(operand, block.types[name], place) for name, operand in zip(inputs, operands)]

    def run(values):
        inner = block.instance()
        inner.update((name, operand(values)) for name, operand in zip(inputs, operands))
        block.run(inner, 0)
        return inner[block.name]
    return block.result, run
