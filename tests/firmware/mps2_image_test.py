# SPDX-License-Identifier: MIT
"""The image for the MPS2 board in QEMU, over Modbus RTU, with the test or cbcan-sim's nodes at its CAN side.

usage: mps2_image_test.py IMAGE CBCAN_SIM
"""

import multiprocessing
import os
import random
import select
import struct

import cases
from mcu import Mcu, crc, die_with_parent
from simulator import READ, WRITE, Simulator, program_from_arguments, wait_until

OPENING = b"\r\r\rC\rS6\rO\r"
BOOT_UP = b"t77F100\r"
TRANSACTIONS = 10_000 if cases.LONG else 200
GARBAGE = 100_000


def spin():
    die_with_parent()
    while True:
        pass


class LoadedHost:
    """One more busy process than the machine has processors."""

    def __enter__(self):
        self.processes = [multiprocessing.Process(target=spin, daemon=True) for _ in range(os.cpu_count() + 1)]
        for process in self.processes:
            process.start()

    def __exit__(self, *_):
        for process in self.processes:
            process.kill()
            process.join()


def hear_silence(line):
    """Discards input until there is none for a while: the silence between frames that RTU requires of a client."""
    while select.select([line.socket], [], [], 0.3)[0]:
        line.socket.recv(65536)


def ask_until_answered(mcu):
    """The line may still be full of garbage, so that a request is lost: repeats it, with silence in between."""
    frame = b"\x01" + struct.pack(">BHH", 3, 3700, 1)

    def answered():
        hear_silence(mcu.modbus)
        mcu.modbus.send(frame + crc(frame))
        return select.select([mcu.modbus.socket], [], [], 1)[0]

    wait_until(answered, "a response after the garbage")
    mcu.modbus.receive(7)


def read_until_answered(mcu):
    """Reads 2000h of node 5 through the window, until no garbage is before the response any more."""

    def answered():
        mcu.write(3700, [0xCA0E, READ, 5, 0x2000, 0, 4])
        read_until(mcu.can, b"t60584000200000000000\r")
        mcu.can.send(b"\rt58584300200078563412\r")
        while mcu.read(3700, 1) == [0xCA0E]:
            pass
        return mcu.read(3700, 8) == [0, READ, 5, 0x2000, 0, 4, 0x5678, 0x1234]

    wait_until(answered, "an SDO response after the garbage")


def read_until(line, text):
    data = b""
    while not data.endswith(text):
        data += line.receive(1)
    return data


class Image(cases.Case):
    def finish(self, mcu):
        """The end of every test: the image still responds, and its stack is within its limit."""
        diagnostics = mcu.diagnostics()
        print(f"figure: {self.id().split('.')[-1]}: stack {diagnostics['stack_used']} of {diagnostics['stack_size']} bytes")
        self.assertIn(diagnostics["stack_size"], (1536, 2048))
        self.assertLessEqual(diagnostics["stack_used"], diagnostics["stack_size"] // 2)
        return diagnostics

    def test_the_same_program_runs_on_three_cores(self):
        for machine in "mps2-an385", "mps2-an386", "mps2-an500":
            with self.subTest(machine), Mcu(IMAGE, machine) as mcu:
                self.assertEqual(mcu.can.receive(len(OPENING + BOOT_UP)), OPENING + BOOT_UP)
                self.assertEqual(mcu.execute(READ, 0, 0x3001, 0, 1, seen=7), [0, READ, 0, 0x3001, 0, 1, 127])
                diagnostics = self.finish(mcu)
                self.assertEqual(diagnostics["reset_cause"], 1)
                self.assertEqual(diagnostics["transactions"], 1)

    def test_transactions_on_a_loaded_host_none_lost_none_wrong(self):
        """Writes random bytes of both sizes to the node and reads them back; no request is sent twice."""
        chance = random.Random(1)
        with Simulator(SIMULATOR, "--demo", "--no-module", "--slcan", "127.0.0.1:0", log=False) as sim:
            with Mcu(IMAGE, can=f"tcp:{sim.where['slcan']},nodelay=on", options=("-icount", "shift=5,sleep=on")) as mcu, LoadedHost():
                for number in range(TRANSACTIONS // 2):
                    index, size = (0x2004, 4) if number % 32 else (0x2080, 128)
                    words = [chance.randrange(65536) for _ in range(size // 2)]
                    self.assertEqual(mcu.execute(WRITE, 0x20, index, 0, size, *words), [0], number)
                    blank = [0] * (size // 2)
                    seen = mcu.execute(READ, 0x20, index, 0, 128, *blank, seen=6 + size // 2)
                    self.assertEqual(seen, [0, READ, 0x20, index, 0, size, *words], number)
                diagnostics = self.finish(mcu)
                self.assertEqual(diagnostics["transactions"], TRANSACTIONS)
                for name in "transactions_failed", "transactions_cancelled", "modbus_crc_errors", "modbus_lost", "can_lost":
                    self.assertEqual(diagnostics[name], 0, name)

    def test_a_hundred_thousand_random_bytes_into_each_line_and_it_still_responses(self):
        chance = random.Random(2)
        with Mcu(IMAGE) as mcu:
            mcu.can.receive(len(OPENING + BOOT_UP))
            for _ in range(GARBAGE // 1000):
                mcu.can.send(chance.randbytes(1000))
                mcu.modbus.send(chance.randbytes(1000))
            ask_until_answered(mcu)
            read_until_answered(mcu)
            diagnostics = self.finish(mcu)
            self.assertGreater(diagnostics["can_errors"], 100)


if __name__ == "__main__":
    IMAGE, SIMULATOR = program_from_arguments(2)
    cases.main()
