"""`breccia gravity` on the particles of a snapshot: files, methods, ranks, errors."""

import json
import unittest

from command import CommandTest, breccia


class Gravity(CommandTest):
    def setUp(self):
        super().setUp()
        out = self.folder / "run"
        process = breccia("run", self.write_scene(), "--out", out, "--steps", 1)
        self.assertEqual(process.returncode, 0, process.stderr)
        self.particles = out / "snap_0000.hdf"

    def evaluate(self, *arguments, ranks=1):
        out = self.folder / "gravity.hdf"
        return breccia("gravity", self.particles, "--out", out, "--json", "-", *arguments, ranks=ranks)

    def test_errors_against_direct_sums(self):
        # Direct sums in mixed precision are good to 1e-6, the tree to its default error.
        for method, error in {"direct": 1e-6, "auto": 1e-6, "tree": 5e-4}.items():
            for ranks in (1, 2):
                with self.subTest(method=method, ranks=ranks):
                    process = self.evaluate(
                        "--method", method, "--set", "gravity.softening=500 m", "--verify", 400, ranks=ranks
                    )
                    self.assertEqual((process.returncode, process.stderr), (0, ""))
                    result = json.loads(process.stdout)
                    self.assertEqual((result["particles"], result["verify"]["targets"]), (400, 400))
                    self.assertLess(result["verify"]["rms"], error)
                    self.assertTrue((self.folder / "gravity.hdf").exists())

    def test_wrong_use_is_one_line(self):
        for arguments, words in {
            ("--set", "gravity.foo=1"): "gravity.softening",
            ("--set", "gravity.softening=3 s"): "length",
            ("--method", "magic"): "direct, tree",
        }.items():
            with self.subTest(arguments=arguments):
                process = self.evaluate(*arguments)
                self.assertEqual(process.returncode, 2)
                self.assertIn(words, process.stderr)
                self.assertEqual(process.stderr.count("\n"), 1)

    def test_file_without_particles(self):
        self.particles = self.folder / "nothing.hdf"
        self.assertEqual(self.evaluate().returncode, 4)


if __name__ == "__main__":
    unittest.main()
