"""Profile: the fastest time law that keeps velocity, acceleration and feed."""

from dataclasses import replace

import naive
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from motions import MILL, lines, refined, wander
from numpy.testing import assert_allclose
from paths import arc, dwell, line, toolpath
from scipy.interpolate import CubicSpline

from cnc_shape.arrays import frozen, frozen_integers
from cnc_shape.certificate import worst_violation
from cnc_shape.errors import InfeasibleError
from cnc_shape.feedrate import Profile, rotary_only
from cnc_shape.kernels.speed_limits import speed_limits
from cnc_shape.kernels.time_law import WORTH, backward, largest_start, quickest_start
from cnc_shape.limits import Limits
from cnc_shape.planning import plan, planning
from cnc_shape.program import PathMode
from cnc_shape.smoothing import Path, Smoothing, join_paths, smooth

NO_LIMIT = frozen(np.empty(0))
SQUARE = [[0, 0], [20, 0], [20, 20], [0, 20], [0, 0]]


def planned(whole, limits=MILL, tolerance=0.01) -> Profile:
    return plan(smooth(whole, Smoothing(tolerance)), limits)


def assert_keeps(profile, limits, points=33):
    found = worst_violation(profile, limits, points)
    assert found.worst <= 1e-6
    assert found.gap <= 1e-9
    assert found.jump <= 1e-7


@settings(max_examples=300)
@given(
    d=st.floats(-4, 4).map(lambda x: 10**x),
    v=st.floats(0, 3).map(lambda x: 10**x),
    a=st.floats(1, 5).map(lambda x: 10**x),
    heading=st.floats(0, 6.28),
)
def test_rest_to_rest_is_the_closed_form(d, v, a, heading):
    along = np.array([np.cos(heading), np.sin(heading)])
    profile = planned(lines([[0, 0], d * along], v), [Limits(2000.0, a)] * 3)
    most = a / np.abs(along).max()
    time = d / v + v / most if d >= v * v / most else 2 * np.sqrt(d / most)
    assert_allclose(profile.end_time, time, rtol=1e-9)


def test_square_numbers():
    """A square of 20 mm at F 50 mm/s, 500 mm/s^2; LinuxCNC: 2.049, 2.073 and 1.960 s."""
    limits = [Limits(1000.0, 500.0)] * 3
    stop = planned(lines(SQUARE, 50.0, PathMode.EXACT_STOP), limits)
    assert_allclose(stop.end_time, 2.0, rtol=1e-12)
    small, large = (planned(lines(SQUARE, 50.0, tolerance=p), limits) for p in (0.035, 0.35))
    assert small.end_time <= 1.946
    assert large.end_time <= 1.808
    for profile in (stop, small, large):
        assert_keeps(profile, limits)


@pytest.mark.parametrize("step", [0.01, 0.05, 0.3, 1.0])
def test_a_circle_of_short_lines_runs_at_the_speed_of_its_curvature(step):
    """R 5 mm at 100 mm/s, rounded to 1e-4 mm; one that stops half-way to its neighbours takes 2.29 s."""
    angle = np.linspace(0.0, 2 * np.pi, round(10 * np.pi / step) + 1)
    profile = planned(lines(np.round(5.0 * np.column_stack([np.cos(angle), np.sin(angle)]), 4)))
    assert profile.end_time <= (0.5 if step < 0.5 else 0.53)
    assert_keeps(profile, MILL)


def test_a_zigzag_within_the_tolerance_is_a_straight():
    n = 5000
    points = np.column_stack([0.02 * np.arange(n + 1), 0.004 * (np.arange(n + 1) % 2)])
    assert_allclose(planned(lines(points)).end_time, 100 / 100 + 100 / 2000, rtol=1e-3)
    assert planned(lines(points, tolerance=0.003)).end_time > 1.5  # it has to be followed


@pytest.mark.parametrize("heading", [0.0, 0.3])
def test_a_straight_of_100_000_blocks_reaches_its_feed_and_brakes_in_time(heading):
    s = 0.01 * np.arange(100_001)
    profile = planned(lines(np.column_stack([s * np.cos(heading), s * np.sin(heading)]), 180.0))
    most = 2000.0 / np.cos(heading)
    assert_allclose(profile.end_time, 1000 / 180 + 180 / most, rtol=1e-9)


def test_a_change_of_feed_on_a_straight_and_in_a_hat():
    straight = planned(lines([[0, 0], [10, 0], [20, 0]], [30.0, 90.0]), [Limits(200.0, 1000.0)] * 3)
    assert_allclose(straight.end_time, 10 / 30 + 30 / 2000 + _to_rest(10, 30, 90, 1000), rtol=1e-9)
    hat = planned(lines([[0, 0], [10, 0], [20, 1], [30, 0]], [30.0, 90.0, 20.0]))
    for profile in (straight, hat):
        found = worst_violation(profile, MILL, 33)
        assert found.feed <= 1e-6
        assert_keeps(profile, MILL)


def _to_rest(d, v0, v1, a):
    """Rise from v0 to v1, cruise, fall to rest."""
    rise, fall = (v1 * v1 - v0 * v0) / (2 * a), v1 * v1 / (2 * a)
    return (v1 - v0) / a + (d - rise - fall) / v1 + v1 / a


def spline_path(points, per_span=64) -> tuple[Path, CubicSpline]:
    """A cubic spline through `points` over its chord length, in equal cells, from rest to rest."""
    knots = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    spline = CubicSpline(knots, points)
    share = np.arange(per_span) / per_span
    u = (knots[:-1, None] + share * np.diff(knots)[:, None]).ravel()
    length = np.repeat(np.diff(knots) / per_span, per_span)
    coefficients = np.stack([spline(u), spline(u, 1), spline(u, 2) / 2, spline(u, 3) / 6], axis=1)
    rest = np.zeros((1, 4, 3))
    rest[0, 0] = points[-1]
    n = u.size + 1
    stop = np.zeros(n, np.bool_)
    stop[[0, -1]] = True
    path = Path(
        ("x", "y", "z"), frozen(np.append(u, knots[-1])), frozen(np.append(length, 0.0)),
        frozen(np.concatenate([coefficients, rest])), frozen(np.full(n, 1e4)), stop, frozen(np.zeros(n)),
        frozen(np.append(u, knots[-1])), frozen(np.ones(n)), frozen_integers(np.arange(1, n + 1)),
    )  # fmt: skip
    return path, spline


def toppra_time(curve, nodes, limits) -> float:
    """Time by TOPP-RA (Pham & Pham 2018) on the same path and nodes, rest to rest."""
    toppra = pytest.importorskip("toppra")
    velocity = np.array([[-limit.velocity, limit.velocity] for limit in limits])
    acceleration = np.array([[-limit.acceleration, limit.acceleration] for limit in limits])
    constraints = [
        toppra.constraint.JointVelocityConstraint(velocity),
        toppra.constraint.JointAccelerationConstraint(
            acceleration, discretization_scheme=toppra.constraint.DiscretizationType.Interpolation
        ),
    ]
    method = toppra.algorithm.TOPPRA(constraints, curve, gridpoints=nodes)
    _, speed, _ = method.compute_parameterization(0.0, 0.0)
    return float((2 * np.diff(nodes) / (speed[1:] + speed[:-1])).sum())


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_smooth_splines_take_the_time_of_toppra(seed):
    toppra = pytest.importorskip("toppra")
    points = np.random.default_rng(seed).uniform(-30, 30, size=(6, 3))
    path, spline = spline_path(points)
    profile = plan(path, MILL)
    curve = toppra.SplineInterpolator(spline.x, points, bc_type="not-a-knot")
    assert_allclose(profile.end_time, toppra_time(curve, path.u, MILL), rtol=1e-3)
    assert_keeps(profile, MILL)


@pytest.mark.filterwarnings("ignore")
def test_hats_take_the_time_of_toppra():
    toppra = pytest.importorskip("toppra")
    angle = np.linspace(0.0, 3.0, 30)
    points = np.column_stack([20 * angle, 6 * np.sin(3 * angle) + 2 * np.cos(7 * angle)])
    path = refined(smooth(lines(points, np.inf), Smoothing(0.05)), 16)

    class Hats(toppra.interpolator.AbstractGeometricPath):
        dof = 3
        path_interval = np.array([0.0, path.u[-2] + path.length[-2]])
        waypoints = None

        def __call__(self, at, order=0):
            at = np.atleast_1d(at)
            k = np.clip(np.searchsorted(path.u[:-1], at, side="right") - 1, 0, len(path) - 2)
            e, c = (at - path.u[k])[:, None], path.coefficients[k]
            if order == 0:
                return c[:, 0] + e * (c[:, 1] + e * (c[:, 2] + e * c[:, 3]))
            return (
                c[:, 1] + e * (2 * c[:, 2] + 3 * e * c[:, 3]) if order == 1 else 2 * c[:, 2] + 6 * e * c[:, 3]
            )

    profile = plan(path, MILL)
    nodes = path.u[:-1][path.length[:-1] > 1e-6]
    nodes = np.append(nodes, Hats.path_interval[1])
    assert_allclose(profile.end_time, toppra_time(Hats(), nodes, MILL), rtol=1e-3)
    assert_keeps(profile, MILL)


@settings(max_examples=200)
@given(st.integers(0, 10**6), st.sampled_from([3, 5]), st.booleans(), st.sampled_from([0.0, 1e-3, 0.3, 3.0]))
def test_speed_limits_of_curved_cells_equal_their_slow_twin(seed, d, alone, bend):
    rng = np.random.default_rng(seed)
    alone = alone and d > 3
    rows, length = rng.normal(size=(4, d)), 10 ** rng.uniform(-2, 1)
    rows[1] /= np.linalg.norm(rows[1, 3:] if alone else rows[1, :3]) * rng.choice([1.0, 1.3])
    rows[2:] *= bend * np.array([[1.0], [1.0 / length]]) / length
    rows[2, 0] += 0.01 / length  # curved in any case
    feed_rate, velocity = 10 ** rng.uniform(0, 3), 10 ** rng.uniform(1, 3, d)
    limit_v2, straight = speed_limits(
        frozen(rows[None]), frozen([length]), frozen([feed_rate]), frozen_integers([alone]),
        frozen(velocity), frozen(np.full(d, 1e-9)),
    )  # fmt: skip
    assert straight[0] == 0.0
    assert_allclose(limit_v2[0], naive.speed_limits(rows, length, feed_rate, alone, velocity), rtol=1e-9)


def test_a_long_gentle_curve_is_braked_at_its_end_alone():
    """A hat of 3 mm half-width over a turn of 1 degree: two cells, in each of which rise and fall have room."""
    turn = np.deg2rad(1.0)
    whole = lines([[0, 0], [3, 0], [3 + 3 * np.cos(turn), 3 * np.sin(turn)]], 1.5)
    profile = planned(whole)
    assert len(profile.path) <= 4
    assert_keeps(profile, MILL)
    assert_allclose(profile.end_time, 6 / 1.5 + 1.5 / 2000, rtol=1e-4)


@settings(max_examples=60)
@given(st.integers(0, 10**6))
def test_a_row_that_hardly_knows_the_acceleration_does_not_brake_to_rest(seed):
    """At the largest speed such a row leaves no choice but to brake hard; a grid finds what is worth it."""
    rng = np.random.default_rng(seed)
    steep = 10 ** rng.uniform(3, 9)
    base = np.array([2000.0, 400.0, steep]) * rng.uniform(0.8, 1.2, 3)
    slope = np.array([30.0, -1000.0, -1.2 * steep]) * rng.uniform(0.5, 1.5, 3)
    h, next_v2 = 4e-4, rng.uniform(0.05, 0.6)
    largest = largest_start(2.7, next_v2, h, base, slope)
    grid = largest * (1.0 - np.concatenate([[0.0], np.logspace(-13, 0, 4000)]))
    high = (slope * grid[:, None] + base).min(axis=1)
    following = np.minimum(np.maximum(grid + 2 * h * high, 0.0), next_v2)
    worth = np.sqrt(grid) + np.sqrt(following) / WORTH
    found = quickest_start(largest, next_v2, h, base, slope)
    ours = min(found + 2 * h * (slope * found + base).min(), next_v2)
    assert found <= largest
    assert np.sqrt(found) + np.sqrt(max(ours, 0.0)) / WORTH >= worth.max() * (1 - 2e-3)
    assert ours > 1e-3


def test_the_scan_is_the_solution_of_its_linear_programs():
    path = smooth(lines([[0, 0], [3, 1], [3.5, 4], [5, 4.2], [5.4, 4.1]], 80.0), Smoothing(0.1))
    velocity, acceleration = frozen([200.0] * 3), frozen([2000.0] * 3)
    limit_v2, straight = speed_limits(
        path.coefficients, path.length, path.feed_rate, rotary_only(path), velocity, acceleration
    )
    reach, _ = backward(
        path.coefficients, path.length, path.stop, limit_v2, straight, acceleration, NO_LIMIT, np.inf
    )
    profile = plan(path, MILL)
    slow_reach, slow_speed = naive.fastest(path, limit_v2, acceleration)
    assert_allclose(reach, slow_reach, rtol=1e-6, atol=1e-6)
    first = np.flatnonzero(np.diff(profile.cell, prepend=-1))
    assert_allclose(profile.velocity[first] ** 2, slow_speed[profile.cell[first]], rtol=1e-5, atol=1e-5)


@settings(max_examples=15)
@given(
    st.integers(0, 10**6),
    st.sampled_from(
        [MILL, [Limits(300.0, 5000.0), Limits(150.0, 800.0), Limits(20.0, 200.0)], [Limits(1e4, 1e5)] * 3]
    ),
)
def test_random_programs_keep_every_limit(seed, limits):
    profile = planned(wander(np.random.default_rng(seed), 300), limits)
    assert_keeps(profile, limits, 9)
    moving = profile.path.length[profile.cell] > 0.0
    assert (profile.duration[moving] >= 0.0).all()
    assert np.isfinite(profile.end_time)


def test_a_row_that_does_not_see_the_path_acceleration_limits_the_speed_alone():
    """At the end of a blend after which Z rests, q' goes with the square of what is left, q'' with itself.

    So ``q'_1 + 2 h q''_1`` is 0 four cells before it, but for rounding: solved for `a` it has no digits left.
    """
    points = [
        [0.08573, -0.09149, -1e-5], [-1.08355, 2.15954, -0.866], [-11.98819, 13.06444, -0.866],
        [46.7657, 30.48611, -0.866],
    ]  # fmt: skip
    limits = [Limits(50.0, 5000.0), Limits(50.0, 2000.0), Limits(50.0, 2000.0)]
    assert_keeps(planned(lines(points, [np.inf, 1000.0, 1000.0]), limits), limits)


@settings(max_examples=30)
@given(
    st.integers(0, 10**6),
    st.sampled_from([400.0, 2000.0]),
    st.sampled_from([50.0, 200.0]),
    st.sampled_from([0.001, 0.01, 0.1]),
)
def test_axes_that_come_to_rest_in_a_blend_keep_every_limit(seed, weakest, velocity, tolerance):
    rng = np.random.default_rng(seed)
    steps = rng.normal(size=(60, 4)) * [3.0, 3.0, 3.0, 0.05] * (rng.random((60, 4)) < 0.6)
    points = np.vstack([np.zeros(4), np.cumsum(steps, axis=0)])
    limits = [Limits(velocity, a) for a in (5000.0, 2000.0, weakest, 10.0)]
    whole = lines(points, 1000.0, axes=("x", "y", "z", "a"))
    assert_keeps(planned(whole, limits, tolerance), limits)


def test_the_certificate_is_that_of_a_plain_loop():
    profile = planned(toolpath(line(3, 0), arc((5, 2, 0), (3, 2, 0), np.pi / 2), line(5, 6), line(8, 6.5)))
    found = worst_violation(profile, MILL, 9)
    slow = naive.excesses(profile, MILL, 9) - 1.0
    assert_allclose([found.velocity, found.acceleration, found.feed], slow, rtol=0, atol=1e-12)


def test_the_certificate_sees_what_is_wrong():
    profile = planned(lines(SQUARE))
    faster = replace(profile, velocity=frozen(1.01 * profile.velocity))
    assert worst_violation(faster, MILL).feed > 9e-3
    assert worst_violation(faster, MILL).jump > 0.0
    steeper = replace(profile, acceleration=frozen(1.01 * profile.acceleration))
    assert worst_violation(steeper, MILL).acceleration > 9e-3
    shifted = replace(profile, u=frozen(profile.u + 1e-6 * (np.arange(len(profile)) % 2)))
    assert worst_violation(shifted, MILL).gap > 9e-7


def test_dwells_and_stops_rest():
    profile = planned(toolpath(dwell(0.25), line(10, 0), dwell(0.5), line(20, 0), dwell(1.0)))
    resting = profile.velocity + np.abs(profile.acceleration) == 0.0
    assert_allclose(profile.duration[resting], [0.25, 0.5, 1.0])
    one = planned(toolpath(line(10, 0))).end_time
    assert_allclose(profile.end_time, 1.75 + 2 * one, rtol=1e-12)


def test_rotary_axes_keep_their_own_limits():
    axes = ("x", "y", "z", "a")
    limits = [*MILL, Limits(1.5, 15.0)]
    alone = planned(lines([[0, 0, 0, 0], [0, 0, 0, 3.0]], 1.0, axes=axes), limits)
    assert_allclose(alone.end_time, 3.0 / 1.0 + 1.0 / 15.0, rtol=1e-9)
    rapid = planned(lines([[0, 0, 0, 0], [0, 0, 0, 3.0]], np.inf, axes=axes), limits)
    assert_allclose(rapid.end_time, 3.0 / 1.5 + 1.5 / 15.0, rtol=1e-9)
    rng = np.random.default_rng(2)
    steps = rng.normal(size=(200, 4)) * [1.0, 1.0, 0.2, 0.05]
    steps[::20, :3] = 0.0
    steps[1::20, 3] = 0.0
    mixed = planned(lines(np.vstack([np.zeros(4), np.cumsum(steps, axis=0)]), 50.0, axes=axes), limits)
    assert_keeps(mixed, limits)


def test_what_no_motion_can_satisfy_names_its_line():
    still = [Limits(200.0, 2000.0), Limits(0.0, 2000.0), Limits(200.0, 2000.0)]
    with pytest.raises(InfeasibleError, match="Y moves") as caught:
        planned(lines(SQUARE), still)
    assert caught.value.line in (1, 2)
    assert planned(lines([[0, 0], [1, 0]]), still).end_time > 0.0
    for feed in (0.0, np.nan):
        with pytest.raises(InfeasibleError, match="feed rate") as caught:
            planned(lines(SQUARE, [10.0, 10.0, feed, 10.0]))
        assert caught.value.line == 3


def test_look_ahead_is_a_stopping_distance_not_a_number_of_blocks():
    """From 180 mm/s the mill stops in 8.1 mm: 405 blocks of 0.02 mm. A tail of 64 blocks would be wrong."""
    path = refined(smooth(lines([[0, 0], [80, 0]], 180.0), Smoothing(0.01)), 4000)
    velocity, acceleration = frozen([200.0] * 3), frozen([2000.0] * 3)

    def reach(cells):
        part = path.cut(slice(0, cells))
        limit_v2, straight = speed_limits(
            part.coefficients, part.length, part.feed_rate, rotary_only(part), velocity, acceleration
        )
        return backward(
            part.coefficients, part.length, part.stop, limit_v2, straight, acceleration, NO_LIMIT, np.inf
        )

    whole, _ = reach(len(path))
    part, free = reach(2000)  # as if the path rested there
    assert not np.array_equal(part[: 2000 - 64], whole[: 2000 - 64])
    last = np.flatnonzero(free[:-1])[-1]
    assert 400 <= 2000 - last <= 410
    np.testing.assert_array_equal(part[: last + 1], whole[: last + 1])


@pytest.mark.parametrize("gentleness", [0.25, 0.6])
def test_gentleness_is_a_factor_of_the_acceleration_and_its_root_one_of_the_feed(gentleness):
    path = smooth(lines([[0, 0], [100, 0]], 50.0), Smoothing(0.01))
    _, profile = planning(MILL, frozen(np.full(len(path), gentleness)))(None, path, True)
    speed, push = 50.0 * np.sqrt(gentleness), MILL[0].acceleration * gentleness
    assert_allclose(profile.end_time, 100.0 / speed + speed / push, rtol=1e-9)
    assert_allclose(profile.velocity.max(), speed, rtol=1e-12)


def test_gentle_cells_alone_are_gentle():
    """Random factors: each cell keeps its own accelerations, and they stay within the plain ones."""
    path = smooth(wander(np.random.default_rng(5), 300), Smoothing(0.01))
    factor = np.random.default_rng(6).uniform(0.2, 1.0, len(path))
    _, profile = planning(MILL, frozen(factor))(None, path, True)
    asked = replace(path, coefficients=frozen(path.coefficients / factor[:, None, None]),
                    feed_rate=frozen(path.feed_rate / np.sqrt(factor)))  # fmt: skip
    found = worst_violation(replace(profile, path=asked), MILL, 33)
    assert found.acceleration <= 1e-6
    assert found.feed <= 1e-6
    assert profile.end_time > planned(wander(np.random.default_rng(5), 300)).end_time


@pytest.mark.parametrize("gentle", [False, True])
def test_chunks_of_cells_do_not_change_a_bit(monkeypatch, gentle):
    monkeypatch.setattr("cnc_shape.feedrate.PATIENCE", 1)
    path = smooth(wander(np.random.default_rng(3), 2000), Smoothing(0.01, 0.0, 0.0))
    factor = frozen(np.random.default_rng(4).uniform(0.3, 1.0, len(path))) if gentle else None
    _, once = planning(MILL, factor)(None, path, True)
    for size in (97, 1000):
        step, state, parts = planning(MILL, factor), None, []
        for first in range(0, len(path), size):
            state, profile = step(state, path.cut(slice(first, first + size)), first + size >= len(path))
            parts.append(profile)
        assert len(join_paths([profile.path for profile in parts])) == len(path)
        for name in ("time", "duration", "u", "velocity", "acceleration"):
            np.testing.assert_array_equal(
                np.concatenate([getattr(p, name) for p in parts]), getattr(once, name)
            )
