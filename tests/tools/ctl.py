# SPDX-License-Identifier: MIT
"""cbcanctl as a process."""

import signal
import subprocess

import cases
from done import ran
from simulator import LIMIT, program_from_arguments

CBCANCTL = program_from_arguments()
DONE, USAGE, NO_CONNECTION, REFUSED, ABSENT, INTERRUPTED = 0, 2, 3, 4, 5, 130


def command(place, *arguments):
    """With the coprocessor at a TCP port or a serial line."""
    return [CBCANCTL, *(("--rtu", place) if isinstance(place, str) else ("--modbus", f":{place}")), *map(str, arguments)]


def run(place, *arguments, **options):
    return ran(*command(place, *arguments), **options)


def start(place, *arguments):
    return subprocess.Popen(command(place, *arguments), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


class Case(cases.Case):
    """With a coprocessor at self.place."""

    def check(self, arguments, out="", code=DONE, error=""):
        done = run(self.place, *arguments.split())
        self.assertEqual((done.stdout, done.returncode, done.stderr), (out, code, error))

    def check_interrupted(self, process, told, number=signal.SIGINT):
        process.send_signal(number)
        self.assertEqual((*process.communicate(timeout=LIMIT), process.returncode), ("", told, INTERRUPTED))
