"""SIGKILL to one or all ranks of a run on two ranks, at random moments and while a checkpoint is written, or with --at-end
while the ranks take leave of each other. Whatever is left must be continued by `--restart auto`, and in the end nothing may
differ from the run that nobody disturbed."""

import os
import random
import shutil
import signal
import time

from torture_parts import runs


OTHERS_END = 30  # seconds after a kill, at the latest
LEAVE = 0.08  # seconds from the summary to the end of the processes, about


def add_options(parser):
    parser.add_argument("--count", type=int, default=200, help="kills [200; 10 with --quick]")
    parser.add_argument("--ranks", type=int, default=2, help="ranks of the run [2]")
    parser.add_argument("--at-end", action="store_true", help="kill single ranks after the summary is written")
    parser.add_argument("--seed", type=int, default=1, help="of the random moments [1]")


def kill_some(process, ranks, everyone, random_source):
    victims = ranks if everyone or not ranks else [random_source.choice(ranks)]
    for pid in victims:
        try:
            os.kill(pid, signal.SIGKILL)
        except ProcessLookupError:
            pass


def is_writing(out):
    return any(out.glob("checkpoint_*.part")) or any(out.glob("snap_*.part"))


def wait_for_moment(process, out, length, random_source):
    """Waits for a moment to kill, half of them within the writing of a file."""
    during_writing = random_source.random() < 0.5
    moment = random_source.uniform(0.0, length)
    started = time.monotonic()
    runs.wait_for(lambda: process.poll() is not None or time.monotonic() - started >= moment, length + 1.0)
    if during_writing:
        runs.wait_for(lambda: process.poll() is not None or is_writing(out), 5.0)
        time.sleep(random_source.uniform(0.0, 0.01))


def wait_for_end(process, out, length, random_source):
    runs.wait_for(lambda: process.poll() is not None or (out / "summary.json").exists(), 10.0 * length)
    time.sleep(random_source.uniform(0.0, LEAVE))


def disturb(runner, out, wait, length, everyone, random_source):
    """Starts or continues the run in `out` and kills it once. Returns what was wrong, or None, the seconds that the other
    ranks took to end, and whether there was something to kill."""
    process = runner.start(out, "--restart", "auto")
    wait(process, out, length, random_source)
    ended = process.poll() is not None
    ranks = runs.ranks_of(process)
    kill_some(process, ranks, everyone, random_source)
    killed = time.monotonic()
    try:
        errors = process.communicate(timeout=OTHERS_END)[1]
    except runs.subprocess.TimeoutExpired:
        left = runs.ranks_of(process)
        runs.end(process)
        if left:
            return f"ranks {left} went on for {OTHERS_END} s after a kill", OTHERS_END, True
        runner.stuck_launchers += 1
        return None, 0.0, True
    took = time.monotonic() - killed
    if ended and process.returncode != 0:
        return f"a restart failed with exit code {process.returncode}: {errors.strip().splitlines()[-1:]}", took, True
    return None, took, bool(ranks)


def disturbed(runner, out, planned, at_end, length, random_source):
    """Kills the run in `out` so many times. Returns what was wrong, how many there were, and the longest wait after one."""
    trouble, done, longest = [], 0, 0.0
    for _ in range(planned):
        everyone = not at_end and random_source.random() < 0.5
        wait = wait_for_end if at_end else wait_for_moment
        problem, took, found = disturb(runner, out, wait, length, everyone, random_source)
        done += found or not at_end
        longest = max(longest, took)
        if problem:
            trouble.append(problem)
    return trouble, done, longest


def finished_otherwise(runner, out, whole):
    """Lets the run in `out` end and tells what is not as in the one that nobody disturbed."""
    code, errors = runner.finish(out, "--restart", "auto")
    if code != 0:
        return [f"the last restart failed with exit code {code}: {errors.strip().splitlines()[-1:]}"]
    different = runs.differences(whole, runs.results(out))
    return [f"the results differ in {', '.join(different)}"] if different else []


def run(root, options):
    quick = options.quick
    count = 10 if quick else getattr(options, "count", 200)
    ranks = getattr(options, "ranks", 2)
    random_source = random.Random(getattr(options, "seed", 1))
    folder = runs.fresh(root / "build" / "torture" / "kill")
    runner = runs.Runner(root, folder, ranks)

    start = time.monotonic()
    code, errors = runner.finish(folder / "whole")
    length = time.monotonic() - start
    if code != 0:
        print(errors)
        return "the undisturbed run failed", 1
    whole = runs.results(folder / "whole")
    at_end = getattr(options, "at_end", False)
    if at_end:
        runner.finish(folder / "near", "--until", "36 s")
        (folder / "near" / "summary.json").unlink()

    findings = kills = rounds = 0
    longest = 0.0
    while kills < count:
        out = folder / f"round{rounds}"
        rounds += 1
        if at_end:
            shutil.copytree(folder / "near", out)
        # Several kills on the way of one run: a checkpoint of a continued run is one like any other.
        planned = 1 if at_end else min(random_source.randint(1, 4), count - kills)
        trouble, done, took = disturbed(runner, out, planned, at_end, length, random_source)
        kills += done
        longest = max(longest, took)
        trouble += finished_otherwise(runner, out, whole)
        if trouble:
            findings += 1
            print(f"{out}: {'; '.join(trouble)}", flush=True)
        else:
            shutil.rmtree(out)
    ended = f"all ended within {longest:.1f} s"
    if runner.stuck_launchers:
        ended += f" ({runner.stuck_launchers} times mpirun itself did not, docs/faults.md)"
    return f"{kills} kills in {rounds} runs on {ranks} ranks (one takes {length:.1f} s), {ended}", findings
