# SPDX-License-Identifier: MIT
"""Starts cbcan-sim for a test, reads its addresses, and ends it by its process ID."""

import contextlib
import os
import pathlib
import re
import select
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import time

from mcu import LIMIT, die_with_parent, receive

READ, WRITE, EXECUTE = 5055, 5066, 0xCA0E  # commands in R3701; in R3700
STANDING = ("--demo", "--modbus", "127.0.0.1:0", "--clock", "manual")  # options: the demo plant, whose time passes by commands
HOW_TO_JOIN = r"^(network \d+: )?(slcan: python3|socketcand: python3|socketcan: candump) "


def wait_until(condition, what):
    """Repeats until the condition holds; it should wait for something (a read, a request), not use up the processor."""
    end = time.monotonic() + LIMIT
    while True:
        value = condition()
        if value:
            return value
        if time.monotonic() > end:
            raise AssertionError(f"not within {LIMIT} s: {what}")


def connect(address):
    """A client of "HOST:PORT" or "unix:PATH"."""
    if address.startswith("unix:"):
        client = socket.socket(socket.AF_UNIX)
        client.settimeout(LIMIT)
        client.connect(address[len("unix:"):])
        return client
    host, port = address.rsplit(":", 1)
    return socket.create_connection((host, int(port)), timeout=LIMIT)


def asked(address, *pieces):
    """All that is answered to a client that sends these pieces and closes its sending side."""
    with contextlib.closing(connect(address)) as client:
        if client.family == socket.AF_INET:
            client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        with contextlib.suppress(OSError):  # the server may have ended before
            for piece in pieces:
                client.sendall(piece)
            client.shutdown(socket.SHUT_WR)
        return rest_of(client)


def rest_of(client):
    """All data until the server closes the connection."""
    data = b""
    with contextlib.suppress(ConnectionError):
        while part := client.recv(1 << 16):
            data += part
    return data


class Simulator:
    def __init__(self, program, *options, log=True, test=None, before_start=None, stdin=subprocess.DEVNULL, stderr=None, **keywords):
        """Ends with `test`, if given."""
        self.folder = tempfile.TemporaryDirectory()
        self.log_path = pathlib.Path(self.folder.name) / "bus.log"
        command = [program, "--modbus", "127.0.0.1:0", *options]
        if log:
            command += ["--log", str(self.log_path)]
        self.error_path = pathlib.Path(self.folder.name) / "stderr"
        def prepare():
            die_with_parent()
            if before_start:
                before_start()

        with self.error_path.open("w") as error:
            self.process = subprocess.Popen(command, stdin=stdin, stdout=subprocess.PIPE, stderr=stderr or error, text=True,
                                            preexec_fn=prepare, **keywords)
        if not select.select([self.process.stdout], [], [], LIMIT)[0]:
            self.stop()
            raise AssertionError("no ready line")
        self.ready = self.process.stdout.readline().strip()
        if not self.ready.startswith("ready "):
            raise AssertionError(f"no ready line: {self.ready!r} {self.stop()[1]}")
        self.where = dict(part.split("=", 1) for part in self.ready.split()[1:])  # "modbus": "127.0.0.1:1502", ...
        self.port = int(self.where.get("modbus", ":0").rsplit(":", 1)[1])
        if test:
            test.addCleanup(self.stop)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.stop()

    def stop(self, number=signal.SIGTERM):
        """Ends the simulator; returns (exit code, standard error without the lines about joining the bus)."""
        if self.process.poll() is None:
            self.process.send_signal(number)
        try:
            self.process.wait(timeout=LIMIT)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
            raise
        finally:
            self.process.stdout.close()
            if self.process.stdin:
                self.process.stdin.close()
        if self.error_path.exists():
            self.error = "".join(line for line in self.error_path.read_text().splitlines(True) if not re.search(HOW_TO_JOIN, line))
        self.folder.cleanup()
        return self.process.returncode, self.error

    def connect(self, service):
        """A client of "control" or "2/slcan"."""
        return connect(self.where[service])

    def say(self, line):
        """A command on standard input; returns its response."""
        print(line, file=self.process.stdin, flush=True)
        response = [self.process.stdout.readline()]
        while response[-1] and not response[-1].startswith(("ok", "error", "at ")):
            response.append(self.process.stdout.readline())
        return "".join(response)

    def errors(self):
        """The lines on standard error so far."""
        return self.error_path.read_text().splitlines()

    def frames(self):
        """The frames on the bus so far, as `605#4017100000000000`."""
        return [line.split()[2] for line in self.log_path.read_text().rpartition("\n")[0].splitlines()]

    def wait_for_frame(self, frame):
        wait_until(lambda: frame in self.frames(), f"{frame} on the bus")

    def window(self, unit=1):
        return Window(self.port, unit)


class Window:
    """R3700..R3769 over a plain socket, for tests that check every byte."""

    def __init__(self, port, unit=1):
        self.unit = unit
        self.socket = socket.create_connection(("127.0.0.1", port), timeout=LIMIT)
        self.transaction = 0

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.socket.close()

    def request(self, pdu, unit=None):
        unit = self.unit if unit is None else unit
        self.transaction = (self.transaction + 1) & 0xFFFF
        self.socket.sendall(struct.pack(">HHHB", self.transaction, 0, len(pdu) + 1, unit) + pdu)
        header = self.receive(7)
        number, protocol, length, echoed = struct.unpack(">HHHB", header)
        assert (number, protocol, echoed) == (self.transaction, 0, unit), header.hex()
        return self.receive(length - 1)

    def receive(self, count):
        return receive(self.socket, count)

    def write(self, address, words):
        pdu = struct.pack(">BHHB", 16, address, len(words), 2 * len(words)) + struct.pack(f">{len(words)}H", *words)
        assert self.request(pdu) == pdu[:5]

    def read(self, address, count):
        response = self.request(struct.pack(">BHH", 3, address, count))
        assert response[:2] == bytes([3, 2 * count]), response.hex()
        return list(struct.unpack(f">{count}H", response[2:]))

    def start(self, *words):
        """R3701.. = words, and CA0Eh, in one request."""
        self.write(3700, [EXECUTE, *words])

    def result(self):
        wait_until(lambda: self.read(3700, 1)[0] != EXECUTE, "a result in R3700")
        return self.read(3700, 1)[0]

    def execute(self, *words):
        self.start(*words)
        return self.result()

    def abort_code(self):
        low, high = self.read(3706, 2)
        return high << 16 | low


def program_from_arguments(count=1):
    """Removes the program paths that CMake passes from the command line, before unittest reads it."""
    programs = [os.path.abspath(name) for name in sys.argv[1:1 + count]]
    del sys.argv[1:1 + count]
    return programs if count > 1 else programs[0]
