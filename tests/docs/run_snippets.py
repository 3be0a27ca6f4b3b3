#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Plays the sessions of pages, ```console blocks, as a user would and compares the output.

Lines that begin with "$ " are typed into one shell for each page, in the project's folder, with its programs in the path. The lines below are the
expected output. A command ending in "\\" continues on the next line. A line "..." stands for any number of lines, "..." within a line for any text,
12.345678 for any time. A command that ends in "&" is a server: its first line reports that it serves, even if the page does not show it. Commands in
ENDLESS are interrupted, and must run until then. A block whose first line is a comment with a file name is that file. Everything runs in its own
network namespace, so that the ports in the page are free.

usage: run_snippets.py PROGRAM_DIR FILE.md... [--root ROOT]      where PROGRAM_DIR is in ROOT, for chroot
"""

import argparse
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests/support"))
import cases
import page_blocks
from simulator import HOW_TO_JOIN

AS_ROOT = [] if os.geteuid() == 0 else ["--map-root-user"]
ALONE = ["unshare", "--net", *AS_ROOT, "sh", "-c", 'ip link set dev lo up && exec "$@"', "sh"]
SHELL = ["bash", "--norc"]
LIMIT = 400  # seconds for a document; one compiles the core
PROLOGUE = "exec 2>&1; PATH=$PWD/build/bin:$PATH"
ENDLESS = re.compile(r"curl -sN")
# After each command: its own mark, so that its output ends before that of the next one.
MARK = "--8<-- {} --8<--"
UNEXPECTED_END = "--it-has-ended--"
FILE = re.compile(r"(?:#|//|--) ([\w.]+\.\w+)\b")


def steps(document):
    """(line number, command, expected lines) of a document, in order."""
    found = []
    for block in page_blocks.blocks(document):
        if block.is_session:
            for number, line in enumerate(block.text.splitlines(), block.line):
                if found and found[-1][1].endswith("\\"):
                    found[-1] = (found[-1][0], found[-1][1][:-1] + line, [])
                elif line.startswith("$ "):
                    found.append((number, line[2:], []))
                else:
                    found[-1][2].append(line)
    return found


def is_server(command):
    return command.rstrip().endswith("&")


def pattern_of(command, expected):
    if ENDLESS.match(command) or is_server(command) and not expected:
        return r"(?:.*\n)*"
    parts = []
    for line in expected:
        if line.strip() == "...":
            parts.append(r"(?:.*\n)*?")
        else:
            text = ".*".join(re.escape(piece) for piece in line.rstrip().split("..."))
            parts.append(text.replace(r"12\.345678", r"\d+\.\d{6}") + r"[ \t]*\n")
    return "".join(parts)


def script_of(document_steps):
    lines = [PROLOGUE]
    for number, (_, command, _) in enumerate(document_steps):
        if is_server(command):
            command = command.rstrip()[:-1]
            # The last server keeps the pipe; bash has one named coprocess at a time.
            lines.append(f"coproc SERVER{number} {{ exec {command}; }}\nread -r line <&${{SERVER{number}[0]}} && echo \"$line\"")
        elif ENDLESS.match(command):
            lines.append(f"timeout -s INT 1 {command.partition('    #')[0]}; [[ $? == 124 ]] || echo {UNEXPECTED_END}")
        else:
            lines.append(command)
        lines.append("echo '" + MARK.format(number) + "'")
    return "\n".join(lines) + "\nkill $(jobs -p) 2>/dev/null; wait\n"


def type_into_shell(document, script, program_dir, root):
    """The shell's output. Its child processes end with it."""
    with tempfile.TemporaryDirectory(dir=root and f"{root}/tmp") as folder:
        inside = ["chroot", root, "env", f"--chdir=/{os.path.relpath(folder, root)}"] if root else []
        for name in ("plants", "tools", "docs", "scenarios", "examples", "firmware", "regmap", "hostsim"):
            (shutil.copytree if root else os.symlink)(ROOT / name, pathlib.Path(folder) / name)
        for block in page_blocks.blocks(document):
            if name := FILE.match(block.first):
                (pathlib.Path(folder) / name[1]).write_text(block.text)
        os.makedirs(pathlib.Path(folder) / "build")
        os.symlink(program_dir, pathlib.Path(folder) / "build" / "bin")
        shell = subprocess.Popen([*ALONE, *inside, *SHELL], cwd=folder, text=True, start_new_session=True, stdin=subprocess.PIPE,
                                 stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
        try:
            return shell.communicate(script, timeout=LIMIT)[0]
        except subprocess.TimeoutExpired:
            os.killpg(shell.pid, signal.SIGKILL)
            return shell.communicate()[0]


def run(document, program_dir, root):
    """(errors, number of commands that ran)"""
    document_steps = steps(document)
    if not document_steps:
        return [f"{document}: not one command in a console block"], 0
    found, rest = [], type_into_shell(document, script_of(document_steps), program_dir, root)
    for number, (line, command, expected) in enumerate(document_steps):
        output, mark, rest = rest.partition(MARK.format(number) + "\n")
        if not mark:
            return found + [f"{document}:{line}: `{command}`: did not end; it printed:\n{output}"], number
        joinless = re.sub(HOW_TO_JOIN + r".*\n", "", output, flags=re.MULTILINE)  # a server tells it after its first line
        fits = any(re.fullmatch(pattern_of(command, expected), text) for text in (output, joinless))
        if not fits or UNEXPECTED_END in output:
            found.append(f"{document}:{line}: `{command}` printed:\n{output}expected:\n" + "\n".join(expected))
    return found, len(document_steps)


def main():
    parser = argparse.ArgumentParser()
    for name, keywords in {"program_dir": {"type": os.path.abspath}, "documents": {"nargs": "+"}, "--root": {}}.items():
        parser.add_argument(name, **keywords)
    arguments = parser.parse_args()
    found, ran = [], 0
    for name in arguments.documents:
        wrong, commands = run(pathlib.Path(name), arguments.program_dir, arguments.root)
        found += wrong
        ran += commands
    print("\n".join(found))
    sys.exit(0 if cases.any_ran(ran) and not found else 1)


if __name__ == "__main__":
    main()
