# SPDX-License-Identifier: MIT
"""The files of the project's own tree. A build is never entered: other tests make and remove folders there at the same time."""

import os
import pathlib

ROOT = pathlib.Path(__file__).resolve().parents[2]
NOT_OURS = {"build", "node_modules", "__pycache__", ".git"}


def files():
    found = []
    for folder, below, names in os.walk(ROOT):
        below[:] = [name for name in below if name not in NOT_OURS]
        found += [pathlib.Path(folder, name) for name in names]
    return sorted(found)
