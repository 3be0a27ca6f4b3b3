# SPDX-License-Identifier: MIT
"""Structured Text."""

import os

__path__.append(os.path.join(os.path.dirname(os.path.realpath(__file__)), "../../st"))  # machine
