"""The rows of paper 004: what it claims, and contour errors that it does not print."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from cnc_shape.contour import contour_error
from cnc_shape.experiments.contour_control.better import better_table
from cnc_shape.experiments.contour_control.comparisons import (
    contour_table,
    estimator_table,
    feeds_table,
    integral_table,
    model_table,
    policy_table,
    sweep_table,
    variant_table,
)
from cnc_shape.experiments.contour_control.contours import FEED_RATE, contours
from cnc_shape.experiments.contour_control.equations import drives_table, estimate_table, jacobian_table
from cnc_shape.experiments.contour_control.laws import INDEPENDENT, PAPER, POSITION_GAIN, tangent
from cnc_shape.experiments.contour_control.rigs import CARTESIAN, CUBIC, SHOWN, SMOOTH, errors, motion, run
from cnc_shape.experiments.contour_control.time_law import speed_along
from cnc_shape.experiments.experiment import Row, Table
from cnc_shape.units import MICROMETRE

ROUNDED: Final = 0.02  # µm, by which the radius within a chord may fall short of that at its start


def tables() -> Sequence[Table]:
    """All tables, in the paper's order."""
    return (
        jacobian_table(),
        estimate_table(),
        drives_table(),
        integral_table(),
        feed_table(),
        claim_table(),
        better_table(),
        contour_table(CARTESIAN),
        contour_table(CUBIC),
        variant_table(),
        sweep_table(),
        estimator_table(),
        policy_table(),
        model_table(),
        feeds_table(),
    )


def feed_table() -> Table:
    """Section 5: the feed and its regulation."""
    fan = contours()["fan"]
    law, told = speed_along(fan, SMOOTH), motion("fan", SMOOTH, POSITION_GAIN)
    interpolated = contour_error(told.command.position, told.toolpath, told.lower, told.upper)
    inside = (law.arc_length > 1.0) & (law.arc_length < fan.length - 1.0)
    bend = float(np.linalg.norm(fan.at(law.arc_length).curvature, axis=1).max())
    limit = (FEED_RATE * 1e-3) ** 2 / (8.0 * MICROMETRE)
    return Table(
        "Section 5, Fig. 4: the fan, and the feed along it",
        (
            Row("largest feed", "mm/s", 16.0, float(law.speed.max()), 0.5, "of the time law"),
            Row("largest interpolation error", "µm", 1.0, interpolated.max / MICROMETRE, ROUNDED,
                "of the commanded chords against the spline, one every 8 ms; above 1 by what the radius "
                "varies within a chord"),
            Row("smallest feed on the way", "mm/s", None, float(law.speed[inside].min()), SHOWN,
                "where the spline is most curved"),
            Row("length run below the feed", "%", None,
                100.0 * float((law.speed < FEED_RATE * (1.0 - 1e-9)).mean()), SHOWN,
                "ramps at both ends included"),
            Row("duration", "s", None, told.command.sample_time * (len(told.command) - 1), 5e-4,
                "with 0.5 s of rest"),
            Row("smallest radius of the fan", "mm", None, 1.0 / bend, SHOWN, "at the root of a blade"),
            Row("radius below which the feed is regulated at all, 1 ms", "mm", None, limit, 5e-4,
                "(F T)^2 / (8 h)"),
        ),
        "The paper shows its fan without points and gives no sample time. Ours has 33 points, is 253.3 mm "
        "long and a closed cubic spline; its time law ramps at 160 mm/s². With 16 mm/s and 1 µm the feed "
        "can only be regulated where the radius is below (F T)²/(8 h): 0.03 mm at a period of 1 ms, 2 mm "
        "at 8 ms. So for the paper's regulation to act on a smooth fan, its interpolator must be as slow "
        "as 8 ms, which is taken here; the loops run at 1 ms between.",
    )  # fmt: skip


def claim_table() -> Table:
    """Section 5, Figs. 5 and 6: independent axes against the paper's controller."""
    alone, coupled = errors(CUBIC, "fan", INDEPENDENT), errors(CUBIC, "fan", PAPER)
    high = errors(CUBIC, "fan", tangent(40.0))
    return Table(
        "Section 5, Figs. 5 and 6: independent axes and cross-coupling, the fan on the cubic machine",
        (
            Row("cross-coupling makes the RMS smaller (1: it does)", "-", 1.0,
                float(coupled[0] < alone[0]), 0.0,
                f"Kc = 10 1/s, half of Kp: {alone[0]:.2f} µm become {coupled[0]:.2f} µm"),
            Row("cross-coupling makes the largest smaller (1: it does)", "-", 1.0,
                float(coupled[1] < alone[1]), 0.0,
                f"Kc = 10 1/s: {alone[1]:.1f} µm become {coupled[1]:.1f} µm"),
            Row("the same at twice Kp (1: it does)", "-", 1.0, float(high[0] < alone[0]), 0.0,
                f"Kc = 40 1/s: {alone[0]:.2f} µm become {high[0]:.2f} µm. The paper puts no condition on "
                "its gain; it would have to: see the sweep below"),
            Row("following error of independent axes, largest", "µm", None,
                _following(), 0.5,
                "16 mm/s over 20 1/s is 0.8 mm: the paper calls independent control very effective here, "
                "without a number"),
        ),
        "What the paper shows is curves without numbers, and its gains, its geometry and the points of its "
        "fan are not told. So this is the claim alone, on a machine, a fan and gains that we chose: it "
        "holds where the cross-coupling gain is about half the position gain, Kp = 20 1/s, or with "
        "feedforward. Besides, the caption of Fig. 4 speaks of biaxial experiments where there is a "
        "simulation of six axes, the text calls Fig. 6 a second Fig. 5, the error of the joints is φ in "
        "section 2.2 and e in 4.1, and the work cited as [5] in the introduction is not the [5] of its list.",
    )  # fmt: skip


def _following() -> float:
    """Largest distance from the command, µm."""
    response = run(CUBIC, "fan", INDEPENDENT).response
    away = np.linalg.norm(response.command.position - response.position, axis=1)
    return float(away.max()) / MICROMETRE
