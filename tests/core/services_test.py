#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""firmware/cbcan/services.hpp: the portable firmware with each switch off alone, and programs that a set of services does not allow.

All sources of a build are one translation unit, so anonymous names differ. Both compilers make a program of it.
"""

import pathlib
import re
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests/support"))
import cases

FIRMWARE = ROOT / "firmware"
SOURCES = [path for room in ("canopen", "coprocessor", "slcan") for path in sorted((FIRMWARE / "cbcan" / room).rglob("*.cpp"))]
SOURCES += [FIRMWARE / "boards/common" / f"{name}.cpp" for name in ("parameter_store", "record_log", "slcan_port", "station")]
MODBUS = sorted((FIRMWARE / "cbcan/modbus").glob("*.cpp"))  # the station's, with no switches
COMPILERS = ("clang++-14", "g++-12")[:1 + cases.LONG]
FLAGS = ["-std=c++20", "-Wall", "-Wextra", "-Werror"]


def switches():
    """Everything that can be left out, as services.hpp says."""
    text = (FIRMWARE / "cbcan/services.hpp").read_text()
    alone = [f".{name} = false" for name in re.findall(r"^  bool (\w+) = true;", text, re.MULTILINE)]
    return alone + [".rpdos = 0", ".tpdos = 0", ".rpdos = 0, .tpdos = 0", ".manager_clients = 0"]


class Services(cases.Case):
    def compile(self, services, text, *options, compiler="clang++-14"):
        """What the compiler says of this program with these services; "" = nothing."""
        place = pathlib.Path(tempfile.mkdtemp(dir=self.folder))
        (place / "cbcan").mkdir()
        (place / "cbcan/configuration.hpp").write_text(
            f'#pragma once\n#include "cbcan/services.hpp"\nnamespace cbcan {{ inline constexpr Services kServices{{{services}}}; }}\n')
        (place / "program.cpp").write_text(text)
        return subprocess.run([compiler, *FLAGS, f"-I{place}", f"-I{FIRMWARE}", f"-I{ROOT}/regmap/include", *(["-o", place / "program", *options] if options else ["-fsyntax-only"]),
                               place / "program.cpp"], capture_output=True, text=True).stderr

    @cases.in_long
    def test_each_switch_alone(self):
        everything = "".join(f'#include "{path}"\n' for path in SOURCES) + "int main() {}\n"
        self.assertGreaterEqual(len(switches()), 13)
        jobs = [(services, compiler) for services in switches() for compiler in COMPILERS]
        with ThreadPoolExecutor(2) as pool:
            said = pool.map(lambda job: self.compile(job[0], everything, "-O1", *MODBUS, compiler=job[1]), jobs)
            for job, errors in zip(jobs, said):
                with self.subTest(services=job[0], compiler=job[1]):
                    self.assertEqual(errors, "")

    def test_programs_that_are_refused(self):
        """What a program uses and its services do not have is named by the compiler."""
        device = '#include "cbcan/canopen/eds_device.hpp"\nclass Device final : public cbcan::EdsDevice { using EdsDevice::EdsDevice; };\n'
        device += "Device* make(const cbcan::EdsDictionary& d, cbcan::CanPort& p) { return new Device(d, {}, {}, p); }\n"
        manager = '#include "cbcan/canopen/manager/manager.hpp"\nusing namespace cbcan;\n'
        manager += "Manager* make(Device& d, NodeMonitor& m, CanPort& p, ManagerApplication& a) { return new Manager(d, m, p, a); }\n"
        store = '#include "boards/common/parameter_store.hpp"\nusing namespace cbcan::boards;\nstd::array<std::uint16_t, {}> words;\n'
        store += "ParameterStore* make(Flash& f) {{ return new ParameterStore(f, words, [](auto) {{ return true; }}); }}\n"
        for services, program, said in (("", device, ""), (".sdo_server = false", device, "SDO server"),
                                        ("", manager, ""), (".manager_clients = 0", manager, "manager_clients is 2 or more"),
                                        (".manager_clients = 1", manager, "manager_clients is 2 or more"),
                                        ("", store.format(16), ""), ("", store.format(17), "up to 16 words of settings")):
            for compiler in COMPILERS:
                with self.subTest(services=services, said=said, compiler=compiler):
                    errors = self.compile(services, program, compiler=compiler)
                    self.assertIn(said, errors) if said else self.assertEqual(errors, "")

    def test_another_serial_queue_does_not_link(self):
        library = "".join(f'#include "{FIRMWARE}/{name}"\n' for name in ("boards/common/slcan_port.cpp", "cbcan/slcan/slcan.cpp"))
        program = '#include "boards/common/slcan_port.hpp"\nint main() { cbcan::boards::SlcanPort port(500); return port.has_output(); }\n'
        self.assertEqual(self.compile("", library, "-c", "-o", f"{self.folder}/library.o"), "")
        self.assertEqual(self.compile("", program, f"{self.folder}/library.o", "-o", f"{self.folder}/program"), "")
        self.assertIn("undefined reference to `cbcan::boards::SlcanPort::SlcanPort(unsigned short, std::integral_constant<unsigned long, 512ul>)",
                      self.compile(".serial_queue = 512", program, f"{self.folder}/library.o", "-o", f"{self.folder}/program"))


if __name__ == "__main__":
    cases.main()
