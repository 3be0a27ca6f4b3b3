#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""The wheel of tools/dev/wheel: what is in its programs, and its installation by pip, README's session and cbcan_plant.py in Debian 11, whose C
library is older than that of the build, and in Debian 13.

usage: wheel_systems_test.py WHEEL_DIR
mmdebstrap creates each Debian and calls this file again: wheel_systems_test.py --inside WHEEL ROOT.
"""

import pathlib
import platform
import shlex
import shutil
import subprocess
import sys
import tempfile
import zipfile

HERE = pathlib.Path(__file__).resolve()
ROOT = HERE.parents[2]
sys.path.insert(0, str(ROOT / "tests/support"))
import cases
from done import output as run, output_and_errors

PLANT = """
from cbcan_plant import Plant
with Plant() as plant:
    plant.wait("state 66 pre-operational", within="5s")
"""


def inside(wheel, root):
    def chroot(script):
        return run("unshare", "--net", "sh", "-c", 'ip link set dev lo up && exec "$@"', "sh", "chroot", root,
                   "env", "-i", "PATH=/usr/bin:/bin", "LC_ALL=C.UTF-8", "sh", "-ec", script)

    shutil.copy(wheel, root / "tmp")
    chroot(f"python3 -m venv /venv; /venv/bin/pip install --quiet --no-index --no-deps /tmp/{wheel.name}")
    version = chroot("/venv/bin/python -m cbcan --version; /venv/bin/cbcanctl --version")
    print(f"figure: Debian {(root / 'etc/debian_version').read_text().strip()}: {version.splitlines()}")
    (root / "tmp/plant.py").write_text(PLANT)
    chroot("/venv/bin/python /tmp/plant.py")
    run(sys.executable, ROOT / "tests/docs/run_snippets.py", "/venv/bin", ROOT / "README.md", "--root", root)
    # A service that is a shared library of this system's glibc.
    chroot("""ls /lib/*/libnss_hesiod.so.2 >/dev/null
        sed -i 's/^hosts:.*/hosts: files hesiod dns/' /etc/nsswitch.conf
        echo '127.0.0.1 localhost' >/etc/hosts
        /venv/bin/cbcan-sim --demo --modbus localhost:0 -- /venv/bin/cbcanctl state 66
        ! /venv/bin/cbcanctl --host plc.invalid state 66 2>/tmp/said
        grep -q plc.invalid /tmp/said""")


class Systems(cases.Case):
    def enter(self, suite):
        again = shlex.join([sys.executable, str(HERE), "--inside", str(WHEEL)])
        print(output_and_errors("mmdebstrap", "--quiet", "--variant=minbase", "--format=null", "--include=python3-venv",
                                f'--customize-hook={again} "$1"', suite, stdin=subprocess.DEVNULL))

    def test_debian_11(self):
        self.enter("bullseye")

    def test_debian_13(self):
        self.enter("trixie")

    def test_no_shared_library_and_all_licences(self):
        machine = platform.machine()
        self.assertTrue(WHEEL.name.endswith(f"-manylinux_2_17_{machine}.manylinux2014_{machine}.musllinux_1_1_{machine}.whl"), WHEEL.name)
        print(f"figure: wheel: {WHEEL.stat().st_size / 1024:.0f} KiB")
        with tempfile.TemporaryDirectory() as folder, zipfile.ZipFile(WHEEL) as archive:
            archive.extractall(folder)
            programs = sorted(pathlib.Path(folder).glob("*.data/scripts/*"))
            self.assertEqual([path.name for path in programs], ["cbcan-eds", "cbcan-network", "cbcan-sim", "cbcanctl"])
            for program in programs:
                self.assertNotRegex(run("readelf", "--wide", "--program-headers", "--dynamic", program), "INTERP|NEEDED")
            licences = next(pathlib.Path(folder).glob("*.dist-info/LICENSE")).read_text()
        for library in ("GNU libmicrohttpd", "libmodbus"):
            self.assertRegex(licences, rf"======== {library} \d\S+, linked statically")
        for text in ("cbcan authors", "======== GNU C Library, linked statically", "Evgeny Grin",
                     "GNU LESSER GENERAL PUBLIC LICENSE\n                       Version 2.1", "GCC RUNTIME LIBRARY EXCEPTION", "Victor Zverovich",
                     "Mark Gillard", "Niels Lohmann", "Lua.org", "Leon Sorokin"):
            self.assertIn(text, licences)


if sys.argv[1] == "--inside":
    inside(*map(pathlib.Path, sys.argv[2:]))
else:
    WHEEL = next(pathlib.Path(sys.argv.pop(1)).glob("cbcan-*.whl"))
    cases.main()
