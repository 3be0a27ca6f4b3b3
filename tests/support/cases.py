# SPDX-License-Identifier: MIT
"""Prints how many cases of a suite ran; it fails if none did, which unittest calls a success."""

import functools
import os
import pathlib
import signal
import sys
import tempfile
import unittest

LONG = "CBCAN_LONG" in os.environ
in_long = unittest.skipUnless(LONG, "tools/test --long runs it")


class Case(unittest.TestCase):
    @functools.cached_property
    def folder(self):
        """An empty one, removed after the test."""
        made = tempfile.TemporaryDirectory()
        self.addCleanup(made.cleanup)
        return pathlib.Path(made.name)

    def write(self, name, text):
        """The path of a new file."""
        (self.folder / name).write_text(text)
        return self.folder / name


def any_ran(ran):
    print(f"{ran} cases ran", flush=True)
    return ran > 0


def main():
    """unittest.main() that counts the cases."""
    for number in (signal.SIGHUP, signal.SIGINT):
        if signal.getsignal(number) == signal.SIG_IGN:  # in a background job; the programs that a test starts would inherit that, but not this
            signal.signal(number, lambda *_: None)
    for name in os.environ.get("CBCAN_WITHOUT", "").split():  # of another build of the program, which does not have what they test
        delattr(getattr(sys.modules["__main__"], name.split(".")[0]), name.split(".")[1])
    result = unittest.main(exit=False).result
    sys.exit(0 if any_ran(result.testsRun - len(result.skipped)) and result.wasSuccessful() else 1)
