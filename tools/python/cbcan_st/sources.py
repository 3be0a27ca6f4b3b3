# SPDX-License-Identifier: MIT
"""The text of a program, and the places in it."""

from __future__ import annotations

import os
import pathlib
import re
from typing import Iterable

from . import machine
from .exchange import Address
from .machine.lexer import StError

LIBRARY = pathlib.Path(machine.__file__).resolve().parents[1]  # tools/st


class Sources:
    def __init__(self, files: Iterable[str], folder: str | os.PathLike[str] = "") -> None:
        """Files that together are one program, as it is uploaded to OpenPLC; each after those that it uses. A name that is not in the folder may be
        that of a file in tools/st."""
        paths = {file: pathlib.Path(folder, file) for file in files}
        self.texts = [(file, (path if path.exists() or not (LIBRARY / file).exists() else LIBRARY / file).read_text("utf-8")) for file, path in paths.items()]
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
