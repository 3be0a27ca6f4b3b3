#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""The pages as they are installed: their links lead to what is installed too, or to a file of the source on the web.

usage: pages_test.py BUILD_DIR
"""

import re

import cases
from done import output as run
from page_blocks import LINK, dead_links, pages, prose
from simulator import program_from_arguments
from tree import ROOT

BUILD = program_from_arguments()
WEB = re.compile(r"https://github\.com/[\w-]+/cbcan/blob/v[\d.]+/(.*)")


class Installed(cases.Case):
    def setUp(self):
        run("cmake", "--install", BUILD, "--component", "programs", "--prefix", self.folder)
        self.pages = sorted((self.folder / "share/doc/cbcan").rglob("*.md"))

    def test_all_pages(self):
        names = {str(page.relative_to(self.folder / "share/doc/cbcan")) for page in self.pages if "examples" not in page.parts}
        self.assertEqual(names, {"README.md", "SECURITY.md", "CHANGELOG.md"} |
                         {str(page.relative_to(ROOT)) for page in pages() if page.is_relative_to(ROOT / "docs")})

    def test_links(self):
        dead, on_the_web = [], 0
        for page in self.pages:
            text = page.read_text()
            dead += [f"{page.name}:{number}: {why}" for number, why in dead_links(page, text)]
            for number, line in prose(text):
                for file in (WEB.fullmatch(target) for target, _ in LINK.findall(line)):
                    on_the_web += file is not None
                    if file and not (ROOT / file[1]).is_file():
                        dead.append(f"{page.name}:{number}: {file[0]}")
        self.assertEqual(dead, [])
        self.assertGreater(on_the_web, 30)


cases.main()
