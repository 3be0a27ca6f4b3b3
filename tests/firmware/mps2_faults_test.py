# SPDX-License-Identifier: MIT
"""A fault on the board is reported, and ends the emulator with exit code 1; a loop that hangs is restarted.

usage: mps2_faults_test.py IMAGE
"""

import re
import subprocess

import cases
from simulator import program_from_arguments

LIMIT = 60  # seconds
FAULT = re.compile(r"cbcan: fault: exception (\w{8}) status (\w{8}) address (\w{8}) pc (\w{8})\n")


def run(name):
    """(exit code, standard error) of the image with the command `name`; its clock counts instructions."""
    done = subprocess.run(
        ["qemu-system-arm", "-M", "mps2-an385", "-kernel", IMAGE, "-display", "none", "-monitor", "none",
         "-serial", "null", "-serial", "null", "-icount", "shift=5,sleep=off",
         "-semihosting-config", f"enable=on,target=native,arg={name}"],
        stdin=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, timeout=LIMIT)
    return done.returncode, done.stderr


class Mps2(cases.Case):
    def check_fault(self, name, exception, status, address):
        """Numbers as in the ARMv7-M manual: exception, CFSR, and the address if the core reports one."""
        code, error = run(name)
        self.assertEqual(code, 1, error)
        fault = FAULT.search(error)
        self.assertTrue(fault, error)
        self.assertEqual([int(number, 16) for number in fault.groups()[:3]], [exception, status, address])
        return int(fault[4], 16)

    def test_the_start_up_fills_data_and_clears_the_registers(self):
        self.assertEqual(run("data"), (0, ""))

    def test_reading_through_a_null_pointer_faults(self):
        pc = self.check_fault("null-read", 4, 0x82, 4)  # MMARVALID, DACCVIOL
        self.assertTrue(0x40 <= pc < 24 * 1024, hex(pc))

    def test_a_program_may_read_its_vectors_and_a_write_there_faults(self):
        self.check_fault("vectors", 4, 0x82, 4)

    def test_an_address_where_nothing_is_faults(self):
        self.check_fault("unmapped", 5, 0x8200, 0x60000000)  # BFARVALID, PRECISERR

    def test_a_division_by_zero_faults(self):
        self.check_fault("division", 6, 1 << 25, 0)  # DIVBYZERO

    def test_an_undefined_instruction_faults(self):
        self.check_fault("undefined", 6, 1 << 16, 0)  # UNDEFINSTR

    def test_a_stack_too_deep_faults_and_is_reported_on_a_fresh_one(self):
        pc = self.check_fault("stack", 4, 0x92, 0x1FFFFFF0)  # MMARVALID, MSTKERR, DACCVIOL: the guard below it
        self.assertEqual(pc, 0)

    def test_an_interrupt_that_nobody_expects_faults(self):
        self.check_fault("interrupt", 16 + 5, 0, 0)

    def test_interrupts_wait_for_the_end_of_the_outer_lock(self):
        self.assertEqual(run("lock-in-lock"), (0, ""))

    def test_interrupts_come_after_the_last_lock(self):
        self.check_fault("after-locks", 16 + 5, 0, 0)

    def test_a_loop_that_hangs_is_reset_by_the_watchdog_and_the_next_start_knows(self):
        self.assertEqual(run("watchdog")[0], 0)


if __name__ == "__main__":
    IMAGE = program_from_arguments()
    cases.main()
