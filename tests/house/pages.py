#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Fails on a page with prose of more than 100 columns, a link or a path that leads nowhere, or a figure that no test checks.

Tables and code are as wide as they are. A figure is checked when a comment stands behind it: see tests/docs/figures.py.
"""

import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
PAGES = [*sorted(ROOT.glob("*.md")), *sorted((ROOT / "docs").glob("*.md")), *sorted((ROOT / "firmware").rglob("*.md"))]
COLUMNS = 100

COMMENT = re.compile(r"<!--.*?-->")
LINK = re.compile(r"\]\(([^)#]*)(#[^)]*)?\)")
ROOMS = sorted(path.name for path in ROOT.iterdir() if path.is_dir() and path.name not in ("build", ".git"))
PATH = re.compile(rf"`((?:{'|'.join(map(re.escape, ROOMS))})/[\w./-]*)[` ]")
FIGURE = re.compile(r"\d[\d.,]* (?:KB|KiB|instructions|bytes of (?:flash|RAM|text|stack))\b(?!<!--)")


def prose(text):
    """(number, line) of what is neither code nor a row of a table."""
    code = False
    for number, line in enumerate(text.splitlines(), 1):
        if line.startswith("```"):
            code = not code
        elif not code and not line.startswith(("|", "    ")):
            yield number, line


def too_wide(text):
    for number, line in prose(text):
        shown = LINK.sub("]", COMMENT.sub("", line))
        if len(shown) > COLUMNS:
            yield number, f"{len(shown)} columns; {COLUMNS} is the most"


def unchecked_figures(text):
    for number, line in enumerate(text.splitlines(), 1):
        for match in FIGURE.finditer(line):
            yield number, f"no test checks `{match[0]}`: leave the figure out, or mark it (tests/docs/figures.py)"


def headings(page):
    """As links name them."""
    lines = [line.lstrip("#").strip().lower() for line in page.read_text().splitlines() if re.match("#+ ", line)]
    return {"#" + re.sub(r"[^\w -]", "", line).replace(" ", "-") for line in lines}


def dead_links(page, text):
    for number, line in prose(text):
        for target, anchor in LINK.findall(line):
            if "://" in target:
                continue
            file = (page.parent / target).resolve() if target else page
            if not file.exists():
                yield number, f"the link leads nowhere: {target}"
            elif anchor and anchor not in headings(file):
                yield number, f"the link leads nowhere: {target} has no heading {anchor}"


def dead_paths(text):
    for number, line in enumerate(text.splitlines(), 1):
        for path in PATH.findall(line + " "):
            if path.startswith("build/") or (ROOT / path).exists():
                continue
            yield number, f"no such file or folder: {path}"


def main():
    found = []
    for page in PAGES:
        text = page.read_text()
        complaints = [*too_wide(text)]
        if page.name != "CHANGELOG.md":
            complaints += [*unchecked_figures(text), *dead_links(page, text), *dead_paths(text)]
        found += [f"{page.relative_to(ROOT)}:{number}: {why}" for number, why in sorted(complaints)]
    print("\n".join(found) if found else f"{len(PAGES)} pages are in order")
    sys.exit(1 if found or len(PAGES) < 10 else 0)


main()
