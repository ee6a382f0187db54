"""Live shaping: one sample in, one sample out, and the same as if all had been known from the start."""

from __future__ import annotations

import naive
import numpy as np
import pytest
from commands import point_to_point, straight, trapezoid
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.testing import assert_allclose, assert_array_equal
from scipy.integrate import solve_ivp

from cnc_shape.modes import Mode
from cnc_shape.shapers import cascade, make_shaper, umzv, zv, zvd
from cnc_shape.shapers.discretisation import Interpolation
from cnc_shape.shapers.live import LiveShaper, filters, shape_samples
from cnc_shape.shapers.shaping import common_delay, shape

T = 1e-3
MODE, SLOW = Mode(33.7, 0.02), Mode(20.0, 0.1)
SHAPERS = {"x": zv(MODE), "y": zvd(SLOW)}
MODES = {"x": (MODE,), "y": (SLOW,)}
AXES = ("x", "y", "z")
EACH = pytest.mark.parametrize("way", Interpolation)


def chosen(way, *, sample_time=T, aligned=True):
    return filters(SHAPERS, AXES, sample_time, way, MODES, aligned=aligned)


@EACH
def test_one_by_one_in_blocks_and_as_a_whole_are_the_same_bits(way):
    wanted = chosen(way)
    samples = np.random.default_rng(5).normal(size=(300, 3))
    whole = shape_samples(samples, wanted)
    live = LiveShaper(wanted)
    one_by_one = np.array([live.push(sample) for sample in samples])
    assert_array_equal(np.concatenate([one_by_one, live.flush()]), whole)
    assert len(whole) == len(samples) + wanted.tail


@settings(max_examples=40)
@given(
    arrays(np.float64, st.tuples(st.integers(1, 60), st.just(3)), elements=st.floats(-1e4, 1e4)),
    st.lists(st.integers(0, 20), max_size=8),
    st.sampled_from(list(Interpolation)),
)
def test_any_cut_gives_the_same_bits_as_the_slow_twin(samples, cuts, way):
    wanted = chosen(way)
    live, parts, low = LiveShaper(wanted), [], 0
    for cut in [*cuts, len(samples)]:
        parts.append(live.push_many(samples[low : low + cut]))
        low = min(low + cut, len(samples))
        live = LiveShaper(wanted, live.ring)  # as if another process went on
    streamed = np.concatenate([*parts, live.flush()])
    assert_array_equal(streamed, shape_samples(samples, wanted))
    for axis, taps in enumerate(wanted.taps):
        expected = naive.filtered(samples[:, axis].tolist(), taps.weights.tolist())
        assert_array_equal(streamed[: len(expected), axis], expected)


def test_impulses_on_the_grid_are_the_planned_command_bit_for_bit():
    shaper = make_shaper([0.0, 4 * T, 9 * T], [0.2, 0.5, 0.3])
    command = point_to_point(T)
    shapers = dict.fromkeys(AXES, shaper)
    whole = shape(command, shapers)
    for way in Interpolation:
        streamed = shape_samples(command.position, filters(shapers, AXES, T, way, {}))
        assert_array_equal(streamed, whole.position)


@pytest.mark.parametrize(("way", "tolerance"), [(Interpolation.LINEAR, 2.5e-4), (Interpolation.CUBIC, 5e-5)])
def test_between_samples_it_is_near_the_command_that_knows_its_velocity(way, tolerance):
    command = point_to_point(T)
    whole, wanted = shape(command, SHAPERS), chosen(way)
    streamed = shape_samples(command.position, wanted)
    late = wanted.taps[0].latency
    assert_allclose(
        streamed[late : late + len(whole)], whole.position[: len(streamed) - late], atol=tolerance
    )


@EACH
def test_starts_and_ends_at_rest_where_the_command_does(way):
    samples = point_to_point(T).position + np.array([3.0, -7.0, 0.1])
    streamed = shape_samples(samples, chosen(way))
    assert_allclose(streamed[0], samples[0], rtol=1e-15)
    assert_allclose(streamed[-1], samples[-1], rtol=1e-14)


@pytest.mark.parametrize("way", [Interpolation.LINEAR, Interpolation.CUBIC, Interpolation.EXACT])
@pytest.mark.parametrize("sample_time", [T, 0.83e-3, 2.3e-3])
def test_axes_stay_in_step_on_steady_motion(way, sample_time):
    wanted = chosen(way, sample_time=sample_time)
    line = straight(sample_time, (1.0, 1.0, 1.0), 100.0, 0.4)
    streamed = shape_samples(line.position, wanted)[wanted.tail : len(line)]
    assert_allclose(streamed - streamed[:, :1], 0.0, atol=1e-11)
    expected = line.position[wanted.tail :, 0] - line.velocity[0, 0] * wanted.delay
    assert_allclose(streamed[:, 0], expected, atol=1e-11)
    assert_allclose(wanted.delay, common_delay(SHAPERS) + wanted.taps[0].latency * sample_time, rtol=1e-12)


def test_without_alignment_every_axis_is_as_early_as_its_shaper():
    wanted = chosen(Interpolation.LINEAR, aligned=False)
    assert_allclose(
        [taps.delay for taps in wanted.taps], [SHAPERS["x"].delay, SHAPERS["y"].delay, 0.0], rtol=1e-12
    )


def test_rounding_is_not_in_step():
    delays = [taps.delay for taps in chosen(Interpolation.ROUNDED).taps]
    assert np.ptp(delays) > 1e-5  # s: 1 um on a line at 100 mm/s


def test_a_ring_holds_what_the_last_tap_needs_and_no_more():
    wanted = chosen(Interpolation.LINEAR)
    live = LiveShaper(wanted)
    assert live.ring is None
    live.push(np.zeros(3))
    cells = live.ring.cells.shape[0]
    longest = max(t.times[-1] + common_delay(SHAPERS) - t.delay for t in SHAPERS.values())
    assert cells == np.ceil(longest / T) + 2


def test_flushed_it_is_as_new():
    wanted = chosen(Interpolation.LINEAR)
    live = LiveShaper(wanted)
    samples = np.full((5, 3), 4.0)
    first = np.concatenate([live.push_many(samples), live.flush()])
    assert live.flush().shape == (0, 3)
    assert_array_equal(
        np.concatenate([live.push_many(samples + 1.0), live.flush()]), shape_samples(samples + 1.0, wanted)
    )
    assert_allclose(first, 4.0, rtol=1e-14)
    assert shape_samples(np.empty((0, 3)), wanted).shape == (0, 3)


def test_wrong_shapes_are_bugs():
    live = LiveShaper(chosen(Interpolation.LINEAR))
    with pytest.raises(ValueError, match="axes"):
        live.push_many(np.zeros((4, 2)))
    with pytest.raises(ValueError, match="axes"):
        live.push_many(np.zeros(3))
    other = LiveShaper(filters({}, AXES, T, Interpolation.LINEAR, {}))
    other.push(np.zeros(3))
    with pytest.raises(ValueError, match="shape"):
        LiveShaper(live.filters, other.ring)
    with pytest.raises(ValueError, match="axes"):
        filters(SHAPERS, (), T, Interpolation.LINEAR, MODES)


def vibration_left(positions, sample_time, mode):
    """Amplitude of the oscillator at the end of the samples, by RK45, driven by their second differences."""
    acceleration = np.diff(positions, 2) / sample_time**2
    state = np.zeros(2)
    for value in acceleration:
        state = solve_ivp(
            lambda _, y, a=value: [y[1], -2 * mode.damping_ratio * mode.omega * y[1] - mode.omega**2 * y[0] - a],
            (0.0, sample_time), state, rtol=1e-10, atol=1e-16,
        ).y[:, -1]  # fmt: skip
    return np.hypot(state[0] * mode.omega_damped, state[1] + mode.damping_ratio * mode.omega * state[0])


@pytest.mark.parametrize(
    ("way", "left"),
    [(Interpolation.ROUNDED, 1.75e-2), (Interpolation.LINEAR, 1.55e-3), (Interpolation.CUBIC, 1.23e-5), (Interpolation.EXACT, 0.0)],
)  # fmt: skip
def test_residual_vibration_after_a_streamed_move(way, left):
    # ZV for 33.7 Hz and 2 per cent, every millisecond, relative to the unshaped move at the same instant
    time = np.arange(-2, 180) * T
    samples = trapezoid(time, 8.0, 100.0, 2000.0)[0]
    wanted = filters({"x": SHAPERS["x"]}, ("x",), T, way, {"x": (MODE,)}, aligned=False)
    shaped = shape_samples(samples[:, None], wanted)[: len(samples), 0]
    ratio = vibration_left(shaped, T, MODE) / vibration_left(samples, T, MODE)
    s = MODE.omega * complex(MODE.damping_ratio, np.sqrt(1 - MODE.damping_ratio**2))
    weights = wanted.taps[0].weights
    assert_allclose(ratio, abs(weights @ np.exp(s * T * np.arange(weights.size))), atol=1e-8)
    assert_allclose(ratio, left, rtol=5e-3, atol=1e-8)


@EACH
def test_negative_impulses_stream_as_well(way):
    shapers = {"x": umzv(MODE), "y": cascade([MODE, Mode(80.0, 0.05)])}
    modes = {"x": (MODE,), "y": (MODE, Mode(80.0, 0.05))}
    wanted = filters(shapers, ("x", "y"), T, way, modes)
    samples = np.random.default_rng(6).normal(size=(50, 2))
    live = LiveShaper(wanted)
    pushed = np.concatenate([[live.push(sample) for sample in samples], live.flush()])
    assert_array_equal(pushed, shape_samples(samples, wanted))
