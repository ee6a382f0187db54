"""How much longer a jerk-limited time law takes than the fastest that sequential linear programs find."""

from dataclasses import replace

import numpy as np
import optimum
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from motions import lines
from numpy.testing import assert_allclose
from scipy.interpolate import BSpline
from test_feedrate import SQUARE, spline_path
from test_jerk import MILL_J, UNLIKE, assert_keeps, corners

from cnc_shape import jerk
from cnc_shape.arrays import frozen
from cnc_shape.kernels.jerk_spline import limit_rows, spline, spline_phases
from cnc_shape.limits import Limits
from cnc_shape.planning import plan
from cnc_shape.smoothing import Path, Smoothing, smooth

FAN = [
    (23.6354, 4.1676), (31.2415, 6.9261), (36.2573, 9.1745), (37.5662, 11.1990), (36.5302, 13.6581),
    (28.5912, 21.5450), (17.3397, 23.8660), (6.6439, 20.4477), (-0.7327, 13.9808), (-5.0, 8.6603),
    (-9.4046, 12.9443), (-15.4269, 18.3851), (-21.6189, 23.5929),
]  # fmt: skip


def mill(j):
    return [Limits(200.0, 2000.0, 2000.0 * j)] * 3


def fed(path: Path, feed_rate: float) -> Path:
    return replace(path, feed_rate=frozen(np.full(len(path), feed_rate)))


def blends(seed, tolerance, n=10) -> Path:
    path = smooth(lines(corners(seed, n), 200.0), Smoothing(tolerance))
    assert not path.stop[1:-1].any()
    return path


def assert_near(path, limits, excess, nodes=500):
    profile = plan(path, limits)
    assert_keeps(profile, limits)
    fastest = optimum.fastest(path, limits, profile, nodes).time
    assert fastest * 0.99 <= profile.end_time <= fastest * (1.0 + excess)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_random_splines(seed):
    path, _ = spline_path(np.random.default_rng(seed).uniform(-30, 30, size=(6, 3)))
    assert_near(fed(path, 250.0), [Limits(300.0, 5000.0, 250_000.0)] * 3, 0.03)


@pytest.mark.parametrize(("j", "excess"), [(50.0, 0.02), (25.0, 0.06)])
def test_a_blade_of_the_fan(j, excess):
    path, _ = spline_path(np.column_stack([FAN, np.zeros(len(FAN))]), 16)
    assert_near(fed(path, 200.0), mill(j), excess)


@pytest.mark.parametrize(
    ("seed", "tolerance", "j", "excess"),
    [
        (1, 0.3, 50.0, 0.02),
        (4, 0.3, 50.0, 0.02),
        (1, 0.1, 25.0, 0.05),
        (1, 1.0, 50.0, 0.02),
        (4, 0.03, 50.0, 0.03),
    ],
)
def test_random_corners(seed, tolerance, j, excess):
    assert_near(blends(seed, tolerance), mill(j), excess)


@pytest.mark.parametrize("angle", [30.0, 90.0, 150.0])
def test_one_corner(angle):
    """Its legs are so short that where the law is given, the first half of its first phase, counts."""
    ahead, aside = 20.0 * np.cos(np.radians(angle + 17.0)), 20.0 * np.sin(np.radians(angle + 17.0))
    start = [20.0 * np.cos(np.radians(17.0)), 20.0 * np.sin(np.radians(17.0))]
    points = [[0.0, 0.0], start, [start[0] + ahead, start[1] + aside]]
    assert_near(smooth(lines(points, 200.0), Smoothing(0.3)), mill(50.0), 0.06)


@pytest.mark.parametrize(("tolerance", "excess"), [(0.035, 0.01), (0.35, 0.005)])
def test_the_square(tolerance, excess):
    path = smooth(lines(SQUARE, 50.0), Smoothing(tolerance))
    assert_near(path, [Limits(1000.0, 500.0, 25_000.0)] * 3, excess)


@settings(max_examples=15)
@given(
    st.integers(0, 10**6),
    st.sampled_from([MILL_J, UNLIKE]),
    st.sampled_from([0.01, 0.3]),
    st.sampled_from([30.0, 200.0]),
)
def test_no_law_gets_slower(seed, limits, tolerance, feed_rate):
    path = smooth(lines(corners(seed), feed_rate), Smoothing(tolerance))
    refined = plan(path, limits)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(jerk, "REFINED_AT_ONCE", -1.0)
        plain = plan(path, limits)
    assert_keeps(refined, limits)
    assert refined.end_time <= plain.end_time * (1.0 + 1e-12)


def test_a_spline_of_squared_speeds_and_its_phases():
    """Nodes of a move with constant jerk: the spline is scipy's, and its phases are that move again."""
    v, a, b = 20.0, 300.0, -2e4
    t = np.sort(np.random.default_rng(1).uniform(0.0, 0.01, 12))
    place = v * t + a * t**2 / 2 + b * t**3 / 6
    speed, steep = v + a * t + b * t**2 / 2, a + b * t
    n, cell = t.size, np.zeros(t.size, np.int64)
    law = np.column_stack([speed**2, steep, b / speed])
    rows = np.zeros((1, 4, 2))
    rows[0, 1] = [0.6, 0.8]
    found, border, centre, c = np.empty(n), np.empty(n + 1), np.empty(n + 2), np.empty(n + 2)
    spline(place, cell, law, np.array([1.0]), found, border, centre, c)
    assert_allclose(found, place - place[0], atol=1e-15)
    x = BSpline(np.concatenate([border[[0, 0]], border, border[[-1, -1]]]), c, 2)
    assert_allclose(x(found), speed**2, rtol=1e-5)
    value, row, cap = np.empty((n, 4, 3)), np.empty((n, 4, 4, 3)), np.empty((n, 4))
    bounds = np.array([2000.0, 1000.0]), np.array([5e4, 3e4])
    limit_rows(
        found,
        border,
        centre,
        place,
        cell,
        rows,
        np.zeros(1),
        np.full((1, 2), 900.0),
        *bounds,
        value,
        row,
        cap,
    )
    for s in (0, 4, n - 1):
        for p, here in ((1, found[s]), (3, border[s + 1])):
            local = c[s : s + 3]
            assert_allclose(value[s, p] @ local, x(here), rtol=1e-12)
            assert_allclose(
                row[s, p, :2] @ local, rows[0, 1] * x(here, 1) / 2 / bounds[0], rtol=1e-9, atol=1e-9
            )
            inner = min(max(here, border[s] + 1e-12), border[s + 1] - 1e-12)
            assert_allclose(
                row[s, p, 2:] @ local, rows[0, 1] * x(inner, 2) / 2 / bounds[1], rtol=1e-6, atol=1e-9
            )
    pieces, piece_cell = np.empty((3 * n, 6)), np.empty(3 * n, np.int64)
    count = spline_phases(c, found, border, centre, place, cell, pieces, piece_cell)
    assert 2 * n < count <= 3 * n
    _, duration, at, v0, a0, b0 = pieces[:count].T
    assert_allclose(duration.sum(), t[-1] - t[0], rtol=1e-6)
    assert_allclose(v0[1:], (v0 + duration * (a0 + duration * b0 / 2))[:-1], rtol=1e-12)
    assert_allclose(a0[1:], (a0 + duration * b0)[:-1], rtol=1e-9)
    assert_allclose(at[1:], (at + duration * (v0 + duration * (a0 / 2 + duration * b0 / 6)))[:-1], atol=1e-13)
    assert_allclose(b0, b, rtol=0.05)
