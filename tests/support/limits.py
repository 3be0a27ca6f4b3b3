# SPDX-License-Identifier: MIT
"""The limits of tests/limits.toml."""

import pathlib
import tomllib

LIMITS = tomllib.loads((pathlib.Path(__file__).resolve().parents[1] / "limits.toml").read_text())
