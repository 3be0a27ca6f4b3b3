# SPDX-License-Identifier: MIT
"""The project's Markdown pages in all folders, and their parts."""

import dataclasses
import pathlib
import re

import tree
from tree import ROOT

LEAST_PAGES = 25


def pages():
    found = [page for page in tree.files()
             if page.suffix == ".md" and not any(part.startswith(".") for part in page.relative_to(ROOT).parts)]
    assert len(found) >= LEAST_PAGES, f"only {len(found)} pages found: the check looks in the wrong place"
    return found


@dataclasses.dataclass
class Block:
    """Code: between fences, or indented by four columns or more after a blank line."""
    page: pathlib.Path
    line: int  # of its first line
    language: str
    text: str

    def __str__(self):
        return f"{self.page.relative_to(ROOT)}:{self.line}"

    @property
    def first(self):
        return self.text.partition("\n")[0].strip()

    @property
    def is_session(self):
        return self.language == "console"


def parts(text):
    """(number, line, its block or None) for each line except fences."""
    fence, block, blank = None, None, True
    for number, line in enumerate(text.splitlines(), 1):
        if found := re.match(r" *```(\w*)", line):
            fence, block, blank = (None if fence is not None else found[1]), None, False
            continue
        if fence is not None:
            block = block or (number, fence)
        elif line.startswith("    ") and (block or blank):
            block = block or (number, "")
        elif line.strip():
            block = None
        blank = not line.strip()
        yield number, line, block


def blocks(page):
    found = {}
    for _, line, block in parts(page.read_text()):
        if block:
            found.setdefault(block, []).append(line)
    for (line, language), lines in found.items():
        indent = min((len(text) - len(text.lstrip()) for text in lines if text.strip()), default=0)
        yield Block(page, line, language, "\n".join(text[indent:] for text in lines).rstrip("\n") + "\n")


def prose(text):
    """(number, line) of all lines that are not code, rows of tables included."""
    return ((number, line) for number, line, block in parts(text) if not block)
