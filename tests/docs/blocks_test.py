#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Executes every code block of every page: plays, runs, compiles, loads or parses it, and compares its output with the page. Blocks that are not
executed are in a table here with the reason; an unknown block fails. run_snippets.py plays the sessions.

usage: blocks_test.py PROGRAM_DIR NPM_FOLDER EXAMPLE_PROGRAM...
"""

import concurrent.futures
import contextlib
import functools
import json
import pathlib
import re
import shlex
import shutil
import sys
import tempfile
import tomllib

import yaml

from tree import ROOT
sys.path.append(str(ROOT / "tests/packaging"))
import cases
import ci_files
import page_blocks
import plc
import run_snippets
from done import done, output
from serial_line import SerialLine
from simulator import LIMIT

BIN, NPM = (pathlib.Path(path).resolve() for path in sys.argv[1:3])
EXAMPLES = {pathlib.Path(path).name.removesuffix("_example"): pathlib.Path(path).resolve() for path in sys.argv[3:]}
PYTHON = "/usr/bin/python3"  # only this one finds Debian's pymodbus
ENVIRONMENT = {"PATH": f"{BIN}:/usr/bin:/bin", "PYTHONPATH": str(ROOT / "tools/python"), "PYTHONDONTWRITEBYTECODE": "1", "HOME": "/tmp",
               "PYTEST_ADDOPTS": "-W error::cbcan_plant.Advice"}

# Blocks that are not executed, by a pattern of their first line: why.
NOT_RUN = {
    r"flowchart |sequenceDiagram": "a picture",
    r"2004h = ": "what the programs of examples/clients print; clients() compares it",
    r"cbcan pressure transducer": "what two of the examples print; examples() compares it",
    r"ORG TU": "FATEK's mnemonics, for which there is no tool here; tests/st/plcopen_test.py plays the same as a ladder diagram",
    r"\$ examples/class\.sh ": "tests/examples/class_test.py runs it",
    r"\$ npx \./cbcan-": "tests/module/session_test.mjs types it",
    r"import assert ": "tests/module/plant_test.mjs runs the example and compares the page",
    r"plant\.toml:\d+: ": "messages; tests/config/pages_test.cpp compares them",
    r"machine\.toml:\d+: ": "messages; tests/descriptions/network_file_test.cpp has their form",
    r".*the network file wants 00020192h ": "tests/journal/boot_test.cpp has these lines",
    r"fault 5 ": "tests/sim/faults_text_test.cpp reads each line",
    r"(cbcan-sim: 12\.345678 )?(network 2: )?node 5: fault 1: ": "messages of faults; tests/system/control_test.py has their form",
}

# Commands that are not executed, by their beginning: why. Their files, options, presets and targets are still checked.
NOT_EXECUTED = {
    "mkfifo ": "tests/examples/class_test.py does the same",
    "dumpcap ": "needs the FIFO; the same test reads one by dumpcap",
    "tools/demo": "installs packages and builds, with --mcu an image too; tools/test runs it with --check",
    "tools/test": "runs this test",
    "tools/dev/wheel": "builds for minutes; tools/test --long does it",
    "pip ": "wheel_test.py does it",
    "npm install": "tests/module/install does it",
    "node --test": "plant_test.mjs does it",
    "python3 -m http.server": "serves without end; tab_test.mjs serves the folder itself",
    "python -m cbcan": "wheel_test.py does it",
    "tests/fuzz/run": "takes minutes; tools/test --long does it",
    "cmake --": "builds for minutes; tools/test does it",
    "ctest --preset": "runs this test",
    "sudo ": "installs; fresh_root_test.py does it in a Debian of its own",
    "podman ": "needs a container engine; fresh_root_test.py carries out the Containerfile",
    "cp build/": "needs a board",
    "st-flash ": "needs a board",
    "openocd ": "needs a board",
}

LONG_SESSIONS = {"explore.md", "port-in-an-hour.md"}  # half a minute each

# Programs whose commands have their own --help.
COMMANDS = {"cbcan-sim": [["run"]], "cbcan-st": [], "cbcan-eds": [], "cbcan-network": [], "cbcanctl": [[name] for name in ("configure", "dump", "emcy", "map", "read", "scan", "status", "write")]}

# Options of other projects' programs in prose.
FOREIGN_OPTIONS = {"--preset", "--install", "--prefix", "--gc-sections", "--cflags", "--libs", "--wsl"}

VALVE = """[FileInfo]
FileName=valve.dcf
[DeviceComissioning]
NodeID=5
""" + "".join(f"[{name}]\nParameterName=Object {name}\nDataType={kind}\nAccessType=rw\n" for name, kind in {
    "1000": "0x0007", "1001": "0x0005", "1017": "0x0006", "2001": "0x0006", "2010sub1": "0x0008", "2011": "0x0009", "2012": "0x000F",
    "2013": "0x0001"}.items()) + "[1018]\nParameterName=Identity\nObjectType=9\nSubNumber=1\n[2010]\nParameterName=Record\nObjectType=9\nSubNumber=1\n"
AROUND_WIRES = '[[node]]\nid = 66\neds = "io_module.eds"\n[[node]]\nid = 20\ndevice = "tank.lua"\n'


class Wrong(Exception):
    pass


def squeezed(text):
    return [" ".join(line.split()) for line in text.splitlines() if line.strip()]


@functools.cache
def shipped(folder):
    """(path, lines) of the sources in a folder; tests compile and run the examples."""
    return [(path, squeezed(path.read_text())) for path in sorted((ROOT / folder).rglob("*.*")) if path.is_file() and path.suffix != ".pyc"]


def stands_in(block, *folders):
    """The file that contains these lines in sequence, except for includes, which are at the top of the file."""
    wanted = squeezed(re.sub(r"\A(#include .*\n)+", "", block.text))
    for path, lines in [file for folder in folders for file in shipped(folder)]:
        if any(lines[i:i + len(wanted)] == wanted for i, line in enumerate(lines) if line == wanted[0]):
            return path
    return None


@functools.cache
def built():
    """The text of all CMake files: targets and switches."""
    files = [ROOT / "CMakeLists.txt", *(path for folder in ("bench", "cmake", "firmware", "hostsim", "tests", "tools") for path in (ROOT / folder).rglob("*")
                                        if path.name == "CMakeLists.txt" or path.suffix == ".cmake")]
    return "\n".join(path.read_text() for path in files)


@functools.cache
def help_of(program):
    """Its --help; for cbcan-sim and cbcanctl also that of their commands. For a script, its text."""
    if program not in COMMANDS:
        return (ROOT / program).read_text()
    return "".join(output(BIN / program, *command, "--help", env=ENVIRONMENT) for command in [[], *COMMANDS[program]])


def has_option(program, option):
    return re.search(rf"(?<![\w-]){option}(?![\w-])", help_of(program)) is not None


def look_for_names(command):
    """Checks the command's files, options, presets and targets."""
    presets = {preset["name"] for preset in json.loads((ROOT / "CMakePresets.json").read_text())["configurePresets"]}
    program = command.split()[0].removeprefix("build/bin/")
    ours = program in ("cbcan-sim", "cbcanctl") or (ROOT / program).is_file()
    for option in re.findall(r"(?<!\S)--[a-z][a-z-]*", command.partition(" -- ")[0]) if ours else []:
        if not has_option(program, option):
            raise Wrong(f"{program} has no option {option}")
    for preset in re.findall(r"--preset (\S+)", command):
        if preset not in presets:
            raise Wrong(f"no preset {preset}")
    for name in re.findall(r"-D(\w+)=|--target (\w+)|\bbuild/(?!wheel/)\S*?([\w-]+)(?:\.elf|\.bin)?(?=[\s:]|$)", command):
        if (name := "".join(name).removeprefix("cbcan_")) not in built():
            raise Wrong(f"CMake builds no {name}")
    for path in re.findall(r"(?<![\w./-])((?:arduino|bench|docs|examples|firmware|packaging|plants|scenarios|tools)/[\w./-]*)", command):
        if not (ROOT / path).exists():
            raise Wrong(f"no such file: {path}")


class Pages:
    def __init__(self, folder):
        self.job = ci_files.repository(folder / "job")
        for file in [*(ROOT / "plants").glob("*.*"), *(ROOT / "plants/quirks").glob("*"), *(ROOT / "plants/coupler").glob("*.eds"), *(ROOT / "packaging").glob("Containerfile")]:
            shutil.copy(file, self.job)
        (folder / "devices").mkdir()
        for place in (self.job, folder / "devices"):
            (place / "valve.dcf").write_text(VALVE)
        (self.job / "pump.csv").write_text("0,1\n1,2\n")
        (self.job / "kernel").write_bytes(bytes(64))
        (self.job / "run-tests").write_text("#!/bin/sh\ncbcanctl read 0 0x3001 0\n")
        (self.job / "run-tests").chmod(0o755)
        self.reasons, self.told = set(), set()  # used keys of NOT_RUN and NOT_EXECUTED; compared outputs

    def run(self, *command, **options):
        return done(*command, **{"cwd": self.job, "env": ENVIRONMENT, "timeout": LIMIT} | options).stdout

    def with_plant(self, *command, **options):
        """Runs a command with the demo plant at the pages' ports, in its own network namespace; the simulator has no advice for it."""
        ended = done(*run_snippets.ALONE, BIN / "cbcan-sim", "--demo", "-v", "--modbus", "127.0.0.1:1502", "--slcan", "127.0.0.1:5021", "--",
                     *command, **{"cwd": self.job, "env": ENVIRONMENT, "timeout": LIMIT} | options)
        if advice := re.findall(r".* advice: .*", ended.stderr):
            raise Wrong(f"{command}: {advice}")
        return ended.stdout

    def compare(self, printed, block, page):
        """Compares with the next block, or with the page's ```text blocks."""
        told = [other for other in page if other.language == "text"] + page[page.index(block) + 1:][:1]
        if printed not in [other.text for other in told]:
            raise Wrong(f"prints this, which the page does not say:\n{printed}")
        self.told |= {str(other) for other in told if other.text == printed}

    # ---- One for each language

    def toml(self, block, page):
        table = tomllib.loads(block.text)
        with tempfile.NamedTemporaryFile("w", dir=self.job, suffix=".toml") as file:
            around = {frozenset(["wire"]): AROUND_WIRES, frozenset(["explore"]): f'plant = "{ROOT}/plants/tank.toml"\n'}
            file.write(around.get(frozenset(table), "") + block.text)
            file.flush()
            if "step" in table:
                self.run("cbcan-sim", "run", file.name)
            elif any("device_type" in node for node in table.get("node", [])):
                self.with_plant("cbcanctl", "configure", file.name)
            elif "pdos" in table or any("pdos" in node for node in table.get("node", [])):  # a network file; its EDS files are those of the project
                network = self.job / "network.toml"
                around = '[[node]]\nid = 66\neds = "plants/demo/io_module.eds"\n' if "pdos" in table else ""
                network.write_text((around + block.text).replace('"plants/', f'"{ROOT}/plants/'))
                self.run("cbcanctl", "map", network, "--for", "csv")
            else:
                self.run("cbcan-sim", "--check", "--config", file.name)

    def sh(self, block, page):
        ran = False
        for line in block.text.replace("\\\n", " ").splitlines():
            command = line.partition(" #")[0].strip()
            while command:
                reason = next((key for key in NOT_EXECUTED if command.startswith(key)), None)
                single, _, rest = (command, "", "") if command.startswith("(") else command.partition(" && ")
                single = re.sub(r" [&;]$|;.*", "", single).strip()
                look_for_names(single)
                if reason:
                    self.reasons.add(reason)
                else:
                    self.execute(single)
                    ran = True
                command = rest
        return ran

    def execute(self, command):
        words = ["plant.toml" if word == "PLANT" else word for word in shlex.split(command.removeprefix("build/bin/"))]
        if "/dev/ttyACM0" in command:
            self.on_serial_line(command.removeprefix("build/bin/"))
        elif words[0].startswith("qemu-system-"):  # creates the machine without starting it; tests/firmware runs the images
            words[words.index("-kernel") + 1], words[words.index("-monitor") + 1] = "kernel", "stdio"
            self.with_plant("sh", "-c", f"echo quit | {shlex.join(words)} -S")
        elif words[0] == "pytest" or words[:2] == ["cbcan-sim", "run"] or "--" in words:
            self.run(*words)
        elif words[0] == "cbcan-sim":  # reads plant, EDS files and options without opening ports
            self.run(words[0], "--check", *words[1:])
        elif words[0] == "cbcanctl":
            self.with_plant(*words)
        elif words[0] in ("cbcan-eds", "cbcan-network"):
            self.run(*words[:words.index(">")])
        else:
            raise Wrong(f"{words[0]}: nothing here says how it is carried out; see NOT_EXECUTED")

    def on_serial_line(self, command):
        with contextlib.closing(SerialLine()) as line:
            self.run("cbcan-sim", "--demo", "--set", "module.parameters=stored", "--rtu", f"{line.ends[1]}", "--set", "rtu.baud=115200", "--set", "rtu.parity=E", "--set", f"rtu.station=1", "--", "sh", "-c",
                     command.replace("/dev/ttyACM0", line.ends[0]))

    def json(self, block, page):
        json.loads(block.text)

    def events(self, block, page):
        for line in block.text.splitlines():
            json.loads(line)

    def yaml(self, block, page):
        yaml.safe_load(block.text)
        if not stands_in(block, "packaging"):
            raise Wrong("is in no file of packaging/")

    def ini(self, block, page):
        if block.text != ci_files.PYTEST_INI:
            raise Wrong("is not the pytest.ini of the CI jobs that tests run")

    def python(self, block, page):
        if not stands_in(block, "examples/pytest", "examples/explore", "tests/packaging"):
            raise Wrong("is in no program of examples/pytest, examples/explore or tests/packaging")

    def clients(self):
        """Each program of examples/clients prints the output on its page. Runs where Node.js finds the packages."""
        page = ROOT / "docs/how-to/modbus-clients.md"
        expected, = (block.text for block in page_blocks.blocks(page) if block.language == "text")
        flags = self.run("pkg-config", "--cflags", "--libs", "libmodbus").split()
        for path in sorted((ROOT / "examples/clients").iterdir()):
            with tempfile.TemporaryDirectory(dir=NPM) as folder:
                shutil.copy(path, folder)
                command = {".py": [PYTHON, path.name], ".mjs": ["node", path.name], ".c": ["./three"]}[path.suffix]
                if path.suffix == ".c":
                    self.run("cc", "-Wall", "-Wextra", "-Werror", "-o", "three", path.name, *flags, cwd=folder)
                if (printed := self.with_plant(*command, cwd=folder)) != expected:
                    yield f"examples/clients/{path.name} prints, other than {page.name} says:\n{printed}"
        with tempfile.TemporaryDirectory() as folder:  # npm_ci leaves Node-RED out of short runs; the flow begins with a write, of which it shows the value too
            if cases.LONG and (printed := self.with_plant("node", "node_red.mjs", ROOT / "examples/node_red.json", folder, cwd=NPM)).splitlines()[1:] != expected.splitlines():
                yield f"examples/node_red.json shows, other than {page.name} says:\n{printed}"

    def examples(self):
        """Programs of which a page shows only the output, with a link."""
        page = ROOT / "docs/reference/function-blocks.md"
        shown = [block.text for block in page_blocks.blocks(page)]
        for name in ("function_blocks", "read_name"):
            if (printed := self.with_plant(EXAMPLES[name])) not in shown:
                yield f"examples/{name}.cpp prints, other than {page.name} says:\n{printed}"

    def cpp(self, block, page):
        file = stands_in(block, "examples", "tests/plant")
        if not file or block.first.startswith("// SPDX") and file.read_text() != block.text:
            raise Wrong("is in no example and no test as it is")
        if file.stem in EXAMPLES:
            self.compare(self.with_plant(EXAMPLES[file.stem]), block, page)

    def lua(self, block, page):
        """Checks it as the script of a device with the objects 2000h and 2001h; tests/plant/lua_test.cpp runs it. One beside a device is in plants/quirks."""
        if "before_update" in block.text and not stands_in(block, "plants/quirks"):
            raise Wrong("is in no script of plants/quirks")
        (self.job / "page.lua").write_text(block.text)
        (self.job / "lua.toml").write_text('[[node]]\nid = 20\neds = "tank.lua"\ndevice = "page.lua"\n')
        self.run("cbcan-sim", "--check", "--config", "lua.toml")

    def iecst(self, block, page):
        """Loads and scans a program once; tests/st runs it. A part is in a file of tools/st."""
        if program := re.search(r"PROGRAM (\w+)", block.text):
            plc.Machine(*plc.source("cia405.st", "conversions.st", "scanner.st"), ("page.st", block.text), plc.configuration(program[1])).scan(0)
        elif not stands_in(block, "tools/st", "examples/explore"):
            raise Wrong("is in no file of tools/st or examples/explore")

    def cmake(self, block, page):
        program = re.search(r"target_link_libraries\((\w+)", block.text)[1]
        with tempfile.TemporaryDirectory() as folder:
            folder = pathlib.Path(folder)
            (folder / "cbcan").symlink_to(ROOT)
            (folder / "main.cpp").write_text("int main() {}\n")
            (folder / "CMakeLists.txt").write_text(f"cmake_minimum_required(VERSION 3.21)\nproject(theirs CXX)\nadd_executable({program} main.cpp)\n" + block.text)
            self.run("cmake", "-S", folder, "-B", folder / "build", "-G", "Ninja")

    # ---- Choice of the method

    def language(self, block):
        shell = r"(build/bin/)?cbcan-sim |cmake |bench/|build/"
        guessed = (("toml", r"\["), ("sh", shell), ("cmake", r"add_subdirectory\("))
        return block.language or next((language for language, pattern in guessed if re.match(pattern, block.first)), "text")

    def carry_out(self, block, page):
        """True: it ran. False: it is in NOT_RUN or NOT_EXECUTED."""
        if block.language == "diagram":
            return False
        if reason := next((key for key in NOT_RUN if re.match(key, block.first)), None):
            self.reasons.add(reason)
            return False
        handler = getattr(self, self.language(block), None)
        if self.language(block) == "text" or not handler:
            raise Wrong("nothing here says how it is carried out; see NOT_RUN")
        return handler(block, page) is not False

    def play(self, page):
        wrong, _ = run_snippets.run(page, BIN, None)
        return wrong

    def of_page(self, path):
        """(errors, number of blocks that ran, number that did not)"""
        page, wrong, ran, left = list(page_blocks.blocks(path)), [], 0, 0
        played = cases.LONG or path.name not in LONG_SESSIONS
        if played and any(block.is_session for block in page):
            wrong += self.play(path)
        for block in sorted(page, key=lambda block: self.language(block) == "text"):
            if block.is_session or str(block) in self.told:
                done_here = played or not block.is_session
                ran, left = ran + done_here, left + (not done_here)
                continue
            try:
                done_here = self.carry_out(block, page)
                ran, left = ran + done_here, left + (not done_here)
            except Exception as error:
                wrong.append(f"{block}: {block.first}: {error}")
        return wrong, ran, left


def options_of_prose():
    """Errors for each option in `...` that is neither of our programs nor in FOREIGN_OPTIONS."""
    tools = [str(path.relative_to(ROOT)) for folder in ("tools", "tools/dev", "tools/st", "tests", "tests/fuzz", "bench") for path in (ROOT / folder).iterdir()
             if path.is_file() and path.stat().st_mode & 0o100]
    for page in (page for page in page_blocks.pages() if page.name != "CHANGELOG.md"):  # it names removed options
        for number, line in page_blocks.prose(page.read_text()):
            for option in re.findall(r"(?<![\w-])--[a-z][a-z-]+", " ".join(re.findall(r"`([^`]*)`", line))):
                if option not in FOREIGN_OPTIONS and not any(has_option(program, option) for program in (*COMMANDS, *tools)):
                    yield f"{page.relative_to(ROOT)}:{number}: no program of ours has an option {option}"


def main():
    with tempfile.TemporaryDirectory() as folder, concurrent.futures.ThreadPoolExecutor(3) as pool:
        pages = Pages(pathlib.Path(folder))
        results = list(pool.map(pages.of_page, page_blocks.pages()))
        wrong = [*(text for found, _, _ in results for text in found), *options_of_prose(), *pages.clients(), *pages.examples()]
    wrong += [f"tests/docs/blocks_test.py: no page has `{key}` any more" for key in [*NOT_RUN, *NOT_EXECUTED] if key not in pages.reasons]
    ran, left = (sum(result[i] for result in results) for i in (1, 2))
    print("\n".join(wrong))
    print(f"{ran} blocks ran, {left} have a reason not to")
    sys.exit(0 if cases.any_ran(ran) and not wrong else 1)


main()
