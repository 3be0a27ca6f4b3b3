#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""examples/class.sh, and what docs/how-to/class.md says about logs.

usage: class_test.py CBCAN_SIM
"""

import os
import re
import signal
import socket
import subprocess

import cases
from healthy import Healthy
from simulator import LIMIT, READ, Simulator, Window, program_from_arguments, wait_until
from tree import ROOT

PROGRAM = program_from_arguments()
ENVIRONMENT = os.environ | {"PATH": f"{os.path.dirname(PROGRAM)}:/usr/bin:/bin"}


class Class(cases.Case):
    def start(self, *options):
        script = subprocess.Popen([ROOT / "examples/class.sh", self.folder / "class", *options], env=ENVIRONMENT, text=True,
                                  stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        self.addCleanup(script.communicate)
        self.addCleanup(script.terminate)
        script.stdin.write("ana\nben\n")
        script.stdin.close()
        script.stdin = None
        return script

    def test_each_student_has_an_address_and_a_log(self):
        for run in (1, 2):
            script = self.start("--demo")
            ports = []
            for name in ("ana", "ben"):
                line = script.stdout.readline()
                ports += re.fullmatch(rf"{name} modbus={socket.gethostname()}:(\d+) can=virtual\n", line).groups()
                self.assertEqual((self.folder / "class" / name / "address").read_text(), line)
                with Window(int(ports[-1])) as window:
                    self.assertEqual(window.execute(READ, 0x42, 0x1000, 0, 4), 0)
            script.terminate()
            script.wait(LIMIT)
            for port in ports:
                wait_until(lambda port=port: socket.socket().connect_ex(("127.0.0.1", int(port))) != 0, "the end of the plant")
            for name in ("ana", "ben"):
                log = (self.folder / "class" / name / "bus.log").read_text()
                self.assertEqual(log.count(" 642#4000100000000000\n"), run)

    def test_a_wrong_option_is_reported(self):
        script = self.start("--demp")
        self.assertEqual(script.wait(LIMIT), 1)
        self.assertIn("--demp: no such option", script.stderr.read())


class WeekOfLogs(cases.Case):
    def test_the_ring_of_dumpcap(self):
        os.mkfifo(self.folder / "bus")
        ring = subprocess.Popen(["dumpcap", "-q", "-i", "bus", "-b", "filesize:100", "-b", "files:2", "-w", "ring.pcapng"], cwd=self.folder,
                                stderr=subprocess.PIPE, text=True)
        self.addCleanup(ring.communicate)
        self.addCleanup(ring.terminate)
        simulator = Simulator(PROGRAM, "--demo", "--pcap", self.folder / "bus", log=False, test=self)
        client = Healthy(simulator.port)
        wait_until(lambda: any("_00004_" in line for line in iter(ring.stderr.readline, "")), "the fourth file")
        client.finish()
        newest = lambda: max(self.folder.glob("ring_*")).stat().st_size
        with simulator.window() as window:  # until the file just begun has both protocols, and is not about to end
            wait_until(lambda: window.execute(READ, 0x42, 0x1000, 0, 4) == 0 and 5_000 < newest() < 90_000, "a file with both protocols")
        simulator.stop()
        ring.wait(LIMIT)
        files = sorted(self.folder.glob("ring_*"))
        self.assertEqual(len(files), 2)
        for file in files:
            read = subprocess.run(["tshark", "-r", file, "-d", "can.subdissector=canopen", "-T", "fields", "-e", "_ws.col.Protocol"],
                                  capture_output=True, text=True, timeout=LIMIT)
            self.assertEqual((read.returncode, set(read.stdout.split())), (0, {"Modbus/TCP", "CANopen"}), read.stderr)


cases.main()
