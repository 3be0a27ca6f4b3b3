#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Lints the files for CI systems and for a container. fresh_root_test.py carries out their steps.

usage: ci_files_test.py NPM_DIR
"""

import pathlib
import re
import subprocess
import sys
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests/support"))
import cases
import ci_files
from simulator import program_from_arguments

NPM = program_from_arguments(sys.argv)
RULES = "{extends: default, rules: {line-length: {max: 140}, document-start: disable, truthy: {check-keys: false}}}"


class Linters(unittest.TestCase):
    def check(self, *command, **options):
        done = subprocess.run(command, capture_output=True, text=True, cwd=ROOT, **options)
        self.assertEqual(done.returncode, 0, f"{' '.join(command)}\n{done.stdout}{done.stderr}")

    def test_yaml(self):
        self.check("yamllint", "--strict", "--config-data", RULES, *ci_files.YAML)

    def test_github(self):
        for name in ("action.yml", "packaging/github.yml"):
            self.check(f"{NPM}/node_modules/.bin/action-validator", name)

    def test_container(self):
        self.check(f"{NPM}/node_modules/.bin/dockerfilelint", "packaging/Containerfile")

    def test_shell(self):
        steps = ci_files.github_steps() + ci_files.gitlab_steps() + [(ci_files.container()["RUN"], {})]
        self.assertGreater(len(steps), 9)
        for script, environment in steps:
            known = "".join(f"export {name}=\n" for name in environment)
            self.check("shellcheck", "--shell=bash", "-", input=known + script)

    def test_versions(self):
        version = re.search(r'kVersion = "([0-9.]+)"', (ROOT / "firmware/cbcan/version.hpp").read_text())[1]
        for name in ("packaging/gitlab.yml", "examples/consumer/CMakeLists.txt"):
            self.assertEqual(set(re.findall(r"\d+\.\d+\.\d+", re.sub(r"VERSION \S+", "", (ROOT / name).read_text()))), {version}, name)


cases.main()
