#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""cbcan-sim on a SocketCAN interface, with can-utils and python-can as witnesses and as the other side.

CBCAN_VCAN names the interface, which must be up; needs root to pull the cable.
"""

import os
import pathlib
import subprocess
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
import cases
from simulator import Simulator, program_from_arguments, wait_until

PROGRAM = program_from_arguments(sys.argv)
VCAN = os.environ["CBCAN_VCAN"]
EDS = pathlib.Path(__file__).resolve().parents[2] / "plants/demo/generic.eds"
READ, WRITE = 5055, 5066


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


class OnVcan(unittest.TestCase):
    def start(self, *options):
        self.simulator = Simulator(PROGRAM, "--can", f"socketcan:{VCAN}", *options, test=self)
        self.window = self.simulator.window()
        self.addCleanup(self.window.socket.close)

    def test_ready_line(self):
        self.start("--demo")
        self.assertEqual(self.simulator.ready.split()[2], f"can=socketcan:{VCAN}")

    def test_transactions_seen_by_candump(self):
        self.start("--demo")
        witness = Candump(self)
        self.assertEqual(self.window.execute(WRITE, 0x42, 0x6411, 1, 2, 300), 0)
        self.assertEqual(self.window.execute(READ, 0x42, 0x6411, 1, 2), 0)
        self.assertEqual(self.window.read(3705, 2), [2, 300])
        self.assertEqual(self.window.execute(WRITE, 0, 0x1F82, 128, 0, 5), 0)
        witness.wait_for("642#2B1164012C010000", "5C2#6011640100000000", "642#4011640100000000",
                         "5C2#4B1164012C010000", "000#0100")

    def test_simulated_nodes_response_cansend(self):
        self.start("--demo")
        witness = Candump(self)
        cansend("620#4018100000000000")
        witness.wait_for("5A0#4F18100004000000")
        cansend("642#2B17100064000000")
        witness.wait_for("5C2#6017100000000000", "742#7F")
        cansend("000#0142")
        witness.wait_for("742#05")

    @unittest.skipUnless("CBCAN_LONG" in os.environ, "python-can takes half a minute to start in the guest")
    def test_node_played_by_python_can(self):
        import can
        self.start()
        with can.Bus(interface="socketcan", channel=VCAN) as bus:
            self.window.start(READ, 0x33, 0x2000, 1, 4)
            self.assertEqual(self.next_request(bus), "4000200100000000")
            bus.send(can.Message(arbitration_id=0x5B3, is_extended_id=False, data=bytes.fromhex("43002001EFBEADDE")))
            self.assertEqual(self.window.result(), 0)
            self.assertEqual(self.window.read(3705, 3), [4, 0xBEEF, 0xDEAD])
            self.window.start(WRITE, 0x33, 0x2000, 1, 1, 7)
            self.assertEqual(self.next_request(bus), "2F00200107000000")
            bus.send(can.Message(arbitration_id=0x5B3, is_extended_id=False, data=bytes.fromhex("8000200102000106")))
            self.assertEqual(self.window.result(), 4)
            self.assertEqual(self.window.abort_code(), 0x06010002)

    def next_request(self, bus):
        message = wait_until(lambda: bus.recv(timeout=1), "a frame")
        while message.arbitration_id != 0x633:
            message = wait_until(lambda: bus.recv(timeout=1), "a request to node 33h")
        return message.data.hex().upper()

    def test_cable_pulled_and_put_back(self):
        self.start("--demo", "--sdo-timeout", "200")
        self.addCleanup(ip_link, "up")
        self.assertEqual(self.window.execute(READ, 0x42, 0x1000, 0, 4), 0)
        ip_link("down")
        self.assertEqual(self.window.execute(READ, 0x42, 0x1000, 0, 4), 4)
        self.assertEqual(self.window.abort_code(), 0x05040000)
        self.assertEqual(self.window.execute(WRITE, 0, 0x1F82, 128, 0, 5), 4)
        ip_link("up")
        wait_until(lambda: self.window.execute(READ, 0x42, 0x1000, 0, 4) == 0, "the bus to be back")
        self.assertEqual(self.simulator.stop(), (0, is_down(VCAN) + is_up_again(VCAN)))


def begin(interface):
    return f"cbcan-sim: can socketcan:{interface}: "


def is_down(interface):
    return begin(interface) + f"the interface is down; `ip link set {interface} up` brings it up\n"


def is_up_again(interface):
    return begin(interface) + "the interface is up again\n"


def none_such(interface):
    return begin(interface) + (f"no such interface; `ip link` lists them; for a virtual one: ip link add dev {interface} type vcan "
                               f"&& ip link set {interface} up\n")


class OwnInterface(unittest.TestCase):
    """The test adds and removes its own interface; Modbus is served meanwhile."""

    NAME = f"cbsys{os.getpid() % 100000}"

    def setUp(self):
        self.addCleanup(subprocess.run, ["ip", "link", "del", "dev", self.NAME], stderr=subprocess.DEVNULL)

    def make(self):
        subprocess.run(["ip", "link", "add", "dev", self.NAME, "type", "vcan"], check=True)

    def start(self):
        self.simulator = Simulator(PROGRAM, "--demo", "--can", f"socketcan:{self.NAME}", "--sdo-timeout", "200", test=self)
        self.window = self.simulator.window()
        self.addCleanup(self.window.socket.close)

    def reads(self):
        return self.window.execute(READ, 0x42, 0x1000, 0, 4) == 0

    def stop(self):
        """The exit code and the messages, except about a slow machine: an emulated one may be too slow for a plant."""
        code, errors = self.simulator.stop()
        return code, "".join(line for line in errors.splitlines(keepends=True) if "behind the clock" not in line)

    def wait_for_line(self, line):
        wait_until(lambda: self.window.read(0, 1) == [0] and line.strip() in self.simulator.errors(), line)

    def test_gone_and_back(self):
        self.make()
        ip_link("up", interface=self.NAME)
        self.start()
        self.assertTrue(self.reads())
        subprocess.run(["ip", "link", "del", "dev", self.NAME], check=True)
        self.wait_for_line(none_such(self.NAME))
        self.assertFalse(self.reads())
        self.make()
        self.wait_for_line(is_down(self.NAME))
        self.assertFalse(self.reads())
        ip_link("up", interface=self.NAME)
        wait_until(self.reads, "the bus to be back")
        code, error = self.simulator.stop()
        # The kernel takes an interface down before it deletes it; the message about that is possible, too.
        self.assertEqual((code, error.removeprefix(is_down(self.NAME))),
                         (0, none_such(self.NAME) + is_down(self.NAME) + is_up_again(self.NAME)))

    def test_a_network_for_each_of_two_interfaces(self):
        other = self.NAME + "b"
        self.addCleanup(subprocess.run, ["ip", "link", "del", "dev", other], stderr=subprocess.DEVNULL)
        for name in (self.NAME, other):
            subprocess.run(["ip", "link", "add", "dev", name, "type", "vcan"], check=True)
            ip_link("up", interface=name)
        simulator = Simulator(PROGRAM, "--can", f"socketcan:{self.NAME}", "--node", f"5={EDS}", "--set", "node.5.objects+={index=0x2002,value=1}", "--network",
                              "2", "--can", f"socketcan:{other}", "--node", f"5={EDS}", "--set", "node.5.objects+={index=0x2002,value=2}", test=self)
        self.assertEqual([simulator.where["can"], simulator.where["2/can"]], [f"socketcan:{self.NAME}", f"socketcan:{other}"])
        for unit in (1, 2):
            with simulator.window(unit) as window:
                self.assertEqual(window.execute(READ, 5, 0x2002, 0, 2), 0)
                self.assertEqual(window.read(3706, 1), [unit])
        ip_link("down", interface=self.NAME)
        with simulator.window(2) as window:
            self.assertEqual(window.execute(READ, 5, 0x2002, 0, 2), 0)


cases.main()
