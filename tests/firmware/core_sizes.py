#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Prints the sizes of three programs of images/ on five cores: -Os, without start-up code and the C library. RAM is without the stack.

usage: core_sizes.py CBCAN_EDS
"""

import os
import pathlib
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor

ROOT = pathlib.Path(__file__).resolve().parents[2]
IMAGES = ROOT / "tests/firmware/images"
ARM = {name: ["arm-none-eabi-", f"-mcpu=cortex-{name}", "-mthumb"] for name in ("m0plus", "m3", "m4", "m7")}
# The distribution's compiler for RISC-V is Linux's for 64 bits: its headers lack two things that no program needs.
CORES = ARM | {"rv32": ["riscv64-linux-gnu-", "-march=rv32imac_zicsr", "-mabi=ilp32", "-DSYS_futex=0", "-fno-pie", "-Wl,-melf32lriscv"]}
FLAGS = ["-std=c++20", "-Os", "-ffreestanding", "-fno-exceptions", "-fno-rtti", "-fno-threadsafe-statics", "-fno-asynchronous-unwind-tables", "-ffunction-sections",
         "-fdata-sections", "-Wno-psabi", f"-I{IMAGES}/without_manager", f"-I{ROOT}/firmware", f"-I{ROOT}/regmap/include", "-nostdlib", "-static",
         "-Wl,--gc-sections,-e,run,--unresolved-symbols=ignore-all"]


def measure(folder, core, name):
    prefix, *options = CORES[core]
    sources = [IMAGES / f"{name}.cpp", *sorted(path for part in ("canopen", "coprocessor") for path in (ROOT / "firmware/cbcan" / part).rglob("*.cpp"))]
    whole, image = folder / f"{core}-{name}.cpp", folder / f"{core}-{name}"
    whole.write_text("".join(f'#include "{path}"\n' for path in sources))
    subprocess.run([f"{prefix}g++", *options, *FLAGS, f"-I{folder}", whole, "-o", image], check=True)
    text, data, bss = map(int, subprocess.run([f"{prefix}size", image], check=True, capture_output=True, text=True).stdout.splitlines()[1].split()[:3])
    return f"figure: cores.{core}-{name}.flash {text + data}\nfigure: cores.{core}-{name}.ram {data + bss}"


with tempfile.TemporaryDirectory() as scratch, ThreadPoolExecutor(os.cpu_count()) as pool:
    made = pathlib.Path(scratch)
    (made / "gnu").mkdir()
    (made / "gnu/stubs-ilp32.h").touch()
    subprocess.run([sys.argv[1], "--output", made / "io_module.hpp", ROOT / "plants/demo/io_module.eds"], check=True)
    each = [(core, name) for core in CORES for name in ("sdo_client", "slave", "coprocessor")]
    print("\n".join(pool.map(lambda one: measure(made, *one), each)))
