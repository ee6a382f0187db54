"""Several modes with the fewest impulses: published values, closed forms, and nothing left ringing."""

from __future__ import annotations

import json
from math import cos, pi, sqrt

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp
from scipy.optimize import fsolve

from cnc_shape.errors import InfeasibleError, OptionError
from cnc_shape.modes import Mode
from cnc_shape.shapers import cascade, zv, zvd
from cnc_shape.shapers.impulse_equations import conditions
from cnc_shape.shapers.multi_mode import multi_mode

MILLISECOND = 1e-3


def vibration(shaper, mode, order=0):
    """``|sum A_i (t_i/T)^order e^{s (t_i - t_N)}|``, impulse by impulse."""
    total = 0j
    for time, amplitude in zip(shaper.times.tolist(), shaper.amplitudes.tolist(), strict=True):
        late = time - shaper.times[-1]
        omega = 2.0 * pi * mode.natural_frequency
        phase = omega * sqrt(1.0 - mode.damping_ratio**2) * late
        weight = amplitude * np.exp(omega * mode.damping_ratio * late) * (time / mode.damped_period) ** order
        total += weight * complex(cos(phase), np.sin(phase))
    return abs(total)


def assert_cancels(shaper, modes, tolerance=1e-9):
    assert shaper.times[0] == 0.0
    assert (np.diff(shaper.times) > 0.0).all()
    assert abs(shaper.amplitudes.sum() - 1.0) < 1e-12
    assert max(vibration(shaper, mode) for mode in modes) <= tolerance


def assert_shaper(shaper, times, amplitudes, period):
    """Equal to the published impulses, or to their mirror image."""
    times, amplitudes = np.asarray(times), np.asarray(amplitudes)
    if not np.allclose(shaper.times, times, rtol=0.0, atol=1e-6 * period):
        times, amplitudes = times[-1] - times[::-1], amplitudes[::-1]
    assert_allclose(shaper.times, times, rtol=0.0, atol=1e-6 * period)
    assert_allclose(shaper.amplitudes, amplitudes, rtol=0.0, atol=1e-6)


def undamped(*frequencies):
    return [Mode(frequency, 0.0) for frequency in frequencies]


# Published and reference values


@pytest.mark.parametrize(("name", "positive"), [("", False), ("_positive", True)], ids=["any", "positive"])
def test_reference_of_30_and_100_hz(shared, name, positive):  # paper 000, Fig. 9
    cases = json.loads((shared / "data" / "shapers.json").read_text())["cases"]
    key = f"paper000_fig9_multimode3{name}_30_100"
    case = cases[key] if isinstance(cases, dict) else next(c for c in cases if key in c.values())
    shaper = multi_mode(undamped(30.0, 100.0), positive=positive)
    assert_shaper(shaper, case["times_s"], case["amplitudes"], 1.0 / 30.0)


@pytest.mark.parametrize("damping", [(0.0, 0.0), (0.02, 0.01)], ids=["undamped", "damped"])
@pytest.mark.parametrize("positive", [False, True], ids=["any", "positive"])
def test_reference_with_derivatives(shared, damping, positive):  # spec of the shapers, section 7
    beyond = json.loads((shared / "data" / "shapers.json").read_text())["beyond"]
    key = f"confluent_[30,100]_[{damping[0]:g},{damping[1]:g}]_[1,1]"
    case = beyond[key]["shortest_positive" if positive else "shortest"]
    modes = [Mode(30.0, damping[0]), Mode(100.0, damping[1])]
    shaper = multi_mode(modes, derivatives=[1, 1], positive=positive)
    assert_shaper(shaper, case["times_s"], case["amplitudes"], 1.0 / 30.0)


def test_30_and_100_hz_undamped():  # spec of the shapers, section 4: 29 % shorter than the cascade
    modes = undamped(30.0, 100.0)
    shaper = multi_mode(modes)
    assert_allclose(shaper.times, [0.0, 1 / 130, 2 / 130], rtol=1e-9)
    assert_allclose(shaper.amplitudes, [0.56853, -0.13706, 0.56853], atol=5e-6)
    assert_allclose(1.0 - shaper.duration / cascade(modes).duration, 0.29, atol=5e-3)


def test_30_and_100_hz_damped():  # spec of the shapers, section 4
    modes = [Mode(30.0, 0.02), Mode(100.0, 0.01)]
    shaper = multi_mode(modes)
    assert_allclose(shaper.times / MILLISECOND, [0.0, 7.49719, 15.38371], atol=5e-6)
    assert_allclose(shaper.amplitudes, [0.587867, -0.137673, 0.549806], atol=5e-7)
    assert_cancels(shaper, modes)


def test_one_robust_mode_of_two_gains_nothing():  # spec of the shapers, section 7: 31.6 ms against 30.769 ms
    modes = undamped(30.0, 100.0)
    shaper = multi_mode(modes, derivatives=[1, 0])
    assert shaper.times.size == 4
    assert_allclose(shaper.duration / MILLISECOND, 31.586955, atol=1e-6)
    assert_cancels(shaper, modes)
    assert vibration(shaper, modes[0], order=1) < 1e-9
    assert vibration(shaper, modes[1], order=1) > 1e-3


def test_robust_to_both_is_the_shaper_twice():  # spec of the shapers, section 7: undamped, 30.769 ms
    modes = undamped(30.0, 100.0)
    once, twice = multi_mode(modes), multi_mode(modes, derivatives=[1, 1])
    assert_allclose(twice.times, np.arange(5) / 130.0, rtol=1e-9)
    assert_allclose(twice.amplitudes, np.convolve(once.amplitudes, once.amplitudes), atol=1e-9)


# Closed forms


@pytest.mark.parametrize("ratio", [1.2, 1.5, 2.0, 2.5, 2.999, 3.0001, 3.3, 4.0, 5.0, 6.5, 7.0, 8.5])
def test_two_undamped_modes(ratio):  # paper 001: equal spacing 1/(f1+f2), A1 = 1/(2(1 - cos phi))
    phase = 2.0 * pi / (1.0 + ratio)
    outer = 0.5 / (1.0 - cos(phase))
    shaper = multi_mode(undamped(1.0, ratio), max_amplitude=4.0)
    assert_allclose(shaper.times, np.arange(3) / (1.0 + ratio), rtol=1e-8)
    assert_allclose(shaper.amplitudes, [outer, 1.0 - 2.0 * outer, outer], atol=1e-9)


def test_one_mode_is_zv():
    for damping in (0.0, 0.1, 0.5):
        mode = Mode(7.0, damping)
        shaper = multi_mode([mode])
        assert_allclose(shaper.times, zv(mode).times, rtol=1e-9)
        assert_allclose(shaper.amplitudes, zv(mode).amplitudes, rtol=1e-9)


def test_one_robust_mode_is_zvd():
    mode = Mode(7.0, 0.1)
    shaper = multi_mode([mode], derivatives=[1])
    assert_allclose(shaper.times, zvd(mode).times, rtol=1e-9)
    assert_allclose(shaper.amplitudes, zvd(mode).amplitudes, rtol=1e-9)


# Fewer impulses, close modes, mirror images


@pytest.mark.parametrize("frequencies", [(1.0, 3.0), (3.0, 1.0), (1.0, 3.0, 5.0), (2.0, 6.0, 14.0, 10.0)])
def test_odd_ratios_need_two_impulses(frequencies):  # half a period of the slowest is an odd one of all
    shaper = multi_mode(undamped(*frequencies), positive=True)
    assert_allclose(shaper.times, [0.0, 0.5 / min(frequencies)], rtol=1e-9)
    assert_allclose(shaper.amplitudes, [0.5, 0.5], rtol=1e-9)


def test_three_modes_on_one_comb_need_three_impulses():  # 1, 2 and 4 Hz: V is 3-periodic
    shaper = multi_mode(undamped(1.0, 2.0, 4.0))
    assert_allclose(shaper.times, [0.0, 1 / 3, 2 / 3], rtol=1e-9)
    assert_allclose(shaper.amplitudes, [1 / 3] * 3, rtol=1e-9)


def test_a_superfluous_impulse_with_damping():  # equal decay and odd ratio of damped frequencies
    decay, slow = 0.1, 2.0 * pi
    modes = [Mode(np.hypot(decay, k * slow) / (2.0 * pi), decay / np.hypot(decay, k * slow)) for k in (1, 3)]
    shaper = multi_mode(modes)
    assert_allclose(shaper.times, zv(modes[0]).times, rtol=1e-9)
    assert_allclose(shaper.amplitudes, zv(modes[0]).amplitudes, rtol=1e-9)


@pytest.mark.parametrize("distance", [1e-12, 1e-9, 1e-7, 1e-6, 1e-4, 1e-3, 1e-2])
@pytest.mark.parametrize("damping", [0.0, 0.1])
def test_close_modes_come_to_a_derivative(distance, damping):
    modes = [Mode(20.0, damping), Mode(20.0 * (1.0 + distance), damping)]
    shaper, limit = multi_mode(modes), multi_mode(modes[:1], derivatives=[1])
    assert_cancels(shaper, modes, 1e-12)
    assert_allclose(shaper.times, limit.times, rtol=1e-8 + distance)
    assert_allclose(shaper.amplitudes, limit.amplitudes, rtol=1e-8 + distance)


def test_close_modes_among_others():
    modes = [Mode(20.0, 0.02), Mode(20.0001, 0.02), Mode(55.0, 0.01)]
    shaper, limit = multi_mode(modes), multi_mode(modes[::2], derivatives=[1, 0])
    assert_cancels(shaper, modes, 1e-12)
    assert_allclose(shaper.times, limit.times, rtol=0.0, atol=1e-4 / 20.0)


@pytest.mark.parametrize("spread", [0.0, 1e-5, 0.01, 0.03])
def test_divided_differences_span_the_modes(spread):  # any combination that the rows forbid, the modes forbid
    poles = [complex(0.2, 6.0) * (1.0 + spread * k) for k in (0.0, 1.0, 1.3)]
    times = np.linspace(0.0, 2.0, 9)
    value, _ = conditions(poles, [0, 0, 0]).basis(times[None])
    value = value[0] * np.exp(poles[0].real * (1.0 + spread * 2.3 / 3.0) * 2.0)
    for pole in poles:
        target = np.exp(pole * times)
        share = np.linalg.lstsq(value.T, target, rcond=None)[0]
        assert_allclose(share @ value, target, rtol=1e-12)


@pytest.mark.parametrize("spread", [0.0, 1e-5, 0.01, 0.3])
def test_slopes_are_derivatives(spread):
    rows = conditions([complex(0.2, 6.0) * (1.0 + spread * k) for k in (0.0, 1.0, 1.3)], [0, 1, 0])
    times, step = np.linspace(0.0, 2.0, 9), 1e-6
    moving = np.append(np.ones(8), 0.0)  # the last time sets the scale
    ahead, behind = (rows.basis((times + d * moving)[None])[0] for d in (step, -step))
    assert_allclose(
        rows.basis(times[None])[1][..., :-1], (ahead - behind)[..., :-1] / (2.0 * step), atol=1e-7
    )


@pytest.mark.parametrize("frequencies", [(30.0, 100.0), (1.0, 1.3, 8.7), (5.0, 7.0, 31.0)])
def test_the_mirror_image_with_the_larger_first_impulse(frequencies):
    shaper = multi_mode(undamped(*frequencies), positive=True)
    assert shaper.amplitudes[0] >= shaper.amplitudes[-1] - 1e-12


def test_the_same_every_time():
    modes = [Mode(12.0, 0.03), Mode(31.0, 0.01), Mode(77.0, 0.02)]
    first, second = multi_mode(modes), multi_mode(modes)
    assert first.times.tobytes() == second.times.tobytes()
    assert first.amplitudes.tobytes() == second.amplitudes.tobytes()


def test_units_do_not_matter():
    slow, fast = (multi_mode([Mode(f, 0.05), Mode(2.7 * f, 0.02)]) for f in (1.0, 1000.0))
    assert_allclose(fast.times * 1000.0, slow.times, rtol=1e-9)
    assert_allclose(fast.amplitudes, slow.amplitudes, rtol=1e-9)


# Properties


@st.composite
def spread_modes(draw, least, most):
    ratios = draw(st.lists(st.floats(1.0, 10.0), min_size=least, max_size=most, unique=True))
    damped = draw(st.booleans())
    return [Mode(13.0 * ratio, draw(st.floats(0.0, 0.3)) if damped else 0.0) for ratio in ratios]


@settings(max_examples=15)
@given(spread_modes(2, 3), st.sampled_from([1.0, 1.5, 2.0]))
def test_any_modes(modes, bound):
    shaper = multi_mode(modes, max_amplitude=bound)
    assert shaper.times.size <= len(modes) + 1
    assert np.abs(shaper.amplitudes).max() <= bound + 1e-9
    assert shaper.duration <= cascade(modes).duration * (1.0 + 1e-9)
    assert_cancels(shaper, modes)


@settings(max_examples=8)
@given(spread_modes(2, 3))
def test_any_modes_with_positive_impulses(modes):
    shaper = multi_mode(modes, positive=True)
    assert (shaper.amplitudes > 0.0).all()
    assert_cancels(shaper, modes)
    assert shaper.duration >= multi_mode(modes).duration * (1.0 - 1e-9)


def test_nothing_rings_after_the_last_impulse():  # y'' + 2 zeta omega y' + omega^2 y, kicked by each impulse
    modes = [Mode(3.0, 0.08), Mode(7.1, 0.02), Mode(11.0, 0.15)]
    shaper = multi_mode(modes)
    for mode in modes:
        omega = 2.0 * pi * mode.natural_frequency

        def motion(_, y, omega=omega, zeta=mode.damping_ratio):
            return [y[1], -2.0 * zeta * omega * y[1] - omega**2 * y[0]]

        state, largest = np.zeros(2), 0.0
        for k, amplitude in enumerate(shaper.amplitudes):
            state = state + np.array([0.0, amplitude])
            if k + 1 < shaper.times.size:
                ran = solve_ivp(motion, shaper.times[k : k + 2], state, rtol=1e-11, atol=1e-14)
                state, largest = ran.y[:, -1], max(largest, np.hypot(omega * ran.y[0], ran.y[1]).max())
        assert largest > 0.1
        assert np.hypot(omega * state[0], state[1]) < 1e-8


@pytest.mark.parametrize("positive", [False, True], ids=["any", "positive"])
@pytest.mark.parametrize(
    "modes",
    [
        [Mode(1.0, 0.0), Mode(2.3, 0.0)],
        [Mode(1.0, 0.21), Mode(4.4, 0.05)],
        [Mode(1.0, 0.1), Mode(1.9, 0.02), Mode(3.4, 0.2)],
    ],
    ids=["undamped", "damped", "three"],
)
def test_no_shorter_solution_by_another_solver(modes, positive):  # MINPACK from random starts
    shaper = multi_mode(modes, positive=positive)
    random = np.random.default_rng(7)
    poles = [
        2.0 * pi * m.natural_frequency * complex(m.damping_ratio, sqrt(1 - m.damping_ratio**2)) for m in modes
    ]
    count = len(modes) + 1

    def equations(x):
        times = np.append(0.0, x[count:])
        sums = [np.exp(s * times - s.real * times.max()) @ x[:count] for s in poles]
        return np.append([x[:count].sum() - 1.0], np.array(sums).view(float))

    shortest, agreeing = np.inf, 0
    for _ in range(200):
        start = np.append(
            random.uniform(-1.0, 1.0, count), np.sort(random.random(count - 1)) * shaper.duration * 1.05
        )
        x, _, status, _ = fsolve(equations, start, full_output=True)
        times = np.sort(np.append(0.0, x[count:]))
        times = times - times[0]
        if status != 1 or np.abs(equations(x)).max() > 1e-9 or np.diff(times).min() < 1e-6:
            continue
        if np.abs(x[:count]).max() <= 2.0 and (not positive or x[:count].min() > 0.0):
            shortest = min(shortest, times[-1])
            agreeing += abs(times[-1] - shaper.duration) < 1e-7
    assert agreeing > 0
    assert_allclose(shortest, shaper.duration, rtol=1e-7)


@pytest.mark.parametrize(
    ("ratios", "shortest"), [((1.0, 10.0, 100.0), 0.23357590), ((1.0, 3.0, 30.0), 0.51666667)]
)
def test_modes_far_apart(ratios, shortest):  # the shortest of a search ten times as long
    assert_allclose(multi_mode(undamped(*ratios)).duration, shortest, rtol=1e-6)


def test_a_tight_bound_makes_it_longer():
    modes = undamped(1.0, 30.0)
    durations = [multi_mode(modes, max_amplitude=bound).duration for bound in (3.0, 2.0, 1.0, 0.6)]
    assert durations == sorted(durations)
    assert durations[0] < durations[-1]


# Complaints


def test_the_bound_is_too_small():
    with pytest.raises(InfeasibleError, match=r"\|A\| <= 0.3: the smallest found is 0.36") as caught:
        multi_mode(undamped(30.0, 100.0), max_amplitude=0.3)
    assert caught.value.argument == "max_amplitude"
    assert multi_mode(undamped(30.0, 100.0), max_amplitude=0.37).times.size == 3  # as the hint says


def test_positive_and_bounded():
    with pytest.raises(InfeasibleError, match=r"the smallest found is 0\.25") as caught:
        multi_mode(undamped(1.0, 2.0, 3.0), positive=True, max_amplitude=0.2)
    assert caught.value.argument == "max_amplitude"


@pytest.mark.parametrize("bound", [0.0, -1.0, np.nan, np.inf])
def test_a_bound_is_positive_and_finite(bound):
    with pytest.raises(OptionError, match="positive and finite") as caught:
        multi_mode(undamped(1.0, 2.0), max_amplitude=bound)
    assert caught.value.argument == "max_amplitude"


@pytest.mark.parametrize(
    ("derivatives", "reason"),
    [
        ([1], "one number per mode: 1 for 2"),
        ([1, 1, 1], "one number per mode: 3 for 2"),
        ([0, -1], "not -1"),
        ([0, 0.5], "not 0.5"),
        ([0, True], "not True"),
        ([0, np.nan], "not nan"),
        ([4, 4], "10 conditions"),
    ],
)
def test_derivatives_are_whole_numbers_one_per_mode(derivatives, reason):
    with pytest.raises(OptionError, match=reason) as caught:
        multi_mode(undamped(1.0, 2.0), derivatives=derivatives)
    assert caught.value.argument == "derivatives"


def test_no_mode():
    with pytest.raises(OptionError, match="a mode at least"):
        multi_mode([])


def test_a_mode_given_twice():
    with pytest.raises(OptionError, match=r"30 Hz, damping ratio 0\.1, is given twice") as caught:
        multi_mode([Mode(30.0, 0.1), Mode(50.0, 0.1), Mode(30.0, 0.1)])
    assert "derivatives = 1" in str(caught.value.hint)


def test_too_many_modes():
    with pytest.raises(OptionError, match="9 modes") as caught:
        multi_mode(undamped(*range(1, 10)))
    assert "cascade" in str(caught.value.hint)
