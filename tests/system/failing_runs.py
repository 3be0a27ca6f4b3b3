# SPDX-License-Identifier: MIT
"""Runs with one failing call: clients at each address, a PLC and a serial line, HTTP with a script, `cbcanctl configure`. Each run checks its own
result."""

import collections
import errno
import os
import pathlib
import re
import select
import socket
import struct
import subprocess
import tty

from done import ran
from mcu import with_crc
from owned_registers import OwnedRegisters
from simulator import HOW_TO_JOIN, READ, WRITE, Simulator, Window, program_from_arguments

PROGRAM, CBCANCTL, PRELOAD = program_from_arguments(3)
LIMIT = 30  # seconds, for actions that take a millisecond

NODE = 5
NUMBER, NAME = 0x2001, 0x2002
AT_FIRST, WRITTEN = 0x12345678, 0x0A0B0C0D
TEXT = b"what each call that fails leaves as it is"

# By function: the errors with which it fails; ENOMEM if none is more realistic.
ERRORS = collections.defaultdict(lambda: [errno.ENOMEM], {
    "accept4": [errno.EMFILE, errno.ENOMEM, errno.ECONNABORTED],
    "close": [errno.EIO],
    "epoll_ctl": [errno.ENOSPC],
    "epoll_wait": [errno.EINTR],
    "fsync": [errno.EIO],
    "poll": [errno.EINTR],
    "read": [errno.EIO, errno.EINTR],
    "recv": [errno.ECONNRESET, errno.EINTR],
    "rename": [errno.ENOSPC],
    "send": [errno.EPIPE, errno.EAGAIN],
    "write": [errno.ENOSPC, errno.EAGAIN, errno.EINTR],
})

def variable(section, kind, access, value):
    return f"[{section}]\nParameterName=x\nDataType={kind}\nAccessType={access}\nDefaultValue={value}\n"


EDS = "".join((
    variable("1000", "0x0007", "ro", 0), variable("1001", "0x0005", "ro", 0),
    "[1010]\nParameterName=x\nObjectType=0x8\nSubNumber=2\n", variable("1010sub0", "0x0005", "const", 1), variable("1010sub1", "0x0007", "rw", 1),
    "[1018]\nParameterName=x\nObjectType=0x9\nSubNumber=2\n", variable("1018sub0", "0x0005", "const", 1), variable("1018sub1", "0x0007", "ro", 0),
    variable("2001", "0x0007", "rw", 0), variable("2003", "0x0007", "rw", 0), variable("2002", "0x0009", "const", TEXT.decode())))

PLANT = f"""[time]
clock = "manual"
[modbus]
port = 0
[rtu]
listen = "127.0.0.1:0"
[control]
listen = "127.0.0.1:0"
[can]
slcan = "unix:can"
socketcand = "127.0.0.1:0"
[log]
file = "bus.log"
[[node]]
id = {NODE}
eds = "node.eds"
parameters = "stored"
"""


class Wrong(Exception):
    """A wrong result."""


def stored_line(number):
    return f"2001:00 = {number.to_bytes(4, 'little').hex().upper()}"


def words(number):
    return [number & 0xFFFF, number >> 16]


def environment(folder, failing):
    made = {**os.environ, "LD_PRELOAD": PRELOAD, "CBCAN_CALLS": str(folder / "calls")}
    return made | {"CBCAN_FAIL": "{} {} {}".format(*failing)} if failing else made


class Lines:
    """The lines that the program writes to standard output."""

    def __init__(self, pipe):
        self.pipe = pipe
        self.text = b""

    def take(self):
        """The next line; None when the program has ended."""
        while b"\n" not in self.text:
            if not select.select([self.pipe], [], [], LIMIT)[0]:
                raise Wrong("hangs")
            part = os.read(self.pipe.fileno(), 4096)
            if not part:
                return None
            self.text += part
        line, self.text = self.text.split(b"\n", 1)
        return line.decode()


class Stream:
    """A connection on which the response to what is sent is known."""

    def __init__(self, clients, family, address):
        self.socket = socket.socket(family)
        clients.append(self.socket)
        self.socket.settimeout(LIMIT)
        self.socket.connect(address)

    def ask(self, request, *responses):
        self.socket.sendall(request)
        got = b""
        while got not in responses:
            part = self.socket.recv(4096)
            got += part
            if not any(response.startswith(got) for response in responses):
                raise Wrong(f"{request} was answered by {got}")
            if not part:
                raise ConnectionError
        return got


class Modbus(Window):
    def __init__(self, clients, port):
        super().__init__(port)
        clients.append(self.socket)
        self.socket.settimeout(LIMIT)

    def result(self):
        """Time does not pass, so a response comes immediately or never."""
        flag = self.read(3700, 1)[0]
        if flag == 0xCA0E:
            raise Wrong("no result")
        return flag

    def read_number(self, *expected):
        if self.execute(READ, NODE, NUMBER, 0, 4) != 0:
            raise Wrong(f"a read failed: {self.abort_code():08X}h")
        number = struct.unpack("<I", struct.pack("<2H", *self.read(3706, 2)))[0]
        if self.read(3705, 1) != [4] or number not in expected:
            raise Wrong(f"read {number:X}h")

    def read_text(self):
        if self.execute(READ, NODE, NAME, 0, 64) != 0 or self.read(3705, 1) != [len(TEXT)]:
            raise Wrong("a read of the text failed")
        text = struct.pack("<32H", *self.read(3706, 32))[:len(TEXT)]
        if text != TEXT:
            raise Wrong(f"read {text}")

    def write_number(self):
        if self.execute(WRITE, NODE, NUMBER, 0, 4, *words(WRITTEN)) != 0:
            raise Wrong("a write failed")

    def save(self):
        """True if the value has been stored."""
        stored = self.execute(WRITE, NODE, 0x1010, 1, 4, *words(0x65766173)) == 0
        if not stored and self.abort_code() != 0x06060000:
            raise Wrong(f"stored: {self.abort_code():08X}h")
        return stored


class Servers:
    """One run with a client at each server; `wrong` is None or the mistake."""

    MOST_LINES = 1

    def plant(self):
        return PLANT

    def __init__(self, folder, failing=None):
        self.folder = pathlib.Path(folder)
        self.failing = failing
        self.lost = []
        self.clients = []
        self.written = False
        self.stored = self.code = self.said = None
        for name, text in (("plant.toml", self.plant()), ("node.eds", EDS), ("stored", stored_line(AT_FIRST) + "\n")):
            (self.folder / name).write_text(text)
        with (self.folder / "errors").open("wb") as errors:
            self.process = subprocess.Popen([PROGRAM, "--config", str(self.folder / "plant.toml")], stdin=subprocess.PIPE,
                                            stdout=subprocess.PIPE, stderr=errors, env=environment(self.folder, failing), close_fds=False)
        self.lines = Lines(self.process.stdout)
        try:
            self.wrong = self.run() or self.end()
        except Wrong as wrong:
            self.wrong = str(wrong)
        except TimeoutError:
            self.wrong = "hangs"
        finally:
            self.process.kill()
            self.process.wait()
            self.process.stdin.close()
            self.process.stdout.close()
            self.leave()

    def is_clean(self):
        return self.wrong is None and (self.code, self.said, self.lost, self.stored) == (0, [], [], True)

    def leave(self):
        for client in self.clients:
            client.close()

    def ports(self):
        """Where it listens; None when the program has ended."""
        ready = self.lines.take()
        return ready and {name: int(port) for name, port in re.findall(r"(\S+)=\S*:(\d+)", ready)}

    def run(self):
        port = self.ports()
        if port is None:
            return
        self.go(lambda: Modbus(self.clients, port["modbus"]),
                lambda plc: plc.write(10, [0x29]),
                lambda plc: plc.read_number(AT_FIRST),
                lambda plc: self.write_by_other(port["modbus"]),
                lambda plc: plc.read_number(*self.numbers()),
                lambda plc: plc.read_text(),
                lambda plc: self.save(plc))
        self.go(lambda: Stream(self.clients, socket.AF_UNIX, str(self.folder / "can")),
                lambda adapter: adapter.ask(b"O\r", b"\r"),
                lambda adapter: adapter.ask(b"t60584002200000000000\r", b"z\rt58584102200029000000\r"),
                lambda adapter: adapter.ask(b"t60586000000000000000\r", b"z\rt585800" + TEXT[:7].hex().upper().encode() + b"\r"))
        self.go(lambda: Stream(self.clients, socket.AF_INET, ("127.0.0.1", port["socketcand"])),
                lambda client: client.ask(b"", b"< hi >"),
                lambda client: client.ask(b"< open can0 >", b"< ok >"),
                lambda client: client.ask(b"< rawmode >", b"< ok >"),
                lambda client: client.ask(b"< send 605 8 40 02 20 00 00 00 00 00 >", b"< frame 585 0.000000 4102200029000000 >"))
        self.go(lambda: Stream(self.clients, socket.AF_INET, ("127.0.0.1", port["control"])),
                lambda control: control.ask(b"get 5 0x2001\n", *(f"ok {number}\n".encode() for number in (AT_FIRST, WRITTEN))),
                lambda control: control.ask(b"nodes\n", b"#1 5 pre-operational none\nok\n"))
        self.go(lambda: Stream(self.clients, socket.AF_INET, ("127.0.0.1", port["rtu_tcp"])),
                lambda rtu: rtu.ask(with_crc("01 03 000A 0001"), with_crc("01 03 02 0000"), with_crc("01 03 02 0029")))
        self.pass_time()

    def write_by_other(self, port):
        self.go(lambda: Modbus(self.clients, port), lambda plc: plc.write_number(), lambda plc: setattr(self, "written", True))

    def save(self, plc):
        self.stored = plc.save()

    def go(self, connect, *steps):
        """One client's session, which may be cut off."""
        try:
            client = connect()
            for step in steps:
                step(client)
        except (ConnectionError, FileNotFoundError):
            self.lost.append(connect)

    def pass_time(self):
        try:
            os.write(self.process.stdin.fileno(), b"pass 100ms\n")
            line = self.lines.take()
            if line not in (None, "at 0.100000"):
                raise Wrong(f"time passed: {line}")
            self.process.stdin.close()
        except BrokenPipeError:
            pass

    def end(self):
        try:
            code = self.process.wait(LIMIT)
        except subprocess.TimeoutExpired:
            return "hangs at the end"
        lines = self.said = [line for line in (self.folder / "errors").read_text().splitlines() if not re.match(HOW_TO_JOIN, line)]
        self.code = code
        if code not in (0, 2, 3):
            return f"exit code {code}: {lines}"
        if lines and lines[-1] == "cbcan-sim --help shows all options":
            lines.pop()
        if len(lines) > (self.MOST_LINES if code == 0 else 1) or (code != 0 and not lines and self.failing[0] not in ("write", "fcntl")):  # no message
            return f"exit code {code}, and says {lines}"
        if code == 0 and len(self.lost) > 1:
            return f"{len(self.lost)} clients are lost: {lines}"
        if self.stored and (self.folder / "stored").read_text().splitlines()[-1] not in map(stored_line, self.numbers()):
            return "stored, and is not in the file"
        return None

    def numbers(self):
        """The possible values of the number."""
        return [WRITTEN] if self.written else [AT_FIRST, WRITTEN]


class PlcAndLine(Servers):
    """One run with a PLC that owns the registers, and a serial line."""

    MOST_LINES = 2  # connection lost, connected again

    def plant(self):
        self.plc = OwnedRegisters()
        self.line, self.end_of_line = os.openpty()
        tty.setraw(self.end_of_line)
        return f"""[time]
clock = "manual"
[modbus]
port = 0
[rtu]
device = "{os.ttyname(self.end_of_line)}"
[plc]
address = "127.0.0.1:{self.plc.port}"
period_ms = 1
[[node]]
id = {NODE}
eds = "node.eds"
parameters = "stored"
"""

    def run(self):
        self.stored = True
        if self.lines.take() is None:
            return
        result = self.execute(READ, NODE, NUMBER, 0, 4)
        if result is None:
            return
        if result != 0 or self.plc.read(3705, 3) != [4, *words(AT_FIRST)]:
            raise Wrong(f"the PLC gets {result}, {self.plc.read(3705, 3)}")
        self.ask_by_line()
        self.pass_time()

    def execute(self, *request):
        """The result for the PLC; None when the program has ended."""
        with self.plc.changed:
            self.plc.write(3700, [0xCA0E, *request])
            for _ in range(10 * LIMIT):
                if self.plc.changed.wait_for(lambda: self.plc.registers[3700] != 0xCA0E, 0.1):
                    return self.plc.registers[3700]
                if self.process.poll() is not None:
                    return None
        raise Wrong("the PLC gets no result")

    def ask_by_line(self):
        os.write(self.line, with_crc("01 03 000A 0001"))
        got, response = b"", with_crc("01 03 02 0000")
        while got != response:
            if not select.select([self.line], [], [], 1)[0]:
                self.lost.append(self.line)  # no response on the line
                return
            got += os.read(self.line, 256)
            if not response.startswith(got):
                raise Wrong(f"the line gets {got.hex()}")

    def numbers(self):
        return [AT_FIRST]

    def leave(self):
        self.plc.stop()
        os.close(self.line)
        os.close(self.end_of_line)


class Web(Servers):
    """One run with HTTP, a script, and a request by the scanner window of channel 2."""

    OUT, IN = 700, 800
    SCRIPT = "function on_write(index, sub, value) if index == 0x2001 then set(0x2003, 0, 2 * value) end end\n"

    def plant(self):
        (self.folder / "double.lua").write_text(self.SCRIPT)
        return f"""[time]
clock = "manual"
[modbus]
port = 0
[http]
listen = "127.0.0.1:0"
[module]
channels = 2
[[node]]
id = {NODE}
eds = "node.eds"
device = "double.lua"
"""

    def is_clean(self):
        return self.wrong is None and (self.code, self.said, self.lost) == (0, [], [])

    def numbers(self):
        return [WRITTEN] if self.written else [0, WRITTEN]

    def run(self):
        port = self.ports()
        if port is None:
            return
        self.go(lambda: Modbus(self.clients, port["modbus"]),
                lambda plc: self.by_channel(plc, 1, 5),
                lambda plc: self.by_channel(plc, 2, 0),
                lambda plc: setattr(self, "written", True))
        self.go(lambda: Stream(self.clients, socket.AF_INET, ("127.0.0.1", port["http"])),
                lambda client: self.ask(client, "GET", f"/api/nodes/{NODE}/objects?first=0x2001&last=0x2001", "",
                                        *(f'"value":"{number}",' for number in self.numbers())))
        self.go(lambda: Stream(self.clients, socket.AF_INET, ("127.0.0.1", port["http"])),
                lambda client: self.ask(client, "POST", "/api/control", f"get {NODE} 0x2003\nnodes\n", "ok 0\n", f"ok {2 * WRITTEN}\n"))
        self.pass_time()

    def by_channel(self, plc, number, result):
        """The response to the first number after a start is 5."""
        plc.write(self.OUT, [number, WRITE, NODE, NUMBER, 0, 4, *words(WRITTEN)])
        if plc.read(self.IN, 2) != [number, result]:
            raise Wrong(f"channel 2 answers {plc.read(self.IN, 8)}")

    def ask(self, client, method, path, body, *responses):
        client.socket.sendall(f"{method} {path} HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\nContent-Length: {len(body)}\r\n\r\n{body}".encode())
        got = b""
        while part := client.socket.recv(65536):
            got += part
        head, _, content = got.decode().partition("\r\n\r\n")
        length = re.search(r"Content-Length: (\d+)", head)
        is_whole = len(content) == int(length[1]) if length else content.endswith("0\r\n\r\n")
        if not is_whole or head.startswith("HTTP/1.1 500"):
            raise ConnectionError
        if not any(response in content for response in responses):
            raise Wrong(f"{method} {path} was answered by {got}")


class Configure:
    """One run of `cbcanctl configure` with a simulator in which no call fails."""

    PLAN = f"[[node]]\nid = {NODE}\nobjects = [ {{ index = {NUMBER}, value = {WRITTEN}, type = 'u32' }} ]\n"

    def __init__(self, folder, failing=None):
        folder = pathlib.Path(folder)
        (folder / "node.eds").write_text(EDS)
        (folder / "plan.toml").write_text(self.PLAN)
        with Simulator(PROGRAM, "--node", f"{NODE}={folder}/node.eds") as simulator:
            try:
                self.wrong = self.judge(ran(CBCANCTL, "--modbus", f":{simulator.port}", "configure", folder / "plan.toml", stdin=subprocess.DEVNULL,
                                            env=environment(folder, failing), timeout=LIMIT), simulator)
            except subprocess.TimeoutExpired:
                self.wrong = "hangs"

    def judge(self, done, simulator):
        self.code, self.said = done.returncode, done.stderr
        if done.returncode not in range(8):
            return f"exit code {done.returncode}: {done.stderr}"
        if done.returncode != 0 and not (done.stderr + done.stdout).strip():
            return f"exit code {done.returncode}, and says nothing"
        with simulator.window() as window:
            if done.returncode == 0 and (window.execute(READ, NODE, NUMBER, 0, 4) != 0 or window.read(3706, 2) != words(WRITTEN)):
                return "says that it has written, and it is not there"
        return None

    def is_clean(self):
        return self.wrong is None and self.code == 0

    lost = ()
