# SPDX-License-Identifier: MIT
"""Runs programs that have to succeed; otherwise an AssertionError has all their output."""

import subprocess


def done(*command, code=0, **options):
    finished = subprocess.run([str(word) for word in command], capture_output=True, text=True, **options)
    if finished.returncode != code:
        raise AssertionError(f"{' '.join(map(str, command))}: exit code {finished.returncode}\n{finished.stdout}{finished.stderr}")
    return finished


def output(*command, **options):
    return done(*command, **options).stdout


def output_and_errors(*command, **options):
    finished = done(*command, **options)
    return finished.stdout + finished.stderr
