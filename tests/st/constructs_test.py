#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""The files of tools/st suit the systems that they name, and the blocks have the inputs and outputs of CiA 405."""

import re

from plc import LIBRARY, ROOT, configuration, source
import cases
from recipes import items, tables_of
from cbcan_st.machine.declarations import STANDARD_FUNCTIONS
from cbcan_st.machine.compiler import COMPUTE
from cbcan_st.machine.lexer import KEYWORDS, SECTIONS
from cbcan_st.machine.types import ELEMENTARY
from cbcan_st.machine import Machine

BLOCKS = {  # inputs, outputs and VAR_IN_OUT as the CiA 405 library of SoMachine has them, and MODE for reading; without the common ones
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
    # CAA CiA 405 4.x
    "SDO_READ_DATA": ("DEVICE CHANNEL INDEX SUBINDEX MODE DATA", "ERRORINFO", "DATALENGTH"),
    "SDO_WRITE_DATA": ("DEVICE CHANNEL INDEX SUBINDEX MODE DATA DATALENGTH", "ERRORINFO", ""),
}
PLCOPEN = {  # the names of PLCopen's blocks; inputs, outputs without Axis, Busy, Error and ErrorID
    "Power": ("ENABLE", "STATUS"), "Reset": ("EXECUTE", "DONE"), "Stop": ("EXECUTE", "DONE COMMANDABORTED"),
    "Home": ("EXECUTE POSITION HOMINGMETHOD SEARCHVELOCITY ZEROVELOCITY ACCELERATION", "DONE ACTIVE COMMANDABORTED"),
    "MoveAbsolute": ("EXECUTE POSITION VELOCITY ACCELERATION DECELERATION", "DONE ACTIVE COMMANDABORTED"),
    "MoveRelative": ("EXECUTE DISTANCE VELOCITY ACCELERATION DECELERATION", "DONE ACTIVE COMMANDABORTED"),
    "MoveVelocity": ("EXECUTE VELOCITY ACCELERATION DECELERATION", "INVELOCITY ACTIVE COMMANDABORTED"),
    "ReadStatus": ("ENABLE", "VALID ERRORSTOP DISABLED STOPPING HOMING STANDSTILL DISCRETEMOTION CONTINUOUSMOTION")}
# Words of the third edition, CODESYS, TwinCAT, MATIEC and STruC++ that the interpreter lets pass, and standard function blocks.
RESERVED = KEYWORDS | STANDARD_FUNCTIONS | set(
    "ABSTRACT ACTION ADR ANY BIT BITADR BOOL BYTE CAL CALC CALCN CLASS CODE CONTINUE CTD CTU CTUD D DATE DINT DT DWORD END EQ EXTENDS F_TRIG FINAL "
    "GOTO IMPLEMENTS INI INIT INT INTERFACE INTERNAL JMP L LDATE LD LINT LREAL LTIME LWORD METHOD N NAMESPACE NULL OVERLAP OVERRIDE P "
    "PERSISTENT POINTER PRIVATE PROPERTY PROTECTED PUBLIC R R_TRIG READ_ONLY READ_WRITE REAL REF REF_TO REFERENCE RET RS RTC S SD SECOND SEMA "
    "SINGLE SINT SIZEOF SL SR ST STOPPED STRING SUPER THIS TIME TIME_OF_DAY TOD TOF TON TP TRUNC UDINT UINT ULINT UNION UNKNOWN USING USINT AUTO "
    "BLOCK WORD WSTRING AXIS_REF MC_POWER MC_RESET MC_HOME MC_STOP MC_MOVEABSOLUTE MC_MOVERELATIVE MC_MOVEVELOCITY MC_READSTATUS".split())
DEFAULTS = {"NETWORK": 1, "CHANNEL": 1, "MODE": "AUTO"}
TYPES = {"NETWORK": "USINT", "ENABLE": "BOOL", "TIMEOUT": "UDINT", "CONFIRM": "BOOL", "ERROR": "USINT", "DEVICE": "USINT", "CHANNEL": "USINT",
         "INDEX": "WORD", "SUBINDEX": "BYTE", "MODE": "SDO_MODE"}


class Files(cases.Case):
    def test_pointers_are_in_the_files_for_codesys_and_strucpp_only(self):
        with_pointers = {path.name for path in LIBRARY.glob("*.st")
                         if re.search(r"\bPOINTER\b|\bADR\b|\^", re.sub(r"\(\*.*?\*\)", "", path.read_text(), flags=re.DOTALL))}
        self.assertEqual(with_pointers, {"cia405_codesys.st", "ramp.st"})

    def test_the_documented_text_for_openplc(self):
        """The files that the page says to upload, with the names that OpenPLC's compile_program.sh expects: MATIEC names
        files after the configuration and the resource."""
        names = re.search(r"`cat ([\w. ]+) > program\.st`", " ".join((ROOT / "docs/how-to/plc/openplc.md").read_text().split()))[1].split()
        text = "".join(text for _, text in source(*names))
        configurations, resources = re.findall(r"^CONFIGURATION (\w+)", text, re.MULTILINE), re.findall(r"^ *RESOURCE (\w+)", text, re.MULTILINE)
        self.assertEqual([configurations, resources], [["Config0"], ["Res0"]])
        program = Machine(("program.st", text)).programs["EXCHANGE"][0]
        words = {f"%QW{100 + i}": f"OUT{i}" for i in range(70)} | {f"%IW{100 + i}": f"IN{i}" for i in range(68)}
        self.assertEqual(program.located, words)

    def test_the_page_lists_what_the_machine_knows(self):
        part = (ROOT / "docs/how-to/structured-text.md").read_text().partition("refuses all but these")[2].partition("##")[0]
        listed = set(re.findall(r"\b[A-Z_]{2,}\b", part))
        known = {*ELEMENTARY, *SECTIONS, *COMPUTE} | set("STRUCT ARRAY FUNCTION FUNCTION_BLOCK IF CASE WHILE REPEAT FOR NOT SHL SHR TON".split())
        known |= {*re.findall(r"(?m)^FUNCTION_BLOCK (\w+)", (LIBRARY / "standard.st").read_text())}
        self.assertEqual({word for word in known if word.isidentifier()} - {"VAR", "VAR_INPUT", "VAR_OUTPUT", "VAR_IN_OUT"}, listed)

    def test_lines_fit_on_a_page(self):
        for path in LIBRARY.glob("*.st"):
            for number, line in enumerate(path.read_text().splitlines(), 1):
                self.assertLessEqual(len(line), 120, f"{path.name}:{number}")


class Signatures(cases.Case):
    def setUp(self):
        self.machine = Machine(*source("cia405.st", "conversions.st", "axis.st", "cia405_codesys.st", "ramp.st"), configuration("Read_Write_SDO"))

    def test_the_blocks_have_the_inputs_and_outputs_of_cia_405(self):
        for name, (inputs, outputs, in_outs) in BLOCKS.items():
            with self.subTest(name):
                block = self.machine.blocks[name]
                self.assertEqual(block.names("VAR_INPUT"), ["NETWORK", "ENABLE", "TIMEOUT", *inputs.split()])
                self.assertEqual(block.names("VAR_OUTPUT"), ["CONFIRM", "ERROR", *outputs.split()])
                self.assertEqual(block.names("VAR_IN_OUT"), in_outs.split())
                for variable in block.names("VAR_INPUT", "VAR_OUTPUT"):
                    self.assertEqual(block.initial[variable], DEFAULTS.get(variable, block.types[variable].first()), variable)
                    self.assertEqual(block.types[variable].name, TYPES.get(variable, block.types[variable].name), variable)
        for name in ("SDO_READ4", "SDO_WRITE4"):
            data = self.machine.blocks[name].types["DATA"]
            self.assertEqual((data.of.name, data.low, data.high), ("BYTE", 1, 4))

    def test_the_motion_blocks_have_the_inputs_and_outputs_of_plcopen(self):
        for name, (inputs, outputs) in PLCOPEN.items():
            block = self.machine.blocks[f"CBCAN_MC_{name.upper()}"]
            self.assertEqual(block.names("VAR_INPUT"), inputs.split(), name)
            self.assertEqual(set(block.names("VAR_OUTPUT")) - {"BUSY"}, {*outputs.split(), "ERROR", "ERRORID"}, name)
            self.assertEqual([*block.names("VAR_IN_OUT"), block.types["AXIS"].name], ["AXIS", "CBCAN_AXIS_REF"])

    def test_no_name_is_one_of_a_system(self):
        """Types, blocks and enumerators have the prefix CBCAN_; variables and members are none of the RESERVED."""
        rest = ("p.st", "PROGRAM p VAR x : UINT; END_VAR x := 1; END_PROGRAM"), configuration("p")
        made, before = (Machine(*source("cia405.st", *more), *rest) for more in (("conversions.st", "axis.st"), ()))
        new = {name for table in ("types", "blocks", "enumerators") for name in {*getattr(made, table)} - {*getattr(before, table)}}
        self.assertEqual({name for name in new if not name.startswith("CBCAN_")}, set())
        within = {name for block in new & {*made.blocks} for name in made.blocks[block].types}
        within |= {name for kind in new & {*made.types} if made.types[kind].kind == "struct" for name in made.types[kind].of}
        self.assertGreater(len(within), 70)
        self.assertEqual(within & RESERVED, set())

    def test_enumerations_and_constants(self):
        self.assertEqual(self.machine.types["DEVICE_STATE"].of,
                         "INIT RESET_COMM RESET_APP PRE_OPERATIONAL STOPPED OPERATIONAL UNKNOWN NOT_AVAIL".split())
        self.assertEqual(self.machine.types["SDO_MODE"].of, "AUTO EXPEDITED SEGMENTED BLOCK".split())
        self.assertEqual({name: self.machine.globals[name] for name in self.machine.constants}, {
            "CANOPEN_KERNEL_NO_ERROR": 0, "CANOPEN_KERNEL_OTHER_ERROR": 1, "CANOPEN_KERNEL_DATA_OVERFLOW": 2, "CANOPEN_KERNEL_TIMEOUT": 3,
            "CANOPEN_KERNEL_CANBUS_OFF": 0x10, "CANOPEN_KERNEL_CAN_ERROR_PASSIVE": 0x11, "CANOPEN_INTERNAL_FB_ERROR": 0x21,
            "CANOPEN_NO_MORE_MEMORY": 0x22, "CANOPEN_WRONG_PARAMETER": 0x23, "CANOPEN_NODEID_UNKNOWN": 0x24, "CANOPEN_NETID_UNKNOWN": 0x25,
            "CANOPEN_REQUEST_ERROR": 0x26, "CANOPEN_SDOCHANNEL_UNKNOWN": 0x27, "CANOPEN_NO_DRIVER": 0x28, "CANOPEN_CONFIGURATION_ERROR": 0x29,
            "CANOPEN_GUARDING_ERROR": 0x2A,
            "STOP_REMOTE_NODE": 4, "START_REMOTE_NODE": 5, "RESET_NODE": 6, "RESET_COMMUNICATION": 7, "ENTER_PRE_OPERATIONAL": 0x7F,
            "ALL_EXCEPT_NMT_AND_SENDER": 0x800})
        self.assertEqual(list(self.machine.types["EMCY_ERROR"].of), ["EMCY_ERROR_CODE", "ERROR_REGISTER", "ERROR_FIELD"])


class MotionPage(cases.Case):
    """The tables of docs/reference/axis-blocks.md."""

    def setUp(self):
        (_, self.text), = source("axis.st")
        self.machine = Machine(*source("cia405.st", "conversions.st", "axis.st", "axis_example.st"), configuration("commission"))
        self.page = (ROOT / "docs/reference/axis-blocks.md").read_text()
        self.tables = tables_of(self.page)

    def test_blocks(self):
        common = {"EXECUTE", "BUSY", "ACTIVE", "COMMANDABORTED", "ERROR", "ERRORID"}
        rows = self.tables["Write the program"][0]
        self.assertEqual({items(row[0])[0].upper() for row in rows}, {name for name in self.machine.blocks if name.startswith("CBCAN_MC_")})
        for name, *cells in rows:
            block = self.machine.blocks[items(name)[0].upper()]
            for cell, section in zip(cells, ("VAR_INPUT", "VAR_OUTPUT")):
                self.assertEqual([item.upper() for item in items(cell)], [found for found in block.names(section) if found not in common], name)

    def test_members(self):
        struct = re.search(r"CBCAN_AXIS_REF : STRUCT(.*?)END_STRUCT", self.text, re.DOTALL)[1]
        defaults = dict(re.findall(r"^    ([A-Z]+) : \w+(?: := ([\w#]+))?;", struct, re.MULTILINE))  # internal ones have small letters
        rows = self.tables["Write the program"][1]
        self.assertEqual([name for row in rows for name in items(row[0])], [*defaults])
        for names, shown, _ in rows:
            self.assertEqual(shown, ", ".join(filter(None, (defaults[name] for name in items(names)))), names)

    def test_states_errors_and_words(self):
        self.assertEqual([name for row in self.tables["Behaviour"][0] for name in items(row[0])], self.machine.types["CBCAN_AXIS_STATE"].of)
        codes = {int(code, 16) for code in re.findall(r"(?:ERRORID|ErrorID|trouble) := 16#(\w+);", self.text)} - {0}
        self.assertEqual({int(code, 16) for code in re.findall(r"^\| (\w\w)h \|", self.page, re.MULTILINE)}, codes)
        located = self.machine.programs["MAIN"][0].located
        first, = re.findall(r"`(%IW\d+)` and `(%QW\d+)`", self.page)
        self.assertEqual((located[first[0]], located[first[1]]), ("IN0", "OUT0"))
        openplc = (ROOT / "docs/how-to/plc/openplc.md").read_text()
        self.assertEqual(first, tuple(re.findall(r"^\| \(c\).* `(%[IQ]W\d+)` to", openplc, re.MULTILINE))[::-1])


cases.main()
