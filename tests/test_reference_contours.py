"""Contours and time laws of the experiment: lengths, radii and durations known beforehand."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from cnc_shape.contour import contour_error
from cnc_shape.experiments.contour_control.contours import FAN, LEAD_OUT, chord_ends, contours
from cnc_shape.experiments.contour_control.time_law import TimeLaw, command, speed_along

LENGTHS = {  # mm: length, smallest radius
    "fan": (253.3333, 1.1286),
    "circle20": (40.0 * np.pi, 20.0),
    "circle5": (30.0 * np.pi, 5.0),
    "diamond": (4.0 * np.hypot(30.0, 30.0), np.inf),
    "corner": (60.0, np.inf),
    "lemniscate": (157.323, 10.0),
    "helix": (4.0 * np.pi * np.hypot(20.0, 10.0 / (2.0 * np.pi)), 20.1267),
    "line": (50.0, np.inf),
}
CURVES = TimeLaw(interpolation_period=8e-3)
DURATIONS = {  # s, with the rest of 0.5 s at the end
    "fan": (CURVES, 16.499),
    "circle20": (TimeLaw(), 8.453),
    "circle5": (TimeLaw(), 6.490),
    "diamond": (TimeLaw(), 11.206),
    "diamond, stops": (TimeLaw(stops=True), 11.606),
    "corner": (TimeLaw(), 4.349),
    "lemniscate": (TimeLaw(), 10.432),
    "helix": (TimeLaw(), 16.357),
}


@pytest.mark.parametrize("name", LENGTHS)
def test_length_and_smallest_radius(name):
    contour = contours()[name]
    length, radius = LENGTHS[name]
    assert contour.length == pytest.approx(length, abs=6e-4)
    bend = np.linalg.norm(contour.at(np.linspace(0.0, contour.length, 200_001)).curvature, axis=1)
    assert bend.max() == pytest.approx(1.0 / radius, rel=1e-4)


@pytest.mark.parametrize("name", LENGTHS)
def test_tangent_and_curvature_are_the_derivatives_over_arc_length(name):
    contour = contours()[name]
    s = np.linspace(0.0, contour.length, 1003)[1:-1]
    for knot in contour.corners:
        s = s[np.abs(s - knot) > 1e-3]
    step = 1e-4
    here, before, after = (contour.at(s + move) for move in (0.0, -step, step))
    assert_allclose((after.position - before.position) / (2.0 * step), here.tangent, atol=1e-7)
    assert_allclose(np.linalg.norm(here.tangent, axis=1), 1.0, rtol=1e-12)
    assert_allclose((after.tangent - before.tangent) / (2.0 * step), here.curvature, atol=1e-3)
    assert_allclose((here.tangent * here.curvature).sum(axis=1), 0.0, atol=1e-9)


def test_the_fan_goes_through_its_points_and_closes_smoothly():
    fan = contours()["fan"]
    s = np.linspace(0.0, fan.length, 400_001)
    where = fan.at(s).position[:, :2]
    for point in FAN:
        assert np.hypot(*(where - point).T).min() < 4e-4
    radius = np.hypot(*where.T)
    assert (radius.min(), radius.max()) == pytest.approx((9.857, 39.339), abs=6e-4)
    ends = fan.at(np.array([0.0, fan.length]))
    for both in (ends.position, ends.tangent, ends.curvature):
        assert_allclose(both[0], both[1], atol=1e-9)


@pytest.mark.parametrize("name", LENGTHS)
def test_the_toolpath_is_the_contour(name):
    contour = contours()[name]
    toolpath = contour.toolpath()
    assert toolpath.arc_length[-1] == pytest.approx(contour.length + contour.closed * LEAD_OUT, abs=5e-6)
    s = np.random.default_rng(4).uniform(0.0, contour.length, 3000)
    error = contour_error(contour.at(s).position, toolpath, s - 0.5, s + 0.5)
    assert error.max <= 0.5e-6


def test_chords_leave_a_curve_by_the_error_they_may():
    fan = contours()["fan"]
    ends = chord_ends(fan.at, fan.length, 0.9e-3)
    middle = fan.at(0.5 * (ends[:-1] + ends[1:])).position
    chord = fan.at(ends).position
    away = np.linalg.norm(middle - 0.5 * (chord[:-1] + chord[1:]), axis=1)
    assert 0.8e-3 < away.max() <= 0.9e-3


@pytest.mark.parametrize("name", DURATIONS)
def test_durations(name):
    law, duration = DURATIONS[name]
    motion = command(contours()[name.split(",")[0]], law)
    assert (len(motion) - 1) * motion.sample_time == pytest.approx(duration, abs=1e-9)
    assert_allclose(motion.velocity[-1], 0.0)


def test_the_fan_slows_down_where_its_chords_would_leave_it():
    fan = contours()["fan"]
    run = speed_along(fan, CURVES)
    inside = (run.arc_length > 1.0) & (run.arc_length < fan.length - 1.0)
    assert run.speed[inside].min() == pytest.approx(11.9, abs=0.05)
    assert (run.speed < 16.0 * (1.0 - 1e-12)).mean() == pytest.approx(0.033, abs=0.001)
    motion = command(fan, CURVES)
    error = contour_error(motion.position, fan.toolpath(), motion.arc_length - 0.5, motion.arc_length + 0.5)
    assert error.max == pytest.approx(1.004e-3, abs=0.016e-3)
    assert np.linalg.norm(np.diff(motion.position, axis=0), axis=1).max() <= 16.0e-3 + 1e-12


def test_the_limit_is_idle_at_one_millisecond():
    """It acts only on radii below (F T)^2 / (8 h): 0.032 mm at 1 ms."""
    assert (speed_along(contours()["fan"], TimeLaw()).limit == 16.0).all()


@pytest.mark.parametrize("law", [CURVES, TimeLaw(stops=True), TimeLaw(feed_rate=64.0)])
def test_speed_changes_no_faster_than_allowed(law):
    for contour in contours().values():
        run = speed_along(contour, law)
        gain = np.abs(np.diff(run.speed**2)) / (2.0 * np.diff(run.arc_length))
        assert gain.max() <= law.acceleration * (1.0 + 1e-9)
        assert run.speed[0] == run.speed[-1] == 0.0
        assert (run.speed <= run.limit).all()


def test_stops_rest_at_every_corner():
    diamond = contours()["diamond"]
    run = speed_along(diamond, TimeLaw(stops=True))
    for corner in diamond.corners:
        assert run.speed[np.argmin(np.abs(run.arc_length - corner))] == 0.0
