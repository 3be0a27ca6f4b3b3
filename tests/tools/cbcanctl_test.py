#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""cbcanctl against the real cbcan-sim, and against servers that misbehave."""

import json
import pathlib
import signal
import socket
import subprocess
import sys
import threading
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
import cases
from simulator import LIMIT, Simulator, program_from_arguments, wait_until

CBCANCTL, CBCAN_SIM = program_from_arguments(sys.argv, 2)
DONE, USAGE, NO_CONNECTION, REFUSED, INTERRUPTED = 0, 1, 2, 3, 130


def run(port, *arguments):
    return subprocess.run([CBCANCTL, "--port", str(port), *arguments], capture_output=True, text=True, timeout=LIMIT)


class WithSimulator(unittest.TestCase):
    def setUp(self):
        self.simulator = Simulator(CBCAN_SIM, "--demo")
        self.addCleanup(self.simulator.stop)

    def check(self, arguments, out="", code=DONE, error=""):
        done = run(self.simulator.port, *arguments.split())
        self.assertEqual((done.stdout, done.returncode), (out, code), done.stderr)
        self.assertEqual(done.stderr, error)

    def test_write_and_read_by_type(self):
        for index, kind, value in ((0x2001, "u8", "200"), (0x2002, "u16", "65535"), (0x2003, "u24", "70000"),
                                   (0x2004, "i32", "-5"), (0x2004, "f32", "1.5"), (0x2005, "u40", "1099511627775"),
                                   (0x2008, "i64", "-1"), (0x2008, "f64", "-0.1"), (0x200E, "string", "fourteen bytes")):
            done = run(self.simulator.port, "write", "0x20", hex(index), "0", value, "--type", kind)
            self.assertEqual((done.returncode, done.stdout, done.stderr), (DONE, "", ""))
            done = run(self.simulator.port, "read", "20h", hex(index), "0", "--type", kind)
            self.assertEqual((done.returncode, done.stdout, done.stderr), (DONE, value + "\n", ""))

    def test_bytes_and_sizes(self):
        self.check("write 0x20 0x2005 0 hex:0102030405")
        self.check("read 0x20 0x2005 0", "01 02 03 04 05\n")
        self.check("write 0x20 0x2002 0 hex:2C01")
        self.check("read 0x20 0x2002 0", "0x012C 300\n")
        self.check("read 0x20 0x2002 0 --size 1", "", REFUSED,
                   "cbcanctl: 0504 0005h ABORT_READ_LENGTH: object length too big to read (CiA 301: out of memory)\n")

    def test_json(self):
        done = run(self.simulator.port, "--json", "read", "1", "0x9130", "1", "--type", "i32")
        self.assertEqual(json.loads(done.stdout), {"result": 0, "size": 4, "data": "CD 82 01 00", "value": "99021"})
        done = run(self.simulator.port, "--json", "read", "0x20", "0x3333", "0")
        self.assertEqual(done.returncode, REFUSED)
        answer = json.loads(done.stdout)
        self.assertEqual((answer["result"], answer["abort_code"]), (4, 0x06020000))
        done = run(self.simulator.port, "--json", "write", "0x20", "0x2001", "0", "1", "--type", "u8")
        self.assertEqual(json.loads(done.stdout), {"result": 0})
        done = run(self.simulator.port, "--json", "state", "1")
        self.assertEqual(json.loads(done.stdout), {"node": 1, "state": 127, "name": "Pre-operational"})

    def test_refusals_in_words(self):
        self.check("write 0x20 0x2200 0 1 --type u32", "", REFUSED,
                   "cbcanctl: 0601 0002h ABORT_RO: attempt to write a read-only object\n")
        self.check("read 0x20 0x2201 0", "", REFUSED,
                   "cbcanctl: 0601 0001h ABORT_WO: attempt to read a write-only object\n")

    def test_nmt_and_state(self):
        for service, state in (("start", "Operational"), ("stop", "Stopped"), ("preop", "Pre-operational")):
            self.check(f"nmt {service} 0x42")
            self.check("state 0x42", f"66 {state}\n")
        self.check("nmt start all")
        self.check("state all", "".join(f"{node} Operational\n" for node in (1, 2, 16, 32, 66)) + "127 Pre-operational\n")
        self.check("nmt reset-node all")
        self.check("nmt reset-comm 1")
        self.check("state 99", "99 Not detected\n")
        self.assertEqual([f for f in self.simulator.frames() if f.startswith("000#")],
                         ["000#0142", "000#0242", "000#8042", "000#0100", "000#8100", "000#8201"])

    def test_state_all_shows_silent_nodes_when_asked(self):
        done = run(self.simulator.port, "state", "all", "--all")
        self.assertEqual(len(done.stdout.splitlines()), 127)
        self.assertIn("3 Not detected\n", done.stdout)

    def test_watch(self):
        watch = subprocess.Popen([CBCANCTL, "--port", str(self.simulator.port), "watch", "--count", "2"],
                                 stdout=subprocess.PIPE, text=True)
        self.addCleanup(watch.stdout.close)
        with self.simulator.window() as window:
            # It may not be looking yet: registers change until it has seen two.
            def change():
                window.write(3769, [window.read(3769, 1)[0] ^ 0xFFFF])
                return watch.poll() is not None
            wait_until(change, "two lines")
        lines = watch.stdout.read().splitlines()
        self.assertEqual(watch.returncode, DONE)
        self.assertEqual(len(lines), 2)
        self.assertTrue(all(line.startswith("R3769 43770 DATA") for line in lines), lines)

    def test_interrupt_cancels(self):
        control = subprocess.Popen([CBCANCTL, "--port", str(self.simulator.port), "read", "99", "0x1000", "0"],
                                   stderr=subprocess.PIPE, text=True)
        self.addCleanup(control.stderr.close)
        self.simulator.wait_for_frame("663#4000100000000000")
        control.send_signal(signal.SIGINT)
        self.assertEqual(control.wait(LIMIT), INTERRUPTED)
        self.assertIn("cancelled", control.stderr.read())
        self.simulator.wait_for_frame("663#8000100000000008")

    def test_another_program_s_transaction_is_waited_for(self):
        with self.simulator.window() as window:
            window.start(5055, 99, 0x1000, 0, 4)
            self.check("read 0x42 0x1000 0 --type u32", f"{0x000F0191}\n", DONE,
                       "cbcanctl: another program's transaction is under way; waiting for it\n")

    def test_no_result_in_time(self):
        done = run(self.simulator.port, "--timeout", "50", "read", "99", "0x1000", "0")
        self.assertEqual(done.returncode, NO_CONNECTION)
        self.assertIn("no result within 50 ms", done.stderr)
        self.simulator.wait_for_frame("663#8000100000000008")


class Usage(unittest.TestCase):
    def test_wrong_usage(self):
        for arguments in ("", "reed 1 2 3", "read 1 2", "read 128 0x1000 0", "read 1 0x10000 0", "read 1 0x1000 256",
                          "read 1 1F82 0", "write 1 0x2000 0 5", "write 1 0x2000 0 300 --type u8", "nmt begin 1",
                          "nmt start 0", "state 128", "read 1 0x1000 0 --size 129", "read 1 0x1000 0 --type u12"):
            done = run(1, *arguments.split())
            self.assertEqual((done.returncode, done.stdout), (USAGE, ""), arguments)
            self.assertTrue(done.stderr, arguments)

    def test_help(self):
        done = run(1, "--help")
        self.assertEqual(done.returncode, DONE)
        for word in ("read", "write", "nmt", "state", "watch", "Exit codes"):
            self.assertIn(word, done.stdout)


class BadServers(unittest.TestCase):
    """A server that answers its first request with given bytes, and then closes."""

    def check(self, answer):
        with socket.create_server(("127.0.0.1", 0)) as listener:
            def serve():
                client, _ = listener.accept()
                with client:
                    client.recv(300)
                    if answer is not None:
                        client.sendall(answer)
            server = threading.Thread(target=serve)
            server.start()
            done = run(listener.getsockname()[1], "--timeout", "100", "read", "1", "0x1000", "0")
            server.join(LIMIT)
        self.assertEqual((done.returncode, done.stdout), (NO_CONNECTION, ""), done.stderr)
        self.assertIn("R3700", done.stderr)

    def test_closes(self):
        self.check(None)

    def test_half_an_answer(self):
        self.check(bytes.fromhex("0001 0000 0005 01 03"))

    def test_garbage(self):
        self.check(b"HTTP/1.1 400 Bad Request\r\n\r\n")

    def test_exception(self):
        self.check(bytes.fromhex("0001 0000 0003 01 83 02"))

    def test_nobody_listens(self):
        with socket.create_server(("127.0.0.1", 0)) as listener:
            port = listener.getsockname()[1]
        done = run(port, "state", "1")
        self.assertEqual(done.returncode, NO_CONNECTION)
        self.assertIn("is cbcan-sim running there?", done.stderr)


cases.main()
