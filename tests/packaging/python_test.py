#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""tools/python/cbcan_plant.py: its fixtures with Debian's pytest; without pytest, the standard library alone.

usage: python_test.py SIMULATOR
"""

import os
import pathlib
import re
import sys

import cases
import ci_files
from done import ran
from simulator import program_from_arguments, wait_until
from tree import ROOT

SIMULATOR = program_from_arguments()
ENVIRONMENT = {name: value for name, value in os.environ.items() if not name.startswith("CBCAN_")} | {
    "CBCAN_SIM": SIMULATOR, "PYTHONPATH": str(ROOT / "tools/python"), "PYTHONDONTWRITEBYTECODE": "1"}
PYTEST = ["/usr/bin/python3", "-m", "pytest", "-q", "-p", "no:cacheprovider"]
FAILING = """
def test_that_fails(plant):
    plant.advance("1s")
    plant.wait("state 66 operational", within="2s")

def test_after_it(plant):
    assert plant.now == 0
"""

RESTARTING = """
import cbcan_plant

def test_that_fails(plant, window):
    window.start(5055, 99, 0x1000, 0, 4)
    with cbcan_plant.Window(plant) as other:
        other.write(3700, *[0] * 70)  # as in a module that has just started
    window.result()

def test_cancelled(window):
    window.start(5055, 99, 0x1000, 0, 4)
    window.cancel()
    assert window.result() == 0
"""
ONE_TASK = "CONFIGURATION c RESOURCE r ON PLC TASK t (INTERVAL := T#10ms, PRIORITY := 0); PROGRAM main WITH t : p; END_RESOURCE END_CONFIGURATION"


def run(*command, **options):
    done = ran(*command, **{"env": ENVIRONMENT} | options)
    return done.returncode, done.stdout + done.stderr


class Python(cases.Case):
    def pytest(self, text, *command, **options):
        """pytest's output for a file of tests, under a command."""
        self.write("conftest.py", (ROOT / "examples/pytest/conftest.py").read_text())
        self.write("test_it.py", text)
        return run(*command, *PYTEST, self.folder, **options)

    def test_a_module_that_restarts_says_so(self):
        code, said = self.pytest(RESTARTING)
        self.assertEqual(code, 1)
        self.assertIn("PlantError: the module has restarted, or another program has written to R3701..R3704", said)
        self.assertIn("1 failed, 1 passed", said)

    def test_what_fails_says_why(self):
        code, said = self.pytest(FAILING)
        self.assertEqual(code, 1)
        self.assertRegex(said, r"NotWithin: wait state 66 operational within 2s: not within 2\.0+ s: state 66 operational: ")
        self.assertIn("1 failed, 1 passed", said)

    def test_a_mistake_in_a_test_is_named(self):
        code, said = self.pytest("""
import cbcan_plant
def test_abort(window):
    assert window.execute(5055, 66, 0x3333, 0, 1) == 4
    assert window.execute(5055, 66, 0x3333, 0, 1) == 0
def test_result(window):
    assert window.execute(5056, 66, 0x1000, 0, 4) == 0
def test_too_large(window):
    window.execute(5066, 66, 0x2001, 0, 4, 100000)
def test_word(window):
    window.execute("read", 66, 0x1000, 0, 4)
def test_words(window):
    window.write(3700, *[0] * 130)
def test_unit(plant):
    cbcan_plant.Window(plant, unit=7).execute(5055, 66, 0x1000, 0, 4)
def test_name(plant):
    assert plant.get(66, "output:1") == 7
""")
        self.assertEqual(code, 1)
        for message in ("assert 4 (0602 0000h no such object) == 0", "assert 1 (R3701 is neither 5055 nor 5066) == 0",
                        "ValueError: 100000: a request has up to 123 words of 0..65535; ", "ValueError: 'read': a request has ",
                        "ValueError: 130 words: ", "PlantError: unit 7: Modbus exception 10: the plant has no such network; unit=1 is its first; ",
                        "assert 0 == 7", "7 failed"):
            self.assertIn(message, said)

    def test_abort_codes_are_those_of_the_registers(self):
        sys.path.insert(0, str(ROOT / "tools/python"))
        import cbcan_plant
        rows = re.findall(r'\{(0x[0-9A-F]{8}), "\w+",\s+"([^"]*)"', (ROOT / "regmap/include/cbcan/sdo_abort_codes.hpp").read_text())
        self.assertEqual(cbcan_plant.ABORTS, {int(number, 16): text for number, text in rows})
        self.assertGreater(len(rows), 30)

    def test_under_a_plant_each_test_still_has_its_own(self):
        code, said = run(SIMULATOR, "--demo", "--", *PYTEST, ROOT / "examples/pytest")
        self.assertEqual((code, re.findall(r"\d+ passed", said)), (0, ["8 passed"]), said)
        code, said = self.pytest("def test_one(plant):\n    pass\n", SIMULATOR, "--demo", "--")
        self.assertEqual((code, "run pytest alone, and name the plant in its configuration file" in said), (1, True), said)

    def test_a_plant_around_is_shared_where_a_test_asks_for_it(self):
        code, said = self.pytest("""
import pytest
from cbcan_plant import Plant
@pytest.fixture(scope="session")
def shared():
    with Plant.around() as plant:
        yield plant
def test_one(shared):
    shared.advance("5s")
def test_two(shared):
    assert shared.now == 5
@pytest.mark.plant("--demo")
def test_three(plant):
    assert plant.now == 0
""", SIMULATOR, "--demo", "--clock", "manual", "--")
        self.assertEqual((code, "3 passed" in said), (0, True), said)

    def test_the_jobs_of_CI_systems_and_of_the_pages_pass_as_they_stand(self):
        """Their test steps, in a repository with the examples; fresh_root_test.py has the installing steps."""
        steps = {script for script, _ in ci_files.github_steps() + ci_files.gitlab_steps() if not re.search("apt-get|curl|sha256sum|GITHUB_ENV", script)}
        self.assertEqual(len(steps), 2, steps)
        job = ci_files.repository(self.folder / "job")
        for step in sorted(steps):
            code, said = run(*ci_files.BASH, step, cwd=job, env=ENVIRONMENT | {"PATH": f"{pathlib.Path(SIMULATOR).parent}:/usr/bin:/bin"})
            self.assertEqual(code, 0, f"{step}\n{said}")
        self.assertIn("<testsuite", (job / "results.xml").read_text())
        code, said = run(*PYTEST, cwd=job / "tests")  # the plant's path is relative to pytest.ini
        self.assertEqual((code, "8 passed" in said), (0, True), said)

    def test_a_program_in_structured_text_beside_the_plant(self):
        self.write("pytest.ini", f"[pytest]\ncbcan_plant = --config {ROOT}/plants/tank.toml\ncbcan_st = cia405.st scanner.st openplc.st tank.st\n")
        self.write("tank.st", (ROOT / "examples/explore/tank.st").read_text())
        self.write("other.st", "PROGRAM p VAR x : UINT; END_VAR x := x - 1; END_PROGRAM " + ONE_TASK)
        code, said = self.pytest("""
import pytest
def test_the_tank_is_filled(st, plant):
    st.run(until="DONE", within=30)
    assert st["main.full"] and plant.get(66, "output:1") == 0
    assert 10 < plant.now < 12
def test_a_level_that_cannot_be_read(st, plant):
    st.run(lambda: plant.get(66, "output:1") == 1)
    plant.fault(66, "request-lost", index=0x6401)
    st.run("GAVE_UP")
    assert plant.get(66, "output:1") == 0
@pytest.mark.st("other.st")
def test_another(st, plant):
    st.force("x", 7)
    st.scan()
    st.release("x")
    st.run(until=lambda: st["x"] == 0)
    st.scan()
""", cwd=self.folder)
        self.assertEqual(code, 1)
        self.assertIn("StError: other.st:1: -1: not within UINT", said)
        self.assertIn("1 failed, 2 passed", said)

    def test_several_networks(self):
        code, said = self.pytest(f"""
import pytest
from cbcan_plant import Window
EDS = "{ROOT}/plants/demo/io_module.eds"
@pytest.mark.plant("--node", f"5={{EDS}}", "--network", "2", "--node", f"6={{EDS}}")
def test_network_2(plant):
    plant.power("2/6", False)
    with Window(plant, unit=2) as window:
        assert window.execute(5055, 6, 0x1000, 0, 4) == 4
        assert window.abort == 0x05040000
""")
        self.assertEqual((code, "1 passed" in said), (0, True), said)

    def test_standard_library_alone(self):
        """-S: without installed packages, so without pytest."""
        self.assertEqual(run("/usr/bin/python3", "-S", "-c", """
import cbcan_plant
with cbcan_plant.Plant() as plant, cbcan_plant.Window(plant) as window:
    print(window.execute(5055, 0x42, 0x3333, 0, 2), hex(window.abort))
    plant.fault(0x42, "response-never")
    window.start(5055, 0x42, 0x1000, 0, 4)
    window.cancel()
    print(window.result(), plant.now)
"""), (0, "4 (0602 0000h no such object) 0x6020000\n0 0.0\ncbcan-sim: 0.000000 node 66: fault 1: response-never: 5C2#4300100091010F00\n"))

    def test_only_within_pytest_it_imports_pytest(self):
        """--explore starts a program a thousand times, and pytest takes four times as long as all the rest."""
        program = "import sys, cbcan_plant; assert 'pytest' not in sys.modules; cbcan_plant.gave_up('no level')"
        self.assertEqual(run("/usr/bin/python3", "-c", program), (75, "gave up: no level\n"))
        inherited = run("/usr/bin/python3", "-c", program, env=ENVIRONMENT | {"PYTEST_CURRENT_TEST": "of the parent"})
        self.assertEqual(inherited, (75, "gave up: no level\n"))
        code, said = self.pytest("import cbcan_plant\ndef test_it(plant):\n    cbcan_plant.gave_up('no level')\n")
        self.assertEqual((code, "no level" in said), (75, True), said)
        self.write("test_it.py", "def test_it(plant):\n    assert plant.now == 0\n")
        code, said = run("/usr/bin/python3", "-c", f"import cbcan_plant, pytest; raise SystemExit(pytest.main(['-q', '{self.folder}']))")
        self.assertEqual((code, "1 passed" in said), (0, True), said)

    def test_a_plant_that_does_not_start(self):
        code, said = run("/usr/bin/python3", "-c", "import cbcan_plant; cbcan_plant.Plant('--demo', '--set', 'module.node_id=300')")
        self.assertEqual(code, 1)
        self.assertIn("module.node_id 300: must be 1..127", said)
        self.assertIn("exit code 2; it says why on standard error", said)

    def test_where_there_is_no_plant(self):
        for made, why in (("Plant(program='./nowhere/cbcan-sim')", "nowhere/cbcan-sim'; is cbcan installed? CBCAN_SIM may be the path"),
                          ("Plant.around()", "no plant has started this program; write cbcan-sim ... -- COMMAND, or use Plant()")):
            code, said = run("/usr/bin/python3", "-c", f"import cbcan_plant; cbcan_plant.{made}")
            self.assertEqual((code, why in said), (1, True), said)

    def test_a_test_that_is_killed_leaves_nothing_behind(self):
        script = "import cbcan_plant, os, signal; print(cbcan_plant.Plant().process.pid, flush=True); os.kill(os.getpid(), signal.SIGKILL)"
        code, said = run("/usr/bin/python3", "-c", script)
        self.assertEqual(code, -9)
        simulator = pathlib.Path(f"/proc/{int(said)}")
        wait_until(lambda: not simulator.exists() or "State:\tZ" in (simulator / "status").read_text(), "the simulator's end")


cases.main()
