"""Cascade: one single-mode shaper per mode, convolved."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from cnc_shape.errors import OptionError
from cnc_shape.modes import Mode
from cnc_shape.shapers.shaper import Shaper, convolve
from cnc_shape.shapers.zero_vibration import zv


def cascade(modes: Sequence[Mode], of: Callable[[Mode], Shaper] = zv) -> Shaper:
    """Cancel every mode by a shaper of its own; the durations add up.

    Raises
    ------
    OptionError
        No mode.
    """
    if not modes:
        raise OptionError("a cascade needs a mode at least", hint="give the frequency of each mode")
    return convolve([of(mode) for mode in modes])
