"""Toolpath: the programmed geometry, exact: lines and arcs with their lengths. Curves stay curves."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from cnc_shape.arrays import FloatArray, IntArray, frozen, frozen_integers
from cnc_shape.errors import InfeasibleError
from cnc_shape.program import ROTARY, XYZ, Motion, Program
from cnc_shape.units import DEGREE


@dataclass(frozen=True, eq=False, slots=True)
class Toolpath:
    """A chunk of the programmed path: segments end to start, d axes, no moves without travel.

    A dwell is a row of its own, of length 0, between the moves it separates.
    """

    source: str
    axes: tuple[str, ...]
    kind: IntArray  # (m,) Motion
    start: FloatArray  # (m,d) mm or rad
    end: FloatArray  # (m,d) mm or rad
    center: FloatArray  # (m,3) mm, arcs: the foot of the axis at the arc's start
    normal: FloatArray  # (m,3) unit normal of the arc's plane
    sweep: FloatArray  # (m,) rad, signed about the normal
    feed_rate: FloatArray  # (m,) mm/s, rad/s for moves of rotary axes alone; inf for rapids
    dwell: FloatArray  # (m,) s
    path_mode: IntArray  # (m,) PathMode
    path_tolerance: FloatArray  # (m,) mm, nan: the machine's
    merge_tolerance: FloatArray  # (m,) mm, nan: the planner's share of the path tolerance
    arc_length: FloatArray  # (m+1,) mm of XYZ travel at the ends of the segments, from the program's start
    line: IntArray  # (m,)

    def __len__(self) -> int:
        return self.kind.size


def _starts(program: Program) -> FloatArray:
    return np.vstack([program.start, program.target[:-1]]) if len(program) else program.target


def _norm(x: FloatArray, y: FloatArray, z: FloatArray) -> FloatArray:
    return np.sqrt(x * x + y * y + z * z)  # term by term: the same bits however many rows stand together


def _dot(a: FloatArray, b: FloatArray) -> FloatArray:
    return a[:, 0] * b[:, 0] + a[:, 1] * b[:, 1] + a[:, 2] * b[:, 2]


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    return np.column_stack([a[:, i - 2] * b[:, i - 1] - a[:, i - 1] * b[:, i - 2] for i in range(3)])


BEYOND = 1e-9  # mm or rad, by which a move may pass the end of a travel: rounding
NO_TRAVEL = 1e-9  # mm, XYZ travel below which a move that turns rotary axes is one of these alone


def travel_lengths(program: Program) -> FloatArray:
    """XYZ length of every programmed move, (m,) mm: chords, arcs, helices and spirals.

    The radius of an arc whose ends differ goes linearly with the angle from start to end; its length
    is the integral of ``sqrt(r^2 + (dr/dphi)^2 + (dz/dphi)^2)`` over the sweep. Where rotary axes turn, less
    than `NO_TRAVEL` is the rounding of increments, and counts as none.
    """
    start = _starts(program)
    chord = program.target[:, :3] - start[:, :3]
    length = _norm(chord[:, 0], chord[:, 1], chord[:, 2])
    arcs = np.flatnonzero(program.motion == Motion.ARC)
    if arcs.size:
        length[arcs] = _arc_lengths(
            start[arcs, :3],
            program.target[arcs, :3],
            program.center[arcs],
            program.normal[arcs],
            program.sweep[arcs],
        )
    if len(program.axes) > len(XYZ):
        length[(length < NO_TRAVEL) & (rotary_travel(program) > 0.0)] = 0.0
    return length


def rotary_travel(program: Program) -> FloatArray:
    """Travel of the rotary axes of every programmed move, (m,) rad: the root of the sum of squares."""
    squares = np.zeros(len(program))
    if len(program):
        for column in range(3, len(program.axes)):
            change = np.diff(program.target[:, column], prepend=program.start[column])
            squares = squares + change * change
    return np.sqrt(squares)


def _arc_lengths(
    start: FloatArray, end: FloatArray, center: FloatArray, normal: FloatArray, sweep: FloatArray
) -> FloatArray:
    """Length of the spiral helix; the circle and the helix are its limits.

    The mean of the integrand over the sweep is taken over the radius by Gauss-Legendre quadrature: exact
    to rounding as long as the radius keeps away from zero.
    """
    arm = start - center
    rise = _dot(end - start, normal)
    last = end - center - rise[:, None] * normal
    radius, last_radius = _norm(arm[:, 0], arm[:, 1], arm[:, 2]), _norm(last[:, 0], last[:, 1], last[:, 2])
    angle = np.abs(sweep)
    slope = (last_radius - radius) / angle  # dr/dphi
    w_v2 = slope * slope + (rise / angle) ** 2
    mean = np.zeros_like(radius)  # of sqrt(r^2 + w^2) over the sweep
    for node, weight in zip(*np.polynomial.legendre.leggauss(16), strict=True):
        at = 0.5 * (radius + last_radius) + 0.5 * (last_radius - radius) * node
        mean += 0.5 * weight * np.sqrt(at * at + w_v2)
    return angle * mean


def build_toolpath(program: Program, arc_length: float = 0.0) -> Toolpath:
    """Turn a chunk of moves into segments; moves that go nowhere are dropped.

    Parameters
    ----------
    program
        Consecutive moves.
    arc_length
        XYZ travel before this chunk, mm.
    """
    length = travel_lengths(program)
    start = _starts(program)
    moves = (length > 0.0) | (rotary_travel(program) > 0.0)
    keep = np.flatnonzero(moves | (program.motion == Motion.DWELL))
    return Toolpath(
        source=program.source,
        axes=program.axes,
        kind=frozen_integers(program.motion[keep]),
        start=frozen(start[keep]),
        end=frozen(program.target[keep]),
        center=frozen(program.center[keep]),
        normal=frozen(program.normal[keep]),
        sweep=frozen(program.sweep[keep]),
        feed_rate=frozen(program.feed_rate[keep]),
        dwell=frozen(program.dwell[keep]),
        path_mode=frozen_integers(program.path_mode[keep]),
        path_tolerance=frozen(program.path_tolerance[keep]),
        merge_tolerance=frozen(program.merge_tolerance[keep]),
        arc_length=frozen(np.cumsum(np.concatenate([[arc_length], length[keep]]))),
        line=frozen_integers(program.line[keep]),
    )


ToolpathStep: TypeAlias = Callable[[float | None, Program, bool], tuple[float, Toolpath]]


def building() -> ToolpathStep:
    """Return the stage Program -> Toolpath as a fold: ``step(state, program, last) -> (state, toolpath)``.

    The state is the arc length so far, mm; None starts. It is summed move by move, so that chunks of any
    size give the same bits.
    """

    def step(state: float | None, program: Program, last: bool) -> tuple[float, Toolpath]:
        del last  # nothing is held back
        toolpath = build_toolpath(program, 0.0 if state is None else state)
        return float(toolpath.arc_length[-1]), toolpath

    return step


def extent(program: Program) -> tuple[FloatArray, FloatArray]:
    """Lowest and highest coordinates that each move reaches, (m,d) each, its start apart.

    An arc reaches beyond its ends where a coordinate's derivative along it is zero.
    """
    low, high = program.target.copy(), program.target.copy()
    arcs = np.flatnonzero(program.motion == Motion.ARC)
    if arcs.size:
        start = _starts(program)[arcs, :3]
        lowest, highest = _arc_extent(
            start, program.target[arcs, :3], program.center[arcs], program.normal[arcs], program.sweep[arcs]
        )
        low[arcs, :3] = np.minimum(low[arcs, :3], lowest)
        high[arcs, :3] = np.maximum(high[arcs, :3], highest)
    return low, high


def _arc_extent(
    start: FloatArray, end: FloatArray, center: FloatArray, normal: FloatArray, sweep: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Extremes of arcs strictly inside their sweep, (k,3) each; inf and -inf where there are none.

    After the angle t a coordinate is ``c + r(t) A cos(t - t0) + h t``, the radius r linear in t. Its
    derivative vanishes near t0 + k pi, once for each k; Newton's method goes from there. As r and the height
    are linear in t, only the first and the last extreme of each kind can be the outermost: that bounds the
    work for any number of turns.
    """
    arm = start - center
    rise = _dot(end - start, normal)
    last = end - center - rise[:, None] * normal
    radius, last_radius = _norm(arm[:, 0], arm[:, 1], arm[:, 2]), _norm(last[:, 0], last[:, 1], last[:, 2])
    total = np.abs(sweep)[:, None, None]
    along = arm / radius[:, None]
    across = _cross(normal, along) * np.sign(sweep)[:, None]
    share = np.sqrt(along * along + across * across)[:, :, None]  # A, 0 along the normal
    climb = normal[:, :, None] * rise[:, None, None] / total  # h
    slope = (last_radius - radius)[:, None, None] / total
    origin = np.arctan2(across, along)[:, :, None]  # t0
    first = np.floor(-origin / np.pi)
    final = np.ceil((total - origin) / np.pi)
    half_turns = np.concatenate([first, first + 1, first + 2, final - 2, final - 1, final], axis=2)
    angle = origin + np.pi * half_turns
    relative_climb = climb / np.maximum(share, 1e-12)
    for _ in range(6):
        r = radius[:, None, None] + slope * angle
        cosine, sine = np.cos(angle - origin), np.sin(angle - origin)
        with np.errstate(divide="ignore", invalid="ignore"):
            step = (slope * cosine - r * sine + relative_climb) / (2.0 * slope * sine + r * cosine)
        angle = angle + np.where(np.abs(step) < 1.0, step, 0.0)
    r = radius[:, None, None] + slope * angle
    value = center[:, :, None] + r * share * np.cos(angle - origin) + climb * angle
    inside = (angle > 0.0) & (angle < total)
    return np.where(inside, value, np.inf).min(axis=2), np.where(inside, value, -np.inf).max(axis=2)


def check_travel(
    program: Program, travel: Mapping[str, tuple[float, float]]
) -> tuple[FloatArray, FloatArray]:
    """Refuse the first move that leaves an axis's travel; return the extent of all moves.

    Raises
    ------
    InfeasibleError
        Names the line, the axis, the coordinate and the travel.
    """
    low, high = extent(program)
    for column, axis in enumerate(program.axes):
        lower, upper = travel.get(axis, (-np.inf, np.inf))
        outside = np.flatnonzero((low[:, column] < lower - BEYOND) | (high[:, column] > upper + BEYOND))
        if outside.size:
            row = int(outside[0])
            reached = low[row, column] if low[row, column] < lower - BEYOND else high[row, column]
            unit, key, scale = ("°", "travel_deg", DEGREE) if axis in ROTARY else (" mm", "travel_mm", 1.0)
            raise InfeasibleError(
                f"{axis.upper()} reaches {reached / scale:.6g}{unit}, "
                f"beyond its travel of {lower / scale:g} to {upper / scale:g}{unit}",
                hint=f"move the part, or widen the axis's {key} in the machine file",
                source=program.source,
                line=int(program.line[row]),
            )
    return low, high
