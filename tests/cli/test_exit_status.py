"""One rank that fails alone ends the whole job with its code and its line, though the others wait for it."""

import os
import unittest

from command import run_program

FAILING_PROGRAM = os.environ["BRECCIA_FAILING_PROGRAM"]


class ExitStatus(unittest.TestCase):
    def run_failing(self, how, ranks=2):
        return run_program([FAILING_PROGRAM, how], ranks)

    def assert_ends(self, process, code, line):
        self.assertEqual(process.returncode, code, process.stderr)
        self.assertEqual(process.stderr.count("breccia: error: "), 1, process.stderr)
        self.assertIn(line + "\n", process.stderr)

    def test_all_ranks_fail_alike(self):
        self.assert_ends(self.run_failing("all"), 3, "breccia: error: the numbers went wrong")

    def test_one_rank_fails_while_the_others_wait(self):
        self.assert_ends(self.run_failing("one"), 3, "breccia: error: rank 1: the numbers went wrong")

    def test_one_rank_fails_after_the_others_are_done(self):
        self.assert_ends(self.run_failing("last"), 3, "breccia: error: rank 1: the numbers went wrong")

    def test_other_exceptions_are_defects(self):
        self.assert_ends(self.run_failing("defect", 1), 1, "breccia: error: internal error: two lines")

    def test_a_rank_is_lost_at_the_very_end(self):
        line = "rank 0: the end of all other ranks did not come within 1 s; one was killed or hangs"
        self.assert_ends(self.run_failing("lost"), 1, f"breccia: error: {line}")

    def test_success(self):
        process = self.run_failing("none")
        self.assertEqual((process.returncode, process.stderr), (0, ""))


if __name__ == "__main__":
    unittest.main()
