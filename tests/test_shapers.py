"""Shapers: closed forms, published values, and what they leave of a vibration."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp

from cnc_shape.errors import OptionError
from cnc_shape.modes import Mode
from cnc_shape.shapers import cascade, make_shaper, zv, zvd
from cnc_shape.shapers.analysis import contour_factor, phasor, residual_vibration
from cnc_shape.shapers.insensitivity import insensitivity
from cnc_shape.shapers.shaper import convolve

modes = st.builds(Mode, st.floats(0.5, 200.0), st.floats(0.0, 0.3))


def test_zv_undamped():  # two equal impulses half a period apart
    shaper = zv(Mode(1.0, 0.0))
    assert_allclose(shaper.times, [0.0, 0.5])
    assert_allclose(shaper.amplitudes, [0.5, 0.5])


def test_zvd_undamped():  # binomial weights at half periods
    shaper = zvd(Mode(1.0, 0.0))
    assert_allclose(shaper.times, [0.0, 0.5, 1.0])
    assert_allclose(shaper.amplitudes, [0.25, 0.5, 0.25])


def test_cascade_of_30_and_100_hz():  # paper 001, Fig. 9: four equal impulses over 21.667 ms
    shaper = cascade([Mode(30.0, 0.0), Mode(100.0, 0.0)])
    assert_allclose(shaper.times, [0.0, 5e-3, 1 / 60, 1 / 60 + 5e-3], rtol=1e-12)
    assert_allclose(shaper.amplitudes, [0.25] * 4)


def test_cascade_of_two_like_modes_is_zvd():
    mode = Mode(7.0, 0.08)
    assert_allclose(cascade([mode, mode]).times, zvd(mode).times)
    assert_allclose(cascade([mode, mode]).amplitudes, zvd(mode).amplitudes)


@pytest.mark.parametrize(
    ("make", "width"), [(zv, 0.06369), (zvd, 0.28713)], ids=["zv", "zvd"]
)  # spec of the shapers, section 1
def test_insensitivity_undamped(make, width):
    assert_allclose(insensitivity(make(Mode(1.0, 0.0)), [Mode(1.0, 0.0)]).width, width, atol=6e-6)


@pytest.mark.parametrize(
    ("make", "factor"), [(zv, 1 - np.pi**2 / 8), (zvd, 1 - np.pi**2 / 4)], ids=["zv", "zvd"]
)
def test_contour_factor_undamped(make, factor):  # kappa = 1 - omega^2 sigma^2 / 2
    assert_allclose(contour_factor(make(Mode(42.0, 0.0)), [Mode(42.0, 0.0)]), factor, rtol=1e-12)


@given(modes, modes)
def test_cascade_silences_both_modes(first, second):
    shaper = cascade([first, second])
    assert_allclose(shaper.amplitudes.sum(), 1.0, atol=1e-14)
    assert max(residual_vibration(shaper, first), residual_vibration(shaper, second)) <= 1e-12
    assert_allclose(shaper.duration, zv(first).duration + zv(second).duration, rtol=1e-12)


@pytest.mark.parametrize("damping", [0.0, 0.1, 0.3])
@pytest.mark.parametrize("ratio", [0.8, 1.0, 1.17])
def test_residual_equals_a_simulated_impulse_response(damping, ratio):
    """RK45 of ``y'' + 2 zeta omega y' + omega^2 y = impulses``: swing after the last, over one impulse's."""
    mode, actual = Mode(2.0, damping), 2.0 * np.pi * 2.0 * ratio
    shaper = zvd(mode)
    state = np.zeros(2)
    for i, (time, amplitude) in enumerate(zip(shaper.times, shaper.amplitudes, strict=True)):
        state = state + np.array([0.0, amplitude])
        if i + 1 < shaper.times.size:
            state = solve_ivp(
                lambda _, y: [y[1], -2 * damping * actual * y[1] - actual**2 * y[0]],
                (time, shaper.times[i + 1]), state, rtol=1e-11, atol=1e-13,
            ).y[:, -1]  # fmt: skip
    damped = actual * np.sqrt(1 - damping**2)
    swing = np.hypot(state[0] * damped, state[1] + damping * actual * state[0])
    assert_allclose(swing, residual_vibration(shaper, mode, ratio), atol=1e-8)


def test_phasor_is_the_residual_without_its_decay():
    mode = Mode(3.0, 0.1)
    shaper = zv(mode)
    decay = np.exp(-mode.damping_ratio * 1.1 * mode.omega * shaper.duration)
    assert_allclose(residual_vibration(shaper, mode, 1.1), decay * phasor(shaper, 1.1 * mode.omega, 0.1))


@given(modes)
def test_the_ends_of_the_insensitive_band_sit_at_the_tolerance(mode):
    band = insensitivity(zvd(mode), [mode], 0.05)
    ends = [band.low] + ([] if band.high is None else [band.high])
    assert_allclose([residual_vibration(zvd(mode), mode, end) for end in ends], 0.05, atol=1e-10)
    inside = np.linspace(band.low, band.high or 6.0, 500)
    assert (residual_vibration(zvd(mode), mode, inside) <= 0.05 + 1e-9).all()


def test_convolution_keeps_sum_and_adds_moments():
    first, second = zv(Mode(10, 0.05)), zvd(Mode(33, 0.02))
    both = convolve([first, second])
    assert_allclose(both.delay, first.delay + second.delay)
    assert_allclose(both.variance, first.variance + second.variance)


@pytest.mark.parametrize(
    ("times", "amplitudes", "message"),
    [
        ([], [], "as many times as amplitudes"),
        ([0.0, 0.1], [1.0], "as many times as amplitudes"),
        ([0.1, 0.2], [0.5, 0.5], "increase from 0"),
        ([0.0, 0.0], [0.5, 0.5], "increase from 0"),
        ([0.0, 0.1], [0.5, 0.6], "add up to 1, not 1.1"),
        ([0.0, np.nan], [0.5, 0.5], "finite"),
    ],
)
def test_impulses_that_are_no_shaper_are_refused(times, amplitudes, message):
    with pytest.raises(OptionError, match=message):
        make_shaper(times, amplitudes)


@pytest.mark.parametrize(
    ("frequency", "damping"), [(0.0, 0.1), (-1.0, 0.1), (np.nan, 0.1), (1.0, 1.0), (1.0, -0.1)]
)
def test_modes_that_are_none_are_refused(frequency, damping):
    with pytest.raises(OptionError):
        Mode(frequency, damping)


def test_a_tolerance_outside_its_range_is_refused():
    with pytest.raises(OptionError, match="between 0 and 1"):
        insensitivity(zv(Mode(1.0, 0.0)), [Mode(1.0, 0.0)], 1.0)


def test_modes_that_do_not_bend_the_tool_have_no_contour_factor():
    assert contour_factor(zv(Mode(30.0, 0.0)), [Mode(30.0, 0.0, 0.0)]) is None
    assert contour_factor(zv(Mode(30.0, 0.0)), []) is None
