#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""cbcanctl with servers that are not Modbus servers, or do not exist."""

import json
import socket
import subprocess
import threading

import cases
from owned_registers import OwnedRegisters
from simulator import LIMIT, program_from_arguments

CBCANCTL = program_from_arguments()
NO_CONNECTION = 3


def run(port, *arguments):
    return subprocess.run([CBCANCTL, "--modbus", f":{port}", *arguments], capture_output=True, text=True, timeout=LIMIT)


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
        server = OwnedRegisters()
        with server.changed:
            server.write(3928 + 44 + 5, [0x1B05, 0x4204, 0x9B04])  # nodes 5, 6, 7: ESC, failure B, a C1 control character
        steps = ["unknown step 1Bh", "failed: B", "unknown step 9Bh"]
        done = run(server.port, "status")
        self.assertEqual([line.split(maxsplit=2)[2] for line in done.stdout.splitlines()[1:]], steps, done)
        done = run(server.port, "status", "--json")
        self.assertEqual([json.loads(line)["step"] for line in done.stdout.splitlines()[1:]], steps, done)

    def test_messages_have_no_control_characters(self):
        for words in (["read\x1b[31m"], ["configure", "/no\x1b]0;where\a"], ["--modbus", "no\nhost\x7f", "kernel"]):
            done = run(1, *words)
            self.assertNotEqual(done.returncode, 0)
            self.assertEqual([c for c in done.stderr[:-1] if not c.isprintable()], [], done.stderr)


cases.main()
