#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""cbcanctl over pseudo-terminals, with cbcan-sim and with devices that misbehave; and with servers that are not Modbus servers, or do not exist."""

import fcntl
import json
import os
import select
import shutil
import socket
import struct
import threading
import tty
import unittest.mock

import cases
from ctl import CBCANCTL, DONE, NO_CONNECTION, REFUSED, Case, run
from done import ran
from mcu import with_crc
from owned_registers import OwnedRegisters
from serial_line import SerialLine
from simulator import LIMIT, Simulator, program_from_arguments

CBCAN_SIM = program_from_arguments()


class OurServer(Case):
    """cbcan-sim without nodes, at the other end of the line."""

    def setUp(self):
        line = SerialLine()
        self.addCleanup(line.close)
        self.place = line.ends[1]
        Simulator(CBCAN_SIM, "--rtu", line.ends[0], "--set", "rtu.baud=115200", "--set", "rtu.parity=N", test=self)

    def test_read_and_write(self):
        self.check("read 0 0x3001 0 --type u8", "127\n")
        self.check("write 0 0x3003 0 500 --type u16")
        self.check("read 0 0x3003 0 --type u16", "500\n")
        self.check("read 0 0x3333 0", "", REFUSED, "cbcanctl: 0602 0000h ABORT_NO_OBJ: no such object\n")

    def test_wrong_station(self):
        done = run(self.place, "--station", "9", "--baud", "9600", "--parity", "N", "state", "0")
        self.assertEqual((done.stdout, done.returncode), ("", NO_CONNECTION))
        self.assertIn(f"{self.place} (9600 baud, 8N2, station 9): reading R3700: no response", done.stderr)
        for word in ("--station", "--baud", "--parity"):
            self.assertIn(word, done.stderr)

    def test_another_program_on_the_line(self):
        with open(self.place, "rb", buffering=0) as other:
            fcntl.flock(other, fcntl.LOCK_EX)
            self.check("state 0", "", NO_CONNECTION, f"cbcanctl: {self.place}: another program uses it\n")


class Device:
    """A station whose transactions end immediately: four bytes, 12345678h. Before it sends a response, the next of its misdeeds
    may change it: a function of the response and this object."""

    def __init__(self, *misdeeds):
        self.line, self.slave = os.openpty()
        tty.setraw(self.slave)
        self.name = os.ttyname(self.slave)
        self.misdeeds = list(misdeeds)
        self.requests = []
        self.words = [0] * 70
        self.woken, self.wake = os.pipe()
        self.thread = threading.Thread(target=self.serve, daemon=True)
        self.thread.start()

    def stop(self):
        os.close(self.wake)
        self.thread.join(LIMIT)
        for descriptor in (self.line, self.slave, self.woken):
            os.close(descriptor)

    def serve(self):
        data = b""
        while self.woken not in select.select([self.line, self.woken], [], [])[0]:
            data += os.read(self.line, 256)
            size = 8 if len(data) < 7 or data[1] == 3 else 9 + data[6]
            if len(data) >= size:
                self.execute(data[:size])
                data = data[size:]

    def execute(self, request):
        assert with_crc(request[:-2]) == request, request.hex()
        self.requests.append(request)
        at = struct.unpack(">H", request[2:4])[0] - 3700
        count = struct.unpack(">H", request[4:6])[0]
        if request[1] == 3:
            response = request[:2] + bytes([2 * count]) + struct.pack(f">{count}H", *self.words[at:at + count])
        else:
            self.words[at:at + count] = struct.unpack(f">{count}H", request[7:-2])
            self.words[0], self.words[5:8] = 0, [4, 0x5678, 0x1234]
            response = request[:6]
        response = with_crc(response)
        if self.misdeeds:
            response = self.misdeeds.pop(0)(response, self)
        os.write(self.line, response)


def good(response, _):
    return response


def none(_, __):
    return b""


class BadDevices(cases.Case):
    def result(self, *misdeeds):
        device = Device(*misdeeds)
        try:
            return run(device.name, "read", "1", "0x1000", "0", "--type", "u32"), device.requests
        finally:
            device.stop()

    def check_done(self, *misdeeds):
        done, requests = self.result(*misdeeds)
        self.assertEqual((done.stdout, done.returncode, done.stderr), (f"{0x12345678}\n", DONE, ""))
        self.assertEqual([request[1] for request in requests].count(16), 1)

    def check_lost(self, word, *misdeeds):
        done, requests = self.result(*misdeeds)
        self.assertEqual((done.stdout, done.returncode), ("", NO_CONNECTION), done.stderr)
        self.assertIn(word, done.stderr)
        return requests

    def test_a_lost_response_to_a_read_is_asked_for_again(self):
        self.check_done(none)
        self.check_done(good, good, none)

    def test_a_damaged_response_to_a_read_is_asked_for_again(self):
        self.check_done(lambda response, _: response[:3] + bytes([response[3] ^ 1]) + response[4:])
        self.check_done(good, good, good, lambda response, _: response[:-10])

    def test_a_late_response_is_not_taken_for_the_next_one(self):
        hurried = []

        def late(response, device):
            # cbcanctl's timeout is 1.5 s; then it waits until nothing has arrived for 1 s.
            hurried.append(device.line in select.select([device.line, device.woken], [], [], 2)[0])
            return response
        self.check_done(good, good, late)
        self.assertEqual(hurried, [False])

    def test_bytes_that_nobody_asked_for_are_not_taken_for_a_response(self):
        self.check_done(lambda response, _: response + with_crc("01 03 02 CA 0E"))

    def test_a_response_of_another_station(self):
        self.check_lost("reading R3700", *2 * [lambda response, _: with_crc(b"\x02" + response[1:-2])])

    def test_a_lost_response_to_a_write_is_not_asked_for_again(self):
        requests = self.check_lost("writing R3700: no response", good, none)
        self.assertEqual([request[1] for request in requests], [3, 16])

    def test_an_exception_is_a_response(self):
        requests = self.check_lost("reading R3700: Modbus exception 02h", lambda _, __: with_crc("01 83 02"))
        self.assertEqual(len(requests), 1)


class NoDevice(cases.Case):
    def check(self, device, word):
        done = run(device, "state", "0")
        self.assertEqual((done.stdout, done.returncode), ("", NO_CONNECTION))
        self.assertIn(f"{device}: {word}", done.stderr)

    def test_no_such_device(self):
        self.check("/dev/no-such-tty", "no such device")

    def test_not_a_serial_device(self):
        self.check(str(self.write("file", "")), "not a serial device")
        self.check("/dev", "not a serial device")

    def test_no_permission(self):
        device = Device()
        self.addCleanup(device.stop)
        os.chmod(device.name, 0)
        os.chmod(self.folder, 0o755)  # the other user may not reach the build folder
        nobody = {"user": 65534, "group": 65534, "extra_groups": []} if os.geteuid() == 0 else {}
        done = ran(shutil.copy(CBCANCTL, self.folder), "--rtu", device.name, "state", "0", cwd="/", **nobody)
        self.assertEqual((done.stdout, done.returncode), ("", NO_CONNECTION))
        self.assertIn(f"{device.name}: no permission", done.stderr)


class BadServers(cases.Case):
    """A server that answers its first request with given bytes and then closes the connection."""

    def check(self, response, is_modbus=False):
        with socket.create_server(("127.0.0.1", 0)) as listener:
            def serve():
                client, _ = listener.accept()
                with client:
                    client.recv(300)
                    if response is not None:
                        client.sendall(response)
            server = threading.Thread(target=serve)
            server.start()
            done = run(listener.getsockname()[1], "--timeout", "100", "read", "1", "0x1000", "0")
            server.join(LIMIT)
        self.assertEqual((done.returncode, done.stdout), (NO_CONNECTION, ""), done.stderr)
        self.assertIn("R3700", done.stderr)
        self.assertEqual("; is that a Modbus server? `cbcan-sim` prints where it is one" in done.stderr, not is_modbus, done.stderr)
        return done.stderr

    def test_silence(self):
        with socket.create_server(("127.0.0.1", 0)) as listener:
            port = listener.getsockname()[1]
            done = run(port, "--timeout", "100", "kernel")
        self.assertEqual((done.returncode, done.stderr), (NO_CONNECTION, f"cbcanctl: 127.0.0.1:{port}: reading R3700: no response; is that a "
                         "Modbus server? `cbcan-sim` prints where it is one, as modbus=HOST:PORT; --modbus says where to look\n"))

    def test_closes(self):
        self.check(None)

    def test_garbage(self):
        self.check(b"HTTP/1.1 400 Bad Request\r\n\r\n")

    def test_exception(self):
        said = self.check(bytes.fromhex("0000 0000 0003 01 83 02"), is_modbus=True)
        self.assertIn(": reading R3700: Modbus exception 02h", said)

    def test_nobody_listens(self):
        with socket.create_server(("127.0.0.1", 0)) as listener:
            port = listener.getsockname()[1]
        done = run(port, "state", "1")
        self.assertEqual(done.returncode, NO_CONNECTION)
        self.assertIn("is cbcan-sim running there?", done.stderr)

    def test_status_of_words_that_are_no_step(self):
        """Failures have their letter alone if the module refuses requests."""
        server = OwnedRegisters()
        with server.changed:
            server.write(3928 + 44 + 5, [0x1B05, 0x4204, 0x9B04, 0x4305])  # nodes 5 to 8: ESC, failure B, a C1 control character, failure C
        write = server.write
        server.write = lambda first, words: write(first, [1, *words[1:]] if words[0] == 0xCA0E else words)
        steps = ["unknown step 1Bh", "no response (B); it is tried again", "unknown step 9Bh",
                 "device type differs from the network file (C); it is not started"]
        done = run(server.port, "status")
        self.assertEqual([line.split(maxsplit=2)[2] for line in done.stdout.splitlines()[1:]], steps, done)
        done = run(server.port, "status", "--json")
        self.assertEqual([json.loads(line)["step"] for line in done.stdout.splitlines()[1:]], steps, done)

    def test_status_of_a_module_that_lets_only_read(self):
        server = OwnedRegisters()
        with server.changed:
            server.write(3928 + 44, [0x4A05, 0x4204])  # the module's own objects, node 1
        server.write = unittest.mock.Mock(side_effect=ConnectionError)
        done = run(server.port, "status")
        self.assertEqual((server.write.call_count, done.stdout.splitlines()),
                         (1, ["module Operational      configuration failed (J); it is not started",
                              "1      Stopped          no response (B); it is tried again"]), done)

    def test_messages_have_no_control_characters(self):
        for words in (["read\x1b[31m"], ["configure", "/no\x1b]0;where\a"], ["--modbus", "no\nhost\x7f", "kernel"]):
            done = run(1, *words)
            self.assertNotEqual(done.returncode, 0)
            self.assertEqual([c for c in done.stderr[:-1] if not c.isprintable()], [], done.stderr)


cases.main()
