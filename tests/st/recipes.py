# SPDX-License-Identifier: MIT
"""The recipes of docs/ladder.md, read from its tables and carried out register by register."""

import re

from plc import ROOT

PAGE = ROOT / "docs/ladder.md"
EXECUTE = 0xCA0E


def tables_of(text):
    """{heading: [table]}, a table is [[cell]] without its head."""
    found, heading = {}, None
    for line in text.splitlines():
        if line.startswith("#"):
            heading = line.lstrip("#").strip()
            found[heading] = []
        elif line.startswith("|---"):
            found[heading].append([])
        elif line.startswith("|") and found[heading] and found[heading][-1] is not None and not is_head(line):
            found[heading][-1].append([cell.strip() for cell in line.strip().strip("|").split("|")])
    return found


def is_head(line):
    return "`" not in line


def items(cell):
    return re.findall(r"`([^`]*)`", cell)


class Recipes:
    def __init__(self, plc):
        self.plc, self.tables = plc, tables_of(PAGE.read_text())
        self.written = {}  # object of the module: what has been written there last

    def register(self, number):
        return self.plc.window.read(number, 1)[0]

    def value(self, text, names):
        """Of an expression of the page."""
        text = re.sub(r"\b(low|high) R(\d+)", lambda m: str(self.register(int(m[2])) >> (8 if m[1] == "high" else 0) & 0xFF), text)
        text = re.sub(r"\bR(\d+)", lambda m: str(self.register(int(m[1]))), text)
        text = re.sub(r"\b([0-9][0-9A-F]*)h\b", lambda m: str(int(m[1], 16)), text)
        text = re.sub(r"\b[A-Z][A-Z_]+\b", lambda m: str(names[m[0]]), text)
        assert re.fullmatch(r"[\d +*=><and]*", text), text
        text = re.sub(r"(?<![<>])=", "==", text)
        return eval(re.sub(r"\b0+(?=\d)", "", text))  # numbers and + * = > < and, as the line above says

    def due(self, when, names):
        if when == "always":
            return True
        if when.endswith("is new"):
            index = "3004h" if when.startswith("mode") else "3003h"
            return self.written.get(index) != self.value(items(when)[0], names)
        return self.value(items(when)[0], names)

    def keep(self, cell, names):
        for item in items(cell):
            name, text = item.split(" = ")
            names[name] = self.value(text, names)

    def execute(self, row, names, wait_ms):
        """One transaction; R3700, or None when it is not over in time."""
        _, *cells, data, _ = row
        words = [self.value(items(cell)[0], names) for cell in cells]
        if items(data) == ["DATA"]:
            raw = list(names["DATA"]) + [0]
            words += [raw[i] | raw[i + 1] << 8 for i in range(0, len(raw) - 1, 2)]
        elif items(data):
            words.append(self.value(items(data)[0], names))
        self.plc.window.write(3701, words)
        self.plc.window.write(3700, [EXECUTE])
        for _ in range(wait_ms or 100000):
            if self.register(3700) != EXECUTE:
                break
            self.plc.pass_time(1000)
        else:
            return None
        if self.register(3700) == 0 and items(cells[2])[0] in ("3003h", "3004h"):
            self.written[items(cells[2])[0]] = words[5]
        return self.register(3700)

    def run(self, block, **inputs):
        """The outputs of the block."""
        names, sdo = {"TIMEOUT": 0, "DEVICE": 0, "SUBINDEX": 0, "MODE": 0, **inputs}, block.startswith("SDO_")
        requests, results = self.tables[block]
        outputs = {}
        for row in requests:
            if not self.due(row[0], names):
                continue
            code = 0 if not items(row[1]) else self.execute(row, names, names["TIMEOUT"])
            if code is None:
                self.plc.window.write(3700, [0])
                self.plc.pass_time(1000)
            if code != 0:
                outputs = self.timed_out() if code is None else self.failure(sdo, names)
                break
            self.keep(row[-1], names)
        else:
            outputs = self.outputs(results, names)
        if outputs.get("ERROR", 0) not in (0, 1):
            self.written.clear()
        return outputs

    def outputs(self, table, names):
        cells = next(row for row in table if self.due(row[0], names))
        found = {}
        for item in items(cells[1]):
            name, _, text = item.partition(" = ")
            if name == "DATA":
                size = self.register(3705)
                words = self.plc.window.read(3706, 64)
                found[name] = [words[i // 2] >> 8 * (i % 2) & 0xFF for i in range(size)]
            else:
                found[name] = True if not text else self.value(text, names)
        return found

    def failure(self, sdo, names):
        table, = self.tables["Failures"]
        row = next(row for row in table if self.due(row[0], names))
        cell = row[1 if sdo else 2]
        found = {name: self.value(text, names) for name, text in (item.split(" = ") for item in items(cell))}
        return {**found, **self.timed_out()} if "as after TIMEOUT" in cell else found

    def timed_out(self):
        requests, results = self.tables["After TIMEOUT"]
        names = {"KERNEL": 0}
        if self.execute(requests[0], names, 500) == 0:
            self.keep(requests[0][-1], names)
        return self.outputs(results, names)
