# SPDX-License-Identifier: MIT
"""Checks a program and runs it: every name, type and argument beforehand, indices and ranges at run time."""

from st_compiler import Compiler
from st_lexer import StError
from st_types import ELEMENTARY, Timer


class Machine:
    """The programs of some files."""

    def __init__(self, *texts):
        """texts: (file name, text) pairs, each after those that it uses; the configuration is last."""
        self.types, self.blocks, self.enumerators = dict(ELEMENTARY), {"TON": Timer()}, {}
        self.global_types, self.globals, self.constants, self.externals = {}, {}, set(), []
        self.programs = {}
        for file, text in texts:
            Compiler(self, text, file).compile()
        for name, a_type, place in self.externals:
            if self.global_types.get(name) != a_type or name in self.constants:  # MATIEC and STruC++ differ on constants
                raise StError(place, f"{name}: no VAR_GLOBAL of this type")

    def scan(self, now):
        """now: microseconds"""
        for block, values in self.programs.values():
            block.run(values, now)
