# SPDX-License-Identifier: MIT
"""Prints how many cases of a suite ran; it fails if fewer ran than CBCAN_CASES (from CMakeLists.txt)."""

import os
import signal
import sys
import unittest


def enough(ran):
    print(f"{ran} cases ran", flush=True)
    committed = int(os.environ.get("CBCAN_CASES", 0))
    if ran < committed:
        print(f"but {committed} are committed: some were lost, or were skipped; if that is meant, commit CASES {ran} "
              "for this test in its CMakeLists.txt", flush=True)
    return ran >= committed


def main():
    """unittest.main() that counts the cases, unless its arguments choose some of them."""
    for number in (signal.SIGHUP, signal.SIGINT):
        if signal.getsignal(number) == signal.SIG_IGN:  # in a background job; the programs that a test starts would inherit that, but not this
            signal.signal(number, lambda *_: None)
    for name in os.environ.get("CBCAN_WITHOUT", "").split():  # of another build of the program, which does not have what they test
        delattr(getattr(sys.modules["__main__"], name.split(".")[0]), name.split(".")[1])
    chosen = len(sys.argv) > 1
    result = unittest.main(exit=False).result
    ran = result.testsRun - len(result.skipped)
    sys.exit(0 if result.wasSuccessful() and (chosen or enough(ran)) else 1)
