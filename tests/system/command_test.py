#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""cbcan-sim ... -- COMMAND: environment, signals, exit codes, and no processes left over."""

import os
import pathlib
import pty
import re
import signal
import socket
import subprocess
import sys

import cases
from simulator import LIMIT, program_from_arguments, wait_until
from tree import ROOT

PROGRAM, CTL = program_from_arguments(2)
# Prints the signal, then further ones until a line is read; its exit code is the signal's number. A shell's read may miss a signal.
WAITS_FOR_A_SIGNAL = """import signal, sys
signals = {signal.SIGINT, signal.SIGTERM, signal.SIGHUP}
signal.pthread_sigmask(signal.SIG_BLOCK, signals)
print("ready", flush=True)
number = signal.sigwait(signals)
print(number.name, flush=True)
sys.stdin.readline()
print(signal.sigpending() & signals, flush=True)
sys.exit(number)"""


def run(*command, options=("--demo",), **keywords):
    return subprocess.run([PROGRAM, *options, "--", *command], capture_output=True, text=True, timeout=LIMIT, **keywords)


def shell(script, **keywords):
    return run("sh", "-c", script, **keywords)


def is_alive(pid):
    try:
        return "State:\tZ" not in pathlib.Path(f"/proc/{pid}/status").read_text()
    except FileNotFoundError:
        return False


class Environment(cases.Case):
    def variables(self, *options):
        lines = run("env", options=options).stdout.splitlines()
        return dict(line.split("=", 1) for line in lines if line.startswith("CBCAN_") and line.split("=")[0] not in os.environ)

    def test_where_the_plant_is(self):
        where = self.variables("--demo")
        self.assertEqual(sorted(where), ["CBCAN_CAN", "CBCAN_CONTROL", "CBCAN_MODBUS", "CBCAN_SLCAN"])
        self.assertEqual(len({where[key].rsplit(":", 1)[1] for key in where if key != "CBCAN_CAN"}), 3)

    def test_the_second_network(self):
        where = self.variables("--demo", "--network", "2")
        self.assertRegex(where["CBCAN_SLCAN_2"], r"^127\.0\.0\.1:\d+$")
        self.assertNotEqual(where["CBCAN_SLCAN_2"], where["CBCAN_SLCAN"])

    def test_an_address_that_an_option_names_is_used_and_one_of_the_plant_file_is_not(self):
        with socket.create_server(("127.0.0.1", 0)) as taken:
            plant = self.folder / "plant.toml"
            port = taken.getsockname()[1]
            plant.write_text(f'[modbus]\nport = {port}\n[control]\nlisten = "127.0.0.1:{port}"\n[can]\nslcan = "127.0.0.1:{port}"\n'
                             f'[rtu]\nlisten = "127.0.0.1:{port}"\n')
            where = self.variables("--config", str(plant), "--control", f"unix:{self.folder}/control")
        self.assertEqual(where["CBCAN_CONTROL"], f"unix:{self.folder}/control")
        for key in ("CBCAN_MODBUS", "CBCAN_SLCAN", "CBCAN_RTU_TCP"):
            self.assertNotEqual(where[key].rsplit(":", 1)[1], str(port))

    def test_one_table_of_the_pages_and_the_help_name_all_variables(self):
        everything = [word for key in ("http.listen", "rtu.listen", "can.socketcand") for word in ("--set", f"{key}=127.0.0.1:0")]
        master, port = pty.openpty()
        self.addCleanup(os.close, master)
        self.addCleanup(os.close, port)
        where = self.variables("--demo", *everything, "--rtu", os.ttyname(port), "--plc", "127.0.0.1:1")
        tables = [sorted(re.findall(r"^\| `(CBCAN_\w+)` \|", page.read_text(), re.M)) for page in (ROOT / "docs").rglob("*.md")]
        self.assertEqual([table for table in tables if "CBCAN_MODBUS" in table], [sorted(where)])
        helped = set(re.findall(r"CBCAN_\w+", subprocess.run([PROGRAM, "--help"], capture_output=True, text=True).stdout))
        self.assertEqual(sorted(helped), sorted([*where, "CBCAN_SLCAN_2"]))

    def test_cbcanctl_finds_the_plant(self):
        self.assertEqual(run(CTL, "read", "0x42", "0x1017", "0", "--type", "u16").stdout, "0\n")

    def test_twenty_at_once(self):
        script = f"{CTL} write 0x42 0x6411 1 $0 --type i16 && {CTL} read 0x42 0x6411 1 --type i16"
        running = [subprocess.Popen([PROGRAM, "--demo", "--", "sh", "-c", script, str(i)], stdout=subprocess.PIPE, text=True)
                   for i in range(20)]
        self.assertEqual([(p.communicate(timeout=LIMIT)[0], p.returncode) for p in running], [(f"{i}\n", 0) for i in range(20)])

    def test_on_a_clock_that_stands_time_passes_by_commands(self):
        script = """import os, socket
control = socket.create_connection(os.environ["CBCAN_CONTROL"].rsplit(":", 1)).makefile("rw")
for line in ("pass 3600s", "trigger read 99 0x1000 0 4", "wait transaction ended"):
    print(line, file=control, flush=True)
    print(control.readline(), end="")
print(input())"""
        done = run(sys.executable, "-c", script, options=("--demo", "--clock", "manual"), input="mine\n")
        self.assertEqual((done.stdout, done.returncode), ("at 3600.000000\nok\nok 3601.000000\nmine\n", 0))


class Ends(cases.Case):
    def test_exit_codes_are_the_commands(self):
        for script, code in (("exit 0", 0), ("exit 7", 7), ("kill -KILL $$", 137), ("kill -INT $$", 130)):
            self.assertEqual(shell(script).returncode, code, script)

    def test_a_command_that_is_not_there(self):
        done = run("no-such-command")
        self.assertEqual((done.returncode, done.stderr), (127, "cbcan-sim: no-such-command: No such file or directory\n"))
        self.assertEqual(run("/tmp").returncode, 126)
        self.assertEqual(run().returncode, 2)

    def test_signals_are_passed_on_once(self):
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            process = subprocess.Popen([PROGRAM, "--demo", "--", sys.executable, "-c", WAITS_FOR_A_SIGNAL], text=True,
                                       stdin=subprocess.PIPE, stdout=subprocess.PIPE)
            self.assertEqual(process.stdout.readline(), "ready\n")
            process.send_signal(number)
            self.assertEqual(process.stdout.readline(), f"{number.name}\n")
            self.assertEqual(process.communicate("\n", timeout=LIMIT)[0], "set()\n")
            self.assertEqual(process.returncode, number)

    def test_the_command_has_the_signals_as_they_were(self):
        done = shell("grep -E 'SigBlk|SigIgn' /proc/self/status", preexec_fn=lambda: signal.signal(signal.SIGHUP, signal.SIG_IGN))
        self.assertEqual(done.stdout, "SigBlk:\t0000000000000000\nSigIgn:\t0000000000000001\n")

    def test_shutdown_ends_the_command(self):
        done = run(sys.executable, "-c", """import os, socket, time
socket.create_connection(os.environ["CBCAN_CONTROL"].rsplit(":", 1)).sendall(b"shutdown\\n")
time.sleep(60)""")
        self.assertEqual(done.returncode, 128 + signal.SIGTERM)

    def test_what_the_command_leaves_behind_ends_with_it(self):
        done = shell("sleep 1000 & echo $!; setsid sleep 1001 & echo $!; exit 3")
        self.assertEqual(done.returncode, 3)
        for pid in done.stdout.split():
            self.assertFalse(is_alive(pid), pid)

    def test_when_the_plant_is_killed_all_are(self):
        process = subprocess.Popen([PROGRAM, "--demo", "--", "sh", "-c", "sleep 1000 & echo $!; setsid sleep 1001 & echo $!; echo $$; wait"],
                                   text=True, stdout=subprocess.PIPE)
        pids = [process.stdout.readline().strip() for _ in range(3)]
        process.kill()
        process.wait(timeout=LIMIT)
        process.stdout.read()  # until all processes have closed it
        process.stdout.close()
        for pid in pids:
            wait_until(lambda: not is_alive(pid), f"the end of {pid}")

    def test_at_a_terminal_the_command_is_in_the_foreground(self):
        pid, terminal = pty.fork()
        if pid == 0:
            os.execv(PROGRAM, [PROGRAM, "--demo", "--", sys.executable, "-c", WAITS_FOR_A_SIGNAL])
        with os.fdopen(terminal, "r+b", buffering=0) as line:
            read = b""
            while b"ready" not in read:
                read += line.read(100)
            line.write(b"\x03\n")
            self.assertEqual(os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]), signal.SIGINT)


class SilentNode(cases.Case):
    def test_the_README_s_test_without_a_sleep_is_the_same_every_time_also_under_load(self):
        script = str(ROOT / "examples/silent_node.sh")
        runs = int(os.environ.get("CBCAN_RUNS", "10"))
        for _ in range(runs // 5):
            at_once = [subprocess.Popen([PROGRAM, "--demo", "--clock", "manual", "--", "bash", script], stdout=subprocess.PIPE,
                                        stderr=subprocess.PIPE, text=True, env=dict(os.environ, CBCANCTL=CTL)) for _ in range(5)]
            for process in at_once:
                self.assertEqual(process.communicate(timeout=LIMIT), (
                    "ok 0.000000\nok 1.000000\ncbcanctl: node 99: 0504 0000h ABORT_TIME_OUT: SDO service timed out\n", ""))


cases.main()
