# SPDX-License-Identifier: MIT
"""Runs programs; those that have to succeed and do not make an AssertionError with all their output."""

import subprocess

from mcu import LIMIT


def ran(*command, **options):
    """The program that has ended, with whatever exit code."""
    return subprocess.run([str(word) for word in command], **{"capture_output": True, "text": True, "timeout": LIMIT} | options)


def done(*command, code=0, **options):
    finished = ran(*command, **{"timeout": None} | options)
    if finished.returncode != code:
        raise AssertionError(f"{' '.join(map(str, command))}: exit code {finished.returncode}\n{finished.stdout}{finished.stderr}")
    return finished


def output(*command, **options):
    return done(*command, **options).stdout


def output_and_errors(*command, **options):
    finished = done(*command, **options)
    return finished.stdout + finished.stderr
