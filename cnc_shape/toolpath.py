"""Toolpath: the programmed geometry, exact: lines and arcs with their lengths. Curves stay curves."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cnc_shape.arrays import FloatArray, IntArray, frozen, frozen_integers
from cnc_shape.errors import InfeasibleError
from cnc_shape.program import Motion, Program


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


def travel_lengths(program: Program) -> FloatArray:
    """XYZ length of every programmed move, (m,) mm: chords, arcs, helices and spirals.

    The radius of an arc whose ends differ goes linearly with the angle from start to end; its length
    is the integral of ``sqrt(r^2 + (dr/dphi)^2 + (dz/dphi)^2)`` over the sweep.
    """
    start = np.vstack([program.start, program.target[:-1]]) if len(program) else program.target
    chord = program.target[:, :3] - start[:, :3]
    length = np.sqrt((chord * chord).sum(axis=1))
    arcs = np.flatnonzero(program.motion == Motion.ARC)
    if arcs.size:
        length[arcs] = _arc_lengths(
            start[arcs, :3],
            program.target[arcs, :3],
            program.center[arcs],
            program.normal[arcs],
            program.sweep[arcs],
        )
    return length


def _arc_lengths(
    start: FloatArray, end: FloatArray, center: FloatArray, normal: FloatArray, sweep: FloatArray
) -> FloatArray:
    """Closed form of the spiral's length; the circle and the helix are its limits."""
    from_center = start - center
    rise = ((end - start) * normal).sum(axis=1)
    to_end = end - center
    radial_start = np.sqrt((from_center * from_center).sum(axis=1))
    in_plane = to_end - rise[:, None] * normal
    radial_end = np.sqrt((in_plane * in_plane).sum(axis=1))
    angle = np.abs(sweep)
    slope = (radial_end - radial_start) / angle  # dr/dphi
    # sqrt(r^2 + w^2) with w^2 = slope^2 + (dz/dphi)^2, r linear in phi: mean over r by Gauss-Legendre,
    # exact to rounding because r changes by 0.1 % at most
    w_v2 = slope**2 + (rise / angle) ** 2
    nodes, weights = np.polynomial.legendre.leggauss(8)
    middle, half = 0.5 * (radial_start + radial_end), 0.5 * (radial_end - radial_start)
    radius = middle[:, None] + half[:, None] * nodes
    return angle * (np.sqrt(radius**2 + w_v2[:, None]) @ weights) / 2.0


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
    start = np.vstack([program.start, program.target[:-1]]) if len(program) else program.target
    moves = (length > 0.0) | (np.abs(program.target - start).max(axis=1, initial=0.0) > 0.0)
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


def extent(program: Program) -> tuple[FloatArray, FloatArray]:
    """True extent of every move, arcs included: lowest and highest coordinates, (m,d) each."""
    start = np.vstack([program.start, program.target[:-1]]) if len(program) else program.target
    low, high = np.minimum(start, program.target), np.maximum(start, program.target)
    for row in np.flatnonzero(program.motion == Motion.ARC):
        center, normal, sweep = program.center[row], program.normal[row], program.sweep[row]
        arm = start[row, :3] - center
        side = np.cross(normal, arm)
        for axis in range(3):
            # the coordinate's extremes lie where its derivative along the circle is zero
            first = np.arctan2(side[axis], arm[axis])
            for angle in first + np.pi * np.arange(-8, 9):
                turn = angle if sweep >= 0.0 else angle
                if 0.0 < turn / sweep < 1.0:
                    value = center[axis] + arm[axis] * np.cos(turn) + side[axis] * np.sin(turn)
                    low[row, axis] = min(low[row, axis], value)
                    high[row, axis] = max(high[row, axis], value)
    return low, high


def check_travel(program: Program, travel: dict[str, tuple[float, float]]) -> None:
    """Refuse the first move that leaves an axis's travel.

    Raises
    ------
    InfeasibleError
        Names the line, the axis, the coordinate and the travel.
    """
    low, high = extent(program)
    for column, axis in enumerate(program.axes):
        lower, upper = travel.get(axis, (-np.inf, np.inf))
        outside = np.flatnonzero((low[:, column] < lower - 1e-9) | (high[:, column] > upper + 1e-9))
        if outside.size:
            row = int(outside[0])
            reached = low[row, column] if low[row, column] < lower else high[row, column]
            raise InfeasibleError(
                f"{axis.upper()} reaches {reached:.6g} mm, beyond its travel of {lower:g} to {upper:g} mm",
                hint="move the part, or widen the axis's travel_mm in the machine file",
                source=program.source,
                line=int(program.line[row]),
            )
