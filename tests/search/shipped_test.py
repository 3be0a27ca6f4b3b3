#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""cbcan-sim run --explore: the shipped scenarios with every fault, cores with a defect, and scenarios that a fault breaks."""

import os
import pathlib
import re

import cases
from done import output_and_errors
from simulator import LIMIT, program_from_arguments
from tree import ROOT

PROGRAM, WITHOUT_QUARANTINE, WITHOUT_TOGGLE = program_from_arguments(3)
TOGETHER = os.environ.get("CBCAN_TOGETHER", "1")
# A read, a write that nothing repeats, a read, and what has to hold at the end.
FRAGILE = """plant = "demo"

[[step]]
do = ["nmt start all", "trigger read 66 0x1000 0 4"]
wait = "transaction ended"
expect = "register 3700 = 0"

[[step]]
do = "trigger write 66 0x6200 1 1 1"
wait = "transaction ended"
expect = "register 3700 = 0"

[[step]]
do = "trigger read 66 0x1018 1 4"
wait = "transaction ended"

[[step]]
after = "1s"
must = "object 66 0x6200:1 = 1"
"""


def run(*arguments, program=PROGRAM, code=0):
    return output_and_errors(program, "run", *arguments, code=code, timeout=LIMIT)


class Shipped(cases.Case):
    def test_no_fault_breaks_them(self):
        scenarios = [path for path in sorted((ROOT / "scenarios").glob("*.toml")) if path.name != "encoder.toml" or cases.LONG and TOGETHER == "1"]  # its cyclic PDOs make 349,000 pairs
        output = output_and_errors(PROGRAM, "run", "--explore", "--together", TOGETHER, *scenarios)  # ctest has a limit
        runs, broken = map(int, re.search(r"^runs: (\d+), broken: (\d+), distinct failures: 0$", output, re.MULTILINE).groups())
        self.assertEqual(broken, 0)
        self.assertGreater(runs, 1000)

    def test_the_table_is_the_same_with_any_number_of_jobs(self):
        paths = [ROOT / "scenarios" / f"{name}.toml" for name in ("sdo_sizes_and_modes", "node_lost", "power_cycle")]
        one = run("--explore", "-j", "1", *paths)
        self.assertEqual(run("--explore", "-j", "8", *paths), one)
        state = ("--state", f"{self.folder}/state")
        self.assertIn("not tried: ", run("--explore", "--budget", "10ms", *state, *paths))
        self.assertEqual(run("--explore", *state, *paths), one)
        self.assertEqual(run("--explore", *state, *paths), one)

    def joined(self, count, *arguments):
        """The reports of a search in so many parts: table and JUnit, and the number of runs of the parts."""
        files = [self.folder / f"{count}.{part}" for part in range(1, count + 1)]
        runs = [int(re.search(r"^runs: (\d+)", run("--explore", "--state", file, "--shard", f"{part}/{count}", *arguments), re.MULTILINE)[1])
                for part, file in enumerate(files, 1)]
        state = self.folder / f"{count}.state"
        state.write_bytes(b"".join(file.read_bytes() for file in [*reversed(files), files[0]]))  # in any order, and some twice
        before = state.read_bytes()
        junit = self.folder / f"{count}.xml"
        output = run("--explore", "--state", state, "--junit", junit, *arguments)
        self.assertEqual(state.read_bytes(), before)  # nothing was left to run
        return output, junit.read_text(), sum(runs)

    def test_pairs_in_parts_are_the_whole_and_no_run_is_made_twice(self):
        arguments = ("--together", "2", ROOT / "scenarios/cancel.toml", ROOT / "scenarios/checks.toml")
        junit = self.folder / "whole.xml"
        whole = run("--explore", "--junit", junit, *arguments)
        runs = int(re.search(r"^runs: (\d+)", whole, re.MULTILINE)[1])
        self.assertGreater(runs, 100)
        for count in (1, 3, 100):
            self.assertEqual(self.joined(count, *arguments), (whole, junit.read_text(), runs))

    def test_parts_of_another_scenario_are_refused_by_name(self):
        parts = []
        for text in (FRAGILE.replace("must", "expect"), FRAGILE.replace("must", "expect") + "# other"):
            parts.append(self.folder / f"state{len(parts)}")
            run("--explore", "--faults", "silent", "--state", parts[-1], self.write("s.toml", text))
        state = self.write("state", "".join(part.read_text() for part in parts))
        self.assertRegex(run("--explore", "--faults", "silent", "--state", state, self.folder / "s.toml", code=2),
                         rf"{state}:\d+: {self.folder}/s.toml: results of another scenario; keep them apart")


class Defects(cases.Case):
    """In the core: scenarios/sdo_sizes_and_modes.toml passes, and a fault shows it."""

    PATH = ROOT / "scenarios/sdo_sizes_and_modes.toml"

    def find(self, program, failure):
        run(self.PATH, program=program)
        self.assertIn(failure, run("--explore", self.PATH, program=program, code=1))

    def test_no_quarantine(self):
        self.find(WITHOUT_QUARANTINE, "66:response-never@1\n  a node that has not responded in time is left alone: 66 has a request")

    def test_a_toggle_bit_that_is_not_looked_at(self):
        self.find(WITHOUT_TOGGLE, "66:response-other-toggle@1\n  a wrong response is noticed: result 0")


class Fragile(cases.Case):
    def setUp(self):
        self.path = self.write("fragile.toml", FRAGILE)

    def test_only_must_is_judged_with_faults(self):
        output = run("--explore", "--faults", "request-lost", self.path, code=1)
        self.assertIn(": must object 66 0x6200:1 = 1: ", output)
        self.assertIn("broken: 1, distinct failures: 1", output)  # not the reads, which expect result 0
        run("--explore", "--faults", "request-lost", self.write("fragile.toml", FRAGILE.replace("must", "expect")))

    def test_a_failure_is_written_with_fewer_steps_and_fails_the_same(self):
        out = self.folder / "made/out"
        output = run("--explore", "--faults", "request-lost", "--out", out, self.path, code=1)
        file = pathlib.Path(re.search(r"replay: (.*)", output)[1])
        self.assertEqual(file.name, "fragile-66-request-lost-1.toml")
        self.assertIn('plant = "../../fragile.toml"\n', file.read_text())
        self.assertEqual(file.read_text().split("\n\n", 1)[1],
                         '[explore]\nonly = ["66:request-lost@1"]\n\n[[step]]\ndo = ["trigger write 66 0x6200 1 1 1"]\n'
                         'wait = ["transaction ended"]\nexpect = ["register 3700 = 0"]\n\n'
                         '[[step]]\nafter = "1000000us"\nmust = ["object 66 0x6200:1 = 1"]\n')
        run("--check", file)
        self.assertIn("66:request-lost@1: the scenario passes: ", run(file, code=1))
        self.assertIn("must object 66 0x6200:1 = 1", run(file, code=1))
        self.assertIn("runs: 1, broken: 1", run("--explore", file, code=1))
        self.assertIn(f"--log {out}: a run of --explore writes none", run("--log", out, file, code=2))

    def test_a_wrong_condition_is_a_mistake_of_each_run(self):
        path = self.write("wrong.toml", FRAGILE + '[explore]\nalways = "object 66 0x9999 = 1"\n')
        line = path.read_text().splitlines().index('always = "object 66 0x9999 = 1"') + 1
        for options in ((), ("--check",), ("--explore",)):
            self.assertIn(f"{path}:{line}: explore.always: 9999h:00: node 66 has no such object\n", run(*options, path, code=2).replace(f"{path}: {path}", "twice"))

    def test_files_that_are_not_ours(self):
        before = self.path.read_text()
        self.assertIn("is no file of --explore; name a new one", run("--explore", "--state", self.path, self.path, code=2))
        self.assertEqual(self.path.read_text(), before)
        self.assertIn(f"--out {self.path}: Not a directory; name another folder", run("--explore", "--out", self.path, self.path, code=2))
        self.assertIn("nowhere/x.xml", run("--explore", "--junit", self.folder / "nowhere/x.xml", self.path, code=3))

    def test_a_file_that_cannot_be_written_and_one_that_cannot_be_read_lose_no_results(self):
        self.assertIn("runs: 3, broken: 1", run("--explore", "--faults", "request-lost", "--junit", "/dev/full", self.path, code=3))
        junit = self.write("junit.xml", "of the last search")
        self.assertIn("second.toml:1: ", run("--explore", "--junit", junit, self.path, self.write("second.toml", "[["), code=2))
        self.assertEqual(junit.read_text(), "of the last search")

    def test_one_moment(self):
        self.assertIn("must object", run("--only", "66:request-lost@2", self.path, code=1))
        run("--only", "66:request-lost@1", self.path)
        run("--only", "66:request-lost@1+66:request-lost@3", self.path)
        self.assertIn("17: there is no such node in the plant", run("--only", "17:request-lost@1", self.path, code=2))

    def test_the_module_is_varied_too(self):
        path = self.write("fragile.toml", 'plant = "demo"\n\n[[step]]\nafter = "1s"\n\n[[step]]\ndo = "trigger read 66 0x1000 0 4"\nwait = "transaction ended"\nmust = "no frame 77F#00"\n')
        output = run("--explore", path, code=1)
        self.assertRegex(output, r"bus:module-nmt@2\n  the scenario passes: .*must no frame 77F#00: 1 of them")
        for fault in ("module-nmt", "module-nmt command=reset-comm"):
            self.assertRegex(output, rf"{fault} +bus +2 +1 +0 +1 ")
        self.assertRegex(output, r"module-bus-off for_ms=300 +bus +[1-9]")

    def test_a_condition_that_was_never_true_shows_nothing(self):
        reached = self.write("fragile.toml", FRAGILE.replace("must", "expect").replace("\n[[step]]", '\n[explore]\nreached = "object 66 0x6200:1 = 5"\n\n[[step]]', 1))
        self.assertIn("reached object 66 0x6200:1 = 5: in no run", run("--explore", "--faults", "silent", reached, code=1))

    def test_a_scenario_that_fails_without_faults(self):
        broken = self.write("fragile.toml", FRAGILE.replace("must = \"object 66 0x6200:1 = 1", "must = \"object 66 0x6200:1 = 2"))
        self.assertIn("without faults: the scenario passes: ", run("--explore", broken, code=2))


if __name__ == "__main__":
    cases.main()
