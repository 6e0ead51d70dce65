"""A Slurm of one node, started and ended as processes of the test: no service, no other users."""

import os
import secrets
import shutil
import socket
import subprocess
import time
from pathlib import Path

PROGRAMS = ("munged", "slurmctld", "slurmd", "sbatch", "scancel", "scontrol", "squeue")


def missing():
    """What keeps a private Slurm from starting here, or an empty string."""
    # Debian keeps the daemons where only root looks for programs.
    os.environ["PATH"] += ":/usr/sbin"
    absent = [name for name in PROGRAMS if shutil.which(name) is None]
    if absent:
        return f"no {', '.join(absent)}: install the packages slurm-wlm and munge"
    return "" if os.geteuid() == 0 else "Slurm's daemons start as root only"


def free_ports(count):
    sockets = [socket.socket() for _ in range(count)]
    for s in sockets:
        s.bind(("127.0.0.1", 0))
    ports = [s.getsockname()[1] for s in sockets]
    for s in sockets:
        s.close()
    return ports


class PrivateSlurm:
    """Used in a `with` statement; `folder` holds all of its files."""

    def __init__(self, folder, cpus=2):
        self.folder = Path(folder)
        self.cpus = cpus
        self.daemons = []
        self.is_up = False

    def __enter__(self):
        try:
            self._start_munge()
            self._start_slurm()
        except BaseException:
            self.stop()
            raise
        return self

    def __exit__(self, *_):
        self.stop()

    def stop(self):
        try:
            if self.is_up:
                self._cancel_jobs()
        finally:
            self._stop_daemons()

    def _cancel_jobs(self):
        """A job's processes are nobody's children: they would outlive the daemons."""
        def jobs():
            return self.run("squeue", "--noheader", "--format=%A").split()

        if jobs():
            self.run("scancel", *jobs())
            self._wait(lambda: not jobs(), "the end of jobs")

    def _stop_daemons(self):
        for process in reversed(self.daemons):
            process.terminate()
        for process in self.daemons:
            try:
                process.wait(timeout=20)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
        self.daemons = []

    def run(self, *command, **keywords):
        process = subprocess.run(command, capture_output=True, text=True, env=self.environment(), timeout=60, **keywords)
        if process.returncode != 0:
            raise RuntimeError(f"{' '.join(command)}: {process.stderr}")
        return process.stdout

    def environment(self):
        return dict(os.environ, SLURM_CONF=str(self.folder / "slurm.conf"))

    def _daemon(self, *command):
        with open(self.folder / f"{Path(command[0]).name}.out", "w") as log:
            self.daemons.append(
                subprocess.Popen(command, env=self.environment(), stdout=log, stderr=log, stdin=subprocess.DEVNULL)
            )

    def _wait(self, condition, what):
        deadline = time.monotonic() + 60
        while time.monotonic() < deadline:
            if condition():
                return
            time.sleep(0.2)
        raise RuntimeError(f"Slurm: waited a minute for {what}; see {self.folder}")

    def _start_munge(self):
        munge = self.folder / "munge"
        munge.mkdir(mode=0o755)
        self.socket = munge / "socket"
        key = munge / "key"
        key.write_bytes(secrets.token_bytes(128))
        key.chmod(0o400)
        for path in (munge, key):
            shutil.chown(path, "munge", "munge")
        options = {"key-file": key, "socket": self.socket, "pid-file": munge / "pid"}
        options |= {"log-file": munge / "log", "seed-file": munge / "seed"}
        self._daemon(
            "setpriv", "--reuid=munge", "--regid=munge", "--clear-groups", shutil.which("munged"), "--foreground",
            *(f"--{name}={value}" for name, value in options.items()),
        )
        self._wait(self.socket.exists, "munged")

    def _start_slurm(self):
        host = socket.gethostname().split(".")[0]
        controller, node = free_ports(2)
        for name in ("state", "spool", "tmp"):
            (self.folder / name).mkdir()
        (self.folder / "slurm.conf").write_text(
            f"""\
ClusterName=test
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort={controller}
SlurmUser=root
AuthType=auth/munge
AuthInfo=socket={self.socket}
CryptoType=crypto/munge
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
ReturnToService=2
SlurmdParameters=config_overrides
KillWait=10
StateSaveLocation={self.folder}/state
SlurmdSpoolDir={self.folder}/spool
SlurmctldPidFile={self.folder}/slurmctld.pid
SlurmdPidFile={self.folder}/slurmd.pid
SlurmctldLogFile={self.folder}/slurmctld.log
SlurmdLogFile={self.folder}/slurmd.log
TmpFS={self.folder}/tmp
NodeName={host} NodeAddr=127.0.0.1 Port={node} CPUs={self.cpus} State=UNKNOWN
PartitionName=main Nodes={host} Default=YES MaxTime=INFINITE State=UP
"""
        )
        self._daemon(shutil.which("slurmctld"), "-D")
        self._daemon(shutil.which("slurmd"), "-D")
        self._wait(self._node_is_idle, "the node")
        self.is_up = True

    def _node_is_idle(self):
        try:
            return "State=IDLE" in self.run("scontrol", "show", "node")
        except RuntimeError:
            return False

    def job(self, number):
        """Properties of a job as `scontrol show job` names them."""
        words = self.run("scontrol", "--oneliner", "show", "job", str(number)).split()
        return dict(word.split("=", 1) for word in words if "=" in word)

    def let_start(self, number):
        """Starts a job that is pending after a requeue. Slurm holds it back for two minutes, and with reason: a node
        refuses a start that was granted in the second in which it ended the job before, and the job counts as failed."""
        time.sleep(2)
        self.run("scontrol", "update", f"JobId={number}", "StartTime=now")
