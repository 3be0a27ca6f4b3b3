#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""The C++ blocks alone: this project as a subfolder of another project, with every package hidden but pkg-config, which finds libmodbus.

usage: subproject_test.py SIMULATOR
"""

import re

import cases
from done import output, output_and_errors
from simulator import LIMIT, Simulator, program_from_arguments
from tree import ROOT

SIMULATOR = program_from_arguments()
PROJECT = f"""cmake_minimum_required(VERSION 3.21)
project(theirs CXX)
add_subdirectory({ROOT} cbcan)
add_executable(read_name {ROOT}/examples/read_name.cpp)
target_link_libraries(read_name PRIVATE cbcan::cia405)
"""


def packages():
    """Every other package that one of our CMakeLists.txt looks for."""
    text = "".join(path.read_text() for path in (ROOT / "CMakeLists.txt", *ROOT.glob("*/**/CMakeLists.txt")))
    found = set(re.findall(r"find_package\((\w+)", text)) | {"fmt", "tomlplusplus"}
    assert {"nlohmann_json", "PkgConfig", "Catch2"} <= found, found
    return found - {"PkgConfig"}


class Subproject(cases.Case):
    def test_libmodbus_is_all_that_it_takes(self):
        self.write("CMakeLists.txt", PROJECT)
        build = self.folder / "build"
        output("cmake", "-S", self.folder, "-B", build, "-G", "Ninja", *(f"-DCMAKE_DISABLE_FIND_PACKAGE_{name}=ON" for name in packages()))
        targets = output("cmake", "--build", build, "--target", "help")
        self.assertNotIn("cbcan-sim", targets)
        self.assertNotIn("_test", targets)
        output("cmake", "--build", build, "--target", "read_name")
        with Simulator(SIMULATOR, "--demo") as simulator:
            self.assertEqual(output_and_errors(build / "read_name", simulator.port, timeout=LIMIT), "cbcan pressure transducer\n")


cases.main()
