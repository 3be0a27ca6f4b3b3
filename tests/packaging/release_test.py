#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""The files of a release, by the steps of the workflow: npm tarball, page, wheel, checksums. Packages: newer_debian; container: fresh_root_test.py.
"""

import hashlib
import shutil
import tarfile
import zipfile

import cases
import ci_files
from done import output as run
from tree import ROOT

OUT = ROOT / "build/release"
IN_MODULE = ("cbcan", "fmt", "toml++", "JSON for Modern C++", "fast_float", "libc++, libc++abi", "wasi-libc", "Lua", "uPlot")


class Release(cases.Case):
    @classmethod
    def setUpClass(cls):
        shutil.rmtree(OUT, ignore_errors=True)
        for step in ci_files.release_steps()["packages"]:
            if step.startswith("packaging/release"):
                run("bash", "-c", step, cwd=ROOT)
        cls.files = {path.name for path in OUT.iterdir()}
        run("packaging/release", "checksums", cwd=ROOT)

    def check_licences(self, text):
        parts = [line.removeprefix("======== ") for line in text.splitlines() if line.startswith("======== ")]
        self.assertEqual(["cbcan", *parts], list(IN_MODULE))
        self.assertGreater(text.count("Permission is hereby granted"), 5)

    def test_npm(self):
        with tarfile.open(OUT / "cbcan-0.1.0.tgz") as tarball:
            self.check_licences(tarball.extractfile("package/LICENSE").read().decode())

    def test_page(self):
        with tarfile.open(OUT / "cbcan-0.1.0-page.tar.gz") as page:
            self.check_licences(page.extractfile("tab/LICENSE").read().decode())
            self.assertLess({"tab/index.html", "tab/cbcan.wasm"}, set(page.getnames()))

    def test_wheel(self):
        (name,) = (name for name in self.files if name.endswith(".whl"))
        with zipfile.ZipFile(OUT / name) as wheel:
            self.assertTrue([entry for entry in wheel.namelist() if "licenses/" in entry.lower() or "LICENSE" in entry])

    def test_checksums(self):
        lines = (OUT / "SHA256SUMS").read_text().splitlines()
        self.assertEqual(lines, sorted((f"{hashlib.sha256((OUT / name).read_bytes()).hexdigest()}  {name}" for name in self.files), key=lambda line: line[66:]))

    def test_again_the_same_bytes(self):
        before = (OUT / "SHA256SUMS").read_text()
        for part in ("module", "wheel", "checksums"):
            run("packaging/release", part, cwd=ROOT)
        self.assertEqual((OUT / "SHA256SUMS").read_text(), before)

    def test_notes(self):
        notes = run("packaging/release", "notes", cwd=ROOT)
        self.assertIn("### Added", notes)
        self.assertNotIn("\n## ", notes)


cases.main()
