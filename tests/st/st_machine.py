# SPDX-License-Identifier: MIT
"""Checks a program and runs it: every name, type and argument before it runs, indices and ranges while it does."""

import copy

from st_compiler import PouCompiler, fits
from st_lexer import StError
from st_parser import Parser
from st_types import ELEMENTARY, Timer, Type


# Of IEC 61131-3, 2nd edition, tables 23 to 28: no names for variables in MATIEC.
STANDARD_FUNCTIONS = set("ABS SQRT LN LOG EXP SIN COS TAN ASIN ACOS ATAN ADD MUL SUB DIV MOD EXPT MOVE SHL SHR ROR ROL AND OR XOR NOT SEL MAX "
                         "MIN LIMIT MUX GT GE EQ LE LT NE LEN LEFT RIGHT MID CONCAT INSERT DELETE REPLACE FIND".split())


class Block:
    """A FUNCTION_BLOCK, PROGRAM or FUNCTION: the variables of an instance, and what runs."""

    def __init__(self, kind, name):
        self.kind, self.name = kind, name
        self.sections = {}   # NAME: section
        self.types = {}      # NAME: Type or Block
        self.initial = {}    # NAME: value, or a Block to make an instance of
        self.located = {}    # address: NAME
        self.run = None      # of (the variables, the time)
        self.result = None   # Type of a FUNCTION

    def instance(self):
        return {name: value.instance() if isinstance(value, Block) else copy.deepcopy(value) for name, value in self.initial.items()}

    def names(self, *sections):
        return [name for name, section in self.sections.items() if section in sections]


def standard_timer():
    block = Block("FUNCTION_BLOCK", "TON")
    for section, variables in (("VAR_INPUT", Timer.inputs), ("VAR_OUTPUT", Timer.outputs)):
        for name, (a_type, first) in variables.items():
            block.sections[name], block.types[name], block.initial[name] = section, a_type, first
    block.run = Timer.run
    return block


class Machine:
    """The programs of some files; `uses` is {construct: first place}."""

    def __init__(self, *texts):
        """texts: (file name, text) each, in the order in which they use each other; the configuration is the last."""
        self.types, self.blocks, self.enumerators = dict(ELEMENTARY), {"TON": standard_timer()}, {}
        self.global_types, self.globals, self.constants = {}, {}, set()
        self.uses, self.programs = {}, {}
        parsers = [Parser(text, file) for file, text in texts]
        units = [parser.parse() for parser in parsers]
        for parser in parsers:
            self.uses = {**parser.uses, **self.uses}
        for unit in units:
            for declared in unit.types:
                self.new_name(declared.name, declared.place)
                self.types[declared.name] = self.type_of(declared.spec, declared.name, declared.place)
        for unit in units:
            self.add_globals(unit.globals)
        for unit in units:
            for pou in unit.pous:
                self.add_pou(pou)
        for unit in units:
            for instance, name, place in unit.programs:
                if name not in self.blocks or self.blocks[name].kind != "PROGRAM":
                    raise StError(place, f"{name}: no such program")
                self.programs[instance] = (self.blocks[name], self.blocks[name].instance())

    def scan(self, now):
        """now: microseconds"""
        for block, values in self.programs.values():
            block.run(values, now)

    # Declarations

    def new_name(self, name, place):
        if name in self.types or name in self.blocks or name in self.enumerators:
            raise StError(place, f"{name}: this name is taken")

    def type_of(self, spec, name, place):
        kind = spec[0]
        if kind == "name":
            if spec[1] in self.types:
                return self.types[spec[1]]
            if spec[1] in self.blocks and self.blocks[spec[1]].kind == "FUNCTION_BLOCK":
                return self.blocks[spec[1]]
            raise StError(place, f"{spec[1]}: no such type")
        if kind == "array":
            element = self.type_of(spec[3], "", place)
            if element.kind == "array":  # MATIEC's C for it does not compile
                raise StError(place, f"{name}: an ARRAY of arrays")
            return Type("array", name, spec[1], spec[2], element)
        if kind == "pointer":
            return Type("pointer", "POINTER", of=self.type_of(spec[1], "", place))
        if kind == "enum":
            made = Type("enum", name, of=spec[1])
            for value in spec[1]:
                self.new_name(value, place)
                self.enumerators[value] = made
            return made
        members = {}
        for member in spec[1]:
            a_type = self.type_of(member.spec, "", member.place)
            members[member.name] = (a_type, self.initial_of(member, a_type))
        return Type("struct", name, of=members)

    def initial_of(self, variable, a_type):
        if variable.initial is None:
            return a_type if isinstance(a_type, Block) else a_type.first()
        kind, (value, *_), place = variable.initial
        if kind == "name" and self.enumerators.get(value) is a_type:
            return value
        if kind not in ("number", "time", "bool") or not fits(kind, value, a_type):
            raise StError(place, f"{variable.name}: not a first value of a {a_type.name}")
        return value

    def add_globals(self, variables):
        for variable in variables:
            if variable.name in self.global_types:
                raise StError(variable.place, f"{variable.name}: this name is taken")
            self.global_types[variable.name] = self.type_of(variable.spec, "", variable.place)
            self.globals[variable.name] = copy.deepcopy(self.initial_of(variable, self.global_types[variable.name]))
            if variable.constant:
                self.constants.add(variable.name)

    def add_pou(self, pou):
        self.new_name(pou.name, pou.place)
        block = Block(pou.kind, pou.name)
        if pou.result:
            block.result = self.type_of(pou.result, "", pou.place)
            block.sections[pou.name], block.types[pou.name], block.initial[pou.name] = "VAR", block.result, block.result.first()
        for variable in pou.variables:
            self.add_variable(block, variable)
        compiler = PouCompiler(self, block)
        body = compiler.statements(pou.body)
        block.run = body
        self.blocks[pou.name] = block

    def add_variable(self, block, variable):
        name = variable.name
        if name in block.sections or name in self.types or name in self.enumerators or name in STANDARD_FUNCTIONS:
            raise StError(variable.place, f"{name}: this name is taken")
        if block.kind == "FUNCTION" and variable.section not in ("VAR", "VAR_INPUT"):
            raise StError(variable.place, f"{name}: a FUNCTION has no {variable.section} in this subset")
        a_type = self.type_of(variable.spec, "", variable.place)
        block.sections[name], block.types[name] = variable.section, a_type
        if variable.section == "VAR_EXTERNAL":
            if self.global_types.get(name) != a_type or name in self.constants:  # MATIEC and STruC++ differ on constants
                raise StError(variable.place, f"{name}: no VAR_GLOBAL of this type")
        elif variable.section == "VAR_IN_OUT":
            block.initial[name] = None
        else:
            block.initial[name] = self.initial_of(variable, a_type)
        if variable.address:
            if block.kind != "PROGRAM" or a_type.name != "WORD":
                raise StError(variable.place, f"{name}: only a WORD of a PROGRAM is located in this subset")
            block.located[variable.address] = name
