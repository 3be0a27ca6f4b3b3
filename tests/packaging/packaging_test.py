#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""The library in PlatformIO, Zephyr and Arduino; and the example of docs/how-to/port.md.

None of these build systems is installed; each test does with the Cortex-M3 compiler what the build system does with the
manifest: its sources, its include paths and no others."""

import json
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests/support"))
import cases
from done import output as run

EXAMPLE = ROOT / "examples/minimal_port.cpp"
COMPILER = ["arm-none-eabi-g++", "-mcpu=cortex-m3", "-mthumb", "-fno-exceptions", "-fno-rtti", "-fno-threadsafe-statics", "-Os",
            "-Wall", "-Wextra", "-Werror", "-Wno-psabi"]


def compile_with(flags, sources, program):
    """Compiles the program; of the sources, which the images compile, only checks that their includes are found."""
    run(*COMPILER, *flags, "-fsyntax-only", program, cwd=ROOT)
    run(*COMPILER, *flags, "-M", *sources, cwd=ROOT)


def library_sources():
    """All files of a library, relative to firmware/."""
    return sorted(str(path.relative_to(ROOT / "firmware")) for path in (ROOT / "firmware/cbcan").rglob("*.cpp"))


def version():
    return re.search(r'kVersion = "([0-9.]+)"', (ROOT / "firmware/cbcan/version.hpp").read_text())[1]


class Packaging(unittest.TestCase):
    def test_versions_are_the_one_of_version_hpp(self):
        self.assertEqual(json.loads((ROOT / "library.json").read_text())["version"], version())
        self.assertIn(f"\nversion={version()}\n", (ROOT / "arduino/library.properties").read_text())

    def test_platformio(self):
        """PlatformIO: sources by srcFilter below srcDir; include paths are includeDir, srcDir and the -I of the flags, the
        same for the sketch that uses the library."""
        build = json.loads((ROOT / "library.json").read_text())["build"]
        sources = set()
        for rule in build["srcFilter"]:
            sign, pattern = re.fullmatch(r"([+-])<(.+)>", rule).groups()
            found = set((ROOT / build["srcDir"]).glob("**/*" if pattern == "*" else pattern + "**/*" if pattern.endswith("/") else pattern))
            sources = sources | found if sign == "+" else sources - found
        sources = {path for path in sources if path.suffix == ".cpp"}  # a folder: its sources
        self.assertEqual(sorted(str(path.relative_to(ROOT / "firmware")) for path in sources), library_sources())
        flags = [flag.replace("-I ", "-I") for flag in build["flags"]]
        compile_with([f"-I{build['includeDir']}", f"-I{build['srcDir']}", *flags], sorted(sources), EXAMPLE)

    def test_platformio_exports_what_it_builds(self):
        manifest = json.loads((ROOT / "library.json").read_text())
        exported = manifest["export"]["include"]
        for needed in ("firmware", "regmap/include", "library.json", "LICENSE"):
            self.assertIn(needed, exported)
        for path in exported:
            self.assertTrue((ROOT / path).exists(), path)

    def test_zephyr(self):
        module = (ROOT / "zephyr/module.yml").read_text()
        self.assertEqual(re.findall(r"^(?:name|  cmake|  kconfig): (.*)$", module, re.MULTILINE),
                         ["cbcan", "zephyr", "zephyr/Kconfig"])
        self.assertRegex((ROOT / "zephyr/Kconfig").read_text(), r"(?m)^config CBCAN$")
        listed = re.findall(r"\$\{cbcan\}/firmware/(\S+\.cpp)", (ROOT / "zephyr/CMakeLists.txt").read_text())
        self.assertEqual(sorted(listed), library_sources())
        with tempfile.TemporaryDirectory() as folder:
            run("cmake", "-S", ROOT / "tests/packaging/zephyr", "-B", folder, "-G", "Ninja",
                f"-DCMAKE_TOOLCHAIN_FILE={ROOT}/cmake/arm-none-eabi.cmake", "-DCMAKE_BUILD_TYPE=MinSizeRel")
            run("cmake", "--build", folder)
            defined = run("arm-none-eabi-nm", "-C", "--defined-only", pathlib.Path(folder) / "cbcan/libcbcan.a")
            self.assertIn("cbcan::Coprocessor::poll", defined)

    def test_arduino(self):
        """Arduino: everything below src/ is compiled, and src/ is the only include path."""
        with tempfile.TemporaryDirectory() as folder:
            library = pathlib.Path(run(ROOT / "tools/dev/arduino-library", "libraries", cwd=folder).strip())  # relative to the current folder
            self.assertEqual(library, pathlib.Path(folder) / "libraries/cbcan")
            sources = sorted((library / "src").rglob("*.cpp"))
            self.assertEqual([str(path.relative_to(library / "src")) for path in sources], library_sources())
            sketch = pathlib.Path(folder) / "sketch.cpp"
            sketch.write_text("#include <cbcan.h>\n" + EXAMPLE.read_text())
            compile_with([f"-I{library}/src", "-std=gnu++20"], sources, sketch)
            again = subprocess.run([ROOT / "tools/dev/arduino-library", f"{folder}/libraries"], capture_output=True, text=True)
            self.assertEqual((again.returncode, "is there already" in again.stderr), (1, True))

    def test_the_demo_is_configured_without_a_warning(self):
        command = re.search(r"cmake (--preset \S+ .*?) >", (ROOT / "tools/demo").read_text())[1]
        with tempfile.TemporaryDirectory() as folder:
            done = subprocess.run(["cmake", *command.split(), "-B", folder], cwd=ROOT, capture_output=True, text=True)
            self.assertEqual((done.returncode, done.stderr), (0, ""))

    def test_canopen_by_itself(self):
        """The folder and the headers that its page names, and no other file of ours."""
        page = (ROOT / "firmware/cbcan/canopen/README.md").read_text()
        example = ROOT / "examples/sdo_read.cpp"
        with tempfile.TemporaryDirectory() as folder:
            folder = pathlib.Path(folder)
            shutil.copytree(ROOT / "firmware/cbcan/canopen", folder / "cbcan/canopen")
            for header in re.findall(r"`(\w+\.hpp)`", page):
                shutil.copy(ROOT / "firmware/cbcan" / header, folder / "cbcan")
            run("c++", "-std=c++20", "-fno-exceptions", "-fno-rtti", "-Wall", "-Wextra", "-Werror", f"-I{folder}", example,
                *sorted((folder / "cbcan").rglob("*.cpp")), "-o", folder / "example")
            self.assertEqual(run(folder / "example"), "4 bytes: 91 01 0F 00\n")

    def test_the_example_has_under_100_lines(self):
        self.assertLess(len(EXAMPLE.read_text().splitlines()), 100)


cases.main()
