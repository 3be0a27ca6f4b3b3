#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""The library in PlatformIO, Zephyr and Arduino; and the example of docs/how-to/port.md.

usage: packaging_test.py CBCAN_EDS

None of these build systems is installed; each test does with the Cortex-M3 compiler what the build system does with the
manifest: its sources, its include paths and no others."""

import json
import os
import pathlib
import re
import shutil

import cases
from done import done, output as run
from simulator import program_from_arguments
from tree import ROOT

CBCAN_EDS = program_from_arguments()
PORTING = (ROOT / "docs/how-to/port.md").read_text()
EXAMPLE = ROOT / "examples/minimal_port.cpp"
COMPILER = ["arm-none-eabi-g++", "-mcpu=cortex-m3", "-mthumb", "-fno-exceptions", "-fno-rtti", "-fno-threadsafe-statics", "-Os",
            "-Wall", "-Wextra", "-Werror", "-Wno-psabi"]


ARDUINO_H = """#pragma once
#include <stddef.h>
#include <stdint.h>
#define HIGH 1
#define LOW 0
#define INPUT 0
#define OUTPUT 1
#define DEFAULT 1
#define SERIAL 0
#define PI 3.14
#define bit(b) (1UL << (b))
#define lowByte(w) ((uint8_t)((w) & 0xff))
#define sq(x) ((x) * (x))
#define constrain(x, low, high) ((x) < (low) ? (low) : (x))
#define word(...) makeWord(__VA_ARGS__)
typedef uint8_t byte;
unsigned long micros();
void interrupts();
void noInterrupts();
void pinMode(int pin, int mode);
void digitalWrite(int pin, int level);
"""
SPI_H = """#pragma once
enum BitOrder { LSBFIRST, MSBFIRST };
enum SPIMode { SPI_MODE0 };
struct SPISettings { SPISettings(uint32_t clock, BitOrder, SPIMode); };
struct HardwareSPI { void begin(); void beginTransaction(SPISettings); void endTransaction(); void transfer(void* bytes, size_t count); };
extern HardwareSPI SPI;
"""
FLASH_H = """#pragma once
#define FLASH_PAGE_SIZE (1u << 8)
#define FLASH_SECTOR_SIZE (1u << 12)
#define XIP_BASE 0x10000000
extern "C" void flash_range_erase(uint32_t offset, size_t count);
extern "C" void flash_range_program(uint32_t offset, const uint8_t* data, size_t count);
"""
PROFILE = ROOT / "firmware/boards/profiles/process_data"


def compile_with(flags, sources, program):
    """Compiles the program; of the sources, which the images compile, only checks that their includes are found. Returns all files read."""
    run(*COMPILER, *flags, "-fsyntax-only", program, cwd=ROOT)
    return run(*COMPILER, *flags, "-M", *sources, program, cwd=ROOT)


def configurations(files):
    """The folders of those cbcan/configuration.hpp that these files, as -M prints them, include."""
    return {str((ROOT / path).resolve().parents[1]) for path in re.findall(r"(\S*cbcan/configuration\.hpp)", files)}


def library_sources():
    """All files of a library, relative to firmware/: the stack, and cbcan::station."""
    of_station = re.search(r"cbcan_station station\s+(.*?)\s+LIBS", (ROOT / "firmware/CMakeLists.txt").read_text(), re.DOTALL)[1].split()
    return sorted([*of_station, *(str(path.relative_to(ROOT / "firmware")) for path in (ROOT / "firmware/cbcan").rglob("*.cpp"))])


def version():
    return re.search(r'kVersion = "([0-9.]+)"', (ROOT / "firmware/cbcan/version.hpp").read_text())[1]


class Packaging(cases.Case):
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
        flags = [f"-I{build['includeDir']}", f"-I{build['srcDir']}", *flags]
        compile_with(flags, sorted(sources), EXAMPLE)
        # build_flags of a project come after the include paths of the library.
        self.assertIn("`build_flags = -std=gnu++20 -iquote", PORTING)
        self.assertEqual(configurations(compile_with([*flags, f"-iquote{PROFILE}"], sorted(sources), EXAMPLE)), {str(PROFILE)})

    def test_platformio_exports_what_it_builds(self):
        manifest = json.loads((ROOT / "library.json").read_text())
        exported = manifest["export"]["include"]
        for needed in ("firmware", "regmap/include", "library.json", "LICENSE"):
            self.assertIn(needed, exported)
        for path in exported:
            self.assertTrue((ROOT / path).exists(), path)

    def test_zephyr(self):
        module = (ROOT / "zephyr/module.yml").read_text()
        self.assertEqual(re.findall(r"^(?:name|  cmake|  kconfig): (.*)$", module, re.MULTILINE), ["cbcan", "zephyr", "zephyr/Kconfig"])
        self.assertRegex((ROOT / "zephyr/Kconfig").read_text(), r"(?m)^config CBCAN$")
        kconfig = (ROOT / "zephyr/Kconfig").read_text()
        self.assertRegex(kconfig, r"(?m)^config CBCAN_CONFIGURATION$")
        self.assertNotIn("select", kconfig)  # of the C++ library only headers
        for option in re.findall(r"`CONFIG_(CBCAN\w*)=", PORTING):
            self.assertRegex(kconfig, rf"(?m)^config {option}$")
        run("cmake", "-S", ROOT / "tests/packaging/zephyr", "-B", self.folder, "-G", "Ninja", f"-DPROFILE={PROFILE}",
            f"-DCMAKE_TOOLCHAIN_FILE={ROOT}/cmake/arm-none-eabi.cmake", "-DCMAKE_BUILD_TYPE=Debug")
        run("cmake", "--build", self.folder)
        self.assertEqual(configurations(run("ninja", "-C", self.folder, "-t", "deps")), {str(PROFILE)})
        library = self.folder / "cbcan/libcbcan.a"
        self.assertEqual(sorted(run("arm-none-eabi-ar", "t", library).split()), sorted(f"{pathlib.Path(path).name}.obj" for path in library_sources()))
        defined = run("arm-none-eabi-nm", "-C", "--defined-only", library)
        self.assertIn("cbcan::Coprocessor::poll", defined)

    def test_arduino(self):
        """Arduino: everything below src/ is compiled, and src/ is the only include path."""
        library = pathlib.Path(run(ROOT / "tools/dev/arduino-library", "libraries", cwd=self.folder).strip())  # relative to the current folder
        self.assertEqual(library, self.folder / "libraries/cbcan")
        sources = sorted((library / "src").rglob("*.cpp"))
        self.assertEqual([str(path.relative_to(library / "src")) for path in sources], library_sources())
        compile_with([f"-I{library}/src", "-std=gnu++20"], sources, self.write("sketch.cpp", "#include <cbcan.h>\n" + EXAMPLE.read_text()))
        self.assertIn("is there already", done(ROOT / "tools/dev/arduino-library", f"{self.folder}/libraries", code=1).stderr)
        wrong = done(ROOT / "tools/dev/arduino-library", "wrong", ".", cwd=self.folder, code=2)
        self.assertEqual(wrong.stderr.partition(";")[0], f"arduino-library: there is no {self.folder}/cbcan/configuration.hpp")
        self.assertFalse((self.folder / "wrong").exists())
        own = pathlib.Path(run(ROOT / "tools/dev/arduino-library", "own", os.path.relpath(PROFILE, self.folder), cwd=self.folder).strip())
        self.assertEqual((own / "src/cbcan/configuration.hpp").read_text(), (PROFILE / "cbcan/configuration.hpp").read_text())

    def test_arduino_sketch(self):
        """The sketch with the names and macros of Arduino's headers that it and the library meet. The core itself is in no distribution."""
        library = pathlib.Path(run(ROOT / "tools/dev/arduino-library", self.folder).strip())
        sketch = library / "examples/slave"
        made = re.search(r"//   cbcan-eds (.*)", (sketch / "slave.ino").read_text())[1]
        run(CBCAN_EDS, *made.split(), cwd=sketch)
        (sketch / "hardware").mkdir()
        (sketch / "hardware/flash.h").write_text(FLASH_H)
        (sketch / "Arduino.h").write_text(ARDUINO_H)
        (sketch / "SPI.h").write_text(SPI_H)
        (sketch / "sketch.cpp").write_text(f"#include <Arduino.h>\n{(sketch / 'slave.ino').read_text()}")
        flags = ["-mcpu=cortex-m0plus", "-std=gnu++17", "-std=gnu++20", f"-I{library}/src", f"-I{sketch}"]
        run(*COMPILER, *flags, "-c", sketch / "sketch.cpp", "-o", self.folder / "sketch.o")
        self.assertIn("T setup", run("arm-none-eabi-nm", "-C", self.folder / "sketch.o"))

    def test_a_store_needs_no_coprocessor(self):
        for name in ("parameter_store", "record_log"):
            run(*COMPILER, "-std=c++20", f"-I{ROOT}/firmware", f"-I{ROOT}/regmap/include", "-c", ROOT / f"firmware/boards/common/{name}.cpp", "-o",
                self.folder / "store.o")
            needed = run("arm-none-eabi-nm", "-uC", self.folder / "store.o")
            self.assertEqual([symbol for symbol in re.findall(r"U (\S+)", needed) if re.search("Coprocessor|local::|regmap", symbol)], [], name)

    def test_riscv(self):
        """What the Modbus server needs on a RV32 without compare-and-swap of a byte is in the file that its page names."""
        name, = re.findall(r"`(firmware/boards/common/exchange\.cpp)`", PORTING)
        # The distribution's compiler is Linux's for RV64: its headers lack two things that no program needs.
        (self.folder / "gnu").mkdir()
        (self.folder / "gnu/stubs-ilp32.h").touch()
        compiler = ["riscv64-linux-gnu-g++", "-march=rv32imac_zicsr", "-mabi=ilp32", "-DSYS_futex=0", f"-I{self.folder}", "-ffreestanding", "-std=c++20",
                    "-Os", "-fno-exceptions", "-Wall", "-Wextra", "-Werror", f"-I{ROOT}/firmware", f"-I{ROOT}/regmap/include", "-c"]
        run(*compiler, ROOT / name, "-o", self.folder / "exchange.o")
        needed = set()
        for path in (ROOT / "firmware/cbcan/modbus").glob("*.cpp"):
            run(*compiler, path, "-o", self.folder / "server.o")
            needed |= set(re.findall(r"U (__atomic\w+)", run("riscv64-linux-gnu-nm", self.folder / "server.o")))
        self.assertEqual(needed, {"__atomic_compare_exchange_1", "__atomic_compare_exchange_2"})
        self.assertLessEqual(needed, set(re.findall(r"T (__atomic\w+)", run("riscv64-linux-gnu-nm", self.folder / "exchange.o"))))
        masked = run("riscv64-linux-gnu-objdump", "-d", self.folder / "exchange.o")
        self.assertEqual(len(re.findall(r"csrrc\s+a\d,mstatus", masked)), len(re.findall(r"csrs\s+mstatus", masked)))

    def test_the_demo_is_configured_without_a_warning(self):
        command = re.search(r"cmake (--preset \S+ .*?) >", (ROOT / "tools/demo").read_text())[1]
        self.assertEqual(done("cmake", *command.split(), "-B", self.folder, cwd=ROOT).stderr, "")

    def test_canopen_by_itself(self):
        """The folder and the headers that its page names, and no other file of ours."""
        page = (ROOT / "firmware/cbcan/canopen/README.md").read_text()
        example = ROOT / "examples/sdo_read.cpp"
        shutil.copytree(ROOT / "firmware/cbcan/canopen", self.folder / "cbcan/canopen")
        for header in re.findall(r"`(\w+\.hpp)`", page):
            shutil.copy(ROOT / "firmware/cbcan" / header, self.folder / "cbcan")
        run("c++", "-std=c++20", "-fno-exceptions", "-fno-rtti", "-Wall", "-Wextra", "-Werror", f"-I{self.folder}", example,
            *sorted((self.folder / "cbcan").rglob("*.cpp")), "-o", self.folder / "example")
        self.assertEqual(run(self.folder / "example"), "4 bytes: 91 01 0F 00\n")

    def test_the_example_has_under_100_lines(self):
        self.assertLess(len(EXAMPLE.read_text().splitlines()), 100)


cases.main()
