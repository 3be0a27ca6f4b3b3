#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Two CAN networks in one program: the Modbus unit ID selects the network, and they are independent."""

import pathlib
import subprocess

import cases
from done import done
from simulator import EXECUTE, LIMIT, READ, STANDING, WRITE, Simulator, program_from_arguments
from tree import ROOT

PROGRAM = program_from_arguments()
EDS = ROOT / "plants/demo/generic.eds"

PLANT = f"""
[[node]]
id = 5
eds = "{EDS}"
objects = [ {{ index = 0x2002, value = 0x1111 }} ]
faults = [ {{ kind = "response-late", delay_ms = 50, count = 1 }} ]

[[network]]
[network.can]
slcan = "127.0.0.1:0"

[network.log]
file = "two.log"

[[network.node]]
id = 5
eds = "{EDS}"
objects = [ {{ index = 0x2002, value = 0x2222 }} ]
faults = [ {{ kind = "response-late", delay_ms = 50, count = 1 }} ]
"""


def frames_in(log):
    return [line.split()[2] for line in log.read_text().splitlines()]


class TwoNetworks(cases.Case):
    def setUp(self):
        self.simulator = Simulator(PROGRAM, "--config", self.write("plant.toml", PLANT), "--clock", "manual", "--set", "log.summary=true", stdin=subprocess.PIPE, test=self)

    def unit(self, number):
        window = self.simulator.window(number)
        self.addCleanup(window.socket.close)
        return window

    def test_transactions_on_both_at_once(self):
        one, two = self.unit(1), self.unit(2)
        one.start(READ, 5, 0x2002, 0, 2)
        two.start(READ, 5, 0x2002, 0, 2)
        self.simulator.say("pass 49ms")
        self.assertEqual([one.read(3700, 1), two.read(3700, 1)], [[EXECUTE], [EXECUTE]])
        self.simulator.say("pass 1ms")
        self.assertEqual([one.read(3700, 7)[::6], two.read(3700, 7)[::6]], [[0, 0x1111], [0, 0x2222]])
        self.assertEqual(frames_in(self.simulator.log_path)[-2:], ["605#4002200000000000", "585#4B02200011110000"])
        self.assertEqual(frames_in(self.folder / "two.log")[-2:], ["605#4002200000000000", "585#4B02200022220000"])

    def test_nmt_of_one_network(self):
        one, two = self.unit(1), self.unit(2)
        two.start(WRITE, 128, 0x1F82, 128, 1, 5)
        self.assertEqual(two.read(3700, 1), [0])
        self.assertEqual(self.simulator.say("nodes"), '#1 5 pre-operational none "cbcan generic node"\n2/#1 2/5 operational none "cbcan generic node"\nok\n')
        self.assertNotIn("000#0100", frames_in(self.simulator.log_path))
        self.assertIn("000#0100", frames_in(self.folder / "two.log"))

    def test_adapters_are_on_their_own_bus(self):
        self.assertEqual(sorted(self.simulator.where), ["2/can", "2/slcan", "can", "modbus"])
        with self.simulator.connect("2/slcan") as adapter:
            adapter.sendall(b"O\r")
            self.assertEqual(adapter.recv(1), b"\r")
            one, two = self.unit(1), self.unit(2)
            one.start(WRITE, 5, 0x1F82, 5, 1, 5)
            two.start(WRITE, 5, 0x1F82, 5, 1, 4)
            heard = b""
            while heard.count(b"\r") < 1:
                heard += adapter.recv(100)
        self.assertEqual(heard, b"t00020205\r")

    def test_the_summary_names_the_network(self):
        self.unit(2).start(READ, 5, 0x2002, 0, 2)
        self.simulator.say("pass 50ms")
        self.unit(3).request(b"\1\0\0\0\1")
        code, text = self.simulator.stop()
        self.assertEqual(code, 0)
        self.assertIn("network 1: transactions 0, failed 0, cancelled 0\n", text)
        self.assertIn("network 2: transactions 1, failed 0, cancelled 0\n", text)
        self.assertIn("\nModbus requests 2, exceptions 1, connections 2\n", text)
        self.assertIn("network 2: SLCAN connections 0, frames not read in time 0\n", text)


class WithAndWithout(cases.Case):
    def run_plant(self, *options):
        log = self.folder / "one.log"
        done(PROGRAM, *STANDING, "--log", log, "--fault", "bus:frame-loss probability=0.2", "--fault", "66:heartbeat-stops probability=0.5",
             "--set", "node.66.heartbeat_ms=10", "--set", "node.66.signals+={index = 0x6401, sub = 1, shape = 'noise', mean = 100, deviation = 50}",
             *options, input="pass 2s\n", timeout=LIMIT)
        return log.read_text()

    def test_a_second_network_changes_nothing_in_the_first(self):
        alone = self.run_plant()
        self.assertGreater(alone.count("\n"), 50)
        self.assertEqual(alone, self.run_plant("--network", "2", "--node", f"66={EDS}", "--set", "node.66.heartbeat_ms=7", "--fault",
                                               "bus:frame-loss probability=0.2"))

    def test_a_plant_without_any_module_has_no_modbus_and_one_with_a_second_module_has(self):
        without = Simulator(PROGRAM, "--no-module", "--network", "2", "--no-module", "--slcan", "127.0.0.1:0", log=False, test=self)
        self.assertEqual(without.ready.split()[1:3], ["can=virtual", "2/can=virtual"])
        only_second = Simulator(PROGRAM, "--no-module", "--network", "2", log=False, test=self)
        for unit, response in ((1, b"\x83\x0a"), (2, b"\x03\x02\x00\x00"), (255, b"\x83\x0a")):
            with only_second.window() as window:
                self.assertEqual(window.request(b"\x03\x0e\x74\x00\x01", unit=unit), response)


class StoredParameters(cases.Case):
    SAVE, LOAD = (0x6173, 0x6576), (0x6F6C, 0x6461)

    def setUp(self):
        self.files = [self.folder / name for name in ("one.par", "two.par")]

    def start(self):
        simulator = Simulator(PROGRAM, "--set", f"module.parameters={self.files[0]}", "--network", "2", "--set", f"module.parameters={self.files[1]}", "--network", "3", log=False)
        self.addCleanup(simulator.stop)
        return simulator

    def test_each_module_has_its_own_after_a_restart(self):
        simulator = self.start()
        for unit, saves in ((1, 0), (2, 0), (3, 4)):
            with simulator.window(unit) as window:
                self.assertEqual(window.execute(WRITE, 0, 0x1017, 0, 2, 1000 * unit), 0)
                self.assertEqual(window.execute(WRITE, 0, 0x3003, 0, 2, 100 * unit), 0)
                self.assertEqual(window.execute(WRITE, 0, 0x1010, unit, 4, *self.SAVE), saves)
                if saves:
                    self.assertEqual(window.abort_code(), 0x08000020)
                self.assertEqual(window.execute(WRITE, 0, 0x3003, 0, 2, 77), 0)
        self.assertEqual(simulator.stop()[0], 0)
        self.assertEqual([file.read_text().splitlines()[2:] for file in self.files], [["1017:00 = E803", "3003:00 = 6400"], ["1017:00 = D007"]])
        simulator = self.start()
        for unit, values in ((1, [1000, 100]), (2, [2000, 1000]), (3, [0, 1000])):
            with simulator.window(unit) as window:
                for index, value in zip((0x1017, 0x3003), values):
                    self.assertEqual((window.execute(READ, 0, index, 0, 2), window.read(3706, 1)), (0, [value]))
                self.assertEqual(window.execute(WRITE, 0, 0x1011, 1, 4, *self.LOAD), 0 if unit < 3 else 4)
        simulator.stop()
        self.assertEqual([file.read_text().splitlines()[2:] for file in self.files], [[], []])

    def test_a_file_that_is_broken_or_cannot_be_written(self):
        self.files[0].write_text("1017 = 5\n")
        refused = done(PROGRAM, "--set", f"module.parameters={self.files[0]}", code=2, timeout=LIMIT)
        self.assertIn(f'{self.files[0]}:1: "1017 = 5": write INDEX:SUB = BYTES', refused.stderr)
        self.files[0].write_text("1017:00 = E803\n5FFF:00 = 01\n")
        simulator = self.start()
        pathlib.Path(str(self.files[0]) + ".new").mkdir()
        with simulator.window() as window:
            self.assertEqual(window.execute(WRITE, 0, 0x1010, 1, 4, *self.SAVE), 4)
            self.assertEqual(window.abort_code(), 0x06060000)
        code, text = simulator.stop()
        told = [line for line in text.splitlines() if line.startswith(f"cbcan-sim: {self.files[0]}: ")]
        self.assertEqual(code, 0)
        self.assertEqual([line.split(": ", 2)[2] for line in told],
                         ["left out, as the node has no such parameter of this length: 5FFF:00",
                          "parameters could not be stored: Is a directory"])
        self.assertEqual(self.files[0].read_text(), "1017:00 = E803\n5FFF:00 = 01\n")


cases.main()
