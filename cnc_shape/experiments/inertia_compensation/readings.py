"""What the paper's equations say, what they can mean, and the numbers behind that."""

from __future__ import annotations

from typing import Final

import numpy as np

from cnc_shape.arrays import FloatArray
from cnc_shape.experiments.experiment import Row, Table
from cnc_shape.experiments.inertia_compensation.loads import PEAK
from cnc_shape.experiments.inertia_compensation.methods import AS_PRINTED, NONE, PAPER, STIFF
from cnc_shape.experiments.inertia_compensation.rig import (
    INERTIA,
    LOADED,
    MOTOR,
    SHOWN,
    UNLOADED,
    errors,
    lap,
    ripple,
)
from cnc_shape.units import MICROMETRE, MILLISECOND

TORQUE_CONSTANT, RESISTANCE = 0.641, 0.454  # N m/A, ohm of a phase, of a 750 W motor
SLOPE: Final = 3.0 * RESISTANCE / TORQUE_CONSTANT**2  # rad/s per N m, the paper's alpha
SEEN: Final = 0.5  # N m of observed torque from which on the agreement is looked at


def readings_table() -> Table:
    """Eqs (1)-(17): contradictions, and what they cost where they are taken at their word."""
    motors = lap(LOADED, PAPER).motors
    agreed = motors.agreement[np.abs(motors.estimate) > SEEN]
    printed = {name: errors(LOADED, control) for name, control in AS_PRINTED.items()}
    return Table(
        "Eqs 1 to 17: what they say, and how they are read",
        (
            Row("eq 4: observer of the sign printed there, fed forward: RMS", "µm", None,
                printed["sign of eq 4"][0], SHOWN,
                f"largest {printed['sign of eq 4'][1]:.1f} µm: the torque is seen with the wrong sign, "
                "and fed forward it doubles the error; eq 1 has it right, the load opposes the motor"),
            Row("eq 7: load torque over acceleration", "kg m²", None, _over_acceleration(), SHOWN,
                f"{_over_acceleration() / INERTIA:.0f} times the inertia there is: at 1 m/min the motors "
                f"accelerate at {_centripetal():.1f} rad/s², which takes "
                f"{1e3 * INERTIA * _centripetal():.1f} mN m against 2.5 N m of load. ∫T dt / a has the unit "
                "of an inertia times a second; it is ∫T dt / ∫a dt"),
            Row("eq 9: displacement by α ∫T dt, largest of an axis", "µm", None, _open_loop(), 0.5,
                f"with α = {SLOPE:.2f} rad/s per N m; the axes are displaced by {_displaced():.1f} µm at "
                "most: eq 8 leaves out the loops. It is read as what the closed loop yields to the "
                "torque"),
            Row("eq 14: -A where the load is felt, mean", "-", None, float(agreed.mean()), SHOWN,
                f"standard deviation {agreed.std():.2f}, by exponential least squares. As printed S has no "
                "least value, and A = -1 solves eqs 11 to 13 identically; so A tests the model, and is 1 but "
                "for its sign: setting it so changes nothing"),
            Row("eqs 15, 16: α J", "ms", None, SLOPE * INERTIA / MILLISECOND, SHOWN,
                f"said to be about 2/Kv, which is {2e3 / MOTOR.velocity_loop.bandwidth:.1f} ms"),
            Row("eq 17 as printed, Kv = α A J / 2: RMS", "µm", None, printed["eq 17 as printed"][0], SHOWN,
                f"largest {printed['eq 17 as printed'][1]:.1f} µm, the gain kept above a tenth; it is a "
                "time, not 1/s, and of the wrong size"),
            Row("eqs 15 and 16, Kv = 2 / (α A J): RMS", "µm", None, printed["eqs 15 and 16"][0], SHOWN,
                f"largest {printed['eqs 15 and 16'][1]:.1f} µm; the gain falls as the load rises, and is "
                "at its ceiling of 2.5 without one"),
            Row("read as a ratio, κ = 1 + A Ĵ / J: RMS", "µm", None, errors(LOADED, PAPER)[0], SHOWN,
                "eq 17 without units: the torque gain rises with the effective inertia, and is 1 "
                "without load"),
            Row("torque ripple without load, constant gain over none", "-", None, _ripple(), SHOWN,
                "standard deviation of its change per ms: what a gain that follows the load saves"),
        ),
        "The equations contradict one another in signs, units and inverses. Read so that all fit, they "
        "say: torque over acceleration is an inertia Ĵ = max(|∫T dt| - 0.12 N m, 0) / (|∫a dt| + 261 "
        "rad/s²) in leaky windows of 20 ms, and the velocity gain is J ωv κ, κ = 1 + clip(-A, 0, 1) Ĵ / "
        "J up to 2.5, up within 10 ms and back within 1 s. What is compensated is not inertia: a normal "
        "torque that is constant is proportional to acceleration, so it looks like one. The loop is made "
        "stiffer while a load is felt. A load with a low-frequency compliance of s Ti / (K Kp) yields to "
        "the change of torque, so a constant torque is seen only as it turns with the path.",
    )  # fmt: skip


def _centripetal() -> float:
    """Acceleration of the motors on the circle, rad/s^2."""
    circle = LOADED.circle
    return circle.feed_rate**2 / circle.radius / MOTOR.pitch


def _over_acceleration() -> float:
    """Largest load over the acceleration of the motors, kg m^2."""
    return PEAK / _centripetal()


def _open_loop() -> float:
    """Largest displacement that eq 9 makes of the loads, µm."""
    turned = SLOPE * np.cumsum(lap(LOADED, NONE).motors.load, axis=0) * LOADED.circle.sample_time
    return float(np.abs(turned).max()) * MOTOR.pitch / MICROMETRE


def _displaced() -> float:
    """Largest displacement of an axis that the loads make, µm."""
    under: FloatArray = lap(LOADED, NONE).response.position - lap(UNLOADED, NONE).response.position
    return float(np.abs(under).max()) / MICROMETRE


def _ripple() -> float:
    """Torque ripple at a constant gain of 2.5 over that at the nominal one."""
    return ripple(lap(UNLOADED, STIFF)) / ripple(lap(UNLOADED, NONE))
