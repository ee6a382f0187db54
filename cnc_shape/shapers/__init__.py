"""Input shapers. `SHAPERS` is the registration: one name, one function.

A single-mode shaper is a function of one `Mode`, a multi-mode shaper of several; `impulses` takes
what the user measured or was given.
"""

from collections.abc import Callable, Mapping

from cnc_shape.modes import Mode
from cnc_shape.shapers.cascade import cascade
from cnc_shape.shapers.extra_insensitive import ei, three_hump_ei, two_hump_ei
from cnc_shape.shapers.firmware import (
    duet_ei2,
    duet_ei3,
    fitted_ei,
    klipper_2hump_ei,
    klipper_3hump_ei,
    klipper_ei,
)
from cnc_shape.shapers.modified_zero_vibration import mzv
from cnc_shape.shapers.multi_mode import multi_mode
from cnc_shape.shapers.optimal import optimal
from cnc_shape.shapers.shaper import NONE, Shaper, make_shaper
from cnc_shape.shapers.specified_duration import Robustness, sd
from cnc_shape.shapers.unity_magnitude import umzv
from cnc_shape.shapers.virtual_mode import virtual_mode
from cnc_shape.shapers.zero_vibration import zv, zvd, zvdd, zvddd

# shapers of a mode without further choice: what a cascade can be made of
PLAIN: Mapping[str, Callable[[Mode], Shaper]] = {
    "zv": zv,
    "zvd": zvd,
    "zvdd": zvdd,
    "zvddd": zvddd,
    "umzv": umzv,
    "mzv": mzv,
    "ei": ei,
    "2hump_ei": two_hump_ei,
    "3hump_ei": three_hump_ei,
    "klipper_ei": klipper_ei,
    "klipper_2hump_ei": klipper_2hump_ei,
    "klipper_3hump_ei": klipper_3hump_ei,
    "fitted_ei": fitted_ei,
    "duet_ei2": duet_ei2,
    "duet_ei3": duet_ei3,
}
SINGLE_MODE: Mapping[str, Callable[..., Shaper]] = {**PLAIN, "virtual_mode": virtual_mode, "sd": sd}
MULTI_MODE: Mapping[str, Callable[..., Shaper]] = {
    "cascade": cascade,
    "multi_mode": multi_mode,
    "optimal": optimal,
}
SHAPERS: Mapping[str, Callable[..., Shaper]] = {**SINGLE_MODE, **MULTI_MODE, "impulses": make_shaper}

__all__ = [
    "MULTI_MODE",
    "NONE",
    "PLAIN",
    "SHAPERS",
    "SINGLE_MODE",
    "Robustness",
    "Shaper",
    "cascade",
    "duet_ei2",
    "duet_ei3",
    "ei",
    "fitted_ei",
    "klipper_2hump_ei",
    "klipper_3hump_ei",
    "klipper_ei",
    "make_shaper",
    "multi_mode",
    "mzv",
    "optimal",
    "sd",
    "three_hump_ei",
    "two_hump_ei",
    "umzv",
    "virtual_mode",
    "zv",
    "zvd",
    "zvdd",
    "zvddd",
]
