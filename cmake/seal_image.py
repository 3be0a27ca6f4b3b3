#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Writes the CRC-32 into the header of an image: firmware/boards/common/image_header.hpp.

usage: seal_image.py OBJCOPY IMAGE.elf
"""

import pathlib
import struct
import subprocess
import sys
import tempfile
import zlib

objcopy, image = sys.argv[1:]
with tempfile.TemporaryDirectory() as folder:
    start, program = pathlib.Path(folder, "start"), pathlib.Path(folder, "program")
    subprocess.run([objcopy, "-O", "binary", "--only-section=.start", image, start], check=True)
    subprocess.run([objcopy, "-O", "binary", "--remove-section=.start", image, program], check=True)
    begin = start.read_bytes()[:-4]
    sealed = begin + struct.pack("<I", zlib.crc32(begin + program.read_bytes()))
    start.write_bytes(sealed)
    subprocess.run([objcopy, f"--update-section=.start={start}", image], check=True)
