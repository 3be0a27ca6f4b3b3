#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Programs of a release: the linker's tables are read-only, the stack and the calls of the C library are checked."""

import subprocess

import cases
from simulator import program_from_arguments

PROGRAMS = program_from_arguments(2)


def readelf(option, program):
    return subprocess.run(["readelf", "--wide", option, program], capture_output=True, text=True, check=True).stdout


class Release(cases.Case):
    def test_tables_of_the_linker(self):
        for program in PROGRAMS:
            self.assertIn("GNU_RELRO", readelf("--program-headers", program))
            self.assertRegex(readelf("--dynamic", program), r"\(FLAGS_1\) .*\bNOW\b")

    def test_stack_and_c_library(self):
        for program in PROGRAMS:
            self.assertIn(" __stack_chk_fail@", readelf("--dyn-syms", program))
        self.assertRegex(readelf("--dyn-syms", PROGRAMS[0]), r" __(?!stack)\w+_chk@")  # the other one has no checked call


cases.main()
