# SPDX-License-Identifier: MIT
"""Structured Text to Python functions, limited to what tools/st needs: only what CODESYS, MATIEC (OpenPLC, Beremiz) and STruC++ all accept;
pointers are for CODESYS and STruC++. Anything else is an error. A body becomes a function of (the variables of an instance, the time),
an expression (its type, a function of the variables)."""

import copy
import re
from typing import NamedTuple

from .declarations import Declarations
from .lexer import StError
from .types import ADDRESS, BOOL, BYTE, ELEMENTARY, LITERAL, REAL, TIME, Block, Pointer, bytes_of, single

ENOUGH = 1000  # iterations of a loop; no loop here needs more, and a PLC has a watchdog
PRECEDENCE = [("OR",), ("AND",), ("=", "<>"), ("<", ">", "<=", ">="), ("+", "-"), ("*", "/", "MOD")]
COMPARISONS = PRECEDENCE[2] + PRECEDENCE[3]


def quotient(a, b):
    """Towards zero, as the standard has it for integers."""
    if isinstance(a, float):
        return a / b
    return a // b if (a < 0) == (b < 0) else -(-a // b)


COMPUTE = {
    "OR": lambda a, b: a | b, "AND": lambda a, b: a & b, "=": lambda a, b: a == b, "<>": lambda a, b: a != b,
    "<": lambda a, b: a < b, ">": lambda a, b: a > b, "<=": lambda a, b: a <= b, ">=": lambda a, b: a >= b,
    "+": lambda a, b: a + b, "-": lambda a, b: a - b, "*": lambda a, b: a * b, "/": quotient, "MOD": lambda a, b: a - b * quotient(a, b),
    "MIN": min, "MAX": max}
FORMS = {"ADD": "+", "SUB": "-", "MUL": "*", "DIV": "/", "EQ": "=", "NE": "<>", "LT": "<", "GT": ">", "LE": "<=", "GE": ">=", "MIN": "MIN", "MAX": "MAX"}
KINDS = {"OR": "bool bits", "AND": "bool bits", "=": "bool bits int real time enum", "<>": "bool bits int real time enum", "+": "int real time",
         **dict.fromkeys("-*/", "int real"), **dict.fromkeys(PRECEDENCE[3], "bits int real time")}  # operand types of operators; the others take int


def times(time, factor):
    """As in MATIEC (iec_types_all.h: __time_mul): the nanoseconds within a second are computed in a 32-bit int."""
    nanoseconds = time % 1000000 * 1000 * factor
    if nanoseconds >= 2 ** 31:
        nanoseconds = -2 ** 31
    return time // 1000000 * factor * 1000000 + nanoseconds // 1000


def checked(compute, a_type, place):
    """A value that does not fit its type is an error here; the standard leaves it to each system (2.5.1.5.2)."""
    if a_type.kind not in ("int", "bits", "time", "real"):
        return compute

    def run(values):
        try:
            value = compute(values)
        except (ArithmeticError, ValueError) as error:
            raise StError(place, str(error)) from None
        if a_type is REAL:
            return single(value)
        if not a_type.low <= value <= a_type.high:
            raise StError(place, f"{value}: not within {a_type.name}")
        return value
    return run


def within_variable(place, function, *arguments):
    try:
        return function(*arguments)
    except IndexError:
        raise StError(place, "a pointer behind its variable") from None


class Reference(NamedTuple):
    type: object  # a Type or a Block
    where: object  # a function of the variables: (container, key), or the Pointer
    name: str  # of a whole variable; "" for a part of one
    pointed: bool = False


class Expressions(Declarations):
    def expression(self, level=0):
        if level == len(PRECEDENCE):
            return self.unary()
        left = self.expression(level + 1)
        while self.sees(*PRECEDENCE[level]):
            operator = self.next()
            left = self.binary(operator.place, operator.value, left, self.expression(level + 1))
        return left

    def value_of_type(self, a_type):
        """The expression at this position, as one of the type."""
        place = self.token.place
        return self.converted(self.expression(), a_type, place)

    def converted(self, expression, a_type, place):
        """A literal number takes every type that it fits."""
        found, value = expression
        if found is LITERAL and a_type.kind in ("int", "bits"):
            if not a_type.takes(value(None)):
                raise StError(place, f"{value(None)}: not within {a_type.name}")
        elif found != a_type and not (found is ADDRESS and a_type.kind == "pointer"):
            raise StError(place, f"{a_type.name}, not {found.name}, should stand here")
        return value

    def unary(self):
        place = self.token.place
        if self.takes("NOT"):
            value = self.converted(self.unary(), BOOL, place)
            return BOOL, lambda values: not value(values)
        if self.takes("-"):
            a_type, value = self.unary()
            if a_type.kind not in ("int", "real", "literal"):
                raise StError(place, f"-: not for {a_type.name}")
            return a_type, checked(lambda values: -value(values), a_type, place)
        if self.takes("("):
            inner = self.expression()
            self.expect(")")
            return inner
        if self.token.kind in ("number", "real", "time"):
            kind, value, _ = self.next()
            return {"number": LITERAL, "real": REAL, "time": TIME}[kind], lambda values: value
        if self.sees("TRUE", "FALSE"):
            value = self.next().value == "TRUE"
            return BOOL, lambda values: value
        name = self.one("word")
        if self.takes("("):
            return self.function(place, name)
        if name in self.machine.enumerators:
            return self.machine.enumerators[name], lambda values: name
        return self.value(self.reference(name, place), place)

    def value(self, reference, place):
        where, name = reference.where, reference.name
        if isinstance(reference.type, Block):
            raise StError(place, "an instance of a function block is no value")
        if name and self.block.sections[name] not in ("VAR_EXTERNAL", "VAR_IN_OUT"):  # most values are whole variables; this takes half the time
            return reference.type, lambda values: values[name]
        if reference.pointed:
            return reference.type, lambda values: within_variable(place, where(values).read)

        def value_of(values):
            container, key = where(values)
            return container[key]
        return reference.type, value_of

    def binary(self, place, operator, left, right):
        left_type, right_type = left[0], right[0]
        if left_type.kind == "pointer":
            return self.pointer_operation(place, operator, left, right)
        if operator == "*" and left_type is TIME and right_type.kind == "int":
            return TIME, lambda values: times(left[1](values), right[1](values))
        common = right_type if left_type is LITERAL else left_type
        if common is LITERAL or common.kind not in KINDS.get(operator, "int").split():
            raise StError(place, f"{operator}: not for {common.name}")
        left, right = self.converted(left, common, place), self.converted(right, common, place)
        result, compute = BOOL if operator in COMPARISONS else common, COMPUTE[operator]
        return result, checked(lambda values: compute(left(values), right(values)), result, place)

    def pointer_operation(self, place, operator, left, right):
        (a_type, pointer), (right_type, amount) = left, right
        if operator == "=" and right_type is LITERAL and amount(None) == 0:
            return BOOL, lambda values: pointer(values) is None
        if operator == "+" and right_type is LITERAL:
            return a_type, lambda values: pointer(values).moved(amount(values))
        raise StError(place, f"{operator}: not for pointers in this subset")

    # Functions

    def function(self, place, name):
        conversion = re.fullmatch(r"([A-Z]+)_TO_([A-Z]+)", name)
        if conversion and conversion[1] in ELEMENTARY and conversion[2] in ELEMENTARY:
            source, target = ELEMENTARY[conversion[1]], ELEMENTARY[conversion[2]]
            value = self.value_of_type(source)
            self.expect(")")
            return target, checked(self.convert(value, source, target), target, place)
        if name == "ADR":
            return self.address(place)
        operands = self.listed(self.expression)
        if name in FORMS and len(operands) == 2:
            return self.binary(place, FORMS[name], *operands)
        if name in ("SHL", "SHR") and len(operands) == 2:
            return self.shift(place, name, *operands)
        block = self.machine.blocks.get(name)
        if block is None or block.kind != "FUNCTION" or len(operands) != len(block.names("VAR_INPUT")):
            raise StError(place, f"{name}: no such function in this subset, or not with {len(operands)} arguments")
        operands = {name: self.converted(operand, block.types[name], place) for name, operand in zip(block.names("VAR_INPUT"), operands)}

        def run(values):
            inner = block.instance()
            inner.update((name, operand(values)) for name, operand in operands.items())
            block.run(inner, 0)
            return inner[block.name]
        return block.result, run

    @staticmethod
    def convert(value, source, target):
        """Bits and a signed number of the same size are the same bits; elsewhere the systems agree only on values that fit."""
        if source is REAL and target.kind == "int":
            return lambda values: round(value(values))
        if {source.kind, target.kind} == {"bits", "int"} and bytes_of(source) == bytes_of(target):
            return lambda values: (value(values) - target.low) % (target.high - target.low + 1) + target.low
        return value

    def shift(self, place, name, bits, count):
        (a_type, value), (count_type, count) = bits, count
        if a_type.kind != "bits" or count_type.kind not in ("int", "literal"):
            raise StError(place, f"{name}: not for {a_type.name}, {count_type.name}")
        if name == "SHL":
            return a_type, lambda values: value(values) << count(values) & a_type.high
        return a_type, lambda values: value(values) >> count(values)

    def address(self, place):
        a_type, where, _, _ = self.writable()
        self.expect(")")
        number = a_type.of if a_type.kind == "array" else a_type
        if number.kind not in ("int", "bits") or number.low < 0:
            raise StError(place, f"ADR: of unsigned numbers only in this subset, not of {a_type.name}")
        return ADDRESS, lambda values: Pointer(*where(values), a_type, 0)

    # References

    def writable(self):
        place, name = self.token.place, self.one("word")
        found = self.reference(name, place)
        if isinstance(self.block.types[name], Block):
            raise StError(place, f"{name}: its variables are its own")
        if self.block.sections[name] == "VAR_INPUT" and not found.pointed:
            raise StError(place, f"{name}: not to be written here")
        return found

    def reference(self, name, place):
        if name not in self.block.types:
            raise StError(place, f"{name}: no such variable")
        a_type, section, shared = self.block.types[name], self.block.sections[name], self.machine.globals
        where = {"VAR_EXTERNAL": lambda values: (shared, name), "VAR_IN_OUT": lambda values: values[name]}.get(section, lambda values: (values, name))
        found = Reference(a_type, where, name)
        while self.sees("[", ".", "^"):
            symbol = self.next()
            found = {"[": self.element, ".": self.member, "^": self.pointed}[symbol.value](symbol.place, found)
        return found

    def element(self, place, base):
        index_type, index = self.expression()
        self.expect("]")
        array, where = base.type, base.where
        if array.kind != "array" or index_type.kind not in ("int", "literal"):
            raise StError(place, f"{array.name}: no ARRAY, or its index is no number")

        def element(values):
            container, key = where(values)
            at = index(values)
            if not array.low <= at <= array.high:
                raise StError(place, f"index {at}: not within {array.low}..{array.high}")
            return container[key], at - array.low
        return base._replace(type=array.of, where=element, name="")

    def member(self, place, base):
        name, where, a_type = self.one("word"), base.where, base.type
        if isinstance(a_type, Block):
            found = a_type.types.get(name) if a_type.sections.get(name) in ("VAR_INPUT", "VAR_OUTPUT") else None
        else:
            found = a_type.of[name][0] if a_type.kind == "struct" and name in a_type.of else None
        if found is None:
            raise StError(place, f"{name}: no member of {a_type.name}")

        def member(values):
            container, key = where(values)
            return container[key], name
        return base._replace(type=found, where=member, name="")

    def pointed(self, place, base):
        a_type, value = self.value(base, place)
        if a_type.kind != "pointer" or a_type.of != BYTE:
            raise StError(place, f"no POINTER TO BYTE but {a_type.name}")

        def pointer(values):
            found = value(values)
            if found is None:
                raise StError(place, "a pointer to nothing")
            return found
        return Reference(BYTE, pointer, "", True)


class Compiler(Expressions):
    """Statements."""

    def statements(self, *ends):
        return self.steps(lambda: self.sees(*ends))

    def steps(self, ended):
        steps = []
        while not ended():
            steps.append(self.statement())
            self.expect(";")

        def run(values, now):
            for step in steps:
                step(values, now)
        return run

    def statement(self):
        compound = {"IF": self.if_, "CASE": self.case, "WHILE": self.while_, "REPEAT": self.repeat, "FOR": self.for_}
        if self.sees(*compound):
            place, word, _ = self.token.place, self.token.value, self.next()
            return compound[word](place)
        return self.call() if self.tokens[self.at + 1].value == "(" else self.assignment()

    def assignment(self):
        target, where, _, pointed = self.writable()
        place = self.expect(":=").place
        value = self.value_of_type(target)
        if pointed:
            return lambda values, now: within_variable(place, where(values).write, value(values))
        taken = copy.deepcopy if target.kind in ("array", "struct") else lambda it: it

        def run(values, _):
            container, key = where(values)
            container[key] = taken(value(values))
        return run

    def call(self):
        """Of a function block."""
        place, name, _ = self.token.place, self.one("word"), self.next()
        block = self.block.types.get(name)
        if not isinstance(block, Block) or self.block.sections[name] != "VAR":
            raise StError(place, f"{name}: no instance of a function block")
        given = {}
        while not self.takes(")"):
            if given:
                self.expect(",")
            argument = self.one("word")
            section = block.sections.get(argument)
            if argument in given or section not in ("VAR_INPUT", "VAR_IN_OUT"):
                raise StError(place, f"{argument}: no input of {block.name}, or twice")
            self.expect(":=")
            given[argument] = self.value_of_type(block.types[argument]) if section == "VAR_INPUT" else self.variable_of_type(block.types[argument])
        missing = [argument for argument in block.names("VAR_IN_OUT") if argument not in given]
        if missing:
            raise StError(place, f"{missing[0]}: VAR_IN_OUT of {block.name}, needs a variable")

        def run(values, now):
            inner = values[name]
            for argument, value in given.items():
                inner[argument] = value(values)
            block.run(inner, now)
        return run

    def variable_of_type(self, a_type):
        place, found = self.token.place, self.writable()
        if found.type != a_type:
            raise StError(place, f"{a_type.name}, not {found.type.name}, should stand here")
        return found.where

    def if_(self, _):
        branches, otherwise = [], None
        while True:
            condition = self.value_of_type(BOOL)
            self.expect("THEN")
            branches.append((condition, self.statements("ELSIF", "ELSE", "END_IF")))
            if not self.takes("ELSIF"):
                break
        if self.takes("ELSE"):
            otherwise = self.statements("END_IF")
        self.expect("END_IF")

        def run(values, now):
            body = next((body for condition, body in branches if condition(values)), otherwise)
            if body:
                body(values, now)
        return run

    def case(self, place):
        a_type, value = self.expression()
        if a_type.kind not in ("int", "enum"):
            raise StError(place, f"CASE: neither an integer nor an enumeration but {a_type.name}")
        self.expect("OF")
        bodies, otherwise, labels = [], None, []
        while not self.sees("ELSE", "END_CASE"):
            known = len(labels)
            labels.append(self.label(a_type, labels))
            while a_type.kind == "int" and self.takes(","):  # of enumerators: not in STruC++
                labels.append(self.label(a_type, labels))
            self.expect(":")
            bodies.append((labels[known:], self.steps(self.sees_label)))
        if self.takes("ELSE"):
            otherwise = self.statements("END_CASE")
        self.expect("END_CASE")

        def run(values, now):
            found = value(values)
            body = next((body for labels, body in bodies if any(found in label for label in labels)), otherwise)
            if body:
                body(values, now)
        return run

    def label(self, a_type, others):
        """The values of a label, or of a range."""
        place, first = self.token.place, self.value_of_type(a_type)(None)
        found = range(first, (self.value_of_type(a_type)(None) if self.takes("..") else first) + 1) if a_type.kind == "int" else [first]
        if not found or any(found[0] in other or other[0] in found for other in others):
            raise StError(place, f"{first}: the second of its kind, or an empty range")
        return found

    def sees_label(self):
        return self.sees("ELSE", "END_CASE", "-") or self.token.kind == "number" or self.tokens[self.at + 1].value == ":"

    def while_(self, place):
        condition = self.value_of_type(BOOL)
        body = self.expect("DO") and self.statements("END_WHILE")
        self.expect("END_WHILE")
        return self.loop(place, "WHILE", condition, body)

    def repeat(self, place):
        body = self.statements("UNTIL")
        condition = self.expect("UNTIL") and self.value_of_type(BOOL)
        self.expect("END_REPEAT")
        again = self.loop(place, "REPEAT", lambda values: not condition(values), body)
        return lambda values, now: (body(values, now), again(values, now))

    @staticmethod
    def loop(place, word, condition, body):
        def run(values, now):
            for _ in range(ENOUGH):
                if not condition(values):
                    return
                body(values, now)
            raise StError(place, f"{word}: does not end")
        return run

    def for_(self, place):
        a_type, where, _, _ = self.writable()
        if a_type.kind != "int":
            raise StError(place, f"FOR: no integer but {a_type.name}")
        first = self.expect(":=") and self.value_of_type(a_type)
        last = self.expect("TO") and self.value_of_type(a_type)
        self.expect("DO")
        body = self.statements("END_FOR")
        self.expect("END_FOR")

        def run(values, now):
            container, key = where(values)
            for container[key] in range(first(values), last(values) + 1):
                body(values, now)
        return run
