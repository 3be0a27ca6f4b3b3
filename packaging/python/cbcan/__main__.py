# SPDX-License-Identifier: MIT
"""python -m cbcan ARGUMENT...: cbcan-sim with these arguments."""

import os
import sys

from cbcan import SIMULATOR

os.execvp(SIMULATOR, [SIMULATOR, *sys.argv[1:]])
