"""Insensitivity: ends at the tolerance, humps that only just touch it, many shapers at once."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy.optimize import minimize_scalar

from cnc_shape.modes import Mode
from cnc_shape.shapers import PLAIN, cascade, make_shaper, zv, zvd
from cnc_shape.shapers.analysis import residual_vibration
from cnc_shape.shapers.insensitivity import bands, insensitivity

modes = st.builds(Mode, st.floats(0.5, 200.0), st.floats(0.0, 0.3))


@settings(max_examples=40)
@given(modes, st.sampled_from(["zv", "zvd", "zvddd", "mzv", "2hump_ei"]), st.floats(0.01, 0.4))
def test_ends_sit_at_the_tolerance_and_nothing_between_exceeds_it(mode, name, tolerance):
    shaper = PLAIN[name](mode)
    band = insensitivity(shaper, [mode], tolerance)
    ends = [band.low] + ([] if band.high is None else [band.high])
    if len(ends) == 2 and band.high - band.low == 0.0:
        return
    assert_allclose([residual_vibration(shaper, mode, end) for end in ends], tolerance, atol=1e-8)
    inside = np.linspace(band.low, band.high or 6.0, 4001)
    assert (residual_vibration(shaper, mode, inside) <= tolerance * (1.0 + 2e-8)).all()


def test_a_hump_between_two_points_of_the_scan_is_found():
    """ZVD's hump at twice its frequency, and a tolerance that it exceeds by a billionth of itself."""
    mode = Mode(1.0, 0.0)
    shaper = make_shaper([0.0, 0.4, 0.8], [0.276393202250021, 0.447213595499958, 0.276393202250021])
    top = -minimize_scalar(
        lambda r: -float(residual_vibration(shaper, mode, r)), bounds=(1.05, 1.4), method="bounded",
        options={"xatol": 1e-12},
    ).fun  # fmt: skip
    above, below = (insensitivity(shaper, [mode], top * (1.0 + d)) for d in (1e-6, -1e-6))
    assert below.high < 1.26 < above.high


def test_designed_humps_that_touch_the_tolerance_do_not_end_the_band():
    for name in ("ei", "2hump_ei", "3hump_ei"):
        mode = Mode(42.0, 0.06)
        assert insensitivity(PLAIN[name](mode), [mode]).width > 0.4


def test_a_design_point_above_the_tolerance_has_no_band():
    band = insensitivity(zv(Mode(1.3, 0.0)), [Mode(1.0, 0.0)])
    assert (band.low, band.high, band.width, band.margin) == (1.0, 1.0, 0.0, 0.0)


def test_much_damping_leaves_the_band_open():
    mode = Mode(1.0, 0.3)
    band = insensitivity(PLAIN["zvddd"](mode), [mode])
    assert band.high is None
    assert band.width is None
    assert_allclose(band.margin, 1.0 - band.low)


@pytest.mark.parametrize(("damping", "opens"), [(0.3, False), (0.7, True), (0.99, True)])
def test_the_scan_ends_early_only_where_nothing_can_follow(monkeypatch, damping, opens):
    mode = Mode(1.0, damping)
    shapers = [make_shaper([0.0, 0.4 * t, t], [0.3, 0.4, 0.3]) for t in np.linspace(0.3, 1.5, 25)]
    times, amplitudes = np.array([s.times for s in shapers]), np.array([s.amplitudes for s in shapers])
    early = bands(times, amplitudes, [mode], 0.32)
    with monkeypatch.context() as patch:
        patch.setattr("cnc_shape.shapers.insensitivity._Curve._calm", lambda _, rows, __: rows < 0)
        whole = bands(times, amplitudes, [mode], 0.32)
    assert (early[0] == whole[0]).all()
    assert (early[1] == whole[1]).all()
    assert np.isinf(early[1]).any() == opens


def test_several_modes_move_together():
    pair = [Mode(30.0, 0.02), Mode(100.0, 0.01)]
    shaper = cascade(pair, of=zvd)
    both, single = insensitivity(shaper, pair), [insensitivity(shaper, [mode]) for mode in pair]
    assert_allclose(both.low, max(one.low for one in single), atol=1e-12)
    assert_allclose(both.high, min(one.high for one in single), atol=1e-12)


@pytest.mark.parametrize("tolerance", [0.02, 0.05])
def test_many_at_once_are_as_one_by_one(tolerance):
    mode = Mode(1.0, 0.04)
    shapers = [make_shaper([0.0, t, 2.0 * t], [0.25, 0.5, 0.25]) for t in np.linspace(0.45, 0.55, 41)]
    low, high = bands(
        np.array([s.times for s in shapers]), np.array([s.amplitudes for s in shapers]), [mode], tolerance
    )
    singles = [insensitivity(shaper, [mode], tolerance) for shaper in shapers]
    assert_allclose(low, [one.low for one in singles], atol=1e-12)
    assert_allclose(high, [one.high for one in singles], atol=1e-12)


@pytest.mark.parametrize("damping", [0.999999, 1.0 - 1e-10, 1.0 - 1e-14])
def test_a_mode_that_hardly_swings_is_scanned_where_there_is_something(damping):
    """Its shapers last very many time constants; V is large only where the frequency is nearly 0."""
    mode = Mode(40.0, damping)
    for shaper in (zv(mode), zvd(mode)):
        found = insensitivity(shaper, [mode])
        assert found.high is None
        edge = residual_vibration(shaper, mode, np.array([found.low * (1 - 1e-6), found.low * (1 + 1e-6)]))
        assert edge[0] > 0.05 > edge[1]
