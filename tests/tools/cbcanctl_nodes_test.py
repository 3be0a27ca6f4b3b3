#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""The commands of cbcanctl for many nodes at once (scan, dump, configure), with the real cbcan-sim."""

import json
import os
import re
import select
import subprocess

import cases
from ctl import ABSENT, DONE, REFUSED, USAGE, Case, run, start
from done import ran
from simulator import Simulator, program_from_arguments, wait_until
from tree import ROOT

CBCAN_SIM = program_from_arguments()
FILES = {1: "pressure_transducer", 16: "drive", 32: "generic", 66: "io_module"}  # of the demo plant


def eds(name):
    return ROOT / f"plants/demo/{name}.eds"


class Nodes(Case):
    options = ()

    def setUp(self):
        self.simulator = Simulator(CBCAN_SIM, "--demo", *self.options, test=self)
        self.place = self.simulator.port

    def dcf(self, name, node, values):
        """The file of a demo node with values: {"1400sub1": "5"}."""
        text = eds(name).read_text() + f"\n[DeviceComissioning]\nNodeID={node}\n"
        for section, value in values.items():
            self.assertIn(f"[{section}]\n", text)
            text = text.replace(f"[{section}]\n", f"[{section}]\nParameterValue={value}\n")
        return self.write(f"{name}{node}.dcf", text)

    def dumped(self, *arguments):
        done = run(self.place, "dump", *arguments)
        self.assertEqual((done.returncode, done.stderr), (DONE, ""))
        return done.stdout


class Boots(Nodes):
    def setUp(self):
        network = self.write("network.toml", """
            node = [
              { id = 2, objects = [ { index = 0x5000, value = 1, type = "u8" } ] },
              { id = 66, device_type = 0x20192 },
              { id = 1 },
            ]""")
        self.options = "--network-file", network
        super().setUp()

    def test_status_says_why_nodes_have_not_been_booted(self):
        said = {1: "running, not watched", 2: "configuration failed at 5000h:00: 0602 0000h no such object (J); it is not started",
                66: "device type differs from the network file (C); it is not started"}  # it is stopped: no SDO
        rows = [(line[:6], line[24:]) for line in run(self.place, "status").stdout.splitlines()]
        self.assertEqual({int(row[0]): row[1] for row in rows[1:] if int(row[0]) in said}, said)
        rows = [json.loads(line) for line in run(self.place, "status", "--json").stdout.splitlines()]
        self.assertEqual({row["node"]: row["step"] for row in rows if row["node"] in said}, said)


class WithoutNodeIds(Case):
    """Three modules of the plant get their node IDs by LSS; two are alike."""

    def start(self, network):
        plant = self.write("plant.toml", f"""
            can.bit_rate = 0
            module.network = "{self.write('network.toml', network)}"
            node = [
              {{ eds = "{eds('io_module')}", lss = true, objects = [ {{ index = 0x1018, sub = 4, value = 7 }} ] }},
              {{ eds = "{eds('io_module')}", lss = true, objects = [ {{ index = 0x1018, sub = 4, value = 9 }} ] }},
              {{ eds = "{eds('drive')}", lss = true }},
            ]""")
        self.place = Simulator(CBCAN_SIM, "--config", plant, test=self).port

    def test_lss(self):
        self.start("")
        io, drive = "vendor 0x0  product 0x191  revision 0x10000  serial ", "vendor 0x0  product 0x192  revision 0x10000  serial 0x1\n"
        self.check("lss scan --timeout 5", f"{io}0x7\n{io}0x9\n{drive}")
        self.check("lss assign 5 0 0x191 --timeout 5", "", REFUSED, "cbcanctl: lss: more than one module has this identity; add the SERIAL that lss scan shows\n")
        self.check("lss assign 5 0 0x191 0 9 --timeout 5")
        self.check("read 5 0x1018 4", "0x00000009 9\n")
        self.check("lss assign 6 0 0x999 --timeout 5", "", REFUSED, "cbcanctl: lss: no module without a node ID has this identity\n")
        self.assertEqual([json.loads(line)["serial"] for line in run(self.place, "lss", "scan", "--json", "--timeout", "5").stdout.splitlines()], [7, 1])
        self.check("lss assign 6 --timeout 5", "", REFUSED, "cbcanctl: lss: more than one module has this identity; add the SERIAL that lss scan shows\n")
        self.check("lss assign 6 0 0x191 --timeout 5")
        self.check("read 6 0x1018 4", "0x00000007 7\n")
        for words in ("lss find", "lss scan 5", "lss assign", "lss assign 5 1 2 3 4 5"):
            self.check(words, "", USAGE, "cbcanctl: lss: write scan, or assign NODE [VENDOR [PRODUCT [REVISION [SERIAL]]]]\n")

    def test_nodes_join(self):
        self.start("""
            node = [ { id = 5, identity = [0, 0x192, 0x10000], lss = true }, { id = 6, identity = [0, 0x191, 0x10000, 9], lss = true } ]""")
        self.assertEqual(run(self.place, "status", "--wait", 60000).returncode, DONE)
        self.check("read 6 0x1018 4", "0x00000009 9\n")

    @cases.in_long
    def test_two_alike(self):
        self.start("node = [ { id = 5, identity = [0, 0x191, 0x10000], lss = true } ]")
        said = "differ in the serial number only: give it, or connect one at a time (U); it is looked for each second"
        while said not in run(self.place, "status", "--wait", 200).stdout:
            pass


class ManyNodes(Nodes):
    def test_scan(self):
        done = run(self.place, "scan")
        self.assertEqual((done.returncode, done.stderr), (DONE, ""))
        heading, *rows = done.stdout.splitlines()
        self.assertEqual([row.split()[0] for row in rows], ["1", "2", "16", "32", "66", "127"])
        self.assertEqual(rows[4].split(), ["66", "0x000F0191", "0x00000000", "0x00000191", "0x00010000", "0x00000001", *"cbcan I/O module".split()])
        self.assertEqual(rows[4].index("0x00000191"), heading.index("product"))
        self.assertEqual(rows[4].index("cbcan"), heading.index("name"))
        rows = [json.loads(line) for line in run(self.place, "--json", "scan").stdout.splitlines()]
        self.assertEqual(rows[3], {"node": 32, "device_type": 0, "vendor": 0, "product": 32, "revision": 65536, "serial": 1,
                                   "name": "cbcan generic node"})

    def test_a_scan_is_a_network_file(self):
        """cbcan-sim has nothing to say about it, and boots it."""
        done = run(self.place, "scan", "--eds", ROOT / "plants/demo", "--network")
        self.assertEqual(done.returncode, DONE)
        self.assertEqual([int(line) for line in re.findall(r"^id = (\d+)$", done.stdout, re.MULTILINE)], [1, 2, *list(FILES)[1:]])  # without 127, the module
        self.assertEqual(re.findall(r'^eds = ".*/(.*)\.eds"$', done.stdout, re.MULTILINE), [FILES[1], *FILES.values()])
        self.assertEqual(done.stderr.splitlines(), [f"cbcanctl: node 16: RPDO {number}: RPDO 1 has 6040h:00 already" for number in (2, 3, 4)])
        network = self.write("network.toml", done.stdout)
        checked = ran(CBCAN_SIM, "--demo", "--network-file", network, "--check")
        self.assertEqual((checked.returncode, checked.stdout, checked.stderr), (DONE, "", ""))
        simulator = Simulator(CBCAN_SIM, "--demo", "--network-file", network, test=self)
        wait_until(lambda: run(simulator.port, "status").stdout.count(" Operational      running") == 5, "five nodes")

    def test_scan_needs_a_folder_of_eds_files(self):
        told = "--network: needs --eds FOLDER, and no --json; --eds needs --network"
        for options in ("--network", "--eds .", "--eds . --network --json"):
            self.assertEqual((done := run(self.place, "scan", *options.split())).returncode, USAGE)
            self.assertIn(told, done.stderr)
        self.check(f"scan --eds {self.folder} --network", "", USAGE, f"cbcanctl: {self.folder}: no EDS file that can be used in this folder\n")

    @cases.in_long
    def test_a_dump_is_a_plan(self):
        for node, name in FILES.items():
            for arguments in ((node, "--eds", eds(name)), (node,))[:1 + (node == 66)]:  # without a file it takes seconds
                with self.subTest(arguments):
                    text = self.dumped(*arguments)
                    self.check(f"configure {self.write('plan.toml', text)}", f"{node} started\n")
                    self.check(f"nmt preop {node}")
                    self.assertEqual(self.dumped(*arguments), text)
        self.assertIn('\n  # { index = 0x6200, sub = 0, value = 1, type = "u8" },\n', text)  # a number of sub-indices
        self.assertIn('\n  { index = 0x1600, sub = 0, value = 1, type = "u8" },\n', text)

    def test_what_a_dump_says(self):
        text = self.dumped(32, "--eds", eds("generic"))
        for line in ("device_type = 0", "identity = [0, 32, 65536, 1]",
                     '  { index = 0x1014, sub = 0, value = 0xa0, type = "u32" },  # COB-ID emergency message',
                     '  { index = 0x2202, sub = 0, value = 0, type = "i16" },  # Limited',
                     '  # { index = 0x2200, sub = 0, value = 305419896, type = "u32" },  # Read only',
                     "  # 2201h:00 0601 0001h ABORT_WO: attempt to read a write-only object  # Write only"):
            self.assertIn(f"\n{line}\n", text)
        rows = [json.loads(line) for line in self.dumped(32, "--json").splitlines()]
        self.assertIn({"node": 32, "index": 0x2001, "sub": 0, "data": "00", "value": 0}, rows)
        self.assertIn({"node": 32, "index": 0x2201, "sub": 0, "abort_code": 0x06010001}, rows)
        self.assertEqual({row["index"] for row in rows}, {int(line[1:5], 16) for line in eds("generic").read_text().splitlines()
                                                          if line[1:5].isalnum() and line[:2] in ("[1", "[2")})

    @cases.in_long
    def test_what_has_been_dumped_comes_back(self):
        self.check("write 0x20 0x200E 0 hex:6865783A30313032303330343035")  # hex:0102030405
        self.check("write 0x20 0x2008 0 18446744073709551615 --type u64")
        self.check("write 0x20 0x207F 0 " + 127 * "a" + " --type string")
        plan = self.write("plan.toml", self.dumped(32))
        self.check("nmt reset-node 0x20")
        self.check("read 0x20 0x2008 0 --type u64", "0\n")
        self.check(f"configure {plan}", "32 started\n")
        self.check("read 0x20 0x200E 0 --type string", "hex:0102030405\n")
        self.check("read 0x20 0x207F 0 --type string", 127 * "a" + "\n")
        self.check("read 0x20 0x2008 0 --type u64", "18446744073709551615\n")

    def test_a_node_that_is_not_there_and_files_that_are_none(self):
        self.check("dump 99", "", ABSENT, "cbcanctl: node 99: 0504 0000h ABORT_TIME_OUT: SDO service timed out\n")
        self.check("dump 0", "", USAGE, "cbcanctl: NODE 0: write 1..127\n")
        no_object = "there is no object in it, no section like [1000]: is this an EDS or DCF?"
        for content, told in ((b"", no_object), (bytes(range(256)) * 50, no_object),
                              (b"\xFF\xFE[\0", "this is UTF-16: save the file as ASCII or UTF-8")):
            for command, name in (("dump 32 --eds", "a.eds"), ("configure", "a.DCF")):
                path = self.folder / name
                path.write_bytes(content)
                self.check(f"{command} {path}", "", USAGE, f"cbcanctl: {path}:1: {told}\n")

    def test_configure_by_dcf(self):
        generic = self.dcf("generic", 32, {"2002": "0x4D", "1017": "500"})
        module = self.dcf("io_module", 66, {"1400sub2": "1", "1600sub0": "1", "1600sub1": "0x62000108"})
        seen = len(self.simulator.frames())
        self.check(f"configure {generic} {module}", "32 started\n66 started\n")
        self.check("read 0x20 0x2002 0 --type u16", "77\n")
        self.check("read 0x42 0x1400 2 --type u8", "1\n")
        written = [frame[4:] for frame in self.simulator.frames()[seen:] if frame[:6] in ("642#23", "642#2F")]
        self.assertEqual(written, ["2300140142020080", "2F00140201000000", "2F00160000000000", "2300160108010062", "2F00160001000000",
                                   "2300140142020000"])

    def test_plans_that_do_not_fit(self):
        generic = self.dcf("generic", 32, {"2002": "0x4D"})
        self.check(f"configure {generic} {generic}", "", USAGE, f"cbcanctl: {generic}: node 32 is in {generic} already\n")
        wrong = self.dcf("generic", 32, {"2002": "70000"})
        line = wrong.read_text().splitlines().index("ParameterValue=70000") + 1
        self.check(f"configure {wrong}", "", USAGE, f'cbcanctl: {wrong}:{line}: ParameterValue="70000" is no UNSIGNED16\n')
        self.check(f"configure {eds('generic')}", "", USAGE,
                   f"cbcanctl: {eds('generic')}:1: there is no NodeID in [DeviceComissioning]: is this a DCF?\n")
        self.check(f"configure {self.dcf('generic', 16, {'2002': '1'})}", "", REFUSED, "cbcanctl: node 16: 1000h:00 is 92 01 02 00, not "
                   "00 00 00 00\ncbcanctl: 1 of 1 nodes has not been started\n")

    def test_a_terminal_shows_how_far_it_is(self):
        plan = self.write("plan.toml", "[[node]]\nid = 1\n[[node]]\nid = 2\n")
        for words, last in ((("scan",), "node 127 of 127"), (("configure", self.write("none.toml", "")), "node 0 of 0"), (("configure", plan), "node 2 of 2"), (("dump", "32", "--eds", eds("generic")), "object 45 of 45")):
            terminal, end = os.openpty()
            done = run(self.place, *words, capture_output=False, stdout=subprocess.PIPE, stderr=end)
            shown = b""
            while select.select([terminal], [], [], 0)[0]:
                shown += os.read(terminal, 1 << 16)
            os.close(terminal), os.close(end)
            self.assertEqual(done.returncode, DONE)
            self.assertIn(f"] {last}".encode(), shown)
            self.assertTrue(shown.endswith(b"\r\x1b[K"), shown[-60:])

    def test_an_interrupt_leaves_nothing_behind(self):
        for words, frame in (("scan --timeout 60000", "603#4000100000000000"), ("dump 32", "620#4000300000000000")):
            control = start(self.place, *words.split())
            self.simulator.wait_for_frame(frame)
            self.check_interrupted(control, "cbcanctl: cancelled: no request is in progress any more\n")
        self.simulator.wait_for_frame("603#8000100000000008")
        with self.simulator.window() as window:  # 3003h of each channel is unchanged
            for channel in range(1, 16):
                out, number = 500 + 200 * channel, window.read(602 + 200 * channel, 1)[0] + 1
                window.write(out, [number, 5055, 0, 0x3003, 0, 2])
                self.assertEqual(window.read(600 + 200 * channel, 5), [number, 0, number, 2, 1000])


class OneChannel(Nodes):
    options = ("--set", "module.channels=1")

    def test_the_same_by_r3700(self):
        done = run(self.place, "scan", "--timeout", "5")
        self.assertEqual([row.split()[0] for row in done.stdout.splitlines()], ["node", "1", "2", "16", "32", "66", "127"])
        self.check("read 0 0x3003 0 --type u16", "1000\n")
        plan = self.write("plan.toml", self.dumped(32, "--eds", eds("generic")))
        self.check(f"configure {plan}", "32 started\n")


cases.main()
