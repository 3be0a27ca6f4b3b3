#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""examples/consumer, a project that uses the libraries, in three ways and with each installed compiler; and pkg-config.

usage: consumer_test.py BUILD_DIR SIMULATOR
"""

import itertools
import pathlib
import re
import shutil
import tempfile

import cases
from done import output_and_errors as run, ran
from simulator import Simulator, program_from_arguments
from tree import ROOT

BUILD, SIMULATOR = program_from_arguments(2)
COMPILERS = ["g++-12", "clang++-14"]
NEWER = [name for name in ("g++-13", "g++-14", "clang++-16", "clang++-19") if shutil.which(name)]
PROFILES = ROOT / "firmware/boards/profiles"
CCACHE = ["-DCMAKE_CXX_COMPILER_LAUNCHER=ccache"] if shutil.which("ccache") else []
PRINTED = {
    "with_canopen": "4 bytes: 91 01 0F 00\n",
    "with_core": "result 0, node ID 5\n",
    "with_rtu": "register 100 is 7\n",
    "with_station": "\n\n\nC\nS6\nO\nt705100\n",
    "with_window": "cbcan pressure transducer\n",
    "with_cia405": "cbcan pressure transducer\n",
    "with_sim": "result 4, abort code 05040000h after 1000 ms\n",
}


class Consumer(cases.Case):
    @classmethod
    def setUpClass(cls):
        cls.shared = cls.enterClassContext(tempfile.TemporaryDirectory())
        cls.prefix = pathlib.Path(cls.shared) / "installed"
        run("cmake", "--install", BUILD, "--prefix", cls.prefix)

    def new_folder(self):
        return pathlib.Path(tempfile.mkdtemp(dir=self.shared))

    def project(self, text):
        """The folder of a project that uses cbcan like this."""
        folder = self.new_folder()
        (folder / "CMakeLists.txt").write_text(f"cmake_minimum_required(VERSION 3.21)\nproject(theirs CXX)\n{text}\n")
        return folder

    def configure(self, *options, source=ROOT / "examples/consumer", code=0):
        build = self.new_folder()
        return build, run("cmake", "-S", source, "-B", build, "-G", "Ninja", *CCACHE, *options, code=code)

    def build_and_run(self, *options, compilers, sim_with=COMPILERS + NEWER):
        for compiler in compilers:
            programs = {name: text for name, text in PRINTED.items() if name != "with_sim" or compiler in sim_with}
            with self.subTest(compiler=compiler), Simulator(SIMULATOR, "--demo") as simulator:
                build, _ = self.configure(f"-DCMAKE_CXX_COMPILER={compiler}", *options)
                run("cmake", "--build", build, "--target", *programs)
                self.assertEqual({name: run(f"{build}/{name}", simulator.port) for name in programs}, programs)
                self.assertNotIn("cbcan-sim", run("cmake", "--build", build, "--target", "help"))

    def test_find_package(self):
        self.build_and_run("-DHOW=find_package", f"-DCMAKE_PREFIX_PATH={self.prefix}", compilers=COMPILERS + NEWER)
        print("figure: examples/consumer was compiled with " + ", ".join(COMPILERS + NEWER))

    def test_from_sources(self):
        """With each compiler and in both ways; cbcan::sim, which takes a minute, once for each."""
        self.build_and_run("-DHOW=FetchContent", f"-DFETCHCONTENT_SOURCE_DIR_CBCAN={ROOT}", compilers=COMPILERS, sim_with=["clang++-14"])
        self.build_and_run("-DHOW=add_subdirectory", compilers=COMPILERS, sim_with=["g++-12"])

    def find(self, components, *hidden, code=0):
        """CMake's output for find_package() if these packages are missing, and the targets that exist then."""
        source = self.project(f"find_package(cbcan REQUIRED {components})\nforeach(name canopen core rtu slcan window cia405 sim)\n"
                              "  if(TARGET cbcan::${name})\n    message(STATUS \"has ${name}.\")\n  endif()\nendforeach()")
        said = self.configure(f"-DCMAKE_PREFIX_PATH={self.prefix}", *(f"-DCMAKE_DISABLE_FIND_PACKAGE_{name}=ON" for name in hidden),
                              source=source, code=code)[1]
        return " ".join(said.split())

    def test_each_target_needs_only_its_own_libraries(self):
        self.assertIn("has core.", self.find("COMPONENTS core", "PkgConfig"))
        without = self.find("", "PkgConfig")
        self.assertIn("has slcan.", without)
        for name in ("window", "cia405", "sim"):
            self.assertNotIn(f"has {name}.", without)
        self.assertIn("cbcan::window is not there; it needs pkg-config and libmodbus", self.find("COMPONENTS window", "PkgConfig", code=1))
        without = self.find("", "fmt")
        self.assertIn("has cia405.", without)
        self.assertNotIn("has sim.", without)
        self.assertIn("cbcan::sim is not there; it needs fmt, tomlplusplus, pkg-config and Lua 5.4", self.find("COMPONENTS sim", "tomlplusplus", code=1))

    def test_what_does_not_exist(self):
        self.assertIn("the components are canopen, core, rtu", self.find("COMPONENTS sdo", code=1))

    def test_warnings_are_errors_at_home_alone(self):
        """A careless line in our sources is a warning to others and an error to us."""
        sources = self.folder / "sources"
        shutil.copytree(ROOT, sources, ignore=shutil.ignore_patterns("build", ".git", "tests", "docs"))
        with (sources / "firmware/cbcan/slcan/slcan.cpp").open("a") as source:
            source.write("char careless(int number) { return number; }\n")
        build, _ = self.configure("-DHOW=FetchContent", f"-DFETCHCONTENT_SOURCE_DIR_CBCAN={sources}")
        self.assertIn("[-Wconversion]", run("cmake", "--build", build, "--target", "cbcan_slcan"))
        build, _ = self.configure("-DCBCAN_HOST=OFF", source=sources)
        self.assertIn("[-Werror=conversion]", run("cmake", "--build", build, "--target", "cbcan_slcan", code=1))

    def test_nothing_else_is_built(self):
        """A project that links cbcan::canopen compiles its sources and no others."""
        source = self.project(f"add_subdirectory({ROOT} cbcan)\nadd_executable(theirs sdo_read.cpp)\ntarget_link_libraries(theirs cbcan::canopen)")
        shutil.copy(ROOT / "examples/sdo_read.cpp", source)
        build, _ = self.configure(source=source)
        compiled = re.findall(r" -c (\S+\.cpp)", run("ninja", "-C", build, "-t", "commands"))
        self.assertEqual(set(compiled), {str(path) for path in [*(ROOT / "firmware/cbcan/canopen").rglob("*.cpp"), source / "sdo_read.cpp"]})

    def test_another_configuration_does_not_link(self):
        """Whatever the program begins with: a coprocessor, a slave, a dictionary, an SDO client."""
        programs = {
            "Coprocessor": (ROOT / "examples/consumer/core.cpp").read_text(),
            "SdoClient": (ROOT / "examples/sdo_read.cpp").read_text(),
            "Slave": '#include "cbcan/canopen/slave.hpp"\nusing namespace cbcan;\nint main(int count, char** words) { '
                     "if (count > 1) new Slave(1, {}, {}, *reinterpret_cast<Application*>(words), *reinterpret_cast<CanPort*>(words)); }\n",
            "ObjectDictionary": '#include "cbcan/canopen/dictionary/object_dictionary.hpp"\n'
                                "int main() { cbcan::ObjectDictionary({}, {}, nullptr); }\n"}
        for (name, text), compiler in itertools.product(programs.items(), COMPILERS):
            with self.subTest(program=name, compiler=compiler):
                source = self.write(f"{name}.cpp", text)
                link = [compiler, "-std=c++20", source, f"-I{self.prefix}/include", f"-L{self.prefix}/lib", "-lcbcan_core", "-lcbcan_canopen",
                        "-ffunction-sections", "-Wl,--gc-sections", "-o", self.folder / name]
                run(*link)
                for profile in ("everything", "process_data"):
                    refused = run(*link, f"-iquote{PROFILES / profile}", code=1)
                    self.assertRegex(refused, rf"undefined reference to `cbcan::{name}::[^\n]*Services\{{")

    def test_configuration(self):
        """CBCAN_CONFIGURATION reaches the libraries and those who link them, from sources and from an installation."""
        profile = PROFILES / "process_data"
        program = '#include "cbcan/configuration.hpp"\nstatic_assert(!cbcan::kServices.sdo_server);\n' + (ROOT / "examples/consumer/core.cpp").read_text()
        for how in (f"set(CBCAN_CONFIGURATION relative)\nadd_subdirectory({ROOT} cbcan)", "find_package(cbcan REQUIRED COMPONENTS core rtu)"):
            source = self.project(f"{how}\nadd_executable(theirs program.cpp)\ntarget_link_libraries(theirs cbcan::rtu cbcan::core)")
            (source / "relative").symlink_to(profile)
            (source / "program.cpp").write_text(program)
            prefix = source / "installed"
            if how.startswith("find"):
                whole, _ = self.configure(f"-DCBCAN_CONFIGURATION={profile}", source=ROOT)
                run("cmake", "--build", whole)
                run("cmake", "--install", whole, "--prefix", prefix)
                self.assertIn("an installation has its own configuration",
                              " ".join(self.configure(f"-DCMAKE_PREFIX_PATH={prefix}", f"-DCBCAN_CONFIGURATION={profile}", source=source, code=1)[1].split()))
            build, _ = self.configure(f"-DCMAKE_PREFIX_PATH={prefix}", source=source)
            run("cmake", "--build", build)
            self.assertEqual(run(f"{build}/theirs"), PRINTED["with_core"])
        self.assertIn("there is no /nowhere/cbcan/configuration.hpp", self.configure("-DCBCAN_CONFIGURATION=/nowhere", source=ROOT, code=1)[1])

    def test_pkg_config(self):
        found = ran("pkg-config", "--cflags", "--libs", "cbcan-cia405", env={"PATH": "/usr/bin", "PKG_CONFIG_PATH": f"{self.prefix}/lib/pkgconfig"})
        self.assertEqual(found.stderr, "")
        program = self.folder / "read_name"
        run("c++", ROOT / "examples/read_name.cpp", *found.stdout.split(), "-o", program)
        with Simulator(SIMULATOR, "--demo") as simulator:
            self.assertEqual(run(program, simulator.port), "cbcan pressure transducer\n")


cases.main()
