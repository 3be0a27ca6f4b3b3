#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""The image for the STM32F446: its start, and the parts for which QEMU has the hardware; that for the STM32G474: its bytes alone.

QEMU's netduinoplus2 is an STM32F405 with the USARTs, TIM2 and the flash at the addresses of the F446; clocks, pins, watchdog and CAN are missing and
read as 0. So there is no external clock: the image stays at 16 MHz and off the CAN bus, which is reported as bus-off. TIM2 counts 62.5 times too fast:
20 ms between two bytes are 0.3 ms, which a loaded host exceeds. A request without a response is repeated, as by a Modbus client. TIM2 has no
compare channel, which would end the image's sleep before a response: the test raises its interrupt instead.

usage: stm32_image_test.py IMAGE.elf
"""

import pathlib
import select
import struct
import subprocess
import time
import zlib

import cases
from mcu import Line, crc, die_with_parent
from simulator import program_from_arguments, wait_until
from tree import ROOT

FLASH, RAM, STACK = 0x08000000, 0x20000000, 2048
# Header, first byte of the program, number of interrupts, those in use: CAN, TIM2, USART1, USART2 (RM0390, table 38; RM0440, vector table).
CHIPS = {"cbcan_stm32f4": (b"stm32f446", 0x08010000, 97, [20, 21, 22, 28, 37, 38]), "cbcan_stm32g4": (b"stm32g474", 0x08000800, 102, [21, 28, 37, 38])}
RESPONSE_WITHIN = 1  # seconds; a later response would be taken for that to the next request


class Machine:
    """The image in QEMU, as a Modbus client sees it through USART2."""

    def __enter__(self):
        self.line, self.hardware = Line(), Line()
        self.process = subprocess.Popen(
            ["qemu-system-arm", "-M", "netduinoplus2", "-accel", "tcg", "-kernel", IMAGE, "-display", "none", "-monitor", "none",
             "-serial", "null", "-serial", self.line.option(), "-qtest", self.hardware.option(), "-qtest-log", "/dev/null"],
            stdin=subprocess.DEVNULL, preexec_fn=die_with_parent)
        try:
            self.line.accept()
            self.hardware.accept()
        except OSError:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_):
        self.process.kill()
        self.process.wait()
        self.line.close()
        self.hardware.close()

    def send(self, frame, expected):
        """Returns the bytes received within RESPONSE_WITHIN, up to `expected`."""
        self.line.send(frame)
        response = b""
        end = time.monotonic() + RESPONSE_WITHIN
        while len(response) < expected and time.monotonic() < end:
            if select.select([self.line.socket], [], [], 0.01)[0]:
                response += self.line.socket.recv(expected - len(response))
            else:
                self.raise_interrupt("unnamed-gpio-in 28")  # TIM2 (RM0390, table 38)
        return response

    def raise_interrupt(self, line):
        """With QEMU's protocol "qtest"."""
        for level in 1, 0:
            self.hardware.send(f"set_irq_in /machine/unattached/device[0]/armv7m {line} {level}\n".encode())
            self.hardware.receive(len("OK\n"))

    def ask(self, request, expected):
        frame = b"\x01" + request
        response = wait_until(lambda: self.send(frame + crc(frame), expected + 2), f"a response to {request.hex()}")
        if crc(response[:-2]) != response[-2:]:
            raise AssertionError(f"CRC of {response.hex()}")
        return response[1:-2]

    def read(self, first, count):
        response = self.ask(struct.pack(">BHH", 3, first, count), 3 + 2 * count)
        return list(struct.unpack(f">{count}H", response[2:]))

    def write(self, first, *values):
        data = struct.pack(f">{len(values)}H", *values)
        self.ask(struct.pack(">BHHB", 16, first, len(values), len(data)) + data, 6)

    def transact(self, *request):
        """R3700..R3707 after a transaction; R3700 is written last."""
        self.write(3701, *request)
        self.write(3700, 0xCA0E)
        return wait_until(lambda: (words := self.read(3700, 8))[0] != 0xCA0E and words, "the transaction's end")


class Image(cases.Case):
    def test_flash_begins_with_the_vectors(self):
        image = pathlib.Path(IMAGE).with_suffix(".bin").read_bytes()
        vectors = struct.unpack_from(f"<{16 + INTERRUPTS}I", image)
        self.assertEqual(vectors[0], RAM + STACK)
        handlers = [vector for i, vector in enumerate(vectors) if i not in (0, 7, 8, 9, 10, 13)]
        for handler in handlers:
            self.assertEqual(handler & 1, 1, "Thumb")
            self.assertTrue(PROGRAM <= handler < FLASH + len(image))
        self.assertTrue(set(image[0x4000:PROGRAM - FLASH]) <= {0xFF}, "sectors 1 to 3 of the STM32F446 are not the program's")
        unexpected = vectors[3]
        self.assertNotEqual(vectors[2], unexpected, "the NMI: the clock fails")
        self.assertEqual([i for i in range(INTERRUPTS) if vectors[16 + i] != unexpected], USED)

    def test_behind_the_vectors_is_what_a_boot_loader_asks_for(self):
        image = pathlib.Path(IMAGE).with_suffix(".bin").read_bytes()
        mark, form, board, text, begin, end, checksum = struct.unpack_from("<4sI16s16sIII", image, 4 * (16 + INTERRUPTS))
        self.assertEqual((mark, form, board), (b"BCAN", 1, BOARD.ljust(16, b"\0")))
        self.assertEqual([int(n) for n in text.rstrip(b"\0").split(b".")], [VERSION[0] >> 8, VERSION[0] & 255, VERSION[1]])
        self.assertEqual((begin, end), (PROGRAM, FLASH + len(image)))
        self.assertEqual(checksum, zlib.crc32(image[:4 * (16 + INTERRUPTS) + 48] + image[begin - FLASH:end - FLASH]))

    def test_it_starts_and_shows_its_diagnostics_over_modbus(self):
        with Machine() as machine:
            words = machine.read(4100, 40)
            self.assertEqual(words[:2], VERSION)
            self.assertEqual(words[5], STACK)
            self.assertTrue(64 < words[6] < STACK // 2, words[6])
            self.assertEqual(words[7], 0x10)  # off the CAN bus
            self.assertEqual(words[32], 2)  # the RC oscillator
            self.assertEqual(words[33:], [0] * 7)  # no faults
            self.assertTrue(machine.ask(bytes.fromhex("2B0E0401"), 19).endswith(b"stm32f446"))  # FC 43/14, product code
            later = machine.read(4102, 2)
            self.assertGreater(later[0] | later[1] << 16, words[2] | words[3] << 16)
            print(f"stm32f4: {words[6]} bytes of stack used", flush=True)

    def test_the_coprocessor_responses_and_a_bus_that_is_off_is_told(self):
        with Machine() as machine:
            self.assertEqual(machine.transact(5055, 0, 0x3001, 0, 1)[:7], [0, 5055, 0, 0x3001, 0, 1, 127])
            self.assertEqual(machine.transact(5055, 0, 0x3002, 0, 1)[6], 0x10)
            words = machine.transact(5055, 5, 0x1000, 0, 4)
            self.assertEqual(words[0], 4)
            self.assertEqual(words[6:], [0x0000, 0x0504])

    def test_its_settings_are_registers_and_flash_that_does_not_work_is_told(self):
        with Machine() as machine:  # QEMU's flash is read-only
            self.assertEqual(machine.read(4150, 6), [1, 1152, 0, 0, 500, 127])
            machine.write(4155, 42)
            self.assertEqual(machine.read(4155, 1), [42])
            words = machine.transact(5066, 0, 0x1010, 1, 4, 0x6173, 0x6576)
            self.assertEqual((words[0], words[6:]), (4, [0x0000, 0x0606]))
            machine.write(4155, 128)
            words = machine.transact(5066, 0, 0x1010, 1, 4, 0x6173, 0x6576)
            self.assertEqual((words[0], words[6:]), (4, [0x0030, 0x0609]))

    def test_an_nmi_without_a_failure_of_the_clock_is_a_fault(self):
        with Machine() as machine:
            machine.write(3900, 7)
            machine.raise_interrupt("NMI 0")
            self.assertEqual(machine.read(3900, 1), [0])  # the board was reset
            self.assertEqual(machine.read(4133, 1), [1])


def version():
    """The expected values of R4100 and R4101."""
    text = (ROOT / "firmware/cbcan/version.hpp").read_text()
    major, minor, patch = (int(n) for n in text.split('kVersion = "')[1].split('"')[0].split("."))
    return [major << 8 | minor, patch]


if __name__ == "__main__":
    IMAGE = program_from_arguments()
    BOARD, PROGRAM, INTERRUPTS, USED = CHIPS[pathlib.Path(IMAGE).stem]
    VERSION = version()
    cases.main()
