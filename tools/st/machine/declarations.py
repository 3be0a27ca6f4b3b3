# SPDX-License-Identifier: MIT
"""The declarations of a file: types, blocks with their variables, globals and programs."""

import copy

from .lexer import SECTIONS, StError, Words
from .types import LOCATED, Block, Type

# IEC 61131-3, 2nd edition, tables 23 to 28: not allowed as names of variables in MATIEC.
STANDARD_FUNCTIONS = set("ABS SQRT LN LOG EXP SIN COS TAN ASIN ACOS ATAN ADD MUL SUB DIV MOD EXPT MOVE SHL SHR ROR ROL AND OR XOR NOT SEL MAX "
                         "MIN LIMIT MUX GT GE EQ LE LT NE LEN LEFT RIGHT MID CONCAT INSERT DELETE REPLACE FIND".split())


class Declarations(Words):
    def __init__(self, machine, text, file):
        super().__init__(text, file)
        self.machine, self.block = machine, None

    def compile(self):
        parts = {"TYPE": self.type_section, "FUNCTION": self.pou, "FUNCTION_BLOCK": self.pou, "PROGRAM": self.pou,
                 "CONFIGURATION": self.configuration}
        while self.token.kind != "end":
            parts[self.expect(*parts).value]()

    def new_name(self):
        place, name = self.token.place, self.one("word")
        if name in self.machine.types or name in self.machine.blocks or name in self.machine.enumerators:
            raise StError(place, f"{name}: this name is taken")
        return name

    def type_section(self):
        while not self.takes("END_TYPE"):
            name = self.new_name()
            self.expect(":")
            self.machine.types[name] = self.new_type(name)
            self.expect(";")

    def new_type(self, name):
        if self.takes("("):
            names = self.listed(self.new_name)
            made = Type("enum", name, of=names)
            self.machine.enumerators.update(dict.fromkeys(names, made))
            return made
        if self.takes("STRUCT"):
            members = {}
            while not self.takes("END_STRUCT"):
                member, a_type, first, _, _ = self.variable()
                members[member] = (a_type, first)
            return Type("struct", name, of=members)
        if self.takes("ARRAY"):
            low, high = (self.expect("[") and self.one("number")), (self.expect("..") and self.one("number"))
            place = self.expect("]").place
            self.expect("OF")
            element = self.type_name()
            if element.kind == "array":  # MATIEC generates C that does not compile
                raise StError(place, f"{name}: an ARRAY of arrays")
            return Type("array", name, low, high, element)
        return self.type_name()

    def type_name(self):
        if self.takes("POINTER"):
            self.expect("TO")
            return Type("pointer", "POINTER", of=self.type_name())
        place, name = self.token.place, self.one("word")
        found = self.machine.types.get(name) or self.machine.block(name)
        if found is None or found.kind in ("FUNCTION", "PROGRAM"):
            raise StError(place, f"{name}: no such type in this subset, or in files before this one, such as cia405.st")
        return found

    def variable(self):
        """(name, type, first value, place, address)"""
        place, name = self.token.place, self.one("word")
        address = self.one("address") if self.takes("AT") else ""
        self.expect(":")
        a_type = self.new_type(name) if self.sees("ARRAY") else self.type_name()
        first = a_type if isinstance(a_type, Block) else a_type.first()
        if self.takes(":="):
            first = self.first_value(place, name, a_type)
        self.expect(";")
        return name, a_type, first, place, address

    def first_value(self, place, name, a_type):
        if a_type.kind == "array" and self.takes("["):
            found, others = self.listed(lambda: self.first_value(place, name, a_type.of), "]"), a_type.first()
            if len(found) == len(others):
                return found
        negative, (kind, value, _) = self.takes("-"), self.next()
        if negative and kind in ("number", "real"):
            value = -value
        if value in ("TRUE", "FALSE"):
            kind, value = "bool", value == "TRUE"
        is_enumerator = self.machine.enumerators.get(value) is a_type
        if not (is_enumerator or kind == a_type.kind or kind == "number" and a_type.takes(value)):
            raise StError(place, f"{name}: not a first value of a {a_type.name}")
        return value

    def pou(self):
        kind, name = self.tokens[self.at - 1].value, self.new_name()
        block = self.block = Block(kind, name)
        if kind == "FUNCTION":
            self.expect(":")
            block.result = self.type_name()
            block.declare(name, "VAR", block.result, block.result.first())
        while self.sees(*SECTIONS):
            section, _ = self.next().value, self.takes("CONSTANT", "RETAIN")
            self.var_section(section)
        block.run = self.statements(f"END_{kind}")
        self.expect(f"END_{kind}")
        self.machine.blocks[name] = block

    def var_section(self, section):
        block, located = self.block, set()
        while not self.takes("END_VAR"):
            name, a_type, first, place, address = self.variable()
            if name in block.sections or name in self.machine.types or name in self.machine.enumerators or name in STANDARD_FUNCTIONS:
                raise StError(place, f"{name}: this name is taken")
            if block.kind == "FUNCTION" and section not in ("VAR", "VAR_INPUT"):
                raise StError(place, f"{name}: a FUNCTION has no {section} in this subset")
            if address and ((section, block.kind) != ("VAR", "PROGRAM") or a_type not in LOCATED[address[2]]):
                raise StError(place, f"{name}: {address} is for a {' or '.join(fit.name for fit in LOCATED[address[2]])} of a PROGRAM")
            located.add(bool(address))
            if len(located) > 1:
                raise StError(place, f"{name}: located variables have a VAR of their own")  # MATIEC
            if section == "VAR_EXTERNAL":
                self.machine.externals.append((name, a_type, place))
            block.declare(name, section, a_type, first)
            if address:
                block.located[address] = name

    def configuration(self):
        self.one("word")
        while self.takes("VAR_GLOBAL"):
            constant = self.takes("CONSTANT")
            while not self.takes("END_VAR"):
                name, a_type, first, place, address = self.variable()
                if address:
                    raise StError(place, f"{name}: only variables of a PROGRAM are located in this subset")
                self.machine.globals[name], self.machine.global_types[name] = copy.deepcopy(first), a_type
                if constant:
                    self.machine.constants.add(name)
        self.expect("RESOURCE"), self.one("word"), self.expect("ON"), self.one("word")
        while self.takes("TASK"):
            task, _, _, _ = self.one("word"), self.expect("("), self.expect("INTERVAL"), self.expect(":=")
            self.machine.tasks[task] = self.one("time")
            for expected in ", PRIORITY := number ) ;".split():
                self.one(expected) if expected.islower() else self.expect(expected)
        while self.takes("PROGRAM"):
            instance, _, place, task, _ = self.one("word"), self.expect("WITH"), self.token.place, self.one("word"), self.expect(":")
            if not self.machine.tasks.get(task):
                raise StError(place, f"{task}: no task with an INTERVAL")
            place, name = self.token.place, self.one("word")
            block = self.machine.blocks.get(name)
            if block is None or block.kind != "PROGRAM":
                raise StError(place, f"{name}: no such program")
            self.machine.programs[instance] = (block, block.instance())
            self.machine.intervals[instance] = self.machine.tasks[task]
            self.expect(";")
        self.expect("END_RESOURCE"), self.expect("END_CONFIGURATION")
