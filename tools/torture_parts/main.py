"""The command line of tools/torture."""

import argparse
import os
import subprocess
import time

import torture_random
from torture_parts import fuzz, kill, methods, mutate, quiet, sanitizers

EPILOG = """\
Without a part all of them run, one after the other. The last line is the summary; the exit code is 0 only if nothing was
found. What was found stays in build/torture/PART with what is needed to repeat it.
"""


def parse(arguments=None):
    parser = argparse.ArgumentParser(prog="tools/torture", description=__doc__, epilog=EPILOG)
    parser.add_argument("--quick", action="store_true", help="the small shares of tools/test --full, a few minutes")
    parts = parser.add_subparsers(dest="part", metavar="PART")
    for name, module, text in (
        ("kill", kill, "kill ranks of a running command at random moments; it must go on bit for bit"),
        ("mutate", mutate, "damage checkpoints; they must be refused or read"),
        ("fuzz", fuzz, "libFuzzer on the parsers and the checkpoint reader (clang-16)"),
        ("random", torture_random, "random scenes; what any run must keep"),
    ):
        part = parts.add_parser(name, help=text, description=text)
        part.add_argument("--quick", action="store_true", default=argparse.SUPPRESS, help="a small share")
        module.add_options(part)
    for name, text in (
        ("methods", "the coarse flagship collision by direct sums and by the particle mesh: the same remnant"),
        ("quiet", "bodies that rest or turn for 8e5 steps and 1e5 s; what creeps"),
        ("sanitize", "all tests under the address and undefined-behaviour sanitizers"),
        ("threads", "the threaded engine under the thread sanitizer (clang-16)"),
    ):
        part = parts.add_parser(name, help=text, description=text)
        part.add_argument("--quick", action="store_true", default=argparse.SUPPRESS, help="a small share")
    return parser.parse_args(arguments)


def mpi_environment(root):
    """What tools/mpi-environment sets, for all that is started from here."""
    command = ["bash", "-c", "source tools/mpi-environment && env -0"]
    for variable in subprocess.run(command, cwd=root, capture_output=True, check=True).stdout.split(b"\0"):
        name, _, value = variable.partition(b"=")
        if name.startswith((b"OMPI_", b"OMP_")):
            os.environ[name.decode()] = value.decode()
    os.environ.setdefault("OMP_NUM_THREADS", "1")


def main(root):
    options = parse()
    os.chdir(root)
    mpi_environment(root)
    parts = {
        "kill": kill.run,
        "mutate": mutate.run,
        "fuzz": fuzz.run,
        "random": torture_random.run,
        "methods": methods.run,
        "quiet": quiet.run,
        "sanitize": sanitizers.run_address,
        "threads": sanitizers.run_threads,
    }
    chosen = [options.part] if options.part else list(parts)
    results = []
    for name in chosen:
        start = time.monotonic()
        summary, findings = parts[name](root, options)
        results.append((name, summary, findings))
        print(f"{name}: {summary}, {findings} findings, {time.monotonic() - start:.0f} s", flush=True)
    total = sum(findings for _, _, findings in results)
    print(f"torture: {len(results)} parts, {total} findings")
    return 1 if total else 0
