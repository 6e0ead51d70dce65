"""Files with damage of all kinds. A checkpoint must be refused with exit code 4, or continued to the results of the intact
one where the damage is outside of what is read: never a crash, a hang, or other results. A snapshot, which has no
checksum, must be analysed or refused with an error of one line: never a crash or a hang."""

import random
import shutil
import subprocess

from torture_parts import runs

STEPS = 24  # of the run whose checkpoint is damaged; it is continued for a window


def add_options(parser):
    parser.add_argument("--count", type=int, default=1000, help="damaged files [1000; 50 with --quick]")
    parser.add_argument("--ranks", type=int, default=1, help="ranks that read them [1]")
    parser.add_argument("--seed", type=int, default=1, help="of the damage [1]")


def mutated(intact, source):
    """A damaged copy and what was done."""
    data = bytearray(intact)
    kind = source.choice(["bit", "byte", "bytes", "zeros", "truncated", "longer", "swapped", "trailer", "repeated", "head"])
    at = source.randrange(len(data))
    length = source.choice([1, 8, 64, 512, 4096])
    if kind == "bit":
        data[at] ^= 1 << source.randrange(8)
    elif kind == "byte":
        data[at] = (data[at] + source.randrange(1, 256)) % 256
    elif kind == "bytes":
        data[at : at + length] = source.randbytes(len(data[at : at + length]))
    elif kind == "zeros":
        data[at : at + length] = bytes(len(data[at : at + length]))
    elif kind == "truncated":
        del data[at:]
    elif kind == "longer":
        data += source.randbytes(length)
    elif kind == "swapped":
        other = source.randrange(len(data))
        data[at], data[other] = data[other], data[at]
    elif kind == "trailer":
        place = len(data) - 1 - source.randrange(24)
        data[place] ^= 1 << source.randrange(8)
    elif kind == "repeated":
        data[at:at] = data[at : at + length]
    elif kind == "head":
        place = source.randrange(min(2048, len(data)))
        data[place] ^= 1 << source.randrange(8)
    return bytes(data), f"{kind} at {at}, length {length}"


def analyse_damaged(root, folder, intact, count, source):
    """Findings among `count` damaged copies of the snapshot `intact`."""
    path = folder / "damaged.hdf"
    findings = 0
    for number in range(count):
        data, what = mutated(intact, source)
        path.write_bytes(data)
        try:
            process = subprocess.run(
                [root / "build" / "release" / "breccia", "analyze", path],
                capture_output=True,
                text=True,
                timeout=120,
                check=False,
            )
            code, errors = process.returncode, process.stderr
        except subprocess.TimeoutExpired:
            code, errors = None, "does not end"
        if code == 0 or (code in (2, 3, 4) and errors.count("error: ") == 1):
            continue
        findings += 1
        kept = folder / f"finding{number}.hdf"
        kept.write_bytes(data)
        print(f"{kept}: {what}: exit code {code}: {errors.strip()[-300:]}", flush=True)
    return findings


def run(root, options):
    count = 50 if options.quick else getattr(options, "count", 1000)
    source = random.Random(getattr(options, "seed", 1))
    folder = runs.fresh(root / "build" / "torture" / "mutate")
    runner = runs.Runner(root, folder, getattr(options, "ranks", 1))
    code, errors = runner.finish(folder / "first", "--steps", STEPS)
    if code != 0:
        print(errors)
        return "the run that makes the checkpoint failed", 1
    intact = sorted((folder / "first").glob("checkpoint_*.h5"))[-1].read_bytes()

    path = folder / "damaged.h5"
    path.write_bytes(intact)
    code, errors = runner.finish(folder / "intact", "--restart", path, "--steps", STEPS + 4)
    if code != 0:
        print(errors)
        return "the intact checkpoint is refused", 1
    expected = runs.results(folder / "intact")

    refused = harmless = findings = 0
    for number in range(count):
        data, what = mutated(intact, source)
        while data == intact:
            data, what = mutated(intact, source)
        path.write_bytes(data)
        out = folder / "continued"
        shutil.rmtree(out, ignore_errors=True)
        code, errors = runner.finish(out, "--restart", path, "--steps", STEPS + 4, timeout=60)
        if code == 4 and errors.count("error: ") == 1:
            refused += 1
        elif code == 0 and not runs.differences(expected, runs.results(out)):
            harmless += 1
        else:
            findings += 1
            kept = folder / f"finding{number}.h5"
            kept.write_bytes(data)
            print(f"{kept}: {what}: exit code {code}: {errors.strip()}", flush=True)
    snapshots = count // 5
    snapshot = (folder / "first" / "snap_0000.hdf").read_bytes()
    findings += analyse_damaged(root, folder, snapshot, snapshots, source)
    checkpoints = f"{count} damaged checkpoints of {len(intact)} bytes, {refused} refused, {harmless} harmless"
    return f"{checkpoints}; {snapshots} damaged snapshots", findings
