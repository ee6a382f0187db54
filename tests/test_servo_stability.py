"""Servo motors in the loop's stability: brute force, python-control, and the margins that were published."""

from __future__ import annotations

from dataclasses import replace

import control
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from cnc_shape.config.loop_check import check_loop
from cnc_shape.config.setup import Setup
from cnc_shape.controllers import (
    Control,
    CrossCoupling,
    DisturbanceObserver,
    GainLaw,
    InertiaCompensation,
    gain_limits,
)
from cnc_shape.controllers.loop import Command
from cnc_shape.controllers.loop_model import closed_loop, loop_model, loop_transfer, open_loop, poles
from cnc_shape.controllers.margins import servo_margins, worst_margins
from cnc_shape.controllers.servo_model import at_ratio, gain_ratios, lifted, torque_transfer, velocity_tick
from cnc_shape.controllers.stability import (
    DIRECTIONS,
    check_along,
    check_poses,
    check_stability,
    largest_stable_coupling,
    largest_stable_position_gain,
)
from cnc_shape.controllers.velocity_loops import largest_stable_bandwidth, settles
from cnc_shape.errors import InfeasibleError
from cnc_shape.experiments.contour_control import rigs
from cnc_shape.joints import joints_of
from cnc_shape.limits import Limits
from cnc_shape.machine import Axis, FirstOrderLag, IdealDrive, Machine, ServoMotor, VelocityLoop
from cnc_shape.servo import NO_POSES, SLOWEST_LOOP, PathWindows, make_loop, settling_time
from cnc_shape.units import DEGREE

T = 1e-3
NOMINAL = 4.6e-4  # kg m^2
LIMITS = Limits(1000.0, 10_000.0)
MOTOR = ServoMotor(NOMINAL, 7.1, 10.0, 5e-4, 0.0808, 2e-4, 131072, nominal_inertia=NOMINAL)
LOOP = Control(T, 44.67)  # paper 003: all of it
LAG = FirstOrderLag(0.0137, 1.1)
CUBIC = rigs.CUBIC.kinematics
AT = CUBIC.inverse_jacobian(np.array([[20.0, 15.0, 0.0, 0.0, 0.0, 0.0]]))
X, Y, Z = np.eye(3)


def turning(share, **changes):
    """The motor with a share of the inertia that its controllers believe in."""
    return replace(MOTOR, inertia=share * NOMINAL, **changes)


def axes(*drives):
    return [Axis(name, LIMITS, drive) for name, drive in zip("xyzac", drives, strict=False)]


def compensated(ratio, law=GainLaw.EFFECTIVE_INERTIA, **changes):
    return replace(LOOP, inertia_compensation=InertiaCompensation(ratio, law=law, **changes))


def observed(loop, bandwidth, feedforward=1.0):
    return replace(loop, disturbance_observer=DisturbanceObserver(bandwidth, feedforward))


# --- brute force ----------------------------------------------------------------------------------


class Turning:
    """A linear motor with its velocity loop, written as the spec has it, the motor integrated by RK4."""

    def __init__(self, motor, loop, angle, ratio=1.0, stiffening=1.0, ticks=4):
        self.motor, self.loop, self.ticks = motor, loop, ticks
        self.gain = motor.believed_inertia * motor.velocity_loop.bandwidth * ratio
        self.rate = stiffening / motor.velocity_loop.integral_time
        self.x = np.array([angle, 0.0, 0.0])  # angle, speed, torque
        self.before, self.asked, self.integral = angle, 0.0, 0.0
        self.angle, self.speed, self.load = angle, 0.0, 0.0

    @property
    def position(self):
        return self.x[0] * self.motor.lead / (2 * np.pi)

    def sample(self, command):
        for _ in range(self.ticks):
            self.tick(command / (self.motor.lead / (2 * np.pi)))

    def tick(self, command):
        h, J = T / self.ticks, self.motor.believed_inertia
        y = self.x[0]
        e = command - (y - self.before) / h
        self.integral += self.gain * h * self.rate * e
        asked = self.gain * e + self.integral
        observer = self.loop.disturbance_observer
        if observer is not None:
            asked += observer.feedforward * self.load
            d = 1.0 - np.exp(-observer.bandwidth * h)
            nu, drive = y - self.angle, self.asked - self.load
            self.angle, self.speed, self.load = (
                self.angle + h * self.speed + h**2 / (2 * J) * drive + 3 * d * nu,
                self.speed + h / J * drive + (3 * d**2 - d**3 / 2) / h * nu,
                self.load - J * d**3 / h**2 * nu,
            )
        steps = 25
        for _ in range(steps):
            self.x = self.runge_kutta(self.x, self.asked, h / steps)
        self.before, self.asked = y, asked

    def runge_kutta(self, x, asked, q):
        motor = self.motor

        def rates(x):
            lag = motor.current_time_constant
            torque = x[2] if lag else asked
            return np.array(
                [
                    x[1],
                    (torque - motor.viscous * x[1]) / motor.inertia,
                    (asked - x[2]) / lag if lag else 0.0,
                ]
            )

        a = rates(x)
        b = rates(x + q / 2 * a)
        c = rates(x + q / 2 * b)
        return x + q / 6 * (a + 2 * b + 2 * c + rates(x + q * c))


def run_alone(turning, gain, samples):
    """Positions of a motor under its position loop, let go beside its command."""
    told = []
    for _ in range(samples):
        told.append(turning.position)
        turning.sample(-gain * turning.position)
    return np.array(told)


def one(motor, loop):
    """The closed loop of a joint by itself."""
    return loop_model((motor,), loop, np.eye(1)[None], X[None])


MOTORS = {
    "the paper's": MOTOR,
    "half the inertia": turning(0.5),
    "three times the inertia": turning(3.0),
    "no current lag": replace(MOTOR, current_time_constant=0.0),
    "no viscous friction": replace(MOTOR, viscous=0.0),
    "no integral": replace(MOTOR, velocity_loop=VelocityLoop(integral_time=np.inf)),
    "much friction": replace(MOTOR, viscous=0.05),
    "as slow as the position loop": replace(MOTOR, velocity_loop=VelocityLoop(100.0, 0.02, 1e-3)),
    "rotary": replace(MOTOR, lead=0.1),
}
OBSERVERS = {
    "none": None,
    "fed forward": DisturbanceObserver(300.0),
    "watching": DisturbanceObserver(300.0, 0.0),
    "half": DisturbanceObserver(150.0, 0.5),
}


@pytest.mark.parametrize("motor", MOTORS.values(), ids=MOTORS)
@pytest.mark.parametrize("observer", OBSERVERS.values(), ids=OBSERVERS)
def test_the_model_goes_where_brute_force_goes(motor, observer):
    """Position loop included, sample by sample."""
    loop = replace(LOOP, disturbance_observer=observer)
    ticks = round(T / motor.velocity_loop.sample_time)
    told = run_alone(Turning(motor, loop, 1.0, ticks=ticks), LOOP.position_gain, 30)
    transition = closed_loop(one(motor, loop))[0]
    state = np.zeros(len(transition))
    state[0] = told[0]
    found = []
    for _ in told:
        found.append(state[0])
        state = transition @ state
    assert_allclose(found, told, rtol=0.0, atol=1e-8 * told[0])


@pytest.mark.parametrize("ratio", [0.1, 2.5])
@pytest.mark.parametrize("scaled", [False, True])
def test_the_gain_is_held_at_a_ratio(ratio, scaled):
    """The ratio raises the gain, the integral with it; once more where it shortens the integral time."""
    loop = compensated(ratio, GainLaw.FIXED, scale_integral_time=scaled)
    brute = Turning(MOTOR, loop, 1.0, ratio, ratio if scaled else 1.0)
    told = run_alone(brute, LOOP.position_gain, 60)
    transition = closed_loop(one(MOTOR, loop))[0]
    powers = [np.linalg.matrix_power(transition, k)[0, 0] for k in range(60)]
    assert_allclose(np.array(powers) * told[0], told, rtol=0.0, atol=1e-8 * told[0])
    moving = compensated(9.0, scale_integral_time=scaled)
    assert_array_equal(closed_loop(one(MOTOR, at_ratio(moving, ratio)))[0], transition)


@pytest.mark.parametrize("observer", [None, DisturbanceObserver(200.0)], ids=["no observer", "observer"])
@pytest.mark.parametrize("share", [0.97, 1.03])
def test_brute_force_decays_and_grows_by_the_largest_pole(observer, share):
    """Close to the largest stable position gain, from which the pole is read in the slope of the envelope."""
    loop = replace(LOOP, disturbance_observer=observer)
    gain = share * largest_stable_position_gain(MOTOR, loop)
    radius = np.abs(poles((MOTOR,), replace(loop, position_gain=gain), np.eye(1), X)).max()
    told = np.abs(run_alone(Turning(MOTOR, loop, 1.0), gain, 400))
    early, late = told[100:200].max(), told[300:].max()
    assert (share < 1.0) == (radius < 1.0) == (late < early)
    assert_allclose(np.log(late / early) / 200, np.log(radius), rtol=0.03)


@pytest.mark.parametrize("delay", [0, 2])
def test_servo_motors_and_lags_move_a_parallel_kinematics_together(delay):
    """Cross-coupled, with all terms, at a pose of the cubic manipulator: against the loop term by term."""
    kinds = (MOTOR, LAG, turning(0.6, lead=5.0), FirstOrderLag(0.02), turning(2.0), LAG)
    coupling = CrossCoupling(50.0, integral=500.0, derivative=0.7, orientation=20.0)
    loop = replace(observed(LOOP, 200.0), delay_samples=delay, cross_coupling=coupling)
    tangent = np.array([0.6, 0.0, 0.8])
    across = np.eye(3) - np.outer(tangent, tangent)
    start = np.array([1.0, -0.4, 0.7, 0.2, -0.9, 0.5])
    motors = {
        j: Turning(kind, loop, start[j] * 2 * np.pi / kind.lead)
        for j, kind in enumerate(kinds)
        if isinstance(kind, ServoMotor)
    }
    q, v, late = start.copy(), np.zeros(6), [np.zeros(6)] * delay
    integral, before = np.zeros(3), np.zeros(3)
    told = []
    for _ in range(40):
        told.append(q.copy())
        e = np.linalg.solve(AT[0], -q)
        eps = across @ e[:3]
        w = 50.0 * eps + 500.0 * integral + 0.7 * (eps - before) / T
        integral, before = integral + T * eps, eps
        late = [*late, -44.67 * q + AT[0] @ np.concatenate([w, 20.0 * e[3:]])]
        heard, late = late[0], late[1:]
        for j, kind in enumerate(kinds):
            if j in motors:
                motors[j].sample(heard[j])
                q[j] = motors[j].position
                continue
            al = np.exp(-T / kind.time_constant)
            be = kind.time_constant * (1 - al)
            q[j] += be * v[j] + kind.gain * (T - be) * heard[j]
            v[j] = al * v[j] + (1 - al) * kind.gain * heard[j]
    transition = closed_loop(loop_model(kinds, loop, AT, tangent[None]))[0]
    state = np.zeros(len(transition))
    state[:6] = start
    for positions in told:
        assert_allclose(state[:6], positions, rtol=0.0, atol=1e-8)
        state = transition @ state


# --- the loop's own kernel ------------------------------------------------------------------------


def let_go(drives, loop, start, samples):
    """Positions of the loop itself, told to stand at 0 and let go beside it, (samples, j)."""
    still = np.zeros((samples + 1, len(drives)))
    servo = make_loop(joints_of(Machine("m", tuple(axes(*drives)))), loop)
    ran = servo.run(servo.start(np.array(start)), Command(*[still] * 5), NO_POSES, PathWindows())
    return ran.joint


def linear(motor):
    """The motor without what is not linear, and without what the kernel splits within a tick."""
    return replace(
        motor, coulomb=0.0, encoder_counts=0, torque_limit=1e9, viscous=0.0, current_time_constant=0.0
    )


@pytest.mark.parametrize("observer", OBSERVERS.values(), ids=OBSERVERS)
@pytest.mark.parametrize(("ratio", "scaled"), [(1.0, False), (2.5, False), (1.7, True)])
@pytest.mark.parametrize("delay", [0, 2])
def test_the_model_goes_where_the_kernel_goes(observer, ratio, scaled, delay):
    loop = compensated(ratio, GainLaw.FIXED, scale_integral_time=scaled)
    loop = replace(loop, disturbance_observer=observer, delay_samples=delay)
    drives = (linear(MOTOR), LAG, linear(turning(0.6, lead=4.0)))
    start = [1.0, -0.5, 0.3]
    told = let_go(drives, loop, start, 100)
    transition = closed_loop(loop_model(drives, loop, np.eye(3)[None], X[None]))[0]
    state = np.zeros(len(transition))
    state[:3] = start
    for positions in told:
        assert_allclose(state[:3], positions, rtol=0.0, atol=1e-9)
        state = transition @ state


@pytest.mark.parametrize("share", [0.9, 1.1])
def test_the_kernel_decays_and_grows_as_told(share):
    """The motor as it is but for friction, limit and counts: its lag split from its motion, 3 % off."""
    motor = replace(MOTOR, coulomb=0.0, encoder_counts=0, torque_limit=1e9)
    gain = share * largest_stable_position_gain(motor, LOOP)
    told = np.abs(let_go((motor,), replace(LOOP, position_gain=gain), [1.0], 400))
    assert (told[300:].max() < told[100:200].max()) == (share < 1.0)


@pytest.mark.parametrize(("share", "stable"), [(0.45, True), (0.35, False)])
def test_the_papers_motor_runs_where_it_is_not_refused(share, stable):
    """At a ratio of 2.5, let go 0.2 mm beside the command: it settles, or shakes within its torque limit."""
    motor, loop = turning(share), compensated(2.5, GainLaw.FIXED)
    told = np.abs(let_go((motor,), loop, [0.2], 4000))
    assert (closed_poles(motor, loop) < 1.0) == stable
    assert (told[3000:].max() < 1e-3) == stable
    assert (told[3000:].max() > 0.01) != stable


# --- the loop over frequency ----------------------------------------------------------------------


def test_transfer_matrix_of_mixed_drives_equals_the_state_space():
    kinds = (MOTOR, LAG, turning(0.6), IdealDrive(), turning(2.0), LAG)
    coupling = CrossCoupling(80.0, integral=800.0, derivative=1.16, orientation=30.0)
    loop = replace(observed(LOOP, 300.0), delay_samples=2, cross_coupling=coupling)
    model = loop_model(kinds, loop, AT, X[None])
    A, B, C = open_loop(model)
    z = np.exp(1j * np.array([0.01, 0.3, 3.0]))
    slow = [-C[0] @ np.linalg.solve(point * np.eye(len(A[0])) - A[0], B) for point in z]
    assert_allclose(loop_transfer(model, z)[0], slow, rtol=1e-8, atol=1e-12)


@pytest.mark.parametrize("observer", OBSERVERS.values(), ids=OBSERVERS)
@pytest.mark.parametrize("delay", [0, 3])
def test_where_the_position_loop_ticks_as_fast_both_loops_have_the_same_poles(observer, delay):
    """det(1 + L) = 0: broken at the torque or at the command, it is one loop."""
    motor = turning(0.7, velocity_loop=VelocityLoop(200.0, 0.01, T))
    loop = replace(LOOP, position_gain=15.0, delay_samples=delay, disturbance_observer=observer)
    found = poles((motor,), loop, np.eye(1), X)
    moving = found[np.abs(found) > 1e-2]
    assert_allclose(torque_transfer(motor, loop, moving), -1.0, atol=1e-5)


def by_python_control(motor, loop, ratio):
    """Loop transfer at the torque, put together from systems of python-control."""
    h, J, lag = 2.5e-4, motor.inertia, motor.current_time_constant
    continuous = control.ss(
        [[0, 1, 0], [0, -motor.viscous / J, 1 / J], [0, 0, -1 / lag]], [[0], [0], [1 / lag]], [[1, 0, 0]], 0
    )
    plant = control.sample_system(continuous, h, "zoh")
    late = control.ss(0, 1, 1, 0, h)
    speed = control.ss(0, -1 / h, 1, 1 / h, h)
    held = control.ss(np.eye(3, 3, -1), [[1], [0], [0]], np.full((1, 3), 0.25), 0.25, h)
    gain = motor.believed_inertia * 400.0 * ratio
    integral = control.ss(1, 1, gain * h / 0.01, gain * (1 + h / 0.01), h)
    answer = integral * (loop.position_gain * held + speed)
    observer = loop.disturbance_observer
    if observer is None:
        return answer * late * plant
    d, Jn = 1.0 - np.exp(-observer.bandwidth * h), motor.believed_inertia
    gains = np.array([[3 * d], [(3 * d**2 - d**3 / 2) / h], [-Jn * d**3 / h**2]])
    A = np.array([[1, h, -(h**2) / 2 / Jn], [0, 1, -h / Jn], [0, 0, 1]]) - gains @ [[1, 0, 0]]
    from_torque = control.ss(A, [[h**2 / 2 / Jn], [h / Jn], [0]], [[0, 0, 1]], 0, h)
    from_reading = control.ss(A, gains, [[0, 0, 1]], 0, h)
    asking = control.feedback(control.ss([], [], [], 1, h), late * from_torque, sign=1)
    return asking * (answer - from_reading) * late * plant


@pytest.mark.parametrize("share", [1.0, 0.5])
@pytest.mark.parametrize("bandwidth", [None, 300.0])
@pytest.mark.parametrize("ratio", [1.0, 2.5])
def test_margins_are_those_of_python_control(share, bandwidth, ratio):
    motor = turning(share)
    loop = LOOP if bandwidth is None else observed(LOOP, bandwidth)
    system = by_python_control(motor, loop, ratio)
    w = np.geomspace(1.0, 0.999 * np.pi / 2.5e-4, 6000)
    response = system(np.exp(2.5e-4j * w))
    found = servo_margins(motor, loop, ratio)
    assert_allclose(torque_transfer(motor, at_ratio(loop, ratio), np.exp(2.5e-4j * w)), response, rtol=1e-5)
    gains, phases, *_ = control.stability_margins(control.frd(response, w), returnall=True)
    assert_allclose(found.gain, gains[gains > 1.0].min(), rtol=1e-4)
    assert_allclose(found.phase / DEGREE, np.abs(phases).min(), rtol=1e-4)
    assert_allclose(found.sensitivity, np.abs(1.0 / (1.0 + response)).max(), rtol=1e-5)


SENSITIVITY = [  # largest, with the believed inertia and with half of it (paper 003's table, ours)
    ("none", 1.0, None, False, 1.32, 1.72), ("ratio 1.5", 1.5, None, False, 1.50, 2.36),
    ("ratio 2.5", 2.5, None, False, 2.00, 6.97), ("ratio 3", 3.0, None, False, 2.36, 63.0),
    ("ratio 2.5, integral", 2.5, None, True, 2.25, 11.9), ("observer 150", 1.0, 150.0, False, 1.32, 1.72),
    ("observer 300", 1.0, 300.0, False, 1.36, 1.71), ("both", 2.5, 150.0, False, 1.99, 6.95),
]  # fmt: skip


@pytest.mark.parametrize(
    ("ratio", "bandwidth", "scaled", "whole", "half"),
    [row[1:] for row in SENSITIVITY], ids=[row[0] for row in SENSITIVITY],
)  # fmt: skip
def test_sensitivities_are_the_published_ones(ratio, bandwidth, scaled, whole, half):
    loop = compensated(9.0, scale_integral_time=scaled)
    loop = loop if bandwidth is None else observed(loop, bandwidth)
    for share, published in ((1.0, whole), (0.5, half)):
        last_digit = 0.5 if published > 20.0 else 0.05 if published > 10.0 else 0.005
        found = servo_margins(turning(share), loop, ratio).sensitivity
        assert_allclose(found, published, rtol=0.01, atol=last_digit)


def test_margins_of_the_recommended_ratio_are_the_published_ones():
    found = servo_margins(MOTOR, LOOP, 2.5)
    assert_allclose(found.phase / DEGREE, 42.6, atol=0.05)
    assert_allclose(20.0 * np.log10(found.gain), 7.8, atol=0.05)


# --- refusals -------------------------------------------------------------------------------------


def refused(drives, loop):
    with pytest.raises(InfeasibleError) as error:
        check_stability(axes(*drives), loop)
    return error.value


def limit(error):
    return float(str(error).split("stable below ")[1].split()[0])


def test_the_papers_compensation_is_stable_down_to_two_fifths_of_the_inertia():
    """7.8 dB of gain margin at a ratio of 2.5 are 0.41 of the inertia."""
    loop = compensated(2.5)
    check_stability(axes(MOTOR, turning(0.45), MOTOR), loop)
    error = refused((MOTOR, turning(0.35), MOTOR), loop)
    assert "the velocity loop of axis y is unstable at" in str(error)
    assert "max_gain_ratio 2.5, stable below 2.1" in str(error)
    assert "inertia_compensation.max_gain_ratio" in error.hint
    shares = np.linspace(0.35, 0.45, 101)
    stable = [closed_poles(turning(share), at_ratio(loop, 2.5)) < 1.0 for share in shares]
    assert_allclose(shares[stable.index(True)], 0.41, atol=0.005)


def closed_poles(motor, loop):
    return np.abs(np.linalg.eigvals(closed_loop(one(motor, loop))[0])).max()


@pytest.mark.parametrize("law", [GainLaw.EFFECTIVE_INERTIA, GainLaw.TRIGGERED, GainLaw.FIXED])
def test_the_largest_ratio_told_is_the_largest(law):
    told = limit(refused((turning(0.35),), compensated(2.5, law)))
    check_stability(axes(turning(0.35)), compensated(0.999 * told, law))
    assert_allclose(limit(refused((turning(0.35),), compensated(1.001 * told, law))), told, rtol=5e-4)


def test_only_the_ratios_that_a_law_comes_to_are_looked_at():
    """A heavy load needs gain: nothing holds it at a tenth, little at 1, and the fixed law is never there."""
    heavy = turning(3.0)
    check_stability(axes(heavy), compensated(2.5))
    for law in (GainLaw.LITERAL, GainLaw.LITERAL_INVERSE):
        error = refused((heavy,), compensated(2.5, law))
        assert "the loop of axis x is unstable at 0.1" in str(error)
        told = limit(error)
        slower = replace(compensated(2.5, law), position_gain=0.999 * told)
        check_stability(axes(heavy), slower)
    motor = replace(heavy, velocity_loop=VelocityLoop(40.0))
    assert "position gain" in str(refused((motor,), compensated(10.0)))
    check_stability(axes(motor), compensated(10.0, GainLaw.FIXED))
    assert gain_ratios((MOTOR,), compensated(2.5, GainLaw.FIXED)) == (2.5,)
    assert gain_ratios((MOTOR,), LOOP) == gain_ratios((LAG,), compensated(2.5)) == (1.0,)
    looked = gain_ratios((MOTOR,), compensated(2.5, GainLaw.LITERAL))
    assert looked[0] == 1.0
    assert_allclose([min(looked), max(looked)], [0.1, 2.5])


@pytest.mark.parametrize("observer", [None, DisturbanceObserver(300.0, 0.0), DisturbanceObserver(100.0)])
def test_an_unstable_velocity_loop_is_told_with_its_axis_and_largest_bandwidth(observer):
    loop = replace(LOOP, disturbance_observer=observer)
    largest = largest_stable_bandwidth(MOTOR, loop)
    fast = replace(MOTOR, velocity_loop=VelocityLoop(1.001 * largest))
    assert settles(replace(MOTOR, velocity_loop=VelocityLoop(0.999 * largest)), loop)
    assert not settles(fast, loop)
    error = refused((MOTOR, LAG, fast), loop)
    assert "the velocity loop of axis z is unstable: bandwidth" in str(error)
    assert_allclose(limit(error), largest, rtol=5e-4)


def test_an_observer_that_makes_the_velocity_loop_unstable_is_told():
    loop = observed(LOOP, 3000.0)
    error = refused((turning(0.4),), loop)
    assert "the disturbance observer makes the velocity loop of axis x unstable: bandwidth 3000" in str(error)
    check_stability(axes(turning(0.4)), observed(LOOP, 0.9 * limit(error)))
    check_stability(axes(turning(0.4)), observed(LOOP, 3000.0, 0.0))


def test_an_unstable_position_loop_is_told_with_its_largest_gain():
    largest = largest_stable_position_gain(MOTOR, LOOP)
    check_stability(axes(MOTOR), replace(LOOP, position_gain=0.999 * largest))
    error = refused((MOTOR,), replace(LOOP, position_gain=1.001 * largest))
    assert "the loop of axis x is unstable: position gain" in str(error)
    assert_allclose(limit(error), largest, rtol=5e-4)
    late = replace(LOOP, delay_samples=2)
    assert largest_stable_position_gain(MOTOR, late) < 0.7 * largest


def test_the_compensation_may_make_the_position_loop_unstable():
    """The velocity loop would settle at a ratio of 2.5 by itself, but not inside a position loop this fast."""
    motor, loop = turning(0.415), replace(compensated(2.5), position_gain=300.0)
    assert settles(motor, at_ratio(loop, 2.5))
    error = refused((motor,), loop)
    assert "the loop of axis x is unstable at 2.5 times its velocity gain: max_gain_ratio 2.5" in str(error)
    told = InertiaCompensation(0.999 * limit(error))
    check_stability(axes(motor), replace(loop, inertia_compensation=told))


def test_every_joint_is_held_by_its_own_gain():
    largest = largest_stable_position_gain(MOTOR, LOOP)
    loop = replace(LOOP, joint_gains=(20.0, 1.01 * largest, 20.0))
    assert "axis y" in str(refused((MOTOR, MOTOR, MOTOR), loop))


@given(
    st.floats(0.3, 3.0), st.floats(0.0, 1e-3), st.floats(0.0, 0.01), st.floats(50.0, 800.0),
    st.floats(0.003, 0.1), st.sampled_from([1, 2, 4, 8]), st.floats(0.0, 400.0), st.integers(0, 3),
)  # fmt: skip
@settings(max_examples=25)
def test_largest_position_gain_is_where_brute_force_begins_to_grow(
    share, lag, viscous, bandwidth, integral_time, ticks, watched, delay
):
    velocity = VelocityLoop(bandwidth, integral_time, T / ticks)
    motor = turning(share, current_time_constant=lag, viscous=viscous, velocity_loop=velocity)
    loop = replace(observed(LOOP, watched) if watched > 20.0 else LOOP, delay_samples=delay)
    if not settles(motor, loop):
        return
    largest = largest_stable_position_gain(motor, loop)
    for factor in (0.98, 1.02):
        gained = replace(loop, position_gain=factor * largest)
        assert (closed_poles(motor, gained) < 1.0) == (factor < 1.0)
    tick, whole = velocity_tick(motor, loop), lifted(motor, loop)
    assert_allclose(whole.transition[0, 0], 1.0)
    assert_array_equal(whole.transition[1:, 0], 0.0)
    inner = np.linalg.matrix_power(tick.transition[1:, 1:], ticks)
    assert_allclose(whole.transition[1:, 1:], inner, rtol=1e-9, atol=1e-12)


# --- across the path ------------------------------------------------------------------------------


def test_equal_motors_answer_alike_at_every_pose_in_every_direction():
    """The poles are those of a joint held by Kp (along the path) and by Kp + Kc (across it)."""
    loop = replace(LOOP, cross_coupling=CrossCoupling(80.0))
    alone = {
        gain: np.abs(poles((MOTOR,), replace(LOOP, position_gain=gain), np.eye(1), X)).max()
        for gain in (44.67, 124.67)
    }
    for tangent in DIRECTIONS:
        found = np.abs(poles((MOTOR,) * 6, loop, AT[0], tangent)).max()
        assert_allclose(found, max(alone.values()), rtol=1e-6)
    largest = largest_stable_coupling((MOTOR,) * 6, loop, AT)
    assert_allclose(largest, largest_stable_position_gain(MOTOR, LOOP) - 44.67, rtol=1e-4)


def test_the_largest_coupling_holds_wherever_the_velocity_gain_may_be():
    """Stiffer velocity loops, or softer ones, bear less across the path."""
    for ratio, law in ((2.5, GainLaw.EFFECTIVE_INERTIA), (2.5, GainLaw.LITERAL), (0.5, GainLaw.FIXED)):
        loop = replace(compensated(ratio, law), cross_coupling=CrossCoupling(10.0))
        each = [
            largest_stable_coupling((turning(0.8), LAG, MOTOR), at_ratio(loop, held), np.eye(3)[None])
            for held in {GainLaw.LITERAL: (0.1, 1.0, 2.5), GainLaw.FIXED: (0.5,)}.get(law, (1.0, 2.5))
        ]
        found = largest_stable_coupling((turning(0.8), LAG, MOTOR), loop, np.eye(3)[None])
        assert found == min(each)
        edge = replace(loop, cross_coupling=CrossCoupling(1.001 * found))
        machine = (turning(0.8), LAG, MOTOR)
        assert "across the path" in str(refused(machine, edge))
        assert_allclose(limit(refused(machine, edge)), found, rtol=5e-4)
        check_stability(axes(*machine), replace(edge, cross_coupling=CrossCoupling(0.999 * found)))


def test_mixed_drives_of_a_parallel_kinematics_are_refused_by_pose():
    kinds = (MOTOR, LAG, turning(0.6), LAG, turning(2.0), LAG)
    poses = CUBIC.inverse_jacobian(np.array([[0.0] * 6, [50.0, -40.0, 30.0, 0.1, 0.2, 0.0]]))
    loop = replace(LOOP, cross_coupling=CrossCoupling(10.0))
    largest = largest_stable_coupling(kinds, loop, poses)
    check_poses(kinds, replace(loop, cross_coupling=CrossCoupling(0.99 * largest)), poses)
    beyond = replace(loop, cross_coupling=CrossCoupling(1.01 * largest))
    with pytest.raises(InfeasibleError, match="across the path"):
        check_poses(kinds, beyond, poses)
    with pytest.raises(InfeasibleError, match=r"joint q3 is unstable at .* times its velocity gain"):
        check_along((*kinds[:2], turning(0.35), *kinds[3:]), compensated(2.5), poses, DIRECTIONS[:2])
    radius = np.abs(poles(kinds, beyond, poses[0], DIRECTIONS[0])).max()
    assert radius > 0.99


def test_what_a_gain_may_grow_by_is_found_without_poles_too(monkeypatch):
    """Poles and frequency response agree; the latter decides where delays are long."""
    kinds = (turning(0.8), LAG, MOTOR)
    loop = replace(observed(LOOP, 150.0), delay_samples=1, cross_coupling=CrossCoupling(10.0, integral=50.0))
    by_poles = largest_stable_coupling(kinds, loop, np.eye(3)[None])
    gain_by_poles = largest_stable_position_gain(MOTOR, loop)
    monkeypatch.setattr(gain_limits, "MOST_STATES", 0)
    assert_allclose(largest_stable_coupling(kinds, loop, np.eye(3)[None]), by_poles, rtol=3e-5)
    assert_allclose(largest_stable_position_gain(MOTOR, loop), gain_by_poles, rtol=3e-5)


def test_a_very_long_delay_leaves_a_gain_in_closed_form():
    """The motor is an integrator to it: the delay d T leaves pi/2 / (d T + T/2), but for the velocity loop."""
    loop = replace(LOOP, position_gain=1.0, delay_samples=500)
    found = largest_stable_position_gain(MOTOR, loop)
    assert_allclose(found, 0.5 * np.pi / (500 * T + 0.5 * T), rtol=2e-3)
    assert_allclose(limit(refused((MOTOR,), replace(loop, position_gain=4.0))), found, rtol=1e-3)


def test_no_position_gain_holds_a_velocity_loop_that_does_not_settle():
    assert largest_stable_position_gain(turning(0.35), compensated(2.5)) == 0.0
    fast = VelocityLoop(400.0, 0.01, 1e-6)  # grows beyond all numbers within one sample
    wild = turning(1e-6, current_time_constant=0.0, velocity_loop=fast)
    assert largest_stable_position_gain(wild, LOOP) == 0.0
    assert "velocity loop" in str(refused((wild,), LOOP))
    assert largest_stable_position_gain(IdealDrive(), LOOP) == np.inf


# --- check and the rest ---------------------------------------------------------------------------

VELOCITY_LOOP = (
    "velocity_loop_gain_margin_db",
    "velocity_loop_phase_margin_deg",
    "velocity_loop_max_sensitivity",
)


def test_check_tells_the_worst_velocity_loop():
    machine = Machine("m", tuple(axes(MOTOR, turning(0.8), LAG)))
    told = check_loop(Setup(machine, control=compensated(2.5)))
    worst = servo_margins(turning(0.8), LOOP, 2.5)
    assert_allclose(told["velocity_loop_gain_margin_db"], 20.0 * np.log10(worst.gain))
    assert_allclose(told["velocity_loop_phase_margin_deg"], worst.phase / DEGREE)
    assert_allclose(told["velocity_loop_max_sensitivity"], worst.sensitivity)
    plain = check_loop(Setup(Machine("m", tuple(axes(MOTOR))), control=LOOP))
    assert_allclose(plain["velocity_loop_max_sensitivity"], 1.32, atol=0.005)


@pytest.mark.parametrize(("law", "softest"), [(GainLaw.LITERAL, 0.1), (GainLaw.EFFECTIVE_INERTIA, 1.0)])
def test_check_tells_the_worst_outer_loop_wherever_the_velocity_gain_may_be(law, softest):
    """A soft velocity loop bears a position loop least."""
    drives = (MOTOR, turning(1.5), LAG)
    loop = replace(compensated(2.5, law), position_gain=20.0)
    told = check_loop(Setup(Machine("m", tuple(axes(*drives))), control=loop))
    softly, stiffly = (
        worst_margins(drives, at_ratio(loop, ratio), np.eye(3), DIRECTIONS) for ratio in (softest, 2.5)
    )
    assert softly.gain < stiffly.gain
    assert told["gain_margin"] == softly.gain
    assert told["max_sensitivity"] == softly.sensitivity


def test_check_has_nothing_to_tell_without_servo_motors():
    told = check_loop(Setup(Machine("m", tuple(axes(LAG))), control=compensated(2.5)))
    assert [told[name] for name in VELOCITY_LOOP] == [None] * 3
    assert told["gain_margin"] is not None


def test_check_refuses_what_runs_beside_the_kinematics():
    beside = Machine("m", (*axes(), Axis("u", LIMITS, turning(0.35))), (LAG,) * 6)
    with pytest.raises(InfeasibleError, match="the velocity loop of joint u is unstable"):
        check_loop(Setup(beside, control=compensated(2.5), kinematics=CUBIC))


def test_a_servo_motor_takes_the_time_of_its_position_loop_to_settle():
    assert settling_time(joints_of(Machine("m", tuple(axes(MOTOR, IdealDrive())))), LOOP) == 1.0 / 44.67
    slow = replace(LOOP, joint_gains=(44.67, 0.1))
    assert settling_time(joints_of(Machine("m", tuple(axes(IdealDrive(), MOTOR)))), slow) == SLOWEST_LOOP
    assert settling_time(joints_of(Machine("m", tuple(axes(IdealDrive())))), LOOP) == 0.0
