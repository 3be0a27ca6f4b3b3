#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Makes of an image for the RP2040 the file that its boot ROM takes as a drive: UF2, github.com/microsoft/uf2.

The image begins with the second stage: 252 bytes, then their CRC-32 as the boot ROM calculates it
(data sheet, 2.8.1.3.1: polynomial 04C11DB7h, initial value FFFFFFFFh, not reflected).

usage: make_uf2.py IMAGE.bin IMAGE.uf2
"""

import pathlib
import struct
import sys
import zlib

FLASH, PAGE, STAGE, FAMILY = 0x10000000, 256, 252, 0xE48BFF56


def reversed_bits(number, count):
    return int(f"{number:0{count}b}"[::-1], 2)


image, file = map(pathlib.Path, sys.argv[1:])
data = image.read_bytes()
crc = zlib.crc32(bytes(reversed_bits(byte, 8) for byte in data[:STAGE])) ^ 0xFFFFFFFF  # zlib's is reflected
data = data[:STAGE] + struct.pack("<I", reversed_bits(crc, 32)) + data[PAGE:]
pages = [data[at:at + PAGE].ljust(PAGE, b"\0") for at in range(0, len(data), PAGE)]
file.write_bytes(b"".join(
    struct.pack("<8I", 0x0A324655, 0x9E5D5157, 0x2000, FLASH + n * PAGE, PAGE, n, len(pages), FAMILY)
    + page.ljust(476, b"\0") + struct.pack("<I", 0x0AB16F30) for n, page in enumerate(pages)))
