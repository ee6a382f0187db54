"""Servo motors in the loop: closed forms of the motor, and that it goes with every other part."""

from __future__ import annotations

from dataclasses import replace
from math import exp, pi

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from test_loop import PATH, polygon_run

from cnc_shape.arrays import frozen
from cnc_shape.contour import contour_error
from cnc_shape.controllers import (
    Control,
    CrossCoupling,
    DisturbanceObserver,
    Estimator,
    Feedforward,
    FrictionFeedforward,
    InertiaCompensation,
    InertiaIdentification,
)
from cnc_shape.controllers.loop import Command
from cnc_shape.disturbances import (
    Disturbances,
    EncoderNoise,
    LoadTorque,
    PathDirection,
    SineBurst,
    Steps,
)
from cnc_shape.experiments.contour_control import rigs
from cnc_shape.joints import joints_of
from cnc_shape.kinematics import cartesian, corexy, linear_delta, trunnion_ac
from cnc_shape.limits import Limits
from cnc_shape.machine import Axis, FirstOrderLag, Machine, ServoMotor, VelocityLoop
from cnc_shape.modes import Mode
from cnc_shape.servo import NO_POSES, PathWindows, make_loop
from cnc_shape.simulation import simulate, simulating
from cnc_shape.trajectory import Trajectory
from cnc_shape.windows import foot_windows

T, H = 1e-3, 2.5e-4
LIMITS = Limits(1000.0, 10_000.0)
BARE = ServoMotor(inertia=4.6e-4, torque_limit=7.1, lead=10.0)
REAL = replace(BARE, viscous=5e-4, coulomb=0.08, current_time_constant=2e-4, encoder_counts=131072)
ROTARY = replace(REAL, lead=2 * pi / 50)
CONTROL = Control(T, 44.67)
FULL = replace(
    CONTROL,
    disturbance_observer=DisturbanceObserver(300.0),
    inertia_compensation=InertiaCompensation(),
    friction_feedforward=FrictionFeedforward(),
    inertia_identification=InertiaIdentification(excitation=1.0),
    feedforward=Feedforward(1.0, 1.0),
    cross_coupling=CrossCoupling(20.0, Estimator.FOOT_POINT),
)
BURST = Disturbances((LoadTorque(PathDirection.NORMAL, 2.0, SineBurst(8.0, 0.5, 0.3)),), EncoderNoise(0.5, 3))
KINEMATICS = {
    "cartesian": (cartesian(), ()),
    "corexy": (corexy(), (REAL,) * 3),
    "delta": (linear_delta(150.0, 300.0), (REAL,) * 3),
    "cubic": (rigs.CUBIC.kinematics, (REAL,) * 6),
    "trunnion": (trunnion_ac(np.zeros(3)), (REAL, REAL, REAL, ROTARY, ROTARY)),
}


def machine(motor=REAL, joints=(), modes=()) -> Machine:
    drive = {} if joints else {"drive": motor}
    return Machine("test", tuple(Axis(name, LIMITS, **drive, modes=modes) for name in "xyz"), joints)


def still(seconds: float) -> Trajectory:
    """A command that rests at 0."""
    n = round(seconds / T)
    nothing = frozen(np.zeros((n, 3)))
    return Trajectory(("x", "y", "z"), T, frozen(np.zeros(n)), nothing, nothing, nothing)


def constant(axis: str, torque: float, start: float = 0.0) -> Disturbances:
    return Disturbances((LoadTorque(axis, torque, Steps((start,), (1.0,))),))


# --- the motor


def free_motor(motor: ServoMotor) -> ServoMotor:
    """The motor with a velocity loop that can ask for next to nothing."""
    return replace(motor, torque_limit=1e-12)


def test_a_free_motor_falls_under_its_load():  # w' = -Td / J, angle exact
    motor = free_motor(BARE)
    response = simulate(still(0.05), machine(motor), CONTROL, disturbances=constant("x", 1e-3))
    t = np.arange(50) * T
    assert_allclose(response.joint[:, 0], -0.5 * 1e-3 / 4.6e-4 * t**2 * motor.pitch, atol=1e-9)
    assert not response.joint[:, 1:].any()


def test_friction_holds_what_it_can_and_takes_its_share_of_the_rest():
    motor = replace(free_motor(BARE), coulomb=0.05)
    stuck = simulate(still(0.05), machine(motor), CONTROL, disturbances=constant("x", 0.0499))
    assert not stuck.joint.any()
    slipping = simulate(still(0.05), machine(motor), CONTROL, disturbances=constant("x", 0.06))
    t = np.arange(50) * T
    assert_allclose(slipping.joint[:, 0], -0.5 * 0.01 / 4.6e-4 * t**2 * motor.pitch, atol=1e-9)


def test_a_push_that_ends_leaves_a_motor_that_friction_stops_for_good():
    motor = replace(free_motor(BARE), coulomb=0.05)
    pushed = Disturbances((LoadTorque("x", 0.1, Steps((0.0, 0.02), (1.0, 0.0))),))
    x = simulate(still(0.2), machine(motor), CONTROL, disturbances=pushed).joint[:, 0]
    speed = 0.05 / 4.6e-4 * 0.02  # rad/s, after 20 ms; the same deceleration: 20 ms more
    assert_allclose(x[40:], -motor.pitch * speed * 0.02, rtol=1e-9)


def test_viscous_friction_sets_the_final_speed():
    motor = replace(free_motor(BARE), viscous=0.02)
    x = simulate(still(0.4), machine(motor), CONTROL, disturbances=constant("x", 0.1)).joint[:, 0]
    assert_allclose(np.diff(x)[-1] / T, -motor.pitch * 0.1 / 0.02, rtol=1e-6)


def test_the_current_lag_is_exact_over_a_tick():
    """A velocity command that steps: torque at the limit from the second tick on, behind the lag."""
    tau, limit = 2e-4, 0.01
    motor = replace(BARE, torque_limit=limit, current_time_constant=tau)
    loop = make_loop(joints_of(machine(motor)), Control(T, 1000.0))
    memory = loop.start(np.zeros(3))
    away = frozen(np.ones((2, 3)))
    none = frozen(np.zeros((2, 3)))
    loop.run(memory, Command(away, none, none, away, none), NO_POSES, PathWindows())
    t = 3 * H  # three of the four ticks move the motor: the torque of the first comes a tick later
    speed = limit / 4.6e-4 * (t - tau * (1 - exp(-t / tau)))
    assert_allclose(memory.motors.motor[0, 1], speed, rtol=1e-12)
    assert_allclose(memory.motors.motor[0, 2], limit * (1 - exp(-t / tau)), rtol=1e-12)


def test_a_load_is_borne_by_the_integral_without_a_lasting_error():
    response = simulate(
        still(1.0), machine(replace(REAL, coulomb=0.0)), CONTROL, disturbances=constant("y", 1.5)
    )
    count = REAL.lead / REAL.encoder_counts
    assert abs(response.joint[-1, 1]) < 2 * count
    assert response.motors is not None
    assert_allclose(response.motors.torque[-100:, 1].mean(), 1.5, rtol=2e-3)


def test_a_drive_without_integral_gives_way_as_its_stiffness_says():  # x = pitch Td / (K_T Kp)
    motor = replace(BARE, velocity_loop=VelocityLoop(integral_time=np.inf))
    x = simulate(still(1.0), machine(motor), CONTROL, disturbances=constant("x", 0.5)).joint[-1, 0]
    assert_allclose(x, -motor.pitch * 0.5 / (4.6e-4 * 400.0 * 44.67), rtol=1e-6)


def test_the_integral_does_not_wind_up_at_the_torque_limit():
    """Overloaded for a tenth of a second: an integral that went on would hold 20 N m by then."""
    push = Disturbances((LoadTorque("x", 1.05, Steps((0.1, 0.2), (1.0, 0.0))),))
    motor = replace(BARE, torque_limit=1.0)
    response = simulate(still(1.0), machine(motor), CONTROL, disturbances=push)
    assert response.motors is not None
    assert np.abs(response.motors.torque).max() == 1.0
    x = response.joint[:, 0]
    assert x.min() < -0.5
    assert x.max() < 0.1 * -x.min()
    assert abs(x[-1]) < 1e-3


def test_the_encoder_reads_whole_counts():
    """Within half a count nothing is seen: the motor falls freely so far, and is then hit by the whole count."""
    coarse = replace(BARE, encoder_counts=100)  # 0.1 mm
    response = simulate(still(0.1), machine(coarse), CONTROL, disturbances=constant("x", 0.02))
    assert response.motors is not None
    fall = np.sqrt(2 * 0.05 / coarse.pitch * 4.6e-4 / 0.02)  # s, over half a count
    asked = np.flatnonzero(response.motors.torque[:, 0])[0] * T
    assert fall < asked <= fall + 2 * T


# --- with everything else


@pytest.mark.parametrize("name", KINEMATICS)
def test_motors_follow_under_every_kinematics(name):
    kinematics, joints = KINEMATICS[name]
    command, path = polygon_run(dwell=300)
    response = simulate(command, machine(joints=joints), FULL, kinematics, path)
    error = contour_error(response.position, path, *foot_windows(command.arc_length, 100, 40, 0.5))
    assert error.rms < 0.02
    assert_allclose(response.position[-1], command.position[-1], atol=4e-3)  # where friction holds it


@pytest.mark.parametrize("name", KINEMATICS)
@pytest.mark.parametrize("sizes", [(1,), (7, 0, 100), (333,)], ids=str)
def test_streamed_equals_whole(name, sizes):
    kinematics, joints = KINEMATICS[name]
    command, path = polygon_run(dwell=100)
    stage = machine(joints=joints, modes=(Mode(30.0, 0.02),))
    control = replace(FULL, delay_samples=1, jacobian_every=3)
    whole = simulate(command, stage, control, kinematics, path, disturbances=BURST)
    step = simulating(stage, control, kinematics, disturbances=BURST)
    state, parts, first, turn = None, [], 0, 0
    while first < len(command):
        last = min(first + sizes[turn % len(sizes)], len(command))
        chunk = command.cut(slice(first, last))
        state, response = step(state, path if state is None else None, chunk, last == len(command))
        parts.append(response)
        first, turn = last, turn + 1
    for signal in ("joint", "tool", "drive"):
        assert_array_equal(np.vstack([getattr(part, signal) for part in parts]), getattr(whole, signal))
    assert whole.motors is not None
    for signal in ("torque", "load", "estimate", "gain_ratio", "agreement", "inertia"):
        joined = np.vstack([getattr(part.motors, signal) for part in parts])
        assert_array_equal(joined, getattr(whole.motors, signal))


def test_a_load_on_a_parallel_machine_does_the_same_work_on_its_legs():
    """Legs without integral give way like springs: what the load works there it works at the platform."""
    kinematics, _ = KINEMATICS["cubic"]
    spring = replace(BARE, velocity_loop=VelocityLoop(integral_time=np.inf))
    load = np.array([0.02, -0.01, 0.03])
    loads = tuple(LoadTorque(a, t, Steps((0.0,), (1.0,))) for a, t in zip("xyz", load, strict=True))
    response = simulate(
        still(2.0), machine(joints=(spring,) * 6), CONTROL, kinematics, disturbances=Disturbances(loads)
    )
    assert response.motors is not None
    torque = response.motors.load[0]
    for direction in np.eye(6):
        moved = kinematics.inverse(np.vstack([1e-4 * direction, -1e-4 * direction]))
        along = (moved[0] - moved[1]) / 2e-4
        assert_allclose(torque @ along, (np.append(load, np.zeros(3)) @ direction), atol=1e-6)
    yielded = spring.pitch * torque / (4.6e-4 * 400.0 * 44.67)
    assert_allclose(response.joint[-1] - response.reference[-1], -yielded, rtol=1e-3)


def test_modes_behind_a_motor_answer_its_acceleration():
    """Twice the tool's motion by the free response of each mode, added up over the ticks of the motor."""
    mode = Mode(40.0, 0.03, 0.7)
    response = simulate(
        still(0.3), machine(BARE, modes=(mode,)), CONTROL, disturbances=constant("x", 0.5, 0.01)
    )
    bare = simulate(still(0.3), machine(BARE), CONTROL, disturbances=constant("x", 0.5, 0.01))
    assert_array_equal(response.joint, bare.joint)
    fine = np.interp(np.arange(0, 0.3, 1e-5), np.arange(300) * T, bare.joint[:, 0])
    d, w, found = 0.0, 0.0, []
    push = np.gradient(np.gradient(fine, 1e-5), 1e-5)
    for a in push:
        found.append(d)
        w += 1e-5 * (-0.7 * a - 2 * 0.03 * mode.omega * w - mode.omega**2 * d)
        d += 1e-5 * w
    bent = response.tool[:, 0] - response.joint[:, 0]
    assert np.abs(bent - np.array(found)[::100]).max() < 0.1 * np.abs(bent).max()


def test_axes_without_a_motor_are_as_without_its_neighbours():
    command, path = polygon_run()
    lag = FirstOrderLag(0.0153, 0.993)
    mixed = Machine("mixed", tuple(Axis(n, LIMITS, d) for n, d in zip("xyz", (REAL, lag, lag), strict=True)))
    alone = Machine("lags", tuple(Axis(n, LIMITS, lag) for n in "xyz"))
    one, other = (simulate(command, stage, CONTROL, toolpath=path) for stage in (mixed, alone))
    assert_array_equal(one.joint[:, 1:], other.joint[:, 1:])
    assert one.motors is not None
    assert one.motors.joints == ("x",)
    assert other.motors is None


def test_delayed_commands_and_torques_arrive_late_together():
    command, _ = polygon_run()
    ahead = replace(CONTROL, position_gain=1e-3, feedforward=Feedforward(1.0, 1.0))
    prompt = simulate(command, machine(), ahead).joint
    late = simulate(command, machine(), replace(ahead, delay_samples=5)).joint
    assert_allclose(late[5:], prompt[:-5], atol=2e-4)  # the position loop sees them, though weakly


def test_noise_is_the_same_twice_and_another_with_another_seed():
    command, _ = polygon_run()
    runs = [
        simulate(command, machine(), CONTROL, disturbances=Disturbances((), EncoderNoise(1.0, s)))
        for s in (1, 1, 2)
    ]
    assert_array_equal(runs[0].joint, runs[1].joint)
    assert (runs[0].joint != runs[2].joint).any()


@pytest.mark.parametrize(
    "term",
    [
        {"inertia_compensation": InertiaCompensation()},
        {"inertia_identification": InertiaIdentification()},
        {"disturbance_observer": DisturbanceObserver(200.0, 0.0)},
    ],
    ids=lambda term: next(iter(term)),
)
def test_what_only_watches_changes_nothing_to_the_bit(term):
    command, path = polygon_run()
    plain = simulate(command, machine(), CONTROL, toolpath=path)
    watched = simulate(command, machine(), replace(CONTROL, **term), toolpath=path)
    assert_array_equal(watched.joint, plain.joint)
    assert watched.motors is not None
    assert watched.motors.estimate.any()


def test_the_path_is_where_the_test_says():  # that the runs above have corners and rests
    command, path = polygon_run()
    assert tuple(command.position[-1, :2]) == PATH[-1]
    assert len(path) == len(PATH)
