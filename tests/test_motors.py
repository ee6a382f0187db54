"""Motors: peaks, means and shares are their definitions, however the signals were cut."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from cnc_shape.arrays import frozen
from cnc_shape.joints import joints_of
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
