#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Fails on a test without a time limit, or with a limit that a busy machine can exceed: tests/CMakeLists.txt, cbcan_time_limit.

usage: time_limits.py BUILD_DIR
"""

import json
import subprocess
import sys

LEAST = 600  # seconds


def main():
    listed = subprocess.run(["ctest", "--show-only=json-v1"], cwd=sys.argv[1], check=True, capture_output=True, text=True).stdout
    tests = json.loads(listed)["tests"]
    found = []
    for test in tests:
        limit = {each["name"]: each["value"] for each in test["properties"]}.get("TIMEOUT", 0)
        if limit < LEAST:
            found.append(f"{test['name']}: its limit is {limit:.0f} s; {LEAST} is the least")
    print("\n".join(found) if found else f"{len(tests)} tests have a limit")
    sys.exit(1 if found or len(tests) < 50 else 0)


main()
