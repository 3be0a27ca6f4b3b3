# SPDX-License-Identifier: MIT
"""The boot loader of the MPS2 board in QEMU, and programs that cbcanctl sends to it through cbcan-sim.

usage: mps2_boot_loader_test.py BOOT_LOADER BOOT_LOADER_CUT PROGRAM_FOLDER CBCAN_SIM CBCANCTL
"""

import json
import pathlib
import zlib

import cases
from done import ran
from mcu import Mcu
from simulator import Simulator, program_from_arguments, wait_until

LOADER, CUT, FOLDER = program_from_arguments(), program_from_arguments(), pathlib.Path(program_from_arguments())
CBCAN_SIM, CBCANCTL = program_from_arguments(), program_from_arguments()
NODE = 0x42
START, RESET, BOOT_UP = 1, 2, "742#00"
DISTANCE = 1 if cases.LONG else 10  # of the writes of a copy that are cut
PROGRAMS = {number: FOLDER / f"mps2_program_{number}.bin" for number in (1, 2, 3)}
CRCS = {number: zlib.crc32(path.read_bytes()) for number, path in PROGRAMS.items()}


class BootLoader(cases.Case):
    def board(self, image=LOADER):
        self.sim = Simulator(CBCAN_SIM, "--slcan", "127.0.0.1:0", test=self)
        mcu = Mcu(image, can=f"tcp:{self.sim.where['slcan']},nodelay=on", options=("-semihosting-config", f"enable=on,target=native,arg={DISTANCE}"))
        self.addCleanup(lambda: mcu.process.poll() is None and mcu.stop())
        self.ready()
        return mcu

    def ctl(self, *arguments):
        return ran(CBCANCTL, "--modbus", f":{self.sim.port}", *map(str, arguments))

    def number(self, index):
        """1F51h..1F57h; None = no response."""
        done = self.ctl("read", NODE, index, 1, "--json")
        return json.loads(done.stdout)["value"] if done.returncode == 0 else None

    def ready(self):
        wait_until(lambda: self.number(0x1F51) is not None, "the node")

    def runs(self):
        """The number of the program that runs; 0 = the boot loader; None = no response, as it is being reset."""
        self.ready()
        crc = self.number(0x1F51) and self.number(0x1F56)
        return crc and next(number for number in CRCS if CRCS[number] == crc)

    def send(self, path):
        return self.ctl("program", NODE, path)

    def update(self, number):
        done = self.send(PROGRAMS[number])
        self.assertEqual((done.returncode, done.stdout),
                         (0, f"{NODE} runs its new program: {PROGRAMS[number].stat().st_size} bytes, CRC {CRCS[number]:08X}h\n"),
                         done.stderr)

    def confirm(self):
        """A program counts as working when a master has started it."""
        self.assertEqual(self.ctl("nmt", "start", NODE).returncode, 0)
        wait_until(lambda: self.ctl("state", NODE).stdout.startswith(f"{NODE} Operational"), "Operational")

    def control(self, command):
        before = self.sim.frames().count(BOOT_UP)
        self.assertEqual(self.ctl("write", NODE, 0x1F51, 1, command, "--type", "u8").returncode, 0)
        wait_until(lambda: self.sim.frames().count(BOOT_UP) > before, "a restart")

    def test_a_program_is_on_trial_until_it_is_started_and_the_one_before_comes_back(self):
        self.board()
        self.assertEqual(self.runs(), 0)
        self.assertEqual((self.number(0x1F57), self.number(0x1018)), (1 << 1, 0))  # no program; no vendor-ID
        self.update(1)
        self.confirm()
        self.control(RESET)
        self.assertEqual(self.runs(), 1)
        self.update(2)
        self.confirm()
        self.update(3)
        self.control(RESET)
        self.assertEqual(self.runs(), 2)

    def test_what_is_no_program_for_the_board_leaves_the_one_that_is_there(self):
        self.board()
        self.update(1)
        self.confirm()
        good = PROGRAMS[2].read_bytes()
        for name, image in (("short", good[:-1]), ("rotten", good[:5000] + bytes([good[5000] ^ 1]) + good[5001:]), ("text", b"no program" * 100),
                            ("other board", good.replace(b"mps2_an385", b"mps2_an386")), ("long", good.ljust(33_000, b"\0"))):
            with self.subTest(name):
                (self.folder / "image.bin").write_bytes(image)
                done = self.send(self.folder / "image.bin")
                self.assertEqual((done.returncode, done.stdout), (4, ""), done)
                self.control(START)
                self.assertEqual(self.runs(), 1)

    def test_a_power_cut_at_any_write_leaves_a_program_that_runs(self):
        mcu = self.board(CUT)
        self.update(1)
        self.confirm()
        while self.send(PROGRAMS[2]).returncode != 0:
            self.assertEqual(self.runs(), 1)
        self.assertEqual(self.runs(), 2)
        self.confirm()
        cuts = mcu.stop().split()[1::2]
        copy = -(-len(PROGRAMS[2].read_bytes()) // 32) + 8 + 1  # units, pages, a record
        self.assertEqual([int(cut, 16) for cut in cuts], [*range(1, copy + 1, 10 * DISTANCE), *range(1, copy + 1, DISTANCE),
                                                          *range(1, copy + 1 + (copy % 3 == 0), DISTANCE)])
        # At a third of the cuts nothing is written: if the record is not, the copy is done again, and its mark is write copy + 1.


if __name__ == "__main__":
    cases.main()
