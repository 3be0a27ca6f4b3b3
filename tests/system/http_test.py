#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""The HTTP interface: each endpoint as docs/reference/http.md shows it, by curl and http.client; other sites, garbage, and clients that hang."""

import contextlib
import http.client
import json
import pathlib
import re
import subprocess

import cases
from done import ran
from simulator import LIMIT, READ, WRITE, Simulator, program_from_arguments, wait_until
from tree import ROOT

PROGRAM = program_from_arguments()


class Http(cases.Case):
    def start(self, *options, plant=("--demo",), **keywords):
        self.simulator = Simulator(PROGRAM, *plant, "--http", "127.0.0.1:0", *options, **keywords, test=self)
        return self.simulator

    def ask(self, path, body=None, **headers):
        """(status, JSON or text)"""
        connection = http.client.HTTPConnection(self.simulator.where["http"], timeout=LIMIT)
        with contextlib.closing(connection):
            connection.request("GET" if body is None else "POST", path, body, {name.capitalize(): value for name, value in headers.items()})
            response = connection.getresponse()
            text = response.read().decode()
            return response.status, json.loads(text) if response.headers["Content-Type"] == "application/json" else text

    def get(self, path):
        status, json_or_text = self.ask(path)
        self.assertEqual(status, 200, json_or_text)
        return json_or_text

    def control(self, *lines):
        return self.ask("/api/control", "\n".join(lines))[1]

    def stream(self, path, **headers):
        """Lines of a stream, from curl."""
        arguments = [argument for name, value in headers.items() for argument in ("-H", f"{name.replace('_', '-')}: {value}")]
        process = subprocess.Popen(["curl", "-sN", *arguments, f"http://{self.simulator.where['http']}{path}"], stdout=subprocess.PIPE, text=True)
        self.addCleanup(process.stdout.close)
        self.addCleanup(process.wait)
        self.addCleanup(process.kill)
        assert process.stdout.readline() == ": cbcan\n"
        return process.stdout

    def events(self, stream, count):
        found = []
        while len(found) < count:
            line = stream.readline()
            if line.startswith("data: "):
                found.append(json.loads(line[6:]))
        return found


def shape(value):
    if isinstance(value, dict):
        return {key: shape(member) for key, member in value.items()}
    if isinstance(value, list):
        return [shape(value[0])] if value else []
    return "number" if type(value) in (int, float) else type(value).__name__


class Page(Http):
    def examples(self):
        text = (ROOT / "docs/reference/http.md").read_text()
        found = re.findall(r"^`(GET|POST) (/api/\S+?)`(?:(?!\n`(?:GET|POST)).)*?\n```json\n(.*?)```", text, re.S | re.M)
        return {f"{method} {path}": json.loads(example) for method, path, example in found}, [json.loads(line) for line in
                                                                         re.search(r"```events\n(.*?)```", text, re.S)[1].splitlines()]

    def test_endpoints_are_as_the_page_shows_them(self):
        simulator = self.start()
        examples, _ = self.examples()
        objects = self.get("/api/nodes/16/objects?first=0x6041&last=0x6041")
        self.control("fault #4 response-late delay_ms=50", "incident 16 overtemperature on")
        with simulator.window() as window:
            window.execute(READ, 0x20, 0x3333, 0, 4)
            self.assertEqual(shape(self.get("/api/time")), shape(examples["GET /api/time"]))
        registers = self.get("/api/registers?first=3700&count=1")
        self.assertEqual(shape(registers), shape(examples["GET /api/registers"]))
        self.assertEqual([len(self.get(f"/api/registers{query}")["registers"]) for query in ("", "?first=0&count=3")], [70 + 70 + 68 + 128 + 172 + 2, 3])
        last = [self.get(f"/api/registers?first={first}")["registers"][0] for first in (500, 3500, 3569, 3600, 3667, 3668)]
        self.assertEqual([(register["name"], register.get("channel")) for register in last],
                         [("OUT_NUMBER", None), ("OUT_NUMBER", 16), ("OUT_DATA", 16), ("IN_NUMBER", 16), ("IN_DATA", 16), ("", None)])
        self.assertEqual(self.get(f"/api/registers?first={3972 + 16}")["registers"][0]["words"], "Pre-operational, not listed")
        nodes = self.get("/api/nodes")
        nodes["nodes"] = nodes["nodes"][3:4]
        self.assertEqual(shape(nodes), shape(examples["GET /api/nodes"]))
        self.assertEqual((objects["objects"], shape(objects)), (examples["GET /api/nodes/N/objects"]["objects"], shape(examples["GET /api/nodes/N/objects"])))
        points = self.get("/api/nodes/66/points")
        self.assertEqual((points["points"][0], shape(points)),
                         (examples["GET /api/nodes/N/points"]["points"][0], shape(examples["GET /api/nodes/N/points"])))
        self.assertEqual(nodes["nodes"][0]["alarms"], ["overcurrent", "short-circuit", "overvoltage", "undervoltage", "overtemperature", "encoder",
                                                       "following-error", "motor-blocked"])
        everything = self.get("/api/points")["nodes"]
        self.assertEqual(([len(node) for node in everything], everything[0]), ([6, 1, 1, 5, 0], points["points"]))
        words = self.get("/api/words")
        self.assertIn({"word": "stop", "meaning": "Stop Remote Node"}, words["nmt"])
        self.assertIn("response-never", [fault["word"] for fault in words["faults"]])
        self.assertEqual([len(words[name]) > 8 for name in ("faults", "commands", "kinds")], [True] * 3)
        self.assertEqual(self.get("/api/wires"), {"wires": []})
        self.assertEqual(self.get("/api/nodes/%231/objects?first=0x1000&last=0x1000")["objects"][0]["value"], "983441")

    def test_wires_are_as_the_page_shows_them(self):
        self.start(plant=("--config", ROOT / "plants/tank.toml"))
        examples, _ = self.examples()
        wires = self.get("/api/wires")["wires"]
        self.assertEqual((len(wires), wires[0]), (2, examples["GET /api/wires"]["wires"][0]))
        level = self.get("/api/nodes/20/points")["points"][2]
        self.assertEqual((level["name"], level["level"], level["unit"]), ("level", True, "mm"))

    def test_process_data_say_what_they_are_exchanged_with(self):
        simulator = self.start()
        with simulator.window() as window:
            for index, sub, size, value in [(0x1600, 1, 4, 0xA0400308), (0x1600, 2, 4, 0xA0400408), (0x1600, 3, 4, 0xA1000410), (0x1600, 0, 1, 3), (0x1400, 1, 4, 0x2C2),
                                            (0x1A00, 1, 4, 0xA5800110), (0x1A00, 0, 1, 1), (0x1800, 1, 4, 0x345)]:
                self.assertEqual(window.execute(WRITE, 0, index, sub, size, value & 0xFFFF, value >> 16), 0)
            inputs = {3801: "node 66 6401h:01 Channel 1", 3803: "node 66 6401h:02 Channel 2"}
            for flags, expected in ((0, inputs), (0x8000, {3801: "PDO 2C2h", 3803: "PDO 2C2h"}), (0x4000, inputs)):  # valid, not valid, without RTR
                self.assertEqual(window.execute(WRITE, 0x42, 0x1801, 1, 4, 0x2C2, flags), 0)
                registers = self.get("/api/registers?first=3800&count=65")["registers"]
                self.assertEqual({register["register"]: register["mapped"] for register in registers if "mapped" in register}, {**expected, 3864: "PDO 345h"})

    def test_events_are_as_the_page_shows_them(self):
        # A short time-out, so that polls of the result do not push the first events out of the journal.
        network = self.write("network.toml", "node = [ { id = 66, device_type = 1 } ]")  # which it has not
        simulator = self.start("--set", "module.sdo_timeout_ms=20", "--fault", "32:response-never count=1", "--network-file", network)
        answers, examples = self.examples()
        with simulator.window() as window:
            window.execute(READ, 0x20, 0x3333, 0, 4)
            window.execute(READ, 16, 6041, 0, 2)  # decimal
            self.assertEqual(shape(self.get("/api/advice")), shape(answers["GET /api/advice"]))
            self.control("incident 16 overtemperature on", "nmt start 16", "set 0x42 0x6000:1 5")
        self.assertEqual(self.get("/api/nodes")["boots"], [
            {"node": 66, "failed": True, "words": "device type 000F0191h, the network file wants 00000001h (C); it is not started"}])
        stream = self.stream("/api/events?since=0&state=1&watch=16:0x6064")
        missing = {example["kind"]: shape(example) for example in examples if example["kind"] != "missed"}
        while missing:
            event, = self.events(stream, 1)
            wanted = missing.get(event["kind"])
            if wanted and set(event) == set(wanted):  # frames and faults also come without a transaction
                self.assertEqual(shape(event), wanted)
                del missing[event["kind"]]


class Events(Http):
    def test_a_transaction_is_all_there(self):
        simulator = self.start()
        with simulator.window() as window:
            window.execute(READ, 0x42, 0x1000, 0, 4)
            window.execute(READ, 0x20, 0x3333, 0, 4)
        ended = self.get("/api/transactions")["events"]
        self.assertEqual([(event["transaction"], event["ok"]) for event in ended], [(1, True), (2, False)])
        self.assertEqual(self.get("/api/transactions?failed=1")["events"], ended[1:])
        self.assertEqual(self.get("/api/transactions?slow=1000")["events"], [])
        kinds = [event["kind"] for event in self.get("/api/journal?transaction=2")["events"]]
        self.assertEqual(kinds[:5], ["modbus", "begun", "frame", "frame", "ended"])
        self.assertEqual(set(kinds[5:]), {"modbus"})
        self.assertEqual([event["frame"] for event in self.get("/api/frames?limit=2")["events"]], ["620#4033330000000000", "5A0#8033330000000206"])
        self.assertEqual(self.get("/api/frames?limit=1&before=7")["events"][0]["kind"], "frame")

    def test_a_stream_goes_on_where_it_was(self):
        simulator = self.start()
        stream = self.stream("/api/events?kinds=ended")
        with simulator.window() as window:
            for _ in range(3):
                window.execute(READ, 0x42, 0x1000, 0, 4)
        events = self.events(stream, 3)
        self.assertEqual([event["transaction"] for event in events], [1, 2, 3])
        again = self.stream("/api/events?kinds=ended", Last_Event_ID=events[0]["number"])
        self.assertEqual(self.events(again, 2), events[1:])
        restarted = self.stream("/api/events?kinds=ended", Last_Event_ID=10**9)
        self.assertEqual(self.events(restarted, 3), events)

    def test_watched_values(self):
        self.start()
        stream = self.stream("/api/events?kinds=client&watch=16:0x6064,16:0x6041")
        first = self.events(stream, 2)
        self.assertEqual([event["object"] for event in first], ["0x6064", "0x6041"])
        self.control("power 16 off")
        while True:
            event, = self.events(stream, 1)
            if event["object"] == "0x6041":
                break
        self.assertEqual(event["value"], "off")

    def test_several_networks(self):
        simulator = self.start("--network", "2", "--node", f"5={ROOT}/plants/demo/generic.eds")
        with simulator.window(2) as window:
            window.execute(READ, 5, 0x1000, 0, 4)
        self.assertEqual([event["network"] for event in self.get("/api/transactions")["events"]], [2])
        self.assertEqual(self.get("/api/nodes?network=2")["nodes"][0]["node"], 5)
        self.assertEqual(self.get("/api/nodes/5/objects?network=2&first=0x1000&last=0x1000")["node"], "2/5")
        self.assertEqual(self.control("write 2/100 7"), "ok\n")
        self.assertEqual(self.get("/api/registers?network=2&first=100")["registers"][0]["value"], 7)

    def test_the_last_minute_as_a_scenario(self):
        """A saved scenario has earlier events, has no refused commands, and passes."""
        simulator = self.start("--clock", "manual", stdin=subprocess.PIPE)
        with simulator.window() as window:
            for number in (1, 2):
                window.write(500, [number, READ, 0x42, 0x1000, 0, 4])
            self.control("incident 16 overcurrent on", "incident 16 no-such on", "pass 61s", "set 99 0x6401 1", "fault 0x42 abort code=0x08000021 count=1")
            for number in (3, 4):
                window.write(500, [number, READ, 0x42, 0x1000, 0, 4])
            self.assertEqual(window.execute(WRITE, 0x42, 0x6411, 1, 2, 300), 0)
            self.control("pass 1s")
            self.assertEqual(window.execute(READ, 0x42, 0x6411, 1, 2), 0)
        status, text = self.ask("/api/scenario")
        self.assertEqual(status, 200)
        self.assertIn('do = [\n  "incident 16 overcurrent on",\n  "write 500 2",\n]\n', text)
        self.assertNotIn("no-such", text)
        self.assertNotIn("set 99", text)
        for line in ('wait = "register 600 = 3"\nexpect = ["register 601 = 4", "register 604 = 33 2048"]\n',
                     'wait = "register 600 = 4"\nexpect = ["register 601 = 0", "register 603 = 4 401 15"]\n',
                     'wait = "register 3700 != 51726"\nexpect = ["register 3700 = 0", "register 3705 = 2 300"]\n'):
            self.assertIn(line, text)
        saved = self.write("saved.toml", text)
        done = ran(PROGRAM, "run", saved)
        self.assertEqual(done.returncode, 0, text + done.stdout)

    def test_a_manual_clock(self):
        simulator = self.start("--clock", "manual", stdin=subprocess.PIPE)
        self.assertEqual(self.get("/api/time")["time"], 0)
        self.assertEqual(self.control("pass 100ms", "trigger read 99 0x1000 0 4", "wait transaction ended", "time"),
                         "at 0.100000\nok\nok 1.100000\nok 1.100000\n")
        self.assertEqual(self.get("/api/transactions")["events"][0]["took_ms"], 1000)
        self.assertEqual(simulator.process.poll(), None)


class Strangers(Http):
    def test_what_is_wrong_is_told(self):
        self.start()
        for path, status, why in (("/api/nothing", 404, "no such resource"), ("/api/nodes/99/objects", 400, "node 99: not in this plant"),
                                  ("/api/registers?first=5000", 400, "first=5000: must be 0..4167"), ("/api/nodes?network=2", 400, "network=2"),
                                  ("/api/registers?network=0", 400, "network=0: must be 1..1"),
                                  ("/api/time?network=7", 400, "network=7"),
                                  ("/api/transactions?service=foo", 400, "service=foo: must be read, write, nmt or state"),
                                  ("/api/events?watch=16", 400, "write NODE:INDEX"), ("/api/events?watch=16:0x9999", 400, "no such object")):
            got, answer = self.ask(path)
            self.assertEqual(got, status, path)
            self.assertIn(why, answer["error"])
        for words in ("4294971097 1", "3803.9 1", "1e30 1", "-1 1", "3801 65536", "3801 -65530", "3801 1e30", "3801 nan", "4167 1 2", "9/1 1", "3801"):
            self.assertTrue(self.control(f"write {words}").startswith("error: "), words)
        self.assertEqual({register["value"] for register in self.get("/api/registers?first=3800&count=100")["registers"]}, {0})
        self.assertEqual(self.ask("/api/registers", "{}"), (404, {"error": "POST is for /api/control; its command `write` writes registers"}))
        self.assertEqual(self.ask("/api/control", 1001 * "x" + "\ntime")[1].splitlines()[0], "error: a line of more than 1000 characters")
        self.assertEqual(self.ask("/api/time", "x")[0], 404)

    def test_a_body_of_two_lengths_is_refused(self):
        self.start()
        for lengths, answer in ((b"5",), b"HTTP/1.1 200"), ((b"5", b"3"), b"HTTP/1.1 400"), ((b"5", b"5"), b"HTTP/1.1 400"):
            head = b"".join(b"Content-Length: %s\r\n" % length for length in lengths)
            with self.simulator.connect("http") as client:
                client.sendall(b"POST /api/control HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n" + head + b"\r\ntime\n")
                with contextlib.suppress(ConnectionError):  # or the connection is closed
                    self.assertIn(client.recv(12), (answer, b"" if len(lengths) > 1 else answer))


class Crowd(Http):
    def raw(self, data):
        client = self.simulator.connect("http")
        self.addCleanup(client.close)
        client.sendall(data)
        return client

    def memory(self, simulator, what):
        """KiB"""
        status = pathlib.Path(f"/proc/{simulator.process.pid}/status").read_text()
        return int(re.search(fr"{what}:\s+(\d+)", status)[1])

    def test_64_clients_that_read_nothing_hold_nobody_up(self):
        simulator = self.start()
        request = b"GET /api/events?since=0 HTTP/1.1\r\nHost: localhost\r\n\r\n"
        dead = [self.raw(request) for _ in range(64)]
        for client in dead[:32]:
            client.close()
        wait_until(lambda: self.get("/api/time")["streams"] >= 32, "the streams")
        with simulator.window() as window:
            for _ in range(1000):
                self.assertEqual(window.execute(READ, 0x42, 0x1000, 0, 4), 0)
        self.assertEqual(len(self.get("/api/transactions")["events"]), 1000)
        time = self.get("/api/time")
        self.assertGreaterEqual(time["requests"], 2000)
        is_sanitized = self.memory(simulator, "VmSize") > 100_000_000  # AddressSanitizer frees memory late
        self.assertLess(self.memory(simulator, "VmRSS"), 1_000_000 if is_sanitized else 100_000)
        self.assertEqual(simulator.stop(), (0, ""))


cases.main()
