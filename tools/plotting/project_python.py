"""Runs a tool with the project's own Python where the one it was started with lacks a package."""

import importlib.util
import os
import sys
from pathlib import Path


def ensure_packages(*names):
    """Restarts the script under .venv if a package is missing here; ends with one line if that does not help."""
    missing = [name for name in names if importlib.util.find_spec(name) is None]
    if not missing:
        return
    root = Path(__file__).resolve().parents[2]
    python = root / ".venv" / "bin" / "python3"
    if python.exists() and Path(sys.prefix).resolve() != (root / ".venv").resolve():
        os.execv(python, [str(python), *sys.argv])
    sys.exit(f"error: Python package {missing[0]} is missing: run tools/install-deps")
