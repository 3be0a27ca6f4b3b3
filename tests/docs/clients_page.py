#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Each program of docs/clients.md, as it stands there, prints what the page says. mbpoll's session is run_snippets.py's.

usage: clients_page.py SIMULATOR NPM_FOLDER
"""

import json
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests/support"))
import cases
from simulator import LIMIT, Simulator, program_from_arguments

PROGRAM, NPM_FOLDER = program_from_arguments(sys.argv, 2)
PAGE = (ROOT / "docs/clients.md").read_text()
FLOW = (ROOT / "examples/node_red.json").read_text()
PYTHON = "/usr/bin/python3"  # Debian's has Debian's pymodbus


def blocks(heading, language):
    section = re.search(rf"^### {heading}\n(.*?)(?=^##|\Z)", PAGE, re.MULTILINE | re.DOTALL)[1]
    return re.findall(rf"^```{language}\n(.*?)^```", section, re.MULTILINE | re.DOTALL)


OUTPUT = re.search(r"^```text\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)[1]


class ClientsPage(unittest.TestCase):
    def setUp(self):
        # Where Node.js finds the packages.
        folder = tempfile.TemporaryDirectory(dir=NPM_FOLDER)
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def run_command(self, *command):
        done = subprocess.run(command, cwd=self.folder, capture_output=True, text=True, timeout=LIMIT)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        return done.stdout

    def place(self, name, text, port):
        """Writes a program to a file; all that changes is the port."""
        self.assertEqual(text.count("1502"), 1, text)
        (self.folder / name).write_text(text.replace("1502", str(port)))

    def check(self, name, text, *command):
        with Simulator(PROGRAM, "--demo") as simulator:
            self.place(name, text, simulator.port)
            self.assertEqual(self.run_command(*command), OUTPUT)

    def test_pymodbus(self):
        self.check("three.py", blocks("pymodbus", "python")[0], PYTHON, "three.py")

    def test_pymodbus_s_own_conversions(self):
        self.run_command(PYTHON, "-c", blocks("pymodbus", "python")[1])

    def test_modbus_serial(self):
        self.check("three.mjs", *blocks("modbus-serial", "js"), "node", "three.mjs")

    def test_jsmodbus(self):
        self.check("three.mjs", *blocks("jsmodbus", "js"), "node", "three.mjs")

    def test_libmodbus(self):
        section = PAGE.partition("### libmodbus\n")[2]
        build = re.search(r"`(cc .*?)`", section)[1]
        self.check("three.c", *blocks("libmodbus", "c"), "sh", "-c", f"{build} -Wall -Wextra -Werror && ./three")

    def test_node_red(self):
        written = OUTPUT.splitlines(keepends=True)[0]  # the write's button shows a line too
        with Simulator(PROGRAM, "--demo") as simulator:
            self.place("flow.json", FLOW, simulator.port)
            (self.folder / "user").mkdir()
            shown = self.run_command("node", f"{NPM_FOLDER}/node_red.mjs", f"{self.folder}/flow.json", f"{self.folder}/user")
        self.assertEqual(shown, written + OUTPUT)

    def test_node_red_s_functions_are_those_of_the_flow(self):
        functions = [node["func"] + "\n" for node in json.loads(FLOW) if node["type"] == "function"]
        shown = blocks("Node-RED", "js")
        self.assertEqual(len(shown), 2)
        for text in shown:
            self.assertIn(text, functions)


cases.main()
