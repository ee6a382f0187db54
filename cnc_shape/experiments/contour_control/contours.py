"""Contours of the experiment: exact curves over their arc length, and the same as toolpaths.

The paper names its contour, a fan, but does not print its points; ours is chosen and documented here. The
others are what contours are usually tried on: circles, sharp corners, a figure of eight, a helix.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from typing import Final

import numpy as np
from scipy.interpolate import CubicHermiteSpline, CubicSpline

from cnc_shape.arrays import FloatArray, frozen, frozen_integers
from cnc_shape.program import XYZ, Motion, PathMode, Program, vertical_normals
from cnc_shape.toolpath import Toolpath, build_toolpath

FEED_RATE: Final = 16.0  # mm/s, the paper's F
FINE: Final = 0.5e-6  # mm, by which lines that stand for a curve in a toolpath leave it
LEAD_OUT: Final = 2.0  # mm of a closed contour's beginning that follow its end
STRAIGHT: Final = 100.0  # mm, radius from which on a curve counts as one of that radius
TABLE: Final = 40_000  # places of a curve where its arc length is known

# mm: 3 blades of 11 points, the contour closes through its first point
FAN: Final = (
    (23.6354, 4.1676), (31.2415, 6.9261), (36.2573, 9.1745), (37.5662, 11.1990), (36.5302, 13.6581),
    (28.5912, 21.5450), (17.3397, 23.8660), (6.6439, 20.4477), (-0.7327, 13.9808), (-5.0000, 8.6603),
    (-9.4046, 12.9443), (-15.4269, 18.3851), (-21.6189, 23.5929), (-26.0740, 26.8125), (-28.4817, 26.9338),
    (-30.0934, 24.8071), (-32.9541, 13.9882), (-29.3384, 3.0836), (-21.0302, -4.4701), (-11.7414, -7.6249),
    (-5.0000, -8.6603), (-6.5078, -14.6167), (-8.2085, -22.5526), (-9.6226, -30.5189), (-10.1833, -35.9870),
    (-9.0845, -38.1328), (-6.4369, -38.4651), (4.3629, -35.5332), (11.9987, -26.9496), (14.3863, -15.9776),
    (12.4741, -6.3559), (10.0000, 0.0000), (15.9124, 1.6725),
)  # fmt: skip
DIAMOND: Final = ((15.0, 15.0), (0.0, 30.0), (-30.0, 0.0), (0.0, -30.0), (30.0, 0.0), (15.0, 15.0))
CORNER: Final = ((0.0, 0.0), (30.0, 0.0), (30.0, 30.0))
LINE: Final = ((0.0, 0.0), (40.0, 30.0))


@dataclass(frozen=True, eq=False, slots=True)
class Places:
    """Points of a contour with their tangents and curvatures."""

    position: FloatArray  # (n,3) mm
    tangent: FloatArray  # (n,3) unit
    curvature: FloatArray  # (n,3) 1/mm, towards the centre


@dataclass(frozen=True, eq=False, slots=True)
class Moves:
    """Lines and arcs, one row a move, that a contour is made of."""

    motion: Sequence[Motion]
    target: FloatArray  # (m,3) mm
    center: FloatArray  # (m,3) mm
    sweep: FloatArray  # (m,) rad


@dataclass(frozen=True, eq=False, slots=True)
class Contour:
    """A curve over its arc length."""

    name: str
    length: float  # mm
    at: Callable[[FloatArray], Places]  # arc length (n,) mm -> points
    corners: tuple[float, ...]  # mm, places where the direction jumps
    closed: bool
    # up to a place, mm, as a program has it: curves as lines that leave them by no more than an error, mm
    moves: Callable[[float, float], Moves]

    def toolpath(self) -> Toolpath:
        """The contour as programmed: lines and arcs exact, other curves as fine lines.

        A closed one goes on into its beginning, so that overshoot at the end is no contour error.
        """
        moves = self.moves(self.length + self.closed * LEAD_OUT, FINE)
        count = len(moves.motion)
        nan = frozen(np.full(count, np.nan))
        return build_toolpath(
            Program(
                source=self.name,
                axes=XYZ,
                start=frozen(self.at(np.zeros(1)).position[0]),
                motion=frozen_integers([int(motion) for motion in moves.motion]),
                target=frozen(moves.target),
                center=frozen(moves.center),
                normal=frozen(vertical_normals(count)),
                sweep=frozen(moves.sweep),
                feed_rate=frozen(np.full(count, FEED_RATE)),
                dwell=frozen(np.zeros(count)),
                path_mode=frozen_integers(np.full(count, int(PathMode.EXACT_PATH))),
                path_tolerance=nan,
                merge_tolerance=nan,
                line=frozen_integers(np.arange(1, count + 1)),
            )
        )


def circle(name: str, radius: float, laps: int = 1, pitch: float = 0.0) -> Contour:
    """Counter-clockwise about the origin from (radius, 0, 0); with a pitch (mm a lap) a helix."""
    climb = pitch / (2.0 * np.pi)  # mm a radian
    slant = float(np.hypot(radius, climb))  # mm of path a radian
    turn = 2.0 * np.pi
    angle = turn * laps

    def at(arc_length: FloatArray) -> Places:
        phi = arc_length / slant
        cosine, sine, one = np.cos(phi), np.sin(phi), np.ones_like(phi)
        return Places(
            frozen(np.column_stack([radius * cosine, radius * sine, climb * phi])),
            frozen(np.column_stack([-radius * sine, radius * cosine, climb * one]) / slant),
            frozen(np.column_stack([-cosine, -sine, 0.0 * one]) * (radius / slant**2)),
        )

    def moves(until: float, chord_error: float) -> Moves:
        del chord_error  # arcs are exact
        ends = laid_out(slant * angle, [slant * turn * lap for lap in range(1, laps)], until)
        target, start = at(ends[1:]).position, at(ends[:-1]).position
        center = start * np.array([0.0, 0.0, 1.0])
        return Moves([Motion.ARC] * len(target), target, center, np.diff(ends) / slant)

    return Contour(name, slant * angle, at, (), pitch == 0.0, moves)


def polygon(name: str, vertices: Sequence[Sequence[float]]) -> Contour:
    """Straight lines through `vertices`, (x, y) mm each."""
    points = np.array([(x, y, 0.0) for x, y in vertices])
    side = np.diff(points, axis=0)
    size = np.linalg.norm(side, axis=1)
    direction = side / size[:, None]
    place = np.concatenate([[0.0], np.cumsum(size)])
    length, corners = float(place[-1]), tuple(place[1:-1].tolist())
    closed = bool((points[0] == points[-1]).all())

    def at(arc_length: FloatArray) -> Places:
        arc_length = _wrapped(arc_length, length) if closed else arc_length
        row = np.clip(np.searchsorted(place, arc_length, side="right") - 1, 0, len(size) - 1)
        position = points[row] + (arc_length - place[row])[:, None] * direction[row]
        return Places(frozen(position), frozen(direction[row]), frozen(np.zeros_like(position)))

    def moves(until: float, chord_error: float) -> Moves:
        del chord_error  # lines are exact
        return _lines(at(laid_out(length, corners, until)[1:]).position)

    return Contour(name, length, at, corners, closed, moves)


def curve(name: str, of: Callable[[FloatArray, int], FloatArray], knots: FloatArray) -> Contour:
    """A closed smooth plane curve by its parameter.

    Parameters
    ----------
    of
        Parameters (n,), derivative 0, 1 or 2 -> (n,2).
    knots
        Parameters, increasing, between which the curve is smooth to any order.
    """
    per_span = max(TABLE // (knots.size - 1), 1)
    u = divided(knots, lambda span: per_span)
    nodes, weights = np.polynomial.legendre.leggauss(6)
    half = 0.5 * np.diff(u)
    inside = (u[:-1] + half)[:, None] + half[:, None] * nodes
    speed = np.linalg.norm(of(inside.ravel(), 1), axis=1).reshape(inside.shape)
    place = np.concatenate([[0.0], np.cumsum(half * (speed @ weights))])
    parameter = CubicHermiteSpline(place, u, 1.0 / np.linalg.norm(of(u, 1), axis=1))

    length = float(place[-1])

    def at(arc_length: FloatArray) -> Places:
        w = np.clip(parameter(_wrapped(arc_length, length)), u[0], u[-1])
        first, second = of(w, 1), of(w, 2)
        speed_v2 = (first**2).sum(axis=1)[:, None]
        curvature = second / speed_v2 - first * ((first * second).sum(axis=1)[:, None] / speed_v2**2)
        return Places(_in_space(of(w, 0)), _in_space(first / np.sqrt(speed_v2)), _in_space(curvature))

    def moves(until: float, chord_error: float) -> Moves:
        ends = laid_out(length, chord_ends(at, length, chord_error)[1:-1].tolist(), until)
        return _lines(at(ends[1:]).position)

    return Contour(name, length, at, (), True, moves)


def laid_out(length: float, between: Sequence[float], until: float) -> FloatArray:
    """Places where the moves of a contour end, its start first, its own end among them, up to `until` mm."""
    lap = np.array([0.0, *between, length])
    again = length + lap[1:]
    return frozen(np.concatenate([lap, again[again < until], [until][: until > length]]))


def _wrapped(arc_length: FloatArray, length: float) -> FloatArray:
    """Arc length on a closed contour: past its end it begins anew."""
    return np.where(arc_length > length, arc_length - length, arc_length)


def _lines(target: FloatArray) -> Moves:
    none = np.zeros_like(target)
    return Moves([Motion.FEED] * len(target), target, none, none[:, 0])


def divided(edges: FloatArray, parts: Callable[[float], int]) -> FloatArray:
    """Increasing numbers with `edges` among them, the span between two of these in as many parts as asked."""
    spans: list[FloatArray] = [
        np.linspace(a, b, parts(b - a), endpoint=False) for a, b in pairwise(edges.tolist())
    ]
    return frozen(np.concatenate([*spans, edges[-1:]]))


def chord_ends(at: Callable[[FloatArray], Places], length: float, chord_error: float) -> FloatArray:
    """Places (m+1,) mm on a smooth curve, from start to end, whose chords leave it by no more than an error.

    A chord of length L leaves a curve of radius r by ``L^2 / (8 r)``, so ``sqrt(1 / (8 r error))`` chords
    fall on a mm.
    """
    s = np.linspace(0.0, length, TABLE + 1)
    bend = np.maximum(np.linalg.norm(at(s).curvature, axis=1), 1.0 / STRAIGHT)
    density = np.sqrt(bend / (8.0 * chord_error))
    number = np.concatenate([[0.0], np.cumsum(0.5 * (density[:-1] + density[1:]) * np.diff(s))])
    count = int(np.ceil(1.03 * number[-1]))  # a chord's radius is its smallest, not its mean
    ends: FloatArray = np.interp(np.linspace(0.0, float(number[-1]), count + 1), number, s)
    ends[-1] = length
    return frozen(ends)


def _in_space(plane: FloatArray) -> FloatArray:
    return frozen(np.column_stack([plane, np.zeros(len(plane))]))


def fan() -> Contour:
    """The fan: a closed periodic cubic spline over the length of the chords between its points."""
    points = np.array([*FAN, FAN[0]])
    knots = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    spline = CubicSpline(knots, points, bc_type="periodic")
    return curve("fan", lambda u, order: np.asarray(spline(u, order)), knots)


def lemniscate(half_width: float) -> Contour:
    """Bernoulli's lemniscate from (half_width, 0): a figure of eight that crosses itself."""

    def of(u: FloatArray, order: int) -> FloatArray:
        # x + iy = a cos u / (1 - i sin u)
        c, s = np.cos(u), np.sin(u)
        below = 1.0 - 1j * s
        z = c / below
        if order == 1:
            z = (-s + 1j) / below**2
        elif order == 2:
            z = (-c * below + 2.0 * (-s + 1j) * 1j * c) / below**3
        return half_width * np.column_stack([z.real, z.imag])

    return curve("lemniscate", of, np.array([0.0, 2.0 * np.pi]))


@cache
def contours() -> Mapping[str, Contour]:
    """All contours by name."""
    every = (
        fan(),
        circle("circle20", 20.0),
        circle("circle5", 5.0, laps=3),
        polygon("diamond", DIAMOND),
        polygon("corner", CORNER),
        lemniscate(30.0),
        circle("helix", 20.0, laps=2, pitch=10.0),
        polygon("line", LINE),
    )
    return {contour.name: contour for contour in every}
