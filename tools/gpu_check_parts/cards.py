"""What a card could do at best, from tools/gpu-report."""

import importlib.machinery
import importlib.util
import sys
import tempfile

from .programs import ROOT


def load_report():
    sys.dont_write_bytecode = True
    loader = importlib.machinery.SourceFileLoader("gpu_report", str(ROOT / "tools/gpu-report"))
    report = importlib.util.module_from_spec(importlib.util.spec_from_loader("gpu_report", loader))
    loader.exec_module(report)
    return report


def rooflines(name):
    """Particle-steps/s at best by precision of the card that the driver calls so; or nothing, and why."""
    report = load_report()
    known = sorted(card["driver"] for card in report.CARDS.values())
    if name not in known:
        return {}, f"No roofline for {name}: tools/gpu-report has those of {', '.join(known)}"
    try:
        with tempfile.TemporaryDirectory() as folder:
            rows = report.rooflines(report.costs(folder))
    except SystemExit:  # it has said why
        return {}, f"No roofline for {name}: what a step costs could not be counted"
    return {row["precision"]: row["particle_steps_per_second"] for row in rows if row["driver_name"] == name}, ""
