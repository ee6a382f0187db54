"""Shaping a sampled command: steady motion is left alone, all axes stay in step, chunks do not matter."""

from __future__ import annotations

import numpy as np
import pytest
from commands import part, point_to_point, straight, trapezoid
from numpy.testing import assert_allclose, assert_array_equal

from cnc_shape.modes import Mode
from cnc_shape.shapers import MULTI_MODE, PLAIN, cascade, make_shaper, sd, virtual_mode, zv, zvd
from cnc_shape.shapers.shaping import common_delay, shape, shaping

T = 1e-3
MODE = Mode(33.7, 0.02)
SHAPERS = {
    **{name: make(MODE) for name, make in PLAIN.items()},
    "virtual_mode": virtual_mode(Mode(MODE.natural_frequency, 0.0), duration_periods=0.4),
    "sd": sd(MODE, duration_periods=0.8),
    **{n: make([MODE]) for n, make in MULTI_MODE.items()},
}


@pytest.mark.parametrize("shaper", SHAPERS.values(), ids=SHAPERS)
def test_constant_velocity_is_unchanged(shaper):
    line = straight(T, (1.0, 2.0, 0.5), 50.0, 0.5)
    shaped = shape(line, {"x": shaper, "y": zvd(Mode(20.0, 0.1))})
    steady = slice(120, len(line))
    delay = max(shaper.delay, zvd(Mode(20.0, 0.1)).delay)
    unit = line.velocity[0] / 50.0
    expected = np.outer(50.0 * (np.arange(len(line)) * T - delay), unit)
    assert_allclose(shaped.position[steady], expected[steady], atol=1e-11)
    assert_allclose(shaped.velocity[steady], line.velocity[steady], atol=1e-9)
    assert_allclose(shaped.arc_length[steady], 50.0 * (np.arange(len(line)) * T - delay)[steady], atol=1e-11)


def test_a_shaper_ahead_of_its_command_delays_no_axis_below_zero():
    ahead = make_shaper([0.0, 0.02], [3.0, -2.0])  # centroid -40 ms
    line = straight(T, (1.0, 2.0, 0.5), 50.0, 0.5)
    shaped = shape(line, {"x": ahead})
    assert common_delay({"x": ahead}) == 0.0
    assert_array_equal(
        shaped.position[:, 1:], np.vstack([line.position, shaped.position[len(line) :]])[:, 1:]
    )
    steady = slice(80, len(line))  # x is late by 40 ms more than its own centroid: in step with y and z
    assert_allclose(shaped.position[steady, 0], line.position[steady, 0], atol=1e-11)


@pytest.mark.parametrize("shaper", SHAPERS.values(), ids=SHAPERS)
def test_starts_and_ends_where_the_command_does_and_lasts_longer_by_the_last_impulse(shaper):
    command = point_to_point(T)
    shaped = shape(command, {"x": shaper})
    assert_array_equal(shaped.position[0], command.position[0])
    assert_allclose(shaped.position[-1], command.position[-1], atol=1e-13)
    assert_allclose(shaped.velocity[-1], 0.0, atol=1e-12)
    assert len(shaped) - len(command) == np.ceil(shaper.duration / T)


def test_impulses_on_the_grid_give_the_exact_sum():
    shaper = make_shaper([0.0, 4 * T, 9 * T], [0.2, 0.5, 0.3])
    command = point_to_point(T)
    shaped = shape(command, {"x": shaper})
    padded = np.concatenate([np.zeros(9), command.position[:, 0], np.full(9, 10.0)])
    n = len(shaped)
    expected = 0.2 * padded[9 : 9 + n] + 0.5 * padded[5 : 5 + n] + 0.3 * padded[:n]
    assert_allclose(shaped.position[:, 0], expected, rtol=1e-15)


def test_impulses_between_samples_shift_the_profile_itself():
    shaper = zv(MODE)
    shaped = shape(point_to_point(T), {"x": shaper})
    time = np.arange(len(shaped)) * T
    exact = sum(
        a * trapezoid(time - t, 10.0, 100.0, 2000.0)[0]
        for t, a in zip(shaper.times, shaper.amplitudes, strict=True)
    )
    assert_allclose(
        shaped.position[:, 0], exact, atol=2000.0 * T**2 / 50
    )  # only at the kinks of acceleration


def test_axes_are_delayed_to_the_largest_centroid():
    shapers = {"x": zv(Mode(55.0, 0.05)), "y": cascade([Mode(42.0, 0.05), Mode(90.0, 0.02)])}
    diagonal = straight(T, (1.0, 1.0, 1.0), 30.0, 0.4)
    shaped = shape(diagonal, shapers)
    steady = shaped.position[100 : len(diagonal)]
    assert_allclose(steady[:, 0], steady[:, 1], atol=1e-12)
    assert_allclose(steady[:, 0], steady[:, 2], atol=1e-12)
    assert common_delay(shapers) == shapers["y"].delay


@pytest.mark.parametrize("amplitudes", [[-1.0, 2.0], [2.0, -1.0]])
def test_centroids_outside_the_impulses_keep_the_axes_in_step(amplitudes):
    """Impulses of mixed signs can be late by more than their last one, or early."""
    shapers = {"x": make_shaper([0.0, 0.0205], amplitudes)}
    diagonal = straight(T, (1.0, 1.0, 0.0), 30.0, 0.3)
    shaped = shape(diagonal, shapers)
    steady = slice(80, len(diagonal))
    assert_allclose(shaped.position[steady, 0], shaped.position[steady, 1], atol=1e-12)
    assert common_delay(shapers) == max(shapers["x"].delay, 0.0)


@pytest.mark.parametrize("chunk", [1, 2, 7, 50])
def test_streamed_equals_whole_bit_for_bit(chunk):
    command = point_to_point(T)
    shapers = {"x": zv(MODE), "y": zvd(MODE)}
    step, state, parts = shaping(shapers, T), None, []
    for low in range(0, len(command), chunk):
        state, out = step(
            state, part(command, low, min(low + chunk, len(command))), low + chunk >= len(command)
        )
        parts.append(out)
    whole = shape(command, shapers)
    for name in ("position", "velocity", "acceleration", "arc_length"):
        assert_array_equal(np.concatenate([getattr(p, name) for p in parts]), getattr(whole, name))


def test_acceleration_grows_by_no_more_than_the_sum_of_amplitudes():
    shaper = make_shaper([0.0, 0.0041, 0.0137], [1.0, -0.5, 0.5])
    shaped = shape(point_to_point(T), {"x": shaper})
    assert np.abs(shaped.acceleration).max() <= 2000.0 * shaper.sum_abs_amplitude * (1 + 1e-12)


def test_equals_its_slow_twin():
    import naive

    command = point_to_point(T)
    shapers = {"x": zv(MODE), "y": zvd(Mode(20.0, 0.1))}
    shaped = shape(command, shapers)
    time = np.arange(len(shaped)) * T
    delay = common_delay(shapers) - shapers["x"].delay
    expected = naive.delayed_sum(time, T, command.position[:, 0], command.velocity[:, 0], shapers["x"], delay)
    assert_allclose(shaped.position[:, 0], expected, atol=1e-12)
