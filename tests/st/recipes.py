# SPDX-License-Identifier: MIT
"""The recipes of docs/reference/ladder-recipes.md, read from its tables and carried out register by register."""

import re

from plc import ROOT

PAGE = ROOT / "docs/reference/ladder-recipes.md"
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
        elif line.startswith("|") and "`" in line and found[heading]:
            found[heading][-1].append([cell.strip() for cell in line.strip().strip("|").split("|")])
    return found


def items(cell):
    return re.findall(r"`([^`]*)`", cell)


class Recipes:
    def __init__(self, plc):
        self.plc, self.tables = plc, tables_of(PAGE.read_text())
        self.written = {}  # object of the module: the last value written

    def register(self, number):
        return self.plc.window.read(number, 1)[0]

    def value(self, text, names):
        """The value of an expression of the page."""
        text = re.sub(r"\b(low|high) R(\d+)", lambda m: str(self.register(int(m[2])) >> (8 if m[1] == "high" else 0) & 0xFF), text)
        text = re.sub(r"\bR(\d+)", lambda m: str(self.register(int(m[1]))), text)
        text = re.sub(r"\b([0-9][0-9A-F]*)h\b", lambda m: str(int(m[1], 16)), text)
        text = re.sub(r"\b[A-Z][A-Z_]+\b", lambda m: str(names[m[0]]), text)
        assert re.fullmatch(r"[\d +*/=>and]*", text), text
        text = text.replace("=", "==").replace("/", "//")
        return eval(re.sub(r"\b0+(?=\d)", "", text))  # only numbers and + * / = > and, as checked above

    def due(self, row, names):
        when = row[0]
        if when == "always":
            return True
        if when.endswith("is new"):
            return self.written.get(self.value(items(row[3])[0], names)) != self.value(items(when)[0], names)
        return self.value(items(when)[0], names)

    def keep(self, cell, names):
        for item in items(cell):
            name, text = item.split(" = ")
            names[name] = self.value(text, names)

    def execute(self, row, names, most_ms):
        """One transaction; returns R3700, or None if it does not end in time."""
        _, *cells, data, _ = row
        words = [self.value(items(cell)[0], names) for cell in cells]
        if items(data) == ["DATA"]:
            raw = list(names["DATA"]) + [0]
            words += [raw[i] | raw[i + 1] << 8 for i in range(0, len(raw) - 1, 2)]
        elif items(data):
            words.append(self.value(items(data)[0], names))
        self.plc.window.write(3701, words)
        self.plc.window.write(3700, [EXECUTE])
        names["OVER"] = 0
        while self.register(3700) == EXECUTE and not names["OVER"]:
            self.plc.pass_time(self.plc.scan_us)
            names["OVER"] = int(0 < most_ms <= (self.plc.now - self.begun) / 1000)
        code = self.register(3700)
        if words[:2] == [5066, 0]:
            self.written.pop(words[2], None)
            if code == 0:
                self.written[words[2]] = words[5]
        return None if code == EXECUTE else code

    def run(self, block, **inputs):
        """The outputs of the block."""
        names = {"TIMEOUT": 0, "DEVICE": 0, "INDEX": 0, "SUBINDEX": 0, "MODE": 0, **inputs}
        self.begun = self.plc.now
        requests, results = self.tables[block]
        if self.register(3701) == 0:
            self.written.clear()
        if block == "NMT" or block.startswith("SDO_"):
            requests = self.tables["Timeout and mode"][0] + requests
        for row in requests:
            if not self.due(row, names):
                continue
            code = 0 if not items(row[1]) else self.execute(row, names, names["TIMEOUT"])
            if code is None:
                self.plc.window.write(3700, [0])
                self.plc.pass_time(self.plc.scan_us)
            if code != 0 or items(row[1]) and self.register(3701) == 0:
                outputs = self.timed_out() if code is None else self.failure(block, names)
                break
            self.keep(row[-1], names)
        else:
            outputs = self.outputs(results, names)
        if outputs.get("ERROR", 0) == 0x21 or (block, names.get("STATE")) == ("NMT", 6):
            self.written.clear()
        return outputs

    def outputs(self, table, names):
        cells = next(row for row in table if self.due(row, names))
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

    def failure(self, block, names):
        table, = self.tables["Failures"]
        row = next(row for row in table if self.due(row, names))
        cell = row[1 if block.startswith("SDO_") else 2]
        if "as after TIMEOUT" in cell:
            return self.timed_out()
        return {name: self.value(text, names) for name, text in (item.split(" = ") for item in items(cell))}

    def timed_out(self):
        requests, results = self.tables["After TIMEOUT"]
        names, self.begun = {"KERNEL": 0}, self.plc.now
        if self.execute(requests[0], names, 500) == 0:
            self.keep(requests[0][-1], names)
        return self.outputs(results, names)
