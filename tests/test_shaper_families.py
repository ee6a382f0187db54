"""Shapers of one mode in closed form or by continuation: published values, conditions, simulated vibration."""

from __future__ import annotations

import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from oscillator import swing_after
from scipy.signal.windows import chebwin

from cnc_shape.errors import InfeasibleError, OptionError
from cnc_shape.modes import Mode
from cnc_shape.shapers import (
    PLAIN,
    cascade,
    duet_ei2,
    duet_ei3,
    ei,
    fitted_ei,
    klipper_ei,
    mzv,
    three_hump_ei,
    two_hump_ei,
    umzv,
    virtual_mode,
    zv,
    zvd,
    zvdd,
    zvddd,
)
from cnc_shape.shapers.analysis import residual_vibration, vibration
from cnc_shape.shapers.extra_insensitive import extra_insensitive
from cnc_shape.shapers.insensitivity import insensitivity

EXACT = ["zv", "zvd", "zvdd", "zvddd", "umzv", "mzv"]  # nothing is left at the mode
EXTRA = {"ei": 0.05, "2hump_ei": 0.0, "3hump_ei": 0.05}  # what is left at the mode, at 5 %
modes = st.builds(Mode, st.floats(0.5, 200.0), st.floats(0.0, 0.3))
HZ = Mode(1.0, 0.0)


# --- published values -----------------------------------------------------------------------------


def test_reference_values(shared):
    cases = json.loads((shared / "data" / "shapers.json").read_text())["cases"]
    single = {
        "ZV": zv, "ZVD": zvd, "ZVDD": zvdd, "ZVDDD": zvddd, "UMZV": umzv, "EI": ei, "EI_heuristic": klipper_ei,
    }  # fmt: skip
    seen = set()
    for case in cases.values():
        name = case["shaper"]
        design = [Mode(m["frequency_hz"], m["damping_ratio"]) for m in case["modes"]]
        if name in single:
            shaper = single[name](design[0])
        elif name == "virtual_mode":
            shaper = virtual_mode(design[0], virtual_frequency=case["options"]["fv_hz"])
        elif name == "ZV*ZV":
            shaper = cascade(design)
        else:
            continue
        assert_allclose(shaper.times, case["times_s"], atol=1e-9)
        assert_allclose(shaper.amplitudes, case["amplitudes"], atol=1e-9)
        if expected := case.get("insensitivity_5pct"):
            band = insensitivity(shaper, design)
            assert_allclose(
                [band.low, band.high, band.width, band.margin], list(expected.values()), atol=1e-8
            )
        seen.add(name)
    assert seen == {*single, "virtual_mode", "ZV*ZV"}


@pytest.mark.parametrize(
    ("make", "width"),
    [(zv, 0.06369), (zvd, 0.28713), (zvdd, 0.48038), (zvddd, 0.62713), (ei, 0.39945), (umzv, 0.05515)],
    ids=["zv", "zvd", "zvdd", "zvddd", "ei", "umzv"],
)
def test_insensitivity_undamped(make, width):
    assert_allclose(insensitivity(make(HZ), [HZ]).width, width, atol=6e-6)


def test_mzv_with_a_tenth_of_critical_damping():
    shaper = mzv(Mode(1.0, 0.1))
    assert_allclose(shaper.times, [0.0, 0.376889, 0.753778], atol=1e-6)
    assert_allclose(shaper.amplitudes, [0.365128, 0.407489, 0.227383], atol=1e-6)


def test_mzv_undamped_is_made_of_square_roots_of_two():
    third = 1.0 - 1.0 / np.sqrt(2.0)
    assert_allclose(mzv(HZ).amplitudes, [third, np.sqrt(2.0) - 1.0, third])


@pytest.mark.parametrize("tolerance", [0.01, 0.05, 0.2])
def test_two_and_three_humps_undamped(tolerance):  # the closed forms by which they are usually given
    v = tolerance
    x = np.cbrt(v**2 * (np.sqrt(1.0 - v**2) + 1.0))
    outer = (3.0 * x**2 + 2.0 * x + 3.0 * v**2) / (16.0 * x)
    two = two_hump_ei(HZ, vibration_tolerance=v)
    assert_allclose(two.amplitudes, [outer, 0.5 - outer, 0.5 - outer, outer])
    assert_allclose(two.times, [0.0, 0.5, 1.0, 1.5])
    outer, next_to_it = (1.0 + 3.0 * v + 2.0 * np.sqrt(2.0 * (v**2 + v))) / 16.0, (1.0 - v) / 4.0
    three = three_hump_ei(HZ, vibration_tolerance=v)
    assert_allclose(
        three.amplitudes, [outer, next_to_it, 1.0 - 2.0 * (outer + next_to_it), next_to_it, outer]
    )


@pytest.mark.parametrize("humps", [1, 2, 3, 4, 6])
@pytest.mark.parametrize("tolerance", [0.005, 0.05])
def test_undamped_extra_insensitive_shapers_are_dolph_chebyshev_windows(humps, tolerance):
    window = chebwin(humps + 2, at=-20.0 * np.log10(tolerance)) if tolerance < 0.0056 else None
    shaper = extra_insensitive(HZ, humps=humps, vibration_tolerance=tolerance)
    ratio = np.linspace(0.0, 2.0, 4001)
    order = humps + 1
    stretched = np.cosh(np.arccosh(1.0 / tolerance) / order) * np.cos(np.pi * ratio / 2.0)
    polynomial = np.polynomial.Chebyshev.basis(order)(stretched)
    assert_allclose(residual_vibration(shaper, HZ, ratio), tolerance * np.abs(polynomial), atol=1e-12)
    if window is not None:  # below 45 dB scipy warns that its window is not meant for spectra
        assert_allclose(shaper.amplitudes, window / window.sum(), atol=1e-12)


@pytest.mark.parametrize(("exact", "fit"), [(two_hump_ei, duet_ei2), (three_hump_ei, duet_ei3)])
@pytest.mark.parametrize("damping", [0.0, 0.05, 0.1, 0.15, 0.2])
def test_published_fits_agree_with_the_exact_solution(exact, fit, damping):
    mode = Mode(1.0, damping)
    assert_allclose(fit(mode).times, exact(mode).times, atol=3e-3)
    assert_allclose(fit(mode).amplitudes, exact(mode).amplitudes, atol=2e-3)


@pytest.mark.parametrize("damping", [0.0, 0.05, 0.1, 0.2])
def test_the_fit_of_ei_agrees_within_its_own_accuracy(damping):
    mode = Mode(1.0, damping)
    assert_allclose(fitted_ei(mode).amplitudes, ei(mode).amplitudes, atol=7e-4)
    assert insensitivity(fitted_ei(mode), [mode], 0.055).width > 0.4  # graded at 5.5 %


# --- conditions, simulated ------------------------------------------------------------------------


@settings(max_examples=25)
@given(modes, st.sampled_from(EXACT))
def test_nothing_is_left_at_the_design_mode(mode, name):
    shaper = PLAIN[name](mode)
    assert_allclose(shaper.amplitudes.sum(), 1.0, atol=1e-12)
    assert name == "umzv" or (shaper.amplitudes > 0.0).all()
    assert swing_after(shaper, mode.natural_frequency, mode.damping_ratio) <= 1e-9


@settings(max_examples=25)
@given(modes, st.sampled_from(sorted(EXTRA)))
def test_the_tolerance_is_left_where_it_is_meant_to_be(mode, name):
    shaper = PLAIN[name](mode)
    assert_allclose(shaper.amplitudes.sum(), 1.0, atol=1e-12)
    assert (shaper.amplitudes > 0.0).all()
    swing = swing_after(shaper, mode.natural_frequency, mode.damping_ratio)
    assert_allclose(swing, EXTRA[name], atol=1e-9)
    slope = np.diff(residual_vibration(shaper, mode, np.array([1.0 - 1e-5, 1.0 + 1e-5])))
    assert name == "2hump_ei" or abs(slope[0]) <= 1e-9  # the mode sits on a hump


@pytest.mark.parametrize("name", sorted(EXTRA))
@pytest.mark.parametrize("damping", [0.02, 0.1, 0.2])
@pytest.mark.parametrize("tolerance", [0.01, 0.05])
def test_between_the_outer_zeros_no_more_than_the_tolerance_is_left(name, damping, tolerance):
    mode = Mode(1.0, damping)
    shaper = PLAIN[name](mode, vibration_tolerance=tolerance)
    band = insensitivity(shaper, [mode], tolerance * (1.0 + 1e-7))
    assert band.width > insensitivity(zvd(mode), [mode], tolerance).width
    inside = np.linspace(band.low, band.high, 20001)
    worst = residual_vibration(shaper, mode, inside)
    humps = (worst[1:-1] > worst[:-2]) & (worst[1:-1] > worst[2:])
    assert humps.sum() == {"ei": 1, "2hump_ei": 2, "3hump_ei": 3}[name]
    assert_allclose(worst[1:-1][humps], tolerance, rtol=1e-6)


@pytest.mark.parametrize("derivatives", [0, 1, 4, 9])
def test_derivatives_flatten_the_sensitivity(derivatives):
    """V grows like the power derivatives + 1 of the frequency's error."""
    shaper = zv(Mode(1.0, 0.05), derivatives=derivatives)
    near, far = vibration(shaper, 2.0 * np.pi * np.array([1.02, 1.04]), 0.05)
    assert_allclose(np.log2(far / near), derivatives + 1, atol=0.1 * (derivatives + 1))


@pytest.mark.parametrize(("impulses", "periods"), [(3, 0.75), (4, 1.0), (5, 1.25), (6, 2.0)])
def test_the_zeros_of_mzv_lie_where_the_definition_puts_them(impulses, periods):
    shaper = mzv(HZ, impulses=impulses, duration_periods=periods)
    tau = periods * (impulses - 2) / (impulses - 2 * periods - 1)
    zeros = 1.0 + np.arange(impulses - 1) / tau
    assert_allclose(residual_vibration(shaper, HZ, zeros), 0.0, atol=1e-12)
    assert_allclose(shaper.duration, periods)


def test_mzv_of_half_periods_is_zvd():
    mode = Mode(3.0, 0.07)
    assert_allclose(mzv(mode, duration_periods=1.0).amplitudes, zvd(mode).amplitudes)


# --- virtual mode ---------------------------------------------------------------------------------


@pytest.mark.parametrize(("times", "like"), [(1.0, zvd), (5.0, umzv)])
def test_virtual_modes_that_are_known_shapers(times, like):
    shaper = virtual_mode(Mode(8.0, 0.0), virtual_frequency=8.0 * times)
    assert_allclose(shaper.times, like(Mode(8.0, 0.0)).times)
    assert_allclose(shaper.amplitudes, like(Mode(8.0, 0.0)).amplitudes)


@given(st.floats(0.5, 100.0), st.floats(0.3, 12.0))
def test_both_modes_are_cancelled_and_all_ways_to_ask_agree(frequency, times):
    mode = Mode(frequency, 0.0)
    shaper = virtual_mode(mode, virtual_frequency=times * frequency)
    assert vibration(shaper, mode.omega, 0.0) <= 1e-9
    assert vibration(shaper, times * mode.omega, 0.0) <= 1e-9
    by_time = virtual_mode(mode, duration=shaper.duration)
    by_periods = virtual_mode(mode, duration_periods=2.0 / (1.0 + times))
    for other in (by_time, by_periods):
        assert_allclose(other.amplitudes, shaper.amplitudes, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize(
    ("amplitude", "frequency", "duration"), [(1.2, 5.628044, 0.301748), (1.5, 6.470478, 0.267720)]
)  # paper 001
def test_the_amplitude_of_the_actuator_sets_the_virtual_mode(amplitude, frequency, duration):
    shaper = virtual_mode(HZ, max_amplitude=amplitude)
    assert_allclose(shaper.max_running_sum, amplitude)
    assert_allclose(shaper.duration, duration, atol=1e-6)
    assert_allclose(2.0 / shaper.duration - 1.0, frequency, atol=1e-5)
    assert_allclose(shaper.sum_abs_amplitude, 4.0 * amplitude - 1.0)


def test_the_insensitivity_of_a_virtual_mode_in_closed_form():
    """``V(r) = |cos(phi r) - cos phi| / (1 - cos phi)``; its band tends to sqrt 1.05 - sqrt 0.95."""
    shaper = virtual_mode(HZ, virtual_frequency=10.0)
    angle = 2.0 * np.pi / 11.0
    ends = np.arccos(np.cos(angle) + 0.05 * (1.0 - np.cos(angle)) * np.array([1.0, -1.0])) / angle
    band = insensitivity(shaper, [HZ])
    assert_allclose([band.low, band.high], ends)
    narrow = virtual_mode(HZ, virtual_frequency=1000.0)
    assert_allclose(insensitivity(narrow, [HZ]).width, np.sqrt(1.05) - np.sqrt(0.95), atol=1e-5)


# --- what is refused ------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("make", "error", "message"),
    [
        (lambda: zv(HZ, derivatives=-1), OptionError, "0 to 20, not -1"),
        (lambda: mzv(HZ, impulses=2), OptionError, "3 to 20 impulses, not 2"),
        (lambda: mzv(HZ, duration_periods=2.0), OptionError, "less than 2 damped periods"),
        (lambda: mzv(HZ, duration_periods=np.nan), OptionError, "not nan"),
        (lambda: ei(HZ, vibration_tolerance=1.0), OptionError, "not 1"),
        (lambda: ei(HZ, vibration_tolerance=0.0), OptionError, "not 0"),
        (lambda: ei(Mode(1.0, 0.9)), InfeasibleError, "up to a damping ratio of 0.69, not for 0.9"),
        (lambda: umzv(Mode(1.0, 0.99)), InfeasibleError, "damping 0.99"),
        (lambda: virtual_mode(Mode(1.0, 0.1), virtual_frequency=2.0), OptionError, "undamped mode"),
        (lambda: virtual_mode(HZ), OptionError, "takes one of .* not 0"),
        (lambda: virtual_mode(HZ, virtual_frequency=2.0, duration=0.3), OptionError, "not 2"),
        (lambda: virtual_mode(HZ, virtual_frequency=-2.0), OptionError, "positive and finite, not -2"),
        (lambda: virtual_mode(HZ, duration_periods=2.0), InfeasibleError, "less than two periods"),
        (lambda: virtual_mode(HZ, virtual_frequency=1e5), InfeasibleError, "cancel each other"),
        (lambda: virtual_mode(HZ, max_amplitude=0.2), InfeasibleError, "0.25 high at least, not 0.2"),
    ],
)
def test_designs_that_do_not_exist_are_refused(make, error, message):
    with pytest.raises(error, match=message):
        make()
