#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Lints the files for CI systems and for a container. fresh_root_test.py carries out their steps.

usage: ci_files_test.py NPM_DIR
"""

import contextlib
import pathlib
import re

import cases
import ci_files
from done import done, output
from simulator import program_from_arguments
from tree import ROOT

NPM = program_from_arguments()
BARE = re.compile(r"""\b(?:npx|npm (?:install|i|exec)|pip3? install)(?: -\S+)* cbcan(?![\w./*-])|(?:from|import\() ?["']cbcan["']""")
RULES = "{extends: default, rules: {line-length: {max: 140}, document-start: disable, truthy: {check-keys: false}}}"


class Linters(cases.Case):
    def test_yaml(self):
        done("yamllint", "--strict", "--config-data", RULES, *ci_files.YAML, cwd=ROOT)

    def test_github(self):
        for name in ("action.yml", *ci_files.GITHUB, *ci_files.WORKFLOWS):
            text = (ROOT / name).read_text().replace("      attestations: write\n", "")  # which is newer than the validator
            done(f"{NPM}/node_modules/.bin/action-validator", self.write(pathlib.Path(name).name, text), cwd=ROOT)

    def test_container(self):
        done(f"{NPM}/node_modules/.bin/dockerfilelint", "packaging/Containerfile", cwd=ROOT)

    def test_shell(self):
        steps = ci_files.github_steps() + ci_files.gitlab_steps() + [(ci_files.container()["RUN"], {})]
        self.assertGreater(len(steps), 9)
        for script, environment in steps:
            known = "".join(f"export {name}=\n" for name in environment)
            done("shellcheck", "--shell=bash", "-", input=known + script, cwd=ROOT)

    def test_the_release_is_a_script_but_for_the_uploads(self):
        steps = [step for steps in ci_files.release_steps().values() for step in steps]
        parts = re.findall(r"^  (\w+) +\S", output(ROOT / "packaging/release", "--help"), re.M)
        ours = [step.split()[1] for step in steps if step.startswith("packaging/release ")]
        self.assertEqual(sorted(ours), sorted(parts))
        others = [step.split()[0] for step in steps if not step.startswith("packaging/release ")]
        self.assertEqual(others, ["apt-get", "apt-get", "node", "gh", "mkdir"])

    def test_actions_are_named_by_their_commits(self):
        """A tag can be moved."""
        uses = [name for path in ci_files.WORKFLOWS for name in re.findall(r"uses: (\S+)", (ROOT / path).read_text())]
        self.assertGreater(len(uses), 9)
        self.assertEqual([name for name in uses if not re.search(r"@[0-9a-f]{40}$|^\./", name)], [])

    def test_a_tag_that_does_not_belong(self):
        owner = (ROOT / "packaging/owner").read_text().strip()
        version = re.search(r'kVersion = "([0-9.]+)"', (ROOT / "firmware/cbcan/version.hpp").read_text())[1]
        for tag, name, said in ((f"v{version}", owner, ""), ("v9.9.9", owner, "the tag v9.9.9 is not"), (f"v{version}", "Else", "has not the name Else")):
            checked = done(ROOT / "packaging/release", "check", tag, name, code=1 if said else 0)
            self.assertEqual(checked.stdout, "")
            self.assertIn(said, checked.stderr)

    def test_a_registry_is_not_asked_for_the_bare_name(self):
        """Other people may own it there."""
        names = output("git", "ls-files", cwd=ROOT).split()
        for path in (ROOT / name for name in names if not name.startswith("tests/descriptions/corpus/")):
            with contextlib.suppress(UnicodeDecodeError):
                self.assertEqual(BARE.findall(path.read_text()), [], path)

    def test_versions(self):
        version = re.search(r'kVersion = "([0-9.]+)"', (ROOT / "firmware/cbcan/version.hpp").read_text())[1]
        for name in ("packaging/gitlab.yml", "packaging/cluster/gitlab.yml", "packaging/cluster/kubernetes.yml", "examples/consumer/CMakeLists.txt"):
            self.assertEqual(set(re.findall(r"\d+\.\d+\.\d+", re.sub(r"VERSION \S+", "", (ROOT / name).read_text()))), {version}, name)


cases.main()
