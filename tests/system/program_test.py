#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""cbcan-sim as a program: its start, messages about a failed start, its end, and that clients do not disturb each other."""

import os
import pathlib
import pty
import resource
import signal
import socket
import subprocess

import cases
from done import ran
from healthy import Healthy
from mcu import crc
from simulator import LIMIT, READ, STANDING, Simulator, program_from_arguments, wait_until
from tree import ROOT

PROGRAM = program_from_arguments()


def run(*options, **keywords):
    return ran(PROGRAM, *options, **keywords)


def frame(hexadecimal):
    data = bytes.fromhex(hexadecimal)
    return data + crc(data)


class Starting(cases.Case):
    def check_refused(self, done, code, *texts):
        self.assertEqual(done.returncode, code, done.stderr)
        self.assertEqual(done.stdout, "")
        for text in texts:
            self.assertIn(text, done.stderr)

    def test_a_service_manager_hears_when_it_serves(self):
        """sd_notify(3): a datagram to the socket that NOTIFY_SOCKET names; @ begins a name outside of the file system."""
        for name in (f"{self.folder}/notify", f"@cbcan-test-{os.getpid()}"):
            with self.subTest(name=name), socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as manager:
                manager.settimeout(LIMIT)
                manager.bind(name.replace("@", "\0"))
                with Simulator(PROGRAM, "--demo", env=os.environ | {"NOTIFY_SOCKET": name}) as simulator:
                    self.assertEqual(manager.recv(100), b"READY=1")
                    self.assertEqual(simulator.stop(), (0, ""))

    def test_a_service_manager_that_is_gone(self):
        for name, why in (("/nonexistent/notify", "No such file or directory"), ("/" + 200 * "n", "File name too long")):
            with self.subTest(name=name), Simulator(PROGRAM, "--demo", env=os.environ | {"NOTIFY_SOCKET": name}) as simulator:
                self.assertEqual(simulator.stop(), (0, f"cbcan-sim: service manager: NOTIFY_SOCKET={name}: {why}; "
                                                       "it does not hear that cbcan-sim serves\n"))

    def test_a_folder_and_a_program_where_a_file_is_meant(self):
        for option in (("--config", self.folder), ("--node", f"5={self.folder}"), ("--demo", "--set", f"node.32.device={self.folder}/x.lua")):
            (self.folder / "x.lua").mkdir(exist_ok=True)
            self.check_refused(run("--check", *option), 2, f"cbcan-sim: {self.folder}", ": this is a folder; name a file in it\n")
        done = run("--check", "--node", "5=/bin/ls")
        self.check_refused(done, 2, "/bin/ls: not one object in it that a node could have; write an EDS or DCF file\n")
        self.assertEqual(len(done.stderr.splitlines()), 1)

    def test_check_refuses_what_a_start_refuses(self):
        parameters = self.write("module.txt", "not a parameter\n")
        missing = f"{self.folder}/none/x: there is no folder {self.folder}/none; make it first\n"
        for options, why in ((("--rtu", "/dev/x", "--set", "rtu.baud=9601"), "--set rtu.baud=9601: rtu.baud 9601: must be 1200, 2400, 4800, 9600"),
                             (("--set", "plc.device=/dev/x", "--set", "plc.baud=9601"), "plc.baud 9601: must be 1200"),
                             (("--modbus", "127.0.0.1:5000", "--control", ":5000"), "control.listen 127.0.0.1:5000: modbus.port has it already"),
                             (("--rtu", "/dev/x", "--can", "slcan:/dev/x"), "can.spec /dev/x: rtu.device has it already"),
                             (("--rtu", "/dev/x,9601,E,1"), "must be the path alone; the others are --set rtu.baud=, rtu.parity= and rtu.station="),
                             (("--rtu", parameters), f"rtu.device {parameters}: no serial port; write the path of one"),
                             (("--log", f"{self.folder}/none/x"), f"log.file {missing}"),
                             (("--record", f"{self.folder}/none/x"), f"log.record {missing}"),
                             (("--pcap", f"{self.folder}/none/x"), f"log.pcap {missing}"),
                             (("--control", f"unix:{self.folder}/none/x"), f"control.listen {missing}"),
                             (("--slcan", f"pty:{self.folder}/none/x"), f"can.slcan {missing}"),
                             (("--set", f"module.parameters={self.folder}/none/x"), f"module.parameters {missing}"),
                             (("--set", f"node.66.parameters={self.folder}/none/x"), f"node.parameters {missing}"),
                             (("--wire", "66:output:99=16:0x6040"), "cbcan-sim: --wire 66:output:99=16:0x6040: wire "),
                             (("--set", f"module.parameters={parameters}"), f"{parameters}:1: ")):
            with self.subTest(options=options):
                self.check_refused(run("--demo", *options), 2, why)
                self.check_refused(run("--check", "--demo", *options), 2, why)
        done = run("--check", "--demo")
        self.assertEqual((done.returncode, done.stdout, done.stderr), (0, "", ""))

    def test_a_pipe_of_parameters_is_read_once(self):
        for line, options, code, said in (("1017:00 = E703", ("--clock", "manual", "--modbus", "127.0.0.1:0"), 0, "ok 999\n"),
                                          ("1017:00 = E703", ("--check",), 0, ""), ("1017", ("--check",), 2, ':1: "1017": ')):
            done = ran("bash", "-c", f'"$0" "$@" --set node.66.parameters=<(echo {line})', PROGRAM, "--demo", *options, input="get 66 0x1017\n")
            self.assertEqual(done.returncode, code, done.stderr)
            self.assertIn(said, done.stdout + done.stderr)

    def test_words_in_the_wrong_order(self):
        for words in (("eds",), ("eds", "--demo", "66"), ("eds", "drive", "--demo")):
            self.check_refused(run(*words), 2, "cbcan-sim: eds: write cbcan-sim eds NODE --config FILE\n")
        self.check_refused(run("eds", "99", "--demo"), 2, "cbcan-sim: eds 99: there is no such node in the plant\n")

    def test_wrong_files(self):
        self.check_refused(run("--check", "--demo", "--set", f"node.66.parameters={self.folder}", "--node", "9=no.eds"), 2, "--node 9=no.eds: node 9: cannot read")
        plant = self.write("plant.toml", '[[node]]\nid = 5\neds = "missing.eds"\n')
        self.check_refused(run("--config", str(plant), "--modbus", "127.0.0.1:0"), 2, f"{plant}:1: ", "missing.eds")
        plant.write_bytes(bytes(range(256)))  # the line end is among them
        self.check_refused(run("--config", str(plant)), 2, f"{plant}:2: ", "UTF-8")

    def test_files_without_an_end(self):
        modbus = ("--modbus", "127.0.0.1:0")
        self.check_refused(run("--config", "/dev/zero", *modbus), 2, "cbcan-sim: /dev/zero: more than 16 MiB; ")
        self.check_refused(run("--demo", "--set", "node.0x42.parameters=/dev/full", *modbus), 2, "cbcan-sim: /dev/full: more than 16 MiB; ")

    def test_plant_file_made_to_hurt_the_parser(self):
        plant = self.folder / "plant.toml"
        for line in (".".join(200_000 * "a") + " = 1", "[" + ".".join(200_000 * "a") + "]", 5_000_000 * "a" + " = 1"):
            plant.write_text(f"[modbus]\n{line}\n")
            self.check_refused(run("--config", str(plant)), 2, f"{plant}:2: a line of more than 10000 characters; ")
        plant.write_text(500 * (9_990 * "a" + " = 1\n[[network]]\n"))
        self.check_refused(run("--config", str(plant)), 2, f"{plant}:1: aaa")

    def test_port_in_use(self):
        with socket.create_server(("127.0.0.1", 0)) as other:
            address = f"127.0.0.1:{other.getsockname()[1]}"
            done = run("--demo", "--modbus", address)
        self.check_refused(done, 3)
        self.assertEqual(done.stderr, f"cbcan-sim: modbus {address}: address in use: another program listens there; stop it, or use "
                                      "127.0.0.1:0 for any free port\n")

    def test_no_such_interface(self):
        done = run("--demo", "--modbus", "127.0.0.1:0", "--can", "socketcan:nope0")
        self.check_refused(done, 3)
        # With CAN in the kernel and without.
        self.assertIn(done.stderr, (
            "cbcan-sim: can socketcan:nope0: no such interface; `ip link` lists them; for a virtual one: ip link add dev nope0 "
            "type vcan && ip link set nope0 up\n",
            "cbcan-sim: can socketcan:nope0: this kernel has no CAN (Address family not supported by protocol); "
            "`tools/dev/in-vcan-vm COMMAND` runs a command where there is vcan0, and the virtual bus needs no kernel\n"))

    def test_log_that_cannot_be_made(self):
        self.check_refused(run("--demo", "--modbus", "127.0.0.1:0", "--log", "/proc"), 3, "log /proc: Is a directory; ")

    def test_closed_descriptors(self):
        """Descriptors that its caller has closed become /dev/null: no socket gets such a number."""
        for closed in ((0,), (1,), (2,), (0, 1), (0, 1, 2)):
            def close(closed=closed):
                for number in closed:
                    os.close(number)

            done = run(*STANDING, stdin=subprocess.DEVNULL, preexec_fn=close)
            self.assertEqual((done.returncode, done.stderr), (0, ""), closed)
            self.assertRegex(done.stdout, r"\A\Z" if 1 in closed else r"\Aready modbus=\S+ can=virtual\n\Z")

    def test_too_few_descriptors(self):
        for plant in (("--demo",), ("--config", f"{ROOT}/plants/demo/plant.toml"), ("--node", f"5={ROOT}/plants/demo/generic.eds")):
            for limit in range(4, 16):
                done = run(*plant, *STANDING[1:], stdin=subprocess.DEVNULL,
                           preexec_fn=lambda limit=limit: resource.setrlimit(resource.RLIMIT_NOFILE, (limit, limit)))
                self.assertRegex(done.stderr, r"\A\Z" if done.returncode == 0 else r"\Acbcan-sim: .*Too many open files", limit)
                self.assertIn(done.returncode, (0, 3))
            self.assertEqual(done.returncode, 0)

    def test_a_pipe_that_nobody_writes_to(self):
        pipe = f"{self.folder}/plant.toml"
        os.mkfifo(pipe)
        why = f"{pipe}: a pipe that no program writes to; name a file, or start its writer first"
        self.check_refused(run("--config", pipe), 2, why)
        done = run("run", pipe)
        self.assertEqual((done.returncode, done.stdout), (2, f"WRONG {pipe}\n{why}\n0 passed, 1 wrong\n"))
        self.check_refused(run("run", self.folder), 2, f"{self.folder}: no file *.toml in it has a [[step]]")
        self.check_refused(run("--modbus", "127.0.0.1:0", "--node", f"5={pipe}"), 2, why)

    def test_a_pipe_with_a_writer(self):
        done = ran("bash", "-c", f"{PROGRAM} --check --config <(sleep 0.01; printf '[module]\nnode_id = 300\n')")
        self.assertRegex(done.stderr, r"\A/dev/fd/\d+:2: .*1\.\.127")

    def test_nothing_that_is_quoted_commands_the_terminal(self):
        evil = "\x1b[2J\nready modbus=0.0.0.0:1 \x9b"
        path = self.folder
        (path / f"a{evil}.toml").write_text('plant = "demo"\n[[step]]\nat = "0ms"\nexpect = "register 0 = 1"\n')
        lua = "".join(f"\\{byte:03}" for byte in evil.encode())
        (path / "print.lua").write_text(f'function update(now) print("printed{lua}") error("failed{lua}") end\n')
        (path / "load.lua").write_text(f'error("refused{lua}")\n')
        for name in ("print", "load"):
            (path / f"{name}.toml").write_text(f'[modbus]\nport = 0\n[[node]]\nid = 5\neds = "{ROOT}/plants/demo/generic.eds"\ndevice = "{name}.lua"\n')
        outputs = [run("run", self.folder), run("--config", f"{self.folder}/load.toml"), run("--demo", "--log", f"{self.folder}/no{evil}/log"),
                   run("--demo", "--set", f"node.32.device={self.folder}/load.lua"), run("run", f"--x{evil}"),
                   run("--demo", "--modbus", ":0", "--clock", "manual", "--slcan", f"pty:{self.folder}/pty{evil}", stdin=subprocess.DEVNULL)]
        simulator = Simulator(PROGRAM, "--config", f"{self.folder}/print.toml", "--control", "127.0.0.1:0")
        wait_until(lambda: "printed" in "".join(simulator.errors()), "the script's words")
        said = simulator.stop()[1]
        self.assertEqual(outputs[0].returncode, 1, outputs[0].stderr)
        for text in [output.stdout + output.stderr for output in outputs] + [said]:
            self.assertIn("ready modbus=0.0.0.0:1", text)
            self.assertNotRegex(text, r"[^\n\x20-\x7e\u00a0-\U0010ffff]|\nready")


class Diagnostics(cases.Case):
    """R4100..R4140, as in an image for a microcontroller."""

    def check(self, plc, registers):
        for first, words in registers.items():
            self.assertEqual(plc.read(first, len(words)), words, first)

    def test_what_can_be_known(self):
        with Simulator(PROGRAM, "--demo", "--clock", "manual", "--set", "rtu.listen=127.0.0.1:0",
                       stdin=subprocess.PIPE) as simulator, simulator.window() as plc:
            simulator.say("pass 70s")
            self.assertEqual((plc.execute(READ, 0x42, 0x1000, 0, 4), plc.execute(READ, 0x42, 0x3333, 0, 4)), (0, 4))
            plc.start(READ, 99, 0x1000, 0, 4)
            plc.write(3700, [0])
            version = [int(part) for part in run("--version").stdout.split()[1].split(".")]
            requests = plc.read(4108, 1)[0]
            self.check(plc, {4100: [version[0] << 8 | version[1], version[2]], 4102: [70000 & 0xFFFF, 70000 >> 16, 1, 0, 0, 0],
                             4116: [5 + 2, 0, 1 + 4, 0, 0, 0, 0, 0, 0, 0],  # boot-up messages and transfers
                             4126: [3, 0, 1, 0, 1, 0], 4132: [0] * 9})
            self.assertEqual(plc.read(4108, 1), [requests + 6])
            self.assertRaises(Exception, plc.read, 4168, 1)
            self.check(plc, {4112: [1, 0]})
            for fault, state in (("error-passive", 17), ("overflow", 2), ("bus-off", 16)):
                simulator.say("clear bus")
                simulator.say(f"fault bus {fault}")
                self.check(plc, {4107: [state]})
                self.assertEqual(simulator.say("read 4107"), f"ok {state}\n")
            plc.start(READ, 0x42, 0x1000, 0, 4)
            simulator.say("pass 1ms")
            self.assertGreater(plc.read(4120, 1)[0], 0)
            with simulator.connect("rtu_tcp") as rtu:
                rtu.sendall(frame("0103100B0001"))  # R4107
                self.assertEqual(rtu.recv(7, socket.MSG_WAITALL), frame("0103020010"))

    def test_in_a_scenario(self):
        scenario = self.write("diagnostics.toml", 'plant = "demo"\n[[step]]\ndo = ["trigger read 0x42 0x1000 0 4", "fault bus bus-off"]\n'
                              'expect = ["register 4107 = 16", "register 4126 = 1 0 0 0"]\n')
        done = run("run", scenario)
        self.assertEqual(done.returncode, 0, done.stdout)

    def test_the_result_after_a_start(self):
        for options, result in (((), 0), (("--set", "module.start_result=5"), 5)):
            with Simulator(PROGRAM, "--demo", *options) as simulator, simulator.window() as plc:
                self.assertEqual(plc.read(3700, 70), [result] + [0] * 69)
                self.assertEqual(plc.execute(READ, 0x42, 0x1000, 0, 4), 0)
        self.assertIn("module.start_result 4: must be 0 or 5", run("--set", "module.start_result=4").stderr)


class Ending(cases.Case):
    def test_signals(self):
        for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP):
            simulator = Simulator(PROGRAM, "--demo", log=False)
            code, error = simulator.stop(number)
            self.assertEqual((code, error), (0, ""))

    def test_a_hangup_opens_the_logs_again(self):
        second = self.folder / "second.log"
        simulator = Simulator(PROGRAM, "--demo", "--network", "2", "--log", second, log=False, test=self)
        second.rename(self.folder / "moved")
        simulator.process.send_signal(signal.SIGHUP)
        wait_until(second.exists, "a new file")
        self.assertEqual(simulator.stop()[0], 0)

    def test_a_hangup_of_the_terminal_ends_it(self):
        log = self.folder / "bus.log"
        child, terminal = pty.fork()
        if child == 0:
            os.execv(PROGRAM, [PROGRAM, "--demo", "--modbus", "127.0.0.1:0", "--log", str(log)])
        self.assertIn(b"ready", os.read(terminal, 1000))
        log.rename(self.folder / "moved")
        os.kill(child, signal.SIGHUP)  # of another program
        wait_until(log.exists, "a new file")
        os.close(terminal)
        wait_until(lambda: os.waitpid(child, os.WNOHANG) == (child, 0), "an end with exit code 0")

    def test_nohup(self):
        simulator = Simulator(PROGRAM, "--demo", before_start=lambda: signal.signal(signal.SIGHUP, signal.SIG_IGN), test=self)
        simulator.process.send_signal(signal.SIGHUP)
        with simulator.window() as window:
            for _ in range(10):
                self.assertEqual(window.execute(READ, 0x42, 0x1000, 0, 4), 0)
        self.assertEqual(simulator.stop(), (0, ""))

    def test_in_the_middle_of_a_transfer_that_takes_longer_than_this_waits(self):
        simulator = Simulator(PROGRAM, "--demo", "--sdo-timeout", str(1000 * (LIMIT + 5)))
        with simulator.window() as window:
            window.start(READ, 99, 0x1000, 0, 4)
            simulator.wait_for_frame("663#4000100000000000")
            self.assertEqual(simulator.stop(), (0, ""))

    def test_in_the_middle_of_many_transfers_the_log_is_whole(self):
        simulator = Simulator(PROGRAM, "--demo", test=self)
        healthy = Healthy(simulator.port)
        healthy.wait_for(50)
        simulator.process.send_signal(signal.SIGTERM)
        self.assertEqual(simulator.process.wait(LIMIT), 0)
        healthy.join(LIMIT)  # it runs until the server is gone
        with self.assertRaises(AssertionError):
            healthy.finish()
        log = simulator.log_path.read_text()
        self.assertRegex(log, r"\A(\(\d{10}\.\d{6}\) virtual [0-9A-F]{3}#[0-9A-F]{0,16}\n)+\Z")
        begun = [frame for frame in simulator.frames() if frame in ("620#2180200080000000", "620#4080200000000000")]
        self.assertGreaterEqual(len(begun), healthy.transactions)

    def test_what_its_last_turn_brings_is_in_the_log(self):
        simulator = Simulator(PROGRAM, "--demo", test=self)
        clients = [simulator.window() for _ in range(50)]
        for client in clients:
            self.addCleanup(client.socket.close)
            client.read(0, 1)
        # Everything comes in one turn: a read of 1000h of node 20h, more requests than the response's frame takes time, the signal.
        simulator.process.send_signal(signal.SIGSTOP)
        wait_until(lambda: self.state(simulator.process) == "T", "the simulator to be stopped")
        clients[0].socket.sendall(bytes.fromhex("0001 0000 0013 01 10 0E74 0006 0C CA0E 13BF 0020 1000 0000 0004"))
        for client in clients[1:]:
            client.socket.sendall(20 * bytes.fromhex("0001 0000 0006 01 03 0000 007D"))
        simulator.process.send_signal(signal.SIGTERM)
        simulator.process.send_signal(signal.SIGCONT)
        self.assertEqual(simulator.process.wait(LIMIT), 0)
        self.assertIn("620#4000100000000000", simulator.frames())

    def state(self, process):
        return pathlib.Path(f"/proc/{process.pid}/stat").read_text().rsplit(")", 1)[1].split()[0]


class BehindTheClock(cases.Case):
    """update() takes 0.4 ms and more, and is to be called every 10 us."""

    def test_clients_and_signals_have_their_turn(self):
        generic = ROOT / "plants/demo/generic.eds"
        (self.folder / "slow.lua").write_text("function update(now) for i = 1, 90000 do end return now + 1e-5 end\n")
        plant = self.write("plant.toml", f'[[node]]\nid = 20\neds = "{generic}"\ndevice = "slow.lua"\n[[node]]\nid = 32\neds = "{generic}"\n')
        simulator = Simulator(PROGRAM, "--config", str(plant), "--control", "127.0.0.1:0", log=False, test=self)
        with simulator.window() as window, simulator.connect("control") as control:
            def is_said():
                window.write(3700, [0xCA0E, READ, 32, 0x2004, 0, 4])
                self.assertEqual(window.read(3700, 1), [0])
                control.sendall(b"get 32 0x2004\n")
                self.assertTrue(control.recv(100).startswith(b"ok "))
                return simulator.errors()
            wait_until(is_said, "the plant is behind")
        code, error = simulator.stop()
        self.assertEqual(code, 0)
        self.assertEqual(error, "cbcan-sim: the plant is more than 1 s behind the clock: its nodes take more time than there "
                                "is; let scripts be called less often, or use --clock manual\n")


cases.main()
