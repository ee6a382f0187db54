"""What the law with a jerk limit is built of, each part against an independent definition of it."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy.linalg import solveh_banded

from cnc_shape.kernels.jerk_certificate import largest_loads
from cnc_shape.kernels.jerk_interior import solved
from cnc_shape.kernels.jerk_phases import time_to, travel_time
from cnc_shape.kernels.jerk_pieces import cut, index_pieces, timed

SEEDS = st.integers(0, 10**6)


def least_root(v, a, b, h) -> float:
    roots = np.roots(np.trim_zeros([b / 6.0, a / 2.0, v, -h], "f"))
    real = roots[np.abs(roots.imag) < 1e-9 * np.abs(roots)].real
    return real[real > 0.0].min()


@given(SEEDS)
def test_travel_times_are_roots_of_the_cubic(seed):
    rng = np.random.default_rng(seed)
    v, a, b = 10 ** rng.uniform(-2, 3), 10 ** rng.uniform(0, 4), 10 ** rng.uniform(2, 5)
    h = 10 ** rng.uniform(-4, 2)
    assert_allclose(travel_time(v, a, b, h), least_root(v, a, b, h), rtol=1e-9)
    assert_allclose(travel_time(v, 0.0, b, h), least_root(v, 0.0, b, h), rtol=1e-9)
    braking = (a + np.sqrt(a * a + 2.0 * b * v)) / b  # until v + a t - b t^2/2 is 0
    share = rng.uniform(0.05, 0.9) * (v * braking + a * braking**2 / 2.0 - b * braking**3 / 6.0)
    assert_allclose(time_to(v, a, -b, braking, share), least_root(v, a, -b, share), rtol=1e-9)


@given(SEEDS, st.integers(3, 30))
def test_five_diagonals_are_solved_as_scipy_solves_them(seed, n):
    rng = np.random.default_rng(seed)
    half = np.tril(np.triu(rng.normal(size=(n, n)), -2)) + 3.0 * np.eye(n)
    matrix = half @ half.T
    right = rng.normal(size=n)
    bands = np.zeros((3, n))
    for k in range(3):
        bands[k, : n - k] = np.diag(matrix, -k)
    want = solveh_banded(bands, right, lower=True)
    assert solved(bands[0].copy(), bands[1].copy(), bands[2].copy(), right)
    assert_allclose(right, want, rtol=1e-8, atol=1e-10)
    assert not solved(-np.ones(n), np.zeros(n), np.zeros(n), np.ones(n))


@given(SEEDS)
def test_bounds_of_acceleration_and_jerk_are_above_what_a_piece_asks_for_and_near_it(seed):
    """Where they tell of an excess, they are within a thousandth of it, or of what halving six times leaves."""
    rng = np.random.default_rng(seed)
    c = np.vstack([np.zeros(2), rng.normal(size=2), 0.1 * rng.normal(size=2), 0.05 * rng.normal(size=2)])
    v, a, b, t = rng.uniform(1, 100), rng.uniform(-500, 500), rng.uniform(-3e4, 3e4), rng.uniform(0, 0.02)
    a = max(a, -0.5 * v / t)
    b = max(b, -0.5 * v / t**2)
    acceleration, jerk = np.array([800.0, 500.0]), np.array([5e4, 3e4])
    found = largest_loads(c, 0.0, v, a, b, t, acceleration, jerk, 1.0, 1.0)
    e = np.linspace(0.0, t, 4001)[:, None]
    s, speed, push = v * e + a * e**2 / 2 + b * e**3 / 6, v + a * e + b * e**2 / 2, a + b * e
    first, bend, third = c[1] + 2 * c[2] * s + 3 * c[3] * s**2, 2 * c[2] + 6 * c[3] * s, 6 * c[3]
    asked = (
        (np.abs(first * push + bend * speed**2) / acceleration).max(),
        (np.abs(first * b + 3 * bend * speed * push + third * speed**3) / jerk).max(),
    )
    for bound, most in zip(found, asked, strict=True):
        assert bound >= most * (1.0 - 1e-9)
        if bound > 1.0:
            assert bound <= max(most, 1.0) + 0.02 * most


def test_phases_are_cut_at_the_ends_of_cells():
    """A move of three phases over five cells: places, speeds and times follow from the phases alone."""
    law = np.array(
        [[0.1, 0.0, 0.0, 0.0, 3000.0], [0.2, 0.5, 15.0, 300.0, 0.0], [0.1, 9.5, 75.0, 300.0, -3e3]]
    )
    length = 9.5 + 75.0 * 0.1 + 300.0 * 0.01 / 2 - 3e3 * 0.001 / 6
    nodes = np.array([0.0, 0.25, 3.0, 9.5, 12.0, length])
    pieces, cell = np.empty((12, 6)), np.empty(12, np.int64)
    count = cut(law, np.zeros(3, np.int64), 3, nodes, np.int64(7), pieces, cell)
    pieces, cell = pieces[:count], cell[:count] - 7
    assert cell.tolist() == [0, 1, 1, 2, 3, 4]
    _, duration, place, speed, push, jerk = pieces.T
    at = nodes[cell] + place
    travel = duration * (speed + duration * (push / 2 + duration * jerk / 6))
    assert_allclose(at + travel, [*at[1:], length], atol=1e-9)
    assert_allclose(speed + duration * (push + duration * jerk / 2), [*speed[1:], 90.0], rtol=1e-9)
    clock = np.array([2.0, 0.0])
    timed(pieces, clock)
    assert_allclose(pieces[:, 0], 2.0 + np.concatenate([[0.0], np.cumsum(duration)[:-1]]), rtol=1e-15)
    assert clock[0] == pytest.approx(2.4, rel=1e-15)
    first = np.empty(6, np.int64)
    index_pieces(cell, count, first, 5)
    assert first.tolist() == [0, 1, 3, 4, 5, 6]
