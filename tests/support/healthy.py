# SPDX-License-Identifier: MIT
"""A correct client in a thread: transactions all the time, each response checked, the time of the slowest recorded."""

import threading
import time

from simulator import LIMIT, READ, WRITE, Window

NODE, OBJECT = 0x20, 0x2080  # 128 bytes that keep what was written
WORDS = 64


class Healthy(threading.Thread):
    def __init__(self, port):
        super().__init__(daemon=True)
        self.window = Window(port)
        self.transactions = 0
        self.worst = 0.0  # seconds for a transaction
        self.error = None
        self.changed = threading.Condition()
        self.pausing = self.paused = self.stopping = False
        self.start()
        self.wait_for(2)

    def run(self):
        try:
            while not self.stopping:
                self.write_and_read_back()
                self.pause_if_asked()
        except (AssertionError, OSError) as error:
            with self.changed:
                self.error = error
                self.changed.notify_all()

    def write_and_read_back(self):
        words = [(self.transactions + i) & 0xFFFF for i in range(WORDS)]
        assert self.timed(WRITE, NODE, OBJECT, 0, 2 * WORDS, *words) == 0
        assert self.timed(READ, NODE, OBJECT, 0, 2 * WORDS) == 0
        response = self.window.read(3705, 1 + WORDS)
        assert response == [2 * WORDS, *words], response

    def timed(self, *words):
        begin = time.monotonic()
        result = self.window.execute(*words)
        with self.changed:
            self.worst = max(self.worst, time.monotonic() - begin)
            self.transactions += 1
            self.changed.notify_all()
        return result

    def wait_for(self, more):
        """Returns after this many more transactions."""
        with self.changed:
            goal = self.transactions + more
            if not self.changed.wait_for(lambda: self.error or self.transactions >= goal, LIMIT):
                raise AssertionError(f"the healthy client got no response within {LIMIT} s")
        if self.error:
            raise AssertionError("the healthy client was disturbed") from self.error

    def pause(self):
        """Returns when no request is in progress; go_on() ends the pause."""
        with self.changed:
            self.pausing = True
            self.changed.wait_for(lambda: self.error or self.paused, LIMIT)

    def go_on(self):
        with self.changed:
            self.pausing = False
            self.changed.notify_all()

    def pause_if_asked(self):
        with self.changed:
            self.paused = self.pausing
            self.changed.notify_all()
            self.changed.wait_for(lambda: not self.pausing)
            self.paused = False

    def finish(self):
        """The time of the slowest transaction, in milliseconds."""
        self.stopping = True
        self.join(LIMIT)
        self.window.socket.close()
        if self.error:
            raise AssertionError("the healthy client was disturbed") from self.error
        return 1000 * self.worst
