#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Fails on a page with prose of more than 100 columns, a dead link or path, a name that the linked source does not have, or a figure that no
test checks.

Tables and code have no limit. A figure is checked if a comment follows it: see tests/docs/figures.py. In the changelog only the paths of the
unreleased part are checked: an item about a missing file must say removed.
"""

import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests/support"))
import page_blocks
import tree
from page_blocks import COMMENT, LINK, dead_links

COLUMNS = 100
SOURCES = ("firmware", "hostsim", "regmap", "tools")

ROOMS = sorted(path.name for path in ROOT.iterdir() if path.is_dir() and path.name not in ("build", ".git"))
PATH = re.compile(rf"`((?:{'|'.join(map(re.escape, ROOMS))})/[\w./-]*)[` ]")
FILE = re.compile(r"(?<![\w.-])((?:[\w-]+/)*[\w-]+\.(?:md|[ch]pp|h|py|st|toml|eds|lua|json|xml|yml))\b")
FILES = ["/" + str(path.relative_to(ROOT)) for path in tree.files()]
FIGURE = re.compile(r"\d[\d.,]* (?:KB|KiB|instructions|bytes of (?:flash|RAM|text|stack))\b(?!<!--)")


def too_wide(text):
    for number, line in page_blocks.prose(text):
        shown = "" if line.startswith("|") else LINK.sub("]", COMMENT.sub("", line))
        if len(shown) > COLUMNS:
            yield number, f"{len(shown)} columns; {COLUMNS} is the most"


def unchecked_figures(text):
    for number, line in enumerate(text.splitlines(), 1):
        for match in FIGURE.finditer(line):
            yield number, f"no test checks `{match[0]}`: leave the figure out, or mark it (tests/docs/figures.py)"


def dead_paths(text):
    for number, line in enumerate(text.splitlines(), 1):
        for path in PATH.findall(line + " "):
            if path.startswith("build/") or (ROOT / path).exists():
                continue
            yield number, f"no such file or folder: {path}"


def dead_files(text):
    """Missing files in the changelog's unreleased part: FILE or FOLDER/FILE, with or without `."""
    part = text.partition(" - unreleased\n")[2].partition("\n## ")[0]
    before = text.count("\n", 0, text.find(part))
    for item in re.finditer(r"^- .*(?:\n  .*)*", part, re.MULTILINE):
        for path in FILE.findall(item[0]):
            if not any(str(name).endswith("/" + path) for name in FILES) and "removed" not in item[0]:
                yield before + part.count("\n", 0, item.start()) + 1, f"no such file: {path}; call it removed, or correct it"


def misnamed(page, text):
    """Names of code in a paragraph that links to source files, and are in none of them."""
    for paragraph in re.finditer(r"(?:.+\n)+", text):
        files = [page.parent / target for target, _ in LINK.findall(paragraph[0]) if re.search(r"\.([ch]pp|js)$", target)]
        code = "".join(file.read_text() for file in files if file.exists())
        for name in re.findall(r"`(?:\w+::)*(\w+)`", paragraph[0]) if files else ():
            if not re.search(rf"\b{name}\b", code) and not (page.parent / name).exists():
                yield text.count("\n", 0, paragraph.start()) + 1, f"`{name}` is in none of the files that this paragraph links to"


def main():
    found, pages = [], page_blocks.pages()
    for page in pages:
        text = page.read_text()
        complaints = [*too_wide(text)]
        if page.name == "CHANGELOG.md":
            complaints += [*dead_files(text)]
        else:
            complaints += [*unchecked_figures(text), *dead_links(page, text), *dead_paths(text)]
            if page.relative_to(ROOT).parts[0] in SOURCES or page.name == "the-path.md":
                complaints += [*misnamed(page, text)]
        found += [f"{page.relative_to(ROOT)}:{number}: {why}" for number, why in sorted(complaints)]
    print("\n".join(found) if found else f"{len(pages)} pages are in order")
    sys.exit(1 if found else 0)


main()
