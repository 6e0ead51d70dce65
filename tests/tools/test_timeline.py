"""tools/plot-timeline: a picture of a trace, and one clear line where there is none to draw."""

import json
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

TOOL = Path(__file__).resolve().parents[2] / "tools" / "plot-timeline"


def trace(steps):
    """Two ranks: a fused pass of 2 ms and a grid update of 1 ms in every step."""
    events = [{"name": "process_name", "ph": "M", "pid": 0, "args": {"name": "rank 0"}}]
    for step in range(steps):
        for rank in (0, 1):
            for name, lane, begin, length in (("g2p, stress, p2g", 0, 0.0, 2000.0), ("grid", 0, 2000.0, 1000.0),
                                              ("boundary tiles", 1, 0.0, 500.0), ("sums", 2, 500.0, 900.0)):
                events.append({"name": name, "ph": "X", "pid": rank, "tid": lane, "ts": 3000.0 * step + begin,
                               "dur": length})
    return {"traceEvents": events}


class Timeline(unittest.TestCase):
    def draw(self, content):
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "timeline.json"
            file.write_text(content)
            picture = Path(folder) / "picture.png"
            process = subprocess.run([sys.executable, TOOL, file, "--out", picture], capture_output=True, text=True)
            return process, picture.read_bytes() if picture.exists() else b""

    def test_picture(self):
        process, picture = self.draw(json.dumps(trace(20)))
        self.assertEqual(process.returncode, 0, process.stderr)
        self.assertEqual(picture[:4], b"\x89PNG")

    def test_no_step(self):
        process, picture = self.draw(json.dumps(trace(0)))
        self.assertEqual(process.returncode, 4)
        self.assertIn("run more steps", process.stderr)
        self.assertEqual(picture, b"")

    def test_no_trace(self):
        process, _ = self.draw("not a trace")
        self.assertEqual(process.returncode, 4)
        self.assertEqual(len(process.stderr.strip().splitlines()), 1, process.stderr)


if __name__ == "__main__":
    unittest.main()
