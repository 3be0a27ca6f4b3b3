# SPDX-License-Identifier: MIT
"""A simulated CANopen plant behind a coprocessor's registers, for tests in Python: cbcan-sim with a clock that advances only when a test lets
time pass. Needs the standard library and the program cbcan-sim; with pytest there are three fixtures. Installed by pip, they are found
automatically; else, in the top-level conftest.py:

    pytest_plugins = ["cbcan_plant"]

    def test_a_silent_node(plant, window):
        plant.power(0x42, False)
        assert window.execute(5055, 0x42, 0x6411, 1, 2) == 4      # R3701...; the result in R3700
        assert window.abort == 0x05040000
        assert plant.now == 1.0                                   # the SDO timeout, in no time

Each test has its own plant: the built-in demo, or the options in the key `cbcan_plant` of pytest's configuration file. These may be any of
cbcan-sim, with paths relative to that file:

    [pytest]
    cbcan_plant = --config plant.toml

A program in Structured Text (cbcan_st.Program) runs beside the plant in the fixture `st`; the key `cbcan_st` has its files:

    [pytest]
    cbcan_st = cia405.st scanner.st openplc.st tank.st

    def test_the_tank_is_filled(st, plant):
        st.run(until="DONE", within=30)
        assert st["main.full"] and plant.get(66, "output:1") == 0

@pytest.mark.plant("--config", "other.toml") gives a test, class or module another plant, @pytest.mark.st("other.st") another program. A plant that
already runs is no fixture: a test that is the COMMAND of `cbcan-sim ... -- COMMAND` gets it by Plant.around(), in the state that other tests have
left.
"""

from __future__ import annotations

import contextlib
import json
import os
import signal
import socket
import struct
import subprocess
import sys
import warnings
from typing import TYPE_CHECKING, Any, Iterator, NoReturn

if TYPE_CHECKING:
    import pytest
    from cbcan_st import Program

try:
    from cbcan import SIMULATOR  # of the same wheel
except ImportError:
    SIMULATOR = "cbcan-sim"

LIMIT = 60  # seconds of the wall clock that anything may take

EXECUTE = 0xCA0E
READ, WRITE = 5055, 5066
FIRST = 3700
ABORTED = 4  # the result in R3700 that has an SDO abort code
GAVE_UP = 75  # exit code; EX_TEMPFAIL of sysexits.h
RESULTS = {1: "R3701 is neither 5055 nor 5066", 2: "R3702 is above 127"}
ABORTS = {  # CiA 301, 7.2.4.3.17
    0x05030000: "toggle bit not alternated", 0x05040000: "SDO service timed out", 0x05040001: "command specifier not valid",
    0x05040002: "invalid block size", 0x05040003: "invalid sequence number", 0x05040004: "CRC error",
    0x05040005: "object length too big to read (CiA 301: out of memory)",
    0x06010000: "unsupported access to the object, or segmented transfer not supported", 0x06010001: "attempt to read a write-only object",
    0x06010002: "attempt to write a read-only object", 0x06020000: "no such object", 0x06040041: "object cannot be mapped to the PDO",
    0x06040042: "the mapped objects exceed the PDO length", 0x06040043: "general parameter incompatibility",
    0x06040047: "data length exceeds what the system allows", 0x06060000: "access failed due to a hardware error",
    0x06070010: "object length does not match", 0x06070012: "length of the service parameter too high",
    0x06070013: "length of the service parameter too low", 0x06090011: "sub-index does not exist", 0x06090030: "invalid value for the parameter",
    0x06090031: "value too high", 0x06090032: "value too low", 0x06090036: "maximum is less than minimum",
    0x060A0023: "resource not available: SDO connection", 0x08000000: "general error",
    0x08000020: "data cannot be transferred or stored to the application", 0x08000021: "data cannot be transferred because of local control",
    0x08000022: "data cannot be transferred because of the present device state", 0x08000023: "no object dictionary is present",
    0x08000024: "no data available"}
EXCEPTIONS = {2: "there are no such registers, or they are read-only", 3: "too many registers in a request, or a wrong value",
              10: "the plant has no such network; unit=1 is its first"}


class PlantError(Exception):
    """cbcan-sim refused something; the text is its message."""


class Disconnected(PlantError, ConnectionError):
    """The plant has closed the Modbus connection."""


class Advice(UserWarning):
    """A mistake of the program that the registers let pass: the command `advice` of docs/reference/commands.md."""


class NotWithin(PlantError, AssertionError):
    """The condition did not hold in time."""


class Result(int):
    """R3700 of a transaction that has ended, a number. As a text it says what it means: 4 (0602 0000h no such object)."""

    meaning = ""

    def __repr__(self) -> str:
        return f"{int(self)} ({self.meaning})" if self.meaning else f"{int(self)}"


def gave_up(reason: str = "") -> NoReturn:
    """Ends the program with exit code 75: it could not do its work, knows that, and has left the plant in a safe state. cbcan-sim --explore tells
    this from a failure. In a test it ends pytest with this code."""
    if "PYTEST_CURRENT_TEST" in os.environ and "pytest" in sys.modules:
        sys.modules["pytest"].exit(reason, returncode=GAVE_UP)
    print(f"gave up: {reason}", file=sys.stderr)
    sys.exit(GAVE_UP)


def connect(address: str) -> socket.socket:
    """`address` as cbcan-sim writes it: HOST:PORT, [IPV6]:PORT or unix:PATH."""
    if address.startswith("unix:"):
        made = socket.socket(socket.AF_UNIX)
        made.settimeout(LIMIT)
        made.connect(address[5:])
        return made
    host, port = address.rsplit(":", 1)
    made = socket.create_connection((host.strip("[]"), int(port)), timeout=LIMIT)
    made.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    return made


def duration(time: float | str) -> str:
    """0.1 (seconds) or "100ms"."""
    return time if isinstance(time, str) else f"{round(time * 1e6)}us"


def packed(layout: str, *words: int) -> bytes:
    """The words of a request."""
    try:
        return struct.pack(layout, *words)
    except struct.error:
        wrong = [repr(word) for word in words if not isinstance(word, int) or not 0 <= word <= 0xFFFF]
        raise ValueError(f"{', '.join(wrong) or f'{len(words) - 4} words'}: a request has up to 123 words of 0..65535; {READ} in R3701 reads, {WRITE} "
                         "writes; a longer or negative value is several words, the lowest first: value & 0xFFFF, value >> 16 & 0xFFFF") from None


class Plant:
    """A plant in its own process, which ends with stop() or with this process."""

    def __init__(self, *options: str, program: str | None = None, folder: str | os.PathLike[str] | None = None) -> None:
        """`options` of cbcan-sim, default --demo; paths are relative to `folder`, or to the current folder."""
        program = program or os.environ.get("CBCAN_SIM") or SIMULATOR
        if os.sep in program:
            program = os.path.abspath(program)
        command = [program, *(options or ["--demo"]), "--clock", "manual", "--modbus", "127.0.0.1:0", "--control", "127.0.0.1:0"]
        try:
            process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, cwd=folder)
        except FileNotFoundError as error:
            raise PlantError(f"{error}; is cbcan installed? CBCAN_SIM may be the path of cbcan-sim") from None
        self.process: subprocess.Popen[str] | None = process
        assert process.stdout
        ready = process.stdout.readline()
        if not ready.startswith("ready "):
            self.stop()
            raise PlantError(f"{' '.join(command)}: exit code {process.returncode}; it says why on standard error")
        where = dict(word.split("=", 1) for word in ready.split()[1:])
        self._join(where["modbus"], where["control"])

    @classmethod
    def around(cls) -> Plant:
        """The plant that started this program: cbcan-sim ... -- COMMAND. It ends with the command."""
        plant = cls.__new__(cls)
        plant.process = None
        if "CBCAN_CONTROL" not in os.environ:
            raise PlantError("no plant has started this program; write cbcan-sim ... -- COMMAND, or use Plant()")
        plant._join(os.environ["CBCAN_MODBUS"], os.environ["CBCAN_CONTROL"])
        return plant

    def _join(self, modbus: str, control: str) -> None:
        self.modbus = modbus
        self.control = connect(control)
        self.lines = self.control.makefile("r", encoding="utf-8", newline="\n")

    def __enter__(self) -> Plant:
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    def stop(self) -> None:
        if hasattr(self, "control"):
            self.lines.close()
            self.control.close()
        if self.process:
            self.process.send_signal(signal.SIGTERM)
            self.process.communicate(timeout=LIMIT)

    def command(self, line: str) -> list[str]:
        """Executes a command of docs/reference/commands.md; returns the lines of the response, without "ok"."""
        self.send(line)
        return self.response(line)

    def send(self, *lines: str) -> None:
        """Sends commands in one go; each needs its response()."""
        self.control.sendall("".join(f"{line}\n" for line in lines).encode())

    def response(self, line: str) -> list[str]:
        """That to the next command sent, which is this line."""
        said: list[str] = []
        while True:
            answer = self.lines.readline().rstrip("\n")
            word, _, rest = answer.partition(" ")
            if not answer:
                raise PlantError(f"{line}: the plant is gone")
            if word == "error:":
                raise (NotWithin if rest.startswith("not within") else PlantError)(f"{line}: {rest}")
            if word in ("ok", "at"):
                return [*said, rest] if rest else said
            said.append(answer)

    @property
    def now(self) -> float:
        """Seconds since the plant's start."""
        return float(self.command("time")[0])

    def advance(self, time: float | str) -> float:
        """Lets this much time pass: seconds, or "100ms". Returns the new time."""
        return float(self.command(f"pass {duration(time)}")[0])

    def wait(self, condition: str, within: float | str | None = None) -> float:
        """Lets time pass until "state 5 operational" or any other condition of docs/reference/commands.md holds; returns the new time. Raises
        NotWithin when that takes longer than `within` (60 s) of the plant's time."""
        return float(self.command(f"wait {condition}" + (f" within {duration(within)}" if within else ""))[0])

    def get(self, node: int | str, index: int | str, sub: int = 0) -> Any:
        """The value that an SDO read would return now: a number, True or False, or a text. `index` may be a name: "output:1"."""
        value = self.command(f"get {node} {index if isinstance(index, str) else f'{index}:{sub}'}")[0]
        try:
            return json.loads(value)
        except ValueError:
            return value

    def set(self, node: int | str, index: int, sub: int, value: object) -> None:
        """Sets an input of the node to this value."""
        self.command(f"set {node} {index}:{sub} {value}")

    def advice(self) -> list[str]:
        """Mistakes of the program so far: kind, Modbus client, how often, and a sentence. The fixture makes warnings of them."""
        return self.command("advice")

    def fault(self, node: int | str, kind: str, **keys: object) -> int:
        """Injects a fault into a node, or the "bus"; docs/reference/faults.md has kinds and keys. Returns its number, for clear()."""
        return int(self.command(" ".join([f"fault {node} {kind}", *(f"{key}={value}" for key, value in keys.items())]))[0])

    def clear(self, node: int | str = "", number: int | str = "") -> None:
        """Removes all faults, those of a node or of the "bus", or one."""
        self.command(f"clear {node} {number}".rstrip())

    def incident(self, node: int | str, name: str, present: bool = True) -> None:
        """Starts or ends an incident of the device: docs/reference/devices.md."""
        self.command(f"incident {node} {name} {'on' if present else 'off'}")

    def power(self, node: int | str, on: bool) -> None:
        """Switches a node's power off or on; on is a cold start that keeps stored parameters. "all": all nodes."""
        self.command(f"power {node} {'on' if on else 'off'}")


class Window:
    """R3700..R3769 of a plant, as a PLC accesses them, over Modbus TCP. `unit` selects the CAN network."""

    def __init__(self, plant: Plant, unit: int = 1) -> None:
        self.plant, self.unit, self.transaction = plant, unit, 0
        self.asked: list[int] = []  # R3701..R3704 of the transaction by start(), to compare with when it has a result
        self.socket = connect(plant.modbus)

    def __enter__(self) -> Window:
        return self

    def __exit__(self, *_: object) -> None:
        self.socket.close()

    def _request(self, pdu: bytes) -> bytes:
        self.transaction = self.transaction + 1 & 0xFFFF
        self.socket.sendall(struct.pack(">HHHB", self.transaction, 0, len(pdu) + 1, self.unit) + pdu)
        response = self._receive(struct.unpack(">HHHB", self._receive(7))[2] - 1)
        if response[0] & 0x80:
            why = EXCEPTIONS.get(response[1], "")
            raise PlantError(f"unit {self.unit}: Modbus exception {response[1]}{why and ': ' + why}; request {pdu.hex()}")
        return response

    def _receive(self, count: int) -> bytes:
        data = b""
        while len(data) < count:
            part = self.socket.recv(count - len(data))
            if not part:
                raise Disconnected("the plant has closed the Modbus connection")
            data += part
        return data

    def read(self, register: int, count: int = 1) -> list[int]:
        """Returns `count` registers as a list."""
        return list(struct.unpack(f">{count}H", self._request(packed(">BHH", 3, register, count))[2:]))

    def write(self, register: int, *words: int) -> None:
        self.asked = []
        self._request(packed(f">BHHB{len(words)}H", 16, register, len(words), 2 * len(words), *words))

    def start(self, *words: int) -> None:
        """Writes CA0Eh to R3700 and `words` to R3701.., in one request; does not wait."""
        self.write(FIRST, EXECUTE, *words)
        self.asked = list(words[:4])

    def result(self, within: float | str | None = None) -> Result:
        """Lets time pass until the transaction has ended; returns R3700: 0 = done."""
        if self.read(FIRST)[0] == EXECUTE:
            network = "" if self.unit in (0, 1, 255) else f"{self.unit}/"
            self.plant.wait(f"register {network}{FIRST} != 0x{EXECUTE:X}", within)
        flag, *asked, low, high = self.read(FIRST, 8)
        if asked[:len(self.asked)] != self.asked:
            raise PlantError("the module has restarted, or another program has written to R3701..R3704")
        result = Result(flag)
        result.meaning = RESULTS.get(flag, "")
        if flag == ABORTED:
            result.meaning = f"{high:04X} {low:04X}h {ABORTS.get(high << 16 | low, 'abort code of the device')}"
        return result

    def execute(self, *words: int, within: float | str | None = None) -> Result:
        """start() and result(): execute(5055, node, index, sub, size)."""
        self.start(*words)
        return self.result(within)

    def cancel(self) -> None:
        """Cancels a transaction in progress."""
        self.write(FIRST, 0)

    @property
    def abort(self) -> int | None:
        """The SDO abort code of a transaction with result 4, else None."""
        flag, *_, low, high = self.read(FIRST, 8)
        return high << 16 | low if flag == ABORTED else None

    @property
    def data(self) -> bytes:
        """The bytes that were read."""
        size, *words = self.read(FIRST + 5, 65)
        return struct.pack("<64H", *words)[:size]


# ---- pytest, which imports this; other programs start without it

def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addini("cbcan_plant", "options of cbcan-sim for the fixture `plant`; --demo without", "args", [])
    parser.addini("cbcan_st", "files of the program for the fixture `st`", "args", [])


def pytest_configure(config: pytest.Config) -> None:
    config.addinivalue_line("markers", "plant(option, ...): options of cbcan-sim for the fixture `plant`; else those of cbcan_plant")
    config.addinivalue_line("markers", "st(file, ...): files of the program for the fixture `st`; else those of cbcan_st")
    config.pluginmanager.register(fixtures(), "cbcan_plant_fixtures")


def fixtures() -> object:
    import pytest

    def given(request: pytest.FixtureRequest, marker: str, key: str) -> tuple[Any, Any]:
        """(words of the marker, or of the configuration file; their folder)"""
        found, file = request.node.get_closest_marker(marker), request.config.inipath
        return (found.args, "") if found else (request.config.getini(key), file.parent if file else "")

    class Fixtures:
        @pytest.fixture
        def plant(self, request: pytest.FixtureRequest) -> Iterator[Plant]:
            """A Plant for this test, at time 0."""
            options, folder = given(request, "plant", "cbcan_plant")
            if not options and "CBCAN_CONTROL" in os.environ:
                raise PlantError("`cbcan-sim ... -- pytest`: each test has a plant of its own, so run pytest alone, and name the plant in its "
                                 "configuration file: cbcan_plant = --config plant.toml")
            with Plant(*options, folder=folder or None) as made:
                yield made
                with contextlib.suppress(PlantError, OSError):  # the test may have ended the plant
                    for line in made.command("advice end"):
                        warnings.warn(line, Advice, stacklevel=1)

        @pytest.fixture
        def window(self, plant: Plant) -> Iterator[Window]:
            """The Window of the fixture `plant`."""
            with Window(plant) as made:
                yield made

        @pytest.fixture
        def st(self, request: pytest.FixtureRequest, plant: Plant) -> Iterator[Program]:
            """A program in Structured Text beside the fixture `plant`."""
            from cbcan_st import Program
            files, folder = given(request, "st", "cbcan_st")
            with Program(plant, *files, folder=folder) as made:
                yield made

    return Fixtures()
