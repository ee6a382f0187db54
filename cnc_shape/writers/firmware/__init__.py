"""Shapers as texts for the controllers that run them. `EMITTERS` is the registration: a target, a function.

A target takes what its controller takes: by name from frequency and damping, or impulse by impulse. What it
cannot carry is refused with the nearest that it can; what it rounds or computes in its own way is said in a
comment, with the vibration that is left then.
"""

from collections.abc import Mapping, Sequence
from enum import Enum

from cnc_shape.writers.firmware.c_source import DEFAULT_SAMPLE_TIME, c_source
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
    C = "c"
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


def emit(target: Target, designs: Sequence[Handover], sample_time: float = DEFAULT_SAMPLE_TIME) -> str:
    """Write shapers for a target; `sample_time`, s, is that of the taps of a C header.

    Raises
    ------
    OptionError, InfeasibleError
        What the target cannot carry.
    """
    return c_source(designs, sample_time) if target is Target.C else EMITTERS[target](designs)


__all__ = ["DEFAULT_SAMPLE_TIME", "EMITTERS", "Handover", "Target", "emit"]
