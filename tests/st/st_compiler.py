# SPDX-License-Identifier: MIT
"""A checked tree to Python functions of (the variables of an instance, the time)."""

import copy

from st_functions import call_of, checked
from st_lexer import StError
from st_types import ADDRESS, BOOL, BYTE, LITERAL, TIME, Type

ENOUGH = 1000  # rounds of a loop; no loop here needs more, and a PLC has a watchdog


def fits(kind, value, a_type):
    """Whether a number, a time or TRUE/FALSE as it is written is a value of the type."""
    if kind == "number":
        return a_type.kind in ("int", "bits") and a_type.low <= value <= a_type.high
    return a_type.kind == kind


def times(time, factor):
    """As MATIEC has it (iec_types_all.h: __time_mul): the nanoseconds beside the whole seconds go through an int of 32 bits."""
    nanoseconds = time % 1000000 * 1000 * factor
    if nanoseconds >= 2 ** 31:
        nanoseconds = -2 ** 31
    return time // 1000000 * factor * 1000000 + nanoseconds // 1000


class PouCompiler:
    def __init__(self, machine, block):
        self.machine, self.block = machine, block

    # Statements

    def statements(self, statements):
        kinds = {"assign": self.assign, "call": self.call, "if": self.if_, "case": self.case, "while": self.while_, "for": self.for_}
        steps = [kinds[statement.kind](statement.place, *statement.parts) for statement in statements]

        def run(values, now):
            for step in steps:
                step(values, now)
        return run

    def assign(self, place, target, source):
        target_type, where = self.writable(target)
        value = self.value_as(source, target_type, place)
        if target.kind == "deref":
            return lambda values, now: self.at(place, where(values).write, value(values))
        taken = copy.deepcopy if target_type.kind in ("array", "struct") else lambda it: it

        def run(values, _):
            container, key = where(values)
            container[key] = taken(value(values))
        return run

    def if_(self, _, branches, otherwise):
        branches = [(self.value_as(condition, BOOL, condition.place), self.statements(body)) for condition, body in branches]
        otherwise = self.statements(otherwise)

        def run(values, now):
            for condition, body in branches:
                if condition(values):
                    return body(values, now)
            return otherwise(values, now)
        return run

    def case(self, place, selector, branches, otherwise):
        a_type, value = self.expression(selector)
        if a_type.kind not in ("int", "enum"):
            raise StError(place, f"CASE: neither an integer nor an enumeration but {a_type.name}")
        bodies = {}
        for label, body in branches:
            constant = self.value_as(label, a_type, label.place)(None)
            if constant in bodies:
                raise StError(label.place, f"{constant}: the second of its kind")
            bodies[constant] = self.statements(body)
        otherwise = self.statements(otherwise)
        return lambda values, now: bodies.get(value(values), otherwise)(values, now)

    def while_(self, place, condition, body):
        condition, body = self.value_as(condition, BOOL, place), self.statements(body)

        def run(values, now):
            for _ in range(ENOUGH):
                if not condition(values):
                    return
                body(values, now)
            raise StError(place, "WHILE: does not end")
        return run

    def for_(self, place, variable, first, last, body):
        a_type, where = self.writable(variable)
        if a_type.kind != "int":
            raise StError(place, f"FOR: no integer but {a_type.name}")
        first, last, body = self.value_as(first, a_type, place), self.value_as(last, a_type, place), self.statements(body)

        def run(values, now):
            container, key = where(values)
            for container[key] in range(first(values), last(values) + 1):
                body(values, now)
        return run

    def call(self, place, target, arguments):
        """Of a function block."""
        if target.kind != "name":
            raise StError(place, "only instances by their name are called in this subset")
        block = self.type_of_name(target.parts[0], place)
        if isinstance(block, Type) or self.block.sections[target.parts[0]] != "VAR":
            raise StError(place, f"{target.parts[0]}: no instance of a function block")
        before, after, given = [], [], set()
        for name, output, expression in arguments:
            if name in given or block.sections.get(name) not in (("VAR_OUTPUT",) if output else ("VAR_INPUT", "VAR_IN_OUT")):
                raise StError(place, f"{name}: no {'output' if output else 'input'} of {block.name}, or twice")
            given.add(name)
            (after if output else before).append(self.argument(block, name, expression, place))
        missing = [name for name in block.names("VAR_IN_OUT") if name not in given]
        if missing:
            raise StError(place, f"{missing[0]}: VAR_IN_OUT of {block.name}, needs a variable")
        instance = target.parts[0]

        def run(values, now):
            inner = values[instance]
            for step in before:
                step(values, inner)
            block.run(inner, now)
            for step in after:
                step(values, inner)
        return run

    def argument(self, block, name, expression, place):
        section, a_type = block.sections[name], block.types[name]
        if section == "VAR_INPUT":
            value = self.value_as(expression, a_type, place)
            return lambda values, inner: inner.__setitem__(name, value(values))
        found, where = self.writable(expression)
        if found != a_type:
            raise StError(place, f"{name}: {a_type.name}, not {found.name}")
        if section == "VAR_IN_OUT":
            return lambda values, inner: inner.__setitem__(name, where(values))

        def take(values, inner):
            container, key = where(values)
            container[key] = inner[name]
        return take

    # References: functions that give (container, key)

    def type_of_name(self, name, place):
        if name not in self.block.types:
            raise StError(place, f"{name}: no such variable")
        return self.block.types[name]

    def writable(self, expression):
        if expression.kind not in ("name", "index", "member", "deref"):
            raise StError(expression.place, "a variable should stand here")
        root = expression
        while root.kind != "name":
            root = root.parts[0]
            if root.kind == "name" and not isinstance(self.block.types.get(root.parts[0]), (Type, type(None))):
                raise StError(root.place, f"{root.parts[0]}: its variables are its own")
        name = root.parts[0]
        pointed = any(part.kind == "deref" for part in self.path(expression))
        if self.block.sections.get(name) == "VAR_INPUT" and not pointed:
            raise StError(root.place, f"{name}: not to be written here")
        return self.reference(expression)

    def path(self, expression):
        yield expression
        if expression.kind != "name":
            yield from self.path(expression.parts[0])

    def reference(self, expression):
        return getattr(self, f"ref_{expression.kind}")(expression.place, *expression.parts)

    def ref_name(self, place, name):
        a_type, section = self.type_of_name(name, place), self.block.sections[name]
        if section == "VAR_EXTERNAL":
            return a_type, lambda values, where=self.machine.globals: (where, name)
        if section == "VAR_IN_OUT":
            return a_type, lambda values: values[name]
        return a_type, lambda values: (values, name)

    def ref_index(self, place, base, index):
        a_type, where = self.reference(base)
        if a_type.kind != "array":
            raise StError(place, f"no ARRAY but {a_type.name}")
        index_type, index = self.expression(index)
        if index_type.kind not in ("int", "literal"):
            raise StError(place, f"no index but {index_type.name}")

        def element(values):
            container, key = where(values)
            at = index(values)
            if not a_type.low <= at <= a_type.high:
                raise StError(place, f"index {at}: not within {a_type.low}..{a_type.high}")
            return container[key], at - a_type.low
        return a_type.of, element

    def ref_member(self, place, base, name):
        a_type, where = self.reference(base)
        if isinstance(a_type, Type):
            if a_type.kind != "struct" or name not in a_type.of:
                raise StError(place, f"{name}: no member of {a_type.name}")
            found = a_type.of[name][0]
        else:
            if a_type.sections.get(name) not in ("VAR_INPUT", "VAR_OUTPUT"):
                raise StError(place, f"{name}: no input or output of {a_type.name}")
            found = a_type.types[name]

        def member(values):
            container, key = where(values)
            return container[key], name
        return found, member

    def ref_deref(self, place, base):
        """Of a pointer the function gives the Pointer."""
        a_type, value = self.expression(base)
        if a_type.kind != "pointer" or a_type.of != BYTE:
            raise StError(place, f"no POINTER TO BYTE but {a_type.name}")

        def pointer(values):
            found = value(values)
            if found is None:
                raise StError(place, "a pointer to nothing")
            return found
        return BYTE, pointer

    def at(self, place, function, *arguments):
        try:
            return function(*arguments)
        except IndexError:
            raise StError(place, "a pointer behind its variable") from None

    # Expressions: (type, function that gives the value)

    def expression(self, expression):
        kind, place = expression.kind, expression.place
        if kind in ("number", "time", "bool"):
            value = expression.parts[0]
            return {"number": LITERAL, "time": TIME, "bool": BOOL}[kind], lambda values: value
        if kind == "name" and expression.parts[0] in self.machine.enumerators and expression.parts[0] not in self.block.types:
            value = expression.parts[0]
            return self.machine.enumerators[value], lambda values: value
        if kind in ("binary", "unary"):
            return getattr(self, kind)(place, *expression.parts)
        if kind == "call":
            return call_of(self, place, *expression.parts)
        a_type, where = self.reference(expression)
        if not isinstance(a_type, Type):
            raise StError(place, "an instance of a function block is no value")
        if kind == "deref":
            return a_type, lambda values: self.at(place, where(values).read)

        def value_of(values):
            container, key = where(values)
            return container[key]
        return a_type, value_of

    def value_as(self, expression, a_type, place):
        """The value as one of the type; a number as it is written takes every type that it fits."""
        found, value = self.expression(expression)
        if not isinstance(a_type, Type):
            raise StError(place, "an instance of a function block is no value")
        if found is LITERAL and a_type.kind in ("int", "bits"):
            constant = value(None)
            if not fits("number", constant, a_type):
                raise StError(place, f"{constant}: not within {a_type.name}")
            return value
        if found != a_type and not (found is ADDRESS and a_type.kind == "pointer"):
            raise StError(place, f"{a_type.name}, not {found.name}, should stand here")
        return value

    def unary(self, place, _, operand):
        a_type, value = self.expression(operand)
        if a_type is not BOOL:
            raise StError(place, f"NOT: no BOOL but {a_type.name}")
        return BOOL, lambda values: not value(values)

    def binary(self, place, operator, left, right):
        left_type, right_type = self.expression(left)[0], self.expression(right)[0]
        if left_type.kind == "pointer":
            return self.pointer_operation(place, operator, left_type, left, right)
        if operator == "*" and left_type is TIME and right_type.kind == "int":
            left, right = self.expression(left)[1], self.expression(right)[1]
            return TIME, lambda values: times(left(values), right(values))
        common = right_type if left_type is LITERAL else left_type
        if common is LITERAL:
            raise StError(place, f"{operator}: one number should stand here, not two")
        left, right = self.value_as(left, common, place), self.value_as(right, common, place)
        return self.operation(place, operator, common, left, right)

    def pointer_operation(self, place, operator, a_type, left, right):
        right_type, amount = self.expression(right)
        left = self.expression(left)[1]
        if operator == "=" and right_type is LITERAL and amount(None) == 0:
            return BOOL, lambda values: left(values) is None
        if operator == "+" and right_type is LITERAL:
            return a_type, lambda values: left(values).moved(amount(values))
        raise StError(place, f"{operator}: not for pointers in this subset")

    def operation(self, place, operator, a_type, left, right):
        kinds = {"OR": "bool bits", "AND": "bool bits", "=": "bool bits int time enum", "<>": "bool bits int time enum", "+": "int time"}
        if a_type.kind not in kinds.get(operator, "bits int time" if operator in ("<", ">", "<=", ">=") else "int").split():
            raise StError(place, f"{operator}: not for {a_type.name}")
        compute = {
            "OR": lambda a, b: a | b, "AND": lambda a, b: a & b, "=": lambda a, b: a == b, "<>": lambda a, b: a != b,
            "<": lambda a, b: a < b, ">": lambda a, b: a > b, "<=": lambda a, b: a <= b, ">=": lambda a, b: a >= b,
            "+": lambda a, b: a + b, "-": lambda a, b: a - b, "*": lambda a, b: a * b, "/": lambda a, b: a // b,
            "MOD": lambda a, b: a % b}[operator]
        result = BOOL if operator in ("=", "<>", "<", ">", "<=", ">=") else a_type
        return result, checked(lambda values: compute(left(values), right(values)), result, place)

