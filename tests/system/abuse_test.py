#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""cbcan-sim with one client that breaks the rules and one that keeps to them and must not notice.

The second one makes complete transactions all the time. How many, and how long the slowest took, is printed at the end.
"""

import contextlib
import os
import resource
import signal
import socket
import struct
import sys
import pathlib
import time
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
import cases
from healthy import Healthy
from simulator import LIMIT, Simulator, program_from_arguments, wait_until

PROGRAM = program_from_arguments(sys.argv)
TARGET_MS = 50  # for the slowest transaction; printed, since other programs may have the processor

READ_ONE = bytes.fromhex("0001 0000 0006 01 03 0000 0001")
READ_ONE_RESPONSE = bytes.fromhex("0001 0000 0005 01 03 02 0000")
READ_125 = bytes.fromhex("0002 0000 0006 01 03 0000 007D")
NO_LOG = "; the log ends here, the simulation goes on; make room, or write it to another disk"
ROWS = []


def tearDownModule():
    print(f"\n{'while':<50} transactions  slowest ms (target {TARGET_MS})")
    for what, transactions, worst in ROWS:
        print(f"{what:<50} {transactions:12}  {worst:10.1f}")


def processor_seconds(process):
    fields = pathlib.Path(f"/proc/{process.pid}/stat").read_text().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


class Client:
    """A connection for whatever bytes."""

    def __init__(self, port, receive_buffer=None):
        self.socket = socket.socket()
        if receive_buffer:
            self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive_buffer)
        self.socket.settimeout(LIMIT)
        self.socket.connect(("127.0.0.1", port))
        self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def send(self, data):
        self.socket.sendall(bytes.fromhex(data) if isinstance(data, str) else data)

    def receive(self, count):
        """So many bytes, or fewer when the server closes."""
        data = b""
        while len(data) < count:
            part = self.socket.recv(count - len(data))
            if not part:
                break
            data += part
        return data

    def ask(self, request, response_bytes):
        self.send(request)
        return self.receive(response_bytes)

    def is_closed(self):
        try:
            return self.socket.recv(1) == b""
        except ConnectionError:
            return True

    def leave(self):
        self.socket.close()

    def reset(self):
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        self.socket.close()


class Abuse(unittest.TestCase):
    @contextlib.contextmanager
    def served(self, what, *options, says="", **keywords):
        """cbcan-sim with the healthy client at work; the with block's body is the abuse. `says`: the line on standard error."""
        self.simulator = Simulator(PROGRAM, "--demo", *options, **keywords, test=self)
        self.healthy = Healthy(self.simulator.port)
        self.clients = []
        self.served_clients = 0
        self.addCleanup(lambda: [client.leave() for client in self.clients])
        yield
        self.healthy.wait_for(10)
        worst = self.healthy.finish()
        ROWS.append((what, self.healthy.transactions, worst))
        self.assertIsNone(self.simulator.process.poll(), "the simulator has ended")
        code, error = self.simulator.stop()
        for word, value in (("PORT", self.simulator.port), ("LOG", self.simulator.log_path), ("CLIENTS", 1 + self.served_clients)):
            says = says.replace(word, str(value))
        self.assertEqual((code, error), (0, "cbcan-sim: " + says + "\n" if says else ""))

    def client(self, **keywords):
        self.clients.append(Client(self.simulator.port, **keywords))
        return self.clients[-1]

    def check_responses(self, *dialogue):
        """(request, response) after (request, response), all requests sent at once, and the healthy client meanwhile."""
        client = self.client()
        responses = b"".join(bytes.fromhex(response) for _, response in dialogue)
        client.send(b"".join(bytes.fromhex(request) for request, _ in dialogue))
        self.assertEqual(client.receive(len(responses)).hex(), responses.hex())
        self.healthy.wait_for(2)
        self.assertEqual(client.ask(READ_ONE, 11), READ_ONE_RESPONSE)

    def check_does_not_spin(self):
        """While this program takes 0.3 s of a processor's time, the simulator, which nobody asks for anything, takes next to none."""
        self.healthy.pause()
        before, mine = processor_seconds(self.simulator.process), time.process_time()
        while time.process_time() - mine < 0.3:
            pass
        self.assertLess(processor_seconds(self.simulator.process) - before, 0.1)
        self.healthy.go_on()

    # ---- what comes slowly or not at all

    def test_client_that_never_reads(self):
        with self.served("a client reads no response"):
            client = self.client(receive_buffer=4096)
            client.socket.setblocking(False)
            while self.sends_some(client):
                pass
            self.healthy.wait_for(100)
            self.check_does_not_spin()

    def sends_some(self, client):
        """False when the server has stopped reading: it takes nothing more, however many others it has served."""
        try:
            client.socket.send(READ_125 * 100)
            return True
        except BlockingIOError:
            self.healthy.wait_for(10)
        try:
            client.socket.send(READ_125)
            return True
        except BlockingIOError:
            return False

    # ---- what is wrong

    def test_header_that_is_not_modbus(self):
        with self.served("wrong protocol IDs and lengths"):
            for header in ("0002 0001 0006", "0002 FFFF 0006", "0002 0000 0000", "0002 0000 0001", "0002 0000 00FF",
                           "0002 0000 FFFF"):
                client = self.client()
                self.assertEqual(client.ask(READ_ONE, 11), READ_ONE_RESPONSE)
                # Whole, so that a server which believes the header would answer.
                client.send(bytes.fromhex(header + "01 03 0000 0001") + bytes(249))
                self.assertTrue(client.is_closed(), header)
                self.healthy.wait_for(2)

    def test_garbage(self):
        with self.served("garbage"):
            for garbage in (b"GET / HTTP/1.1\r\n\r\n", bytes(range(256)) * 40, b"\xff" * 5000, b"\0" * 5000):
                client = self.client()
                with contextlib.suppress(ConnectionError):
                    client.send(garbage)
                self.assertTrue(client.is_closed())
                self.healthy.wait_for(2)

    def test_length_with_two_bytes_too_many(self):
        with self.served("length 8 with two real bytes more"):
            client = self.client()
            # Taken for the begin of the next request, 0606 would make that one write register 0.
            self.assertEqual(client.ask("0001 0000 0008 01 03 0000 0001 0606 0002 0000 0006 01 03 0000 0001", 20).hex(),
                             "000100000003018303" + "0002000000050103020000")
            self.healthy.wait_for(2)
            self.assertEqual(client.ask(READ_125, 259)[9:], bytes(250))

    def test_unknown_functions_with_requests_behind(self):
        with self.served("unknown functions, requests behind"):
            for function in (0, 1, 2, 5, 7, 8, 15, 17, 20, 24, 65, 99, 127):
                self.check_responses((f"0009 0000 0006 01 {function:02X} 0000 0001", f"0009 0000 0003 01 {function | 0x80:02X} 01"),
                                   ("0001 0000 0006 01 03 0000 0001", "0001 0000 0005 01 03 02 0000"),
                                   ("0002 0000 0006 01 03 0000 0002", "0002 0000 0007 01 03 04 0000 0000"))

    def test_fc7_and_fc0_as_short_as_they_are(self):
        with self.served("FC7 and FC0"):
            for function in (7, 0):
                self.check_responses((f"0009 0000 0002 01 {function:02X}", f"0009 0000 0003 01 {function | 0x80:02X} 01"),
                                   ("0001 0000 0006 01 03 0000 0001", "0001 0000 0005 01 03 02 0000"))

    def test_bad_quantities_with_requests_behind(self):
        with self.served("bad quantities, requests behind"):
            for quantity in ("0000", "007E", "00FF", "FFFF"):
                self.check_responses((f"0009 0000 0006 01 03 0000 {quantity}", "0009 0000 0003 01 83 03"),
                                   ("0001 0000 0006 01 03 0000 0001", "0001 0000 0005 01 03 02 0000"))

    def test_fc16_with_124_registers_or_255_bytes(self):
        with self.served("FC16: quantity 124, byte count 255"):
            # 253 bytes are the most that a PDU has: quantity 124 cannot bring all of its 248.
            for pdu in ("10 0000 007C F8" + 247 * "00", "10 0000 007C F8 0000", "10 0000 0001 FF 0000", "10 0000 007B FF" + 246 * "00",
                        "10 0000 0000 00"):
                length = len(bytes.fromhex(pdu)) + 1
                self.check_responses((f"0009 0000 {length:04X} 01 {pdu}", "0009 0000 0003 01 90 03"),
                                   ("0001 0000 0006 01 03 0000 0001", "0001 0000 0005 01 03 02 0000"))

    # ---- too many

    def test_1100_connections(self):
        soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
        resource.setrlimit(resource.RLIMIT_NOFILE, (hard, hard))
        self.addCleanup(resource.setrlimit, resource.RLIMIT_NOFILE, (soft, hard))
        with self.served("1,100 connections"):
            for _ in range(1100):
                self.client().send(READ_ONE)
            for client in self.clients:
                self.assertEqual(client.receive(11), READ_ONE_RESPONSE)
            self.assertGreater(len(os.listdir(f"/proc/{self.simulator.process.pid}/fd")), 1100)
            # Where libmodbus waits with select(): beyond descriptor 1023 it ends the process.
            self.assertEqual(self.clients[-1].ask("0009 0000 0006 01 63 0000 0001", 9).hex(), "000900000003" + "01e301")
            self.healthy.wait_for(20)
            for client in self.clients:
                client.reset()

    def test_descriptors_used_up(self):
        with self.served("no descriptors left", before_start=lambda: resource.setrlimit(resource.RLIMIT_NOFILE, (64, 64)),
                         says="modbus 127.0.0.1:PORT: no descriptor left for a further client (CLIENTS are connected); raise the "
                              "limit with `ulimit -n`"):
            served = [self.is_served(self.client()) for _ in range(100)]
            self.served_clients = served.count(True)
            self.assertEqual(served, self.served_clients * [True] + (100 - self.served_clients) * [False])
            self.assertGreater(self.served_clients, 40)
            self.healthy.wait_for(20)
            self.check_does_not_spin()
            self.clients[0].leave()
            wait_until(lambda: self.is_served(self.client()), "a client to be accepted again")

    def is_served(self, client):
        try:
            return client.ask(READ_ONE, 11) == READ_ONE_RESPONSE
        except ConnectionError:
            return False

    # ---- those who go

    def test_reset_before_the_reply(self):
        with self.served("resets before the reply"):
            for requests in (READ_ONE[:5], READ_ONE, READ_125 * 50, READ_125 * 5000):
                for _ in range(20):
                    client = self.client(receive_buffer=4096)
                    client.socket.setblocking(False)
                    client.socket.send(requests)
                    client.reset()
                self.healthy.wait_for(5)

    def test_response_to_a_client_that_is_gone(self):
        with self.served("responses to nobody, SIGPIPE"):
            client = self.client(receive_buffer=4096)
            client.socket.setblocking(False)
            while self.sends_some(client):
                pass
            client.reset()
            os.kill(self.simulator.process.pid, signal.SIGPIPE)
            self.healthy.wait_for(20)

    # ---- the disk

    def test_log_on_a_full_disk(self):
        with self.served("the log's disk is full", "--log", "/dev/full", log=False,
                         says="log /dev/full: No space left on device" + NO_LOG):
            self.healthy.wait_for(20)

    def test_log_on_a_disk_that_gets_full(self):
        limit = 10000  # bytes for a file: the write that meets it is cut, as on a disk that gets full
        with self.served("the log's disk gets full", says="log LOG: File too large" + NO_LOG,
                         before_start=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))):
            self.healthy.wait_for(50)
            self.assertEqual(self.simulator.log_path.stat().st_size, limit)


cases.main()
