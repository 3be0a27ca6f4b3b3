#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""The wheel with this build's programs, installed by pip in a virtual environment that is not on PATH: programs, fixtures, types. With the
portable programs, on other systems: wheel_systems_test.py.

usage: wheel_test.py BUILD_DIR
"""

import base64
import hashlib
import os
import pathlib
import platform
import re
import tempfile
import zipfile

import cases
from done import done, output as run
from simulator import LIMIT, program_from_arguments
from tree import ROOT

BUILD = pathlib.Path(program_from_arguments()).resolve()
ENVIRONMENT = {"PATH": "/usr/bin:/bin", "PYTHONDONTWRITEBYTECODE": "1"}
TEST = '''
import os
import pathlib
import sys

def test_the_program_of_this_environment(plant, window):
    program = os.readlink(f"/proc/{plant.process.pid}/exe")
    assert program == f"{sys.prefix}/bin/cbcan-sim"
    plant.power(0x42, False)
    assert window.execute(5055, 0x42, 0x6411, 1, 2) == 4
'''
TYPED = '''
from cbcan_plant import Plant, Window
from cbcan_st import Program

def test_it(plant: Plant, window: Window) -> None:
    assert plant.wait("state 66 operational", within="2s") + plant.now > 0
    plant.power(0x42, on="off")
    window.read(3700).append("0")
    window.abort + 1

def test_st(st: Program) -> None:
    assert st.run(until="DONE", within=30) > 0 and st["main.full"]
    st.force(5, 5)
'''


def make(folder):
    return pathlib.Path(run(ROOT / "packaging/wheel", BUILD, folder).strip())


class Wheel(cases.Case):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(cls.enterClassContext(tempfile.TemporaryDirectory())).resolve()
        cls.wheel = make(cls.folder / "first")
        cls.venv = cls.folder / "venv"
        cls.bin = cls.venv / "bin"
        run("/usr/bin/python3", "-m", "venv", "--without-pip", "--system-site-packages", cls.venv)  # with Debian's pytest
        run("/usr/bin/python3", "-m", "pip", "--python", cls.bin / "python", "install", "--no-index", "--no-deps", "--no-compile", cls.wheel)
        cls.version = run(BUILD / "bin/cbcan-sim", "--version")

    def python(self, *arguments, code=0, **environment):
        return done(self.bin / "python", *arguments, env=ENVIRONMENT | environment, cwd=self.folder, code=code, timeout=LIMIT)

    def pytest(self, *arguments, **options):
        return self.python("-m", "pytest", "-q", "-W", "error", "--strict-markers", "-p", "no:cacheprovider", *arguments, **options).stdout

    def test_programs(self):
        self.assertEqual(run(self.bin / "cbcan-sim", "--version"), self.version)
        self.assertEqual(self.python("-m", "cbcan", "--version").stdout, self.version)
        self.assertIn("--demoo", self.python("-m", "cbcan", "--demoo", code=2).stderr)
        plc = ("cia405.st", "scanner.st", "openplc.st", "example.st", "configuration.st")
        run(self.bin / "cbcan-sim", "--demo", "--clock", "manual", "--", self.bin / "cbcan-st", *plc, "--scans", "5", cwd=self.folder)
        self.assertEqual(run(self.bin / "cbcanctl", "--version"), run(BUILD / "bin/cbcanctl", "--version"))
        for name in ("cbcan-eds", "cbcan-network"):
            self.assertEqual(run(self.bin / name, "--help"), run(BUILD / "bin" / name, "--help"))

    def test_fixtures_without_conftest(self):
        self.write("test_it.py", TEST)
        self.assertIn("1 passed", self.pytest("test_it.py"))
        program = BUILD / "bin/cbcan-sim"
        self.assertIn(f"+ {program}\n", self.pytest("test_it.py", code=1, CBCAN_SIM=str(program)))

    def test_fixtures_with_conftest(self):
        self.assertIn('pytest_plugins = ["cbcan_plant"]', (ROOT / "examples/pytest/conftest.py").read_text())
        self.assertIn("8 passed", self.pytest(ROOT / "examples/pytest"))

    def test_types(self):
        self.write("typed.py", TYPED)
        self.write("mypy.ini", "[mypy]\nstrict = True\n[mypy-pytest]\nfollow_imports = skip\n")  # takes seconds
        said = done("/usr/bin/mypy", "--show-error-codes", "--cache-dir", os.devnull, "--python-executable", self.bin / "python", "typed.py",
                    code=1, cwd=self.folder).stdout
        self.assertEqual(re.findall(r"(\S+:\d+): error: .*\[([a-z-]+)\]", said),
                         [("typed.py:7", "arg-type"), ("typed.py:8", "arg-type"), ("typed.py:9", "operator"), ("typed.py:13", "arg-type")], said)

    def test_metadata(self):
        said = self.python("-c", "from importlib.metadata import *; m = metadata('cbcan'); print(m['Version'], m['Requires-Python'])").stdout
        self.assertEqual(said, f"{self.version.split()[1]} >=3.9\n")

    def test_bytes(self):
        again = make(self.folder / "second")
        self.assertEqual((again.name, again.read_bytes()), (self.wheel.name, self.wheel.read_bytes()))
        self.assertTrue(again.name.endswith(f"-py3-none-linux_{platform.machine()}.whl"), again.name)
        with zipfile.ZipFile(again) as archive:
            names = archive.namelist()
            info = names[-1].rpartition("/")[0]
            *record, (last, *nothing) = [line.split(",") for line in archive.read(names[-1]).decode().splitlines()]
            self.assertEqual((last, nothing), (f"{info}/RECORD", ["", ""]))
            for name, digest, size in record:
                data = archive.read(name)
                self.assertEqual((base64.urlsafe_b64decode(digest.partition("=")[2] + "="), int(size)), (hashlib.sha256(data).digest(), len(data)))
        self.assertEqual(names, [name for name, *_ in record] + [last])
        self.assertEqual({name.partition(info.removesuffix("dist-info"))[2] or name for name in names}, {
            "cbcan/__init__.py", "cbcan/__main__.py", "cbcan_plant/__init__.py", "cbcan_plant/py.typed", "cbcan_st/py.typed",
            *(f"{name}/{path.name}" for name, files in (("cbcan_st", "python/cbcan_st/*.*"), ("cbcan_st", "st/*.st"), ("cbcan_st/machine", "st/machine/*.*"))
              for path in (ROOT / "tools").glob(files)), *(f"data/scripts/{name}" for name in ("cbcan-sim", "cbcanctl", "cbcan-eds", "cbcan-network")),
            *(f"dist-info/{name}" for name in ("LICENSE", "METADATA", "WHEEL", "entry_points.txt", "RECORD"))})


class Source(cases.Case):
    def test_libmicrohttpd_is_that_of_the_last_update(self):
        script = """. tools/dev/packages.sh
            dpkg-query() { echo "lua5.4 9.9"; echo "libmicrohttpd 0.9.75-6"; }
            apt-get() { echo "asked"; exit; }
            debian_source libmicrohttpd "$1" """
        for unpacked, said in ("0.9.75-6", ""), ("0.9.75-7", ""), ("0.9.75-5", "asked\n"):
            (self.folder / "debian").mkdir(exist_ok=True)
            self.write("debian/changelog", f"libmicrohttpd ({unpacked}) unstable; urgency=low\n\n  * .\n\n"
                       " -- A <a@example>  Mon, 01 Jan 2024 00:00:00 +0000\n")
            self.assertEqual(run("bash", "-euc", script, "sh", self.folder, cwd=ROOT), said, unpacked)


cases.main()
