#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""One call fails: of each function by which cbcan-sim calls the kernel, and of allocations, the first one, the second one, and so on, in
scenarios with a client at each server, on a manual clock. Either the program continues, with one closed connection at most and all
values right, or it ends with one line and an exit code. It never hangs, and no client ever gets a wrong value.

One scenario has the servers, one a serial line and a PLC that owns the registers, one HTTP, a Lua script and a second channel; in the last
one the calls are those of `cbcanctl configure`.
"""

import errno
import functools
import multiprocessing
import pathlib
import shutil
import tempfile

from failing_runs import ERRORS, Configure, Servers, PlcAndLine, Web
import cases


def run_failing(scenario, failing):
    folder = tempfile.mkdtemp()
    try:
        wrong = scenario(folder, failing).wrong
    finally:
        shutil.rmtree(folder)
    return wrong and f"{scenario.__name__}: {failing[0]}() number {failing[1]} fails ({errno.errorcode[failing[2]]}): {wrong}"


class EachCall:
    """All cases of one scenario."""

    errors = {}

    @classmethod
    def setUpClass(cls):
        with tempfile.TemporaryDirectory() as folder:
            clean = cls.scenario(folder)
            assert clean.is_clean(), (clean.wrong, clean.code, clean.said, clean.lost)
            lines = pathlib.Path(folder, "calls").read_text().splitlines()
        cls.calls = {name: int(count) for name, count in map(str.split, lines)}

    def check(self, runs):
        with multiprocessing.Pool() as pool:
            results = pool.imap_unordered(functools.partial(run_failing, self.scenario), runs, chunksize=8)
            wrong = [line for line in results if line]
        print(f"{len(runs)} runs", flush=True)
        self.assertFalse(wrong, "\n" + "\n".join(wrong))

    def test_each_call_of_the_kernel(self):
        self.check([(name, k, error) for name, count in sorted(self.calls.items()) if name != "malloc"
                    for k in range(1, count + 1) for error in self.errors.get(name, ERRORS[name])])

    def test_each_allocation(self):
        """None in a program with AddressSanitizer, which has its own allocator."""
        self.check([("malloc", k, errno.ENOMEM) for k in range(1, self.calls.get("malloc", 0) + 1)])


class ServersForClients(EachCall, cases.Case):
    scenario = Servers


class WithPlcAndLine(EachCall, cases.Case):
    scenario = PlcAndLine


class WithHttpAndScript(EachCall, cases.Case):
    scenario = Web
    errors = {"send": [errno.EPIPE]}  # libmicrohttpd waits for an edge, which comes after a full buffer but not after this error


class OfConfigure(EachCall, cases.Case):
    scenario = Configure


cases.main()
