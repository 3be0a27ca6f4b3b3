#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""cbcan-sim on a SocketCAN interface, with can-utils as witnesses and as the other side.

CBCAN_VCAN names the interface, which must be up; needs root to add others.
"""

import os
import subprocess

import cases
from simulator import READ, WRITE, Simulator, program_from_arguments, wait_until
from tree import ROOT

PROGRAM = program_from_arguments()
VCAN = os.environ["CBCAN_VCAN"]
EDS = ROOT / "plants/demo/generic.eds"


def ip_link(*arguments, interface=VCAN):
    subprocess.run(["ip", "link", "set", "dev", interface, *arguments], check=True)


def cansend(frame):
    subprocess.run(["cansend", VCAN, frame], check=True)


class Candump:
    """candump -L as a witness; it is ready when it has received a first frame."""

    MARK = "7E5#00"

    def __init__(self, test):
        self.process = subprocess.Popen(["candump", "-L", VCAN], stdout=subprocess.PIPE)
        test.addCleanup(self.stop)
        os.set_blocking(self.process.stdout.fileno(), False)
        self.text = b""
        wait_until(self.hears_us, "candump to listen")

    def hears_us(self):
        cansend(self.MARK)
        return self.MARK in self.frames()

    def frames(self):
        self.text += self.process.stdout.read() or b""
        return [line.split()[2].decode() for line in self.text.splitlines(keepends=True) if line.endswith(b"\n")]

    def wait_for(self, *frames):
        wait_until(lambda: self.in_order(frames), f"{frames} on {VCAN}")

    def in_order(self, frames):
        rest = iter(self.frames())
        return all(frame in rest for frame in frames)

    def stop(self):
        self.process.kill()
        self.process.wait()
        self.process.stdout.close()


class OnVcan(cases.Case):
    def start(self, *options, can=VCAN):
        self.simulator = Simulator(PROGRAM, "--can", f"socketcan:{can}", *options, test=self)
        self.window = self.simulator.window()
        self.addCleanup(self.window.socket.close)

    def test_transactions_seen_by_candump(self):
        self.start("--demo")
        witness = Candump(self)
        self.assertEqual(self.window.execute(WRITE, 0x42, 0x6411, 1, 2, 300), 0)
        self.assertEqual(self.window.execute(READ, 0x42, 0x6411, 1, 2), 0)
        self.assertEqual(self.window.read(3705, 2), [2, 300])
        self.assertEqual(self.window.execute(WRITE, 0, 0x1F82, 128, 0, 5), 0)
        witness.wait_for("642#2B1164012C010000", "5C2#6011640100000000", "642#4011640100000000", "5C2#4B1164012C010000", "000#0100")

    def test_simulated_nodes_response_cansend(self):
        self.start("--demo")
        witness = Candump(self)
        cansend("620#4018100000000000")
        witness.wait_for("5A0#4F18100004000000")
        cansend("642#2B17100064000000")
        witness.wait_for("5C2#6017100000000000", "742#7F")
        cansend("000#0142")
        witness.wait_for("742#05")

    def add_interface(self, end):
        name = f"cbsys{os.getpid() % 100000}{end}"
        self.addCleanup(subprocess.run, ["ip", "link", "del", "dev", name], stderr=subprocess.DEVNULL)
        subprocess.run(["ip", "link", "add", "dev", name, "type", "vcan"], check=True)
        ip_link("up", interface=name)
        return name

    def test_the_cable_is_pulled_and_the_adapter_too(self):
        """Modbus is served throughout, and a message says what to do."""
        name = self.add_interface("c")
        self.start("--demo", "--sdo-timeout", "200", can=name)
        reads = lambda: self.window.execute(READ, 0x42, 0x1000, 0, 4) == 0
        says = f"cbcan-sim: can socketcan:{name}: "
        down = f"{says}the interface is down; `ip link set {name} up` brings it up\n"
        gone = (f"{says}no such interface; `ip link` lists them; for a virtual one: ip link add dev {name} type vcan "
                f"&& ip link set {name} up\n")
        self.assertTrue(reads())
        ip_link("down", interface=name)
        self.assertFalse(reads())
        self.assertEqual(self.window.abort_code(), 0x05040000)
        self.assertEqual(self.window.execute(WRITE, 0, 0x1F82, 128, 0, 5), 4)
        subprocess.run(["ip", "link", "del", "dev", name], check=True)
        wait_until(lambda: gone.strip() in self.simulator.errors() and not reads(), gone)
        self.add_interface("c")
        wait_until(reads, "the bus to be back")
        lines = [line for line in self.simulator.stop()[1].splitlines(keepends=True) if "behind the clock" not in line]
        self.assertEqual([lines[0], lines[1], lines[-1]], [down, gone, f"{says}the interface is up again\n"])

    def test_a_network_for_each_of_two_interfaces(self):
        one, other = self.add_interface("a"), self.add_interface("b")
        simulator = Simulator(PROGRAM, "--can", f"socketcan:{one}", "--node", f"5={EDS}", "--set", "node.5.objects+={index=0x2002,value=1}", "--network",
                              "2", "--can", f"socketcan:{other}", "--node", f"5={EDS}", "--set", "node.5.objects+={index=0x2002,value=2}", test=self)
        self.assertEqual([simulator.where["can"], simulator.where["2/can"]], [f"socketcan:{one}", f"socketcan:{other}"])
        for unit in (1, 2):
            with simulator.window(unit) as window:
                self.assertEqual(window.execute(READ, 5, 0x2002, 0, 2), 0)
                self.assertEqual(window.read(3706, 1), [unit])
        ip_link("down", interface=one)
        with simulator.window(2) as window:
            self.assertEqual(window.execute(READ, 5, 0x2002, 0, 2), 0)


cases.main()
