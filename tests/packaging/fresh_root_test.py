#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Our packages in a fresh Debian of this machine's release: installed as a container does it, as a user does it, by GitHub's and GitLab's example
jobs, and in a project that uses the libraries. Every shell step of those files is carried out; a local server replaces the releases' server.

usage: fresh_root_test.py BUILD_DIR
mmdebstrap creates that Debian and calls this file again: fresh_root_test.py --inside PACKAGES PORT ROOT.
"""

import functools
import http.server
import os
import pathlib
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
import threading
import time

HERE = pathlib.Path(__file__).resolve()
ROOT = HERE.parents[2]
sys.path.insert(0, str(ROOT / "tests/support"))
import cases
from done import output as run
import ci_files

ALONE = ["unshare", "--net", "sh", "-c", 'ip link set dev lo up && exec "$@"', "sh"]  # with its own ports


class FreshRoot(cases.Case):
    """In this order: each but the first two removes what it has installed."""

    def chroot(self, script, cwd="/", env=(), user="root", alone=False):
        environment = {"PATH": "/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin", "HOME": "/root", "LC_ALL": "C.UTF-8",
                       "DEBIAN_FRONTEND": "noninteractive"} | dict(env)
        return run(*(ALONE if alone else []), "chroot", f"--userspec={user}", self.root, "env", f"--chdir={cwd}", *ci_files.BASH, script,
                   env=environment)

    def purge(self, package):
        self.chroot(f"apt-get purge -y -qq --autoremove {package}")
        left = self.chroot(f"find / -xdev -name '*cbcan*' -not -path '/job/*' -not -path '/action/*' -not -path '/tmp/*'")
        self.assertEqual(left, "")

    def test_1_container(self):
        container = ci_files.container()
        self.assertEqual((container["FROM"], container["COPY"]), ("debian:12-slim", "cbcan_*-debian12_*.deb /tmp/"))
        shutil.copy(next(self.packages.glob("cbcan_*.deb")), self.root / "tmp")
        self.chroot(container["RUN"])
        health = shlex.join(container["HEALTHCHECK"])
        self.chroot(f"""if {health}; then exit 1; fi
            coproc {shlex.join(container["ENTRYPOINT"] + container["CMD"])}
            pid=$COPROC_PID
            read -r ready <&"${{COPROC[0]}}"
            [[ $ready == "ready modbus=0.0.0.0:1502 can=virtual" ]]
            {health}
            kill "$pid"
            wait "$pid"
            """, user=container["USER"], alone=True)

    def test_2_readme_session(self):
        run(sys.executable, ROOT / "tests/docs/run_snippets.py", "/usr/bin", ROOT / "README.md", "--root", self.root)
        self.purge("cbcan")

    def carry_out(self, steps, **environment):
        """Each step in the repository's folder; returns their total time in seconds."""
        job = ci_files.repository(self.root / "job")
        self.addCleanup(shutil.rmtree, job)
        begin = time.monotonic()
        for script, own in steps:
            own = {name: re.sub(r"\$\{\{ (\S+) \}\}", lambda found: EXPRESSIONS[found[1]], value) for name, value in own.items()}
            print(f"  {time.monotonic() - begin:5.1f} s: {script.splitlines()[-1]}", flush=True)
            self.chroot(script, cwd="/job", env=own | environment)
        seconds = time.monotonic() - begin
        self.assertIn("<testsuite", (job / "results.xml").read_text())
        self.purge("cbcan")
        return seconds

    def test_3_gitlab(self):
        self.carry_out(ci_files.gitlab_steps(), RELEASE=f"{SERVER}/{ci_files.OWNER}/cbcan/releases/download/v0.1.0")

    def test_4_github(self):
        """With curl, sudo and pytest installed, as on its runners."""
        sudo = self.root / "usr/local/bin/sudo"
        sudo.write_text('#!/bin/sh\nexec "$@"\n')
        sudo.chmod(0o755)
        version = self.root / "action/firmware/cbcan/version.hpp"
        version.parent.mkdir(parents=True)
        shutil.copy(ROOT / "firmware/cbcan/version.hpp", version)
        seconds = self.carry_out(ci_files.github_steps(), GITHUB_ACTION_PATH="/action", RUNNER_TEMP="/tmp", GITHUB_ENV="/tmp/github_env")
        self.assertEqual((self.root / "tmp/github_env").read_text(), "PYTHONPATH=/usr/share/cbcan/python\n")
        print(f"figure: the CI job from the package to its results in a fresh Debian: {seconds:.1f} s")

    def test_5_libraries(self):
        for package in self.packages.glob("*.deb"):
            shutil.copy(package, self.root / "tmp")
        self.chroot("""apt-get update -qq
            apt-get install -y -qq --no-install-recommends /tmp/cbcan_*.deb /tmp/libcbcan-dev_*.deb g++ cmake ninja-build pkg-config libmodbus-dev libfmt-dev libtomlplusplus-dev liblua5.4-dev
            cmake -S /usr/share/doc/libcbcan-dev/examples/consumer -B /tmp/consumer -G Ninja
            cmake --build /tmp/consumer
            [[ $(/tmp/consumer/with_canopen) == "4 bytes: 91 01 0F 00" ]]
            c++ /usr/share/doc/libcbcan-dev/examples/read_name.cpp $(pkg-config --cflags --libs cbcan-cia405) -o /tmp/read_name""")
        self.purge("cbcan libcbcan-dev")


def serve(packages):
    """Serves releases as GitHub does."""
    class Releases(http.server.SimpleHTTPRequestHandler):
        def translate_path(self, path):
            found = re.fullmatch(r"/[^/]+/cbcan/releases/download/v[\d.]+/([\w.-]+)", path)
            return super().translate_path(found[1] if found else "nothing")

        def log_message(self, *_):
            pass

    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Releases, directory=packages))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    return server.server_port


def outside(build):
    codename = re.search(r"(?m)^VERSION_CODENAME=(\w+)$", pathlib.Path("/etc/os-release").read_text())[1]
    with tempfile.TemporaryDirectory() as folder:
        os.chmod(folder, 0o755)
        subprocess.run(["cpack", "-B", folder], cwd=build, check=True, stdout=subprocess.DEVNULL)
        subprocess.run("sha256sum *.deb >SHA256SUMS", shell=True, cwd=folder, check=True)
        again = shlex.join([sys.executable, str(HERE), "--inside", folder, str(serve(folder))])
        return subprocess.run(["mmdebstrap", "--quiet", "--variant=minbase", "--format=null", f'--customize-hook={again} "$1"', codename],
                              stdin=subprocess.DEVNULL).returncode


if sys.argv[1] == "--inside":
    FreshRoot.packages, FreshRoot.root = pathlib.Path(sys.argv[2]), pathlib.Path(sys.argv[4])
    SERVER = f"http://127.0.0.1:{sys.argv[3]}"
    EXPRESSIONS = {"github.server_url": SERVER, "github.action_repository": f"{ci_files.OWNER}/cbcan"}
    del sys.argv[1:]
    cases.main()
else:
    sys.exit(outside(sys.argv[1]))
