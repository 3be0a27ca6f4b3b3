# SPDX-License-Identifier: MIT
import os
import sys

if not __package__:  # python3 FOLDER/cbcan_st
    sys.path[0] = os.path.dirname(sys.path[0])
from cbcan_st import main

main()
