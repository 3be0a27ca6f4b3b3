#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""The Debian packages from cpack: their files, lintian's output, and their programs, manual pages, completion and unit. Installation by apt in a
fresh Debian: fresh_root_test.py.

usage: package_test.py BUILD_DIR
"""

import os
import pathlib
import re
import shlex
import tempfile

import cases
from done import output_and_errors as run
from simulator import Simulator, program_from_arguments
from tree import ROOT

BUILD = program_from_arguments()
EXPOSURE = 25  # tenths, as systemd-analyze counts


class Package(cases.Case):
    @classmethod
    def setUpClass(cls):
        folder = pathlib.Path(cls.enterClassContext(tempfile.TemporaryDirectory()))
        run("cpack", "-B", folder, cwd=BUILD)
        cls.packages = {path.name.partition("_")[0]: path for path in folder.glob("*.deb")}
        cls.root = folder / "root"
        for path in cls.packages.values():
            run("dpkg-deb", "-x", path, cls.root)
        cls.programs = {name: cls.root / "usr/bin" / name for name in ("cbcan-eds", "cbcan-network", "cbcan-sim", "cbcan-st", "cbcanctl")}

    def contents(self, package):
        return set(re.findall(r"\./(\S*[^/\s])(?= ->|$)", run("dpkg-deb", "-c", self.packages[package]), re.MULTILINE))

    def test_what_is_in_them(self):
        self.assertEqual(set(self.packages), {"cbcan", "libcbcan-dev"})
        print(*(f"figure: {name}: {path.stat().st_size / 1024:.0f} KiB" for name, path in sorted(self.packages.items())), sep="\n")
        programs = self.contents("cbcan")
        for name in (*(f"bin/{name}" for name in self.programs), *(f"share/man/man1/{name}.1.gz" for name in self.programs),
                     "share/cbcan/plants/demo/plant.toml", "share/cbcan/st/cia405.st", "share/cbcan/st/axis.st",
                     "share/cbcan/python/cbcan_plant.py", "lib/python3/dist-packages/cbcan_plant.py", "lib/python3/dist-packages/cbcan_st",
                     "share/cbcan/python/cbcan_st/exchange.py", "share/cbcan/st/machine/compiler.py", "share/man/man5/cbcan-plant.5.gz", "share/bash-completion/completions/cbcan-sim",
                     "share/bash-completion/completions/cbcanctl", "lib/systemd/system/cbcan-sim@.service",
                     "share/doc/cbcan/docs/reference/plant-file.md", "share/doc/cbcan/registers.csv", "share/doc/cbcan/registers.json",
                     "share/doc/cbcan/copyright"):
            self.assertIn(f"usr/{name}", programs)
        libraries = self.contents("libcbcan-dev")
        for name in ("lib/libcbcan_core.a", "lib/cmake/cbcan/cbcan-config.cmake", "include/cbcan/station/boards/common/station.hpp", "lib/pkgconfig/cbcan-cia405.pc", "include/cbcan/regmap.h",
                     "include/cbcan/cia405.hpp", "include/cbcan/window.hpp", "share/doc/libcbcan-dev/copyright"):
            self.assertIn(f"usr/{name}", libraries)
        # The public headers are all below cbcan/.
        self.assertEqual({name for name in libraries if name.startswith("usr/include/") and not name.startswith("usr/include/cbcan/")}, set())

    def test_dependencies(self):
        needed = run("dpkg-deb", "-f", self.packages["cbcan"], "Depends")
        self.assertEqual({re.match(r"[a-z+-]*", name)[0] for name in needed.split(", ")},
                         {"libc", "libfmt", "libgcc-s", "liblua", "libmicrohttpd", "libmodbus", "libstdc++", "libtomlplusplus"})
        self.assertEqual(run("dpkg-deb", "-f", self.packages["libcbcan-dev"], "Depends").strip(), "")

    def test_lintian(self):
        said = run("lintian", "--allow-root", "--fail-on", "error", *self.packages.values())
        self.assertNotRegex(said, "(?m)^E: ")
        print("figure: lintian: " + ("; ".join(said.splitlines()) or "nothing"))

    def test_installed_plants(self):
        for plant in self.root.glob("usr/share/cbcan/plants/*/plant.toml"):
            with self.subTest(plant=plant), Simulator(self.programs["cbcan-sim"], "--config", str(plant)) as simulator:
                self.assertEqual(simulator.stop(), (0, ""))

    # ---- Manual pages and completion

    def helps(self, program):
        """Its --help, and that of each command that has its own."""
        text = run(self.programs[program], "--help")
        commands = re.search(r"\nCommands:\n(.*?)\n\n", text, re.DOTALL)
        names = re.findall(r"^  (\S+)", commands[1], re.MULTILINE) if commands else re.findall(rf"(?m)^ +{program} ([a-z]+) ", text)
        return {"": text} | {name: run(self.programs[program], name, "--help") for name in names}

    @staticmethod
    def options(text):
        """The options at the beginning of lines: "  -v, --verbose", "  --station, --unit N"."""
        return {option for line in re.findall(r"^  (-.*?)(?: |$)(--\S+)?", text, re.MULTILINE) for words in line
                for option in re.findall(r"(?<![\w-])--?[a-z][a-z-]*", words)}

    def test_manual_pages_have_every_option(self):
        for program in self.programs:
            page = self.root / f"usr/share/man/man1/{program}.1.gz"
            text = run("man", "--warnings", "-l", page, env=os.environ | {"MANWIDTH": "200", "LC_ALL": "C.UTF-8", "MANROFFSEQ": ""})
            text = re.sub(".\b", "", text)
            self.assertNotIn("warning:", text)
            for command, helped in self.helps(program).items():
                part = text.partition(f"{program} {command}".upper())[2] if command else text
                for option in self.options(helped):
                    self.assertRegex(part, rf"(?m)^ +(-\w?[^ ]*, ?)?(\S*,)?{option}\b", f"{program} {command}")

    def test_the_page_of_the_plant_file_has_every_key(self):
        text = run("man", "--warnings", "-l", self.root / "usr/share/man/man5/cbcan-plant.5.gz", env=os.environ | {"LC_ALL": "C.UTF-8"})
        self.assertNotIn("warning:", text)
        keys = re.findall(r"^\| (?:[a-z, ]+ \| )?`([\w.]+)` \|", (ROOT / "docs/reference/plant-file.md").read_text(), re.MULTILINE)
        self.assertGreater(len(keys), 50)
        for key in keys:
            self.assertRegex(text, rf"(?m)^ +{re.escape(key)}(\s|$)")

    def complete(self, program, *words):
        """The words that bash offers for the last of these words."""
        script = (f"source {self.root}/usr/share/bash-completion/completions/{program}\n"
                  f"COMP_WORDS=({shlex.join([program, *words])}); COMP_CWORD={len(words)}\n"
                  f"$(complete -p {program} | sed 's/.*-F //; s/ .*//') {program} {shlex.join([words[-1], words[-2] if words[1:] else program])}\n"
                  'printf "%s\\n" "${COMPREPLY[@]}"')
        return set(run("bash", "-c", script).split())

    def test_completion_has_every_option(self):
        for program in self.programs:
            for command, helped in self.helps(program).items():
                offered = self.complete(program, *filter(None, [command]), "-")
                self.assertEqual(self.options(helped) - offered, set(), f"{program} {command}")

    def test_completion_of_words(self):
        self.assertEqual(self.complete("cbcan-sim", "--cl"), {"--clock"})
        self.assertEqual(self.complete("cbcan-sim", "--clock", ""), {"real", "manual"})
        self.assertEqual(self.complete("cbcan-sim", "--config", ""), set())  # then bash offers files
        self.assertEqual(self.complete("cbcanctl", "k"), {"kernel"})
        self.assertEqual(self.complete("cbcanctl", "--port", "1503", "nmt", "reset-"), {"reset-node", "reset-comm"})
        self.assertEqual(self.complete("cbcanctl", "read", "--mode", "s"), {"segmented"})

    # ---- The unit

    def test_unit(self):
        unit = self.root / "usr/lib/systemd/system/cbcan-sim@.service"
        self.assertIn("\nType=notify\n", unit.read_text())
        copy = self.write("cbcan-sim@plant.service", unit.read_text().replace("ExecStart=", f"ExecStart={self.root}/usr/bin/").replace("Documentation=", "#"))
        self.assertEqual(run("systemd-analyze", "verify", "--recursive-errors=no", copy), "")
        said = run("systemd-analyze", "security", "--offline=true", f"--threshold={EXPOSURE}", copy)
        print("figure: systemd-analyze security: " + re.search(r"exposure level for \S+: (\S+)", said)[1])


cases.main()
