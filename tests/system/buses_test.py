#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Connections with the bus: socketcand's clients, a pseudo-terminal, and plants that span processes. The client is python-can; sessions of SavvyCAN
and Kayak are replayed."""

import os
import random
import shlex
import socket
import struct
import subprocess
import threading
import time

import can

import cases
from healthy import Healthy
from simulator import LIMIT, READ, Simulator, connect, program_from_arguments, wait_until
from tree import ROOT

PROGRAM = program_from_arguments()


class Case(cases.Case):
    def start(self, *options, **keywords):
        return Simulator(PROGRAM, *options, **keywords, test=self)

    def python_can(self, interface, **options):
        bus = can.Bus(interface=interface, **options)
        self.addCleanup(bus.shutdown)
        return bus

    def next(self, bus, identifier):
        return wait_until(lambda: next((m for m in (bus.recv(timeout=1),) if m and m.arbitration_id == identifier), None), f"{identifier:X}")

    def check_node_answers(self, bus):
        bus.send(can.Message(arbitration_id=0x620, is_extended_id=False, data=bytes.fromhex("4018100000000000")))
        self.assertEqual(self.next(bus, 0x5A0).data.hex(), "4f18100004000000")


class Socketcand(Case):
    def test_python_can(self):
        host, port = self.start("--demo", "--socketcand", "127.0.0.1:0").where["socketcand"].rsplit(":", 1)
        left, right = (self.python_can("socketcand", host=host, port=int(port), channel="can0") for _ in range(2))
        self.check_node_answers(left)
        for message in (can.Message(arbitration_id=0x7FF, is_extended_id=False, data=bytes(range(8))),
                        can.Message(arbitration_id=0x1ABCDEF0, is_extended_id=True, data=b"\xff"), can.Message(arbitration_id=0x42)):
            left.send(message)
            self.assertEqual(self.next(right, message.arbitration_id).data, message.data)

    def test_one_who_is_silent_is_kept(self):
        simulator = self.start("--demo", "--socketcand", "127.0.0.1:0", "--clock", "manual", stdin=-1)
        with simulator.connect("socketcand") as client:
            self.assertEqual(client.recv(4096), b"< hi >")
            self.assertIn("3600", simulator.say("pass 3600s"))
            client.sendall(b"< open can0 >")
            self.assertEqual(client.recv(4096), b"< ok >")


class Slcan(Case):
    def python_can_of(self, simulator, **options):
        bus = self.python_can("slcan", channel=f"socket://{simulator.where['slcan']}", sleep_after_open=0, **options)
        self.assertEqual(bus.get_version(LIMIT), (10, 13))  # after O: frames are received from now on
        return bus

    def test_a_node_played_by_python_can(self):
        simulator = self.start("--slcan", "127.0.0.1:0")
        bus = self.python_can_of(simulator)
        self.assertEqual(bus.get_serial_number(LIMIT), "CB01")
        with simulator.window() as window:
            window.start(READ, 0x33, 0x2000, 1, 4)
            self.assertEqual(self.next(bus, 0x633).data.hex(), "4000200100000000")
            bus.send(can.Message(arbitration_id=0x5B3, is_extended_id=False, data=bytes.fromhex("43002001EFBEADDE")))
            self.assertEqual(window.result(), 0)
            self.assertEqual(window.read(3705, 3), [4, 0xBEEF, 0xDEAD])

    def test_every_kind_of_frame_between_two(self):
        simulator = self.start("--slcan", "127.0.0.1:0")
        left, right = self.python_can_of(simulator), self.python_can_of(simulator, bitrate=250000)
        for message in (can.Message(arbitration_id=0x7FF, is_extended_id=False, data=bytes(range(8))),
                        can.Message(arbitration_id=0x1ABCDEF0, is_extended_id=True, data=b"\xff"),
                        can.Message(arbitration_id=0x42, is_extended_id=False, is_remote_frame=True, dlc=1),
                        can.Message(arbitration_id=0x42, is_extended_id=True, is_remote_frame=True, dlc=8)):
            left.send(message)
            heard = self.next(right, message.arbitration_id)
            self.assertTrue(heard.equals(message, timestamp_delta=None, check_direction=False), heard)


class WaysIn(Case):
    def test_each_line_can_be_copied(self):
        simulator = self.start("--demo", "--set", "node.0x20.heartbeat_ms=10", "--slcan", "127.0.0.1:0", "--socketcand", "127.0.0.1:0",
                               "--network", "2", "--slcan", f"pty:{self.folder}/can", "--node",
                               f"5={ROOT}/plants/demo/generic.eds", "--set", "node.5.heartbeat_ms=10")
        lines = wait_until(lambda: len(simulator.errors()) >= 3 and simulator.errors(), "the ways in")
        self.assertEqual([line.split(": python3")[0] for line in lines], [f"network {name}" for name in ("1: slcan", "1: socketcand", "2: slcan")])
        for line in lines:
            with subprocess.Popen(shlex.split("/usr/bin/" + line[line.index("python3"):]), stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
                                  text=True) as logger:
                found = any(text.startswith("Timestamp: ") for text in iter(logger.stdout.readline, ""))
                logger.terminate()
            self.assertTrue(found, line)


class Terminal(Case):
    def test_python_can_again_and_again(self):
        path = f"{self.folder}/can"
        simulator = self.start("--demo", "--slcan", f"pty:{path}")
        self.assertEqual(simulator.where["slcan"], f"pty:{path}")
        for _ in range(3):
            bus = can.Bus(interface="slcan", channel=path, sleep_after_open=0, bitrate=500000)
            self.assertEqual(bus.get_version(LIMIT), (10, 13))
            self.check_node_answers(bus)
            bus.shutdown()
        self.assertEqual(simulator.errors(), [f"slcan: python3 -m can.logger -i slcan -c {path}"])
        simulator.stop()
        self.assertFalse(os.path.lexists(path))


class TwoProcesses(Case):
    """One process has the module, one the nodes."""

    def check_spans(self, spec):
        module = self.start("--can", spec)
        self.assertEqual(module.where["can"], spec)
        with module.window() as window:
            for words, size in (((0x42, 0x1000, 0, 4), 4), ((0x20, 0x1018, 2, 4), 4)):
                wait_until(lambda: window.execute(READ, *words) == 0, "a node's answer")
                self.assertEqual(window.read(3705, 1), [size])
            window.start(5055, 0x42, 0x1000, 0, 4)
            self.assertEqual(window.result(), 0)

    def nodes(self, *options):
        return self.start("--demo", "--no-module", *options)

    def test_slcan(self):
        self.check_spans("slcan:" + self.nodes("--slcan", "127.0.0.1:0").where["slcan"])

    def test_slcan_over_a_serial_line(self):
        path = f"{self.folder}/can"
        self.nodes("--slcan", f"pty:{path}")
        self.check_spans(f"slcan:{path}@1000000")

    def test_socketcand(self):
        self.check_spans("socketcand:" + self.nodes("--socketcand", "127.0.0.1:0").where["socketcand"] + "/can0")


class Crowd(Case):
    """64 clients at two servers join, flood, stop reading and end at random, with a PLC's transactions and a reader."""

    CLIENTS, FIRST = 64, 0x10000000
    SECONDS = float(os.environ.get("CBCAN_CROWD_SECONDS", 4))

    def flood(self, number):
        """Frames of a client, with increasing numbers."""
        frames = b""
        for _ in range(self.random.randrange(1, 300)):
            self.sent += 1
            data = self.sent.to_bytes(8, "big")
            if number % 2:
                frames += b"< send %08x 8 %s >" % (self.ids[number], b" ".join(b"%x" % byte for byte in data))
            else:
                frames += b"T%08X8%s\r" % (self.ids[number], data.hex().encode())
        return frames

    def act(self, number):
        client, choice = self.clients[number], self.random.random()
        try:
            if client is None:
                client = self.clients[number] = self.simulator.connect("socketcand" if number % 2 else "slcan")
                client.setblocking(False)
                self.ids[number] = max(self.ids) + 1  # frames of the previous connection are still sent
                client.send(b"< open can0 >< rawmode >" if number % 2 else b"O\r")
            elif choice < 0.05:
                if choice < 0.02:
                    client.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
                client.close()
                self.clients[number] = None
            elif choice < 0.5:
                client.send(self.flood(number))  # a part of it, if there is no room for all
            elif number % 4 != 3:  # the others never read
                client.recv(1 << 20)
        except BlockingIOError:
            pass

    def test_at_random(self):
        self.random, self.sent, self.clients = random.Random(1), 0, [None] * self.CLIENTS
        self.ids = [self.FIRST] * self.CLIENTS
        self.simulator = self.start("--demo", "--slcan", "127.0.0.1:0", "--socketcand", "127.0.0.1:0", "--set", "log.summary=true")
        healthy = Healthy(self.simulator.port)
        witness = Witness(self.simulator.where["slcan"])
        end = time.monotonic() + self.SECONDS
        while time.monotonic() < end:
            self.act(self.random.randrange(self.CLIENTS))
        for client in self.clients:
            if client:
                client.close()
        healthy.wait_for(5)
        healthy.finish()
        witness.finish()
        self.assertEqual(witness.out_of_order, 0)
        self.assertGreater(witness.frames, 100)
        code, error = self.simulator.stop()
        self.assertEqual(code, 0)
        summary = [line for line in error.splitlines() if "connections" in line and "not read in time" in line]
        self.assertEqual([line.split()[0] for line in summary], ["SLCAN", "socketcand"], error)
        print(f"{healthy.transactions} transactions, the slowest {1000 * healthy.worst:.0f} ms; {witness.frames} of {self.sent} frames heard; "
              + "; ".join(summary), flush=True)


class Witness(threading.Thread):
    """Reads all, and checks that the frames of each sender are in order."""

    def __init__(self, address):
        super().__init__(daemon=True)
        self.socket = connect(address)
        self.socket.sendall(b"L\r")
        self.frames = self.out_of_order = 0
        self.start()

    def run(self):
        last, rest = {}, b""
        while part := self.socket.recv(1 << 20):
            *lines, rest = (rest + part).split(b"\r")
            for line in lines:
                if len(line) == 26 and line.startswith(b"T1"):
                    number = int(line[10:], 16)
                    self.out_of_order += number <= last.get(line[:9], 0)
                    last[line[:9]] = number
                    self.frames += 1

    def finish(self):
        self.socket.shutdown(socket.SHUT_RDWR)
        self.join(LIMIT)


cases.main()
