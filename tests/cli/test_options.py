"""The command line itself: help, wrong use, what this build cannot do."""

import unittest

from command import CommandTest, breccia


class Options(CommandTest):
    def test_wrong_use_is_exit_2_with_one_line(self):
        scene = self.write_scene()
        cases = [
            ([], "run, check, analyze, gravity, eos or info"),
            (["fly"], "fly"),
            (["run"], "scene"),
            (["run", scene, "--colour", "red"], "--colour"),
            (["run", scene, "--device", "abacus"], "abacus"),
            (["run", scene, "--steps", "-3"], "--steps"),
            (["run", scene, "--threads", "0"], "--threads"),
            (["run", scene, "--until", "3 km"], "--until"),
            (["eos", "basalt", "--density", "2700"], "--energy"),
            (["eos", "basalt", "--density", "dense", "--energy", "0"], "dense"),
            (["info", "more"], "more"),
        ]
        for arguments, word in cases:
            with self.subTest(arguments=arguments):
                self.assert_fails(breccia(*arguments, cwd=self.folder), 2, word)

    def test_wrong_use_on_two_ranks(self):
        self.assert_fails(breccia("fly", ranks=2), 2, "fly")
        self.assert_fails(breccia("run", "scene.toml", "--until", "3 km", ranks=2, cwd=self.folder), 2, "--until")

    def test_help_names_every_command(self):
        for ranks in (1, 2):
            process = breccia("--help", ranks=ranks)
            self.assertEqual((process.returncode, process.stderr), (0, ""))
            for command in ("run", "check", "analyze", "eos", "info"):
                self.assertEqual(process.stdout.count(f"\n  {command} "), 1, process.stdout)

    def test_help_of_a_command(self):
        process = breccia("run", "--help")
        self.assertEqual(process.returncode, 0)
        for option in ("--set", "--out", "--until", "--steps", "--device", "--threads", "--profile"):
            self.assertIn(option, process.stdout)

    def test_info(self):
        for ranks in (1, 2):
            process = breccia("info", ranks=ranks)
            self.assertEqual((process.returncode, process.stderr), (0, ""))
            topics = [line.split()[0] for line in process.stdout.splitlines()]
            self.assertEqual(topics, ["breccia", "compiler", "mpi", "hdf5", "fftw", "simd", "cuda", "devices"])


if __name__ == "__main__":
    unittest.main()
