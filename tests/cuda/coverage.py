"""Which lines of device code the tests have run, from the counters that they leave beside these object files.

Usage: coverage.py [--reset] OBJECT ...
  --reset  removes the counters

Prints the share of each file of src/cuda with device code and ends with 1 if that of all is below 95 %.
"""

import argparse
import json
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
LEAST = 0.95
DEVICE_HEADERS = {"block_hash.hpp", "node_order.hpp", "node_sums.hpp", "particle_update.hpp", "particle_view.hpp",
                  "step_arguments.hpp"}  # fmt: skip


def is_device_code(path):
    return path.parent == ROOT / "src/cuda" and (path.suffix in (".cu", ".cuh") or path.name in DEVICE_HEADERS)


def count_lines(counters):
    """{file: {line: times}}, of all instances of a template together."""
    text = subprocess.run(["gcov", "--json-format", "--stdout", *counters], capture_output=True, text=True, check=True).stdout
    counts = {}
    for document in filter(None, text.splitlines()):
        parsed = json.loads(document)
        for file in parsed["files"]:
            path = (Path(parsed["current_working_directory"]) / file["file"]).resolve()
            if not is_device_code(path):
                continue
            lines = counts.setdefault(path, {})
            for line in file["lines"]:
                number = line["line_number"]
                lines[number] = lines.get(number, 0) + line["count"]
    return counts


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--reset", action="store_true", help="remove the counters")
    parser.add_argument("objects", nargs="+", type=Path)
    options = parser.parse_args()
    counters = [path.with_suffix(".gcda") for path in options.objects]
    if options.reset:
        for path in counters:
            path.unlink(missing_ok=True)
        return 0
    missing = [path.name for path in counters if not path.exists()]
    if missing:
        sys.exit(f"coverage: no test has run {', '.join(missing)}")
    counts = count_lines(counters)
    for path, lines in sorted(counts.items()):
        never = sorted(number for number, times in lines.items() if times == 0)
        share = f"{100 * (1 - len(never) / len(lines)):.1f} %"
        print(f"{path.name:<22} {len(lines):>4} lines {share:>8}  {'never: ' + str(never)[1:-1] if never else ''}")
    every = [times for lines in counts.values() for times in lines.values()]
    share = sum(times > 0 for times in every) / len(every)
    print(f"{'all':<22} {len(every):>4} lines {100 * share:>6.1f} %  at least {100 * LEAST:.0f} %")
    return 0 if share >= LEAST else 1


if __name__ == "__main__":
    sys.exit(main())
