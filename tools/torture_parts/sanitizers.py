"""The tests under sanitizers."""

import os
import re
import subprocess

from torture_parts import clang

# The threaded engine: every loop over threads, the sweep with its phases, gravity of each kind, and whole runs.
THREADED = (
    "test_sim_threads",
    "test_grid_reference",
    "test_gravity_tree",
    "test_gravity_direct",
    "test_gravity_tree_pm",
    "test_gravity_mesh_parts",
)
QUICK_THREADED = ("test_sim_threads",)


def run_address(root, options):
    """All tests with address and undefined-behaviour sanitizers, the long ones included unless --quick."""
    preset = "asan" if options.quick else "asan-all"
    subprocess.run([root / "tools" / "build", preset], check=True)
    environment = dict(
        os.environ,
        # Without slow unwinding the leaks of Open MPI cannot be told from ours; what the sanitizer of g++ 12 guesses of
        # threads' memory in libraries loaded at run time can crash it.
        ASAN_OPTIONS="fast_unwind_on_malloc=0:intercept_tls_get_addr=0",
        LSAN_OPTIONS=f"suppressions={root}/tests/support/lsan.supp:print_suppressions=0",
        UBSAN_OPTIONS="print_stacktrace=1:halt_on_error=1",
    )
    command = ["ctest", "--test-dir", f"build/{preset}", "--output-on-failure", "--no-tests=error", "--timeout", "3600"]
    if options.quick:
        command += ["--label-exclude", "long", "--exclude-regex", "^(grid_reference|gravity_orbit|cli_)"]
    process = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    summary = re.findall(r"\d+% tests passed, (\d+) tests failed out of (\d+)", process.stdout)
    if process.returncode:
        print(process.stdout[-8000:])
    return f"{summary[-1][1] if summary else 'no'} tests", int(summary[-1][0]) if summary else 1


def sees_nothing(root, environment):
    """'' where the sanitizer finds the planted race and nothing in the same loop with a barrier; else what is wrong."""
    for which, races in (("race", True), ("barrier", False)):
        command = [root / "build" / "tsan" / "tests" / "planted_race", which]
        process = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
        if ("data race" in process.stderr) != races or (process.returncode != 0) != races:
            return f"planted_race {which}: exit code {process.returncode}\n{process.stderr[-3000:]}"
    return ""


def run_threads(root, options):
    """Races of the threaded engine. libarcher tells the sanitizer what OpenMP's barriers order."""
    names = QUICK_THREADED if options.quick else THREADED
    clang.build(root, "tsan", "planted_race", *names)
    environment = dict(
        os.environ,
        # Open MPI is not instrumented: what only its own threads touch is left out. Nothing else is suppressed.
        TSAN_OPTIONS="ignore_noninstrumented_modules=1:halt_on_error=1",
        OMP_TOOL_LIBRARIES="/usr/lib/llvm-16/lib/libarcher.so",
        OMP_WAIT_POLICY="passive",
        OMP_NUM_THREADS="4",
    )
    if blind := sees_nothing(root, environment):
        print(blind)
        return "the sanitizer cannot be trusted here", 1
    findings = 0
    for name in names:
        process = subprocess.run(
            [root / "build" / "tsan" / "tests" / name], env=environment, capture_output=True, text=True, check=False
        )
        if process.returncode:
            findings += 1
            print(f"{name}: exit code {process.returncode}\n{process.stdout[-2000:]}{process.stderr[-6000:]}")
    return f"{len(names)} test programs", findings
