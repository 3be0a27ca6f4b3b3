# SPDX-License-Identifier: MIT
"""A PLC program in Structured Text, scan by scan in the time of a plant of cbcan-sim: docs/how-to/structured-text.md. The program cbcan-st is
main(), Program is what pytest's fixture `st` has."""

from __future__ import annotations

import argparse
import os
import sys
from typing import Any, Callable, NoReturn

__path__.append(os.path.join(os.path.dirname(os.path.realpath(__file__)), "../../st"))  # machine; in the wheel it is in this folder

from cbcan_plant import GAVE_UP, NotWithin, Plant, PlantError

from .compiled import COMPILERS, Compiled, available
from .exchange import Exchange
from .interpreted import Interpreted
from .machine.lexer import StError
from .sources import Sources

HELP = """cbcan-st: runs a PLC program in Structured Text (IEC 61131-3) scan by scan, in
the time of the plant that has started it

Usage:  cbcan-sim --clock manual ... -- cbcan-st [OPTION...] FILE...
        cbcan-sim ... --explore -- cbcan-st [OPTION...] FILE...

The files are one text, in this order; cia405.st and others of cbcan's own are
found by name. A BOOL variable DONE of a program ends it with exit code 0,
GAVE_UP with 75.

Options:
  --engine NAME  machine (needs Python alone), or iec2c or strucpp: translated by
                 this program, and compiled; by default one that is there
  --scans N      Ends after N scans with exit code 0
  -h, --help     Prints this
"""


class Program(Exchange):
    """A program beside a plant: program["main.level"] is a variable, by instance or, where one program has it, without. A TIME is in seconds."""

    def __init__(self, plant: Plant, *files: str, folder: str | os.PathLike[str] = "") -> None:
        """Paths are relative to the folder."""
        super().__init__(plant, Interpreted(Sources(files, folder)))

    def __enter__(self) -> Program:
        return self

    def __exit__(self, *_: object) -> None:
        """Nothing is left open."""

    def __getitem__(self, name: str) -> Any:
        return self.engine.get(name)

    def __setitem__(self, name: str, value: Any) -> None:
        """Once; the program may change it."""
        self.engine.set(name, value)

    def force(self, name: str, value: Any) -> None:
        """Before and after each call of a program, until release()."""
        self.engine.set(name, value)
        self.engine.forced[name] = value

    def release(self, name: str) -> None:
        del self.engine.forced[name]

    def run(self, until: Callable[[], bool] | str, within: float = 60) -> float:
        """Scans until the condition, or the BOOL of this name, is true. Returns the plant's time. Raises NotWithin after so many seconds of it."""
        limit = self.now + within * 1e6
        while not (until() if callable(until) else self[until]):
            if self.now >= limit:
                raise NotWithin(f"not within {within} s: {until}")
            self.scan()
        return self.now / 1e6


def main() -> NoReturn:
    parser = argparse.ArgumentParser("cbcan-st", "cbcan-st [OPTION...] FILE...")
    parser.add_argument("file", nargs="+")
    parser.add_argument("--scans", type=int)
    parser.add_argument("--engine", choices=("machine", *COMPILERS))
    parser.format_help = lambda: HELP  # type: ignore
    arguments = parser.parse_args()
    try:
        sources, engine = Sources(arguments.file), arguments.engine or next(filter(available, COMPILERS), "machine")
        exchange = Exchange(Plant.around(), Interpreted(sources) if engine == "machine" else Compiled(sources, engine), alone=True)
        scans, end = 0, None
        while not end and scans != arguments.scans:
            end, scans = exchange.scan(), scans + 1
    except (PlantError, StError, OSError, UnicodeError) as error:
        sys.exit(f"cbcan-st: {error}")
    sys.exit(GAVE_UP if end == "GAVE_UP" else 0)
