#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Fails on words that are never right, on sentences of more than 30 words, on headings that are questions, on more words than
tests/limits.toml allows, and on pages without a link to them. Words are checked in pages, manual pages, the web page, comments and every string of the programs (--help, messages).

Words are counted as a reader sees them: prose, cells of tables (generated ones too) and code; not link targets, comments, tags and bare punctuation.
The READMEs that say where a directory begins are not counted.

usage: english.py [--words]      --words: prints each page's number of words
"""

import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests/support"))
import page_blocks
from limits import LIMITS

MOST_WORDS = 30  # of a sentence
DIRECTORY = "\n* **Never here**: "
LEAST_SENTENCES, LEAST_STRINGS, LEAST_DOCUMENTS, LEAST_COMMENTS = 4000, 1500, 40, 6000
# A pattern that is never right: what to write instead.
WORDS = {
    r"stands?(?! (?:for|still)\b)": "is, appears",
    r"behind (?:it|them|that|those|each|which|this|one|the (?:first|last|node|other))|one behind the other": "after, next",
    r"(?:is|are|was|were|be|been) told": "reported",
    r"nobody|somebody|anybody|whoever|no one": "name who: a node, a client, a program",
    r"occasions?(?!=)": "matching frame",
    r"(?:each|the|of|own|no|another) doors?|doors": "bus connection",
    r"besides(?=[.,;:)]|$)|anew": "also; again",
    r"(?:is|are|was|were) over(?= *[.,;:)]|$)": "has ended",
    r"under way": "in progress",
    r"in the place of": "instead of",
    r"(?:has|have|of|all|by) chance": "a random sequence, randomness",
    r"(?:un)?harmed": "altered, unaffected",
    r"looked at": "checked, polled",
    r"taken back|given up|held back|holds? back": "cancelled, abandoned, delayed",
    r"in a crowd": "under load",
    r"clock on the wall": "wall clock",
    r"the house|rooms|(?:the|each|this|which) room(?! for\b)": "architecture; directory",
    r"held to": "checked against",
    r"so many times": "N times",
    r"(?:is|are) so|so it is|likewise": "holds; the same applies",
    r"is (?:not )?liked": "accepted, rejected",
    r"as ever|for ever": "as before; without limit",
}
BANNED = re.compile("|".join(rf"(?P<w{number}>\b(?:{pattern})\b)" if not pattern.endswith("$)") else rf"(?P<w{number}>\b(?:{pattern}))"
                             for number, pattern in enumerate(WORDS)), re.IGNORECASE)

# A comment begins with a noun or a verb: these first words leave out what the rest is about.
FRAGMENT = re.compile(r"(?:Of|By|As|Until|Since|Like|To be|In place of|At most|At least|Not of|Without that) ")
WITH_SUBJECTS = ("firmware", "hostsim", "regmap", "tools")

HEADING = re.compile(r"\b(?:what|who|so)\b", re.IGNORECASE)
VERBS = set("""Add Address Answer Arm Build Call Change Check Choose Compile Connect Copy Describe Fail Fill Give Hand Let Look Make Open Play Provide Put Read
            Replace Run See Send Set Share Start Try Use Watch Wire Write""".split())

CODE, LINK, COMMENT, TAG = re.compile(r"`[^`]*`"), re.compile(r"!?\[([^]]*)\]\([^)]*\)"), re.compile(r"<!--.*?-->"), re.compile(r"<[^>]*>")
SENTENCE_END = re.compile(r'(?<=[.?!])\)?[*"]*\s+(?=[A-Z0-9"*`(_|\[]|\d)')
STRING = re.compile(r'"((?:[^"\\\n]|\\.)*)"')
ABBREVIATIONS = re.compile(r"\b(?:e\.g|i\.e|etc|min|max|No)\.")

def words_of(text):
    return [word for word in TAG.sub(" ", COMMENT.sub("", text)).split() if re.search(r"\w", word)]


def plain(text):
    """The text as read: code is one word, a link is its text."""
    return ABBREVIATIONS.sub("etc", TAG.sub(" ", LINK.sub(r"\1", COMMENT.sub("", CODE.sub("Code", text))))).replace("**", "")


def units(page):
    """(line, text) of each paragraph, list item, heading and cell of a table."""
    text, first = [], 0
    for number, line in [*page_blocks.prose(page.read_text()), (0, "")]:
        begins = not line.strip() or line.startswith(("#", "|")) or re.match(r" *(?:[*-] |\d+\. )", line)
        if text and (begins or number != first + len(text)):
            yield first, " ".join(text)
            text = []
        if line.startswith("|"):
            yield from ((number, cell.strip()) for cell in re.split(r"(?<!\\)\|", line) for cell in cell.split("<br>") if cell.strip("- "))
        elif line.startswith("#"):
            yield number, line
        elif line.strip():
            text, first = (text + [line.strip()], first) if text else ([line.strip()], number)


def sentences(page):
    for line, text in units(page):
        if not text.startswith("#"):
            for sentence in SENTENCE_END.split(plain(text)):
                yield line, sentence.strip()


def banned(text):
    for match in BANNED.finditer(text):
        yield f'"{match[0]}": write {list(WORDS.values())[int(match.lastgroup[1:])]}'


def of_page(page):
    for line, sentence in sentences(page):
        if (count := len(words_of(sentence))) > MOST_WORDS:
            yield line, f"a sentence of {count} words; {MOST_WORDS} is the most: {sentence[:60]}..."
    is_tutorial = "tutorials" in page.parts
    for line, text in units(page):
        yield from ((line, why) for why in banned(plain(text)))
        if text.startswith("#") and HEADING.search(text):
            yield line, f"a heading names the task or the thing: {text}"
        if is_tutorial and text.startswith("## ") and text.split()[1] not in VERBS:
            yield line, f"a step of a tutorial begins with a verb: {text}"


def strings():
    """(place, text) of the strings of the programs."""
    for folder in ("hostsim", "regmap", "tools"):
        for path in sorted((ROOT / folder).rglob("*")):
            if path.suffix in (".cpp", ".hpp") or path.parent.name == "help" or path.suffix in (".js", ".html") and not path.name.startswith("uPlot"):
                for number, line in enumerate(path.read_text().splitlines(), 1):
                    code = line.partition("// ")[0]
                    if path.suffix in (".html", ".txt") or not code.lstrip().startswith(("///", "//", "*", "#include")):
                        for text in [code] if path.suffix in (".html", ".txt") else STRING.findall(code):
                            if " " in text:
                                yield f"{path.relative_to(ROOT)}:{number}", text


C_LIKE = r"///?|/?\*+(?!/)"
MARKS = {".cpp": C_LIKE, ".hpp": C_LIKE, ".h": C_LIKE, ".js": C_LIKE, ".mjs": C_LIKE, ".lua": "--", ".py": "#", ".sh": "#", ".txt": "#", ".cmake": "#",
         ".toml": "#", ".yml": "#", ".dict": "#", "": "#"}
FOLDERS = ("arduino", "bench", "cmake", "examples", "firmware", "hostsim", "packaging", "plants", "regmap", "scenarios", "tests", "tools", "zephyr")


def sources():
    for folder in FOLDERS:
        for path in sorted((ROOT / folder).rglob("*")):
            if path.suffix in MARKS and path.is_file() and "corpus" not in path.parts and not path.name.startswith("uPlot"):
                yield path


def comments():
    """(place, text) of each block of comment lines, docstring, comment after code, and name of a test."""
    for path in sources():
        mark, block, first, in_docstring = MARKS[path.suffix], [], 0, False
        for number, line in enumerate([*path.read_text().splitlines(), ""], 1):
            text = re.match(rf"\s*(?:{mark}|TEST_CASE\()[!<]* ?(.*)", line)
            if path.suffix in (".py", "") and (in_docstring or line.strip().startswith('"""')):
                text = [None, line.strip()]
                in_docstring ^= line.count('"""') % 2 == 1
            if not text and block:
                yield f"{path.relative_to(ROOT)}:{first}", " ".join(block)
                block = []
            if text:
                block, first = block + [text[1]], first if block else number
            elif (after := re.search(rf"\s(?:{mark})[!<]* (.*)$", line)) and line[:after.start()].count('"') % 2 == 0:
                yield f"{path.relative_to(ROOT)}:{number}", after[1]


def links_of(page):
    return {(page.parent / target).resolve() for target in re.findall(r"\]\(([^)#]+)", page.read_text())}


def of_index(documents):
    """Each page of docs/ is linked from docs/README.md, each other one from some page."""
    index, first = ROOT / "docs/README.md", ROOT / "README.md"
    linked, anywhere = links_of(index), set().union(*map(links_of, documents))
    in_docs = [page for page in documents if page.is_relative_to(index.parent) and page != index]
    return [f"docs/README.md: no link to {page.relative_to(ROOT)}" for page in in_docs if page not in linked] + [
        f"no page links to {page.relative_to(ROOT)}" for page in documents if page not in anywhere and page != first]


def main():
    documents = page_blocks.pages()
    found, counts, read = of_index(documents), {}, 0
    for page in documents:
        name = str(page.relative_to(ROOT))
        counts[name] = 0 if DIRECTORY in page.read_text() else len(words_of(page.read_text()))
        read += len(list(sentences(page)))
        found += [f"{name}:{line}: {why}" for line, why in sorted(set(of_page(page)))]
    said = list(strings())
    found += [f"{place}: {why}" for place, text in said for why in banned(text)]
    read_comments = list(comments())
    found += [f"{place}: {why}" for place, text in read_comments for why in banned(text)]
    found += [f"{place}: a comment begins with a noun or a verb: {text[:60]}" for place, text in read_comments
              if FRAGMENT.match(text) and place.startswith(WITH_SUBJECTS) and pathlib.Path(place.partition(":")[0]).suffix in (".cpp", ".hpp")]
    print("\n".join(found))
    if "--words" in sys.argv:
        print("\n".join(f"{count:6,} {name}" for name, count in counts.items()), f"{sum(counts.values()):6,} words", sep="\n")
    print(f"{len(documents)} pages with {sum(counts.values()):,} words, {read:,} sentences; {len(said):,} strings; {len(read_comments):,} comments")
    if len(documents) < LEAST_DOCUMENTS or read < LEAST_SENTENCES or len(said) < LEAST_STRINGS or len(read_comments) < LEAST_COMMENTS:
        sys.exit("too few: the check looks in the wrong place")
    if sum(counts.values()) > LIMITS["words"]["all"]:
        sys.exit(f"more than {LIMITS['words']['all']:,} words in all pages")
    sys.exit(1 if found else 0)


main()
