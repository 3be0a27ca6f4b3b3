# SPDX-License-Identifier: MIT
"""The project's Markdown pages in all folders, and their parts."""

import dataclasses
import pathlib
import re

import tree
from tree import ROOT

LEAST_PAGES = 25
COMMENT = re.compile(r"<!--.*?-->")
LINK = re.compile(r"\]\(([^)#]*)(#[^)]*)?\)")


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


def anchors(page):
    """Anchors as links name them: headings (the second of the same name with -1) and <a id="...">."""
    found = set()
    for _, line in prose(page.read_text()):
        found |= {f"#{name}" for name in re.findall(r'<a id="([^"]+)">', line)}
        if re.match("#+ ", line):
            heading = "#" + re.sub(r"[^\w -]", "", COMMENT.sub("", line).lstrip("#").strip().lower()).replace(" ", "-")
            found.add(heading if heading not in found else f"{heading}-1")
    return found


def dead_links(page, text):
    for number, line in prose(text):
        for target, anchor in LINK.findall(line):
            if "://" in target:
                continue
            file = (page.parent / target).resolve() if target else page
            if not file.exists():
                yield number, f"the link leads nowhere: {target}"
            elif anchor and anchor not in anchors(file):
                yield number, f"the link leads nowhere: {target} has no heading {anchor}"
