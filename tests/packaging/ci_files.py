# SPDX-License-Identifier: MIT
"""The files for CI systems and for a container, as commands: action.yml, packaging/github.yml, gitlab.yml, Containerfile."""

import json
import re
import shutil

import yaml
from tree import ROOT

OWNER = (ROOT / "packaging/owner").read_text().strip()
WORKFLOWS = [".github/workflows/check.yml", ".github/workflows/release.yml"]
GITHUB = ["packaging/github.yml", "packaging/cluster/github.yml"]
YAML = ["action.yml", *GITHUB, "packaging/gitlab.yml", "packaging/cluster/gitlab.yml", "packaging/cluster/kubernetes.yml", *WORKFLOWS]
PYTEST_INI = "[pytest]\ncbcan_plant = --config plant.toml\n"
BASH = ["bash", "--noprofile", "--norc", "-eo", "pipefail", "-c"]  # as both systems use it


def load(name):
    return yaml.safe_load((ROOT / name).read_text())


def action_steps():
    """(script, environment) of each step of the action."""
    return [(step["run"], step.get("env", {})) for step in load("action.yml")["runs"]["steps"]]


def github_steps():
    """The same for the example's job, with the action replaced by its steps."""
    (job,) = load("packaging/github.yml")["jobs"].values()
    found = []
    for step in job["steps"]:
        if "run" in step:
            found.append((step["run"], {}))
        elif step["uses"].startswith(f"{OWNER}/cbcan@"):
            found += action_steps()
        else:
            assert step["uses"].startswith("actions/checkout@"), step
    return found


def release_steps():
    """The commands of the workflow, by its jobs."""
    return {name: [step["run"] for step in job.get("steps", []) if "run" in step] for name, job in load(".github/workflows/release.yml")["jobs"].items()}


def gitlab_steps():
    job = load("packaging/gitlab.yml")["plant"]
    return [(line, job["variables"]) for line in job["before_script"] + job["script"]]


def container():
    """Instructions of the Containerfile by name, lists as lists."""
    text = re.sub(r"\\\n\s*", "", (ROOT / "packaging/Containerfile").read_text())
    found = {}
    for name, rest in re.findall(r"^([A-Z]+) (.*)$", text, re.MULTILINE):
        assert name not in found, f"a second {name}"
        found[name] = json.loads(rest) if rest.startswith("[") else rest
    found["HEALTHCHECK"] = json.loads(found["HEALTHCHECK"].partition("CMD ")[2])
    return found


def repository(job):
    """A user's project: the demo plant, pytest.ini from docs/how-to/test-in-ci.md, and shipped examples for the rest."""
    shutil.copytree(ROOT / "plants/demo", job)
    shutil.copytree(ROOT / "plants", job / "plants")  # for the shipped scenarios
    shutil.copytree(ROOT / "scenarios", job / "scenarios")
    shutil.copytree(ROOT / "examples/pytest", job / "tests", ignore=shutil.ignore_patterns("pytest.ini"))
    shutil.move(job / "tests" / "conftest.py", job)
    (job / "pytest.ini").write_text(PYTEST_INI)
    return job
