#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Every address at which cbcan-sim listens: a browser's POST, clients that close their sending side or leave, places filled and emptied."""

import contextlib
import http.client
import os
import pathlib
import re
import resource
import signal
import socket
import struct
import subprocess
import time

import cases
from simulator import LIMIT, Simulator, asked, connect, program_from_arguments, rest_of, wait_until
from tree import ROOT

PROGRAM = program_from_arguments()
CONNECTS = {"plc.address", "can.spec"}  # keys with the address of another program
LISTENS = {"rtu_tcp": "rtu.listen", "slcan": "can.slcan", "socketcand": "can.socketcand", "control": "control.listen", "http": "http.listen"}
READ_R0 = bytes.fromhex("010300000001840a")
STREAMS = {"rtu_tcp": (READ_R0, bytes.fromhex("0103020000b844")), "slcan": (b"V\r", b"V1013\r"), "socketcand": (b"< open can0 >", b"< hi >< ok >"),
           "control": (b"time\n", b"ok ")}

# Lines that each protocol would execute if it parsed the body of an HTTP request.
COMMANDS = ("power 16 off\nnmt stop all\nwrite 3700 1\n" "O\rt00020200\r" "< open can0 >< rawmode >< send 0 2 2 0 >").encode()
WRITE_R3700 = bytes.fromhex("01060e740001") + bytes.fromhex("0af8")


def descriptors(process):
    return os.listdir(f"/proc/{process.pid}/fd")


def listening_ports(process):
    """The TCP ports at which a process listens, from the kernel."""
    links = (os.readlink(f"/proc/{process.pid}/fd/{fd}") for fd in descriptors(process))
    inodes = {link[len("socket:["):-1] for link in links if link.startswith("socket:[")}
    rows = (line.split() for line in pathlib.Path("/proc/net/tcp").read_text().splitlines()[1:])
    return {int(row[1].split(":")[1], 16) for row in rows if row[3] == "0A" and row[9] in inodes}


class Case(cases.Case):
    def start(self, *options, **keywords):
        return Simulator(PROGRAM, "--demo", *options, **keywords, test=self)

    def start_all(self, *options, **keywords):
        """With all TCP listeners."""
        every = [word for key in LISTENS.values() for word in ("--set", f"{key}=127.0.0.1:0")]
        return self.start(*every, *options, **keywords)


class Browser(Case):
    """A page of another site can make a browser send a POST with any body to any address of this machine."""

    def test_no_address_is_forgotten(self):
        page = (ROOT / "docs/reference/plant-file.md").read_text()
        self.assertEqual(set(re.findall(r"^\| `([a-z_.]+)` \|[^|]*HOST:PORT", page, re.M)), set(LISTENS.values()) | CONNECTS)

    def test_a_post_is_executed_nowhere(self):
        simulator = self.start_all()
        addresses = [f"127.0.0.1:{port}" for port in listening_ports(simulator.process)]
        self.assertEqual(len(addresses), len(LISTENS) + 1)  # and Modbus TCP
        for address in addresses:
            for body in (COMMANDS, WRITE_R3700 * 40, COMMANDS * 500):
                for size in (1, 3, 10_000):
                    self.post(address, body, size)
        with simulator.window() as window:
            self.assertEqual(window.execute(5055, 16, 0x1000, 0, 4), 0)
        self.assertEqual([frame for frame in simulator.frames() if not frame.startswith("7")], ["610#4000100000000000", "590#4300100092010200"])
        warned = {line for line in simulator.errors() if "speaks HTTP" in line}
        self.assertEqual(len(warned), len(STREAMS), warned)  # one message for each
        for line in warned:
            self.assertRegex(line, r"^cbcan-sim: .+ \S+: a client that speaks HTTP, as a browser does, is turned away; --http serves HTTP$")

    def post(self, address, body, size):
        request = (f"POST / HTTP/1.1\r\nHost: {address}\r\nOrigin: http://evil.example\r\nContent-Type: text/plain\r\n"
                   f"Content-Length: {len(body)}\r\nConnection: close\r\n\r\n").encode() + body
        with contextlib.closing(connect(address)) as client, contextlib.suppress(ConnectionError):
            for i in range(0, 200, size):
                client.sendall(request[i:i + size])
            client.sendall(request[max(200, size):])
            self.assertIn(rest_of(client)[:12], (b"", b"< hi >", b"HTTP/1.1 400", b"HTTP/1.1 403"), address)


    def test_a_handshake_of_tls_is_executed_nowhere(self):
        """Its session ticket comes from another server by way of the browser."""
        ticket = COMMANDS + b"\rO\rt00020242\r< open can0 >< rawmode >< send 0 2 2 42 >" + COMMANDS
        hello = b"\x01\0" + (200 + len(ticket)).to_bytes(2, "big") + b"\x03\x03" + bytes(100) + ticket + bytes(98)
        handshake = b"\x16\x03\x01" + len(hello).to_bytes(2, "big") + hello
        simulator = self.start_all()
        for name in STREAMS:
            for size in (1, 10_000):
                with contextlib.closing(connect(simulator.where[name])) as client, contextlib.suppress(ConnectionError):
                    for i in range(0, len(handshake), size):
                        client.sendall(handshake[i:i + size])
                    client.shutdown(socket.SHUT_WR)
                    self.assertIn(rest_of(client), (b"", b"< hi >"), name)
        with simulator.window() as window:
            self.assertEqual(window.execute(5055, 16, 0x1000, 0, 4), 0)
        self.assertEqual([frame for frame in simulator.frames() if not frame.startswith("7")], ["610#4000100000000000", "590#4300100092010200"])


class SendingSide(Case):
    """Clients that close their sending side after the requests: printf ... | socat."""

    LINES = b"trigger read 99 0x1000 0 4\nwait transaction ended\nread 3700\nset 0x42 0x6000:1 7\nget 0x42 0x6000:1\n"

    def check_answered(self, answers):
        self.assertRegex(answers.decode(), r"\Aok\nok \d+\.\d{6}\nok 4\nok\nok 7\n\Z")

    def test_lines_behind_a_wait_are_executed_and_answered(self):
        for address in ("127.0.0.1:0", f"unix:{self.folder}/c"):
            simulator = self.start("--control", address)
            self.check_answered(asked(simulator.where["control"], self.LINES))

    def test_a_last_line_without_an_end_is_not_executed(self):
        simulator = self.start("--control", "127.0.0.1:0")
        self.assertEqual(asked(simulator.where["control"], b"write 100 7\nwrite 100 8"),
                         b"ok\nerror: the last line has no end, so it was not executed\n")
        self.assertEqual(asked(simulator.where["control"], b"read 100\n"), b"ok 7\n")

    def test_as_the_page_has_it(self):
        simulator = self.start("--control", "127.0.0.1:0")
        answers = subprocess.run(["socat", "-t", "9", "-", f"TCP:{simulator.where['control']}"], input=self.LINES, capture_output=True, check=True, timeout=LIMIT)
        self.check_answered(answers.stdout)

    def test_who_leaves_has_its_lines_executed(self):
        for address in ("127.0.0.1:0", f"unix:{self.folder}/c", f"pty:{self.folder}/p"):
            simulator = self.start("--control", address, "--sdo-timeout", "100")
            lines = self.LINES + b"write 100 7\n"
            if address.startswith("pty:"):
                pathlib.Path(f"{self.folder}/p").write_bytes(lines)
            else:
                with contextlib.closing(connect(simulator.where["control"])) as client:
                    client.sendall(lines)
                    client.shutdown(socket.SHUT_WR)
                    self.assertEqual(client.recv(3), b"ok\n")
            with simulator.window() as window:
                wait_until(lambda: window.read(100, 1) == [7], f"the line behind wait: {address}")

    def test_the_next_one_at_a_terminal(self):
        simulator = self.start("--control", f"pty:{self.folder}/p")
        pathlib.Path(f"{self.folder}/p").write_bytes(b"wait time 3600s within 3600s\nset 0x42 0x6000:1 7\n")
        with simulator.window() as window:
            for _ in range(3):  # after this many turns the simulator has seen that no program has it open
                window.read(0, 1)
        with open(f"{self.folder}/p", "r+b", buffering=0) as terminal:
            terminal.write(b"get 0x42 0x6000:1\n")
            self.assertEqual(terminal.readline(), b"ok 0\n")

    def test_a_reset_ends_what_waits(self):
        simulator = self.start("--control", "127.0.0.1:0")
        before = len(descriptors(simulator.process))
        for together in (False, True):  # it reads the lines and the reset at once
            client = connect(simulator.where["control"])
            wait_until(lambda: len(descriptors(simulator.process)) == before + 1, "the connection")
            if together:
                simulator.process.send_signal(signal.SIGSTOP)
            client.sendall(b"wait time 3600s within 3600s\nset 0x42 0x6000:1 7\n")
            client.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
            client.close()
            if together:
                simulator.process.send_signal(signal.SIGCONT)
            wait_until(lambda: len(descriptors(simulator.process)) == before, "the end of the connection")
        self.assertEqual(asked(simulator.where["control"], b"get 0x42 0x6000:1\n"), b"ok 0\n")

    def test_every_stream_answers_first(self):
        simulator = self.start_all()
        for name, (request, response) in STREAMS.items():
            self.assertEqual(asked(simulator.where[name], request)[:len(response)], response, name)

    def test_modbus_answers_first(self):
        simulator = self.start()
        request = struct.pack(">HHHBBHH", 1, 0, 6, 1, 3, 0, 1)
        self.assertEqual(asked(simulator.where["modbus"], request * 3), struct.pack(">HHHBBBH", 1, 0, 5, 1, 3, 2, 0) * 3)

    def test_standard_input(self):
        for clock in ([], ["--control", "127.0.0.1:0"]):
            done = subprocess.run([PROGRAM, "--demo", "--modbus", "127.0.0.1:0", "--clock", "manual", *clock], input=self.LINES, capture_output=True, timeout=LIMIT)
            ready, _, answers = done.stdout.partition(b"\n")
            self.assertTrue(ready.startswith(b"ready "))
            self.check_answered(answers)
            self.assertEqual(done.returncode, 0)


class Places(Case):
    """Each limit of each server: fill it, empty it, request again."""

    def ask(self, simulator, name):
        address = simulator.where[name]
        if name == "http":
            host, port = address.rsplit(":", 1)
            with contextlib.closing(http.client.HTTPConnection(host, int(port), timeout=LIMIT)) as connection:
                connection.request("GET", "/api/time")
                return connection.getresponse().status == 200
        if name == "modbus":
            with simulator.window() as window:
                return window.read(0, 1) == [0]
        request, response = STREAMS[name]
        return asked(address, request).startswith(response)

    def is_served(self, simulator, name):
        with contextlib.suppress(OSError, http.client.HTTPException):
            return self.ask(simulator, name)
        return False

    def check_is_served(self, simulator, after):
        if "node_modules" in PROGRAM:  # it disconnects who is one too many, also before it has seen the others leave
            wait_until(lambda: self.is_served(simulator, "http"), f"HTTP after {after}")
        self.assertTrue(self.ask(simulator, "http"), after)

    def test_http_has_128(self):
        for clients in (127, 128, 129, 400):
            simulator = self.start("--http", "127.0.0.1:0")
            crowd = [connect(simulator.where["http"]) for _ in range(clients)]
            with simulator.window() as window:
                window.execute(5055, 0x42, 0x1000, 0, 4)
            self.assertTrue(self.ask(simulator, "http"), clients)
            for client in crowd:
                client.close()
            self.check_is_served(simulator, clients)

    def test_http_s_places_come_back_from_who_leaves(self):
        wait = b"wait time 3600s within 3600s"
        for sent in (b"POST /api/control HTTP/1.1\r\nHost: localhost\r\nContent-Length: %d\r\n\r\n" % len(wait) + wait,
                     b"GET /api", b"POST /api/control HTTP/1.1\r\nHost: localhost\r\nContent-Length: 100\r\n\r\nhalf",
                     b"GET /api/events HTTP/1.1\r\nHost: localhost\r\n\r\n"):
            simulator = self.start("--http", "127.0.0.1:0")
            for _ in range(400):
                with contextlib.closing(connect(simulator.where["http"])) as client:
                    client.sendall(sent)
            self.check_is_served(simulator, sent)

    def test_no_descriptor_left(self):
        for name in LISTENS:
            simulator = self.start_all(before_start=lambda: resource.setrlimit(resource.RLIMIT_NOFILE, (64, 64)))
            crowd = [connect(simulator.where[name]) for _ in range(100)]
            wait_until(lambda: len(descriptors(simulator.process)) >= 63, f"{name} to be full")
            for other in LISTENS:
                if other != name:
                    connect(simulator.where[other]).close()
            before, mine = self.processor_seconds(simulator), time.process_time()
            while time.process_time() - mine < 0.3:
                pass
            self.assertLess(self.processor_seconds(simulator) - before, 0.1, f"{name}: it spins")
            for client in crowd:
                client.close()
            for other in LISTENS:
                wait_until(lambda: self.is_served(simulator, other), f"{other} after {name} was full")
            self.assertIsNone(simulator.process.poll())

    def processor_seconds(self, simulator):
        fields = pathlib.Path(f"/proc/{simulator.process.pid}/stat").read_text().rsplit(")", 1)[1].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    def test_who_only_waits_makes_room(self):
        simulator = self.start("--control", "127.0.0.1:0", before_start=lambda: resource.setrlimit(resource.RLIMIT_NOFILE, (64, 64)))
        crowd = []
        for _ in range(200):
            crowd.append(connect(simulator.where["control"]))
            crowd[-1].sendall(b"wait time 3600s within 3600s\n")
            crowd[-1].shutdown(socket.SHUT_WR)
        self.assertTrue(self.ask(simulator, "control"))
        for client in crowd:
            client.close()


cases.main()
