#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Fails on a commit with a subject of more than 72 characters or without a body, and on one that raises a limit and changes another file too.

Looks at the commits since tests/limits.toml exists; those that this clone has. Without a history there is nothing to check.
"""

import pathlib
import subprocess
import sys
import tomllib

ROOT = pathlib.Path(__file__).resolve().parents[2]
LIMITS, COLUMNS = "tests/limits.toml", 72


def git(*arguments):
    return subprocess.run(["git", "-c", "safe.directory=*", *arguments], cwd=ROOT, capture_output=True, text=True).stdout


def numbers(table, name=""):
    """Each limit by its full name."""
    for key, value in table.items():
        yield from numbers(value, f"{name}{key}.") if isinstance(value, dict) else [(name + key, value)]


def raised(commit):
    before, after = (dict(numbers(tomllib.loads(git("show", f"{of}:{LIMITS}")))) for of in (f"{commit}^", commit))
    # Coverage has to be at least its limit: there a smaller number allows more.
    return [name for name, value in after.items() if (before.get(name, value) - value) * (1 if name.startswith("coverage.") else -1) > 0]


def complaints(commit, subject, body):
    if len(subject) > COLUMNS:
        yield f"a subject of {len(subject)} characters; {COLUMNS} is the most"
    if not body.strip():
        yield "no body: write the reason"
    files = git("show", "--format=", "--name-only", commit).split()
    if LIMITS in files and files != [LIMITS] and (names := raised(commit)):
        yield f"raises {', '.join(names)} and changes other files: let a commit of its own say why"


def main():
    first = git("log", "--format=%H", "--diff-filter=A", "--", LIMITS).split()
    log = git("log", "--no-merges", "--format=%H%x00%s%x00%b%x01", f"{first[-1]}..HEAD") if first else ""
    commits = [entry.strip("\n").split("\0") for entry in log.split("\1") if entry.strip()]
    found = [f"{commit[:8]} {subject}: {why}" for commit, subject, body in commits for why in complaints(commit, subject, body)]
    print("\n".join(found) if found else f"{len(commits)} commits are in order")
    sys.exit(1 if found else 0)


main()
