"""Shapers on a sample grid: what rounding and interpolation cost, in closed form, and that exact taps cost nothing."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from cnc_shape.errors import InfeasibleError, OptionError
from cnc_shape.modes import Mode
from cnc_shape.shapers import (
    NONE,
    PLAIN,
    cascade,
    ei,
    make_shaper,
    multi_mode,
    mzv,
    sd,
    umzv,
    virtual_mode,
    zv,
    zvd,
    zvdd,
    zvddd,
)
from cnc_shape.shapers.analysis import vibration
from cnc_shape.shapers.discretisation import Interpolation, coarse, discretise, worst_residual

ROUNDED, LINEAR, CUBIC, EXACT = Interpolation
MODE = Mode(1.0, 0.0)
DAMPED = Mode(1.0, 0.1)
HALF_WAY = [1.0 / (2 * k + 1) for k in (3, 5, 7, 10, 20, 50)]  # the half period lies between two samples


def residual(taps, mode, ratio=1.0):
    return vibration(taps.shaper, mode.omega * ratio, mode.damping_ratio)


@pytest.mark.parametrize("interval", HALF_WAY)
def test_worst_residual_of_zv_in_closed_form(interval):
    shaper = zv(MODE)
    rounded, linear, cubic, exact = (
        residual(discretise(shaper, interval, way, [MODE]), MODE) for way in Interpolation
    )
    assert_allclose(rounded, np.sin(np.pi * interval / 2), rtol=1e-12)
    assert_allclose(linear, np.sin(np.pi * interval / 2) ** 2, rtol=1e-10)
    assert_allclose(cubic, worst_residual(CUBIC, interval, MODE), rtol=1e-6)
    assert cubic < linear < rounded
    assert exact < 1e-14


@pytest.mark.parametrize("way", [ROUNDED, LINEAR, CUBIC])
@pytest.mark.parametrize("interval", [0.01, 0.0318, 0.05, 0.1, 0.1436, 0.2])
def test_no_place_between_samples_is_worse_than_half_way(way, interval):
    # the second impulse of a ZV wanders between two samples: what its taps do differs from what it does itself
    found = []
    for place in np.linspace(5.0, 6.0, 41) * interval:
        taps = discretise(make_shaper([0.0, place], [0.5, 0.5]), interval, way)
        delays = np.arange(taps.weights.size) * interval
        found.append(abs(taps.weights @ np.exp(2j * np.pi * delays) - 0.5 - 0.5 * np.exp(2j * np.pi * place)))
    assert_allclose(max(found), worst_residual(way, interval, MODE), rtol=1e-9)


@pytest.mark.parametrize(("way", "largest"), [(ROUNDED, 0.0318), (LINEAR, 0.1436)], ids=["rounded", "linear"])
def test_rule_for_five_per_cent(way, largest):
    assert_allclose(worst_residual(way, largest, MODE), 0.05, rtol=2e-3)


# interval over period: worst and RMS of the residual vibration in per cent, where the interval varies by 10 %
TABLE = {
    0.01: (1.57, 0.025, 0.90, 0.018),
    0.05: (7.85, 0.616, 4.5, 0.46),
    0.10: (15.6, 2.45, 9.2, 1.85),
    0.20: (30.9, 9.55, 23.8, 8.9),
}


@pytest.mark.parametrize(("interval", "published"), TABLE.items())
def test_table_of_intervals(interval, published):
    shaper = zv(MODE)
    worst = [100.0 * worst_residual(way, interval, MODE) for way in (ROUNDED, LINEAR)]
    assert_allclose(worst, published[:2], rtol=0.014)  # to the digits given
    jittered = interval * np.linspace(0.9, 1.1, 2001)
    for way, rms in zip((ROUNDED, LINEAR), published[2:], strict=True):
        found = np.array([residual(discretise(shaper, step, way), MODE) for step in jittered])
        assert_allclose(100.0 * np.sqrt(np.mean(found**2)), rms, rtol=0.04)
        assert np.all(found <= [worst_residual(way, step, MODE) + 1e-12 for step in jittered])
    assert all(residual(discretise(shaper, step, EXACT, [MODE]), MODE) < 1e-12 for step in jittered[::20])


def test_an_interval_that_divides_the_half_period_has_no_error_by_luck():
    for way in Interpolation:
        assert residual(discretise(zv(MODE), 0.1, way, [MODE]), MODE) < 1e-14


def test_exact_zv_taps_are_the_solution_of_three_equations():
    # taps at 0, k, k + 1: A ~ (e2 e3 sin(h3 - h2), -e3 sin h3, e2 sin h2), the SD shaper of three impulses by t2
    interval = 0.093
    taps = discretise(zv(DAMPED), interval, EXACT, [DAMPED])
    t2, t3 = taps.used[1:] * interval
    e2, e3 = np.exp(DAMPED.damping_ratio * DAMPED.omega * np.array([t2, t3]))
    h2, h3 = DAMPED.omega_damped * np.array([t2, t3])
    weights = np.array([e2 * e3 * np.sin(h3 - h2), -e3 * np.sin(h3), e2 * np.sin(h2)])
    assert_array_equal(taps.used, [0, 5, 6])
    assert_allclose(taps.weights[taps.used], weights / weights.sum(), rtol=1e-12)


SINGLE = {**PLAIN, "virtual_mode": lambda mode: virtual_mode(Mode(mode.natural_frequency, 0.0), duration_periods=0.4),
          "sd": lambda mode: sd(mode, duration_periods=0.8), "sd_long": lambda mode: sd(mode, duration_periods=1.3)}  # fmt: skip


made = cache(lambda make, mode: make(mode))  # some take a second


@pytest.mark.parametrize("mode", [MODE, DAMPED], ids=["undamped", "damped"])
@pytest.mark.parametrize("interval", [1 / 11, 0.0731, 0.1436, 0.013])
@pytest.mark.parametrize("make", SINGLE.values(), ids=SINGLE)
def test_exact_taps_do_at_the_mode_what_the_shaper_does(make, interval, mode):
    shaper = made(make, mode)
    taps = discretise(shaper, interval, EXACT, [mode])
    phasors = [
        sequence.amplitudes @ np.exp(
            mode.omega * complex(mode.damping_ratio, np.sqrt(1 - mode.damping_ratio**2)) * sequence.times
        )
        for sequence in (taps.shaper, shaper)
    ]  # fmt: skip
    scale = np.exp(mode.damping_ratio * mode.omega * shaper.duration)
    assert abs(phasors[0] - phasors[1]) < 1e-11 * scale
    assert abs(taps.weights.sum() - 1.0) < 1e-14
    assert taps.shaper.sum_abs_amplitude <= 1.5 * shaper.sum_abs_amplitude
    assert abs(taps.shaper.duration - shaper.duration) <= 2.0 * interval


@pytest.mark.parametrize(("make", "order"), [(zv, 1), (zvd, 2), (zvdd, 3), (zvddd, 4)])
@pytest.mark.parametrize("interval", [0.0731, 2 / 21])  # at 2/21 s every second impulse lies on the grid
@pytest.mark.parametrize("mode", [MODE, DAMPED], ids=["undamped", "damped"])
def test_exact_taps_are_as_robust_as_the_shaper(make, order, interval, mode):
    # V grows with the order-th power of the frequency error; two errors, a factor of ten apart, tell it
    taps = discretise(make(mode), interval, EXACT, [mode])
    near, far = residual(taps, mode, 1.003), residual(taps, mode, 1.03)
    assert_allclose(np.log10(far / near), order, atol=0.05)
    linear = discretise(make(mode), interval, LINEAR)
    assert residual(linear, mode) > 10.0 * residual(taps, mode)


def test_exact_taps_for_several_modes():
    modes = [Mode(30.0, 0.02), Mode(100.0, 0.01)]
    for shaper in (cascade(modes), multi_mode(modes)):
        taps = discretise(shaper, 1.1e-3, EXACT, modes)
        assert max(residual(taps, mode) for mode in modes) < 1e-12
        assert max(residual(discretise(shaper, 1.1e-3, LINEAR), mode) for mode in modes) > 1e-3


def test_a_mode_that_the_shaper_is_not_made_for_keeps_its_vibration():
    other = Mode(2.3, 0.05)
    shaper = zv(DAMPED)
    taps = discretise(shaper, 0.0731, EXACT, [DAMPED, other])
    assert residual(taps, DAMPED) < 1e-12
    s = other.omega * complex(other.damping_ratio, np.sqrt(1 - other.damping_ratio**2))
    theirs, ours = (x.amplitudes @ np.exp(s * x.times) for x in (shaper, taps.shaper))
    assert abs(theirs - ours) < 1e-10


def test_exact_taps_without_a_mode_are_the_linear_ones():
    exact, linear = (discretise(ei(MODE), 0.073, way) for way in (EXACT, LINEAR))
    assert_allclose(exact.weights, linear.weights, atol=1e-15)


def test_modes_that_the_taps_cannot_tell_apart_are_refused():
    # 1 Hz and 11 Hz look alike to samples every 0.1 s: a shaper cannot vanish at one and not at the other
    slow, fast = Mode(1.0, 0.0), Mode(11.0, 0.0)
    shaper = zv(Mode(1.0, 0.0))
    late = make_shaper([0.0, 0.53], [0.5, 0.5])
    assert residual(discretise(shaper, 0.1, EXACT, [slow]), slow) < 1e-12
    with pytest.raises(InfeasibleError, match="100 ms"):
        discretise(late, 0.1, EXACT, [slow, fast])
    with pytest.raises(InfeasibleError, match="100 ms"):  # nearly alike: there are taps, of thousands
        discretise(late, 0.1, EXACT, [slow, Mode(11.001, 0.0)])


@settings(max_examples=60)
@given(
    st.sampled_from([zv(DAMPED), zvd(MODE), umzv(DAMPED), mzv(MODE), NONE]),
    st.floats(0.005, 0.14),
    st.sampled_from(list(Interpolation)),
    st.floats(0.0, 3.0),
)
def test_steady_motion_comes_through_late_by_the_delay(shaper, interval, way, more):
    delay = shaper.delay + more * interval
    taps = discretise(shaper, interval, way, [DAMPED], delay=delay)
    assert abs(taps.weights.sum() - 1.0) < 1e-13
    error = taps.delay - taps.latency * interval - delay
    assert abs(error) < (1e-11 if way is not ROUNDED else 0.5 * interval * shaper.sum_abs_amplitude + 1e-12)


def test_moved_exact_taps_stay_exact():
    for make in (zv, zvd, zvdd):
        shaper = make(DAMPED)
        for more in (0.0, 0.02, 0.33):
            taps = discretise(shaper, 0.093, EXACT, [DAMPED], delay=shaper.delay + more)
            assert residual(taps, DAMPED) < 1e-12


def test_a_cubic_needs_a_sample_ahead_only_for_an_impulse_less_than_a_sample_late():
    assert discretise(zv(MODE), 0.09, CUBIC).latency == 0
    moved = discretise(zv(MODE), 0.09, CUBIC, delay=zv(MODE).delay + 0.03)
    assert moved.latency == 1
    assert_allclose(moved.delay, zv(MODE).delay + 0.03 + 0.09, rtol=1e-12)


def test_cubic_taps_reproduce_cubics():
    taps = discretise(zv(MODE), 0.09, CUBIC)
    time = np.arange(40) * 0.09
    cubic = lambda t: 1.0 + t - 0.3 * t**2 + 0.05 * t**3  # noqa: E731
    out = np.convolve(cubic(time), taps.weights, "valid")
    late = time[taps.weights.size - 1 :]
    assert_allclose(out, 0.5 * cubic(late) + 0.5 * cubic(late - 0.5), rtol=1e-13)


@pytest.mark.parametrize("way", Interpolation)
def test_impulses_on_the_grid_are_taken_as_they_are(way):
    shaper = make_shaper([0.0, 4e-3, 9e-3], [0.2, 0.5, 0.3])
    taps = discretise(shaper, 1e-3, way, [Mode(50.0, 0.1)])
    assert_array_equal(taps.weights, [0.2, 0, 0, 0, 0.5, 0, 0, 0, 0, 0.3])
    assert taps.latency == 0


@pytest.mark.parametrize("way", Interpolation)
def test_no_shaper_is_one_tap(way):
    assert_array_equal(discretise(NONE, 1e-3, way).weights, [1.0])


@pytest.mark.parametrize("interval", [0.0, -1e-3, float("nan"), float("inf"), 0.2501])
def test_impossible_intervals_are_refused(interval):
    with pytest.raises(OptionError, match=r"sample") as refused:
        discretise(zv(MODE), interval, LINEAR)
    assert refused.value.argument == "sample_time"


def test_half_the_shaper_is_the_longest_interval():
    assert discretise(zv(MODE), 0.25, LINEAR).weights.tolist() == [0.5, 0.0, 0.5]


def test_a_shaper_of_more_samples_than_memory_should_hold_is_refused():
    with pytest.raises(OptionError, match="more than 200000"):
        discretise(zv(Mode(30.0, 0.0)), 1e-9, Interpolation.LINEAR)
    with pytest.raises(OptionError, match="more than 200000"):  # of an axis that waits for another
        discretise(NONE, 1e-9, Interpolation.LINEAR, delay=1.0)


def test_a_delay_shorter_than_the_shaper_is_a_bug():
    with pytest.raises(ValueError, match="delay"):
        discretise(zv(MODE), 0.1, LINEAR, delay=0.2)


def test_rounding_to_a_coarse_grid_is_told():
    assert coarse(ROUNDED, 0.03, [MODE]) is None
    assert coarse(LINEAR, 0.2, [MODE]) is None
    assert coarse(ROUNDED, 0.2, []) is None
    told = coarse(ROUNDED, 0.1, [Mode(0.1, 0.0), MODE])
    assert told is not None
    assert "0.16 of the vibration at 1 Hz" in told
    assert "0.024" in told
