"""Simulation: exact against closed forms, scipy and python-control; nothing depends on chunks."""

from __future__ import annotations

import control
import naive
import numpy as np
import pytest
from commands import circling, part, point_to_point, straight
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from paths import arc, line, toolpath
from scipy import signal

from cnc_shape.contour import contour_error
from cnc_shape.controllers import Control, CrossCoupling, Feedforward
from cnc_shape.errors import InfeasibleError
from cnc_shape.limits import Limits
from cnc_shape.machine import Axis, FirstOrderLag, IdealDrive, Machine
from cnc_shape.modes import Mode
from cnc_shape.plant import continuous, discretise
from cnc_shape.shapers import make_shaper, zv, zvd
from cnc_shape.shapers.analysis import phasor
from cnc_shape.shapers.shaping import shape
from cnc_shape.simulation import simulate, simulating
from cnc_shape.windows import foot_windows

LIMITS = Limits(1000.0, 10_000.0)
T = 1e-3
ONE_MODE = Mode(33.7, 0.02)


def machine(tau=0.0148, gain=0.992, modes=(), axes="xyz") -> Machine:
    return Machine("test", tuple(Axis(a, LIMITS, FirstOrderLag(tau, gain), modes) for a in axes))


def circle_law(radius, feed, tau, kv, kp, kc, sample_time):
    """Steady radial error of matched axes with tangent cross-coupling, inward positive, mm.

    ``z = H (Kp (rho - z) + Kc (rho - Re z))`` in the frame that turns with the command.
    """
    al, lam = np.exp(-sample_time / tau), np.exp(1j * feed * sample_time / radius)
    be = tau * (1 - al)
    ga = kv * (sample_time - be)
    h = (be * (1 - al) * kv / (lam - al) + ga) / (lam - 1)
    matrix = [[1 + (h * (kp + kc)).real, -(h * kp).imag], [(h * (kp + kc)).imag, 1 + (h * kp).real]]
    right = h * (kp + kc) * radius
    return radius - np.hypot(*np.linalg.solve(matrix, [right.real, right.imag]))


@pytest.mark.parametrize(
    ("kp", "kc", "expected"),  # um; contour control, closed-form laws
    [(20, 0, 25.5021), (20, 8, -0.2007), (20, 40, -34.8871), (35, 0, -1.2787), (35, 40, -11.9795)],
)
def test_circle_closed_form_tabulated(kp, kc, expected):
    assert_allclose(1e3 * circle_law(5, 16, 0.0148, 0.992, kp, kc, T), expected, atol=5e-5)
    coupling = CrossCoupling(kc) if kc else None
    response = simulate(circling(T, 5.0, 16.0, 4), machine(), Control(T, kp, 0, None, coupling))
    assert_allclose(1e3 * (5.0 - np.hypot(*response.position[-1, :2])), expected, atol=1e-3)


@given(
    st.floats(2, 50), st.floats(1, 50), st.floats(0.005, 0.03), st.floats(0.9, 1.1), st.floats(5, 40),
    st.floats(0, 100), st.sampled_from([0.5e-3, 1e-3, 2e-3]),
)  # fmt: skip
@settings(max_examples=40)
def test_circle_closed_form_on_trajectory_and_toolpath(radius, feed, tau, kv, kp, kc, sample_time):
    turns = max(2.0, 3.0 * feed / (2 * np.pi * radius))  # three seconds: settled
    command = circling(sample_time, radius, feed, turns)
    response = simulate(command, machine(tau, kv), Control(sample_time, kp, 0, None, CrossCoupling(kc)))
    sweep = 2 * np.pi * np.ceil(turns)
    path = toolpath(arc((radius, 0, 0), (0, 0, 0), sweep), start=(radius, 0, 0))
    lag = int(np.ceil(4 / kp / sample_time))
    error = contour_error(response.position, path, *foot_windows(command.arc_length, lag, lag, 0.5))
    law = circle_law(radius, feed, tau, kv, kp, kc, sample_time)
    assert_allclose(error.distance[-1], abs(law), atol=1e-6)  # 1e-3 um


@pytest.mark.parametrize(("kc", "expected"), [(0, 11.2028), (20, 5.6014), (60, 2.8007)])
def test_line_with_mismatched_axes(
    kc, expected
):  # plants 3 and 4 of paper 004 at 45 degrees: eps0 / (1 + Kc/Kp)
    axes = (
        Axis("x", LIMITS, FirstOrderLag(0.0160, 0.9755)),
        Axis("y", LIMITS, FirstOrderLag(0.0126, 1.0029)),
    )
    command = straight(T, (1, 1, 0), 16.0, 4.0)
    response = simulate(
        command, Machine("test", axes), Control(T, 20, 0, None, CrossCoupling(kc) if kc else None)
    )
    end = 16.0 * 4.0 / np.sqrt(2)
    path = toolpath(line(end, end, 0.0))
    error = contour_error(response.position, path, *foot_windows(command.arc_length, 200, 75, 0.5))
    assert_allclose(1e3 * error.distance[-1], expected, atol=1e-3)


@pytest.mark.parametrize("modes", [(), (ONE_MODE,), (Mode(30.0, 0.02, 0.8), Mode(100.0, 0.01, 0.2))], ids=len)
@pytest.mark.parametrize("drive", [FirstOrderLag(0.0153, 0.993), IdealDrive()], ids=["lag", "ideal"])
def test_discretisation_equals_scipy_and_python_control(modes, drive):
    axis = Axis("x", LIMITS, drive, modes)
    plant = discretise([axis], T)
    A, B = continuous(axis)
    C, D = np.eye(B.size), np.zeros((B.size, 1))
    ad, bd, *_ = signal.cont2discrete((A, B[:, None], C, D), T, "zoh")
    assert_allclose(plant.transition[0], ad, atol=1e-11)
    assert_allclose(plant.held[0], bd[:, 0], atol=1e-11)
    other = control.c2d(control.ss(A, B[:, None], C, D), T, "zoh")
    assert_allclose(plant.transition[0], other.A, atol=1e-11)
    # an input that rises over the sample is held plus rising: first-order hold
    t = np.linspace(0, T, 3)
    _, y, _ = signal.lsim((A, B[:, None], C, D), 1.0 + t / T, t)
    assert_allclose(y[-1], plant.held[0] + plant.rising[0], atol=1e-11)


def test_closed_loop_equals_lfilter():
    """Independent control is ``20 N / (D + 20 N)`` in z, with the plant's own N and D."""
    tau, kv, kp = 0.0153, 0.993, 20.0
    al = np.exp(-T / tau)
    be = tau * (1 - al)
    ga = kv * (T - be)
    numerator = kp * np.array([0.0, ga, be * (1 - al) * kv - ga * al])
    denominator = np.convolve([1, -1], [1, -al]) + numerator
    command = point_to_point(T)
    response = simulate(command, machine(tau, kv), Control(T, kp))
    assert_allclose(
        response.position[:, 0], signal.lfilter(numerator, denominator, command.position[:, 0]), atol=1e-11
    )


def test_loop_with_modes_equals_python_control():
    """The loop written as one state space, run by python-control, drive and tool, to 1e-8 mm."""
    axis = Axis("x", LIMITS, FirstOrderLag(0.0153, 0.993), (Mode(30.0, 0.02, 0.8), Mode(100.0, 0.01, 0.2)))
    command = point_to_point(T)
    response = simulate(command, Machine("m", (axis,)), Control(T, 25.0))
    A, B = continuous(axis)
    plant = control.c2d(control.ss(A, B[:, None], np.eye(B.size), np.zeros((B.size, 1))), T, "zoh")
    closed = control.ss(
        plant.A - 25.0 * plant.B @ np.eye(B.size)[:1], 25.0 * plant.B, np.eye(B.size), 0 * plant.B, T
    )
    time = np.arange(len(command)) * T
    states = control.forced_response(closed, time, command.position[:, 0]).states
    assert_allclose(response.position[:, 0], states[0], atol=1e-8)
    assert_allclose(response.tool[:, 0], states[0] + states[2] + states[4], atol=1e-8)


def test_loop_equals_its_slow_twin():
    command = shape(point_to_point(T, axes=("x", "y", "z")), {"x": zv(ONE_MODE)})
    loop = Control(T, 20.0, 2, Feedforward(0.9, 0.8), CrossCoupling(30.0))
    stage = machine(0.0153, 0.993, (Mode(30.0, 0.02, 0.8), Mode(100.0, 0.01, 0.2)))
    response = simulate(command, stage, loop)
    position, tool = naive.servo_loop(command, stage.axes, loop)
    assert_allclose(response.position, position, atol=1e-11)
    assert_allclose(response.tool, tool, atol=1e-11)


def test_ideal_drives_equal_their_slow_twin():
    axis = Axis("x", LIMITS, IdealDrive(), (Mode(30.0, 0.02, 0.8), Mode(100.0, 0.01, 0.2)))
    command = point_to_point(T)
    response = simulate(command, Machine("m", (axis,)), Control(T))
    assert_array_equal(response.position, command.position)
    assert_allclose(response.tool[:, 0], naive.ideal_tool(command, axis), atol=1e-10)
    assert np.abs(response.tool - response.position).max() > 1e-3


def test_feedforward_with_its_own_model_follows_without_error():
    command = point_to_point(T)
    loop = Control(T, 20.0, 0, Feedforward(1.0, 1.0))
    response = simulate(command, machine(0.0153, 0.993), loop)
    alone = simulate(command, machine(0.0153, 0.993), Control(T, 20.0))
    assert np.abs(response.following_error).max() < 0.005 * np.abs(alone.following_error).max()


@pytest.mark.parametrize("kp", [5.0, 20.0, 60.0])
def test_following_error_of_a_ramp_is_feed_over_gain(kp):
    response = simulate(straight(T, (1, 0, 0), 16.0, 4.0), machine(0.0148, 1.0), Control(T, kp))
    assert_allclose(response.following_error[-1, 0], 16.0 / kp, rtol=1e-9)


# --- vibration ------------------------------------------------------------------------------------


def residual(command, mode, sample_time, shaper=None):
    ideal = Machine("m", tuple(Axis(a, LIMITS, modes=(mode,) if a == "x" else ()) for a in "xyz"))
    shaped = command if shaper is None else shape(command, {"x": shaper})
    state, _ = simulating(ideal, Control(sample_time))(None, None, shaped, True)
    return state.residual[0]


@pytest.mark.parametrize("make", [zv, zvd])
@pytest.mark.parametrize("distance", [10.0, 10.37])
def test_fractional_delays_leave_less_than_1e_4_of_the_vibration_at_1_khz(make, distance):
    command = point_to_point(T, distance)
    left = residual(command, ONE_MODE, T, make(ONE_MODE)) / residual(command, ONE_MODE, T)
    assert left <= 1e-4


def test_impulses_on_the_grid_leave_nothing():
    period = 30 * T
    mode = Mode(1 / period, 0.0)
    command = point_to_point(T)
    assert_allclose(zv(mode).times, [0.0, 15 * T])
    assert residual(command, mode, T, zv(mode)) <= 1e-9 * residual(command, mode, T)


@pytest.mark.parametrize("ratio", [0.85, 0.95, 1.1, 1.25])
def test_off_the_design_frequency_the_phasor_is_left(ratio):
    actual = Mode(ONE_MODE.natural_frequency * ratio, 0.0)
    command = point_to_point(0.25e-3, 10.21)
    left = residual(command, actual, 0.25e-3, zv(ONE_MODE)) / residual(command, actual, 0.25e-3)
    assert_allclose(left, phasor(zv(ONE_MODE), actual.omega, 0.0), rtol=5e-3)


def test_the_structure_answers_a_steady_acceleration_with_its_compliance():
    mode = Mode(40.0, 0.3)
    command = point_to_point(T, 2000.0, 1000.0, 1000.0)
    ideal = Machine("m", (Axis("x", Limits(2e3, 1e4), modes=(mode,)),))
    response = simulate(command, ideal, Control(T))
    assert_allclose((response.tool - response.position)[500, 0], -1000.0 / mode.omega**2, rtol=1e-6)
    assert_array_equal(response.position, command.position)


# --- chunks, stability, refusals ------------------------------------------------------------------


@pytest.mark.parametrize("chunk", [1, 2, 7, 64])
def test_streamed_equals_whole_bit_for_bit(chunk):
    command = circling(T, 5.0, 50.0, 0.8)
    stage = machine(0.0153, 0.993, (ONE_MODE,))
    loop = Control(T, 20.0, 1, Feedforward(1.0, 1.0), CrossCoupling(20.0))
    step, state, parts = simulating(stage, loop), None, []
    for low in range(0, len(command), chunk):
        high = min(low + chunk, len(command))
        state, out = step(state, None, part(command, low, high), high == len(command))
        parts.append(out)
    assert step(None, None, part(command, 0, 5), False)[0].settling.shape == (0, 3)
    state_whole, whole = step(None, None, command, True)
    for name in ("joint", "tool", "drive"):
        assert_array_equal(np.concatenate([getattr(p, name) for p in parts]), getattr(whole, name))
    assert_array_equal(state.settling, state_whole.settling)


def test_an_empty_last_chunk_changes_nothing():
    command = circling(T, 5.0, 50.0, 0.3)
    step = simulating(machine(), Control(T))
    state, first = step(None, None, command, False)
    state, rest = step(state, None, part(command, len(command), len(command)), True)
    _, whole = step(None, None, command, True)
    assert_array_equal(np.concatenate([first.tool, rest.tool]), whole.tool)


def test_a_command_of_another_period_is_a_wrong_call():
    with pytest.raises(ValueError, match="sample_time"):
        simulate(point_to_point(2e-3), machine(), Control(T))


def test_a_signal_that_is_no_number_stops_the_run():
    command = point_to_point(T)
    broken = make_shaper([0.0], [1.0])
    bad = shape(command, {"x": broken})
    position = bad.position.copy()
    position[50, 0] = np.nan
    with pytest.raises(InfeasibleError, match=r"axis x .* t = 0\.05"):
        simulate(
            type(bad)(bad.axes, T, bad.arc_length, position, bad.velocity, bad.acceleration),
            machine(),
            Control(T),
        )
