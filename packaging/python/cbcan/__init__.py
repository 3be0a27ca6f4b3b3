# SPDX-License-Identifier: MIT
"""The programs that pip has installed with this package."""

import importlib.metadata

# By pip's list of files: the folder of programs need not be on PATH, and is another one after `pip install --user`.
SIMULATOR = next((str(file.locate()) for file in importlib.metadata.files("cbcan") or () if file.name == "cbcan-sim"), "cbcan-sim")
