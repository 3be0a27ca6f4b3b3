#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""PLCopen XML: the output of tools/st/plcopen follows the schema and has every word of the files; figure 1 of the PLC
interface, as its XML and as the steps of docs/reference/ladder-recipes.md, starts all nodes.

usage: plcopen_test.py SIMULATOR
"""

import collections
import re
import xml.etree.ElementTree as ElementTree

from st_bench import PROGRAM
import cases
from done import done, output
from plc import LIBRARY, ROOT, Plant
from recipes import items, tables_of

PLCOPEN, XHTML = "{http://www.plcopen.org/xml/tc6_0201}", "{http://www.w3.org/1999/xhtml}"
LD = "leftPowerRail rightPowerRail contact coil block inVariable outVariable"
# Children in the order of tc6_xml_v201.xsd, and required attributes.
ORDER = {
    "project": "fileHeader contentHeader types instances addData", "fileHeader": "", "contentHeader": "Comment coordinateInfo",
    "coordinateInfo": "fbd ld sfc", "fbd": "scaling", "ld": "scaling", "sfc": "scaling", "scaling": "", "Comment": "",
    "types": "dataTypes pous", "dataTypes": "dataType", "dataType": "baseType initialValue documentation", "pous": "pou",
    "pou": "interface body documentation", "body": "ST LD", "enum": "values", "values": "value", "value": "", "struct": "variable",
    "array": "dimension baseType", "dimension": "", "pointer": "baseType", "derived": "", "initialValue": "simpleValue", "simpleValue": "",
    "instances": "configurations", "configurations": "configuration", "configuration": "resource globalVars", "resource": "task",
    "task": "pouInstance", "pouInstance": "", "addData": "data", "data": "globalVars", "position": "", "relPosition": "", "expression": "",
    "connectionPointIn": "relPosition connection", "connectionPointOut": "relPosition", "connection": "position",
    "leftPowerRail": "position connectionPointOut", "rightPowerRail": "position connectionPointIn",
    "contact": "position connectionPointIn connectionPointOut variable", "coil": "position connectionPointIn connectionPointOut variable",
    "block": "position inputVariables inOutVariables outputVariables", "inOutVariables": "", "inputVariables": "variable",
    "outputVariables": "variable", "inVariable": "position connectionPointOut expression",
    "outVariable": "position connectionPointIn expression"}
ELEMENTARY = "BOOL BYTE WORD DWORD USINT UINT UDINT SINT INT DINT REAL TIME".split()
KEYWORDS = ("TYPE ARRAY OF STRUCT POINTER TO FUNCTION FUNCTION_BLOCK PROGRAM CONFIGURATION RESOURCE ON PLC TASK INTERVAL PRIORITY WITH AT CONSTANT VAR "
            "VAR_INPUT VAR_OUTPUT VAR_IN_OUT VAR_EXTERNAL VAR_GLOBAL cyclic").split()
KEYWORDS += [f"END_{word}" for word in KEYWORDS]
LISTS = "localVars inputVars outputVars inOutVars externalVars globalVars".split()
ATTRIBUTES = {"fileHeader": "companyName productName productVersion creationDateTime", "contentHeader": "name", "dataType": "name",
              "pou": "name pouType", "dimension": "lower upper", "derived": "name", "value": "name", "task": "name priority",
              "pouInstance": "name typeName", "data": "name handleUnknown", "configuration": "name", "resource": "name",
              "scaling": "x y", "position": "x y", "relPosition": "x y", "connection": "refLocalId",
              **{name: "localId" for name in LD.split()}, "block": "localId typeName"}


def kind(element):
    return element.tag.split("}")[1]


def texts(root):
    """Everything that a file in ST contains too."""
    for element in root.iter():
        if kind(element) in ELEMENTARY:
            yield kind(element)
        if kind(element) not in ("contentHeader", "globalVars"):
            yield from (element.get(name, "") for name in ("name", "typeName", "lower", "upper", "address", "interval", "priority"))
        yield element.get("value", "") if kind(element) == "simpleValue" else element.text or ""


def words(*texts):
    """The count of each name and number; the XML has no keywords outside bodies, and a task's name only once."""
    return collections.Counter(re.findall(r"[%\w#]+", " ".join(texts))) - collections.Counter(dict.fromkeys(KEYWORDS, 1000))


def broken_rules(element, parent=""):
    name, children = kind(element), [kind(child) for child in element]
    if name in ("ST", "documentation"):
        return [] if [child.tag.startswith(XHTML) for child in element] == [True] else [f"{name}: no XHTML"]
    if parent in ("type", "baseType", "returnType") and name not in ORDER:  # an elementary type
        return [] if not children else [f"{name}: an elementary type"]
    if name == "variable" and parent in ("contact", "coil"):
        return [] if element.text else ["a contact or coil without a variable"]
    order = {"variable": "connectionPointIn connectionPointOut" if parent.endswith("Variables") else "type initialValue documentation",
             "interface": "returnType", "LD": LD, **dict.fromkeys(("type", "baseType", "returnType"), " ".join(children)),
             **dict.fromkeys(LISTS, "variable"), **ORDER}[name].split()
    if name in ("interface", "LD"):  # one of several, repeatedly
        order += LISTS
        found = [f"{name}: {child} does not belong here" for child in children if child not in order]
    else:
        found = [] if children == sorted(children, key=order.index) and set(children) <= set(order) else [f"{name}: {children}"]
    required = ATTRIBUTES.get(name, "name" if name == "variable" and not parent.endswith("Variables") else "")
    found += [f"{name}: no {attribute}" for attribute in required.split() if element.get(attribute) is None]
    return found + [rule for child in element for rule in broken_rules(child, name)]


class Files(cases.Case):
    def test_every_word_of_the_st_is_there(self):
        for path in sorted(LIBRARY.glob("*.st")):
            with self.subTest(path.name):
                self.assertEqual(words(*texts(ElementTree.fromstring(output(LIBRARY / "plcopen", "--beremiz", path)))), words(path.read_text()))

    def test_the_rules_of_the_schema(self):
        for files in (["cia405.st", "conversions.st", "axis.st", "cia405_codesys.st", "scanner.st", "configuration.st"],
                      ["--beremiz", "cia405.st", "conversions.st", "axis.st", "scanner.st", "openplc.st", "example.st", "configuration.st"]):
            root = ElementTree.fromstring(output(LIBRARY / "plcopen", *files, cwd=LIBRARY))
            self.assertEqual(broken_rules(root), [])
            names = [element.get("name") for element in root.iter() if kind(element) in ("dataType", "pou")]
            self.assertEqual(len(names), len(set(names)))
            used = {element.get("name") for element in root.iter(f"{PLCOPEN}derived")}
            self.assertLessEqual(used, {*names, "TON"})
            lists = [(element.get("name"), element.get("constant"), len(element)) for element in root.iter(f"{PLCOPEN}globalVars")]
            self.assertEqual(lists, [("cbcan_globals", None, 1), ("cbcan_constants", "true", 22)])
            place = "instances/configurations/configuration" if "--beremiz" in files else "addData/data"
            self.assertEqual(len(root.findall("/".join(PLCOPEN + name for name in f"{place}/globalVars".split("/")))), 2)

    def test_the_editor_opens_what_it_has_saved(self):
        """Its plcopen.py puts <xhtml:p> around each CDATA section that it has written itself: the prefix is the root's."""
        text = output(LIBRARY / "plcopen", "--beremiz", LIBRARY / "cia405.st")
        self.assertIn('xmlns:xhtml="http://www.w3.org/1999/xhtml"', re.search(r"<project[^>]*>", text)[0])
        self.assertEqual(text.count("xmlns:xhtml"), 1)

    def test_what_is_not_understood_is_told(self):
        refused = done(LIBRARY / "plcopen", self.write("wrong.st", "TYPE\n  A : UINT\nEND_TYPE\n"), code=1)
        self.assertEqual(refused.stderr, "plcopen: line 2: END_TYPE: ; should stand here\n")


class Ladder:
    """The diagram of start_all_nodes.xml: executes its rungs in one scan."""

    def __init__(self, root):
        self.elements = {element.get("localId"): element for element in root.iter() if element.get("localId")}
        self.bits, self.before, self.written = {"GO": False, "ONCE": False}, {}, []

    def sources(self, element):
        return [(source.get("refLocalId"), source.get("formalParameter")) for source in element.iter(f"{PLCOPEN}connection")]

    def inputs(self, block):
        return {pin.get("formalParameter"): self.value(*self.sources(pin)[0]) for pin in block.find(f"{PLCOPEN}inputVariables")}

    def value(self, identifier, pin=None):
        element = self.elements[identifier]
        text = {kind(child): child.text for child in element}
        if kind(element) == "leftPowerRail":
            return True
        if kind(element) == "contact":
            was = element.get("edge") == "rising" and self.before.get(text["variable"], False)
            return self.value(*self.sources(element)[0]) and self.bits[text["variable"]] and not was
        if kind(element) == "block":
            return self.inputs(element)["EN" if pin == "ENO" else "IN"]
        base, digits = re.fullmatch(r"WORD#(16#)?(\w+)", text["expression"]).groups()
        return int(digits, 16 if base else 10)

    def scan(self, **bits):
        self.bits.update(bits)
        for element in self.elements.values():
            if kind(element) == "coil":
                self.bits[element.find(f"{PLCOPEN}variable").text] = self.value(*self.sources(element)[0])
            if kind(element) == "outVariable":
                block, pin = self.sources(element)[0]
                if self.inputs(self.elements[block])["EN"]:
                    register = re.fullmatch(r"cbcan\[1\]\.regs\[(\d+)\]", element.find(f"{PLCOPEN}expression").text)[1]
                    self.written.append((int(register), self.value(block, pin)))
        self.before = dict(self.bits)


def number(text):
    return int(text[:-1], 16) if text.endswith("h") else int(text)


class Figure1(cases.Case):
    PAGE = (ROOT / "docs/reference/ladder-recipes.md").read_text()
    TABLE_4 = [(3701, 5066), (3703, 0x1F82), (3704, 128), (3706, 5), (3700, 0xCA0E)]  # of the document, and its last step

    def test_the_diagram(self):
        root = ElementTree.parse(LIBRARY / "start_all_nodes.xml").getroot()
        self.assertEqual(broken_rules(root), [])
        numbers = [element.get("localId") for element in root.iter() if element.get("localId")]
        self.assertEqual(len(numbers), len(set(numbers)))
        self.assertLessEqual({element.get("refLocalId") for element in root.iter(f"{PLCOPEN}connection")}, set(numbers))
        ladder = Ladder(root)
        for go in (False, True, True, False):
            ladder.scan(GO=go)
        self.assertEqual(ladder.written, self.TABLE_4)
        ladder.scan(GO=True)
        self.assertEqual(ladder.written, 2 * self.TABLE_4)

    def test_the_steps_and_the_numbers(self):
        steps = re.findall(r"^    FUN 8 +S: (\S+) +D: R(\d+)$", self.PAGE, re.MULTILINE)
        steps = [(int(register), number(value)) for value, register in steps]
        self.assertEqual(steps, self.TABLE_4)
        table, = tables_of(self.PAGE)["Figure 1: start all nodes"]
        before, after, done = ([number(items(cell)[0]) for cell in row[1:8]] for row in table)
        plant = Plant(PROGRAM, "--demo")
        self.addCleanup(plant.close)
        plant.pass_time(100000)
        count = len(plant.frames())
        self.assertEqual(plant.window.read(3700, 7), before)
        for register, value in steps[:-1]:
            plant.window.write(register, [value])
        plant.window.write(*[(register, [value]) for register, value in steps][-1])
        self.assertEqual(plant.window.read(3701, 6), after[1:])
        self.assertEqual(after[0], steps[-1][1])
        plant.pass_time(10000)
        self.assertEqual(plant.window.read(3700, 7), done)
        sent = [frame for frame in plant.frames()[count:] if frame.startswith("000#")]
        self.assertEqual(sent, items(table[2][8]))


cases.main()
