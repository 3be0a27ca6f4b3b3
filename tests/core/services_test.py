#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""firmware/cbcan/services.hpp: the portable firmware with each switch off alone, and programs that a set of services does not allow.

All sources of a build are one translation unit, so anonymous names differ. With CBCAN_LONG both compilers make a program of it.
"""

import os
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest
from concurrent.futures import ThreadPoolExecutor

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests/support"))
import cases

FIRMWARE = ROOT / "firmware"
SOURCES = [path for room in ("canopen", "coprocessor", "slcan") for path in sorted((FIRMWARE / "cbcan" / room).rglob("*.cpp"))]
SOURCES += [FIRMWARE / "boards/common" / f"{name}.cpp" for name in ("parameter_store", "record_log", "slcan_port", "station")]
FLAGS = ["-std=c++20", "-Wall", "-Wextra", "-Werror"]


def switches():
    """Everything that can be left out, as services.hpp says."""
    text = (FIRMWARE / "cbcan/services.hpp").read_text()
    alone = [f".{name} = false" for name in re.findall(r"^  bool (\w+) = true;", text, re.MULTILINE)]
    return alone + [".rpdos = 0", ".tpdos = 0", ".rpdos = 0, .tpdos = 0", ".manager_clients = 0"]


class Services(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def compile(self, services, text, *options, compiler="clang++-14"):
        """What the compiler says of this program with these services; "" = nothing."""
        place = pathlib.Path(tempfile.mkdtemp(dir=self.folder))
        (place / "cbcan").mkdir()
        (place / "cbcan/configuration.hpp").write_text(
            f'#pragma once\n#include "cbcan/services.hpp"\nnamespace cbcan {{ inline constexpr Services kServices{{{services}}}; }}\n')
        (place / "program.cpp").write_text(text)
        return subprocess.run([compiler, *FLAGS, f"-I{place}", f"-I{FIRMWARE}", f"-I{ROOT}/regmap/include", *(options or ["-fsyntax-only"]),
                               place / "program.cpp"], capture_output=True, text=True).stderr

    def test_each_switch_alone(self):
        everything = "".join(f'#include "{path}"\n' for path in SOURCES) + "int main() {}\n"
        builds = [("clang++-14", [])]
        if "CBCAN_LONG" in os.environ:
            builds = [(compiler, ["-O1", "-o", "/dev/null"]) for compiler in ("clang++-14", "g++-12")]
        self.assertGreaterEqual(len(switches()), 13)
        jobs = [(services, *build) for services in switches() for build in builds]
        with ThreadPoolExecutor(2) as pool:
            said = pool.map(lambda job: self.compile(job[0], everything, *job[2], compiler=job[1]), jobs)
            for job, errors in zip(jobs, said):
                with self.subTest(services=job[0], compiler=job[1]):
                    self.assertEqual(errors, "")


if __name__ == "__main__":
    cases.main()
