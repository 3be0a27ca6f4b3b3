#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""cbcanctl map: each form, read as the maker's tool or another program would, against places calculated by hand.

usage: cbcanctl_map_test.py CBCANCTL
"""

import csv
import hashlib
import io
import re
import shutil
import xml.etree.ElementTree as ElementTree

import cases
from done import ran
from simulator import program_from_arguments
from cbcan_st.machine import Machine
from tree import ROOT

CBCANCTL = program_from_arguments()
PLCOPEN = "{http://www.plcopen.org/xml/tc6_0201}"
HOST = ("--modbus", "192.168.1.5:1502")
FORMS = "csv tia-db xsy logix codesys".split()
PROGRAMS = "tia-db-scl xsy-st codesys-st".split()
IDENTIFIER = re.compile(r"(?=.{1,32}\Z)[A-Za-z][A-Za-z0-9]*(_[A-Za-z0-9]+)*")

DEMO = """[[node]]
id = 66
name = "io"
eds = "io_module.eds"
pdos = [{ tpdo = 1 }, { tpdo = 2 }, { rpdo = 1 }, { rpdo = 2 }]
[[node]]
id = 1
eds = "pressure_transducer.eds"
pdos = [{ tpdo = 1 }]
"""

# Objects of an EDS: index, name, type, further lines.
ODD = (("2001", "1st lamp", "0x0001", ""), ("2002", "Tür \"A\", <B> & 'C' $1 *)", "0x0001", ""), ("2003", "байт", "0x0005", ""),
       ("2004", "IF", "0x0002", ""), ("2005", "END_IF", "0x0005", ""), ("2006", "Temperature of the outer bearing, filtered", "0x0008", ""),
       ("2007", "limits", "0x0003", "LowLimit=-10\nHighLimit=10\n"), ("2008", "raw", "0x001B", ""), ("2009", "if", "0x0004", ""))
MAP = ("[{ index = 0x2001 }, { index = 0x2002 }, { index = 0x2003 }, { index = 0x2007 }]",  # 0, 1, 2..9, 10..25: not aligned
       "[{ index = 0x2004 }, { index = 0x2005 }, { index = 0x2007 }, { index = 0x2006 }]",  # 0..7, 8..15, 16..31, 32..63
       "[{ index = 0x2008 }]",
       "[{ index = 0x2007 }, { index = 0x2009 }]")  # 0..15, 16..47: an odd register


def eds(objects):
    index = "".join(f"{number}=0x{each[0]}\n" for number, each in enumerate(objects, 1))
    return f"[ManufacturerObjects]\nSupportedObjects={len(objects)}\n{index}" + "".join(
        f"[{number}]\nParameterName={name}\nDataType={kind}\nAccessType=rw\nPDOMapping=1\n{more}" for number, name, kind, more in objects)


class Map(cases.Case):
    def setUp(self):
        for file in (*ROOT.glob("plants/demo/*.eds"), ROOT / "tests/descriptions/corpus/compact.eds"):
            shutil.copy(file, self.folder)
        self.write("odd.eds", eds(ODD))
        self.network = DEMO

    def run_ctl(self, *arguments):
        self.write("network.toml", self.network)
        return ran(CBCANCTL, "map", *arguments, cwd=self.folder, text=False)

    def text(self, form, *options, encoding="utf-8"):
        done = self.run_ctl("network.toml", "--for", form, *options, *(HOST if form in PROGRAMS else ()))
        self.assertEqual((done.returncode, done.stderr), (0, b""))
        return done.stdout.decode(encoding)

    def odd(self, words="low-first", maps=MAP):
        pdos = "".join(f"{{ tpdo = {n}, can_id = {0x200 + n}, map = {each} }}, " for n, each in enumerate(maps, 1))
        self.network = f'[network]\nwords = "{words}"\n[[node]]\nid = 5\nname = "END"\neds = "odd.eds"\npdos = [{pdos}]\n'

    def rows(self, form="csv"):
        """CSV by name; every line ends with CRLF."""
        text = self.text(form, encoding="utf-8" if form == "csv" else "ascii")
        self.assertEqual(text.count("\n"), text.count("\r\n"))
        found = list(csv.reader(io.StringIO(text, newline=""), strict=True))
        self.assertEqual({len(row) for row in found[2 * (form == "logix"):]}, {{"csv": 12, "logix": 7}[form]})
        return found

    def objects(self):
        return [row for row in self.rows()[1:] if row[8]]

    def xml(self, form, *options):
        return ElementTree.fromstring(self.text(form, *options).encode())

    def xsy(self, *options):
        root = self.xml("xsy", *options)
        self.assertEqual((root.tag, [part.tag for part in root]), ("VariablesExchangeFile", ["fileHeader", "contentHeader", "dataBlock"]))
        self.assertEqual(sorted(root[0].attrib), sorted("company product dateTime content DTDVersion".split()))
        self.assertEqual((root[0].get("DTDVersion"), sorted(root[1].attrib)), ("41", ["name", "version"]))
        self.assertTrue(all(each.tag == "variables" and each.find("comment").text for each in root[2]))
        return {each.get("name"): (each.get("typeName"), each.get("topologicalAddress")) for each in root[2]}

    def codesys(self, *options):
        root = self.xml("codesys", *options)
        self.assertEqual([part.tag for part in root], [PLCOPEN + name for name in "fileHeader contentHeader types instances addData".split()])
        data, = root[4]
        self.assertEqual(data.get("name"), "http://www.3s-software.com/plcopenxml/globalvars")
        variables, = data
        self.assertEqual(variables.tag, PLCOPEN + "globalVars")
        return {each.get("name"): (each[0][0].tag.removeprefix(PLCOPEN), each.get("address")) for each in variables}


class Forms(Map):
    def test_csv(self):
        rows = self.rows()
        self.assertEqual(rows[0], "Name,Register,Bit,Bits,Type,Direction,Words,Node,Object,Low,High,Comment".split(","))
        self.assertEqual([row[:11] for row in self.objects()], [
            ["io_Inputs_1_to_8", "3800", "0", "8", "USINT", "input", "", "66", "6000h:01", "", ""],
            ["io_Channel_1", "3804", "0", "16", "INT", "input", "", "66", "6401h:01", "", ""],
            ["io_Channel_2", "3805", "0", "16", "INT", "input", "", "66", "6401h:02", "", ""],
            ["io_Outputs_1_to_8", "3864", "0", "8", "USINT", "output", "", "66", "6200h:01", "", ""],
            ["io_Channel_1_6411_01", "3868", "0", "16", "INT", "output", "", "66", "6411h:01", "", ""],
            ["io_Channel_2_6411_02", "3869", "0", "16", "INT", "output", "", "66", "6411h:02", "", ""],
            ["n1_Pressure", "3808", "0", "32", "DINT", "input", "low-first", "1", "9130h:01", "", ""]])
        self.assertEqual(rows[-1][11], "node 1 9130h:01 Pressure")
        status = {row[0]: row[1] for row in rows[1:] if not row[8]}
        self.assertEqual(len(status), 4 + 5 * 2 + 2)  # of five bitmaps those of nodes 0 to 15 and 64 to 79
        self.assertEqual([status[f"cbcan_{name}"] for name in "STATUS STATUS_CHANGES NODE_COUNTS FIRST_NOT_RUNNING HEARD_0 CONFIGURED_4 LOST_4".split()],
                         ["3928", "3929", "3930", "3931", "3932", "3944", "3968"])
        self.assertEqual((status["cbcan_NODE_io"], status["cbcan_NODE_n1"]), (str(3972 + 66), "3973"))

    def test_odd_objects_in_csv(self):
        self.odd()
        rows = self.objects()
        self.assertEqual([row[:5] + row[9:11] for row in rows], [
            ["n5_1st_lamp", "3800", "0", "1", "BOOL", "", ""], ["n5_T_r_A_B_C_1", "3800", "1", "1", "BOOL", "", ""],
            ["n5_o2003_00", "3800", "2", "8", "USINT", "", ""], ["n5_limits", "3800", "10", "16", "INT", "-10", "10"],
            ["n5_IF", "3804", "0", "8", "SINT", "", ""], ["n5_END_IF", "3804", "8", "8", "USINT", "", ""],
            ["n5_limits_2007_00", "3805", "0", "16", "INT", "-10", "10"], ["n5_Temperature_of_the_outer_b", "3806", "0", "32", "REAL", "", ""],
            ["n5_raw", "3808", "0", "64", "ULINT", "", ""], ["n5_limits_2", "3812", "0", "16", "INT", "-10", "10"],
            ["n5_if_2009_00", "3813", "0", "32", "DINT", "", ""]])
        self.assertEqual(rows[1][11], "node 5 2002h:00 Tür \"A\", <B> & 'C' $1 *)")
        self.assertEqual(rows[3][11], "node 5 2007h:00 limits [-10..10]")

    def test_words_that_are_exchanged(self):
        self.network = self.network.replace("[[node]]", '[network]\nwords = "high-first"\n[[node]]', 1)
        self.assertEqual([row[6] for row in self.rows() if row[0] == "n1_Pressure"], ["high-first"])
        for variables, low, high in ((self.xsy(), ("INT", "%MW109"), ("INT", "%MW108")), (self.codesys(), ("WORD", "%MW9"), ("WORD", "%MW8"))):
            self.assertNotIn("n1_Pressure", variables)
            self.assertEqual((variables["n1_Pressure_w0"], variables["n1_Pressure_w1"]), (low, high))
        self.assertIn("  n1_Pressure : DInt;", self.text("tia-db"))

    def test_a_data_block_of_siemens(self):
        """Members are where the rules of a block with standard access have them: bits, then bytes, then words at even bytes."""
        for network in ("demo", "odd", "one bit"):
            if network != "demo":
                self.odd(maps=MAP if network == "odd" else ("[{ index = 0x2001 }]", "[{ index = 0x2004 }, { index = 0x2001 }]"))
            lines = self.text("tia-db", encoding="ascii").splitlines()
            self.assertEqual(lines[:3], ['DATA_BLOCK "cbcan"', "{ S7_Optimized_Access := 'FALSE' }", "VERSION : 0.1"])
            self.assertEqual(lines[-3:], ["END_STRUCT;", "BEGIN", "END_DATA_BLOCK"])
            bit, places, left_out = 0, {}, []
            for line in lines[lines.index("STRUCT") + 1:-3]:
                comment, name, array, kind = re.fullmatch(r"(//)?  (\w+) : (?:Array\[0\.\.(\d+)\] of )?(\w+);(?:  //.*)?", line).groups()
                bits = {"Bool": 1, "Byte": 8, "USInt": 8, "SInt": 8, "DInt": 32}.get(kind, 16) * (int(array or 0) + 1)
                bit += -bit % min(bits, 16)
                if comment:
                    left_out.append(name)
                else:
                    places[name], bit = (3800 + bit // 16, (bit % 16) ^ 8 if bits < 16 else 0), bit + bits
            self.assertEqual(bit % 16, 0)
            wanted = {name: (int(register), int(first)) for name, register, first, *_ in self.rows()[1:]}
            single = {name: place for name, place in places.items() if not re.search(r"_w\d\Z|\Aspare", name)}
            self.assertGreaterEqual(len(single), 12)
            for name, place in single.items():
                self.assertEqual(place, (wanted[name][0], wanted[name][1] if name != "n5_o2003_00" else 0), name)
            if network == "odd":
                self.assertEqual((places["n5_Temperature_of_the_outer_b_w1"], places["n5_raw_w3"]), ((3807, 0), (3811, 0)))
                self.assertEqual(left_out, ["n5_limits_w0", "n5_1st_lamp", "n5_T_r_A_B_C_1"])  # they share R3800 with n5_o2003_00
        self.assertIn("//This block has number 77 ", self.text("tia-db", "--at", "77"))

    def test_control_expert(self):
        variables = self.xsy()
        self.assertEqual({kind for kind, _ in variables.values()}, {"INT"})
        self.assertEqual([variables[name][1] for name in ("io_Inputs_1_to_8", "io_Channel_1", "n1_Pressure_w0", "n1_Pressure_w1", "cbcan_STATUS", "cbcan_active")],
                         ["%MW100", "%MW104", "%MW108", "%MW109", "%MW228", "%MW400"])
        self.odd()
        comments = {each.get("name"): each[0].text for each in self.xml("xsy")[2]}
        self.assertEqual(comments["n5_T_r_A_B_C_1"], "node 5 2002h:00 Tür \"A\", <B> & 'C' $1 *) (bit 1)")
        self.assertEqual(comments["n5_limits_w0"], "node 5 2007h:00 limits [-10..10] (its bits 0..5 from bit 10 on)")
        self.assertEqual(comments["n5_limits_w1"], "node 5 2007h:00 limits [-10..10] (its bits 6..15 from bit 0 on)")
        self.assertEqual(comments["cbcan_RUNNING_0"], "nodes 0 to 15: it is listed and Operational")

    def test_logix(self):
        self.odd()
        rows = self.rows("logix")
        self.assertEqual(rows[:3], [["remark", "CSV-Import-Export"], ["0.3"], "TYPE,SCOPE,NAME,DESCRIPTION,DATATYPE,SPECIFIER,ATTRIBUTES".split(",")])
        self.assertEqual(rows[3], ["TAG", "", "cbcan_in_words", "R3800", "INT[64]", "", "(RADIX := Decimal)"])
        aliases = {row[2]: row[5] for row in rows[3:] if row[0] == "ALIAS"}
        self.assertEqual([aliases[f"n5_{name}"] for name in ("1st_lamp", "T_r_A_B_C_1", "IF", "END_IF", "raw_w3")],
                         ["cbcan_in_words[0].0", "cbcan_in_words[0].1", "cbcan_in_words[4]", "cbcan_in_words[4]", "cbcan_in_words[11]"])
        self.assertEqual((aliases["cbcan_LOST_0"], aliases["cbcan_NODE_n5"]), ("cbcan_status_words[36]", "cbcan_states[5]"))
        self.assertEqual([row[3] for row in rows[3:] if row[2] == "n5_T_r_A_B_C_1"], ["node 5 2002h:00 T_r _A_; <B> & _C_ _1 _)"])
        self.assertEqual([row[3] for row in rows[3:] if row[2] == "n5_END_IF"], ["node 5 2005h:00 END_IF (its bits 0..7 from bit 8 on)"])
        sizes = {row[2]: int(row[4][4:-1]) for row in rows[3:] if row[0] == "TAG"}
        for alias in aliases.values():
            array, index = re.match(r"(\w+)\[(\d+)\]", alias).groups()
            self.assertLess(int(index), sizes[array])

    def test_codesys(self):
        variables = self.codesys()
        self.assertEqual([variables[name] for name in ("cbcan_in_words", "cbcan_out_words", "cbcan_status_words", "cbcan_states", "io_Channel_1", "n1_Pressure")],
                         [("array", "%MW0"), ("array", "%MW64"), ("array", "%MW128"), ("array", "%MW172"), ("INT", "%MW4"), ("DINT", "%MD4")])
        self.odd()
        variables = self.codesys("--at", "10")
        self.assertEqual([variables[f"n5_{name}"] for name in ("1st_lamp", "END_IF", "Temperature_of_the_outer_b", "raw_w0", "if_2009_00_w0")],
                         [("BOOL", "%MX20.0"), ("USINT", "%MB29"), ("REAL", "%MD8"), ("WORD", "%MW18"), ("WORD", "%MW23")])
        self.assertEqual(self.codesys("--at", "11")["n5_if_2009_00"], ("DINT", "%MD12"))


class Places(Map):
    def test_existing_files_keep_their_registers(self):
        """Tags, without their comments, and programs as they were when a PDO could only have four registers."""
        for line in (ROOT / "tests/tools/maps.sha256").read_text().splitlines():
            digest, file, form = line.split()
            done = ran(CBCANCTL, "map", ROOT / file, "--for", form, *(HOST if form in PROGRAMS else ()), text=False)
            plain = re.sub(rb',"[^\r]*"\r\n', b"\r\n", done.stdout)
            self.assertEqual((hashlib.sha256(plain).hexdigest(), done.stderr), (digest, b""), line)

    def test_packed(self):
        """An object of 8 bits in each byte, 16 bits at each register, 32 bits at each even one; what has no 64 bits left is not divided."""
        self.odd(maps=("[{ index = 0x2003 }]", "[{ index = 0x2001 }, { index = 0x2002 }]", "[{ index = 0x2003 }]", "[{ index = 0x2007 }, { index = 0x2003 }]",
                       "[{ index = 0x2009 }]", "[{ index = 0x2004 }]", "[{ index = 0x2008 }]", "[{ index = 0x2004 }]"))
        self.network = self.network.replace("words", 'place = "packed"\nwords')
        self.assertEqual([row[1:4] for row in self.objects()],
                         [["3800", "0", "8"], ["3800", "8", "1"], ["3800", "9", "1"], ["3801", "0", "8"], ["3802", "0", "16"], ["3803", "0", "8"],
                          ["3804", "0", "32"], ["3806", "0", "8"], ["3808", "0", "64"], ["3812", "0", "8"]])

    def test_further_registers(self):
        """Twenty-five nodes with one PDO each way: 16 x 4 registers, then R100.., outputs R292..; requests have 96 registers at most."""
        self.network = "[network]\nfurther_first = 100\n" + "".join(
            f'[[node]]\nid = {n}\neds = "io_module.eds"\npdos = [{{ tpdo = 1 }}, {{ rpdo = 2 }}]\n' for n in range(1, 42))
        rows = self.objects()
        self.assertEqual([row[1] for row in rows if row[7] in ("16", "17", "41")], ["3860", "3924", "3925", "100", "292", "293", "196", "388", "389"])
        requests = [("43801", "64", "0"), ("43865", "64", "128"), ("43929", "44", "256"), ("43973", "42", "344"),
                    ("40101", "96", "640"), ("40197", "1", "832"), ("40293", "96", "1024"), ("40389", "2", "1216")]
        self.assertEqual(re.findall(r"MB_DATA_ADDR := (\d+), MB_DATA_LEN := (\d+), MB_DATA_PTR := P#DB10.DBX(\d+)", self.text("tia-db-scl")), requests)
        self.assertEqual([self.xsy()[name][1] for name in ("n16_Inputs_1_to_8", "n17_Inputs_1_to_8", "n41_Channel_2")], ["%MW160", "%MW420", "%MW709"])
        self.assertIn('ALIAS,,n41_Channel_2,"node 41 6411h:02 Channel 2","","cbcan_out_words_3[1]",""', self.text("logix"))


class Names(Map):
    def names(self, form):
        if form in ("csv", "logix"):
            column = {"csv": 0, "logix": 2}[form]
            return [row[column] for row in self.rows(form)[3 if form == "logix" else 1:]]
        pattern = {"tia-db": r"(?m)^(?://)?  (\w+) :", "xsy": r'<variables name="(.*?)"', "codesys": r'<variable name="(.*?)"'}[form]
        return re.findall(pattern, self.text(form))

    def check(self, least):
        for form in FORMS:
            names = self.names(form)
            self.assertGreaterEqual(len(names), least, form)
            self.assertEqual([name for name in names if not IDENTIFIER.fullmatch(name)], [], form)
            self.assertEqual(len({name.upper() for name in names}), len(names), form)

    def test_of_many_nodes(self):
        """16 nodes with one name and 4 objects with one name each; 110 more without PDOs."""
        node = '[[node]]\nid = {}\neds = "compact.eds"\nidentity = []\n{}'
        mapped = ", ".join(f"{{ index = 0x{index}, sub = {sub} }}" for index in (2000, 2001) for sub in (1, 2))
        self.network = "".join(node.format(n, f'name = "{"feed pump" if n % 2 else "Feed-Pump"}"\n' f"pdos = [{{ rpdo = 1, can_id = {0x200 + n}, map = [{mapped}] }}]\n") for n in range(1, 17))
        self.network += "".join(node.format(n, "") for n in range(17, 127))
        self.check(44 + 126 + 64)
        names = [row[0] for row in self.objects()]
        self.assertEqual(names[:5], ["feed_pump_Channel", "feed_pump_Channel_2000_02", "feed_pump_Channel_2001_01", "feed_pump_Channel_2001_02", "Feed_Pump_Channel_2000_01"])
        self.assertEqual(self.names("csv"), self.names("csv"))
        self.assertEqual({(row[8][:4], *row[9:11]) for row in self.objects()}, {("2000", "1", "512"), ("2001", "", "")})

    def test_of_odd_objects_and_nodes(self):
        self.odd()
        self.check(20)
        for node, name in (("r", "n5"), ("INT", "n5"), ("7 up", "n7_up"), ("насос", "n5"), ("cbcan", "n5"), ("a_long_name_of_a_pump", "a_long_name"), ("__x__y__", "x_y")):
            self.odd()
            self.network = self.network.replace('name = "END"', f'name = "{node}"')
            self.check(20)
            self.assertIn(f"{name}_IF", self.names("csv"))

    def test_parts_and_objects_do_not_meet(self):
        objects = [("2001", "value", "0x0007", ""), ("2002", "value_w0", "0x0005", ""), ("2003", "VALUE W1", "0x0005", "")]
        self.write("odd.eds", eds(objects))
        self.odd(maps=["[{ index = 0x2001 }, { index = 0x2002 }, { index = 0x2003 }]"])
        self.check(13)


class Programs(Map):
    def page(self, name):
        """{(function code, start): words} of the jobs (c) and (d) of a page."""
        text = (ROOT / f"docs/how-to/plc/{name}.md").read_text()
        return {(int(code), int(start)): int(words) for job, code, start, words in re.findall(r"^\| (.*?) \| (\d+) \| (\d+) \| 4\d+ \| (\d+) \|", text, re.MULTILINE)
                if int(start) >= 3800}

    def test_siemens(self):
        steps = re.compile(r"    (\d):\n      #client\(REQ := #request, DISCONNECT := FALSE, MB_MODE := ([01]), MB_DATA_ADDR := 4(\d{4}), MB_DATA_LEN := (\d+), "
                           r"MB_DATA_PTR := (P#\S+ WORD \d+), CONNECT := #module\);")
        page = self.page("siemens")
        text = self.text("tia-db-scl", encoding="ascii")
        found = steps.findall(text)
        self.assertEqual([step[0] for step in found], list("0123"))
        self.assertEqual({(16 if mode == "1" else 3, int(number) - 1): int(words) for _, mode, number, words, _ in found}, {**page, (3, 3972): 67})
        self.assertEqual([step[4] for step in found], [f"P#DB10.DBX{first}.0 WORD {words}" for first, words in ((0, 64), (128, 64), (256, 44), (344, 67))])
        self.assertIn("#job := (#job + 1) MOD 4;", text)
        self.assertEqual(re.findall(r"ADDR\[(\d)\] := (\d+);|RemotePort := (\d+);", text), [("1", "192", ""), ("2", "168", ""), ("3", "1", ""), ("4", "5", ""), ("", "", "1502")])

    def test_control_expert(self):
        text, page = self.text("xsy-st", "--at", "200", encoding="ascii"), self.page("schneider")
        module = r"ADDM\('0\.0\.3\{192\.168\.1\.5\}'\), '%MW'"
        reads = re.findall(rf"READ_VAR\({module}, (\d+), (\d+), %MW500:4, %MW(\d+):(\d+)\);", text)
        writes = re.findall(rf"cbcan_length := (\d+);\n      WRITE_VAR\({module}, (\d+), (\d+), %MW(\d+):(\d+), %MW500:4\);", text)
        self.assertEqual(reads, [("3800", "64", "200", "64"), ("3928", "44", "328", "44"), ("3972", "67", "372", "67")])
        self.assertEqual(writes, [("128", "3864", "64", "264", "64")])
        self.assertEqual({start: words for (_, start), words in page.items()}, {3864: 64, 3800: 64, 3928: 44})
        addresses = self.xsy("--at", "200")
        self.assertEqual([addresses[f"cbcan_{name}"][1] for name in ("active", "report", "timeout", "length")], [f"%MW{500 + n}" for n in range(4)])

    def test_codesys(self):
        channels = re.findall(r"^   (\d): (Read Holding|Write Multiple) Registers, offset (\d+), length (\d+): (\w+)$", self.text("codesys-st"), re.MULTILINE)
        self.assertEqual({(3 if kind.startswith("Read") else 16, int(start)): int(words) for _, kind, start, words, _ in channels}, {**self.page("codesys"), (3, 3972): 67})
        arrays = self.codesys()
        self.assertEqual([(number, arrays[name]) for number, *_, name in channels],
                         [("0", ("array", "%MW0")), ("1", ("array", "%MW64")), ("2", ("array", "%MW128")), ("3", ("array", "%MW172"))])

    def test_codesys_in_the_interpreter(self):
        """With a channel that takes two scans and fails once. The interpreter has neither INT nor names of libraries; the device is an input here."""
        channel = """FUNCTION_BLOCK ModbusChannel
VAR_INPUT slave : UINT; xExecute : BOOL; xAbort : BOOL; iChannelIndex : UINT; END_VAR
VAR_OUTPUT xDone : BOOL; xError : BOOL; END_VAR
VAR before : BOOL; starts : UINT; last : UINT; END_VAR
  xDone := FALSE; xError := FALSE;
  IF xExecute AND before THEN
    IF starts = 3 THEN xError := TRUE; ELSE xDone := TRUE; END_IF;
  END_IF;
  IF xExecute AND NOT before THEN starts := starts + 1; last := last * 10 + iChannelIndex; END_IF;
  before := xExecute;
END_FUNCTION_BLOCK
"""
        text = self.text("codesys-st")
        for old, new in (("IoDrvModbusTCP.ModbusChannel", "ModbusChannel"), (": INT;", ": UINT;"), ("cbcan_module, x", "0, x")):
            self.assertEqual(text.count(old), 1, old)
            text = text.replace(old, new)
        configuration = "CONFIGURATION c RESOURCE r ON PLC TASK t (INTERVAL := T#10ms, PRIORITY := 0); PROGRAM main WITH t : cbcan_exchange; END_RESOURCE END_CONFIGURATION\n"
        machine = Machine(("channel.st", channel), ("exchange.st", text), ("c.st", configuration))
        for now in range(15):
            machine.scan(now * 10000)
        values = machine.programs["MAIN"][1]
        self.assertEqual((values["CHANNEL"]["LAST"], values["CHANNEL"]["STARTS"], values["FAILURES"]), (1230, 5, 1))

    def test_only_the_requests_that_tags_need(self):
        self.network = '[[node]]\nid = 126\nname = "last"\n'
        self.assertEqual(re.findall(r"MB_DATA_ADDR := (\d+), MB_DATA_LEN := (\d+)", self.text("tia-db-scl")), [("43929", "44"), ("43973", "125"), ("44098", "2")])
        self.assertIn("cbcan_last_states[1]", self.text("logix"))
        self.network = ""
        self.assertEqual(re.findall(r"MB_DATA_ADDR := (\d+), MB_DATA_LEN := (\d+)", self.text("tia-db-scl")), [("43929", "44")])


class Page(Map):
    def test_tables_of_the_page(self):
        """First addresses, and which form has one variable for a value with 32 bits, in each order."""
        page = (ROOT / "docs/reference/cbcanctl.md").read_text().partition("## map")[2]
        rows = re.findall(r"^\| `(\S+)` \| [^|]* \| (?:`(.*?)`|R3800|byte 0) \| ([^|]*) \|$", page, re.MULTILINE)
        self.assertEqual([name for name, *_ in rows], FORMS)
        self.assertEqual(re.findall(r"^\| `(\S+)` \| [^|]* \| [^|]* \|$", page, re.MULTILINE), PROGRAMS)
        self.write("odd.eds", eds([("2001", "first", "0x0006", ""), ("2002", "pad", "0x0006", ""), ("2003", "value", "0x0007", "")]))
        for name, address, doubles in rows:
            for order in ("low-first", "high-first"):
                self.odd(order, ["[{ index = 0x2001 }, { index = 0x2002 }, { index = 0x2003 }]"])
                text = self.text(name)
                one = order in doubles.partition(", else")[0] or name == "csv"
                self.assertEqual([bool(re.search(pattern, text)) for pattern in (r"n5_value\b", "n5_value_w0")], [one, not one], (name, order))
                first, = [line for line in text.splitlines() if "n5_first" in line]
                self.assertIn(address, first)


class Mistakes(Map):
    def check(self, error, *arguments):
        done = self.run_ctl(*arguments)
        self.assertEqual((done.returncode, done.stdout), (2, b""))
        self.assertEqual(done.stderr.decode(), f"cbcanctl: {error}\n")

    def test_of_the_command(self):
        self.check("--for is missing: " + ", ".join(FORMS + PROGRAMS[:-1]) + " or codesys-st", "network.toml")
        self.check("--at 5: --for csv has no addresses; leave it out", "network.toml", "--for", "csv", "--at", "5")
        self.check("--at 5: --for codesys-st has no addresses; leave it out", "network.toml", "--for", "codesys-st", "--at", "5")
        for host in ("127.0.0.1", "plc.example"):
            self.check(f"--modbus {host}: --for xsy-st needs the module's IPv4 address in the PLC's network, such as --modbus 192.168.1.5",
                       "network.toml", "--for", "xsy-st", "--modbus", host)

    def test_of_the_file(self):
        self.network = DEMO.replace("tpdo = 2", "tpdo = 9")
        self.check("network.toml:5: node 66: TPDO 9: maps nothing: add map = [...]", "network.toml", "--for", "csv")
        done = self.run_ctl("network.toml", "--for", "csv", "--json")
        self.assertEqual((done.returncode, done.stdout), (2, b'{"error": "--json: leave it out; --for csv is for programs"}\n'))
        done = self.run_ctl("nowhere.toml", "--for", "csv")
        self.assertEqual((done.returncode, b"nowhere.toml" in done.stderr), (2, True))


cases.main()
