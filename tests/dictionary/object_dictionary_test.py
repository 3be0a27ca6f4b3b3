#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""cbcan_object_dictionary() and cbcan_network_header() in a project of its own, with files and folders of any name.

usage: object_dictionary_test.py CBCAN_EDS CBCAN_NETWORK
"""

import os
import pathlib
import re
import shutil
import tempfile

import cases
from done import done, output, output_and_errors, ran
from simulator import program_from_arguments
from tree import ROOT

PROGRAM, NETWORK = map(pathlib.Path, program_from_arguments(2))
EDS = "[2000]\nParameterName=A\nDataType=5\nAccessType=rw\nDefaultValue=1\n"


class ObjectDictionary(cases.Case):
    def configure(self, file, generator, more="", space="x"):
        source = pathlib.Path(tempfile.mkdtemp(dir=self.folder)) / "with space(1)"
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
            self.assertEqual(output_and_errors(PROGRAM, folder, code=2), f"cbcan-eds: {folder}: this is a folder; name a file in it\n")
        for words, error in ((("--nmae", "x", "y.eds"), "--nmae: no such option; did you mean --name?; see cbcan-eds --help"),
                             (("--name",), "--name: needs an argument, NAME; see cbcan-eds --help"),
                             (("x.eds", "y.eds"), "y.eds: one word too many; usage: cbcan-eds [OPTION...] FILE; see cbcan-eds --help")):
            self.assertEqual(output_and_errors(PROGRAM, *words, code=2), f"cbcan-eds: {error}\n")
        done(*self.configure("drive.v2.eds", "Ninja"))
        self.assertIn("drive.v2: no name of a C++ namespace; write --name NAME", output_and_errors("cmake", "--build", self.build, code=1))
        self.assertIn("device: write NAME and the header's name", output_and_errors(*self.configure("drive.eds", "Ninja", "device"), code=1))

    def test_macros(self):
        """What a compiler defines before it reads a line is refused; any other macro is named by the header itself."""
        compilers = [name for name in ("g++", "clang++-14", "arm-none-eabi-g++") if shutil.which(name)]
        macros = {line.split()[1].partition("(")[0] for compiler in compilers
                  for line in output(compiler, "-std=gnu++20", "-dM", "-E", "-x", "c++", "/dev/null").splitlines()}
        self.assertGreater(len(macros), 300)
        file = self.write("x.eds", EDS)
        reserved = re.compile("_[A-Z]|.*__")  # tests/descriptions has three of these
        for name in ["__arm__", *(name for name in sorted(macros) if not reserved.match(name))]:
            self.assertEqual(output_and_errors(PROGRAM, "--name", name, file, code=2),
                             f"cbcan-eds: {name}: no name of a C++ namespace; write --name NAME\n")
        for name, error in (("INT8_MAX", "INT8_MAX is a macro here: write cbcan-eds --name NAME"), ("CAN1", "CAN1 is a macro here"), ("drive", "")):
            header = self.write("made.hpp", output(PROGRAM, "--name", name, file))
            made = ran("g++", "-std=c++20", "-fsyntax-only", "-DCAN1=((CAN_TypeDef*)1)", f"-I{ROOT}/firmware", "-x", "c++", header)
            self.assertEqual((made.returncode == 0, error in made.stderr), (error == "", True), made.stderr)

    def test_messages_have_no_control_characters(self):
        for program in (PROGRAM, PROGRAM.with_name("cbcan-network")):
            for words in (["/no\x1b[31m"], ["--no\x1b]0;\a"], ["a\nb\x7f"], ["--own-node", "\x1b1"]):
                said = output_and_errors(program, *words, code=2)
                self.assertEqual([c for c in said[:-1] if not c.isprintable()], [], said)
        network = self.write("n.toml", '[[node]]\nid = 5\neds = "\\u001b[31m.eds"\n')
        said = output_and_errors(PROGRAM.with_name("cbcan-network"), network, code=2)
        self.assertIn(" [31m.eds: cannot be read", said)

    def test_a_network_header_follows_the_files_of_its_nodes(self):
        for generator in ("Ninja", "Unix Makefiles"):
            with self.subTest(generator=generator):
                configure = self.configure("x.eds", generator)
                source = self.build.parent
                (source / "net.toml").write_text('[[node]]\nid = 5\neds = "a b.eds"\n[[node]]\nid = 6\ndcf = "c.dcf"\n')
                (source / "a b.eds").write_text(EDS)
                (source / "c.dcf").write_text("[DeviceComissioning]\nNodeID=6\n" + EDS + "ParameterValue=7\n")
                with (source / "CMakeLists.txt").open("a") as lists:
                    lists.write("cbcan_network_header(x net.toml)\n")
                done(*configure, f"-DCBCAN_NETWORK={NETWORK}")
                done("cmake", "--build", self.build)
                header = self.build / "x_made/net.hpp"
                for name, old, new in (("a b.eds", "[2000]", "[1000]\nParameterName=T\nDataType=7\nAccessType=ro\nDefaultValue=8\n[2000]"),
                                       ("c.dcf", "ParameterValue=7", "ParameterValue=9")):
                    before, made = header.read_text(), header.stat().st_mtime_ns
                    (source / name).write_text((source / name).read_text().replace(old, new))
                    os.utime(source / name, ns=(made + 1, made + 1))
                    done("cmake", "--build", self.build)
                    self.assertNotEqual(header.read_text(), before)
                    made = header.stat().st_mtime_ns
                    done("cmake", "--build", self.build)
                    self.assertEqual(header.stat().st_mtime_ns, made)

    def test_depfile(self):
        self.assertEqual(output_and_errors(NETWORK, "--depfile", "/nowhere/x.hpp.d", ROOT / "plants/demo/network.toml", code=2),
                         "cbcan-network: /nowhere/x.hpp.d: cannot be written\n")


cases.main()
