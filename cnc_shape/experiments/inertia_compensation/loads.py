"""The loads of the experiment: what a second motor on every axis pulls with, along the path's normal.

The paper says that the load motors drive along the normal of the motion with up to 2.5 N m, and shows the
observed torque as a curve without numbers. Kept are the two families of profiles that can explain both
disturbed numbers within 2.5 N m; what is fitted in them is said in `tables`.
"""

from __future__ import annotations

from typing import Final

from cnc_shape.disturbances import (
    Disturbances,
    LoadTorque,
    PathDirection,
    Profile,
    Pulses,
    SineBurst,
)

PEAK: Final = 2.5  # N m, of the vector over the axes
BURST: Final = SineBurst(frequency=0.514, length=6.91, centre=9.4)  # frequency and length are fitted
PULSES: Final = Pulses(start=1.5, rise=0.459, hold=1.0, gap=1.5, peaks=(1.0, 0.958, 0.958))


def load(
    profile: Profile = BURST, peak: float = PEAK, direction: PathDirection = PathDirection.NORMAL
) -> Disturbances:
    """A load along a direction of the path; along the normal a positive one pulls towards the centre."""
    return Disturbances((LoadTorque(direction, peak, profile),))


BURST_LOAD: Final = load()
PULSE_LOAD: Final = load(PULSES)
