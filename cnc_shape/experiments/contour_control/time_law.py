"""Time laws of the experiment: the paper's feed, kept down where chords would leave the contour.

The interpolator moves in straight chords from one interpolation period to the next. On a radius rho a
chord of the length v T leaves the path by ``rho - sqrt(rho^2 - (v T / 2)^2)``, so an error h allows

    v <= 2 sqrt(rho^2 - (rho - h)^2) / T.

Speed rises and falls along the path at a constant rate, from rest to rest.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil

import numpy as np

from cnc_shape.arrays import FloatArray, IntArray, frozen
from cnc_shape.experiments.contour_control.contours import FEED_RATE, Contour, divided
from cnc_shape.kernels.path_limits import chord_speed
from cnc_shape.program import XYZ
from cnc_shape.trajectory import Trajectory

SPACING = 0.05  # mm between the places where the speed is known


@dataclass(frozen=True, slots=True)
class TimeLaw:
    """How fast a contour is run."""

    feed_rate: float = FEED_RATE  # mm/s
    interpolation_period: float = 1e-3  # s, between the ends of chords
    chord_error: float = 1e-3  # mm, the paper's h
    acceleration: float = 160.0  # mm/s^2 along the path
    stops: bool = False  # rest at every corner
    dwell: float = 0.5  # s of rest at the end
    sample_time: float = 1e-3  # s


@dataclass(frozen=True, eq=False, slots=True)
class Speed:
    """Speed over the arc length."""

    arc_length: FloatArray  # (n,) mm
    limit: FloatArray  # (n,) mm/s, what feed and chord error allow
    speed: FloatArray  # (n,) mm/s, what is run
    time: FloatArray  # (n,) s


def speed_along(contour: Contour, law: TimeLaw) -> Speed:
    """Highest speed at every place of a contour."""
    edges = np.array([0.0, *contour.corners, contour.length])
    s = divided(edges, lambda span: ceil(span / SPACING))
    limit = np.minimum(chord_speeds(contour, s, law), law.feed_rate)
    rest = edges if law.stops else edges[[0, -1]]
    v2 = np.where(np.isin(s, rest), 0.0, limit**2)
    gain = 2.0 * law.acceleration * s
    v2 = np.minimum.accumulate(v2 - gain) + gain  # speed up no faster than allowed
    v2 = np.minimum.accumulate((v2 + gain)[::-1])[::-1] - gain  # brake in time
    speed = np.minimum(np.sqrt(np.maximum(v2, 0.0)), limit)  # the sums above round
    time = np.concatenate([[0.0], np.cumsum(2.0 * np.diff(s) / (speed[:-1] + speed[1:]))])
    return Speed(frozen(s), frozen(limit), frozen(speed), frozen(time))


def chord_speeds(contour: Contour, arc_length: FloatArray, law: TimeLaw) -> FloatArray:
    """Speed that the chord error allows at places of a contour (n,) mm, mm/s; the planner's own law."""
    bend = np.linalg.norm(contour.at(arc_length).curvature, axis=1)
    period, error = law.interpolation_period, law.chord_error
    return np.array([chord_speed(curvature, period, error) for curvature in bend.tolist()])


def command(contour: Contour, law: TimeLaw) -> Trajectory:
    """The contour as samples: chords between interpolation points, rest at the end.

    Velocity and acceleration, of which the loop takes tangent and curvature, are those of the contour itself.
    The drives are fed forward the second differences of what they are told, as of any replayed command.
    """
    run = speed_along(contour, law)
    per_chord = round(law.interpolation_period / law.sample_time)
    chords = ceil(run.time[-1] / law.interpolation_period - 1e-9)
    rest = round(law.dwell / law.sample_time)
    step = np.arange(chords * per_chord + rest, dtype=np.float64)
    ends = per_chord * np.arange(chords + 1, dtype=np.float64)
    arc_length = _place(run, law.sample_time * ends)
    points = contour.at(arc_length).position
    columns: list[FloatArray] = [np.interp(step, ends, column) for column in points.T]
    position = np.column_stack(columns)
    velocity, acceleration = _rates(contour, run, law.sample_time * step)
    return Trajectory(
        XYZ,
        law.sample_time,
        frozen(np.interp(step, ends, arc_length)),
        frozen(position),
        frozen(velocity),
        frozen(acceleration),
        replayed=True,
    )


def _span(run: Speed, time: FloatArray) -> tuple[IntArray, FloatArray, FloatArray]:
    """Row of `run` that each time falls into, time since its start and acceleration, constant within it."""
    row = np.clip(np.searchsorted(run.time, time, side="right") - 1, 0, run.time.size - 2)
    since = np.minimum(time, run.time[-1]) - run.time[row]
    rate = np.diff(run.speed)[row] / np.diff(run.time)[row]
    return row, since, rate


def _place(run: Speed, time: FloatArray) -> FloatArray:
    row, since, rate = _span(run, time)
    return np.minimum(run.arc_length[row] + since * (run.speed[row] + 0.5 * rate * since), run.arc_length[-1])


def _rates(contour: Contour, run: Speed, time: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Velocity and acceleration of the contour itself, (n,3) each."""
    row, since, rate = _span(run, time)
    moving = (time < run.time[-1])[:, None]
    speed = (run.speed[row] + rate * since)[:, None]
    place = contour.at(_place(run, time))
    return (
        moving * speed * place.tangent,
        moving * (rate[:, None] * place.tangent + speed**2 * place.curvature),
    )
