#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""The files of packaging/cluster: a search in parts, of which one is killed, has the report of the whole one.

usage: cluster_test.py CBCAN_SIM PLC_PROGRAMS [CLASS...]
"""

import ctypes
import os
import re
import shutil
import socket
import subprocess

import cases
import ci_files
from done import done, ran
from mcu import die_with_parent
from simulator import LIMIT, program_from_arguments, wait_until
from tree import ROOT

PROGRAM, PLC = program_from_arguments(2)
CLUSTER = ROOT / "packaging/cluster"
PARTS = 3
ENVIRONMENT = {"PATH": f"{os.path.dirname(PROGRAM)}:/usr/sbin:/usr/bin:/sbin:/bin", "HOME": os.environ.get("HOME", "/"), "PARTS": str(PARTS)}
FOR_COMMAND = ('cbcan-sim run --explore "$@" scenarios/', 'cbcan-sim --config plant.toml --explore "$@" -- ./program')
SCENARIOS = ("cancel", "node_lost", "power_cycle")
PLANT = (ROOT / "tests/search/drive.toml").read_text() + 'faults = ["refuse", "request-lost", "silent", "short-frame"]\n'
# Once, in the middle of part 2, it kills the search that has started it.
KILLER = f"""#!/bin/bash
process=$PPID
while [[ $(readlink /proc/$process/exe) == */cbcan-sim ]] && tr '\\0' ' ' </proc/$process/cmdline | grep -q ' parts/2.state '; do
  search=$process process=$(cut -d' ' -f4 /proc/$process/stat)
done
if [[ -n $search ]] && (($(wc -l <parts/2.state) > 5)) && mkdir killed 2>/dev/null; then
  cp parts/2.state before
  kill -9 $search
fi
exec {PLC} ignored-abort
"""


class Project(cases.Case):
    """A user's project."""

    def project(self, name, program=KILLER):
        folder = self.folder / name
        for path in ("plants", "scenarios", "parts"):
            (folder / path).mkdir(parents=True)
        shutil.copytree(ROOT / "plants", folder / "plants", dirs_exist_ok=True)
        for scenario in SCENARIOS:
            shutil.copy(ROOT / f"scenarios/{scenario}.toml", folder / "scenarios")
        (folder / "plant.toml").write_text(PLANT)
        (folder / "program").write_text(program)
        (folder / "program").chmod(0o755)
        return folder

    def whole(self, *words):
        """The search in one part: its report, and that for JUnit."""
        folder, place = self.project("whole", f"#!/bin/sh\nexec {PLC} ignored-abort\n"), words.index("--explore")
        made = ran(PROGRAM, *words[:place], "--junit", "results.xml", "--out", "failures", *words[place:], cwd=folder)
        self.assertEqual(made.returncode, 1 if "--" in words else 0, made.stderr)
        return made.stdout, (folder / "results.xml").read_text()

    def script(self, name, folder):
        """The file, for a command as its comment says."""
        text = (CLUSTER / name).read_text()
        found = re.search(r"^(search.*?)(cbcan-sim .*?)(;? ?['}]) # or: (cbcan-sim .*)$", text, re.MULTILINE)
        self.assertEqual(found[2], "cbcan-sim run --explore %s scenarios/" % ("OPTIONS" if "OPTIONS" in found[2] else '"$@"'))
        path = folder / name
        path.write_text(text.replace(found[0], found[1] + found[4] + found[3]).replace("files=(scenarios plants)", "files=(plant.toml program)"))
        path.chmod(0o755)
        return path

    def check(self, folder, report, remote=None):
        """The report is that of the whole search; the part that was killed has gone on where it was."""
        self.assertEqual((report, (folder / "results.xml").read_text()), self.whole("--config", "plant.toml", "--explore", "--", "./program"))
        before, after = (((remote or folder) / name).read_text() for name in ("before", "parts/2.state"))
        self.assertGreater(len(before.splitlines()), 5)
        self.assertTrue(after.startswith(before))
        runs = [line for line in after.splitlines() if "verdict" in line]
        self.assertEqual(len(set(runs)), len(runs))
        self.assertEqual(len(list((folder / "failures").glob("*.toml"))), 1)


class Parallel(Project):
    def test_on_this_machine(self):
        here = self.project("here")
        (here / "machines").write_text("2/:\n")
        made = ran(self.script("parallel.sh", here), "machines", cwd=here, env=ENVIRONMENT, timeout=5 * LIMIT)
        self.assertEqual((made.returncode, made.stderr), (1, "parallel: Warning: --transferfile ignored as there are no remote --sshlogin.\n"))
        self.check(here, made.stdout)


class ParallelBySsh(Project):
    def test_on_two_machines(self):
        here, there = self.project("here"), self.folder / "there"
        there.mkdir()
        for key in ("host", "user"):
            done("ssh-keygen", "-q", "-t", "ed25519", "-N", "", "-f", self.folder / key)
        if os.geteuid() == 0:
            os.makedirs("/run/sshd", exist_ok=True)
        mounts = "unshare --mount" + ("" if os.geteuid() == 0 else " --map-root-user")
        server = self.write("sshd_config", f"HostKey {self.folder}/host\nAuthorizedKeysFile {self.folder}/user.pub\nStrictModes no\nUsePAM no\nPermitRootLogin yes\n"
                            f"SetEnv PATH={ENVIRONMENT['PATH']}\n"
                            f"ForceCommand {mounts} sh -c 'mount --bind {there} {here} && eval \"$SSH_ORIGINAL_COMMAND\"'\n")
        client = self.write("ssh_config", f"ProxyCommand /usr/sbin/sshd -i -f {server}\nIdentityFile {self.folder}/user\nLogLevel ERROR\n"
                            "UserKnownHostsFile /dev/null\nStrictHostKeyChecking no\n")
        (here / "machines").write_text("".join(f"2/ssh -F {client} {name}\n" for name in ("one", "two")))
        made = ran(self.script("parallel.sh", here), "machines", cwd=here, env=ENVIRONMENT | {"PARALLEL_SSH": f"ssh -F {client}"}, timeout=5 * LIMIT)
        self.assertEqual((made.returncode, made.stderr), (1, ""))
        self.check(here, made.stdout, there)


class Kubernetes(Project):
    def test_the_command_with_its_environment(self):
        folder = self.project("volume")
        job = ci_files.load("packaging/cluster/kubernetes.yml")["spec"]
        container, = job["template"]["spec"]["containers"]
        environment = {variable["name"]: variable["value"] for variable in container["env"]}
        self.assertEqual(job["completions"], int(environment["PARTS"]) + 1)
        mount, = container["volumeMounts"]
        self.assertEqual(mount["mountPath"], container["workingDir"])
        self.assertIn(FOR_COMMAND[0], container["command"][-1])
        command = [word.replace(*FOR_COMMAND) for word in container["command"]]

        def start(index):
            """A pod."""
            pod = subprocess.Popen(command, cwd=folder, env=environment | ENVIRONMENT | {"JOB_COMPLETION_INDEX": str(index)}, preexec_fn=die_with_parent,
                                   stdout=subprocess.DEVNULL)
            self.addCleanup(pod.wait)
            self.addCleanup(pod.kill)
            return pod

        pods = [start(index) for index in range(PARTS + 1)]
        self.assertEqual([pod.wait(5 * LIMIT) for pod in pods[1:]], [0, 1, 0])
        self.assertEqual((start(2).wait(LIMIT), pods[0].wait(LIMIT)), (0, 0))
        self.check(folder, (folder / "report.txt").read_text())


class ContinuousIntegration(Project):
    """The commands, each job in a clone of its own."""

    def run_job(self, name, steps, files, environment):
        clone = self.project(name)
        for path, text in files.items():
            (clone / path).parent.mkdir(parents=True, exist_ok=True)
            (clone / path).write_text(text)
        for step in steps:
            last = done(*ci_files.BASH, step, cwd=clone, env=ENVIRONMENT | environment).stdout
        results = clone / "results.xml"
        return (last, results.read_text() if results.exists() else ""), {path.name: path.read_text() for path in clone.glob("*.state")}

    def check_report(self, report):
        self.assertEqual(report, self.whole("run", "--explore", "scenarios/"))

    def test_github(self):
        jobs = ci_files.load("packaging/cluster/github.yml")["jobs"]
        part, report = ([step["run"] for step in jobs[name]["steps"] if "run" in step] for name in ("part", "report"))
        parts = [str(number) for number in jobs["part"]["strategy"]["matrix"]["part"]]
        self.assertEqual(parts, [str(number + 1) for number in range(len(parts))])
        files = {}
        for number in parts:
            before = {}
            for attempt in ("1", "2") if number == "2" else ("1",):
                _, kept = self.run_job(f"{number}-{attempt}", part, before, {"PART": number, "PARTS": str(len(parts))})
                if number == "2" and attempt == "1":  # it was killed in the middle
                    kept = {name: text[:len(text) // 2].rpartition("\n")[0] + "\n" for name, text in kept.items()}
                before = {f"before/part-{number}-{attempt}/{name}": text for name, text in kept.items()}
                files |= {f"parts/part-{number}-{attempt}/{name}": text for name, text in kept.items()}
        self.check_report(self.run_job("report", report, files, {})[0])

    def test_gitlab(self):
        jobs = ci_files.load("packaging/cluster/gitlab.yml")
        files = {}
        for number in range(1, jobs["part"]["parallel"] + 1):
            environment = {"CI_NODE_INDEX": str(number), "CI_NODE_TOTAL": str(jobs["part"]["parallel"])}
            files |= self.run_job(str(number), jobs["part"]["script"], {}, environment)[1]
        script = [line.replace("/tmp/", f"{self.folder}/") for line in jobs["report"]["script"]]
        self.check_report(self.run_job("report", script, files, {})[0])

    def test_at_most_30_lines(self):
        files = sorted(CLUSTER.iterdir())
        self.assertEqual(len(files), 5)
        self.assertEqual([path.name for path in files if len(path.read_text().splitlines()) > 30], [])
        done("shellcheck", *CLUSTER.glob("*.sh"))


CONTROLLER = """ClusterName=test
SlurmctldHost={host}(127.0.0.1)
SlurmUser=root
AuthInfo=socket={folder}/munge,cred_expire=5
StateSaveLocation={folder}/controller
SlurmdSpoolDir={folder}/spool
SlurmctldPidFile={folder}/controller.pid
SlurmdPidFile={folder}/node.pid
SlurmdParameters=config_overrides
ProctrackType=proctrack/linuxproc
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SchedulerParameters=bf_interval=1
NodeName=one NodeHostname={host} NodeAddr=127.0.0.1 CPUs=2
PartitionName=all Nodes=ALL Default=YES
"""


class Slurm(Project):
    """On a real controller and node, in a network namespace: their ports are nobody else's."""

    @classmethod
    def setUpClass(cls):
        clone_newnet = 0x40000000
        if ctypes.CDLL(None).unshare(clone_newnet) != 0:
            raise PermissionError("a network namespace, munged and slurmd need root")
        done("ip", "link", "set", "dev", "lo", "up")
        done("ip", "address", "add", "192.0.2.1/32", "dev", "lo")  # Slurm asks for addresses of a machine that has another one

    def daemon(self, *command):
        log = open(self.folder / f"{command[0]}.log", "w")
        self.addCleanup(log.close)
        process = subprocess.Popen(command, env=self.environment, stdout=log, stderr=log, preexec_fn=die_with_parent)
        self.addCleanup(process.wait)
        self.addCleanup(process.terminate)

    def test_a_job_that_is_killed_is_queued_again(self):
        folder = self.project("project")
        configuration = self.write("slurm.conf", CONTROLLER.format(host=socket.gethostname().split(".")[0], folder=self.folder))
        self.environment = ENVIRONMENT | {"SLURM_CONF": str(configuration)}
        (self.folder / "controller").mkdir()
        self.folder.chmod(0o755)  # munged has clients of all users
        key = self.write("key", 64 * "k")
        key.chmod(0o600)
        at = lambda name: f"{self.folder}/{name}"
        self.daemon("munged", "--foreground", f"--key-file={key}", f"--socket={at('munge')}", f"--pid-file={at('munged.pid')}", f"--seed-file={at('seed')}")
        wait_until((self.folder / "munge").exists, "munged")
        self.daemon("slurmctld", "-D")
        self.daemon("slurmd", "-D", "-N", "one")
        wait_until(lambda: "idle" in ran("sinfo", "-h", "-o", "%T", env=self.environment).stdout, "a node")
        done(self.script("slurm.sh", folder), cwd=folder, env=self.environment)
        done("sbatch", "--wait", "--job-name=explore", "--dependency=singleton", "--output=/dev/null", "--wrap=true", cwd=folder, env=self.environment)
        self.assertIn("Requeuing JobId=1_2(", (self.folder / "slurmctld.log").read_text())
        self.check(folder, (folder / "report.txt").read_text())


cases.main()
