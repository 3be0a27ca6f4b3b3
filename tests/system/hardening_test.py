#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Programs of a release: the linker's tables are read-only, the stack and the calls of the C library are checked."""

import cases
from done import output
from simulator import program_from_arguments

PROGRAMS = program_from_arguments(2)


class Release(cases.Case):
    def test_tables_of_the_linker(self):
        for program in PROGRAMS:
            self.assertIn("GNU_RELRO", output("readelf", "--wide", "--program-headers", program))
            self.assertRegex(output("readelf", "--wide", "--dynamic", program), r"\(FLAGS_1\) .*\bNOW\b")

    def test_stack_and_c_library(self):
        for program in PROGRAMS:
            self.assertIn(" __stack_chk_fail@", output("readelf", "--wide", "--dyn-syms", program))
        self.assertRegex(output("readelf", "--wide", "--dyn-syms", PROGRAMS[0]), r" __(?!stack)\w+_chk@")  # the other one has no checked call


cases.main()
