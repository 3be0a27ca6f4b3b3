#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""The C++ blocks alone: this project as a subfolder of another project, with every package hidden but pkg-config, which finds libmodbus.

usage: subproject_test.py SIMULATOR
"""

import pathlib
import re
import subprocess
import tempfile

import cases
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
        with tempfile.TemporaryDirectory() as folder, Simulator(SIMULATOR, "--demo") as simulator:
            (pathlib.Path(folder) / "CMakeLists.txt").write_text(PROJECT)
            hidden = [f"-DCMAKE_DISABLE_FIND_PACKAGE_{name}=ON" for name in packages()]
            subprocess.run(["cmake", "-S", folder, "-B", f"{folder}/build", "-G", "Ninja", *hidden], check=True, stdout=subprocess.DEVNULL)
            targets = subprocess.run(["cmake", "--build", f"{folder}/build", "--target", "help"], check=True, capture_output=True, text=True)
            self.assertNotIn("cbcan-sim", targets.stdout)
            self.assertNotIn("_test", targets.stdout)
            subprocess.run(["cmake", "--build", f"{folder}/build", "--target", "read_name"], check=True, stdout=subprocess.DEVNULL)
            done = subprocess.run([f"{folder}/build/read_name", str(simulator.port)], capture_output=True, text=True, timeout=LIMIT)
        self.assertEqual((done.stdout, done.stderr), ("cbcan pressure transducer\n", ""))


cases.main()
