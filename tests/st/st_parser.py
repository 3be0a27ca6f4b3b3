# SPDX-License-Identifier: MIT
"""Structured Text to a tree, as far as tools/st needs it; anything else is an error. `uses` tells which constructs there are."""

from typing import NamedTuple, Optional

from st_lexer import StError, tokens_of


class Var(NamedTuple):
    name: str
    spec: tuple  # ("name", NAME), ("array", low, high, spec), ("struct", [Var]), ("enum", [NAME]) or ("pointer", spec)
    initial: Optional[tuple]  # an expression
    place: str
    section: str = ""  # VAR, VAR_INPUT, ...
    constant: bool = False
    address: str = ""  # of a located variable: %IW100


class Pou(NamedTuple):
    kind: str  # FUNCTION, FUNCTION_BLOCK or PROGRAM
    name: str
    result: Optional[tuple]
    variables: list
    body: list
    place: str


class Unit(NamedTuple):
    types: list     # Var: a name and what it stands for
    pous: list
    globals: list   # Var
    programs: list  # (instance, type, place)


class Expression(NamedTuple):
    kind: str  # number, time, bool, name, index, member, deref, unary, binary or call
    parts: tuple
    place: str


class Statement(NamedTuple):
    kind: str  # assign, call, if, case, while or for
    parts: tuple
    place: str


SECTIONS = {"VAR", "VAR_INPUT", "VAR_OUTPUT", "VAR_IN_OUT", "VAR_EXTERNAL"}
PRECEDENCE = [("OR",), ("AND",), ("=", "<>"), ("<", ">", "<=", ">="), ("+", "-"), ("*", "/", "MOD")]
KEYWORDS = SECTIONS | {
    "TYPE", "STRUCT", "ARRAY", "OF", "POINTER", "TO", "FUNCTION", "FUNCTION_BLOCK", "PROGRAM", "CONSTANT", "IF", "THEN", "ELSIF", "ELSE",
    "CASE", "WHILE", "FOR", "BY", "DO", "REPEAT", "UNTIL", "EXIT", "RETURN", "AND", "OR", "XOR", "NOT", "MOD", "TRUE", "FALSE",
    "CONFIGURATION", "RESOURCE", "ON", "TASK", "WITH", "VAR_GLOBAL", "VAR_TEMP", "VAR_ACCESS", "AT", "RETAIN", "NON_RETAIN", "STEP",
    "TRANSITION", "ACTION", "FROM", "R_EDGE", "F_EDGE"}
KEYWORDS |= {f"END_{word}" for word in ("TYPE", "STRUCT", "FUNCTION", "FUNCTION_BLOCK", "PROGRAM", "VAR", "IF", "CASE", "WHILE", "FOR",
                                        "CONFIGURATION", "RESOURCE", "REPEAT", "STEP", "TRANSITION", "ACTION")}


class Parser:
    def __init__(self, text, file):
        self.tokens, self.at = tokens_of(text, file), 0
        self.uses = {}  # construct: first place
        self.unit = Unit([], [], [], [])

    # Words

    @property
    def token(self):
        return self.tokens[self.at]

    def next(self):
        self.at += 1
        return self.tokens[self.at - 1]

    def sees(self, *values):
        return self.token.kind in ("word", "symbol") and self.token.value in values

    def takes(self, *values):
        return self.next() if self.sees(*values) else None

    def expect(self, *values):
        if not self.sees(*values):
            raise StError(self.token.place, f"{self.token.value}: {' or '.join(values)} should stand here")
        return self.next()

    def use(self, construct):
        self.uses.setdefault(construct, self.token.place)

    def identifier(self):
        if self.token.kind != "word" or self.token.value in KEYWORDS:
            raise StError(self.token.place, f"{self.token.value}: a name should stand here")
        return self.next().value

    def number(self):
        if self.token.kind != "number":
            raise StError(self.token.place, f"{self.token.value}: a number should stand here")
        return self.next().value

    # Declarations

    def parse(self):
        parts = {"TYPE": self.type_section, "FUNCTION": self.pou, "FUNCTION_BLOCK": self.pou, "PROGRAM": self.pou,
                 "CONFIGURATION": self.configuration}
        while self.token.kind != "end":
            if not self.sees(*parts):
                raise StError(self.token.place, f"{self.token.value}: {', '.join(parts)} are what this subset has here")
            parts[self.token.value]()
        return self.unit

    def type_section(self):
        self.expect("TYPE")
        while not self.takes("END_TYPE"):
            self.unit.types.append(self.variable("TYPE", False, self.type_spec))

    def variable(self, section, constant, spec):
        place, name = self.token.place, self.identifier()
        address = self.address() if section == "VAR" and self.takes("AT") else ""
        self.expect(":")
        what = spec(section)
        initial = None
        if self.takes(":="):
            self.use("initial value")
            initial = self.expression()
        self.expect(";")
        return Var(name, what, initial, place, section, constant, address)

    def address(self):
        self.use("AT")
        if self.token.kind != "address":
            raise StError(self.token.place, f"{self.token.value}: %IW or %QW and a number should stand here")
        return self.next().value

    def type_spec(self, _):
        if self.takes("("):
            self.use("enumeration without numbers")
            names = [self.identifier()]
            while self.takes(","):
                names.append(self.identifier())
            self.expect(")")
            return ("enum", names)
        if self.takes("STRUCT"):
            self.use("STRUCT")
            members = []
            while not self.takes("END_STRUCT"):
                members.append(self.variable("STRUCT", False, self.spec))
            return ("struct", members)
        spec = self.array() if self.sees("ARRAY") else self.spec(None)
        self.use("named ARRAY type" if spec[0] == "array" else "directly derived type")
        return spec

    def array(self):
        self.expect("ARRAY"), self.expect("[")
        low = self.number()
        self.expect("..")
        high = self.number()
        self.expect("]"), self.expect("OF")
        return ("array", low, high, self.spec(None))

    def spec(self, _):
        if self.takes("POINTER"):
            self.use("POINTER TO")
            self.expect("TO")
            return ("pointer", self.spec(None))
        return ("name", self.identifier())

    def pou(self):
        kind, place, name = self.next().value, self.token.place, self.identifier()
        self.use(kind)
        result = None
        if kind == "FUNCTION":
            self.expect(":")
            result = self.spec(None)
        variables = []
        while self.sees(*SECTIONS):
            variables += self.var_section()
        body = self.statements(f"END_{kind}")
        self.expect(f"END_{kind}")
        self.unit.pous.append(Pou(kind, name, result, variables, body, place))

    def var_section(self):
        section = self.next().value
        constant = section == "VAR_GLOBAL" and bool(self.takes("CONSTANT"))
        self.use(section + (" CONSTANT" if constant else ""))
        variables = []
        while not self.takes("END_VAR"):
            variables.append(self.variable(section, constant, self.spec))
            if bool(variables[-1].address) != bool(variables[0].address):
                raise StError(variables[-1].place, f"{variables[-1].name}: located variables have a VAR of their own")  # MATIEC
        return variables

    def configuration(self):
        self.use("CONFIGURATION")
        self.expect("CONFIGURATION"), self.identifier()
        while self.sees("VAR_GLOBAL"):
            self.unit.globals.extend(self.var_section())
        self.expect("RESOURCE"), self.identifier(), self.expect("ON"), self.identifier()
        self.expect("TASK"), self.identifier(), self.expect("("), self.expect("INTERVAL"), self.expect(":=")
        if self.next().kind != "time":
            raise StError(self.token.place, "INTERVAL: a time should stand here")
        self.expect(","), self.expect("PRIORITY"), self.expect(":="), self.number(), self.expect(")"), self.expect(";")
        while self.takes("PROGRAM"):
            place, instance = self.token.place, self.identifier()
            self.expect("WITH"), self.identifier(), self.expect(":")
            self.unit.programs.append((instance, self.identifier(), place))
            self.expect(";")
        self.expect("END_RESOURCE"), self.expect("END_CONFIGURATION")

    # Statements

    def statements(self, *ends):
        found = []
        while not self.sees(*ends):
            found.append(self.statement())
        return found

    def statement(self):
        compound = {"IF": self.if_statement, "CASE": self.case, "WHILE": self.while_statement, "FOR": self.for_statement}
        place, word = self.token.place, self.token.value
        if self.sees(*compound):
            self.use(word)
            self.next()
            statement = Statement(word.lower(), compound[word](), place)
            self.expect(";")
            return statement
        target = self.reference(self.identifier(), place)
        if self.takes(":="):
            statement = Statement("assign", (target, self.expression()), place)
        elif self.takes("("):
            statement = Statement("call", (target, self.arguments()), place)
        else:
            raise StError(place, f"{word}: no statement of this subset")
        self.expect(";")
        return statement

    def arguments(self):
        """[(name, is output, expression)]"""
        found = []
        while not self.takes(")"):
            name, output = self.identifier(), self.expect(":=", "=>").value == "=>"
            if output:
                self.use("output in a call")
            found.append((name, output, self.expression()))
            if not self.sees(")"):
                self.expect(",")
        return found

    def if_statement(self):
        branches, otherwise = [], []
        while True:
            condition = self.expression()
            self.expect("THEN")
            branches.append((condition, self.statements("ELSIF", "ELSE", "END_IF")))
            if not self.takes("ELSIF"):
                break
        if self.takes("ELSE"):
            otherwise = self.statements("END_IF")
        self.expect("END_IF")
        return branches, otherwise

    def case(self):
        selector, branches, otherwise = self.expression(), [], []
        self.expect("OF")
        while not self.sees("ELSE", "END_CASE"):
            label = self.label()
            self.expect(":")  # lists of labels: not in STruC++, for enumerators
            branches.append((label, self.case_body()))
        if self.takes("ELSE"):
            otherwise = self.statements("END_CASE")
        self.expect("END_CASE")
        return selector, branches, otherwise

    def label(self):
        place = self.token.place
        if self.token.kind == "number":
            return Expression("number", (self.number(),), place)
        return Expression("name", (self.identifier(),), place)

    def case_body(self):
        found = []
        while not (self.sees("ELSE", "END_CASE") or self.token.kind == "number"
                   or self.tokens[self.at + 1].value == ":"):
            found.append(self.statement())
        return found

    def while_statement(self):
        condition = self.expression()
        self.expect("DO")
        body = self.statements("END_WHILE")
        self.expect("END_WHILE")
        return condition, body

    def for_statement(self):
        place = self.token.place
        variable = Expression("name", (self.identifier(),), place)
        self.expect(":=")
        first = self.expression()
        self.expect("TO")
        last = self.expression()
        self.expect("DO")
        body = self.statements("END_FOR")
        self.expect("END_FOR")
        return variable, first, last, body

    # Expressions

    def expression(self, level=0):
        if level == len(PRECEDENCE):
            return self.unary()
        left = self.expression(level + 1)
        while self.sees(*PRECEDENCE[level]):
            operator = self.next()
            left = Expression("binary", (operator.value, left, self.expression(level + 1)), operator.place)
        return left

    def unary(self):
        place = self.token.place
        if self.takes("NOT"):
            return Expression("unary", ("NOT", self.unary()), place)
        if self.takes("("):
            inner = self.expression()
            self.expect(")")
            return inner
        if self.token.kind in ("number", "time"):
            return Expression(self.token.kind, (self.next().value,), place)
        if self.sees("TRUE", "FALSE"):
            return Expression("bool", (self.next().value == "TRUE",), place)
        name = self.identifier()
        if self.takes("("):
            return Expression("call", (name, self.operands(name)), place)
        return self.reference(name, place)

    def operands(self, name):
        self.use("ADR" if name == "ADR" else "call of a function without names")
        found = [self.expression()]
        while self.takes(","):
            found.append(self.expression())
        self.expect(")")
        return found

    def reference(self, name, place):
        found = Expression("name", (name,), place)
        while self.sees("[", ".", "^"):
            symbol = self.next().value
            if symbol == "[":
                found = Expression("index", (found, self.expression()), place)
                self.expect("]")
            elif symbol == ".":
                found = Expression("member", (found, self.identifier()), place)
            else:
                self.use("dereferencing with ^")
                found = Expression("deref", (found,), place)
        return found
