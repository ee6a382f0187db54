"""A C header for one's own controller or DSP: impulses, and the taps of a filter at its sample rate."""

from __future__ import annotations

from collections.abc import Sequence

from cnc_shape.errors import InfeasibleError
from cnc_shape.modes import Mode
from cnc_shape.shapers import Shaper
from cnc_shape.shapers.discretisation import Interpolation
from cnc_shape.shapers.live import Filters, filters
from cnc_shape.writers.c_header import c_header
from cnc_shape.writers.firmware.handover import Handover

DEFAULT_SAMPLE_TIME = 1e-3  # s
ONLY = "x"  # stands for every axis where a shaper is of none in particular


def c_source(designs: Sequence[Handover], sample_time: float = DEFAULT_SAMPLE_TIME) -> str:
    """The C header of shapers at one sample time; the taps of all axes are late alike.

    The taps leave no vibration at the modes where the grid allows that, else they interpolate linearly.

    Raises
    ------
    OptionError
        A sample time that is not positive, or longer than half a shaper.
    """
    shapers = {design.axis or ONLY: design.shaper for design in designs}
    modes = {design.axis or ONLY: design.modes for design in designs}
    known = all(modes.values())
    try:
        on_grid = _filters(
            shapers, sample_time, Interpolation.EXACT if known else Interpolation.LINEAR, modes
        )
    except InfeasibleError:
        on_grid = _filters(shapers, sample_time, Interpolation.LINEAR, modes)
    taps = dict(zip(on_grid.axes, on_grid.taps, strict=True))
    return c_header(
        {design.axis: design.shaper for design in designs},
        {design.axis: taps[design.axis or ONLY] for design in designs},
        {design.axis: design.modes for design in designs},
    )


def _filters(
    shapers: dict[str, Shaper], sample_time: float, way: Interpolation, modes: dict[str, tuple[Mode, ...]]
) -> Filters:
    return filters(shapers, tuple(shapers), sample_time, way, modes)
