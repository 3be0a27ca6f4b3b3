# SPDX-License-Identifier: MIT
"""Checks a program and runs it: every name, type and argument beforehand, indices and ranges at run time."""

import math
import pathlib
import re

from .compiler import Compiler
from .lexer import StError
from .types import ELEMENTARY, Timer

STANDARD = pathlib.Path(__file__).resolve().parents[1].joinpath("standard.st").read_text("utf-8")


class Machine:
    """The programs of some files."""

    def __init__(self, *texts):
        """texts: (file name, text) pairs, each after those that it uses; the configuration is last."""
        self.types, self.blocks, self.enumerators = dict(ELEMENTARY), {"TON": Timer()}, {}
        self.global_types, self.globals, self.constants, self.externals = {}, {}, set(), []
        self.tasks, self.programs, self.intervals = {}, {}, {}  # microseconds; (block, variables) and microseconds by instance
        self.scans = 0
        for file, text in texts:
            Compiler(self, text, file).compile()
        for name, a_type, place in self.externals:
            if self.global_types.get(name) != a_type or name in self.constants:  # MATIEC and STruC++ differ on constants
                raise StError(place, f"{name}: no VAR_GLOBAL of this type in the CONFIGURATION; see configuration.st of tools/st")

    def block(self, name):
        """One that no file declares before it may be a standard one."""
        found = name not in self.blocks and re.search(rf"\nFUNCTION_BLOCK {name}\n.*?END_FUNCTION_BLOCK", STANDARD, re.DOTALL)
        if found:
            Compiler(self, found[0], "standard.st").compile()
        return self.blocks.get(name)

    @property
    def interval(self):
        """Microseconds between two scans; a task may take part in every n-th."""
        return math.gcd(*self.intervals.values())

    def due(self):
        """The programs of the next scan, in the order of the configuration."""
        passed, self.scans = self.scans * self.interval, self.scans + 1
        return [instance for instance in self.programs if passed % self.intervals[instance] == 0]

    def scan(self, now):
        """now: microseconds"""
        for block, values in map(self.programs.get, self.due()):
            block.run(values, now)
