"""What the interval of the samples costs: the vibration that a ZV shaper leaves, by way of interpolation.

``python benchmarks/intervals.py [--write FILE]``. With ``--write`` the table replaces what stands between the
two markers in FILE. The worst place of the second impulse is half way between two samples; the RMS is over
intervals that lie up to 10 per cent around the one of the row, so that no interval is lucky.
"""

from __future__ import annotations

import sys
from argparse import ArgumentParser
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from benchmarks.table import aligned, placed
from cnc_shape.modes import Mode
from cnc_shape.shapers import zv
from cnc_shape.shapers.analysis import residual_vibration
from cnc_shape.shapers.discretisation import Interpolation, discretise, worst_residual

INTERVALS = (0.005, 0.01, 0.02, 0.05, 0.1, 0.2)  # of the period
AROUND = np.linspace(0.9, 1.1, 401)
SOLVED = 1e-12  # what an exact answer may leave
MODE = Mode(1.0, 0.0)


def percent(value: float) -> str:
    """Two or three figures, and plainly 0 for rounding errors."""
    return "0" if value < SOLVED else f"{100.0 * value:.2g}"


def rms(interpolation: Interpolation, interval: float) -> float:
    """Residual vibration over intervals around one."""
    shaper = zv(MODE)
    taps = [discretise(shaper, interval * factor, interpolation, [MODE]) for factor in AROUND]
    left = [float(residual_vibration(tap.shaper, MODE)) for tap in taps]
    return float(np.sqrt(np.mean(np.square(left))))


def table() -> str:
    """Return the table in Markdown."""
    ways = tuple(Interpolation)
    names = [f"{way.value} {what}" for what in ("worst", "RMS") for way in ways]
    rows = [["interval / period", *(f"{name} %" for name in names)]]
    for interval in INTERVALS:
        worst = [percent(worst_residual(way, interval, MODE)) for way in ways]
        rows.append([f"{interval:g}", *worst, *(percent(rms(way, interval)) for way in ways)])
    return aligned(rows)


def main() -> None:
    """Print the table, or write it into a document."""
    arguments = ArgumentParser(description="What the interval of the samples costs.")
    arguments.add_argument("--write", metavar="FILE", type=Path, help="put the table into this document")
    wanted = arguments.parse_args()
    produced = table()
    print(produced)
    if wanted.write:
        wanted.write.write_text(placed(wanted.write.read_text(encoding="utf-8"), produced), encoding="utf-8")


if __name__ == "__main__":
    main()
