"""Disturbances: profiles over time, as shares of their peak."""

import naive
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from cnc_shape.disturbances import ProfileTable, Pulses, SineBurst, Steps, burst_peak, value

F2 = Pulses(2.0, 0.459, 1.0, 1.5, (1.0, 0.958, 0.958))  # spec: inertia compensation, section 2
F3 = SineBurst(0.514, 6.91, 9.4)
LAP = np.arange(0.0, 19.0, 2.5e-4)


def test_the_burst_of_the_spec():
    late = LAP - 9.4
    g = np.where(
        np.abs(late) < 3.455, np.sin(2 * np.pi * 0.514 * late) * np.cos(np.pi * late / 6.91) ** 2, 0.0
    )
    assert_allclose(value(F3, LAP), g / np.abs(g).max(), atol=2e-6)  # the peak lies between two ticks
    assert value(F3, np.array([9.4 - 3.455, 9.4, 9.4 + 3.455])).tolist() == [0.0, 0.0, 0.0]


@given(st.floats(0.05, 50.0), st.floats(0.02, 20.0))
def test_a_burst_peaks_at_one(frequency, length):
    t = np.linspace(-length / 2, length / 2, 4_001)
    assert np.abs(value(SineBurst(frequency, length, 0.0), t)).max() <= 1.0 + 1e-12


@pytest.mark.parametrize(
    ("frequency", "length"), [(0.514, 6.91), (0.1, 1.0), (3.0, 4.0), (0.25, 2.0), (20.0, 1.0)]
)
def test_the_peak_is_that_of_brute_force(frequency, length):
    low, high = 0.0, length / 2
    for _ in range(2):  # a fine grid over the whole window, and a finer one around its best
        t, step = np.linspace(low, high, 500_001, retstep=True)
        burst = np.abs(np.sin(2 * np.pi * frequency * t) * np.cos(np.pi * t / length) ** 2)
        low, high = t[burst.argmax()] - step, t[burst.argmax()] + step
    assert_allclose(burst_peak(frequency, length), burst.max(), rtol=1e-14)
    late = np.linspace(-1.1, 1.1, 501) * length / 2
    burst = SineBurst(frequency, length, 3.0)
    assert_allclose(value(burst, 3.0 + late), naive.burst(late, frequency, length, 0.0), atol=1e-11)


def test_the_peak_of_a_burst_of_one_frequency_with_its_window():
    # sin(w t) cos(w t / 2)^2 with w = 2 pi f, length = 1 / f: (sin x + sin(2x) / 2) / 2 peaks at 60 degrees
    assert_allclose(burst_peak(2.0, 0.5), 3.0 * np.sqrt(3.0) / 8.0, rtol=1e-15)


def test_the_pulses_of_the_spec():
    at = {
        1.9: 0.0,
        2.0: 0.0,
        2.2295: 0.5,
        2.459: 1.0,
        3.0: 1.0,
        3.459: 1.0,
        3.6885: 0.5,
        3.918: 0.0,
        5.0: 0.0,
    }
    second = {t + 0.459 * 2 + 1.0 + 1.5: 0.958 * share for t, share in at.items() if t >= 2.0}
    third = {t + 2 * (0.459 * 2 + 1.0 + 1.5): 0.958 * share for t, share in at.items() if t >= 2.0}
    for times in (at, second, third):
        assert_allclose(value(F2, np.array(list(times))), list(times.values()), atol=1e-12)
    assert_allclose(value(F2, LAP), naive.pulse_train(LAP, 2.0, 0.459, 1.0, 1.5, F2.peaks), atol=1e-12)
    assert value(F2, np.array([13.0, 1e6])).tolist() == [0.0, 0.0]


def test_pulses_without_edges_or_gaps():
    assert value(Pulses(1.0, 0.0, 0.5, 0.5, (2.0,)), np.array([0.9, 1.0, 1.4, 1.5])).tolist() == [0, 2, 2, 0]
    touching = Pulses(0.0, 0.0, 1.0, 0.0, (1.0, -1.0))
    assert value(touching, np.array([-0.5, 0.5, 1.5, 2.5])).tolist() == [0, 1, -1, 0]


def test_steps_hold_from_their_time_on():
    steps = Steps((1.0, 2.0, 4.0), (0.5, -1.0, 0.0))
    assert value(steps, np.array([0.0, 0.999, 1.0, 1.5, 2.0, 3.9, 4.0, 9.0])).tolist() == [
        0.0, 0.0, 0.5, 0.5, -1.0, -1.0, 0.0, 0.0,
    ]  # fmt: skip


def test_a_table_is_linear_between_its_rows_and_zero_beyond():
    table = ProfileTable((1.0, 2.0, 4.0), (1.0, 3.0, -1.0))
    assert_allclose(
        value(table, np.array([0.99, 1.0, 1.25, 2.0, 3.0, 4.0, 4.01])), [0, 1, 1.5, 3, 1, -1, 0], atol=1e-15
    )


@pytest.mark.parametrize(
    "profile", [F2, F3, Steps((1.0, 2.0), (1.0, 2.0)), ProfileTable((0.0, 9.0), (1.0, 2.0))]
)
def test_a_value_depends_on_its_own_time_alone(profile):
    whole = value(profile, LAP)
    np.testing.assert_array_equal(value(profile, LAP.reshape(-1, 4)).ravel(), whole)
    single = [float(value(profile, LAP[k : k + 1])[0]) for k in range(0, len(LAP), 97)]
    np.testing.assert_array_equal(single, whole[::97])
