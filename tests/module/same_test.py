#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""The program of the npm package says what the native one says; and what only the package has.
usage: same_test.py CBCAN_SIM NATIVE MODULE_FOLDER"""

import json
import pathlib
import re
import shlex
import shutil
import subprocess

import cases
from simulator import LIMIT, program_from_arguments
from tree import ROOT

PROGRAM, NATIVE, FOLDER = program_from_arguments(3)
EDITIONS = dict(re.findall(r"^\| `([^`]+)` \| (.*) \|$", re.search(r"<!-- generated: editions -->(.*?)<!-- end -->", (ROOT / "docs/how-to/install.md").read_text(), re.S)[1], re.M))
NUMBERS = ("", "0", "-0", "+1", " 1", "1 ", "01", "1.5", ".5", "5.", "1e3", "1E3", "1e", "1e+", "1e400", "-1e400", "1e-400", "4.9e-324", "0x10", "10h",
           "0x", "h", "0x1p3", "1_000", "1,5", "nan", "inf", "-inf", "infinity", "0x1.8", "1f", "--1", "2147483647", "4294967296",
           "9007199254740993", "1e22", "0.1", "123456789.123456789", "179769313486231580793728971405301e276", "\u0661")


def said(program, *arguments, lines=None):
    done = subprocess.run([program, *arguments], input=lines, capture_output=True, text=True, timeout=LIMIT, cwd=ROOT,
                          stdin=None if lines is not None else subprocess.DEVNULL)
    return done.returncode, done.stdout, done.stderr


class Same(cases.Case):
    maxDiff = None

    def same(self, *arguments, **keywords):
        here, there = said(PROGRAM, *arguments, **keywords), said(NATIVE, *arguments, **keywords)
        self.assertEqual(here, there, arguments)
        return here

    def test_help_versions_and_mistakes(self):
        for arguments in (["--help"], ["--version"], ["run", "--help"], ["--demmo"], ["--demo", "--set", "x=1"], ["--config"], ["--modbus", "1.2.3.4:99999"],
                          ["--check", "--demo"], ["--check", "--config", "plants/tank/plant.toml"], ["--list-devices"], ["run"], ["run", "nowhere"],
                          ["run", "--shard", "2/3", "scenarios"],
                          ["run", "--explore", "scenarios/cancel.toml"], ["run", "--only", "66:response-never@1", "scenarios/cancel.toml"]):
            self.same(*arguments)

    def test_headers_for_firmware(self):
        for name, *words in (("cbcan-eds", "plants/demo/io_module.eds"), ("cbcan-eds", "--name", "1"), ("cbcan-eds", "nowhere.eds"), ("cbcan-eds", "--help"),
                             ("cbcan-network", "plants/demo/network.toml"), ("cbcan-network", "--own-node", "0", "x"),
                             ("cbcan-network", "--output", self.folder / "made.hpp", "--depfile", self.folder / "made.d", "plants/demo/network.toml")):
            results = []
            for program in (PROGRAM, NATIVE):
                ended = said(pathlib.Path(program).with_name(name), *words)
                results.append((ended, [path.read_bytes() for path in sorted(self.folder.glob("made.*"))]))
            self.assertEqual(results[0], results[1], words)
        self.assertEqual(results[0][0], (0, "", ""))
        self.assertIn("plants/demo/io_module.eds", results[0][1][0].decode())
        code, _, err = said(pathlib.Path(PROGRAM).with_name("cbcan-network"), "--binary", "plants/demo/network.toml")
        self.assertEqual((code, err), (2, "cbcan-sim: --binary: is not in this build; use the header\n"))

    def test_a_number_is_accepted_by_both_or_neither(self):
        outcomes = {}
        for number in NUMBERS:
            outcomes[number] = self.same("--check", "--demo", "--set", f"bus.bitrate={number}"), self.same(
                "--check", "--demo", "--signal", f"66:0x6401:1=constant value={number}"), self.same(
                "--demo", "--modbus", "127.0.0.1:1", "--no-module", "--clock", "manual", lines=f"set 66 0x6401:1 {number}\nget 66 0x6401:1\n")
        self.assertEqual(outcomes["1e3"][2][0], 0)
        self.assertEqual(outcomes["0x1p3"][2][0], 2)
        self.assertEqual({number for number in NUMBERS if outcomes[number][2][0] == 0} & {"+1", "nan", "inf", "0x1p3"}, set())


class Package(cases.Case):
    def test_each_row_of_the_table_of_editions(self):
        nowhere = "127.0.0.1:1"
        rows = {"--rtu": ["--demo", "--rtu", "/nowhere/tty"], "rtu.listen": ["--demo", "--set", "rtu.listen=unix:/x"],
                "--control": ["--demo", "--control", "unix:/x"], "--slcan": ["--demo", "--slcan", "pty:/x"],
                "--socketcand": ["--demo", "--socketcand", "unix:/x"], "--pcap": ["--demo", "--pcap", "x"],
                "--plc": ["--demo", "--plc", nowhere], "plc.device": ["--demo", "--set", "plc.device=/nowhere/tty"],
                "--can": ["--demo", "--can", "socketcan:can0"], "--real-time": ["run", "--real-time", "scenarios"],
                "--target": ["run", "--target", nowhere, "scenarios"]}
        self.assertEqual(sorted(rows), sorted(EDITIONS))
        for row, options in rows.items():
            cell = EDITIONS[row]
            if packages := re.findall(r"`(jsmodbus|serialport)`", cell):
                self.check_needs(packages, ["--demo", "--can", "slcan:/nowhere/tty"] if row == "--can" else options)
            missing = re.search(r"(?:^|; )no(?: `socketcan`)?: (.*)", cell)
            if missing or cell == "`HOST:PORT` alone":
                code, out, err = said(PROGRAM, *options)
                self.assertEqual((code, out), (2, ""), options)
                self.assertRegex(err, f"is not in this build; {re.escape(missing[1] if missing else 'use HOST:PORT')}")
            self.assertTrue(packages or missing or cell == "`HOST:PORT` alone", row)

    def check_needs(self, packages, options):
        """They are installed with it; without one of them it says so."""
        package = pathlib.Path(PROGRAM).resolve().parent
        manifest = json.loads((package / "package.json").read_text())
        for name in packages:
            self.assertIn(name, manifest["optionalDependencies"])
        alone = self.folder / "alone"
        shutil.copytree(package, alone, dirs_exist_ok=True)
        code, _, err = said(alone / "cbcan.mjs", "--modbus", "127.0.0.1:0", *options)
        self.assertEqual(code, 2, err)
        self.assertRegex(err, f"needs the package ({'|'.join(packages)}), which is not installed; npm install ")

    def test_its_build_needs_only_what_it_installs(self):
        commands = subprocess.run(["ninja", "-C", FOLDER, "-t", "commands", "cbcan_npm", "cbcan_tab"], capture_output=True, text=True, check=True).stdout
        used = {shlex.split(command)[0] for line in commands.splitlines() for command in line.split(" && ") if not command.startswith("cd ")}
        packages = subprocess.run(["bash", "-c", ". tools/dev/packages.sh; echo ${module_packages[*]}"], cwd=ROOT, capture_output=True, text=True,
                                  check=True).stdout.split()
        for program in used - {":", "ccache", "/usr/bin/ccache"}:
            owner = subprocess.run(["dpkg", "-S", f"*/bin/{pathlib.Path(program).name}"], capture_output=True, text=True, check=True).stdout.split(":")[0]
            essential = subprocess.run(["dpkg-query", "-Wf", "${Essential}", owner], capture_output=True, text=True, check=True).stdout
            self.assertTrue(owner in packages or essential == "yes", f"{program} of {owner}")


cases.main()
