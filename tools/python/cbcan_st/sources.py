# SPDX-License-Identifier: MIT
"""The text of a program, and the places in it."""

from __future__ import annotations

import hashlib
import os
import pathlib
import re
import shutil
import subprocess
import tempfile
from typing import Iterable

from . import machine
from .exchange import Address
from .machine.lexer import StError

LIBRARY = pathlib.Path(machine.__file__).resolve().parents[1]  # tools/st
STRUCT_AS_BLOCK = re.compile(r"FUNCTION_BLOCK (\w+)\s+VAR_INPUT\s([^()]*?)END_VAR\s+VAR\s+local_temp : DINT;\s+END_VAR\s+local_temp := 0;\s+END_FUNCTION_BLOCK")


def kept(suffix: str, tool: pathlib.Path, *texts: str) -> pathlib.Path:
    """The file in the user's cache for what the tool makes of these texts; its folder is there."""
    cache = pathlib.Path(os.environ.get("XDG_CACHE_HOME") or pathlib.Path.home() / ".cache") / "cbcan-st"
    cache.mkdir(parents=True, exist_ok=True)
    return cache / (hashlib.sha256(repr((texts, str(tool), tool.stat().st_mtime)).encode()).hexdigest()[:32] + suffix)


def text_of(path: pathlib.Path) -> str:
    """Of PLCopen XML too: xml2st translates it, and a ladder diagram in it, once: --explore starts a program for each run."""
    if path.suffix.lower() != ".xml":
        return path.read_text("utf-8")
    tool = shutil.which("xml2st")
    if not tool:
        raise StError(str(path), "xml2st, which translates PLCopen XML, is not found; OpenPLC's editor has it")
    made = kept(".st", pathlib.Path(tool), path.read_text("utf-8"))
    if made.exists():
        return made.read_text("utf-8")
    with tempfile.TemporaryDirectory(dir=made.parent) as folder:
        shutil.copy(path, pathlib.Path(folder, "plc.xml"))
        said = subprocess.run([tool, "--generate-st", "plc.xml"], cwd=folder, capture_output=True, text=True)
        try:
            return pathlib.Path(folder, "program.st").rename(made).read_text("utf-8")
        except FileNotFoundError:
            raise StError(str(path), f"xml2st has made no program:\n{said.stdout}{said.stderr}") from None


def with_structs(text: str) -> str:
    """xml2st of OpenPLC's editor writes each STRUCT as a FUNCTION_BLOCK after the types: back, before its first use. Lines keep their numbers."""
    structs = STRUCT_AS_BLOCK.findall(text)
    text = STRUCT_AS_BLOCK.sub(lambda found: "\n" * found[0].count("\n"), text)
    if structs and "END_TYPE" not in text:
        text = text.replace("\n\n\n", "\nTYPE\nEND_TYPE\n", 1)
    for name, members in reversed(structs):
        at = re.search(rf"(?m)^[^:\n]*:.*\b{name}\b|END_TYPE", text).start()
        text = f"{text[:at]}{name} : STRUCT {' '.join(members.split())} END_STRUCT; {text[at:]}"
    return text


class Sources:
    def __init__(self, files: Iterable[str], folder: str | os.PathLike[str] = "") -> None:
        """Files that together are one program, as it is uploaded to OpenPLC; each after those that it uses. A name that is not in the folder may be
        that of a file in tools/st."""
        paths = {file: pathlib.Path(folder, file) for file in files}
        paths = {file: path if path.exists() or not (LIBRARY / file).exists() else LIBRARY / file for file, path in paths.items()}
        self.texts = [(f"{file} as ST" if path.suffix.lower() == ".xml" else file, with_structs(text_of(path))) for file, path in paths.items()]
        self.joined = "\n".join(text for _, text in self.texts)
        exchange = re.search(r"(?i)\bPROGRAM\s+cbcan_exchange\b", self.joined)
        if exchange and "END_CONFIGURATION" in self.joined and not re.search(r"(?i):\s*cbcan_exchange\b", self.joined):
            raise StError(self.place(self.joined.count("\n", 0, exchange.start()) + 1), "no task runs cbcan_exchange; in the CONFIGURATION, "
                          "PROGRAM exchange WITH TASK : cbcan_exchange; goes before your own")

    def place(self, line: int) -> str:
        """file:line of a line of the joined text"""
        for file, text in self.texts:
            lines = text.count("\n") + 1
            if line <= lines:
                break
            line -= lines
        return f"{file}:{line}"

    def address(self, text: str) -> Address:
        try:
            return Address.of(text)
        except ValueError as error:
            found = re.search(re.escape(text) + r"\b", self.joined, re.IGNORECASE)
            raise StError(self.place(self.joined.count("\n", 0, found.start()) + 1 if found else 1), str(error)) from None
