#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Runs every ```console block of a Markdown file as a person would and compares what is printed.

Lines that begin with "$ " are typed into one shell, in the project's folder with its programs built; the lines below are what they must
print. A line "..." stands for any number of lines, "..." within a line for any text. Everything runs in a network namespace of
its own, so that the ports which the document names are free.

usage: run_snippets.py PROGRAM_DIR FILE.md...
"""

import os
import pathlib
import re
import signal
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests/support"))
import cases

AS_ROOT = [] if os.geteuid() == 0 else ["--map-root-user"]
SHELL = ["unshare", "--net", *AS_ROOT, "bash", "--norc"]
LIMIT = 120  # seconds for a document
PROLOGUE = """
ip link set dev lo up
exec 2>&1
"""
# After each command: its own mark, so that its output can be told from the next one's.
MARK = "--8<-- {} --8<--"


def blocks(text):
    """(line number, lines) of each console block."""
    found, start, lines = [], None, []
    for number, line in enumerate(text.splitlines(), 1):
        if line.startswith("```"):
            if start is not None:
                found.append((start, lines))
                start = None
            elif line.strip() == "```console":
                start, lines = number + 1, []
        elif start is not None:
            lines.append(line)
    return found


def steps(document):
    """(line number, command, expected lines) of a document, in order."""
    found = []
    for start, lines in blocks(document.read_text()):
        for offset, line in enumerate(lines):
            if line.startswith("$ "):
                found.append((start + offset, line[2:], []))
            elif found:
                found[-1][2].append(line)
    return found


def pattern_of(expected):
    parts = []
    for line in expected:
        if line.strip() == "...":
            parts.append(r"(?:.*\n)*?")
        else:
            parts.append(".*".join(re.escape(piece) for piece in line.rstrip().split("...")) + r"[ \t]*\n")
    return "".join(parts)


def script_of(document_steps):
    lines = [PROLOGUE]
    for number, (_, command, expected) in enumerate(document_steps):
        if command.rstrip().endswith("&") and expected:
            # A server: its first line says that it serves.
            command = command.rstrip()[:-1]
            lines.append(f"coproc {command}\nread -r line <&${{COPROC[0]}} && echo \"$line\"")
        else:
            lines.append(command)
        lines.append("echo '" + MARK.format(number) + "'")
    return "\n".join(lines) + "\nkill $(jobs -p) 2>/dev/null; wait\n"


def type_into_shell(script, program_dir):
    """What the shell prints. Whatever it started ends with it."""
    with tempfile.TemporaryDirectory() as folder:
        for name in ("plants", "tools", "docs", "scenarios", "examples"):
            os.symlink(ROOT / name, pathlib.Path(folder) / name)
        os.makedirs(pathlib.Path(folder) / "build")
        os.symlink(program_dir, pathlib.Path(folder) / "build" / "bin")
        shell = subprocess.Popen(SHELL, cwd=folder, text=True, start_new_session=True, stdin=subprocess.PIPE,
                                 stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        try:
            return shell.communicate(script, timeout=LIMIT)[0]
        except subprocess.TimeoutExpired:
            os.killpg(shell.pid, signal.SIGKILL)
            return shell.communicate()[0]


def run(document, program_dir):
    """(what is wrong, how many commands ran)"""
    document_steps = steps(document)
    if not document_steps:
        return [f"{document}: not one command in a console block"], 0
    found, rest = [], type_into_shell(script_of(document_steps), program_dir)
    for number, (line, command, expected) in enumerate(document_steps):
        output, mark, rest = rest.partition(MARK.format(number) + "\n")
        if not mark:
            return found + [f"{document}:{line}: `{command}`: did not end; it printed:\n{output}"], number
        if not re.fullmatch(pattern_of(expected), output):
            found.append(f"{document}:{line}: `{command}` printed:\n{output}expected:\n" + "\n".join(expected))
    return found, len(document_steps)


def main():
    program_dir = pathlib.Path(sys.argv[1]).resolve()
    found, ran = [], 0
    for name in sys.argv[2:]:
        wrong, commands = run(pathlib.Path(name), program_dir)
        found += wrong
        ran += commands
    print("\n".join(found))
    sys.exit(0 if cases.enough(ran) and not found else 1)


main()
