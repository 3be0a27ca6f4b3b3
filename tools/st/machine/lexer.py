# SPDX-License-Identifier: MIT
"""The words of Structured Text (IEC 61131-3, 2nd edition, 2.1 and 2.2), as far as the machine knows them."""

import re
from typing import NamedTuple


class StError(Exception):
    def __init__(self, place, message):
        super().__init__(f"{place}: {message}")


class Token(NamedTuple):
    kind: str   # word, number, time, address, symbol or end
    value: object  # a word in capitals, a number, microseconds, a symbol
    place: str  # file:line


PATTERN = re.compile(r"""
    (?P<blank>\s+) | (?P<comment>\(\*.*?\*\)) |
    (?P<time>(?:T|TIME)\#(?:\d+(?:\.\d+)?(?:ms|[smhd])_?)+\b) |
    (?P<address>%[IQM](?:[WD]\d+|X\d+\.\d+)) | (?P<based>16\#[0-9A-F]+) | (?P<real>\d+\.\d+) | (?P<number>\d+(?![A-Z_#.]\w)) | (?P<word>[A-Z_]\w*) |
    (?P<symbol>:=|<>|<=|>=|\.\.|[-+*/<>=()\[\],;:.^])
    """, re.VERBOSE | re.DOTALL | re.IGNORECASE)
MICROSECONDS = {"ms": 1000, "s": 1000000, "m": 60000000, "h": 3600000000, "d": 86400000000}
SECTIONS = {"VAR", "VAR_INPUT", "VAR_OUTPUT", "VAR_IN_OUT", "VAR_EXTERNAL"}
KEYWORDS = SECTIONS | set(
    "TYPE STRUCT ARRAY OF POINTER TO FUNCTION FUNCTION_BLOCK PROGRAM CONSTANT IF THEN ELSIF ELSE CASE WHILE FOR BY DO REPEAT UNTIL EXIT RETURN "
    "AND OR XOR NOT MOD TRUE FALSE CONFIGURATION RESOURCE ON TASK WITH VAR_GLOBAL VAR_TEMP VAR_ACCESS AT RETAIN NON_RETAIN STEP TRANSITION "
    "ACTION FROM R_EDGE F_EDGE EN ENO".split())
KEYWORDS |= {f"END_{word}" for word in KEYWORDS}


def tokens_of(text, file):
    tokens, at, line = [], 0, 1
    while at < len(text):
        found, place = PATTERN.match(text, at), f"{file}:{line}"
        if not found:
            raise StError(place, f"{text[at:at + 10].splitlines()[0]!r}: nothing that this subset has")
        kind, value = found.lastgroup, found.group()
        if kind == "time":
            value = round(sum(float(count) * MICROSECONDS[unit] for count, unit in re.findall(r"([\d.]+)(ms|[smhd])", value.lower())))
        elif kind == "based":
            kind, value = "number", int(value[3:], 16)
        elif kind == "number":
            value = int(value)
        elif kind == "real":
            value = float(value)
        elif kind in ("word", "address"):
            value = value.upper()
        if kind not in ("blank", "comment"):
            tokens.append(Token(kind, value, place))
        line += found.group().count("\n")
        at = found.end()
    return tokens + [Token("end", "the end of the file", f"{file}:{line}")]


class Words:
    """The words of a file in order."""

    def __init__(self, text, file):
        self.tokens, self.at = tokens_of(text, file), 0

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

    def one(self, kind):
        """The value of a word of this kind."""
        if self.token.kind != kind or self.token.value in KEYWORDS:
            keyword = "a keyword; " if self.token.value in KEYWORDS else ""
            raise StError(self.token.place, f"{self.token.value}: {keyword}a {kind} should stand here")
        return self.next().value

    def listed(self, element, end=")"):
        """Elements up to `)` or another end."""
        found = [element()]
        while self.expect(",", end).value == ",":
            found.append(element())
        return found
