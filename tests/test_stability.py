"""Stability: the published limits, closed forms, python-control, the loop's own kernel and brute force."""

from __future__ import annotations

from dataclasses import replace

import control
import naive
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from cnc_shape.config import bundled, check_machine
from cnc_shape.config.loop_check import check_loop
from cnc_shape.config.setup import Setup
from cnc_shape.controllers import Control, CrossCoupling, Form, gain_limits
from cnc_shape.controllers.loop import Command
from cnc_shape.controllers.loop_model import (
    closed_loop,
    loop_matrix,
    loop_model,
    loop_transfer,
    open_loop,
    poles,
)
from cnc_shape.controllers.margins import Margins, _over_negative_axis, margins, worst_margins
from cnc_shape.controllers.stability import (
    DIRECTIONS,
    check_along,
    check_poses,
    check_stability,
    largest_stable_coupling,
    largest_stable_position_gain,
)
from cnc_shape.errors import InfeasibleError
from cnc_shape.experiments.contour_control import rigs
from cnc_shape.joints import joints_of
from cnc_shape.kinematics import linear_delta
from cnc_shape.limits import Limits
from cnc_shape.machine import Axis, FirstOrderLag, IdealDrive, Machine
from cnc_shape.servo import NO_POSES, PathWindows, make_loop

T = 1e-3
LIMITS = Limits(1000.0, 10_000.0)
DRIVES = rigs.PLANTS
CUBIC = rigs.CUBIC.kinematics
AT = CUBIC.inverse_jacobian(np.array([[20.0, 15.0, 0.0, 0.0, 0.0, 0.0]]))
CARTESIAN = np.eye(3)[None]
X, Y, Z = np.eye(3)
PLANE = np.array([X, Y, (X + Y) / np.sqrt(2), (X - Y) / np.sqrt(2)])
FORMS = {"P": (0.0, 0.0), "PD": (0.0, 0.0145), "PI": (10.0, 0.0), "PID": (10.0, 0.0145)}  # Ki / Kc, Kd / Kc


def axes(*drives):
    return [Axis(name, LIMITS, drive) for name, drive in zip("xyzac", drives, strict=False)]


def pid(kc, form, advance=0.0):
    integral, derivative = FORMS[form]
    return CrossCoupling(kc * (1.0 + advance * integral), integral=kc * integral, derivative=kc * derivative)


# --- published and closed forms -------------------------------------------------------------------

LIMIT_OF_COUPLING = [  # 1/s: sample time, delay, controller, Cartesian, cubic manipulator at (20, 15, 0)
    (1e-3, 0, "P", 2007.4, 2001.1), (1e-3, 0, "PD", 1922.4, 1708.3),
    (1e-3, 0, "PI", 1699.8, 1709.9), (1e-3, 0, "PID", 1921.8, 1707.7),
    (1e-3, 1, "P", 660.7, 659.1), (1e-3, 1, "PD", 789.6, 703.4),
    (1e-3, 1, "PI", 557.3, 560.7), (1e-3, 1, "PID", 789.7, 703.5),
    (2e-3, 0, "P", 1005.9, 1004.3), (2e-3, 0, "PD", 944.6, 844.7),
    (2e-3, 0, "PI", 846.9, 852.3), (2e-3, 0, "PID", 943.3, 843.6),
    (2e-3, 1, "P", 326.5, 326.4), (2e-3, 1, "PD", 384.2, 345.5),
    (2e-3, 1, "PI", 272.8, 274.6), (2e-3, 1, "PID", 384.2, 345.5),
]  # fmt: skip


@pytest.mark.parametrize(("sample_time", "delay", "form", "cartesian", "cubic"), LIMIT_OF_COUPLING)
def test_limit_of_cross_coupling_on_a_straight_line(sample_time, delay, form, cartesian, cubic):
    """Kp 20, worst of four directions in the plane, to the last digit of the table.

    The table's integral acts in the tick that advances it, `Kc eps + Ki (I + T eps)`, the loop's from the
    next one on: that is T Ki more of proportional gain.
    """
    loop = Control(sample_time, 20.0, delay, None, pid(100.0, form, sample_time))
    more = 1.0 + sample_time * FORMS[form][0]
    for drives, jacobian, limit in ((DRIVES[:3], CARTESIAN, cartesian), (DRIVES, AT, cubic)):
        largest = largest_stable_coupling(drives, loop, jacobian, PLANE) / more
        assert_allclose(largest, limit, atol=0.051)


@pytest.mark.parametrize("sample_time", [1e-3, 2e-3])
@pytest.mark.parametrize("drive", DRIVES[:2])
def test_largest_stable_position_gain_in_closed_form(sample_time, drive):
    """Without delay the poles leave as a pair, where their product is 1: 2027 and 1026 1/s for plant 2."""
    al, tau = np.exp(-sample_time / drive.time_constant), drive.time_constant
    law = (1 - al) / (drive.gain * (tau * (1 - al) - al * sample_time))
    assert_allclose(largest_stable_position_gain(drive, Control(sample_time)), law, rtol=2e-5)
    if drive is DRIVES[1]:
        assert_allclose(law, {1e-3: 2027.0, 2e-3: 1026.0}[sample_time], atol=0.5)


def test_the_cubic_manipulator_is_refused_where_it_diverges():
    """One sample of delay, 1 ms, Kp 20: Kc 640 runs, 960 diverges."""
    check_poses(DRIVES, Control(T, 20.0, 1, None, CrossCoupling(640.0)), AT)
    with pytest.raises(InfeasibleError, match="across the path") as refused:
        check_poses(DRIVES, Control(T, 20.0, 1, None, CrossCoupling(960.0)), AT, PLANE)
    assert "cross-coupling gain 960 1/s, stable below 659.1 1/s" in str(refused.value)


# --- the model is the loop ------------------------------------------------------------------------


@pytest.mark.parametrize("delay", [0, 1, 3])
def test_one_tick_of_the_model_is_one_tick_of_the_loop(delay):
    coupling = CrossCoupling(80.0, integral=800.0, derivative=1.16, orientation=30.0)
    loop = Control(T, 20.0, delay, None, coupling)
    tangent = np.array([0.6, 0.0, 0.8])
    across = np.eye(3) - np.outer(tangent, tangent)
    random = np.random.default_rng(4)
    q, v, late = random.normal(size=6), random.normal(size=6), random.normal(size=(delay, 6))
    integral, before = across @ random.normal(size=3), across @ random.normal(size=3)
    after = naive.coupled_tick(DRIVES, loop, AT[0], tangent, (q, v, integral, before, list(late)))
    found = loop_matrix(DRIVES, loop, AT[0], tangent) @ np.concatenate([q, v, integral, before, late.ravel()])
    assert_allclose(found, np.concatenate([*after[:4], *after[4]]), rtol=1e-12, atol=1e-11)


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("share", [0.99, 1.02])
def test_the_kernel_decays_and_grows_by_the_largest_pole(form, share):
    """The loop itself, let go beside its command, across a line on which it is close to its limit."""
    drives, tangent = DRIVES[:3], np.array([0.6, 0.8, 0.0])
    loop = Control(T, 20.0, 1, None, pid(100.0, form))
    largest = largest_stable_coupling(drives, loop, CARTESIAN, tangent[None])
    loop = Control(T, 20.0, 1, None, pid(share * largest, form))
    radius = np.abs(poles(drives, loop, np.eye(3), tangent)).max()
    ticks = 1200
    along = 16.0 * T * np.arange(ticks + 1)[:, None] * tangent
    speed = np.broadcast_to(16.0 * tangent, along.shape).copy()
    servo = make_loop(joints_of(Machine("m", tuple(axes(*drives)))), loop)
    joint = []
    for start in (0.0, 0.1):
        memory = servo.start(along[0] + start * np.array([-0.8, 0.6, 0.3]))
        command = Command(along, speed, np.zeros_like(along), along, speed)
        joint.append(servo.run(memory, command, NO_POSES, PathWindows()).joint)
    gap = np.linalg.norm(joint[1] - joint[0], axis=1)
    early, late = gap[400:600].max(), gap[1000:1200].max()
    assert (share < 1.0) == (radius < 1.0) == (late < early)
    assert_allclose(np.log(late / early) / 600, np.log(radius), atol=1e-4, rtol=0.02)


@pytest.mark.parametrize("delay", [0, 2])
def test_transfer_matrix_equals_the_state_space(delay):
    coupling = CrossCoupling(80.0, integral=800.0, derivative=1.16, orientation=30.0)
    model = loop_model(DRIVES, Control(T, 20.0, delay, None, coupling), AT, X[None])
    A, B, C = open_loop(model)
    z = np.exp(1j * np.array([0.01, 0.3, 3.0]))
    slow = [-C[0] @ np.linalg.solve(point * np.eye(len(A[0])) - A[0], B) for point in z]
    assert_allclose(loop_transfer(model, z)[0], slow, rtol=1e-9, atol=1e-12)
    assert_array_equal(closed_loop(model), A + B @ C)


def test_what_never_moves_is_no_pole():
    """Ideal drives, the integral along the path and across it where no drive reaches: none leaves |z| = 1."""
    loop = Control(T, 20.0, 1, None, pid(80.0, "PID"))
    drives = (DRIVES[0], DRIVES[1], IdealDrive())
    for tangent in DIRECTIONS:
        assert np.abs(poles(drives, loop, np.eye(3), tangent)).max() < 0.9999
    assert np.abs(poles((DRIVES[0], IdealDrive(), IdealDrive()), loop, np.eye(3), X)).max() < 0.99
    assert poles((IdealDrive(),) * 3, Control(T), np.eye(3), X).size == 0
    check_stability(axes(*(IdealDrive(),) * 3), loop)


def test_equal_drives_answer_alike_at_every_pose_in_every_direction():
    """The poles are those of a joint held by Kp (along the path) and by Kp + Kc (across it)."""
    loop = Control(T, 20.0, 1, None, CrossCoupling(80.0))
    joint = [
        poles(DRIVES[:1], Control(T, gain, 1), np.eye(1), np.zeros(3))
        for gain in (20.0, 20.0, 20.0, 20.0, 100.0, 100.0)
    ]
    expected = np.sort_complex(np.concatenate(joint))
    for tangent in DIRECTIONS:
        found = poles(DRIVES[:1] * 6, loop, AT[0], tangent)
        assert_allclose(np.sort_complex(np.round(found, 9)), np.round(expected, 9), atol=1e-5)


def test_a_joint_beside_the_kinematics_stands_for_itself():
    drives, loop = (*DRIVES[:3], DRIVES[5]), Control(T, 20.0, 0, None, CrossCoupling(80.0, orientation=50.0))
    together = poles(drives, loop, np.eye(3), Y)
    apart = [poles(DRIVES[:3], loop, np.eye(3), Y), poles(DRIVES[5:], Control(T), np.eye(1), Y)]
    assert_allclose(np.sort_complex(together), np.sort_complex(np.concatenate(apart)), atol=1e-9)


def test_the_scalar_form_is_looked_at_by_its_proportional_part():
    scalar = CrossCoupling(80.0, integral=2000.0, derivative=1.0, form=Form.SCALAR)
    found = loop_matrix(DRIVES, Control(T, cross_coupling=scalar), AT[0], X)
    assert_array_equal(found, loop_matrix(DRIVES, Control(T, cross_coupling=CrossCoupling(80.0)), AT[0], X))


# --- margins --------------------------------------------------------------------------------------


@pytest.mark.parametrize(("gain", "delay"), [(20.0, 0), (200.0, 1), (30.0, 30)])
def test_margins_of_a_joint_equal_python_control(gain, delay):
    loop = Control(T, gain, delay)
    A, B, C = open_loop(loop_model(DRIVES[:1], loop, np.eye(1)[None], X[None]))
    system = control.ss(A[0], B, -C[0], np.zeros((1, 1)), T)
    found = margins(DRIVES[:1], loop, np.eye(1), X)
    gain_margin, phase_margin, _, _, crossing, _ = control.stability_margins(
        control.FRD(system, np.geomspace(1.0, np.pi / T * 0.9999, 400), smooth=True)
    )
    assert_allclose(found.gain, gain_margin, rtol=1e-4)
    assert_allclose(np.rad2deg(found.phase), phase_margin, rtol=1e-4)
    assert_allclose(found.delay, np.deg2rad(phase_margin) / crossing, rtol=1e-3)
    omega = np.geomspace(0.1, np.pi / T * 0.999999, 50_000)
    assert_allclose(found.sensitivity, np.abs(1.0 / (1.0 + system(np.exp(1j * omega * T)))).max(), rtol=1e-6)


@given(
    st.lists(st.floats(0.003, 0.04), min_size=6, max_size=6), st.lists(st.floats(0.5, 2.0), min_size=6, max_size=6),
    st.floats(5.0, 60.0), st.floats(0.0, 100.0), st.sampled_from(list(FORMS)), st.integers(0, 6),
    st.integers(0, 12), st.floats(0.0, 60.0),
)  # fmt: skip
@settings(max_examples=20)
def test_gain_margin_is_where_a_pole_leaves(taus, gains, kp, kc, form, delay, direction, orientation):
    """The common gain of all drives grows, by bisection, until a pole of the closed loop leaves."""
    drives = tuple(FirstOrderLag(tau, gain) for tau, gain in zip(taus, gains, strict=True))
    base = pid(kc, form)
    coupling = CrossCoupling(
        base.proportional, integral=base.integral, derivative=base.derivative, orientation=orientation
    )
    model = loop_model(drives, Control(T, kp, delay, None, coupling), AT, DIRECTIONS[direction][None])
    A, B, C = open_loop(model)

    def radius(k):
        return np.abs(np.linalg.eigvals(A[0] + k * B @ C[0])).max()

    if radius(1.0) >= 0.9999:
        return
    high = next(k for k in 1.05 ** np.arange(400) if radius(k) >= 1.0)
    low = high / 1.05
    while high - low > 1e-7 * high:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if radius(middle) < 1.0 else (low, middle)
    found = margins(drives, Control(T, kp, delay, None, coupling), AT[0], DIRECTIONS[direction])
    assert_allclose(found.gain, low, rtol=1e-4)


def test_margins_of_equal_drives_are_those_of_their_joints():
    loop = Control(T, 20.0, 1, None, CrossCoupling(80.0))
    found = margins(DRIVES[:1] * 6, loop, AT[0], X)
    joints = [margins(DRIVES[:1], Control(T, gain, 1), np.eye(1), X) for gain in (20.0, 100.0)]
    assert_allclose(found.gain, min(joint.gain for joint in joints), rtol=1e-5)
    assert_allclose(found.phase, min(joint.phase for joint in joints), rtol=1e-5)
    straight = margins(
        DRIVES[:1] * 3, loop, np.eye(3), X
    )  # across and along do not mix: nor do their sensitivities
    assert_allclose(straight.sensitivity, max(joint.sensitivity for joint in joints), rtol=1e-6)


def test_sensitivity_of_unlike_drives_is_the_largest_singular_value():
    loop = Control(T, 20.0, 1, None, pid(80.0, "PID"))
    model = loop_model(DRIVES, loop, AT, Z[None])
    transfer = loop_transfer(model, np.exp(1j * T * np.geomspace(0.1, np.pi / T, 20_000)))[0]
    lever = np.diag(np.linalg.norm(np.linalg.inv(AT[0])[:3], axis=0))  # mm at the tool per mm of a joint
    transfer = lever @ transfer @ np.linalg.inv(lever)
    brute = np.linalg.norm(np.linalg.inv(np.eye(6) + transfer), ord=2, axis=(1, 2)).max()
    assert_allclose(margins(DRIVES, loop, AT[0], Z).sensitivity, brute, rtol=1e-6)


def test_a_curve_over_the_positive_axis_is_not_taken_for_one_over_the_negative():
    """Angles from the negative axis: one passes half a turn, which shifts the sorted others by a place."""
    angles = np.array([[-1.0, 0.5, 3.1], [-1.0, 0.5, 3.2], [-0.1, 0.5, 3.2], [0.1, 0.5, 3.2]])
    assert_array_equal(_over_negative_axis(-np.exp(1j * angles)), [False, False, True])


def test_margins_do_not_depend_on_the_unit_of_a_joint():
    loop = Control(T, 20.0, 1, None, pid(80.0, "PID"))
    degrees = np.diag([1.0, 57.3, 1.0, 1.0, 1.0, 0.01]) @ AT[0]
    found, other = margins(DRIVES, loop, AT[0], Z), margins(DRIVES, loop, degrees, Z)
    for name in ("gain", "phase", "sensitivity", "delay"):
        assert_allclose(getattr(other, name), getattr(found, name), rtol=1e-5)


def test_worst_margins_are_those_of_the_worst_directions():
    loop = Control(T, 20.0, 1, None, CrossCoupling(80.0))
    each = [margins(DRIVES, loop, AT[0], tangent) for tangent in PLANE]
    worst = worst_margins(DRIVES, loop, AT[0], PLANE)
    assert worst.gain == min(one.gain for one in each)
    assert worst.phase == min(one.phase for one in each)
    assert worst.sensitivity == max(one.sensitivity for one in each)


def test_where_there_is_no_loop_there_is_no_end():
    ideal = (IdealDrive(),) * 3
    assert margins(ideal, Control(T), np.eye(3), X) == Margins(np.inf, np.inf, 1.0, np.inf)
    assert largest_stable_coupling(ideal, Control(T), CARTESIAN) == np.inf
    assert largest_stable_position_gain(IdealDrive(), Control(T)) == np.inf


@pytest.mark.parametrize("delay", [0, 3])
@pytest.mark.parametrize("form", FORMS)
def test_what_a_gain_may_grow_by_is_found_without_poles_too(form, delay, monkeypatch):
    """Poles and frequency response agree; the latter decides where delays are long."""
    loop = Control(T, 20.0, delay, None, pid(100.0, form))
    by_poles = largest_stable_coupling(DRIVES, loop, AT, PLANE)
    gain_by_poles = largest_stable_position_gain(DRIVES[0], loop)
    monkeypatch.setattr(gain_limits, "MOST_STATES", 0)
    assert_allclose(largest_stable_coupling(DRIVES, loop, AT, PLANE), by_poles, rtol=3e-5)
    assert_allclose(largest_stable_position_gain(DRIVES[0], loop), gain_by_poles, rtol=3e-5)
    for share, turn in ((0.999, 0.0), (1.001, 0.0), (0.1, 3000.0)):
        edge = replace(pid(share * by_poles, form), orientation=turn)
        edge = replace(loop, cross_coupling=edge)
        if share < 1.0 and not turn:
            check_poses(DRIVES, edge, AT, PLANE)
        else:
            with pytest.raises(InfeasibleError, match="orientation" if turn else "across"):
                check_poses(DRIVES, edge, AT, PLANE)


def test_a_very_long_delay_is_judged_in_the_time_of_a_short_one():
    """The drive is an integrator to it, and the delay d T leaves a gain of pi/2 / (d T + tau + T/2)."""
    loop = Control(T, 1.0, 500, None, CrossCoupling(0.1))
    check_stability(axes(*DRIVES[:3]), loop)
    law = 0.5 * np.pi / (500 * T + DRIVES[0].time_constant + 0.5 * T) / DRIVES[0].gain
    assert_allclose(largest_stable_position_gain(DRIVES[0], loop), law, rtol=2e-3)
    with pytest.raises(InfeasibleError, match="across the path"):
        check_stability(axes(*DRIVES[:3]), replace(loop, cross_coupling=CrossCoupling(2.1)))


# --- refusals -------------------------------------------------------------------------------------


@pytest.mark.parametrize(("sample_time", "limit"), [(1e-3, 2027.0), (2e-3, 1026.0)])  # plant 2 of paper 004
def test_an_unstable_position_loop_is_told_with_its_axis_and_largest_gain(sample_time, limit):
    machine = axes(FirstOrderLag(0.001), DRIVES[1], DRIVES[1])
    check_stability(machine, Control(sample_time, 0.999 * limit))
    with pytest.raises(InfeasibleError, match="the loop of axis y is unstable: position gain") as refused:
        check_stability(machine, Control(sample_time, 1.001 * limit))
    told = float(str(refused.value).split("stable below ")[1].split()[0])
    assert_allclose(told, limit, rtol=5e-4)


def test_delay_lowers_the_stable_gain():  # 660.7 1/s across at Kp 20 with one sample of delay, paper 004
    machine = axes(*DRIVES[:3])
    check_stability(machine, Control(T, 20.0, 1, None, CrossCoupling(660.0)))
    with pytest.raises(
        InfeasibleError, match=r"moving along .*: cross-coupling gain 662 1/s, stable below 660\.7"
    ):
        check_stability(machine, Control(T, 20.0, 1, None, CrossCoupling(662.0)))


def test_axes_may_stand_in_any_order_and_some_may_be_missing():
    loop = Control(T, 20.0, 1, None, CrossCoupling(690.0), joint_gains=(10.0, 20.0))
    named = {axis.name: axis for axis in axes(*DRIVES[:3])}
    with pytest.raises(InfeasibleError, match="along") as refused:
        check_stability([named["y"], named["x"]], loop)
    with pytest.raises(InfeasibleError) as again:
        check_stability(
            [named["x"], Axis("z", LIMITS), named["y"]],
            Control(T, 99.0, 1, None, CrossCoupling(690.0), joint_gains=(20.0, 5.0, 10.0)),
        )
    assert str(refused.value) == str(again.value)


def test_joints_that_are_no_axes_are_told_as_joints():
    with pytest.raises(InfeasibleError, match="the loop of joint q2 is unstable"):
        check_stability([Axis("q1", LIMITS), Axis("q2", LIMITS, DRIVES[0])], Control(T, 3000.0))


def test_every_joint_is_held_by_its_own_gain():
    gains = (20.0,) * 5 + (700.0,)
    with pytest.raises(InfeasibleError, match="joint q6 is unstable: position gain 700"):
        check_poses(DRIVES, Control(T, 20.0, 1, joint_gains=gains), AT)
    coupling = CrossCoupling(630.0)
    check_poses(DRIVES, Control(T, 20.0, 1, None, coupling), AT)
    with pytest.raises(InfeasibleError, match="across the path"):
        check_poses(DRIVES, Control(T, 20.0, 1, None, coupling, joint_gains=(100.0,) * 6), AT)


def test_pose_and_direction_are_told():
    poses = CUBIC.inverse_jacobian(np.array([[0.0] * 6, [50.0, -40.0, 30.0, 0.1, 0.2, 0.0]]))
    loop = Control(T, 20.0, 1, None, CrossCoupling(80.0))
    limits = [largest_stable_coupling(DRIVES, loop, pose[None], PLANE[2:3]) for pose in poses]
    worst = int(np.argmin(limits))
    between = Control(T, 20.0, 1, None, CrossCoupling(0.5 * sum(limits)))
    place = ("at home", "in the corner").__getitem__
    with pytest.raises(InfeasibleError) as refused:
        check_along(DRIVES, between, poses, PLANE[[2, 2]], place)
    assert f"{place(worst)}, moving along (0.71, 0.71, 0): " in str(refused.value)
    with pytest.raises(InfeasibleError, match=place(worst)):
        check_poses(DRIVES, between, poses, PLANE[2:3], place)
    check_along(DRIVES, between, poses[[1 - worst]], PLANE[2:3])
    check_along(DRIVES, between, poses[:0], PLANE[:0])


def test_the_direction_told_is_the_one_that_ends_the_gain(monkeypatch):
    unlike = tuple(FirstOrderLag(tau) for tau in (0.007, 0.021, 0.013))
    far = Control(T, 10.0, 2, None, CrossCoupling(20_000.0))
    inverse = linear_delta(150.0, 300.0).inverse_jacobian(np.zeros((1, 3)))
    everywhere = np.repeat(inverse, len(DIRECTIONS), axis=0)
    limits = [largest_stable_coupling(unlike, far, inverse, line[None]) for line in DIRECTIONS]
    for most in (gain_limits.MOST_STATES, 1):  # by poles, by frequency response
        monkeypatch.setattr(gain_limits, "MOST_STATES", most)
        with pytest.raises(InfeasibleError) as refused:
            check_along(unlike, far, everywhere, DIRECTIONS, "direction {}".format)
        assert f"direction {int(np.argmin(limits))}, moving" in str(refused.value)


def test_integral_and_derivative_are_told_to_share_the_limit():
    with pytest.raises(InfeasibleError, match="700 1/s with its integral and derivative, stable below 565"):
        check_poses(DRIVES, Control(T, 20.0, 1, None, pid(700.0, "PI")), AT, PLANE)


def test_an_unstable_orientation_is_told():
    coupling = CrossCoupling(10.0, orientation=900.0)
    with pytest.raises(InfeasibleError, match="loop of the orientation is unstable: gain 900 1/s") as refused:
        check_poses(DRIVES, Control(T, 20.0, 1, None, coupling), AT)
    assert "orientation" in refused.value.hint


# --- check ----------------------------------------------------------------------------------------


def test_check_tells_the_margins_at_home():
    loop = check_machine(bundled("mill_three_axis.yaml"))["loop"]
    assert set(loop) == {
        "gain_margin", "phase_margin_deg", "max_sensitivity", "largest_stable_cross_coupling_per_s",
        "velocity_loop_gain_margin_db", "velocity_loop_phase_margin_deg", "velocity_loop_max_sensitivity",
    }  # fmt: skip
    assert 5.0 < loop["gain_margin"] < 30.0
    assert 40.0 < loop["phase_margin_deg"] < 70.0
    assert 1.2 < loop["max_sensitivity"] < 2.0
    assert 60.0 < loop["largest_stable_cross_coupling_per_s"] < 2000.0
    assert set(check_machine(bundled("cmm.yaml"))["loop"].values()) == {None}


def test_check_looks_at_the_joints_of_other_kinematics():
    loop = Control(T, 20.0, 1, None, CrossCoupling(640.0))
    machine = Machine("cubic", (), DRIVES)
    told = check_loop(Setup(machine, control=loop, kinematics=CUBIC))
    home = CUBIC.inverse_jacobian(np.zeros((1, 6)))
    assert told["largest_stable_cross_coupling_per_s"] == largest_stable_coupling(DRIVES, loop, home)
    assert told["gain_margin"] == worst_margins(DRIVES, loop, home[0], DIRECTIONS).gain
    with pytest.raises(InfeasibleError, match="across the path"):
        check_loop(
            Setup(machine, control=replace(loop, cross_coupling=CrossCoupling(960.0)), kinematics=CUBIC)
        )


@pytest.mark.parametrize("home", [np.nan, 0.0], ids=["out of reach", "singular"])
def test_a_home_where_the_machine_cannot_stand_has_no_margins(home):
    nowhere = replace(CUBIC, inverse_jacobian=lambda axes: np.full((len(axes), 6, 6), home))
    told = check_loop(Setup(Machine("m", (), DRIVES), kinematics=nowhere))
    assert set(told.values()) == {None}
    with pytest.raises(InfeasibleError, match="joint q2 is unstable"):
        check_loop(Setup(Machine("m", (), DRIVES), control=Control(T, 2028.0), kinematics=nowhere))
