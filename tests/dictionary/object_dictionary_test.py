#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""cbcan_object_dictionary() in a project of its own, with files and folders of any name.

usage: object_dictionary_test.py CBCAN_EDS
"""

import pathlib
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests/support"))
import cases
from done import done, output_and_errors

PROGRAM = pathlib.Path(sys.argv.pop(1)).resolve()
EDS = "[2000]\nParameterName=A\nDataType=5\nAccessType=rw\nDefaultValue=1\n"


class ObjectDictionary(unittest.TestCase):
    def configure(self, file, generator, more="", space="x"):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        source = pathlib.Path(self.folder.name) / "with space(1)"
        source.mkdir()
        (source / file).write_text(EDS)
        (source / "x.cpp").write_text(f'#include "{space}.hpp"\nconst auto* used = &{space}::kDictionary;\n')
        (source / "CMakeLists.txt").write_text(
            "cmake_minimum_required(VERSION 3.21)\nproject(x LANGUAGES CXX)\nset(CMAKE_CXX_STANDARD 20)\n"
            f"include({ROOT}/cmake/object_dictionary.cmake)\nadd_library(x OBJECT x.cpp)\n"
            f"target_include_directories(x PRIVATE {ROOT}/firmware)\ncbcan_object_dictionary(x {file} {more})\n")
        self.build = source / "build"
        return ["cmake", "-S", source, "-B", self.build, "-G", generator, f"-DCBCAN_EDS={PROGRAM}"]

    def test_names_that_are_no_namespace_take_one(self):
        for generator in ("Ninja", "Unix Makefiles"):
            for file in ("my-device.eds", "drive.v2.eds"):
                with self.subTest(generator=generator, file=file):
                    done(*self.configure(file, generator, "NAME device", "device"))
                    done("cmake", "--build", self.build)

    def test_the_file_s_name_is_the_namespace(self):
        for generator in ("Ninja", "Unix Makefiles"):
            done(*self.configure("drive.eds", generator, space="drive"))
            done("cmake", "--build", self.build)

    def test_mistakes(self):
        for folder in ("/tmp", "/tmp/"):
            self.assertEqual(output_and_errors(PROGRAM, folder, code=2), f"cbcan-eds: {folder} is a folder; name an EDS or DCF file\n")
        done(*self.configure("drive.v2.eds", "Ninja"))
        self.assertIn("drive.v2: no name of a C++ namespace; write --name NAME",
                      output_and_errors("cmake", "--build", self.build, code=1))
        self.assertIn("device: write NAME and the header's name",
                      output_and_errors(*self.configure("drive.eds", "Ninja", "device"), code=1))


cases.main()
