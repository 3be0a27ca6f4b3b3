# SPDX-License-Identifier: MIT
"""A serial line between two programs: two pseudo-terminals, and a thread that passes bytes on."""

import os
import select
import threading
import tty


class SerialLine:
    def __init__(self):
        self.masters, self.slaves = zip(*(os.openpty() for _ in range(2)))
        for slave in self.slaves:
            tty.setraw(slave)
        self.ends = [os.ttyname(slave) for slave in self.slaves]
        self.stop_reader, self.stop_writer = os.pipe()
        self.thread = threading.Thread(target=self.hand_on)
        self.thread.start()

    def hand_on(self):
        while True:
            ready = select.select([*self.masters, self.stop_reader], [], [])[0]
            if self.stop_reader in ready:
                return
            for side in ready:
                os.write(self.masters[1 - self.masters.index(side)], os.read(side, 4096))

    def close(self):
        os.close(self.stop_writer)
        self.thread.join()
        for descriptor in (*self.masters, *self.slaves, self.stop_reader):
            os.close(descriptor)
