#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""gcc and clang order arguments differently: the same 3000 random networks have the same frames at the same times."""

import os
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))
from support import cases
from support.done import done, output

ROOT = Path(__file__).parents[2]


def digest(program):
    lines = output(program, "3000 random*").splitlines()
    return [line for line in lines if line.startswith("digest ")]


class Compilers(cases.Case):
    def test_the_frames_are_those_of_the_other_compiler(self):
        done("cmake", "-S", ROOT, "-B", self.folder, "-G", "Ninja", "-DCBCAN_TESTS=ON", "-DCMAKE_BUILD_TYPE=Release", f"-DCMAKE_CXX_COMPILER={OTHER}")
        done("cmake", "--build", self.folder, "--target", "sim_network_test")
        other = digest(f"{self.folder}/tests/sim/sim_network_test")
        self.assertEqual(len(other), 1)
        self.assertEqual(digest(PROGRAM), other)


if __name__ == "__main__":
    PROGRAM, OTHER = os.path.abspath(sys.argv.pop(1)), sys.argv.pop(1)
    cases.main()
