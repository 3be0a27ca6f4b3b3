#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Headers by cbcan-eds for many files, and dictionaries.hpp, which names all of them and the files that were refused.

usage: make_dictionaries.py CBCAN_EDS FOLDER FILE...
"""

import json
import pathlib
import subprocess
import sys


def main():
    program, folder, files = sys.argv[1], pathlib.Path(sys.argv[2]), sorted(sys.argv[3:])
    folder.mkdir(parents=True, exist_ok=True)
    includes, rows, refused = "", "", ""
    for file in files:
        path = pathlib.Path(file)
        made = subprocess.run([program, path.name], cwd=path.parent, capture_output=True, text=True)
        if made.returncode == 0:
            (folder / f"{path.stem}.hpp").write_text(made.stdout)
            includes += f'#include "{path.stem}.hpp"\n'
            rows += f"    {{{json.dumps(file)}, &{path.stem}::kDictionary}},\n"
        else:
            refused += f"    {json.dumps(made.stderr.strip().splitlines()[-1].removeprefix('cbcan-eds: '))},\n"
    (folder / "dictionaries.hpp").write_text(
        f"#pragma once\n\n{includes}\n"
        "namespace dictionaries {\n\n"
        "struct File {\n  const char* path;\n  const cbcan::EdsDictionary* dictionary;\n};\n\n"
        f"inline constexpr File kFiles[] = {{\n{rows}}};\n\n"
        f"inline constexpr const char* kRefused[] = {{\n{refused}}};\n\n}}\n")


main()
