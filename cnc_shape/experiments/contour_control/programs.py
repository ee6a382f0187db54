"""The contours as programs: G-code for the planner, and a table of times that bypasses it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Final

import numpy as np

from cnc_shape.arrays import FloatArray
from cnc_shape.experiments.contour_control.contours import FEED_RATE, Contour, contours
from cnc_shape.experiments.contour_control.time_law import TimeLaw, command
from cnc_shape.program import XYZ, Motion
from cnc_shape.units import MICROMETRE, MM_PER_MIN

CHORD_ERROR: Final = 0.9 * MICROMETRE  # of the lines that stand for a curve in a program
REST: Final = 0.5  # s, before the contour begins
TITLES: Final = {
    "fan": "Fan: a closed spline of three blades, as lines that leave it by 0.9 um at most",
    "circle20": "Circle of radius 20 mm",
    "circle5": "Circle of radius 5 mm, three laps",
    "diamond": "Square on its corner, from the middle of a side",
    "corner": "A right angle",
    "lemniscate": "Lemniscate: a figure of eight, as lines that leave it by 0.9 um at most",
    "helix": "Helix of radius 20 mm and pitch 10 mm, two turns",
}


def program_text(contour: Contour) -> str:
    """G-code of a contour at the paper's feed."""
    moves = contour.moves(contour.length, CHORD_ERROR)
    here = contour.at(np.zeros(1)).position[0]
    lines = [f"({TITLES[contour.name]})", "G17 G21 G90 G94", "G64 P0.001", f"F{FEED_RATE / MM_PER_MIN:g}"]
    if here.any():  # go there as slowly, and rest: the errors of a rapid would be all there is to see
        lines += [f"G1 {_words('XYZ', here)}", f"G4 P{REST:g}"]
    for motion, target, center in zip(moves.motion, moves.target, moves.center, strict=True):
        changed = np.abs(target - here) > 0.0
        if motion is Motion.ARC:
            changed[:2] = True
            arm = _words("IJ", center[:2] - here[:2])
            lines.append(f"G3 {_words(_those(changed), target[changed])} {arm}")
        else:
            lines.append(f"G1 {_words(_those(changed), target[changed])}")
        here = target
    return "\n".join([*lines, "M2"]) + "\n"


def time_table(contour: Contour, law: TimeLaw) -> str:
    """CSV of a contour's motion, one row a sample."""
    motion = command(contour, law)
    rows = [
        f"{k * motion.sample_time:.3f},{x:.7f},{y:.7f}"
        for k, (x, y) in enumerate(motion.position[:, :2].tolist())
    ]
    return "\n".join(["time_s,x_mm,y_mm", *rows]) + "\n"


def sample_files() -> Mapping[str, Callable[[], str]]:
    """Files that are bundled as samples: how their text is made."""
    every = contours()
    files: dict[str, Callable[[], str]] = {
        f"{name}.nc": lambda contour=every[name]: program_text(contour) for name in TITLES
    }
    files["circle5_time.csv"] = lambda: time_table(every["circle5"], TimeLaw())
    return files


def _those(changed: Sequence[bool]) -> str:
    return "".join(axis for axis, moves in zip(XYZ, changed, strict=True) if moves).upper()


def _words(letters: str, values: FloatArray) -> str:
    return " ".join(
        f"{letter}{value:.5f}".rstrip("0").rstrip(".")
        for letter, value in zip(letters, values.round(5) + 0.0, strict=True)
    )
