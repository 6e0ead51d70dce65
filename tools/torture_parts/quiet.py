"""Bodies that rest or turn for as long as a run may last: what creeps while nothing happens."""

import os
import subprocess

PROGRAM = "test_stability_quiet"
FILTER = "QuietForLong.*:QuietTorture.*"
QUICK_FILTER = "Quiet.*"


def run(root, options):
    """The long tests of tests/stability/quiet_test.cpp; their figures are printed."""
    subprocess.run([root / "tools" / "build", "release", PROGRAM], check=True)
    chosen = QUICK_FILTER if options.quick else FILTER
    process = subprocess.run(
        [root / "build" / "release" / "tests" / PROGRAM, f"--gtest_filter={chosen}"],
        env=dict(os.environ, OMP_NUM_THREADS="1"),
        capture_output=True,
        text=True,
        check=False,
    )
    lines = process.stdout.splitlines()
    for line in lines:
        if line.startswith(("at rest", "turning")):
            print(f"  {line}")
    failed = [line for line in lines if line.startswith("[  FAILED  ]") and "ms)" in line]
    if process.returncode:
        print(process.stdout[-4000:] + process.stderr[-1000:])
    passed = sum(line.startswith("[       OK ]") for line in lines)
    return f"{passed + len(failed)} tests", len(failed) if failed else int(process.returncode != 0)
