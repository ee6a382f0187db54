"""Time-optimal shapers: closed forms, published durations, and what they promise on whole rectangles."""

from __future__ import annotations

from math import pi, sqrt

import numpy as np
import pytest
from numpy.testing import assert_allclose

from cnc_shape.modes import Mode
from cnc_shape.shapers.optimal import optimal

ONE = Mode(1.0, 0.0)
TWO = (ONE, Mode(10.0 / 3.0, 0.0))


def vibration(shaper, frequency, damping, order=0):
    """``e^{-zeta omega t_N} |sum A t^k e^{s t}|``, written out; frequency in Hz, scalars or arrays."""
    omega = 2.0 * pi * np.asarray(frequency)[..., None]
    damping = np.asarray(damping)[..., None]
    t, a = shaper.times, shaper.amplitudes
    terms = a * t**order * np.exp(-damping * omega * (t[-1] - t))
    phase = omega * np.sqrt(1.0 - damping**2) * t
    return np.hypot((terms * np.cos(phase)).sum(-1), (terms * np.sin(phase)).sum(-1))


def worst(shaper, mode, many=401):
    """Largest V on a dense grid of the rectangle of a mode."""
    u, w = mode.frequency_uncertainty, mode.damping_uncertainty
    frequencies = mode.natural_frequency * np.linspace(1.0 - u, 1.0 + u, 20 * many)
    dampings = mode.damping_ratio * np.linspace(1.0 - w, 1.0 + w, 21 if w else 1)
    return max(vibration(shaper, frequencies, damping).max() for damping in dampings)


def test_zv_is_the_shortest_without_negative_impulses():  # half a period
    shaper = optimal([ONE], positive=True)
    assert_allclose(shaper.times, [0.0, 0.5], atol=1e-12)
    assert_allclose(shaper.amplitudes, [0.5, 0.5], atol=1e-12)


@pytest.mark.parametrize("damping", [0.0, 0.1, 0.3])
def test_umzv_is_the_shortest_that_a_step_within_0_and_1_allows(damping):
    shaper = optimal([Mode(1.0, damping)])
    assert_allclose(shaper.amplitudes, [1.0, -1.0, 1.0], atol=1e-12)
    s = 2.0 * pi * complex(damping, sqrt(1.0 - damping**2))
    assert abs(1.0 - np.exp(s * shaper.times[1]) + np.exp(s * shaper.times[2])) < 1e-11
    if damping == 0.0:
        assert_allclose(shaper.times, [0.0, 1 / 6, 1 / 3], atol=1e-12)
    if damping == 0.1:  # spec of the shapers, section 2
        assert_allclose(shaper.times, [0.0, 0.196800, 0.335717], atol=1e-6)
