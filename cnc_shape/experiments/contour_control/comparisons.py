"""What the paper leaves out: contours, controllers, gains, Jacobians, models and feeds side by side."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from cnc_shape.arrays import FloatArray, frozen
from cnc_shape.contour import contour_error
from cnc_shape.controllers import Control, CrossCoupling, Estimator, Form
from cnc_shape.controllers.estimators import circle_error
from cnc_shape.errors import InfeasibleError
from cnc_shape.experiments.contour_control.contours import Places
from cnc_shape.experiments.contour_control.laws import (
    COMMON,
    COMPARED,
    HIGH,
    INDEPENDENT,
    PAPER,
    POSITION_GAIN,
    fed,
    foot,
    tangent,
    variants,
)
from cnc_shape.experiments.contour_control.rigs import (
    CARTESIAN,
    CUBIC,
    PLANTS,
    SHOWN,
    TRIALS,
    Rig,
    errors,
    run,
)
from cnc_shape.experiments.contour_control.time_law import TimeLaw
from cnc_shape.experiments.experiment import Row, Table
from cnc_shape.units import MICROMETRE

SWEPT: Final = (0.0, 5.0, 10.0, 15.0, 20.0, 30.0, 40.0, 80.0, 160.0, 320.0, 640.0)  # Kc, 1/s
KEPT: Final = (1, 10, 100, 1000)  # samples
FROZEN: Final = 10**6
OFF: Final = (0.8, 0.9, 1.0, 1.1, 1.2)  # time constant of the model over the usual one
FEEDS: Final = (8.0, 16.0, 32.0, 64.0)  # mm/s
BEST: Final = "feedforward, foot point, Kc 80"
LAST: Final = 1000  # samples, of a rest at its end
STILL: Final = 1e-3  # µm


def error_row(quantity: str, rig: Rig, trial: str, control: Control, law: TimeLaw | None = None) -> Row:
    """RMS of a trial, its largest error in the note."""
    rms, largest = errors(rig, trial, control, law)
    return Row(quantity, "µm", None, rms, SHOWN, f"RMS; largest {largest:.1f} µm")


def contour_table(rig: Rig) -> Table:
    """Every contour under eight controllers."""
    rows = [
        error_row(f"{trial}: {name}", rig, trial, control)
        for trial in TRIALS
        if trial != "line"
        for name, control in COMPARED.items()
    ]
    return Table(
        f"Beyond the paper: contours on the {rig.name} machine",
        tuple(rows),
        "Kp = 20 1/s. The fan is interpolated every 8 ms, the others every 1 ms; circle20 and circle5 have "
        "radii of 20 and 5 mm (the latter 3 laps), the diamond is a square of 42.4 mm, the corner two "
        "lines of 30 mm, the lemniscate 60 mm wide, the helix has radius 20 mm and pitch 10 mm. Through: "
        "the corners are passed at 16 mm/s, which no planner would do. Feedforward is of velocity and "
        "acceleration, by one model for all drives (τ = 0.0148 s, k = 1); PID is Kc 80 1/s, Ki 800 1/s², "
        "Kd 1.16. All samples count, the rest at the end included.",
    )


def variant_table() -> Table:
    """More controllers on the fan."""
    rows = [
        error_row(name, CUBIC, "fan", control)
        for name, control in variants(PLANTS, POSITION_GAIN).items()
        if control.cross_coupling is None or control.cross_coupling.form is Form.VECTOR
    ]
    return Table(
        "Beyond the paper: more controllers, the fan on the cubic machine",
        tuple(rows),
        f"Kp = {POSITION_GAIN:g} 1/s; Kc, Ki and Kd of a PID are 80 1/s, 800 1/s² and 1.16. Gains matched: "
        "Kp over the gain of each drive. Velocity fed forward alone makes the contour worse than no "
        "feedforward: it bulges outwards by about τ F²/(ρ Kp).",
    )


def sweep_table() -> Table:
    """RMS over the cross-coupling gain."""
    fast = replace(INDEPENDENT, position_gain=30.0)
    shown = (
        ("tangent, Kp 20", tangent, INDEPENDENT),
        ("tangent, Kp 30", tangent, fast),
        ("foot point, Kp 20", foot, INDEPENDENT),
        ("feedforward, foot point, Kp 20", foot, fed(COMMON)),
    )
    rows = [
        error_row(f"{name}, Kc {gain:g}", CUBIC, "fan", estimator(gain, base))
        for name, estimator, base in shown
        for gain in SWEPT
    ]
    return Table(
        "Beyond the paper: how the error depends on the cross-coupling gain, the fan on the cubic machine",
        tuple(rows),
        "By the tangent the error has a minimum at about Kp (1 - 2 Kp τ), 8 1/s here, and beyond 31 1/s "
        "(13 1/s at Kp 30) the loop is worse than independent axes. That is no instability: on a curve the "
        "tangent takes the lag F/Kp along the path for an error of lag²/(2ρ) across it, which the loop "
        "then produces, outwards. The paper asks for a following error that is small enough; at 0.8 mm it "
        "is not. With the foot point on the contour itself the error only falls. One sample of delay "
        "leaves 640 1/s stable and 960 1/s not.",
    )


def estimator_table() -> Table:
    """Three estimators on one motion of independent axes."""
    rows: list[Row] = []
    for name, control in (
        ("Kp 20", INDEPENDENT),
        ("Kp 30", replace(INDEPENDENT, position_gain=30.0)),
        ("Kp 20, feedforward", fed(COMMON)),
    ):
        true, estimates = estimated(control)
        size = np.linalg.norm(true, axis=1)
        rows.append(Row(f"{name}: the contour error itself", "µm", None, _rms(size), SHOWN, "RMS"))
        for estimator, found in estimates.items():
            away = np.linalg.norm(found, axis=1) - size
            most = np.abs(away).max() / MICROMETRE
            rows.append(Row(f"{name}: {estimator}", "µm", None, _rms(away), SHOWN,
                            f"RMS of what it is off by; {most:.1f} µm at most"))  # fmt: skip
    return Table(
        "Beyond the paper: what the estimators make of one and the same motion, the fan on the cubic machine",
        tuple(rows),
        "Independent axes, so that no estimate acts back. All start from e = J φ.",
    )


def _rms(length: FloatArray) -> float:
    return float(np.sqrt((length**2).mean())) / MICROMETRE


def estimated(control: Control) -> tuple[FloatArray, dict[str, FloatArray]]:
    """Contour error vectors (n,3) mm of a run: the true one, and the estimates by name."""
    result = run(CUBIC, "fan", control)
    told, response = result.motion, result.response
    command = told.command
    true = result.error.foot - response.position[:, :3]
    pose = frozen(np.hstack([command.position, np.zeros_like(command.position)]))
    inverse = CUBIC.kinematics.inverse_jacobian(pose)
    error = np.linalg.solve(inverse, response.following_error[:, :, None])[:, :3, 0]
    e = np.ascontiguousarray(error, dtype=np.float64)
    place = told.contour.at(command.arc_length)
    along = (e * place.tangent).sum(axis=1, keepdims=True) * place.tangent
    tool = frozen(command.position - e)
    found = contour_error(tool, told.toolpath, told.lower, told.upper)
    return true, {
        "tangent": e - along,
        "circle of curvature": _by_circle(e, place),
        "foot point": found.foot - tool,
    }


def _by_circle(tracking: FloatArray, place: Places) -> FloatArray:
    """Estimates by the circle of curvature at the command, as the loop makes them, (n,3) mm."""
    found = np.empty_like(tracking)
    frames = np.stack([place.tangent, place.curvature], axis=1)
    for row, frame, error in zip(tracking, frames, found, strict=True):
        circle_error(row, frame, error)
    return found


def policy_table() -> Table:
    """How often the Jacobian has to be new."""
    shown = {
        "tangent, Kc 10": PAPER,
        "foot point, Kc 80": foot(HIGH),
        BEST: COMPARED[BEST],
    }
    rows = [
        error_row(f"{name}, every {every} samples" if every < FROZEN else f"{name}, only at the start",
                  CUBIC, "fan", replace(control, jacobian_every=every))
        for name, control in shown.items()
        for every in (*KEPT, FROZEN)
    ]  # fmt: skip
    return Table(
        "Beyond the paper: how often the Jacobian is taken anew, the fan on the cubic machine",
        tuple(rows),
        "The paper counts on a light load for the controller. Every 10 ms does as well as every 1 ms; one "
        "Jacobian for the whole contour takes 0.8 mm of lag for an error across the path, unless "
        "feedforward leaves no lag to be mistaken.",
    )


def model_table() -> Table:
    """Feedforward by a model that is off."""
    rows: list[Row] = []
    for scale in OFF:
        base = fed(replace(COMMON, model_time_constant=0.0148 * scale))
        for name, control in (("alone", base), ("foot point, Kc 80", foot(HIGH, base)),
                              ("tangent, Kc 80", tangent(HIGH, base))):  # fmt: skip
            rows.append(error_row(f"τ of the model times {scale:g}: {name}", CUBIC, "fan", control))
    return Table(
        "Beyond the paper: feedforward with a model that is off, the fan on the cubic machine",
        tuple(rows),
        "Cross-coupling takes back most of what a wrong model does, and with feedforward the two "
        "estimators are alike: where there is no lag the tangent is the contour.",
    )


def feeds_table() -> Table:
    """The fan at other feeds."""
    rows = [
        error_row(f"{feed:g} mm/s: {name}", CUBIC, "fan", COMPARED[name], TimeLaw(feed_rate=feed))
        for feed in FEEDS
        for name in ("independent", "tangent, Kc 10", BEST)
    ]
    return Table(
        "Beyond the paper: other feeds, interpolated every 1 ms, the fan on the cubic machine", tuple(rows)
    )


def integral_table() -> Table:
    """Section 4.1: the length of the error in an integral controller, on a line."""
    rows: list[Row] = []
    for gain in (400.0, 2000.0):
        for form, name in ((Form.SCALAR, "of the length"), (Form.VECTOR, "of the vector")):
            coupling = CrossCoupling(40.0, Estimator.TANGENT, gain, form=form)
            comes = _comes_to_rest(replace(INDEPENDENT, cross_coupling=coupling))
            rows.append(Row(f"Ki {gain:g} 1/s², {name}: comes to rest (1: it does)", "-", None,
                            float(comes), 0.0,
                            f"within {1e3 * STILL:g} nm of the line in the last of 20 s at "
                            "its end"))  # fmt: skip
    return Table(
        "Section 4.1: the length of the contour error in a controller with an integral",
        tuple(rows),
        f"A line of 50 mm on unlike axes, Kp = {POSITION_GAIN:g} 1/s, Kc = 40 1/s. A length is never below "
        "zero, so its integral only grows: at 400 1/s² the loop chatters, more and more, at 2000 1/s² it "
        "diverges. The paper's own controller is proportional, where length and vector are the same.",
    )


def _comes_to_rest(control: Control) -> bool:
    try:
        error = run(CARTESIAN, "line", control).error
    except InfeasibleError:
        return False
    return float(error.distance[-LAST:].max()) <= STILL * MICROMETRE
