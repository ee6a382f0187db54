"""Time-optimal shapers: closed forms, published durations, and what they promise on whole rectangles."""

from __future__ import annotations

import json
from math import inf, nan, pi, sqrt

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp

from cnc_shape.errors import InfeasibleError, OptionError
from cnc_shape.modes import Mode
from cnc_shape.shapers import cascade, zv, zvd
from cnc_shape.shapers.optimal import optimal

ONE = Mode(1.0, 0.0)
TWO = (ONE, Mode(10.0 / 3.0, 0.0))


def vibration(shaper, frequency, damping, order=0):
    """``e^{-zeta omega t_N} |sum A t^k e^{s t}|``, written out; frequency in Hz, one or many."""
    omega = 2.0 * pi * np.asarray(frequency)[..., None]
    t, a = shaper.times, shaper.amplitudes
    terms = a * t**order * np.exp(-damping * omega * (t[-1] - t))
    phase = omega * np.sqrt(1.0 - damping**2) * t
    return np.hypot((terms * np.cos(phase)).sum(-1), (terms * np.sin(phase)).sum(-1))


def worst(shaper, mode):
    """Largest V on a dense grid of the rectangle of a mode."""
    u, w = mode.frequency_uncertainty, mode.damping_uncertainty
    frequencies = mode.natural_frequency * np.linspace(1.0 - u, 1.0 + u, 4001)
    dampings = mode.damping_ratio * np.linspace(1.0 - w, 1.0 + w, 21 if w else 1)
    return max(vibration(shaper, frequencies, damping).max() for damping in dampings)


def check(shaper, modes, tolerance=0.05, low=0.0, high=1.0):
    """What every time-optimal shaper promises."""
    assert shaper.times[0] == 0.0
    assert (np.diff(shaper.times) > 0.0).all()
    assert_allclose(shaper.amplitudes.sum(), 1.0, atol=1e-12)
    sums = np.cumsum(shaper.amplitudes)
    assert low - 1e-9 <= sums.min()
    assert sums.max() <= high + 1e-9
    assert (np.abs(shaper.amplitudes) >= 1e-9).all()
    for mode in modes:
        if mode.frequency_uncertainty or (mode.damping_uncertainty and mode.damping_ratio):
            assert worst(shaper, mode) <= tolerance * (1.0 + 1e-6)
        else:
            assert vibration(shaper, mode.natural_frequency, mode.damping_ratio) <= 1e-12


@pytest.mark.parametrize("damping", [0.0, 0.1, 0.3])
def test_zv_and_zvd_are_the_shortest_without_negative_impulses(damping):
    """Known modes, undamped: half a period, a whole one; damping lets nothing shorter either."""
    mode = Mode(30.0, damping)
    for derivatives, closed in (([0], zv(mode)), ([1], zvd(mode))):
        shaper = optimal([mode], positive=True, derivatives=derivatives)
        assert shaper.duration <= closed.duration * (1.0 + 1e-9)
        if derivatives == [0] or damping == 0.0:
            assert_allclose(shaper.times, closed.times, rtol=1e-9)
            assert_allclose(shaper.amplitudes, closed.amplitudes, rtol=1e-9)
        assert vibration(shaper, 30.0, damping, derivatives[0]) <= 1e-12


@pytest.mark.parametrize("damping", [0.0, 0.1, 0.3])
def test_umzv_is_the_shortest_where_a_step_stays_between_0_and_1(damping):
    shaper = optimal([Mode(1.0, damping)])
    assert_allclose(shaper.amplitudes, [1.0, -1.0, 1.0], atol=1e-12)
    s = 2.0 * pi * complex(damping, sqrt(1.0 - damping**2))
    assert abs(1.0 - np.exp(s * shaper.times[1]) + np.exp(s * shaper.times[2])) < 1e-11
    if damping == 0.0:
        assert_allclose(shaper.times, [0.0, 1 / 6, 1 / 3], atol=1e-12)
    if damping == 0.1:  # spec of the shapers, section 2
        assert_allclose(shaper.times, [0.0, 0.196800, 0.335717], atol=1e-6)


def test_a_step_that_may_go_the_wrong_way_is_quicker():
    """Impulses 1, -2, 2: ``1 - 2 e^{ja} + 2 e^{jb} = 0`` gives cos a = 1/4, cos b = -1/4."""
    shaper = optimal([ONE], min_running_sum=-1.0)
    assert_allclose(shaper.amplitudes, [1.0, -2.0, 2.0], atol=1e-12)
    assert_allclose(shaper.times[1:] * 2.0 * pi, [np.arccos(0.25), np.arccos(-0.25)], rtol=1e-11)


def test_a_bound_on_the_sum_of_sizes():
    """Symmetric virtual-mode shaper: A1 = 5/8, A2 = -1/4, so cos(pi t_N) = 1/5."""
    shaper = optimal([ONE], max_sum_abs_amplitude=1.5)
    assert_allclose(shaper.duration, np.arccos(0.2) / pi, rtol=1e-6)
    assert shaper.sum_abs_amplitude <= 1.5 + 1e-9
    assert_allclose(optimal([ONE], max_sum_abs_amplitude=1.0).times, [0.0, 0.5])


def test_a_bound_on_single_impulses():
    """Half a period again, and what the bound takes off the two impulses comes 1/200 period later."""
    shaper = optimal([ONE], positive=True, max_amplitude=0.4)
    assert shaper.amplitudes.max() <= 0.4 + 1e-9
    assert np.diff(shaper.times).min() >= 1.0 / 200.0 - 1e-9
    assert 0.5 < shaper.duration < 0.51
    check(shaper, [ONE])


def bands(*uncertainties):
    return [Mode(m.natural_frequency, 0.0, 1.0, u) for m, u in zip(TWO, uncertainties, strict=False)]


ROWS = {  # spec of the shapers, section 7: modes, options, what a linear program on a grid of T/200 reaches
    "ZV_positive": ([ONE], {"positive": True}, 0.5),
    "ZVD_positive": ([ONE], {"positive": True, "derivatives": [1]}, 1.0),
    "neg_cum_in_[0,1]_UMZV_class": ([ONE], {}, 1 / 3),
    "neg_cum_in_[-1,1]": ([ONE], {"min_running_sum": -1.0}, 0.295),
    "2modes_1_3.333_positive": (TWO, {"positive": True}, 0.650),
    "2modes_cum_in_[0,1]": (TWO, {}, 0.385),
    "2modes_ZVD_positive": (TWO, {"positive": True, "derivatives": [1, 1]}, 1.135),
    "SI_I0.4": (bands(0.2), {"positive": True}, 1.005),
    "SI_I0.7": (bands(0.35), {"positive": True}, 1.475),
    "SI_2modes_pm10pct": (bands(0.1, 0.1), {"positive": True}, 0.975),
}


@pytest.mark.parametrize("row", ROWS)
def test_no_longer_than_on_a_grid(row):
    modes, options, duration = ROWS[row]
    shaper = optimal(modes, **options)
    check(shaper, modes, low=options.get("min_running_sum", 0.0))
    assert shaper.duration <= duration * (1.0 + 1e-9)
    if options.get("positive"):
        assert (shaper.amplitudes > 0.0).all()


def test_the_rows_are_those_of_the_reference(shared):
    reference = json.loads((shared / "data" / "shapers.json").read_text())["beyond"]
    published = reference["LP_min_duration_grid_T/200"]
    assert set(published) == set(ROWS)
    for name, (_, _, duration) in ROWS.items():
        assert duration <= published[name]["duration_over_T"] + 1e-12


def test_ei_is_the_shortest_on_its_own_band():
    """EI at 5 %: ``V = |0.525 cos(pi r) + 0.475|`` reaches 0.05 at cos(pi (r - 1)) = 17/21, in one period."""
    shaper = optimal([Mode(1.0, 0.0, 1.0, np.arccos(17 / 21) / pi)], positive=True)
    assert_allclose(shaper.duration, 1.0, atol=2e-6)
    assert_allclose(shaper.amplitudes[[0, -1]], 1.05 / 4, atol=1e-4)


@pytest.mark.parametrize(
    ("modes", "options"),
    [
        ([Mode(1.0, 0.1, 1.0, 0.2, 0.2)], {"positive": True}),
        ([Mode(1.0, 0.1, 1.0, 0.2, 0.2)], {}),
        ([Mode(1.0, 0.3, 1.0, 0.4, 0.2)], {"positive": True}),
        ([Mode(8.0, 0.05, 1.0, 0.0, 0.5)], {"vibration_tolerance": 0.01}),
        ([Mode(30.0, 0.02, 1.0, 0.1), Mode(100.0, 0.01)], {}),
        ([Mode(30.0, 0.02, 1.0, 0.1), Mode(100.0, 0.01)], {"positive": True}),
        ([Mode(20.0, 0.02), Mode(47.0, 0.05), Mode(90.0, 0.01)], {"min_running_sum": -0.5}),
        ([Mode(20.0, 0.0, 1.0, 0.05), Mode(27.0, 0.1, 1.0, 0.1, 0.3)], {"max_running_sum": 1.5}),
        ([Mode(2.0, 0.02), Mode(80.0, 0.05)], {}),
    ],
)
def test_promises_with_damping_and_uncertainty(modes, options):
    shaper = optimal(modes, **options)
    check(
        shaper, modes, options.get("vibration_tolerance", 0.05),
        options.get("min_running_sum", 0.0), options.get("max_running_sum", 1.0),
    )  # fmt: skip
    assert not options.get("positive") or (shaper.amplitudes > 0.0).all()


@pytest.mark.parametrize("seed", range(6))
def test_random_modes_are_silent_sooner_than_by_a_cascade(seed):
    random = np.random.default_rng(seed)
    first = random.uniform(5.0, 40.0)
    modes = [
        Mode(first, random.uniform(0, 0.2)),
        Mode(first * random.uniform(1.3, 5), random.uniform(0, 0.1)),
    ]
    positive, general = optimal(modes, positive=True), optimal(modes)
    check(positive, modes)
    check(general, modes)
    assert general.duration <= positive.duration <= cascade(modes).duration * (1.0 + 1e-9)


def test_nothing_rings_after_the_last_impulse():
    """RK45 of ``y'' + 2 zeta omega y' + omega^2 y = omega^2 u`` for a step through the shaper."""
    modes = [Mode(2.0, 0.1), Mode(5.0, 0.03)]
    shaper = optimal(modes)
    for mode in modes:
        omega, zeta, state = mode.omega, mode.damping_ratio, np.zeros(2)
        for i, level in enumerate(np.cumsum(shaper.amplitudes)[:-1]):
            state = solve_ivp(
                lambda _, y, u=level, w=omega, z=zeta: [y[1], w * w * (u - y[0]) - 2 * z * w * y[1]],
                (shaper.times[i], shaper.times[i + 1]), state, rtol=1e-11, atol=1e-13,
            ).y[:, -1]  # fmt: skip
        assert_allclose(state, [1.0, 0.0], atol=1e-8)


def test_the_same_request_gives_the_same_bytes():
    modes = [Mode(30.0, 0.02, 1.0, 0.1), Mode(100.0, 0.01, 1.0, 0.05)]
    one, other = optimal(modes), optimal(modes)
    assert one.times.tobytes() == other.times.tobytes()
    assert one.amplitudes.tobytes() == other.amplitudes.tobytes()


def test_only_ratios_of_frequencies_count():
    slow, fast = optimal([Mode(1.0, 0.05), Mode(2.5, 0.0)]), optimal([Mode(64.0, 0.05), Mode(160.0, 0.0)])
    assert_allclose(slow.times, 64.0 * fast.times, rtol=1e-9)
    assert_allclose(slow.amplitudes, fast.amplitudes, atol=1e-9)


@pytest.mark.parametrize(
    ("modes", "options", "argument", "number"),
    [
        ([], {}, "modes", "0"),
        ([Mode(float(f), 0.0) for f in range(1, 8)], {}, "modes", "7"),
        ([ONE, Mode(60.0, 0.0)], {}, "modes", "60"),
        ([ONE, ONE], {}, "modes", "1 Hz"),
        ([ONE], {"vibration_tolerance": 0.0}, "vibration_tolerance", "0.0"),
        ([ONE], {"vibration_tolerance": nan}, "vibration_tolerance", "nan"),
        ([ONE], {"max_running_sum": 0.9}, "max_running_sum", "0.9"),
        ([ONE], {"max_running_sum": inf}, "max_running_sum", "inf"),
        ([ONE], {"min_running_sum": 0.1}, "min_running_sum", "0.1"),
        ([ONE], {"max_amplitude": -1.0}, "max_amplitude", "-1.0"),
        ([ONE], {"max_amplitude": nan}, "max_amplitude", "nan"),
        ([ONE], {"max_sum_abs_amplitude": inf}, "max_sum_abs_amplitude", "inf"),
        ([ONE], {"derivatives": [1, 1]}, "derivatives", "2"),
        ([ONE], {"derivatives": [9]}, "derivatives", "9"),
        (bands(0.1), {"derivatives": [1]}, "derivatives", "1"),
    ],
)
def test_requests_that_make_no_sense_are_refused(modes, options, argument, number):
    with pytest.raises(OptionError, match=number) as caught:
        optimal(modes, **options)
    assert caught.value.argument == argument
    assert caught.value.hint


@pytest.mark.parametrize(
    ("modes", "options", "argument", "number"),
    [
        ([ONE], {"max_sum_abs_amplitude": 0.5}, "max_sum_abs_amplitude", "0.5"),
        ([ONE], {"max_amplitude": 1e-4}, "max_amplitude", "0.0001"),
        (bands(0.95), {"vibration_tolerance": 1e-3, "positive": True}, "vibration_tolerance", "0.001"),
    ],
)
def test_requests_that_nothing_satisfies_are_refused(modes, options, argument, number):
    with pytest.raises(InfeasibleError, match=number) as caught:
        optimal(modes, **options)
    assert caught.value.argument == argument
    assert caught.value.hint
