#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""A ladder program, scan by scan: it starts the network and a drive, reads, writes outputs and uses a scanner window. With the name of a mistake it
makes this one. usage: cbcan-sim --demo ... -- advice_ladder.py [MISTAKE]"""

import contextlib
import sys

from cbcan_plant import EXECUTE, READ, WRITE, Plant, Window

DRIVE, TERMINALS, OWN, ALL = 16, 66, 127, 128


class Ladder:
    def __init__(self, plant, window, mistake=None):
        self.plant, self.window, self.mistake, self.number = plant, window, mistake, 0

    def makes(self, *mistakes):
        return self.mistake in mistakes

    def scan(self, count=1):
        for _ in range(count):
            self.plant.advance("20ms")

    def request(self, *words):
        """One transaction, in scans."""
        self.window.write(3699 if self.makes("address") else 3700, EXECUTE, *words)
        self.scan()
        while self.window.read(3700)[0] == EXECUTE:
            self.scan()

    def scanned(self, *words):
        """The same through the scanner window of channel 1."""
        self.number += 0 if self.makes("number") and self.number > 1 else 1
        for _ in range(10):
            self.window.write(500, self.number, *words, 0, 0)
            self.scan()
            if self.window.read(600)[0] == self.number:
                break

    def command(self, controlword, state):
        self.request(WRITE, DRIVE, 0x6040, 0, 2, controlword)
        for _ in range(0 if self.makes("statusword") else 10):
            self.request(READ, DRIVE, 0x6041, 0, 2)
            if self.window.read(3706)[0] & 0x6F == state:
                break

    def run(self):
        self.request(READ, 0, 0x1000, 0, 4)  # the own node has come up
        self.scan(100)
        self.request(WRITE, 0, 0x1F82, 0 if self.makes("all-nodes") else ALL, 2, 5)
        if not self.makes("not-started"):
            self.request(WRITE, 0, 0x1F82, OWN, 2, 5)
        for _ in range(200):
            self.request(READ, 42 if self.makes("not-heard") else DRIVE, 0x300C, 0, 1)
            if self.window.read(3706)[0] == 5:
                break
        self.request(READ, DRIVE, 1000 if self.makes("hexadecimal") else 0x1000, 0, 2 if self.makes("size") else 4)
        self.request(0x5055 if self.makes("decimal") else READ, DRIVE, 0x6041, 0, 2)
        for controlword, state in ((6, 0x21), (7, 0x23), (15, 0x27)):
            self.command(controlword, state)
        self.by_single_words(TERMINALS, 0x3333)  # an object that does not exist
        self.slow_node()
        self.outputs()
        for index in (0x1000, 0x1001, 0x1000):
            self.scanned(READ, TERMINALS, index, 0, 4)
        if self.makes("two-writers"):
            with Window(self.plant) as second:
                second.write(500, self.number, READ, TERMINALS, 0x1000, 0, 4, 0, 0)
            self.scanned(READ, TERMINALS, 0x1000, 0, 4)
        self.scan(600)
        self.window.read(3700)

    def by_single_words(self, node, index):
        words = [(3701, READ), (3702, node), (3703, index), (3704, 0), (3705, 2), (3700, EXECUTE)]
        self.window.write(3700, 0, 0)
        for register, word in reversed(words) if self.makes("flag-first") else words:
            self.window.write(register, word)
            self.scan()
        self.scan()
        if not self.makes("unread"):
            self.window.read(3700)

    def slow_node(self):
        """A request that takes long, and what the program does meanwhile."""
        self.window.write(3700, EXECUTE, READ, 99, 0x1000, 0, 4)
        self.scan()
        if self.makes("busy"):
            self.window.write(3700, EXECUTE, READ, TERMINALS, 0x1000, 0, 4)
        self.scan(60)
        self.window.read(3700)
        if self.makes("timeout"):
            self.window.write(3700, EXECUTE, READ, 99, 0x1001, 0, 1)
            self.scan(2)
            self.window.write(3700, 0)

    def outputs(self):
        self.window.write(3800 if self.makes("inputs") else 3864, 1, 2)
        if self.makes("unit"):
            with contextlib.suppress(Exception), Window(self.plant, 7) as other:
                other.read(3700)


def main():
    with Plant.around() as plant, Window(plant) as window:
        Ladder(plant, window, *sys.argv[1:]).run()


if __name__ == "__main__":
    main()
