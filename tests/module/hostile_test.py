#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Strangers at the addresses of the npm package, with the corpus of tests/fuzz: it says what the native program says, goes on, and ends on
request. The limits of both in SECURITY.md.
usage: hostile_test.py CBCAN_SIM NATIVE"""

import contextlib
import json
import os
import pathlib
import re
import resource
import signal
import struct
import subprocess
import tempfile
import time

import cases
from done import done, ran
from simulator import LIMIT, STANDING, Simulator, asked, connect, program_from_arguments, wait_until
from tree import ROOT

PROGRAM, NATIVE = program_from_arguments(2)
SECTION = (ROOT / "SECURITY.md").read_text().partition("\n## Limits by edition\n")[2].partition("\n## ")[0]
TABLE = re.findall(r"^\| (.*?) \| (.*?) \| (.*?) \|$", SECTION, re.M)[1:]
CAN_RECEIVED = 4116
SERVICES = ("--http", "--control", "--slcan", "--socketcand")
EVENTS = b"GET /api/events?since=0 HTTP/1.1\r\nHost: localhost\r\n\r\n"
TIME = b"GET /api/time HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n"


def corpus(target):
    """(name, bytes)"""
    with tempfile.TemporaryDirectory() as unpacked:
        done(ROOT / "tests/fuzz/corpus_file", "unpack", target, unpacked)
        for folder in (ROOT / "tests/fuzz/corpus" / target, pathlib.Path(unpacked)):
            for file in sorted(folder.iterdir()):
                yield file.name, file.read_bytes()


def by_http(address, path):
    """(status, body) of a GET with exactly this path; the module's page has no indentation."""
    head, _, body = asked(address, b"GET " + path + b" HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n").partition(b"\r\n\r\n")
    if b"Transfer-Encoding: chunked" in head:
        body = unchunked(body)
    return head.split(b" ")[1], re.sub(rb"\n +", b"\n", body)


def unchunked(body):
    """RFC 9112, 7.1."""
    whole = b""
    while size := int(body[:body.index(b"\r\n")], 16):
        data = body[body.index(b"\r\n") + 2:]
        whole, body = whole + data[:size], data[size + 2:]
    return whole


class Case(cases.Case):
    maxDiff = None

    def start(self, program, *options, clock="manual"):
        every = [word for option in SERVICES for word in (option, "127.0.0.1:0")]
        return Simulator(program, "--demo", *every, "--clock", clock, *options, test=self, log=False, stdin=subprocess.PIPE)

    def both(self):
        return [self.start(program) for program in (PROGRAM, NATIVE)]

    def check_goes_on(self, simulator, what):
        self.assertIn(b" 200 OK\r\n", asked(simulator.where["http"], TIME), what)
        self.assertEqual(asked(simulator.where["control"], b"time\n")[:3], b"ok ", what)


class Http(Case):
    def test_any_path_is_answered_as_natively(self):
        here, there = self.both()
        for path in (b"/%ff", b"//", b"///", b"//evil.example/api/time", b"/%", b"/%zz", b"/%c3%a4", b"/\\",
                     b"/api/nodes/%231/objects?first=0x1000&last=0x1000", b"/api/registers?first=%c3%bf", b"/api/registers?first=+3700&count=1", b"/api/registers?first=1&first=2&count=1", b"/api/registers?%=%&&=",
                     b"/api/registers?first=1?count=2", b"/?__proto__=1", b"http://[", b"http://localhost/api/registers", b"*"):
            self.assertEqual(by_http(here.where["http"], path), by_http(there.where["http"], path), path)

    def test_a_command_of_a_page_takes_effect_without_another_client(self):
        simulator = self.start(PROGRAM, clock="real")
        asked(simulator.where["http"], b"POST /api/control HTTP/1.1\r\nHost: localhost\r\nContent-Length: 9\r\n\r\nshutdown\n")
        self.assertEqual(simulator.process.wait(LIMIT), 0)


class Corpus(Case):
    def test_http(self):
        simulator = self.start(PROGRAM)
        for name, data in corpus("http"):
            piece = 1 + 16 * data[0]
            heard = asked(simulator.where["http"], *(data[place:place + piece] for place in range(1, len(data), piece)))
            self.assertTrue(heard[:7] in (b"", b"HTTP/1."), name)
            head, _, body = heard.partition(b"\r\n\r\n")
            if b"application/json" in head and heard.count(b"HTTP/1.") == 1:
                json.loads(body)
            self.check_goes_on(simulator, name)

    def lines(self, service, inputs):
        here, there = self.both()
        for name, data in inputs:
            answers = sorted((asked(simulator.where[service], data) for simulator in (here, there)), key=len)
            if service == "modbus":  # who closes the connection to bytes that it has not read loses answers
                answers[1] = answers[1][:len(answers[0])]
            self.assertEqual(*answers, name)
        self.check_goes_on(here, service)

    def test_control(self):
        """But for what needs time."""
        self.lines("control", ((name, re.sub(rb"(?m)^\s*(wait|pass|shutdown)\b.*", b"", data)) for name, data in corpus("control")))

    def test_slcan(self):
        self.lines("slcan", ((name, b"O\r" + data[1:]) for name, data in corpus("buses")))

    def test_socketcand(self):
        self.lines("socketcand", ((name, b"< open can0 >" + data[1:]) for name, data in corpus("buses")))

    def test_modbus(self):
        self.lines("modbus", ((name, b"".join(self.requests(data))) for name, data in corpus("modbus")))

    def requests(self, data):
        """As tests/fuzz/modbus_fuzz.cpp reads them."""
        number, left = 0, 400
        while len(data) >= 2:
            flags, piece, data = data[0], data[2:2 + data[1]], data[2 + data[1]:]
            for _ in range(min(left, 1 + (flags >> 3))):
                number, left = number + 1, left - 1
                yield (number.to_bytes(2, "big") + bytes(2) + (len(piece) + 1).to_bytes(2, "big") + b"\1" if flags & 1 else b"") + piece


class Flood(Case):
    def test_a_plc_is_answered_before_what_64_adapters_have_sent(self):
        simulator = self.start(PROGRAM, clock="real")
        window = simulator.window()
        self.addCleanup(window.socket.close)
        crowd = [connect(simulator.where["slcan"]) for _ in range(64)]
        for client in crowd:
            self.addCleanup(client.close)
            client.sendall(b"O\r")
            self.assertEqual(client.recv(1), b"\r")
        frames = b"t7010\r" * 10_000
        simulator.process.send_signal(signal.SIGSTOP)
        for client in crowd:
            client.sendall(frames)
        window.socket.sendall(bytes.fromhex("000100000006010310140002"))
        simulator.process.send_signal(signal.SIGCONT)
        low, high = struct.unpack(">HH", window.receive(13)[9:])
        print(f"figure: a PLC is answered after {low + (high << 16)} of 640000 frames, then within {self.frames_between(window)}")
        self.assertLess(low + (high << 16), 10_000)
        for client in crowd:
            client.close()

    def frames_between(self, window):
        """The most frames between two answers."""
        counts = [window.read(CAN_RECEIVED, 2) for _ in range(20)]
        numbers = [low + (high << 16) for low, high in counts]
        return max(later - earlier for earlier, later in zip(numbers, numbers[1:]))


class Limits(Case):
    """Each row of the table in SECURITY.md, with the cells of both editions."""

    def test_each_row(self):
        for name, *cells in TABLE:
            with self.subTest(name):
                check = getattr(self, re.sub(r"[^a-z]+", "_", name.lower()))
                for program, cell in zip((NATIVE, PROGRAM), cells):
                    check(program, cell)

    def number(self, cell):
        return int(re.match(r"\d+", cell)[0])

    def clients_of_http(self, program, cell):
        most = resource.getrlimit(resource.RLIMIT_NOFILE)[1]
        resource.setrlimit(resource.RLIMIT_NOFILE, (most, most))
        simulator = self.start(program)
        request = TIME.replace(b"Connection: close\r\n", b"")
        crowd = [connect(simulator.where["http"]) for _ in range(self.number(cell))]
        for client in crowd:
            client.sendall(request)
            self.assertIn(b" 200 OK\r\n", client.recv(4096))
        with contextlib.closing(connect(simulator.where["http"])) as one_more:
            one_more.sendall(request)
            self.assertIn(b" 200 OK\r\n", one_more.recv(4096), cell)
            self.assertEqual(crowd[0].recv(1), b"")
        for client in crowd:
            client.close()

    def silence_of_a_tcp_client_that_has_vanished(self, program, cell):
        """Linux, proc(5): timer 2 is keep-alive; its time is in hundredths of a second."""
        simulator = self.start(program)
        for service in "http", "modbus", "control":
            with contextlib.closing(connect(simulator.where[service])) as client:
                ends = [f":{port:04X}" for _, port in (client.getpeername(), client.getsockname())]
                asked(simulator.where["control"], b"time\n")  # it has been accepted
                row, = (row for row in map(str.split, open("/proc/net/tcp")) if row[1].endswith(ends[0]) and row[2].endswith(ends[1]))
                timer, _, left = row[5].partition(":")
                self.assertEqual(timer, "02", service)
                self.assertAlmostEqual(int(left, 16) / 100, self.number(cell), delta=10)

    def body_of_an_http_request(self, program, cell):
        simulator = self.start(program)
        for size, status in (self.number(cell), b"200"), (self.number(cell) + 1, b"413"):
            head = b"POST /api/control HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\nContent-Length: %d\r\n\r\n" % size
            self.assertEqual(asked(simulator.where["http"], head, b"\n" * size)[9:12], status)

    def incomplete_http_request(self, program, cell):
        self.check_is_closed(program, "http", b"GET /api/time HTTP/1.1\r\n", cell)

    def incomplete_modbus_request(self, program, cell):
        self.check_is_closed(program, "modbus", b"\0\1\0\0\0", cell)

    def check_is_closed(self, program, service, half, cell):
        begin = time.monotonic()
        with contextlib.closing(connect(self.start(program, clock="real").where[service])) as client:
            client.sendall(half)
            while client.recv(4096):
                pass
        self.assertGreater(time.monotonic() - begin, self.number(cell) - 1)

    def line_of_a_command(self, program, cell):
        simulator = self.start(program)
        for size, answer in (self.number(cell), b'error: "x'), (self.number(cell) + 1, b"error: a line of more than %d characters\n" % self.number(cell)):
            self.assertEqual(asked(simulator.where["control"], b"x" * size + b"\n")[:len(answer)], answer)

    def line_of_standard_input(self, program, cell):
        for size, why in (self.number(cell), '"x'), (self.number(cell) + 1, f"a line of more than {self.number(cell)} characters\n"):
            done = ran(program, *STANDING, input="x" * size + "\n")
            self.assertEqual((done.returncode, done.stderr[:27 + len(why)]), (2, "cbcan-sim: standard input: " + why))

    def text_that_a_client_at_the_bus_has_not_read(self, program, cell):
        simulator = self.start(program, "--set", "log.summary=true", clock="real")
        reader, sender = connect(simulator.where["slcan"]), connect(simulator.where["slcan"])
        for client in reader, sender:
            client.sendall(b"O\r")
            self.assertEqual(client.recv(1), b"\r")
        for _ in range(40):  # 6.7 MB for the one that does not read; more than the kernel keeps
            sender.sendall(b"T0000000181122334455667788\r" * 6000)
            got = 0
            while got < 12_000:
                got += len(sender.recv(1 << 16))
        _, error = simulator.stop()
        reader.close(), sender.close()
        lost = int(re.search(r"(?m)SLCAN connections .* (\d+)$", error)[1])
        self.assertEqual(lost > 0, "lost" in cell or "same" in cell, error)

    def cyclic_frames_of_socketcand(self, program, cell):
        simulator = self.start(program)
        with contextlib.closing(connect(simulator.where["socketcand"])) as client:
            client.sendall(b"< open can0 >" + b"".join(b"< add 0 100 %x 0 >" % number for number in range(0x100, 0x1C0)))
            asked(simulator.where["control"], b"pass 10ms\n")
            before = self.frames(simulator)
            asked(simulator.where["control"], b"pass 1s\n")
            self.assertAlmostEqual(self.frames(simulator) - before, self.number(cell), delta=100)

    def frames(self, simulator):
        return json.loads(by_http(simulator.where["http"], b"/api/time")[1])["networks"][0]["frames"]

    def plant_eds_and_parameter_file(self, program, cell):
        file = self.write("x.eds", "")
        os.truncate(file, self.number(cell) << 20 | 1)
        for option in ("--config", file), ("--demo", "--set", f"node.0x42.parameters={file}"), ("--node", f"5={file}"):
            self.assertIn(f"{file}: more than {cell}; ", ran(program, "--check", *option).stderr)

    def instructions_in_a_call_of_a_script(self, program, cell):
        file = self.write("x.lua", "while true do end\n")
        self.assertRegex(ran(program, "--check", "--node", f"5={file}").stderr, f"more than {cell} instructions in one call")

    def http_at_another_address(self, program, cell):
        simulator = self.start(program)
        for service in "control", "slcan", "socketcand":
            self.assertIn(asked(simulator.where[service], b"POST / HTTP/1.1\r\nHost: x\r\n\r\nwrite 3700 1\n"), (b"", b"< hi >"), cell)
        self.assertEqual(asked(simulator.where["control"], b"read 3700\n"), b"ok 0\n")

    def unix_sockets_pseudo_terminals(self, program, cell):
        for option in ("--control", f"unix:{self.folder}/s"), ("--slcan", f"pty:{self.folder}/p"):
            done = ran(program, *STANDING, *option, input="")
            self.assertEqual(done.returncode, 2 if "refused" in cell else 0, done.stderr)

    def at_the_end_clients_that_do_not_read(self, program, cell):
        simulator = self.start(program, clock="real")
        requests = {"http": EVENTS * 2, "control": b"help\n" * 20_000, "slcan": b"O\r" + b"V\r" * 20_000,
                    "modbus": bytes.fromhex("00010000000601030000007d") * 50_000}
        for service, request in requests.items():
            client = connect(simulator.where[service])
            self.addCleanup(client.close)
            client.setblocking(False)
            with contextlib.suppress(BlockingIOError):
                for place in range(0, len(request), 4096):
                    client.send(request[place:place + 4096])
        self.check_goes_on(simulator, cell)
        simulator.process.send_signal(signal.SIGTERM)
        self.assertEqual(simulator.process.wait(LIMIT), 0)


class StandardInput(Case):
    def test_a_folder(self):
        for program in PROGRAM, NATIVE:
            folder = os.open("/", os.O_RDONLY)
            done = ran(program, *STANDING, stdin=folder)
            os.close(folder)
            self.assertEqual((done.returncode, done.stderr), (3, "cbcan-sim: standard input: Is a directory\n"), program)


cases.main()
