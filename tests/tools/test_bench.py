#!/usr/bin/env python3
"""What breccia_bench refuses before it measures."""

import os
import subprocess
import unittest


class Json(unittest.TestCase):
    def refused(self, file):
        done = subprocess.run([os.environ["BRECCIA_BENCH"], "engine", "--quick", "--seconds", "0.01", "--json", file],
                              capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, 2, done.stderr)
        return done.stderr.splitlines()[0]

    def test_a_file_that_cannot_be_written_is_told_before_the_measurement(self):
        self.assertEqual(self.refused("nowhere/a.json"), "--json: nowhere/a.json: its folder does not exist")
        self.assertEqual(self.refused("."), "--json: .: is a folder")


if __name__ == "__main__":
    unittest.main()
