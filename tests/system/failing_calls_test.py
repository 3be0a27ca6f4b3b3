#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""A system call fails for one client of cbcan-sim: its connection is closed, other clients are unaffected."""

import os
import socket

import cases
from simulator import LIMIT, READ, Simulator, program_from_arguments

PROGRAM, PRELOAD = program_from_arguments(2)


class ConnectionThatCannotBeWatched(cases.Case):
    def check(self, service, *options, unwatched=3):
        environment = {**os.environ, "LD_PRELOAD": PRELOAD, "CBCAN_UNWATCHED": str(unwatched)}
        simulator = Simulator(PROGRAM, "--demo", *options, env=environment, test=self)
        where = simulator.where[service]
        host, port = where.rsplit(":", 1)
        with simulator.window() as first:
            self.assertEqual(first.execute(READ, 0x42, 0x1000, 0, 4), 0)
            with socket.create_connection((host, int(port)), timeout=LIMIT) as second:
                self.assertEqual(second.recv(1), b"")
            with simulator.window() as third:
                for window in (first, third):
                    self.assertEqual(window.execute(READ, 0x42, 0x1000, 0, 4), 0)
        self.assertEqual(simulator.stop(), (0, f"cbcan-sim: {service} {where}: a further client cannot be served: reactor: watch: "
                                               "No space left on device\n"))

    def test_modbus(self):
        for unwatched in (3, 4):  # of the second client the first time, and the second
            self.check("modbus", unwatched=unwatched)

    def test_control(self):
        self.check("control", "--control", "127.0.0.1:0")

    def test_slcan(self):
        self.check("slcan", "--slcan", "127.0.0.1:0")


cases.main()
