#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Prints the sizes of images for Cortex-M0+, M3 and M4, -Os, all included; fails above a limit of tests/limits.toml.

Those of boards are complete, the others lack startup code. RAM includes the stack and the PLC's registers.

usage: footprint.py BUILD_DIR_M0PLUS BUILD_DIR_M3 BUILD_DIR_M4
"""

import pathlib
import re
import subprocess
import sys

from limits import LIMITS

IMAGES, BOARDS, LEAST = "tests/firmware/images", "firmware/boards", 3000
FILES = {f"{IMAGES}/{name}": name for name in ("sdo_client", "master", "coprocessor", "coprocessor_with_manager", "canopen_services_plain", "canopen_services_lto", "device_plain", "device_lto")}
FILES |= {f"{BOARDS}/mps2_an385/cbcan_mps2_{name}.elf": name for name in ("minimal", "process_data", "boot_loader")} | {f"{BOARDS}/mps2_an385/cbcan_mps2_an385.elf": "image"}
FILES |= {f"{BOARDS}/{name}/cbcan_{name}.elf": name for name in ("pico", "stm32f4", "stm32g4")} | {f"{BOARDS}/pico/cbcan_pico_slave.elf": "pico_slave"}


def size(*arguments):
    return subprocess.run(["arm-none-eabi-size", *map(str, arguments)], check=True, capture_output=True, text=True).stdout


def main():
    m0plus, m3, m4 = map(pathlib.Path, sys.argv[1:])
    limits = LIMITS["size"]
    folders = {"stm32f4": m4, "stm32g4": m4, "pico": m0plus, "pico_slave": m0plus}
    good = sorted(FILES.values()) == sorted(limits)
    for file, name in FILES.items():
        image = folders.get(name, m3) / file
        text, data, bss = map(int, size(image).splitlines()[-1].split()[:3])
        for kind, reached in {"text": text + data, "ram": data + bss}.items():
            print(f"figure: size.{name}.{kind} {reached}, at most {limits[name][kind]}")
            good &= reached <= limits[name][kind]
        for stack in re.findall(r"^\.stack +(\d+)", size("-A", image), re.MULTILINE):
            print(f"figure: size.{name}.stack {stack}")
        if text < LEAST:
            sys.exit(f"{image}: only {text} bytes of text: it is not all there")
    # All functions of the library; an image links fewer.
    print(f"figure: size.canopen.text {size('-t', m3 / 'firmware' / 'libcbcan_canopen.a').splitlines()[-1].split()[0]}")
    sys.exit(0 if good else 1)


main()
