"""Shapers as texts for the controllers that run them. `EMITTERS` is the registration: a target, a function.

A target takes what its controller takes: by name from frequency and damping, or impulse by impulse. What it
cannot carry is refused with the nearest that it can; what it rounds or computes in its own way is said in a
comment, with the vibration that is left then.
"""

from collections.abc import Mapping
from enum import Enum

from cnc_shape.writers.firmware.duet import rrf, rrf_3_4
from cnc_shape.writers.firmware.handover import Emit, Handover
from cnc_shape.writers.firmware.klipper import klipper, klipper_custom
from cnc_shape.writers.firmware.machine_file import yaml
from cnc_shape.writers.firmware.marlin import marlin, marlin_ft


class Target(Enum):
    """What a shaper can be handed to."""

    RRF = "rrf"
    RRF_3_4 = "rrf-3.4"
    KLIPPER = "klipper"
    KLIPPER_CUSTOM = "klipper-custom"
    MARLIN = "marlin"
    MARLIN_FT = "marlin-ft"
    YAML = "yaml"
    JSON = "json"  # the result of the design itself


EMITTERS: Mapping[Target, Emit] = {
    Target.RRF: rrf,
    Target.RRF_3_4: rrf_3_4,
    Target.KLIPPER: klipper,
    Target.KLIPPER_CUSTOM: klipper_custom,
    Target.MARLIN: marlin,
    Target.MARLIN_FT: marlin_ft,
    Target.YAML: yaml,
}

__all__ = ["EMITTERS", "Emit", "Handover", "Target"]
