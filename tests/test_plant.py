"""Plant: drives and structures against their matrix exponentials, and closed forms of a lag drive."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.linalg import expm

from cnc_shape.limits import Limits
from cnc_shape.machine import Axis, FirstOrderLag, IdealDrive
from cnc_shape.modes import Mode
from cnc_shape.plant import continuous, discretise

LIMITS = Limits(1000.0, 10_000.0)
T = 1e-3
DRIVES = (IdealDrive(), FirstOrderLag(0.0142, 0.9982), FirstOrderLag(T), FirstOrderLag(0.2 * T, 1.3))
MODES = ((), (Mode(30.0, 0.02, 0.8), Mode(100.0, 0.01, 0.2)))


def by_exponential(axis, sample_time):
    """Transition, and the answers to inputs 1 and t / sample_time: one exponential with both as states."""
    A, B = continuous(axis)
    s = B.size
    whole = np.zeros((s + 2, s + 2))
    whole[:s, :s], whole[:s, s], whole[s, s + 1] = A, B, 1.0 / sample_time
    found = expm(whole * sample_time)
    return found[:s, :s], found[:s, s], found[:s, s + 1]


@pytest.mark.parametrize("modes", MODES, ids=["drive alone", "two modes"])
@pytest.mark.parametrize("drive", DRIVES, ids=["ideal", "lag", "lag of a sample", "lag within a sample"])
@pytest.mark.parametrize("sample_time", [1e-4, T, 8e-3])
def test_every_axis_is_discretised_exactly(drive, modes, sample_time):
    axis = Axis("x", LIMITS, drive, modes)
    plant = discretise([axis], sample_time)
    transition, held, rising = by_exponential(axis, sample_time)
    assert_allclose(plant.transition[0], transition, rtol=1e-12, atol=1e-300)
    assert_allclose(plant.held[0], held, rtol=1e-12)
    assert_allclose(plant.rising[0], rising, rtol=1e-12)


def test_a_lag_drive_under_a_held_input():
    """q' = k u (1 - exp(-t/tau)) and q = k u (t - tau (1 - exp(-t/tau))) after one sample."""
    tau, gain = 0.0153, 0.9930
    plant = discretise([Axis("x", LIMITS, FirstOrderLag(tau, gain))], T)
    al = np.exp(-T / tau)
    assert_allclose(plant.transition[0], [[1.0, tau * (1.0 - al)], [0.0, al]], rtol=1e-13)
    assert_allclose(plant.held[0], [gain * (T - tau * (1.0 - al)), gain * (1.0 - al)], rtol=1e-13)


def test_a_drive_far_slower_than_its_sample_is_an_integrator():
    """Differences of exponentials would leave no digit of it."""
    tau = 1e6 * T
    plant = discretise([Axis("x", LIMITS, FirstOrderLag(tau))], T)
    assert_allclose(plant.held[0], [T**2 / (2.0 * tau), T / tau], rtol=1e-6)
    assert_allclose(plant.rising[0], [T**2 / (6.0 * tau), T / (2.0 * tau)], rtol=1e-6)


def test_axes_of_unlike_structure_share_arrays():
    bent = Axis("y", LIMITS, DRIVES[1], MODES[1])
    plant = discretise([Axis("x", LIMITS, DRIVES[1]), bent, Axis("z", LIMITS)], T)
    assert_array_equal(plant.states, [2, 6, 2])
    assert_array_equal(plant.ideal, [0, 0, 1])
    assert_array_equal(plant.transition[0, 2:], 0.0)
    assert_allclose(plant.transition[0, :2, :2], plant.transition[1, :2, :2], rtol=1e-13)
