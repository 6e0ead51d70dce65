"""Builds of the presets that need clang-16."""

import shutil
import subprocess


def build(root, preset, *targets):
    """Installs clang if it is missing, and builds `targets` (folders or names) of a preset."""
    if not shutil.which("clang++-16"):
        subprocess.run([root / "tools" / "install-deps", "clang"], check=True)
    named = [f"{target}/all" if "/" in target else target for target in targets]
    subprocess.run([root / "tools" / "build", preset, *named], check=True)
