#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""cbcanctl with the real cbcan-sim, and with the test's own coprocessors."""

import json
import os
import re
import signal
import struct
import subprocess
import sys
import tempfile

import cases
from ctl import ABSENT, CBCANCTL, DONE, INTERRUPTED, NO_CONNECTION, REFUSED, USAGE, Case, run, start
from done import ran
from owned_registers import OwnedRegisters
from simulator import LIMIT, Simulator, program_from_arguments, wait_until
from tree import ROOT

CBCAN_SIM = program_from_arguments()


class WithSimulator(Case):
    def setUp(self):
        self.simulator = Simulator(CBCAN_SIM, "--demo", test=self)
        self.place = self.simulator.port

    def test_write_and_read_by_type(self):
        for index, kind, value in ((0x2001, "u8", "200"), (0x2002, "u16", "65535"), (0x2003, "u24", "70000"),
                                   (0x2004, "i32", "-5"), (0x2004, "f32", "1.5"), (0x2005, "u40", "1099511627775"),
                                   (0x2008, "i64", "-1"), (0x2008, "f64", "-0.1"), (0x200E, "string", "fourteen bytes")):
            done = run(self.place, "write", "0x20", hex(index), "0", value, "--type", kind)
            self.assertEqual((done.returncode, done.stdout, done.stderr), (DONE, "", ""))
            done = run(self.place, "read", "20h", hex(index), "0", "--type", kind)
            self.assertEqual((done.returncode, done.stdout, done.stderr), (DONE, value + "\n", ""))

    def test_bytes_and_sizes(self):
        self.check("write 0x20 0x2005 0 hex:0102030405")
        self.check("read 0x20 0x2005 0", "01 02 03 04 05\n")
        self.check("write 0x20 0x2002 0 hex:2C01")
        self.check("read 0x20 0x2002 0", "0x012C 300\n")
        self.check("read 0x20 0x2002 0 --size 1", "", REFUSED,
                   "cbcanctl: 0504 0005h ABORT_READ_LENGTH: object length too big to read (CiA 301: out of memory)\n")

    def test_json(self):
        done = run(self.place, "--json", "read", "1", "0x9130", "1", "--type", "i32")
        self.assertEqual(json.loads(done.stdout), {"result": 0, "size": 4, "data": "CD 82 01 00", "value": 99021})
        done = run(self.place, "--json", "read", "0x20", "0x3333", "0")
        self.assertEqual(done.returncode, REFUSED)
        response = json.loads(done.stdout)
        self.assertEqual((response["result"], response["abort_code"]), (4, 0x06020000))
        done = run(self.place, "--json", "write", "0x20", "0x2001", "0", "1", "--type", "u8")
        self.assertEqual(json.loads(done.stdout), {"result": 0})
        done = run(self.place, "--json", "state", "1")
        self.assertEqual(json.loads(done.stdout), {"node": 1, "state": 127, "name": "Pre-operational"})

    def test_an_output_that_is_full(self):
        full = self.enterContext(open("/dev/full", "w", encoding="ascii"))
        for arguments in ("--help", "scan", "state 0x42", "read 1 0x1000 0", "read 1 0x1000 0 --json", "dump 1"):
            done = run(self.place, *arguments.split(), capture_output=False, stdout=full, stderr=subprocess.PIPE)
            self.assertEqual(done.returncode, NO_CONNECTION, arguments)
            self.assertRegex(done.stderr, r"cbcanctl: standard output: No space left on device; make room, or send it elsewhere\n\Z")

    def test_descriptors_that_libmodbus_cannot_take(self):
        take = ("import os, resource, sys\nresource.setrlimit(resource.RLIMIT_NOFILE, (2048, resource.getrlimit(resource.RLIMIT_NOFILE)[1]))\n"
                "for number in range(3, 1024): os.dup2(0, number)\nos.execv(sys.argv[1], sys.argv[1:])")
        for command in ((CBCANCTL, "kernel"), (CBCAN_SIM, "--demo", "--plc", "127.0.0.1:1")):
            done = ran(sys.executable, "-c", take, *command)
            self.assertEqual(done.returncode, NO_CONNECTION)
            self.assertRegex(done.stderr, r"\Acbcan\S+: libmodbus needs a descriptor below 1024, and none is free; close some\n\Z")

    def test_nmt_and_state(self):
        for service, state in (("start", "Operational"), ("stop", "Stopped"), ("preop", "Pre-operational")):
            self.check(f"nmt {service} 0x42")
            self.check("state 0x42", f"66 {state}\n")
        self.check("nmt start all")
        self.check("state all", "".join(f"{node} Operational\n" for node in (1, 2, 16, 32, 66)) + "127 Pre-operational\n")
        self.check("nmt reset-node all")
        self.check("nmt reset-comm 1")
        self.check("state 99", "99 Not detected\n", ABSENT)
        self.assertEqual([f for f in self.simulator.frames() if f.startswith("000#")],
                         ["000#0142", "000#0242", "000#8042", "000#0100", "000#8100", "000#8201"])

    def test_configure(self):
        plan = self.write("plan.toml", "[[node]]\nid = 0x20\ndevice_type = 0\nobjects = [{ index = 0x2002, value = 77, type = 'u16' }]\n"
                          "[[node]]\nid = 1\ndevice_type = 5\n")
        self.check(f"configure {plan}", "32 started\n", REFUSED,
                   "cbcanctl: node 1: 1000h:00 is 94 01 02 00, not 05 00 00 00\n"
                   "cbcanctl: 1 of 2 nodes has not been started\n")
        self.check("read 0x20 0x2002 0 --type u16", "77\n")
        self.check("state 0x20", "32 Operational\n")
        self.check("configure /nowhere", "", USAGE, "cbcanctl: /nowhere: cannot be read; name a network file, or a folder of DCF files\n")

    def test_what_is_no_file(self):
        folder, pipe = self.folder, f"{self.folder}/pipe"
        os.mkfifo(pipe)
        for command, hint in (("configure", "no *.dcf in this folder; name a file in TOML, or export DCF files into it"),
                              ("dump 66 --eds", "this is a folder; name a file in it")):
            self.check(f"{command} {folder}", "", USAGE, f"cbcanctl: {folder}: {hint}\n")
            self.check(f"{command} {pipe}", "", USAGE,
                       f"cbcanctl: {pipe}: a pipe that no program writes to; name a file, or start its writer first\n")
        self.check("dump 66 --eds /bin/ls", "", USAGE, "cbcanctl: /bin/ls: not one object in it; name an EDS or DCF file\n")
        self.check("configure /bin/ls", "", USAGE, "cbcanctl: /bin/ls:1: this line is not UTF-8; write a network in TOML, or name a file *.dcf\n")
        with open(os.open(pipe, os.O_RDWR), "wb"):  # a writer that writes nothing
            for number in (signal.SIGINT, signal.SIGTERM):
                process = subprocess.Popen([CBCANCTL, "configure", pipe])
                wait_until(lambda process=process: pipe in ran("ls", "-l", f"/proc/{process.pid}/fd").stdout, "the pipe is open")
                process.send_signal(number)
                self.assertEqual(process.wait(LIMIT), -number)

    def test_another_program_s_transaction_is_waited_for(self):
        with self.simulator.window() as window:
            window.start(5055, 99, 0x1000, 0, 4)
            self.check("read 0x42 0x1000 0 --type u32", f"{0x000F0191}\n", DONE,
                       "cbcanctl: another program's transaction is in progress; waiting for it\n")

    def test_no_result_in_time(self):
        done = run(self.place, "--timeout", "50", "state", "99")  # which takes 100 ms
        self.assertEqual(done.returncode, NO_CONNECTION)
        self.assertIn("no result within 50 ms", done.stderr)

    def test_an_index_that_is_decimal(self):
        self.check("read 1 1000 0", "", REFUSED, "cbcanctl: 0602 0000h ABORT_NO_OBJ: no such object; INDEX 1000 is decimal: did you mean "
                   "0x1000?\n")
        self.check("read 1 0x3333 0", "", REFUSED, "cbcanctl: 0602 0000h ABORT_NO_OBJ: no such object\n")

    def test_an_absent_node(self):
        self.check("--json state 99", '{"node": 99, "state": 6, "name": "Not detected"}\n', ABSENT)

    def test_a_network_that_is_not_there(self):
        self.check("--unit 2 state 1", "", NO_CONNECTION, f"cbcanctl: 127.0.0.1:{self.simulator.port}: reading R3700: there is no network 2; "
                   "--unit selects the network, 1 is the first\n")

    def test_kernel(self):
        self.check("kernel", "00h no error\n")
        self.check("--json kernel", '{"kernel": 0, "name": "no error"}\n')

    def check_settings(self, timeout, mode):
        self.check("read 0 0x3003 0 --type u16", f"{timeout}\n")
        self.check("read 0 0x3004 0 --type u8", f"{mode}\n")

    def test_modes(self):
        self.check("write 0x20 0x2001 0 1 --type u8 --mode segmented")
        self.check("write 0x20 0x2001 0 2 --type u8 --mode block")
        self.check("write 0x20 0x2001 0 3 --type u8 --mode expedited")
        self.check("write 0x20 0x2001 0 4 --type u8 --mode auto")
        begins = [frame[4:6] for frame in self.simulator.frames() if frame.startswith("620#") and frame[6:12] == "012000"]
        self.assertEqual(begins, ["21", "C6", "2F", "2F"])
        self.check("read 0x20 0x2001 0 --type u8 --mode segmented", "4\n")
        self.check_settings(1000, 0)

    def test_settings_are_put_back_after_a_refusal(self):
        self.check("write 0 0x3003 0 777 --type u16")
        self.check("write 0 0x3004 0 2 --type u8")
        self.check("write 0x20 0x200E 0 hex:0102030405 --mode expedited --timeout 300", "", REFUSED,
                   "cbcanctl: 0601 0000h ABORT_NO_SEGMENT: unsupported access to the object, or segmented transfer not "
                   "supported\n")
        self.check_settings(777, 2)
        self.check("--timeout 50 read 99 0x1000 0 --mode block", "", ABSENT, "cbcanctl: node 99: 0504 0000h ABORT_TIME_OUT: SDO service timed out\n")
        self.check_settings(777, 2)

    def test_settings_are_put_back_after_an_interrupt(self):
        for number in (signal.SIGINT, signal.SIGTERM):
            control = start(self.place, "read", number + 80, "0x1000", "0", "--timeout", "60000", "--mode", "segmented")
            self.simulator.wait_for_frame(f"{0x600 + number + 80:X}#4000100000000000")
            self.check_interrupted(control, "cbcanctl: cancelled: 0 written to R3700\n", number)
            self.check_settings(1000, 0)

    def test_own_objects_are_shown_as_they_are(self):
        for node in (0, 127):
            self.check(f"read {node} 0x3003 0 --type u16 --timeout 50", "1000\n")
            self.check(f"write {node} 0x3004 0 2 --type u8 --mode block")
            self.check(f"read {node} 0x3004 0 --type u8 --mode block", "2\n")


class WithFaults(cases.Case):
    def test_emcy_and_kernel_state_as_they_come_from_the_bus(self):
        simulator = Simulator(CBCAN_SIM, "--demo", "--fault", "0x42:emcy-storm code=0x1000 interval_ms=1 count=1",
                              "--fault", "bus:overflow", test=self)
        told = "66 1000h generic error; error register 01h: generic; data 00 00 00 00 00\n"
        wait_until(lambda: run(simulator.port, "emcy", "0x42").stdout == told, "EMCY of node 66")
        self.assertEqual(run(simulator.port, "emcy", "all").stdout, told)
        self.assertEqual(run(simulator.port, "kernel").stdout, "02h overflow: frames were lost\n")


class ManualClock(cases.Case):
    """Waiting lets the plant's time pass: what the log has is after it, however fast the machine."""

    def run_in_plant(self, *command):
        log = tempfile.NamedTemporaryFile()
        self.addCleanup(log.close)
        result = ran(CBCAN_SIM, "--demo", "--clock", "manual", "--control", "127.0.0.1:0", "--log", log.name, "--", CBCANCTL, *command)
        return result.returncode, log.read().decode()

    def test_a_node_that_is_absent(self):
        code, log = self.run_in_plant("read", 99, "1000h", 0, "--timeout", 20000)
        self.assertEqual(code, ABSENT)
        first, last = (float(re.search(rf"\((.*)\) \S+ {frame}", log)[1]) for frame in ("663#4000100000000000", "663#8000100000000405"))
        self.assertAlmostEqual(last - first, 20, delta=0.01)

    def test_a_network_that_does_not_run(self):
        self.assertEqual(self.run_in_plant("status", "--wait", 30000)[0], REFUSED)

    def test_a_control_connection_that_is_not_there(self):
        simulator = Simulator(CBCAN_SIM, "--demo", test=self)
        for control, code in (("127.0.0.1:9", NO_CONNECTION), ("unix:/nowhere", DONE)):
            result = ran(CBCANCTL, "read", 32, "1000h", 0, env={"CBCAN_MODBUS": f":{simulator.port}", "CBCAN_CONTROL": control})
            self.assertEqual((result.returncode, result.stderr[:54]),
                             (code, "cbcanctl: no connection to CBCAN_CONTROL 127.0.0.1:9: " if code else ""))


class Usage(cases.Case):
    def test_wrong_usage(self):
        for arguments in ("", "reed 1 2 3", "read 1 2", "read 128 0x1000 0", "read 1 0x10000 0", "read 1 0x1000 256",
                          "read 1 1F82 0", "write 1 0x2000 0 5", "write 1 0x2000 0 300 --type u8", "nmt begin 1",
                          "nmt start 0", "state 128", "read 1 0x1000 0 --size 129", "read 1 0x1000 0 --type u12",
                          "read 1 0x1000 0 --mode fast", "read 1 0x1000 0 --timeout 65536", "write 1 0x2000 0 hex:01 --timeout 0",
                          "state 1 --mode block", "emcy", "emcy 128", "emcy scan", "kernel 1", "watch"):
            done = run(1, *arguments.split())
            self.assertEqual((done.returncode, done.stdout), (USAGE, ""), arguments)
            self.assertTrue(done.stderr, arguments)

    def test_help_fits_80_columns(self):
        for command in ((), ("read",), ("write",), ("nmt",), ("dump",)):
            for line in run(1, *command, "--help").stdout.splitlines() + run(1, *command, "-h").stdout.splitlines():
                self.assertLessEqual(len(line), 80, line)
        self.assertLessEqual(len(run(1, "-h").stdout.splitlines()), 24)

    def test_help_has_every_command_with_its_arguments_and_options(self):
        commands = re.search(r"\nCommands:\n(.*?)\n\n", run(1, "--help").stdout, re.DOTALL)[1].splitlines()
        self.assertEqual(len(commands), 13)
        for line in commands:
            usage = re.match(r"  ((\S+)(?: [A-Z.]+)*)(?: |$)", line)
            helped = run(1, usage[2], "--help").stdout
            self.assertIn(f"Usage:  cbcanctl {usage[1].replace(usage[2], usage[2] + ' [OPTION...]', 1)}\n", helped)
        self.assertIn("  --mode MODE            SDO transfer mode: auto, expedited, segmented or block\n", run(1, "read", "--help").stdout)
        self.assertIn("  --size BYTES           Room for the value: 1..128 (default 128)\n", run(1, "read", "-h").stdout)
        self.assertIn("  --station, --unit N    Modbus unit ID, which selects the CAN network, or\n", run(1, "--help").stdout)

    def test_version(self):
        done = run(1, "--version")
        self.assertEqual((done.returncode, done.stderr), (DONE, ""))
        self.assertRegex(done.stdout, r"^cbcanctl \d+\.\d+\.\d+\n$")

    def test_the_exit_codes_are_those_of_the_page(self):
        page = (ROOT / "docs/how-to/troubleshooting.md").read_text()
        for code in (DONE, USAGE, NO_CONNECTION, REFUSED, ABSENT, INTERRUPTED):
            self.assertIn(f"\n| {code} | ", page)
            self.assertRegex(run(1, "--help").stdout, rf"\n  {code} +\w")

    def test_failures_as_json(self):
        done = run(1, "--json", "read", "128", "0x1000", "0")
        self.assertEqual(done.returncode, USAGE)
        self.assertEqual(json.loads(done.stdout), {"error": "NODE 128: the most is 127"})
        done = run(1, "--json", "kernel")
        self.assertEqual(done.returncode, NO_CONNECTION)
        self.assertIn("no connection to 127.0.0.1:1: ", json.loads(done.stdout)["error"])

    def test_a_host_with_a_port_or_without_a_meaning(self):
        ctl = lambda *arguments: ran(CBCANCTL, *arguments, "kernel")
        for words in (("--modbus", "127.0.0.1:1"), ("--host", "127.0.0.1:1"), ("--host", "127.0.0.1", "--port", "1"), ("--port", "1")):
            self.assertIn("no connection to 127.0.0.1:1: ", ctl(*words).stderr)
        self.assertIn("no connection to ::1:1: ", ctl("--modbus", "[::1]:1").stderr)
        done = ctl("--modbus", "no-such-host.invalid")
        self.assertEqual(done.returncode, NO_CONNECTION)
        self.assertRegex(done.stderr, r"^cbcanctl: no connection to no-such-host\.invalid:1502: .*; is cbcan-sim running there\? ")
        self.assertEqual(ctl("--modbus", "127.0.0.1:1", "--port", "1").returncode, USAGE)

    def test_what_is_wrong_is_named(self):
        read = "usage: cbcanctl read [OPTION...] NODE INDEX SUB"
        for arguments, told in (("", "a command is missing; cbcanctl --help shows all"),
                                ("read 1", f"INDEX is missing: Object index, such as 0x6411; {read}"),
                                ("read 1 2 3 4", f"4: one word too many; {read}"),
                                ("nmt strat 5", "SERVICE strat: must be start, stop, preop, reset-node or reset-comm; did you mean start?"),
                                ("read 1 2 3 --mode blcok", "--mode blcok: must be auto, expedited, segmented or block; did you mean block?"),
                                ("read 1 2 3 --size 129", "--size 129: must be 1..128"),
                                ("read 1 2 3 --size much", "--size much: must be an integer, 1..128"),
                                ("write 1 2 3 4 --size 1", "--size: cbcanctl write has no such option"),
                                ("--json --json kernel", "--json is given twice"),
                                ("--baud 9600 kernel", "--baud: needs --rtu, the serial device"),
                                ("--port", "--port: needs an argument, PORT; cbcanctl --help shows all")):
            done = ran(CBCANCTL, *arguments.split())
            self.assertEqual((done.returncode, done.stderr), (USAGE, f"cbcanctl: {told}\n"))

    def test_suggestions(self):
        for arguments, told in (("reed 1 2 3", "reed: no such command; did you mean read?"),
                                ("--timeout 5 sate 1", "sate: no such command; did you mean state?"),
                                ("strat 5", "strat: no such command; did you mean nmt start?"),
                                ("frobnicate", "frobnicate: no such command"),
                                ("read 1 2 3 --tipe u8", "--tipe: no such option; did you mean --type?"),
                                ("--jsno state 1", "--jsno: no such option; did you mean --json?"),
                                ("--zzzzzz state 1", "--zzzzzz: no such option")):
            done = run(1, *arguments.split())
            self.assertEqual((done.returncode, done.stdout, done.stderr), (USAGE, "", f"cbcanctl: {told}; cbcanctl --help shows all\n"))


class Coprocessor(OwnedRegisters):
    """A window whose transactions have the result of `execute(command, node, index, sub, data)`: the bytes of the response, a number (an abort code),
    None (in progress until it is cancelled) or "restart" (of the module). Records all. R3700 shows CA0Eh `polls` times before the result."""

    def __init__(self, execute, polls=0):
        self.execute, self.polls = execute, polls
        self.left, self.pending = 0, None
        self.transactions = []
        super().__init__()

    def read(self, first, count):
        if self.pending is not None and self.left == 0:
            self.finish()
        self.left -= 1
        return super().read(first, count)

    def write(self, first, words):
        super().write(first, words)
        self.pending = None
        if words[0] == 0xCA0E:
            command, node, index, sub, size = words[1:6]
            data = struct.pack(f"<{len(words) - 6}H", *words[6:])[:size] if command == 5066 else b""
            self.transactions.append((command, node, index, sub, data.hex()))
            self.pending, self.left = self.execute(*self.transactions[-1]), self.polls

    def finish(self):
        result, self.pending = self.pending, None
        if result == "restart":
            self.registers.clear()
        elif isinstance(result, int):
            self.registers |= {3700: 4, 3706: result & 0xFFFF, 3707: result >> 16}
        else:
            words = struct.unpack("<64H", result.ljust(128, b"\0"))
            self.registers |= {3700: 0, **dict(enumerate(words, 3706))}
            if self.registers[3701] == 5055:
                self.registers[3705] = len(result)


class WithCoprocessor(Case):
    def check_with(self, execute, arguments, out, code=DONE, error=""):
        coprocessor = Coprocessor(execute)
        self.place = coprocessor.port
        self.check(arguments, out, code, error)
        return coprocessor.transactions

    def check_emcy(self, message, text, *arguments):
        done = self.check_with(lambda _, __, index, *___: b"\x05" if index == 0x300C else bytes.fromhex(message),
                               " ".join(arguments) + " emcy 5", text)
        self.assertEqual(done, [(5055, 0, 0x3005, 5, "")] + [(5055, 5, 0x300C, 0, "")] * (not any(bytes.fromhex(message))))

    def test_emcy_of_a_node(self):
        self.check_emcy("00 00 00 00 00 00 00 00", "5 no error\n")
        self.check_emcy("30 81 11 01 02 03 04 05", "5 8130h life guard error or heartbeat error; error register 11h: generic, "
                        "communication; data 01 02 03 04 05\n")
        self.check_emcy("10 23 03 00 00 00 00 00", "5 2310h current, output side; error register 03h: generic, current; "
                        "data 00 00 00 00 00\n")
        self.check_emcy("00 FF 00 00 00 00 00 00", "5 FF00h device-specific; error register 00h; data 00 00 00 00 00\n")
        self.check_emcy("00 00 81 00 00 00 00 00", "5 0000h no error, or an error has ended; error register 81h: generic, "
                        "manufacturer-specific; data 00 00 00 00 00\n")
        self.check_emcy("30 81 11 01 02 03 04 05",
                        '{"node": 5, "error_code": 33072, "meaning": "life guard error or heartbeat error", "error_register": 17, '
                        '"bits": ["generic", "communication"], "data": "01 02 03 04 05"}\n', "--json")
        self.check_emcy("00 00 00 00 00 00 00 00", '{"node": 5, "error_code": 0, "meaning": "no error", "error_register": 0, '
                        '"bits": [], "data": "00 00 00 00 00"}\n', "--json")

    def test_emcy_of_a_node_that_is_not_there(self):
        for arguments, text in (("emcy 5", "5 not detected\n"),
                                ("--json emcy 5", '{"node": 5, "error_code": 0, "meaning": "not detected", "error_register": 0, '
                                                  '"bits": [], "data": "00 00 00 00 00"}\n')):
            self.check_with(lambda _, __, index, *___: b"\x06" if index == 0x300C else bytes(8), arguments, text, ABSENT)

    def test_emcy_of_the_coprocessor_itself(self):
        done = self.check_with(lambda _, __, index, *___: b"\x7F" if index == 0x3001 else bytes(8), "emcy 0", "127 no error\n")
        self.assertEqual(done, [(5055, 0, 0x3001, 0, ""), (5055, 0, 0x3005, 127, "")])

    def check_scan(self, stops, text, *arguments):
        """`stops`: the results of the scan in order; there must be no further reads."""
        left = [bytes.fromhex(stop) for stop in stops]
        done = self.check_with(lambda *_: left.pop(0), " ".join(arguments) + " emcy all", text)
        self.assertEqual(done, len(stops) * [(5055, 0, 0x3006, 0, "")])

    def test_emcy_scan(self):
        nothing, five, nine, over = "00" * 9, "05 2043 0900 00 00 00 00", "09 0050 0100 00 00 00 00", "07" + "00" * 8
        hot, hardware = ("5 4320h temperature; error register 09h: generic, temperature; data 00 00 00 00 00\n",
                         "9 5000h device hardware; error register 01h: generic; data 00 00 00 00 00\n")
        self.check_scan([nothing], "no error\n")
        self.check_scan([nothing], "", "--json")
        self.check_scan([five, five], hot)
        self.check_scan([over, nothing], "7 no error any more\n")
        self.check_scan([five, over, nine, five], hot + "7 no error any more\n" + hardware)
        self.check_scan([over, nine, five, nine], "7 no error any more\n" + hardware + hot)
        self.check_scan([five, "05" + "00" * 8], hot + "5 no error any more\n")  # the error ended during the scan
        self.check_scan([over, nothing], '{"node": 7, "error_code": 0, "meaning": "no error any more", "error_register": 0, '
                        '"bits": [], "data": "00 00 00 00 00"}\n', "--json")

    def test_a_coprocessor_without_the_object(self):
        self.check_with(lambda *_: 0x06020000, "emcy 5", "", REFUSED, "cbcanctl: 3005h of the coprocessor: 0602 0000h ABORT_NO_OBJ: no such object\n")
        self.check_with(lambda *_: b"\x01\x02", "kernel", "", NO_CONNECTION,
                   "cbcanctl: 3002h of the coprocessor: 2 bytes instead of 1: this is no CBCAN window\n")

    def test_a_module_that_restarts_in_the_middle(self):
        for command in ("read 5 0x1000 0", "write 5 0x2000 0 1 --type u8", "nmt start 5", "state 5"):
            coprocessor = Coprocessor(lambda *_: "restart")
            done = run(coprocessor.port, *command.split())
            self.assertEqual((done.stdout, done.returncode, done.stderr),
                             ("", NO_CONNECTION, f"cbcanctl: 127.0.0.1:{coprocessor.port}: the module has restarted, or another program has "
                              "written to R3701..R3704; it is not known whether the request was carried out\n"))

    def test_kernel_states(self):
        for state, text in ((0x02, "02h overflow: frames were lost\n"), (0x10, "10h bus off\n"), (0x11, "11h error passive\n"),
                            (0x20, "20h no known state\n")):
            self.check_with(lambda *_, state=state: bytes([state]), "kernel", text)

    def test_settings_of_one_transfer(self):
        before = {0x3001: b"\x7F", 0x3003: b"\xE8\x03", 0x3004: b"\x00", 0x2000: b"\x2A"}
        done = self.check_with(lambda _, __, index, *___: before[index], "read 5 0x2000 0 --type u8 --timeout 300 --mode block", "42\n")
        self.assertEqual(done, [(5055, 0, 0x3001, 0, ""), (5055, 0, 0x3003, 0, ""), (5066, 0, 0x3003, 0, "2c01"),
                                (5055, 0, 0x3004, 0, ""), (5066, 0, 0x3004, 0, "03"), (5055, 5, 0x2000, 0, ""),
                                (5066, 0, 0x3004, 0, "00"), (5066, 0, 0x3003, 0, "e803")])
        done = self.check_with(lambda _, __, index, *___: before[index], "read 5 0x2000 0 --type u8 --timeout 1000 --mode auto", "42\n")
        self.assertEqual([transaction[0] for transaction in done], 4 * [5055])  # nothing to change

    def test_a_setting_that_is_refused(self):
        def execute(command, _, index, *__):
            return 0x06090030 if (command, index) == (5066, 0x3004) else bytes([7, 7][:1 if index != 0x3003 else 2])
        self.check_with(execute, "read 5 0x2000 0 --mode block", "", REFUSED,
                   "cbcanctl: 3004h of the coprocessor: 0609 0030h ABORT_VALUE: invalid value for the parameter\n")

    def test_a_slow_coprocessor_gets_its_settings_back_too(self):
        values = {0x3001: b"\x7F", 0x3003: b"\xE8\x03", 0x1000: None}
        coprocessor = Coprocessor(lambda _, __, index, *___: values[index], polls=3)
        control = start(coprocessor.port, "read", "5", "0x1000", "0", "--timeout", "300")
        wait_until(lambda: len(coprocessor.transactions) == 4, "the transfer")
        self.check_interrupted(control, "cbcanctl: cancelled: 0 written to R3700\n")
        self.assertEqual(coprocessor.transactions[4:], [(5066, 0, 0x3003, 0, "e803")])

    def test_a_second_interrupt_leaves_the_settings(self):
        def execute(command, node, index, *_):
            if node == 5 or command == 5066 and len(coprocessor.transactions) > 4:
                return None
            return {0x3001: b"\x7F", 0x3003: b"\xE8\x03"}[index]
        coprocessor = Coprocessor(execute)
        control = start(coprocessor.port, "read", "5", "0x1000", "0", "--timeout", "300")
        wait_until(lambda: len(coprocessor.transactions) == 4, "the transfer")
        control.send_signal(signal.SIGINT)
        wait_until(lambda: len(coprocessor.transactions) == 5, "the setting")
        self.check_interrupted(control, "cbcanctl: 3003h of the coprocessor was 0x03E8 1000 and could not be restored: cancelled: 0 written to "
                               "R3700\ncbcanctl: cancelled: 0 written to R3700\n")


cases.main()
