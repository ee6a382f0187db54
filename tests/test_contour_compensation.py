"""Contour compensation as a stage: what it subtracts, how late it is, and that chunks do not matter."""

from __future__ import annotations

import naive
import numpy as np
import pytest
from commands import circling, part, point_to_point, straight
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from cnc_shape.errors import InfeasibleError
from cnc_shape.modes import Mode
from cnc_shape.shapers import zv, zvd
from cnc_shape.shapers.command_shaping import CommandShaping, command_shaping, shape_command
from cnc_shape.shapers.contour_compensation import (
    compensate,
    curve_gain,
    curve_gains,
    half_width,
    triangle_window,
)

T = 1e-3
MODES = {"x": [Mode(30.0, 0.02), Mode(100.0, 0.01)], "y": [Mode(42.0, 0.05)]}
SHAPERS = {"x": zv(Mode(30.0, 0.02)), "y": zvd(Mode(42.0, 0.05))}
HOW = CommandShaping(SHAPERS, structure=MODES)
AXES = ("x", "y", "z")


def test_the_gain_is_half_the_variance_less_the_compliance():
    mode = Mode(42.0, 0.0, 0.8)
    quarter = (0.25 / 42.0) ** 2  # variance of a ZV shaper: two equal halves half a period apart
    assert curve_gain(zv(mode), [mode]) == pytest.approx(quarter / 2 - 0.8 / mode.omega**2, rel=1e-12)


def test_rotary_axes_and_ideal_ones_are_left_alone():
    gains = curve_gains({}, {"c": [Mode(20.0, 0.1)]}, ("x", "c"))
    assert gains == {"x": 0.0}
    assert half_width(gains) == 0.0
    assert not CommandShaping({}, structure={"c": [Mode(20.0, 0.1)]}).gains(("x", "c"))


@given(samples=st.floats(0.05, 90.0))
@settings(max_examples=60, deadline=None, derandomize=True)
def test_the_window_keeps_means_and_differentiates(samples):
    """Weights of the value sum to 1 about the centre; those of the derivatives find a line's and a parabola's."""
    width = samples * T
    window = triangle_window(width, T)
    time = -np.arange(window.weights.shape[1]) * T + width  # of each tap, from the centre
    value, slope, bend = window.weights
    assert_allclose([value.sum(), value @ time], [1.0, 0.0], atol=1e-9)
    assert_allclose(slope @ np.stack([np.ones_like(time), time], axis=1), [0.0, 1.0], atol=2e-6)
    assert_allclose([bend.sum() * T**2, bend @ time * T], [0.0, 0.0], atol=2e-6)
    if samples > 1.0:  # straight lines between samples bend a parabola a little less or more
        assert bend @ time**2 / 2 == pytest.approx(1.0, abs=0.5 / samples**2)


def test_it_subtracts_the_smoothed_normal_offset():
    command = circling(T, 5.0, 120.0, 0.2)
    gains = {"x": 3e-6, "y": -2e-6, "z": 0.0}
    width = half_width(gains)
    out = compensate(command, gains)
    gain = np.array(list(gains.values()))
    for j in (12, 25, 40):
        away = naive.smoothed_offset(command.velocity, command.acceleration, gain, T, width, j * T - width)
        turned = 24.0 * (j * T - width)
        place = 5.0 * np.array([np.cos(turned), np.sin(turned), 0.0])
        assert_allclose(out.position[j], place - away, atol=5e-8)


def test_velocity_and_acceleration_are_those_of_the_position():
    out = compensate(circling(1e-4, 5.0, 120.0, 1.0), {"x": 3e-6, "y": 2e-6})
    steady = slice(200, 1500)
    assert_allclose(np.gradient(out.position, 1e-4, axis=0)[steady], out.velocity[steady], atol=2e-3)
    assert_allclose(np.gradient(out.velocity, 1e-4, axis=0)[steady], out.acceleration[steady], atol=0.5)


def test_lines_are_only_late():
    """A straight line has no side; equal gains push along it."""
    line = straight(T, (1.0, 2.0, 0.5), 50.0, 0.3)
    gains = {"x": 3e-6, "y": 3e-6, "z": 3e-6}
    out = compensate(line, gains)
    late = 50.0 * (np.arange(60, len(line)) * T - half_width(gains))
    assert_allclose(out.position[60 : len(line)], np.outer(late, line.velocity[0] / 50.0), atol=1e-11)
    assert_allclose(out.arc_length[60 : len(line)], late, atol=1e-11)


def test_it_lasts_two_half_widths_longer_and_the_lag_grows_by_one():
    command = point_to_point(T)
    out = shape_command(command, HOW)
    plain = CommandShaping(SHAPERS)
    width = half_width(HOW.gains(AXES))
    assert HOW.longer(AXES, T) == pytest.approx(plain.longer(AXES, T) + 2 * width)
    assert HOW.lag(AXES, T) == pytest.approx(plain.lag(AXES, T) + width)
    assert len(out) >= len(command) + HOW.longer(AXES, T) / T - 1e-6
    assert_array_equal(out.position[0], command.position[0])
    assert_allclose(out.position[-1], command.position[-1], atol=1e-12)


@pytest.mark.parametrize("chunk", [1, 3, 50])
def test_streamed_equals_whole_bit_for_bit(chunk):
    command = circling(T, 5.0, 120.0, 0.7)
    step, state, parts = command_shaping(HOW, AXES, T), None, []
    for low in range(0, len(command), chunk):
        high = min(low + chunk, len(command))
        state, out = step(state, part(command, low, high), high == len(command))
        parts.append(out)
    whole = shape_command(command, HOW)
    for name in ("position", "velocity", "acceleration", "arc_length"):
        assert_array_equal(np.concatenate([getattr(p, name) for p in parts]), getattr(whole, name))


def test_a_window_beyond_all_bounds_is_refused():
    with pytest.raises(InfeasibleError, match="look ahead 475"):
        compensate(point_to_point(T), {"x": 190.0**2})
