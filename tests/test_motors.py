"""Motors: peaks, means and shares are their definitions, however the signals were cut."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from cnc_shape.arrays import frozen
from cnc_shape.joints import joints_of
from cnc_shape.kinematics import Kinematics, corexy, trunnion_ac
from cnc_shape.limits import Limits
from cnc_shape.machine import Axis, FirstOrderLag, Machine, ServoMotor
from cnc_shape.motors import duties, servo_motors, tally_duty
from cnc_shape.response import MotorSignals

LIMITS = np.array([2.0, 1.5])
COUNT = 1000


def signals(seed: int = 0) -> MotorSignals:
    draw = np.random.default_rng(seed)
    torque = np.clip(draw.normal(size=(COUNT, 2)), -LIMITS, LIMITS)
    rest = [draw.normal(size=(COUNT, 2)) for _ in range(6)]
    return MotorSignals(("x", "q2"), frozen(torque), *(frozen(values) for values in rest))


def part(whole: MotorSignals, low: int, high: int) -> MotorSignals:
    names = MotorSignals.__slots__[1:]
    return MotorSignals(whole.joints, *(frozen(getattr(whole, name)[low:high]) for name in names))


WHOLE = signals()


def test_every_number_is_its_definition():
    for k, duty in enumerate(duties(tally_duty(None, WHOLE, LIMITS))):
        torque = WHOLE.torque[:, k]
        assert duty.joint == WHOLE.joints[k]
        assert duty.peak_torque == np.abs(torque).max() == LIMITS[k]
        assert duty.rms_torque == pytest.approx(np.sqrt(np.mean(torque**2)), rel=1e-14)
        assert duty.peak_load == np.abs(WHOLE.load[:, k]).max()
        assert duty.peak_gain_ratio == WHOLE.gain_ratio[:, k].max()
        assert duty.saturated_share == np.mean(np.abs(torque) == LIMITS[k]) > 0.01
        assert duty.identified_inertia == WHOLE.inertia[-1, k]


@pytest.mark.parametrize("chunk", [1, 7, 999])
def test_a_duty_does_not_depend_on_chunks(chunk):
    state = tally_duty(None, part(WHOLE, 0, 0), LIMITS)
    for low in range(0, COUNT, chunk):
        state = tally_duty(state, part(WHOLE, low, low + chunk), LIMITS)
        state = tally_duty(state, part(WHOLE, 0, 0), LIMITS)
    assert duties(state) == duties(tally_duty(None, WHOLE, LIMITS))


def test_a_torque_just_below_its_limit_is_not_saturated():
    torque = frozen(np.nextafter([[2.0, -1.5]], 0.0))
    below = MotorSignals(WHOLE.joints, torque, *[frozen(np.ones((1, 2)))] * 6)
    assert [duty.saturated_share for duty in duties(tally_duty(None, below, LIMITS))] == [0.0, 0.0]


def test_only_joints_with_a_servo_motor_are_motors():
    limits = Limits(100.0, 1000.0)
    motor = ServoMotor(4.6e-4, 7.1, 10.0)
    axes = (Axis("x", limits, FirstOrderLag(0.01)), Axis("y", limits, motor), Axis("z", limits))
    assert servo_motors(joints_of(Machine("mixed", axes))) == {"y": motor}
    assert_array_equal(servo_motors(joints_of(Machine("none", axes[:1]))), {})


def geared(kinematics: Kinematics, names: str, lead: float, gear: float) -> Machine:
    """A machine whose motors turn screws of `lead` mm, and gears of `gear` rad, a revolution."""
    limits, screw, turn = Limits(100.0, 1000.0), ServoMotor(4.6e-4, 7.1, lead), ServoMotor(4.6e-4, 7.1, gear)
    axes = tuple(Axis(name, limits, turn) if name == "c" else Axis(name, limits) for name in names)
    rotary = {"a", "c"}
    drives = tuple(turn if name in rotary else screw for name in kinematics.joints)
    return Machine("geared", axes, joints=drives)


def test_a_load_along_an_axis_with_a_motor_of_its_own_is_that_of_the_motor():
    joints = joints_of(geared(corexy(), "xyzc", 40.0, 0.06), corexy())
    held = joints.torques(np.zeros((1, 4)), np.array([[[0.0, 0.0, 0.0, 2.0]]]))
    assert_allclose(held[0, 0], [0.0, 0.0, 0.0, 2.0], atol=1e-15)


def test_a_load_that_turns_a_table_is_that_of_its_motor_and_does_the_same_work():
    kinematics, lead, gear = trunnion_ac(np.array([0.0, 0.0, -50.0])), 10.0, 0.06
    joints = joints_of(geared(kinematics, "xyzac", lead, gear), kinematics)
    pose = np.array([[10.0, 20.0, 5.0, 0.3, -0.7]])
    held = joints.torques(pose, np.array([[[0.0, 0.0, 0.0, 2.0, 0.0]]]))[0, 0]
    assert_allclose(held, [0.0, 0.0, 0.0, 2.0, 0.0], atol=1e-12)
    load, rates = np.array([0.3, -0.2, 0.5, 0.1, -0.4]), np.array([[3.0, -1.0, 2.0, 0.1, 0.2]])
    per_turn = np.array([lead, lead, lead, gear, gear])
    torque = joints.torques(pose, load[None, None])[0, 0]
    assert_allclose(torque / per_turn @ joints.rates(pose, rates)[0], load / per_turn @ rates[0], rtol=1e-12)
