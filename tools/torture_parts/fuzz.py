"""libFuzzer targets of tests/fuzz, each from its committed corpus for a bounded time. A finding is a file that
`build/fuzz/fuzz/fuzz_TARGET FILE` repeats; it becomes a test, and goes into the corpus once it is mended."""

import os
import subprocess

from torture_parts import clang, runs

QUICK_SECONDS = 20


def targets(root):
    return sorted(path.name for path in (root / "tests" / "fuzz" / "corpus").iterdir())


def add_options(parser):
    parser.add_argument("--seconds", type=int, default=600, help="for each target [600; 20 with --quick]")
    parser.add_argument("--target", nargs="+", help="only these of tests/fuzz")


def run(root, options):
    seconds = QUICK_SECONDS if options.quick else getattr(options, "seconds", 600)
    clang.build(root, "fuzz", "tests/fuzz")
    # Open MPI never frees some of its memory.
    environment = dict(os.environ, ASAN_OPTIONS="detect_leaks=0:handle_abort=1", UBSAN_OPTIONS="print_stacktrace=1:halt_on_error=1")
    findings = 0
    chosen = getattr(options, "target", None) or targets(root)
    for name in chosen:
        folder = runs.fresh(root / "build" / "torture" / "fuzz" / name)
        grown = folder / "corpus"
        grown.mkdir()
        command = [
            root / "build" / "fuzz" / "fuzz" / f"fuzz_{name}",
            grown,
            root / "tests" / "fuzz" / "corpus" / name,
            f"-max_total_time={seconds}",
            "-timeout=20",
            "-rss_limit_mb=4096",
            "-print_final_stats=1",
            f"-artifact_prefix={folder}/",
        ]
        if (dictionary := root / "tests" / "fuzz" / f"{name}.dict").exists():
            command.append(f"-dict={dictionary}")
        with open(folder / "log", "w", encoding="utf-8", errors="replace") as log:
            code = subprocess.run(
                command, env=environment, stdin=subprocess.DEVNULL, stdout=log, stderr=log, check=False
            ).returncode
        text = (folder / "log").read_text(encoding="utf-8", errors="replace")
        executed = [line.split()[-1] for line in text.splitlines() if "number_of_executed_units" in line]
        print(f"  {name}: {executed[0] if executed else '?'} inputs, {'no finding' if code == 0 else f'see {folder}/log'}")
        findings += code != 0
    return f"{len(chosen)} targets, {seconds} s each", findings
