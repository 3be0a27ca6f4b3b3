# SPDX-License-Identifier: MIT
"""The engines that need a compiler: MATIEC's iec2c (OpenPLC, Beremiz) or STruC++ translates the program, a C or C++ compiler makes a library of it.
Libraries are kept in the user's cache, by the program's text."""

from __future__ import annotations

import ctypes
import pathlib
import re
import shutil
import subprocess
import tempfile
from typing import NamedTuple

from .exchange import Address, Image, has_scanner
from .machine.lexer import StError
from .sources import Sources, kept

HERE = pathlib.Path(__file__).resolve().parent
CELLS = {"X": ctypes.c_uint8, "W": ctypes.c_uint16, "D": ctypes.c_uint32}
MOST_LINES = 20  # of what a compiler says
COMPILERS = {"iec2c": "cc", "strucpp": "c++"}


def available(name: str) -> bool:
    return all(map(shutil.which, (name, COMPILERS[name])))


class Compiled:
    def __init__(self, sources: Sources, translator: str) -> None:
        self.library = library = ctypes.CDLL(str(built(sources, translator)))
        library.names.restype, library.value_of.restype, library.register_of.restype = ctypes.c_char_p, ctypes.c_void_p, ctypes.c_void_p
        library.scan.argtypes = ctypes.c_ulong, ctypes.c_longlong
        self.image, self.tick, self.interval = Image(), 0, library.start() // 1000
        places = [(sources.address(name), library.value_of(i)) for i, name in enumerate(library.names().decode().split())]
        if not has_scanner(at for at, _ in places) and library.register_of(0):
            places += [(Address.of(f"%MW{3700 + i}"), library.register_of(i)) for i in range(70)]
        cells = [(at, CELLS[at.size].from_address(value)) for at, value in places]
        self.words = [(at.register, cell) for at, cell in cells if at.size == "W"]  # most are words; this takes a third of the time
        self.others = [(at, cell) for at, cell in cells if at.size != "W"]
        self.addresses = [at for at, _ in cells]

    def scan(self, now: int) -> None:
        image = self.image
        for register, cell in self.words:
            cell.value = image[register]
        for at, cell in self.others:
            cell.value = image.read(at)
        self.library.scan(self.tick, now)
        self.tick += 1
        image.update((register, cell.value) for register, cell in self.words)
        for at, cell in self.others:
            image.write(at, cell.value)

    def ended(self, name: str) -> bool:
        return bool(getattr(self.library, name.lower())())


class Translated(NamedTuple):
    header: list[str]  # lines of generated.h
    names: list[str]  # addresses
    flags: dict[str, list[str]]  # DONE and GAVE_UP: expressions
    registers: str  # an expression, of i
    command: list[object]  # without the glue


def built(sources: Sources, translator: str) -> pathlib.Path:
    """The library, from the cache if it is there."""
    tool = pathlib.Path(shutil.which(translator) or translator).resolve()
    translate, glue = {"iec2c": (matiec, HERE / "matiec.c"), "strucpp": (strucpp, HERE / "strucpp.cpp")}[translator]
    made = kept(".so", tool, sources.joined, glue.read_text())
    if not made.exists():
        with tempfile.TemporaryDirectory(dir=made.parent) as name:
            folder = pathlib.Path(name)
            (folder / "program.st").write_text(sources.joined, "utf-8")
            found = translate(sources, tool, folder)
            defined = {"NAMES": f'"{" ".join(found.names)}"', "REGISTERS": found.registers,
                       **{macro: " || ".join([*found.flags[flag], "0"]) for macro, flag in (("IS_DONE", "DONE"), ("HAS_GIVEN_UP", "GAVE_UP"))}}
            (folder / "generated.h").write_text("".join(f"{line}\n" for line in [*found.header, *(f"#define {key} {defined[key]}" for key in defined)]))
            run(sources, folder, *found.command, "-w", "-O1", "-shared", "-fPIC", "-I.", glue, "-o", "program.so", "-lm")
            (folder / "program.so").rename(made)  # in one step: several processes may do so
    return made


def run(sources: Sources, folder: pathlib.Path, *command: object) -> None:
    ended = subprocess.run(list(map(str, command)), cwd=folder, capture_output=True, text=True)
    if ended.returncode:
        said = re.sub(r"\bprogram\.st:(\d+)", lambda found: sources.place(int(found[1])), ended.stdout + ended.stderr)
        raise StError(pathlib.Path(str(command[0])).name, "\n".join([f"exit code {ended.returncode}", *said.splitlines()[:MOST_LINES]]))


def library_folder(tool: pathlib.Path, *names: str) -> pathlib.Path:
    for folder in (parent / name for parent in list(tool.parents)[:3] for name in names):
        if folder.is_dir():
            return folder
    raise StError(str(tool), f"its folder {names[0]} is neither next to it nor next to its folder")


def matiec(sources: Sources, tool: pathlib.Path, folder: pathlib.Path) -> Translated:
    library = library_folder(tool, "lib")
    run(sources, folder, tool, "-I", library, "program.st")
    located = re.findall(r"(?m)^__LOCATED_VAR\(.*\)", (folder / "LOCATED_VARIABLES.h").read_text())  # the last line may be no C
    variables = (folder / "VARIABLES.csv").read_text()
    headers = [path for path in sorted(folder.glob("*.h")) if path.name not in ("POUS.h", "LOCATED_VARIABLES.h")]
    lines = [*(f'#include "{path.name}"' for path in headers), f"#define LOCATED {' '.join(located)}"]
    lines += [f"extern {kind} {resource}__{instance};" for resource, instance, kind in re.findall(r"(?m)^\d+;\w+\.(\w+)\.(\w+);(\w+);$", variables)]
    flags = {flag: [f"{resource}__{instance}.{flag}.value" for resource, instance in re.findall(rf"(?m);\w+\.(\w+)\.(\w+)\.{flag};.*;BOOL;", variables)]
             for flag in ("DONE", "GAVE_UP")}
    window = any(re.search(r"\(\w*CBCAN_WINDOW\w*,CBCAN\)", path.read_text()) for path in headers)
    made = [path for path in sorted(folder.glob("*.c")) if path.name != "POUS.c"]  # the resource's includes it
    return Translated(lines, [re.sub(r".*,\s*__(\w+?)(?:_(\d+))?,.*,.*,.*", r"%\1.\2", text).rstrip(".") for text in located], flags,
                      "&__GET_GLOBAL_CBCAN()->table[0].REGS.table[i]" if window else "0", ["cc", f"-I{library}/C", f"-I{library}", *made])


def strucpp(sources: Sources, tool: pathlib.Path, folder: pathlib.Path) -> Translated:
    run(sources, folder, tool, "program.st", "-o", "program.cpp")
    header, text = (folder / "program.hpp").read_text(), (folder / "program.cpp").read_text()
    bodies = dict(re.findall(r"(?ms)^class (Program_\w+) : .*?\{(.*?)^\};", header))
    flags = {flag: [f"configuration.{instance}.{flag}" for kind, instance in re.findall(r"(?m)^ +(Program_\w+) (\w+);", header)
                    if f"IEC_BOOL {flag};" in bodies[kind]] for flag in ("DONE", "GAVE_UP")}
    include = library_folder(tool, "runtime/include", "src/runtime/include")
    (configuration,) = re.findall(r"class (Configuration_\w+) :", header)
    return Translated([f"static {configuration} configuration;"], re.findall(r"(?m)// \w+ AT (%\S+)$", text), flags,
                      "CBCAN.value[1].REGS[3700 + i].raw_ptr()" if "<CBCAN_WINDOWS> CBCAN" in header else "nullptr",
                      ["c++", "-std=c++17", f"-I{include}", "program.cpp"])
