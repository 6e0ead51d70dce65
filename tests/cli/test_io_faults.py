"""Disks, folders and files that fail: clear errors with exit code 4, and nothing harmed that was there before."""

import contextlib
import hashlib
import os
import resource
import shutil
import signal
import subprocess
import time
import unittest
from pathlib import Path

from command import BRECCIA, MPIRUN, SCENE, CommandTest, breccia

OUTPUT = '\n[gravity]\ninterval = 8\n[output]\ncheckpoint_time = "every 2 s"\nsnapshots = "every 6 s"\n'


def hashes(folder):
    return {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in folder.iterdir() if path.is_file()}


class IoFaults(CommandTest):
    def setUp(self):
        super().setUp()
        self.scene = self.write_scene(SCENE + OUTPUT)
        self.out = self.folder / "out"

    def run_scene(self, *arguments, ranks=1, scene=None, out=None):
        return breccia("run", scene or self.scene, "--out", out or self.out, *arguments, ranks=ranks)

    def assert_ends(self, process, code, *words):
        """As assert_fails, but progress may have been printed before."""
        self.assertEqual(process.returncode, code, process.stderr)
        self.assertEqual(process.stderr.count("error: "), 1, process.stderr)
        for word in words:
            self.assertIn(word, process.stderr)

    def mount(self, size, *options):
        """A small file system of its own. Only root can have one."""
        folder = self.folder / "mount"
        folder.mkdir()
        if os.geteuid() != 0 or subprocess.run(
            ["mount", "-t", "tmpfs", "-o", ",".join((f"size={size}", *options)), "none", folder],
            capture_output=True,
            check=False,
        ).returncode:
            self.skipTest("no file system can be mounted here")
        self.addCleanup(subprocess.run, ["umount", "-l", folder], check=False)
        return folder

    def test_disk_full(self):
        """The disk fills while the run writes; with space again it ends as one that never saw that."""
        whole = self.folder / "whole"
        self.assertEqual(self.run_scene("--until", "20 s", out=whole).returncode, 0)
        disk = self.mount("8m")
        for ranks in (1, 2):
            with self.subTest(ranks=ranks):
                out = disk / f"out{ranks}"
                process = self.run_scene("--restart", "auto", "--steps", 30, out=out, ranks=ranks)
                self.assertEqual(process.returncode, 0, process.stderr)
                before = hashes(out)
                ballast = disk / "ballast"
                with open(ballast, "wb") as file:
                    space = os.statvfs(disk)
                    file.write(bytes((space.f_bavail - 30) * space.f_bsize))
                process = self.run_scene("--restart", "auto", "--until", "20 s", out=out, ranks=ranks)
                self.assert_ends(process, 4, str(out), "reserve")
                after = hashes(out)
                for name in before:
                    if name.startswith(("snap", "checkpoint")):
                        self.assertEqual(after[name], before[name], name)
                self.assertFalse([name for name in after if name.endswith(".part")])
                ballast.unlink()
                process = self.run_scene("--restart", "auto", "--until", "20 s", out=out, ranks=ranks)
                self.assertEqual(process.returncode, 0, process.stderr)
                if ranks == 1:
                    self.assertEqual(
                        (out / "run.hdf.series").read_text(), (whole / "run.hdf.series").read_text()
                    )

    def test_full_disk_can_be_read(self):
        disk = self.mount("8m")
        self.assertEqual(self.run_scene("--steps", 30, out=disk / "out").returncode, 0)
        with open(disk / "ballast", "wb") as file, contextlib.suppress(OSError):
            while True:
                os.write(file.fileno(), bytes(4096))
        before = sorted(os.listdir(disk / "out"))
        newest = sorted((disk / "out").glob("checkpoint_*"))[-1]
        for ranks in (1, 2):
            with self.subTest(ranks=ranks):
                process = self.run_scene("--restart", newest, "--steps", 40, out=self.folder / f"on{ranks}", ranks=ranks)
                self.assertEqual(process.returncode, 0, process.stderr)
        self.assertEqual(sorted(os.listdir(disk / "out")), before)

    def test_no_room_for_a_lock(self):
        """Files enough for the folders, the table and the first snapshot, but not for the lock that MPI puts beside it."""
        disk = self.mount("8m", "nr_inodes=4")
        for ranks in (1, 2):
            with self.subTest(ranks=ranks):
                process = self.run_scene("--steps", 30, out=disk / "out", ranks=ranks)
                self.assert_fails(process, 4, "snap_0000.hdf", "No space left")
                shutil.rmtree(disk / "out")

    def test_files_may_not_grow(self):
        """ulimit -f, as some machines have it; set once MPI has its own files, which are larger than ours."""
        self.out.mkdir()
        process = self.start_run("--restart", "auto", "--set", "scene.end=1e6 s", out=self.out)
        resource.prlimit(process.pid, resource.RLIMIT_FSIZE, (20000, 20000))
        errors = process.communicate(timeout=60)[1]
        self.assertEqual(process.returncode, 4, errors)
        self.assertIn("File too large", errors)
        self.assertEqual(errors.count("error: "), 1, errors)

    def start_run(self, *arguments, out, ranks=1):
        """A process that has written its first snapshot."""
        command = [BRECCIA, "run", self.scene, "--out", out, *arguments]
        if ranks > 1:
            command = [MPIRUN, "-n", str(ranks), *command]
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        self.addCleanup(process.kill)
        deadline = time.monotonic() + 60
        while not (out / "snap_0000.hdf").exists():
            self.assertIsNone(process.poll(), "the run does not start")
            self.assertLess(time.monotonic(), deadline)
            time.sleep(0.01)
        return process

    def test_folder_that_cannot_be_written(self):
        disk = self.mount("8m")
        out = disk / "out"
        self.assertEqual(self.run_scene("--steps", 30, out=out).returncode, 0)
        subprocess.run(["mount", "-o", "remount,ro", disk], check=True)
        before = hashes(out)
        for ranks in (1, 2):
            for restart in ((), ("--restart", "auto", "--steps", 60)):
                place = out if restart else disk / "new"
                process = self.run_scene(*restart, out=place, ranks=ranks)
                self.assert_fails(process, 4, str(place), "Read-only file system")
        self.assertEqual(hashes(out), before)
        # Its checkpoints can be continued elsewhere.
        newest = sorted(out.glob("checkpoint_*"))[-1]
        process = self.run_scene("--restart", newest, "--steps", 40)
        self.assertEqual(process.returncode, 0, process.stderr)

    def test_file_in_the_way(self):
        self.out.touch()
        self.assert_fails(self.run_scene(), 4, str(self.out))

    def test_folder_of_another_scene(self):
        other = self.folder / "other.toml"
        other.write_text((SCENE + OUTPUT).replace("-200 m/s", "-100 m/s"))
        for arguments in (("--until", "3 s"), ("--steps", 1)):
            for ranks in (1, 2):
                with self.subTest(arguments=arguments, ranks=ranks):
                    out = self.folder / f"out{ranks}{arguments[0]}"
                    self.assertEqual(self.run_scene(*arguments, out=out).returncode, 0)
                    if arguments[0] == "--steps":
                        (out / "summary.json").unlink()  # as if it had been cut off before the first checkpoint
                    before = hashes(out)
                    process = self.run_scene("--restart", "auto", scene=other, out=out, ranks=ranks)
                    self.assert_fails(process, 4, str(out), '"scene"', '"other"', "--out")
                    self.assertEqual(hashes(out), before)

    def test_finished_run_with_other_keys(self):
        self.assertEqual(self.run_scene("--until", "3 s").returncode, 0)
        before = hashes(self.out)
        process = self.run_scene("--restart", "auto", "--until", "3 s", "--set", "grid.cell=9 km")
        self.assert_fails(process, 2, "grid.cell", "summary.json")
        self.assertEqual(hashes(self.out), before)

    def test_killed_before_anything_was_written(self):
        self.out.mkdir()
        for name in ("probe", "probe.part", "snap_0000.hdf.part"):
            (self.out / name).touch()
        process = self.run_scene("--restart", "auto", "--steps", 1)
        self.assertEqual(process.returncode, 0, process.stderr)
        self.assertFalse([path for path in self.out.iterdir() if path.name.startswith("probe")])

    def test_checkpoint_that_cannot_be_removed(self):
        """A folder of that name: neither to be read nor to be removed, and no reason to stop."""
        self.out.mkdir()
        (self.out / "checkpoint_0000.h5").mkdir()
        (self.out / "checkpoint_0000.h5" / "file").touch()
        (self.out / "diagnostics.csv").touch()
        self.assert_ends(self.run_scene("--restart", "auto", "--steps", 40), 4, "checkpoint_0000.h5")
        (self.out / "checkpoint_0000.h5").rename(self.out / "aside")
        self.assertEqual(self.run_scene("--restart", "auto", "--steps", 20).returncode, 0)
        (self.out / "checkpoint_0000.h5").unlink()
        (self.out / "aside").rename(self.out / "checkpoint_0000.h5")
        process = self.run_scene("--restart", "auto", "--steps", 40)
        self.assertEqual(process.returncode, 0, process.stderr)
        self.assertIn("checkpoint_0000.h5: cannot be removed", process.stderr)

    def test_a_rank_dies(self):
        """The other ranks end soon, somebody says so, and the run goes on from its last checkpoint."""
        for victim in (0, 1):
            with self.subTest(rank=victim):
                out = self.folder / f"out{victim}"
                process = self.start_run("--restart", "auto", "--set", "scene.end=1e6 s", out=out, ranks=2)
                while not list(out.glob("checkpoint_*.h5")):
                    time.sleep(0.01)
                ranks = self.ranks_of(process)
                os.kill(ranks[victim], signal.SIGKILL)
                start = time.monotonic()
                errors = process.communicate(timeout=30)[1]
                self.assertLess(time.monotonic() - start, 30)
                self.assertNotEqual(process.returncode, 0)
                self.assertIn("signal 9", errors)
                while any(map(self.is_running, ranks)):  # mpirun does not wait for them on a busy machine
                    self.assertLess(time.monotonic() - start, 30)
                    time.sleep(0.05)
                process = self.run_scene("--restart", "auto", "--steps", 120, "--set", "scene.end=100 s", out=out, ranks=2)
                self.assertEqual(process.returncode, 0, process.stderr)
                self.assertIn("continuing from", process.stderr)
                self.assertFalse(list(out.glob("*.part")))

    def is_running(self, pid):
        try:
            return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] not in "ZX"
        except (FileNotFoundError, ProcessLookupError):
            return False

    def ranks_of(self, process):
        """Process ids of the ranks below a running mpirun, in the order of their ranks."""
        ranks = {}
        for pid in Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text().split():
            for variable in Path(f"/proc/{pid}/environ").read_bytes().split(b"\0"):
                if variable.startswith(b"OMPI_COMM_WORLD_RANK="):
                    ranks[int(variable.split(b"=")[1])] = int(pid)
        return [ranks[n] for n in sorted(ranks)]


if __name__ == "__main__":
    unittest.main()
