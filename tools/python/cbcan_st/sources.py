# SPDX-License-Identifier: MIT
"""The text of a program, and the places in it."""

from __future__ import annotations

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


def text_of(path: pathlib.Path) -> str:
    """Of PLCopen XML too: xml2st translates it, and a ladder diagram in it."""
    if path.suffix.lower() != ".xml":
        return path.read_text("utf-8")
    if not shutil.which("xml2st"):
        raise StError(str(path), "xml2st, which translates PLCopen XML, is not found; OpenPLC's editor has it")
    with tempfile.TemporaryDirectory() as folder:
        shutil.copy(path, pathlib.Path(folder, "plc.xml"))
        said = subprocess.run(["xml2st", "--generate-st", "plc.xml"], cwd=folder, capture_output=True, text=True)
        try:
            return pathlib.Path(folder, "program.st").read_text("utf-8")
        except FileNotFoundError:
            raise StError(str(path), f"xml2st has made no program:\n{said.stdout}{said.stderr}") from None


class Sources:
    def __init__(self, files: Iterable[str], folder: str | os.PathLike[str] = "") -> None:
        """Files that together are one program, as it is uploaded to OpenPLC; each after those that it uses. A name that is not in the folder may be
        that of a file in tools/st."""
        paths = {file: pathlib.Path(folder, file) for file in files}
        self.texts = [(file, text_of(path if path.exists() or not (LIBRARY / file).exists() else LIBRARY / file)) for file, path in paths.items()]
        self.joined = "\n".join(text for _, text in self.texts)

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
