#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Writes the CRC-32 into the header of an image (firmware/boards/common/image_header.hpp), and makes IMAGE.bin.

usage: seal_image.py OBJCOPY IMAGE.elf IMAGE.bin
"""

import pathlib
import struct
import subprocess
import sys
import tempfile
import zlib

objcopy, image, binary = sys.argv[1:]


def section(*names):
    """Their bytes, from the lowest address to the highest."""
    with tempfile.TemporaryDirectory() as folder:
        file = pathlib.Path(folder, "bytes")
        options = [option for name in names for option in ("-j", name)]
        subprocess.run([objcopy, "-O", "binary", *options, image, file], check=True)
        return file.read_bytes()


start, program = section(".start")[:-4], section(".text", ".data")
offset = len(section(".start", ".text", ".data")) - len(program)
start += struct.pack("<I", zlib.crc32(start + program))
pathlib.Path(binary).write_bytes(start.ljust(offset, b"\xFF") + program)
with tempfile.NamedTemporaryFile() as file:
    file.write(start)
    file.flush()
    subprocess.run([objcopy, f"--update-section=.start={file.name}", image], check=True)
