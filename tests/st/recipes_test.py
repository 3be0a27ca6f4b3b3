#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""docs/ladder.md: its recipes are carried out, and have the outputs of the function blocks."""

from st_bench import BUS_OFF, ERROR_PASSIVE, OTHER, TIMEOUT, BlockTest
import cases
from plc import ROOT
from recipes import Recipes, tables_of

BLOCKS = ("NMT RECV_EMCY RECV_EMCY_DEV GET_LOCAL_NODE_ID GET_CANOPEN_KERNEL_STATE GET_STATE "
          "SDO_READ SDO_READ4 SDO_WRITE SDO_WRITE4").split()
NODE, ABSENT = 0x20, 99


class Page(BlockTest):
    options = ("--demo", "--slcan", "127.0.0.1:0")

    def setUp(self):
        super().setUp()
        self.recipes = Recipes(self.plc)

    def run_block(self, name, **inputs):
        """The outputs of the Structured Text, named as the recipes name them."""
        name = {"SDO_READ": "SDO_READ_BUFFER", "SDO_WRITE": "SDO_WRITE_BUFFER"}.get(name, name)
        inputs = dict(inputs)
        if "MODE" in inputs:
            inputs["MODE"] = self.plc.machine.types["SDO_MODE"].of[inputs["MODE"]]
        if "DATA" in inputs:
            inputs["DATA"] = (inputs["DATA"] + [0] * 128)[:4 if name == "SDO_WRITE4" else 128]
        block = self.plc.block(name, ENABLE=True, **inputs)
        self.plc.run(block)
        self.plc.called.clear()
        found = {output: block[output] for output in block.block.names("VAR_OUTPUT", "VAR_IN_OUT")}
        field = found.pop("ERRORINFO", 0)
        if isinstance(field, dict):
            found.update({k: v for k, v in field.items() if k != "ERROR_FIELD"})
            found.update({f"ERROR_FIELD[{i + 1}]": value for i, value in enumerate(field["ERROR_FIELD"])})
        else:
            found["ERRORINFO"] = field
        if name == "GET_STATE":
            found["STATE"] = self.plc.machine.types["DEVICE_STATE"].of.index(found["STATE"])
        if "DATA" in found:
            found["DATA"] = found["DATA"][:found["DATALENGTH"]] if found["CONFIRM"] and name != "SDO_WRITE_BUFFER" else None
        if "DATALENGTH" in found and not found["CONFIRM"]:
            del found["DATALENGTH"]
        return {output: value for output, value in found.items() if value not in (0, False, None)}

    def check(self, name, expected, **inputs):
        """The same outputs by recipe and by block; those that are not in either are 0."""
        by_recipe = {output: value for output, value in self.recipes.run(name, **inputs).items() if value not in (0, False)}
        self.assertEqual({output: by_recipe.get(output) for output in expected}, expected)
        self.plc.machine.globals["CBCAN"].update(SDO_TIMEOUT=0xFFFFFFFF, SDO_MODE=255)
        self.assertEqual(by_recipe, self.run_block(name, **inputs), name)

    def test_every_block_has_one(self):
        tables = tables_of((ROOT / "docs/ladder.md").read_text())
        for name in BLOCKS:
            self.assertEqual([bool(table) for table in tables[name]], [True, True], name)
            self.assertEqual({len(row) for row in tables[name][0]}, {8}, name)

    def test_nmt(self):
        for device, state, frame in ((NODE, 5, "000#0120"), (0, 4, "000#0200"), (NODE, 127, "000#8020"), (NODE, 6, "000#8120"), (0, 7, "000#8200")):
            self.new_frames()
            self.check("NMT", {"CONFIRM": True}, DEVICE=device, STATE=state)
            self.assertEqual([text for text in self.new_frames() if text.startswith("000#")], [frame, frame])

    def test_emcy(self):
        self.check("RECV_EMCY", {"CONFIRM": True})
        self.check("RECV_EMCY_DEV", {"CONFIRM": True}, DEVICE=0x10)
        self.check("RECV_EMCY_DEV", {"CONFIRM": True}, DEVICE=0)
        for frame, code in (("090#1122334455667788", 0x2211), ("090#0022334455667788", 0x2200), ("090#1100334455667788", 0x0011)):
            self.send(frame)
            rest = {"EMCY_ERROR_CODE": code, "ERROR_REGISTER": 0x33, **{f"ERROR_FIELD[{i}]": 0x33 + 0x11 * i for i in range(1, 6)}}
            self.check("RECV_EMCY", {"ERROR": OTHER, "DEVICE": 0x10, **rest})
            self.check("RECV_EMCY_DEV", {"ERROR": OTHER, **rest}, DEVICE=0x10)
        self.send("090#0000334455667788")
        del rest["EMCY_ERROR_CODE"]
        self.check("RECV_EMCY_DEV", {"CONFIRM": True, **rest}, DEVICE=0x10)

    def test_node_id_and_kernel(self):
        self.check("GET_LOCAL_NODE_ID", {"CONFIRM": True, "DEVICE": 127})
        for fault, state in ((None, None), ("bus-off", BUS_OFF), ("error-passive", ERROR_PASSIVE)):
            if fault:
                self.plc.command(f"fault bus {fault}")
            self.check("GET_CANOPEN_KERNEL_STATE", {"CONFIRM": True, "STATE": state, "DEVICE": 127})
            self.plc.command("clear bus")

    def test_states(self):
        self.plc.transaction(5066, 0, 0x1016, 1, 4, 500, NODE)
        self.plc.transaction(5066, NODE, 0x1017, 0, 2, 100)
        for service, state in ((5, 5), (4, 4), (127, 3)):
            self.plc.transaction(5066, 0, 0x1F82, NODE, 1, service)
            self.plc.pass_time(200000)
            self.check("GET_STATE", {"CONFIRM": True, "STATE": state}, DEVICE=NODE)
        self.check("GET_STATE", {"CONFIRM": True, "STATE": 3}, DEVICE=0)
        self.check("GET_STATE", {"CONFIRM": True, "STATE": 6}, DEVICE=ABSENT)

    def test_sdo(self):
        data = [1, 2, 3, 4, 5]
        for mode in range(4):
            size = 4 if mode == 1 else 5
            self.check("SDO_WRITE", {"CONFIRM": True}, DEVICE=NODE, INDEX=0x2000 + size, DATA=data[:size], DATALENGTH=size, MODE=mode)
            self.check("SDO_READ", {"CONFIRM": True, "DATALENGTH": size, "DATA": data[:size]}, DEVICE=NODE, INDEX=0x2000 + size, DATALENGTH=128)
        self.check("SDO_WRITE4", {"CONFIRM": True}, DEVICE=NODE, INDEX=0x2003, DATA=data[:3], DATALENGTH=3)
        self.check("SDO_READ4", {"CONFIRM": True, "DATALENGTH": 3, "DATA": [1, 2, 3]}, DEVICE=NODE, INDEX=0x2003)

    def test_the_time_out_is_written_when_it_is_new(self):
        """Both rows once, then not again; counted by what else has been written there."""
        self.recipes.run("SDO_READ4", DEVICE=NODE, INDEX=0x2001, TIMEOUT=300)
        self.assertEqual(self.recipes.written, {"3003h": 300, "3004h": 0})
        self.plc.transaction(5066, 0, 0x3003, 0, 2, 77)
        self.recipes.run("SDO_READ4", DEVICE=NODE, INDEX=0x2001, TIMEOUT=300)
        self.plc.transaction(5055, 0, 0x3003, 0, 2)
        self.assertEqual(self.plc.window.read(3706, 1), [77])

    def test_failures(self):
        self.check("SDO_READ4", {"ERROR": OTHER, "ERRORINFO": 0x06020000}, DEVICE=NODE, INDEX=0x5000)
        self.check("SDO_WRITE", {"ERROR": OTHER, "ERRORINFO": 0x06010000}, DEVICE=NODE, INDEX=0x2005, DATA=[0] * 5, DATALENGTH=5, MODE=1)
        for fault, error in ((None, TIMEOUT), ("bus-off", BUS_OFF), ("error-passive", ERROR_PASSIVE)):
            if fault:
                self.plc.command(f"fault bus {fault}")
            for name, inputs in (("SDO_READ", {"DATALENGTH": 4}), ("SDO_READ4", {}), ("SDO_WRITE4", {"DATA": [0], "DATALENGTH": 1})):
                self.check_error(name, error, DEVICE=ABSENT, INDEX=0x1000, TIMEOUT=20, **inputs)
            self.plc.command("clear bus")

    def check_error(self, name, error, **inputs):
        """Whether the module's abort or the PLC's timer is first, and so ERRORINFO, depends on the scan."""
        self.assertEqual(self.recipes.run(name, **inputs)["ERROR"], error)
        self.plc.pass_time(100000)
        self.assertEqual(self.run_block(name, **inputs)["ERROR"], error)
        self.plc.pass_time(100000)

    def test_a_time_out_of_nmt(self):
        self.plc.command("fault bus bus-off")
        self.check("NMT", {"ERROR": BUS_OFF}, STATE=5, TIMEOUT=50)
        self.plc.transaction(5066, 0, 0x3003, 0, 2, 20)
        self.check("NMT", {"ERROR": BUS_OFF}, STATE=5)


cases.main()
