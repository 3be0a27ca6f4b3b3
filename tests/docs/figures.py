#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Runs a test that measures, and checks the figures in the pages against its output.

usage: figures.py GROUP COMMAND...

The command prints lines `figure: GROUP.NAME VALUE`. In a page a comment follows the figure: `28,556<!--size.image.text-->`; or, rounded, `28.6 KB<!--...-->`
(1,000 bytes), `36 KiB<!--...-->`. Instructions have two digits, and may be 10 % away: they change with every change of the core. Exit code: the command's, or 1 if a page has another value. With tools/dev/update figures
this program corrects the pages instead.
"""

import os
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests/support"))
import page_blocks

# Each group, and the compiler that its figures depend on; the pages have those of version 12.
GROUPS = {"x86": "g++", "m3": "arm-none-eabi-g++", "size": "arm-none-eabi-g++", "cores": "arm-none-eabi-g++", "host": "g++", "plant": None, "tr308": None}
VERSION = "12"
INSTRUCTIONS, MOST_AWAY = ("x86", "m3", "host"), 0.1

PRINTED = re.compile(r"^figure: ([\w.-]+) +(\d+)")
MARKED = re.compile(r"(\d[\d,]*(?:\.\d+)?)( KB| KiB|)<!--([\w-]+)\.([\w.-]+)-->")
WRITE = os.environ.get("CBCAN_FIGURES") == "write"
UNITS = {"": 1, " KB": 1000, " KiB": 1024}


def measured(command):
    """The command's figures by name, and its exit code. Its output is passed on immediately."""
    figures = {}
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, errors="replace") as process:
        for line in process.stdout:
            print(line, end="", flush=True)
            figures |= {name: int(value) for name, value in PRINTED.findall(line)}
    return figures, process.returncode


def text_of(group, value, written, unit):
    """The value in the page's unit, with the page's number of decimals; of instructions what is written, if it is near enough."""
    if group in INSTRUCTIONS:
        near = abs(int(written.replace(",", "")) - value) <= MOST_AWAY * value
        return written if near else f"{int(float(f'{value:.2g}')):,}"
    decimals = len(written.partition(".")[2])
    return f"{value / UNITS[unit]:,.{decimals}f}"


def corrected(page, group, figures, found):
    """The page's text with this group's measured figures; differences are added to `found`."""
    text = page.read_text()

    def correct(match):
        written, unit, of, name = match.groups()
        place = f"{page.relative_to(ROOT)}:{text.count(chr(10), 0, match.start()) + 1}"
        if of not in GROUPS:
            found.append(f"{place}: {of}.{name}: no such group; tests/docs/figures.py has {', '.join(GROUPS)}")
        if of != group:
            return match[0]
        if f"{of}.{name}" not in figures:
            found.append(f"{place}: {of}.{name}: this test has no such figure, but {', '.join(figures)}")
            return match[0]
        value = text_of(of, figures[f"{of}.{name}"], written, unit)
        if value != written and not WRITE:
            found.append(f"{place}: {of}.{name} is {value}{unit}, not {written}{unit}")
        return f"{value}{unit}<!--{of}.{name}-->"

    return MARKED.sub(correct, text)


def is_compiler_of_pages(compiler):
    version = compiler and subprocess.run([compiler, "-dumpversion"], capture_output=True, text=True).stdout
    return not compiler or version.partition(".")[0].strip() == VERSION


def main():
    group, command = sys.argv[1], sys.argv[2:]
    figures, code = measured(command)
    if code != 0:
        sys.exit(code if code > 0 else 1)
    if not is_compiler_of_pages(GROUPS[group]):
        print(f"the pages are about {GROUPS[group]} {VERSION}, which this is not: not compared")
        return
    found = []
    texts = {page: corrected(page, group, figures, found) for page in page_blocks.pages()}
    if WRITE:
        for page, text in texts.items():
            page.write_text(text)
    print("\n".join(found))
    if found:
        sys.exit("these figures of the pages are stale, which tools/dev/update figures corrects, or misnamed, which it cannot")


main()
