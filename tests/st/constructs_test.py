#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""The files of tools/st use only what the systems that they are for take."""

import re
import unittest

from plc import LIBRARY, ROOT, configuration, source
import cases
from constructs import POINTERS, taken_by
from st_machine import Machine

BLOCKS = {  # inputs and outputs as the CiA 405 library of SoMachine has them; the first three and the first two outputs are common
    "NMT": ("DEVICE STATE", "", ""),
    "RECV_EMCY": ("", "DEVICE ERRORINFO", ""),
    "RECV_EMCY_DEV": ("DEVICE", "ERRORINFO", ""),
    "GET_LOCAL_NODE_ID": ("", "DEVICE", ""),
    "GET_CANOPEN_KERNEL_STATE": ("", "STATE DEVICE", ""),
    "GET_STATE": ("DEVICE", "STATE", ""),
    "SDO_READ": ("DEVICE CHANNEL INDEX SUBINDEX DATA MODE", "ERRORINFO", "DATALENGTH"),
    "SDO_READ4": ("DEVICE CHANNEL INDEX SUBINDEX", "DATA DATALENGTH ERRORINFO", ""),
    "SDO_WRITE": ("DEVICE CHANNEL INDEX SUBINDEX MODE DATA DATALENGTH", "ERRORINFO", ""),
    "SDO_WRITE4": ("DEVICE CHANNEL INDEX SUBINDEX DATA DATALENGTH", "ERRORINFO", ""),
}
DEFAULTS = {"NETWORK": 1, "CHANNEL": 1, "MODE": "AUTO", "DATA": None}


class Files(unittest.TestCase):
    def systems_of(self, *names, main):
        uses = Machine(*source(*names), configuration(main)).uses
        self.assertGreater(len(uses), 20)
        return {construct: (taken_by(construct), place) for construct, place in uses.items() if not place.startswith("configuration.st")}

    def test_the_library_is_for_all(self):
        for construct, (systems, place) in self.systems_of("cia405.st", "scanner.st", "openplc.st", "example.st", main="state_of_node_5").items():
            self.assertEqual(systems, {"MATIEC", "OpenPLC", "STruC++", "CODESYS"}, f"{place}: {construct}")

    def test_the_blocks_with_pointers_are_for_codesys_and_strucpp(self):
        found = self.systems_of("cia405.st", "cia405_codesys.st", "ramp.st", main="Read_Write_SDO")
        for construct, (systems, place) in found.items():
            self.assertLessEqual({"CODESYS", "STruC++"}, systems, f"{place}: {construct}")
            if construct in POINTERS:
                self.assertRegex(place, r"\A(cia405_codesys|ramp)\.st:")
        self.assertEqual({construct for construct in found if construct in POINTERS}, set(POINTERS))

    def test_the_configuration_is_for_matiec(self):
        for construct in Machine(*source("cia405.st", "scanner.st", "openplc.st", "example.st", "configuration.st")).uses:
            self.assertLessEqual({"MATIEC", "OpenPLC", "STruC++"}, taken_by(construct), construct)

    def test_the_documented_text_for_openplc(self):
        """What the page says to upload, with the names that OpenPLC's compile_program.sh moves to where it builds them: MATIEC calls
        its files after the configuration and the resource."""
        names = re.search(r"`cat ([\w. ]+) > program\.st`", " ".join((ROOT / "docs/how-to/openplc.md").read_text().split()))[1].split()
        text = "".join(text for _, text in source(*names))
        configurations, resources = re.findall(r"^CONFIGURATION (\w+)", text, re.MULTILINE), re.findall(r"^ *RESOURCE (\w+)", text, re.MULTILINE)
        self.assertEqual([configurations, resources], [["Config0"], ["Res0"]])
        program = Machine(("program.st", text)).programs["EXCHANGE"][0]
        words = {f"%QW{100 + i}": f"OUT{i}" for i in range(70)} | {f"%IW{100 + i}": f"IN{i}" for i in range(68)}
        self.assertEqual(program.located, words)

    def test_what_is_in_no_list_is_found(self):
        self.assertEqual(taken_by("function SQRT"), set())

    def test_lines_fit_on_a_page(self):
        for path in LIBRARY.glob("*.st"):
            for number, line in enumerate(path.read_text().splitlines(), 1):
                self.assertLessEqual(len(line), 120, f"{path.name}:{number}")


class Signatures(unittest.TestCase):
    def test_the_blocks_have_the_inputs_and_outputs_of_cia_405(self):
        machine = Machine(*source("cia405.st", "cia405_codesys.st", "ramp.st"), configuration("Read_Write_SDO"))
        for name, (inputs, outputs, in_outs) in BLOCKS.items():
            with self.subTest(name):
                block = machine.blocks[name]
                self.assertEqual(block.names("VAR_INPUT"), ["NETWORK", "ENABLE", "TIMEOUT", *inputs.split()])
                self.assertEqual(block.names("VAR_OUTPUT"), ["CONFIRM", "ERROR", *outputs.split()])
                self.assertEqual(block.names("VAR_IN_OUT"), in_outs.split())
                for section in block.names("VAR_INPUT", "VAR_OUTPUT"):
                    if section in DEFAULTS and block.sections[section] == "VAR_INPUT" and block.types[section].kind != "array":
                        self.assertEqual(block.initial[section], DEFAULTS[section], section)
                    else:
                        self.assertIn(block.initial[section], self.zeros(block.types[section]), section)

    def zeros(self, a_type):
        return [a_type.first()]

    def test_their_types(self):
        machine = Machine(*source("cia405.st", "cia405_codesys.st", "ramp.st"), configuration("Read_Write_SDO"))
        types = {"NETWORK": "USINT", "ENABLE": "BOOL", "TIMEOUT": "UDINT", "CONFIRM": "BOOL", "ERROR": "USINT", "DEVICE": "USINT", "CHANNEL": "USINT",
                 "INDEX": "WORD", "SUBINDEX": "BYTE", "MODE": "SDO_MODE"}
        for name in BLOCKS:
            block = machine.blocks[name]
            for variable in set(types) & set(block.names("VAR_INPUT", "VAR_OUTPUT")):
                self.assertEqual(block.types[variable].name, types[variable], f"{name}.{variable}")
        for name, of, low, high in (("SDO_READ4", "BYTE", 1, 4), ("SDO_WRITE4", "BYTE", 1, 4)):
            data = machine.blocks[name].types["DATA"]
            self.assertEqual((data.of.name, data.low, data.high), (of, low, high))
        self.assertEqual(machine.blocks["SDO_READ"].types["DATA"].of.name, "BYTE")
        self.assertEqual(machine.types["SDO_ERROR"].name, "UDINT")

    def test_enumerations_and_constants(self):
        machine = Machine(*source("cia405.st", "example.st"), configuration("state_of_node_5"))
        self.assertEqual(machine.types["DEVICE_STATE"].of,
                         "INIT RESET_COMM RESET_APP PRE_OPERATIONAL STOPPED OPERATIONAL UNKNOWN NOT_AVAIL".split())
        self.assertEqual(machine.types["SDO_MODE"].of, "AUTO EXPEDITED SEGMENTED BLOCK".split())
        self.assertEqual({name: machine.globals[name] for name in machine.constants}, {
            "CANOPEN_KERNEL_NO_ERROR": 0, "CANOPEN_KERNEL_OTHER_ERROR": 1, "CANOPEN_KERNEL_DATA_OVERFLOW": 2, "CANOPEN_KERNEL_TIMEOUT": 3,
            "CANOPEN_KERNEL_CANBUS_OFF": 0x10, "CANOPEN_KERNEL_CAN_ERROR_PASSIVE": 0x11, "CANOPEN_INTERNAL_FB_ERROR": 0x21,
            "CANOPEN_NO_MORE_MEMORY": 0x22, "CANOPEN_WRONG_PARAMETER": 0x23, "CANOPEN_NODEID_UNKNOWN": 0x24, "CANOPEN_NETID_UNKNOWN": 0x25,
            "CANOPEN_REQUEST_ERROR": 0x26, "CANOPEN_SDOCHANNEL_UNKNOWN": 0x27, "CANOPEN_NO_DRIVER": 0x28, "CANOPEN_CONFIGURATION_ERROR": 0x29,
            "CANOPEN_GUARDING_ERROR": 0x2A,
            "STOP_REMOTE_NODE": 4, "START_REMOTE_NODE": 5, "RESET_NODE": 6, "RESET_COMMUNICATION": 7, "ENTER_PRE_OPERATIONAL": 0x7F,
            "ALL_EXCEPT_NMT_AND_SENDER": 0x800})
        self.assertEqual(list(machine.types["EMCY_ERROR"].of), ["EMCY_ERROR_CODE", "ERROR_REGISTER", "ERROR_FIELD"])


cases.main()
