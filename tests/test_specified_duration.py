"""Specified-duration shapers: paper 002's numbers, its conditions, closed forms, and grids that never do better."""

from __future__ import annotations

import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from oscillator import swing_after
from scipy.optimize import brentq

from cnc_shape.errors import InfeasibleError, OptionError
from cnc_shape.modes import Mode
from cnc_shape.shapers import Robustness, sd, zv, zvd, zvdd, zvddd
from cnc_shape.shapers.analysis import residual_vibration, vibration
from cnc_shape.shapers.insensitivity import insensitivity
from cnc_shape.shapers.sd_family import family, impulse_count
from cnc_shape.shapers.shaper import Shaper, make_shaper

HZ = Mode(1.0, 0.0)
CONTAINER = Mode(3.67 / (2.0 * np.pi), 0.0015)


def width(shaper: Shaper, mode: Mode) -> float:
    band = insensitivity(shaper, [mode])
    return min(band.high or 6.0, 6.0) - band.low


# --- paper 002 ------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("mode", "options", "times", "amplitudes", "insensitive"),
    [  # eqs 14-17, 20, 21, continuous optimum
        (HZ, {"duration": 0.8}, [0, 0.4, 0.8], [0.27639, 0.44721, 0.27639], 0.12606),
        (Mode(1, 0.1), {"duration": 0.8}, [0, 0.40367, 0.8], [0.36024, 0.43486, 0.20490], 0.16674),
        (Mode(1, 0.1), {"duration": 1.3}, [0, 0.44514, 0.87043, 1.3], [0.21928, 0.40490, 0.29041, 0.08542], 0.80811),
        (Mode(1, 0.1), {"duration": 0.4, "max_amplitude": 1.5}, [0, 0.06126, 0.4], [1.5, -1.01041, 0.51041], 0.06801),
        (CONTAINER, {"duration_periods": 0.35, "max_amplitude": 1.5}, [0, 0.13623, 0.59921], [1.5, -1.22267, 0.72267], 0.05640),
        (CONTAINER, {"duration_periods": 0.35, "max_amplitude": 1.0}, [0, 0.25751, 0.59921], [1.0, -0.85017, 0.85017], 0.05588),
        (CONTAINER, {"duration_periods": 0.8}, [0, 0.68491, 1.36963], [0.27756, 0.44721, 0.27523], 0.12657),
    ],
    ids=["14", "15", "16", "17", "20", "20 with 1", "21"],
)  # fmt: skip
def test_equations_of_the_paper(mode, options, times, amplitudes, insensitive):
    shaper = sd(mode, **options)
    assert_allclose(shaper.times, times, atol=1.5e-5)
    assert_allclose(shaper.amplitudes, amplitudes, atol=1.5e-5)
    assert_allclose(width(shaper, mode), insensitive, atol=6e-6)
    assert swing_after(shaper, mode.natural_frequency, mode.damping_ratio) <= 1e-9


def test_reference_values(shared):
    reference = json.loads((shared / "data" / "shapers.json").read_text())
    cases = [case for case in reference["cases"].values() if case["shaper"] == "SD"]
    for case in cases:
        (mode,) = [Mode(m["frequency_hz"], m["damping_ratio"]) for m in case["modes"]]
        options = case["options"]
        shaper = sd(
            mode, duration_periods=options["TN"], max_amplitude=options["Amax"], min_gap=options["tmin_s"]
        )
        assert_allclose(shaper.times, case["times_s"], atol=2e-4)
        assert_allclose(shaper.amplitudes, case["amplitudes"], atol=2e-4)
        assert width(shaper, mode) >= case["insensitivity_5pct"]["width"] - 1e-6
    table = reference["checks"]["SD_symmetric_undamped_I05_vs_TN"]["rows"]
    for periods, impulses, insensitive, *_, highest in table[::6]:
        bound = None if periods > 0.5 else highest * (1.0 + 1e-9)
        shaper = sd(HZ, duration_periods=periods, max_amplitude=bound)
        assert shaper.times.size == (2 if periods == 0.5 else impulses)
        assert_allclose(width(shaper, HZ), insensitive, atol=1e-6)


@pytest.mark.parametrize(
    ("periods", "damping", "least"),
    [(0.2, 0, 4.236), (0.25, 0, 2.414), (0.3, 0, 1.426), (1 / 3, 0, 1.0), (0.35, 0, 0.9157), (0.45, 0, 0.5927),
     (0.35, 0.1, 0.9216)],
)  # fmt: skip
def test_the_smallest_amplitude_of_a_duration(periods, damping, least):
    mode = Mode(1.0, damping)
    with pytest.raises(InfeasibleError, match="too short for amplitudes") as refusal:
        sd(mode, duration_periods=periods, max_amplitude=0.99 * least)
    assert refusal.value.argument == "max_amplitude"
    told = float(str(refusal.value).split()[-1])
    assert_allclose(told, least, atol=6e-4)
    assert (
        np.abs(sd(mode, duration_periods=periods, max_amplitude=told * 1.0001).amplitudes).max()
        <= told * 1.0002
    )


@pytest.mark.parametrize(("periods", "like"), [(0.5, zv), (1.0, zvd), (1.5, zvdd), (2.0, zvddd)])
def test_undamped_shapers_of_whole_half_periods_are_the_derivatives_of_zv(periods, like):
    shaper = sd(HZ, duration_periods=periods, max_amplitude=1.0)
    assert_allclose(shaper.times, like(HZ).times, atol=1e-9)
    assert_allclose(shaper.amplitudes, like(HZ).amplitudes, atol=1e-9)


@pytest.mark.parametrize(
    ("periods", "like", "insensitive"), [(1.0, zvd, 0.34043), (1.5, zvdd, 0.57510), (2.0, zvddd, 0.76032)]
)
def test_damped_ones_are_more_insensitive_than_those(periods, like, insensitive):
    mode = Mode(1.0, 0.1)
    assert_allclose(width(sd(mode, duration_periods=periods), mode), insensitive, atol=6e-6)
    assert width(like(mode), mode) < insensitive - 1e-4
    angles, magnitudes = family(periods)(np.array([0.5]))  # but the symmetric member is that of any damping
    times = angles[0] / mode.omega_damped
    amplitudes = magnitudes[0] * np.exp(-mode.damping_ratio * mode.omega * times)
    assert_allclose(times, like(mode).times, atol=1e-12)
    assert_allclose(amplitudes / amplitudes.sum(), like(mode).amplitudes, atol=1e-12)


@pytest.mark.parametrize("jump", [0.8599513039, 1.2836851558, 1.7389976786])
def test_robustness_jumps_where_a_hump_comes_below_the_tolerance(jump):
    below, above = (sd(HZ, duration_periods=jump + d) for d in (-1e-4, 1e-4))
    assert width(above, HZ) > width(below, HZ) + 0.1
    margins = [insensitivity(s, [HZ]).margin for s in (below, above)]
    assert margins[0] < margins[1] < margins[0] + 1e-3  # the margin does not


def test_the_margin_is_a_metric_of_its_own():
    mode = Mode(1.0, 0.1)
    widest = sd(mode, duration_periods=1.2)
    centred = sd(mode, duration_periods=1.2, metric=Robustness.MARGIN)
    assert insensitivity(centred, [mode]).margin > insensitivity(widest, [mode]).margin
    assert width(centred, mode) < width(widest, mode)


# --- closed forms and conditions ------------------------------------------------------------------


@pytest.mark.parametrize("periods", [1.05, 1.2, 1.4])
def test_four_impulses_in_closed_form(periods):
    h = np.pi * periods
    g = brentq(lambda x: x * np.tan(x) - h * np.tan(h), 1e-9, np.pi / 2.0 - 1e-9)
    angles, magnitudes = family(periods)(np.array([0.5]))
    assert_allclose(angles[0], [0.0, h - g, h + g, 2.0 * h], atol=1e-9)
    ratio = -g * np.sin(g) / (h * np.sin(h))
    assert_allclose(magnitudes[0, 0] / magnitudes[0, 1], ratio, rtol=1e-9)


@pytest.mark.parametrize("periods", [1.55, 1.7, 1.9])
def test_five_impulses_in_closed_form(periods):
    h = np.pi * periods
    g = brentq(lambda x: np.tan(x) / x - np.tan(h) / h, np.pi / 2.0 + 1e-9, np.pi)
    angles, magnitudes = family(periods)(np.array([0.5]))
    assert_allclose(angles[0], [0.0, h - g, h, h + g, 2.0 * h], atol=1e-9)
    first, second, third = magnitudes[0, :3]
    assert_allclose(first / second, -(g**2) * np.cos(g) / (h**2 * np.cos(h)), rtol=1e-8)
    assert_allclose(third, -2.0 * first * np.cos(h) - 2.0 * second * np.cos(g), rtol=1e-8)


@settings(max_examples=25)
@given(st.floats(0.2, 2.5), st.floats(0.0, 0.3), st.floats(0.5, 100.0))
def test_every_duration_meets_the_conditions(periods, damping, frequency):
    mode = Mode(frequency, damping)
    bound = 40.0 if periods <= 0.5 else None
    shaper = sd(mode, duration_periods=periods, max_amplitude=bound)
    assert_allclose(shaper.duration, periods * mode.damped_period, rtol=1e-12)
    assert_allclose(shaper.amplitudes.sum(), 1.0, atol=1e-12)
    assert np.abs(shaper.amplitudes).max() <= (bound or 1.0) * (1.0 + 1e-9)
    assert periods <= 0.5 or (shaper.amplitudes > 0.0).all()
    s = mode.omega * complex(damping, np.sqrt(1.0 - damping**2))
    decay = np.exp(-damping * mode.omega * shaper.duration)
    for k in range(1 if shaper.times.size == 3 else impulse_count(periods) - 2):
        moment = (shaper.amplitudes * (shaper.times / shaper.duration) ** k) @ np.exp(s * shaper.times)
        assert decay * abs(moment) <= 1e-9
    assert swing_after(shaper, frequency, damping) <= 1e-9


@pytest.mark.parametrize(("periods", "order"), [(0.8, 1), (1.3, 2), (1.8, 3), (2.3, 4)])
def test_sensitivity_grows_with_the_power_of_its_conditions(periods, order):
    shaper = sd(Mode(1.0, 0.05), duration_periods=periods)
    near, far = vibration(shaper, 2.0 * np.pi * np.array([1.005, 1.01]), 0.05)
    assert_allclose(np.log2(far / near), order, atol=0.1)


# --- grids ----------------------------------------------------------------------------------------


@settings(max_examples=8)
@given(st.floats(0.52, 0.99), st.floats(0.0, 0.3))
def test_the_grid_of_the_paper_is_never_better(periods, damping):
    """A1 in steps of 0.01, the other unknowns solved for (paper 002, eq 5)."""
    mode = Mode(1.0, damping)
    best = width(sd(mode, duration_periods=periods), mode)
    last = 2.0 * np.pi * periods
    for share in np.linspace(0.005, 0.995, 100):
        closing = share + (1.0 - share) * np.exp(1j * last)
        angles = np.array([0.0, np.angle(-closing) % (2.0 * np.pi), last])
        times = angles / mode.omega_damped
        amplitudes = np.array([share, abs(closing), 1.0 - share]) * np.exp(-damping * mode.omega * times)
        grid = make_shaper(times, amplitudes / amplitudes.sum())
        assert residual_vibration(grid, mode) <= 1e-12
        assert width(grid, mode) <= best + 1e-9


@pytest.mark.parametrize("periods", [1.25, 1.7])
def test_no_other_member_of_the_family_is_better(periods):
    mode = Mode(1.0, 0.15)
    best = width(sd(mode, duration_periods=periods), mode)
    angles, magnitudes = family(periods)(np.linspace(0.01, 0.99, 197))
    times = angles / mode.omega_damped
    amplitudes = magnitudes * np.exp(-mode.damping_ratio * mode.omega * times)
    for t, a in zip(times, amplitudes / amplitudes.sum(axis=1, keepdims=True), strict=True):
        if np.isfinite(a).all():
            assert width(make_shaper(t, a), mode) <= best + 1e-9


def test_bounds_are_kept_and_used():
    mode = Mode(10.0, 0.05)
    short = sd(mode, duration_periods=0.3, max_amplitude=2.5)
    assert_allclose(np.abs(short.amplitudes).max(), 2.5, rtol=1e-9)  # the higher the more insensitive
    spaced = sd(mode, duration_periods=0.3, max_amplitude=2.5, min_gap=0.013)
    assert np.diff(spaced.times).min() >= 0.013 * (1.0 - 1e-9)
    assert width(spaced, mode) < width(short, mode)
    low = sd(mode, duration_periods=0.8, max_amplitude=0.44)
    assert np.abs(low.amplitudes).max() <= 0.44 * (1.0 + 1e-9)


# --- what is refused ------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("options", "error", "message"),
    [
        ({}, OptionError, "one duration, not none"),
        ({"duration": 1.0, "duration_periods": 1.0}, OptionError, "not both"),
        ({"duration": 0.0, "duration_periods": 1.0}, OptionError, "not both"),
        ({"duration": 0.0}, OptionError, "positive and finite, not 0"),
        ({"duration_periods": np.nan}, OptionError, "not nan"),
        ({"duration_periods": 20.0}, OptionError, "longer than 8"),
        ({"duration_periods": 0.4}, OptionError, "needs a bound"),
        ({"duration_periods": 0.5}, OptionError, "needs a bound"),
        ({"duration_periods": 0.8, "max_amplitude": -1.0}, OptionError, "not -1"),
        ({"duration_periods": 0.8, "max_amplitude": 0.3}, InfeasibleError, "too short for amplitudes of at most 0.3"),
        ({"duration_periods": 0.4, "max_amplitude": 2.0, "positive": True}, InfeasibleError, "negative impulse"),
        ({"duration_periods": 0.8, "min_gap": 0.4}, InfeasibleError, "does not fit twice"),
        ({"duration_periods": 1.2, "min_gap": 0.45}, InfeasibleError, "the widest is"),
        ({"duration_periods": 0.8, "vibration_tolerance": 1.0}, OptionError, "between 0 and 1, not 1"),
    ],
)  # fmt: skip
def test_requests_that_cannot_be_met_are_refused(options, error, message):
    with pytest.raises(error, match=message):
        sd(HZ, **options)
