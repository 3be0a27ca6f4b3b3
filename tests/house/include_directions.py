#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Fails if a file includes a header that its directory must not use (docs/explanation/architecture.md, "Directories")."""

import pathlib
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]

FIRMWARE = {"firmware/cbcan", "firmware/cbcan/canopen", "firmware/cbcan/coprocessor", "firmware/cbcan/modbus", "firmware/cbcan/slcan"}
BASE = "hostsim/base"
DESCRIPTIONS = {"hostsim/descriptions", BASE}
SIMULATION = {"hostsim/sim", *DESCRIPTIONS, *FIRMWARE, "regmap"}
PLANT = {"hostsim/plant", "hostsim/config", "hostsim/protocols", "hostsim/journal", "hostsim/devices", *SIMULATION}
SESSION = {"hostsim/session", "hostsim/web", "hostsim/scenario", *PLANT}

# Directory (an inner one before the outer) -> other directories that it may include.
MAY_KNOW = {
    "regmap": set(),
    "firmware/cbcan/canopen": {"firmware/cbcan"},
    "firmware/cbcan/coprocessor": {"firmware/cbcan/canopen", "firmware/cbcan", "regmap"},
    "firmware/cbcan/modbus": set(),
    "firmware/cbcan/slcan": {"firmware/cbcan"},
    "firmware/cbcan": set(),
    "firmware/boards": {*FIRMWARE, "regmap"},
    BASE: set(),
    "hostsim/descriptions": {BASE, "firmware/cbcan/canopen", "regmap"},
    "hostsim/window": {"regmap"},
    "hostsim/sim": {*DESCRIPTIONS, *FIRMWARE, "regmap"},
    "hostsim/protocols": {"hostsim/window", "firmware/boards", *SIMULATION},
    "hostsim/devices/lua": {"hostsim/devices", *SIMULATION},
    "hostsim/devices": SIMULATION,
    "hostsim/journal": {"hostsim/protocols", *SIMULATION},
    "hostsim/io": {"hostsim/window", "hostsim/protocols", "hostsim/journal", "firmware/boards", *SIMULATION},
    "hostsim/config": {"hostsim/devices", "hostsim/devices/lua", *SIMULATION},
    "hostsim/plant/include": set(),
    "hostsim/plant": {"hostsim/plant/include", *PLANT},
    "hostsim/scenario/search": {"hostsim/scenario", *PLANT},
    "hostsim/scenario": PLANT,
    "hostsim/web": {"hostsim/scenario", *PLANT},
    "hostsim/session": SESSION,
    "hostsim/module": {"hostsim/scenario/search", *SESSION},
    "hostsim/app": {"hostsim/scenario/search", "hostsim/window", "hostsim/io", *SESSION},
    "tools": {"hostsim/window", *DESCRIPTIONS, "regmap"},
}

# First folder of an include path -> directory.
PREFIXES = {"boards": "firmware/boards",
            **{name: f"hostsim/{name}" for name in ("base", "descriptions", "sim", "protocols", "journal", "devices", "io", "config", "plant", "scenario", "session", "module", "web",
                                                    "window", "app")}}

# Standard headers allowed in the freestanding core: no heap, no OS, no clock, no stream.
FREESTANDING = {"algorithm", "array", "atomic", "bit", "concepts", "cstddef", "cstdint", "limits", "optional", "span",
                "string_view", "type_traits", "utility"}

# These directories have no operating system, so that they also run as WebAssembly: no clock, no threads, no I/O, no unseeded random numbers.
PURE = {f"hostsim/{name}" for name in ("base", "descriptions", "sim", "devices", "devices/lua", "journal", "protocols", "config", "plant", "scenario", "scenario/search", "web", "session", "module")}
IMPURE = re.compile(r"chrono|thread|stop_token|mutex|shared_mutex|condition_variable|future|random|c?time|csignal|[io]?fstream|iostream|filesystem"
                    r"|\w+\.h|(arpa|linux|net|netinet|sys)/.*")

# The files in pure directories that open files.
FILES = {"hostsim/base/read_file.hpp", "hostsim/base/read_file.cpp", "hostsim/plant/library.cpp"}

LUA = re.compile(r"lua\.hpp|lua\.h|lualib\.h|lauxlib\.h")

INCLUDE = re.compile(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]')


def room_of(path):
    for room in MAY_KNOW:
        if path.is_relative_to(room):
            return room
    return None


def room_of_include(name):
    if name in ("cbcan/regmap.hpp", "cbcan/regmap.h", "cbcan/mistakes.hpp", "cbcan/sdo_abort_codes.hpp"):
        return "regmap"
    if name == "cbcan/sim.hpp":
        return "hostsim/plant/include"
    if name == "cbcan/window.hpp":
        return "hostsim/window"
    if name == "cbcan/cia405.hpp":
        return "tools"
    first, *rest = name.split("/")
    if first == "cbcan":
        return f"firmware/cbcan/{rest[0]}" if len(rest) > 1 else "firmware/cbcan"
    inner = f"hostsim/{first}/{rest[0]}" if len(rest) > 1 else None
    return inner if inner in MAY_KNOW else PREFIXES.get(first) if rest else None


def complaint(path, kind, name):
    room = room_of(path)
    opens_files = str(path) in FILES
    if kind == '"':
        target = room_of_include(name)
        if target and target != room and target not in MAY_KNOW[room]:
            return f"{room} may not know {target}"
        return f"{room} is pure: a FileReader is passed to it" if name == "base/read_file.hpp" and room in PURE and not opens_files else None
    if room in ("regmap", "firmware/boards", *FIRMWARE) and name not in FREESTANDING:
        return f"{room} is freestanding"
    if LUA.fullmatch(name):
        return None if room == "hostsim/devices/lua" else "only hostsim/devices/lua sees Lua's headers"
    paths_alone = room == BASE and name == "filesystem"
    if room in PURE and IMPURE.fullmatch(name) and not paths_alone and not opens_files:
        return f"{room} is pure: it is told what time it is and opens nothing"
    return None


def other_board(path, name):
    """The other board that a board's file includes; boards may include only common files, of all or of a family."""
    parts = name.split("/")
    own = path.parts[2] if path.is_relative_to("firmware/boards") and len(path.parts) > 3 else None
    known = {own, "common"} | ({"stm32"} if own and own.startswith("stm32") else set())
    return parts[1] if own and parts[0] == "boards" and parts[1] not in known else None


def check(path):
    room = room_of(path)
    found = []
    if room is None:
        return [f"{path}: is in no room"]
    for number, line in enumerate((ROOT / path).read_text().splitlines(), 1):
        match = INCLUDE.match(line)
        if match and (why := complaint(path, *match.groups())):
            found.append(f"{path}:{number}: includes {match[2]}: {why}")
        if match and (board := other_board(path, match[2])):
            found.append(f"{path}:{number}: includes {match[2]}: a board may not know {board}")
    return found


def check_contract_suite():
    """The cases use only a target; the adapters in the folders below implement it."""
    found = []
    for path in sorted((ROOT / "tests/contract").glob("*.[ch]pp")):
        for number, line in enumerate(path.read_text().splitlines(), 1):
            match = INCLUDE.match(line)
            if match and match[1] == '"' and not re.fullmatch(r"contract/\w+\.hpp|support/(catch|hex|skips|scanner_plc)\.hpp", match[2]):
                found.append(f"{path.relative_to(ROOT)}:{number}: includes {match[2]}: the suite knows only a target")
    return found


def main():
    files = sorted(f.relative_to(ROOT) for top in ("regmap", "firmware", "hostsim", "tools")
                   for f in (ROOT / top).rglob("*") if f.suffix in (".hpp", ".cpp", ".h", ".c"))
    found = [line for path in files for line in check(path)] + check_contract_suite()
    print("\n".join(found) if found else f"{len(files)} files keep to their rooms")
    if len(files) < 50:
        sys.exit(f"only {len(files)} files found: the check looks in the wrong place")
    sys.exit(1 if found else 0)


main()
