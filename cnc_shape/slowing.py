"""Slowing down where the tool would leave its tolerance, and nowhere else.

The motion is planned, shaped and simulated, nominal and with the structure off as far as the machine file
says; wherever the tool is too far from the path, the cells that were passed just before are planned more
gently, and all is done again. What is promised is what the last simulation showed, for the models it was
shown for.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import ceil, inf

import numpy as np

from cnc_shape.arrays import FloatArray, frozen
from cnc_shape.config.setup import Setup
from cnc_shape.errors import OptionError
from cnc_shape.motion import Block
from cnc_shape.opening import open_motion, path_places
from cnc_shape.readers import ReadingOptions
from cnc_shape.readers.source import STANDARD_INPUT
from cnc_shape.shapers.command_shaping import CommandShaping
from cnc_shape.timing import Slowdown, Timing
from cnc_shape.trade import Model, ModelTrial, models

PASSES = 15  # at most
AIM = 0.97  # -, of the tolerance: what a pass aims at
GENTLEST = 0.6  # -, smallest factor in one pass
PERIODS_BEFORE, PERIODS_AFTER = 0.75, 0.25  # of the slowest mode: when what is seen was caused
PROGRESS = 0.99  # -, of the least excess so far: a pass that does not come below it has not helped
PATIENCE = 4  # passes in a row that may not help


@dataclass(frozen=True, slots=True)
class Slowed:
    """How much gentler a motion has to be, and what was shown for it."""

    slowdown: Slowdown | None  # None: nothing had to be slowed down
    tolerance: float  # mm
    reached: float  # mm, largest contour error of the tool in the last simulation
    passes: int  # simulations
    models: tuple[Model, ...]  # that it was shown for
    unhurried: float  # s, cycle time of the motion at its limits
    cycle_time: float  # s, of the slowed one

    @property
    def met(self) -> bool:
        """Whether the tool keeps its tolerance."""
        return self.reached <= self.tolerance

    def summary(self) -> str:
        """One sentence for the user."""
        shown = (
            "nominal" if len(self.models) == 1 else f"nominal and {len(self.models) - 1} models that are off"
        )
        price = f"{self.cycle_time:.3f} s instead of {self.unhurried:.3f} s"
        if self.met:
            return (
                f"the tool keeps {1e3 * self.tolerance:g} µm: {1e3 * self.reached:.3g} µm in the last of "
                f"{self.passes} simulations ({shown}); {price}"
            )
        return (
            f"the tool does not keep {1e3 * self.tolerance:g} µm: {1e3 * self.reached:.3g} µm is the least "
            f"in {self.passes} simulations ({shown}); {price}"
        )


def slow_down(path: str, setup: Setup, options: ReadingOptions, tolerance: float) -> Slowed:
    """Find how gently each cell of a program has to be run through so that the tool keeps `tolerance` mm.

    Parameters
    ----------
    path
        A program or a table of way-points, read once a pass.
    setup
        The machine; `planning.shaping` shapes the motion.
    options
        How to read the file.
    tolerance
        Largest contour error of the tool, mm.

    Raises
    ------
    OptionError
        Standard input, which cannot be read again; a time trajectory, which is not planned.
    """
    if path == STANDARD_INPUT:
        raise OptionError(
            "tool_tolerance_mm needs the program more than once, and standard input is gone after the first",
            hint="write the program to a file",
        )
    start = path_places(path, setup, options)
    if start is None:
        raise OptionError(
            f"{path} tells its own times: there is nothing to slow down",
            hint="leave tool_tolerance_mm out, or give way-points without time_s",
        )
    kind, structures = setup.planning.shaping, models(setup.machine)
    shaping, timing = setup.command_shaping(kind), setup.timing(kind)
    factor = np.ones(start.size)
    best: tuple[float, FloatArray, float] | None = None
    unhurried, idle, passes, least = 0.0, 0, 0, inf
    while passes < PASSES and idle < PATIENCE:
        slowed = replace(timing, slowdown=Slowdown(frozen(factor)) if passes else None)
        trace = _Trace(setup, shaping, slowed, structures)
        with open_motion(path, setup, options, [slowed]) as motion:
            for block in motion.blocks:
                trace.advance(block)
        passes += 1
        unhurried = trace.cycle_time if passes == 1 else unhurried
        error = trace.error()
        reached = float(error.max(initial=0.0))
        excess = float(np.maximum(error - tolerance, 0.0).sum())
        idle = idle + 1 if excess > PROGRESS * least else 0
        least = min(least, excess)
        if best is None or reached < best[0]:
            best = (reached, factor, trace.cycle_time)
        if reached <= tolerance:
            break
        factor = factor * _gentler(trace, error, start, tolerance, setup, shaping)
    assert best is not None
    reached, factor, cycle_time = best
    slowdown = None if (factor == 1.0).all() else Slowdown(frozen(factor))
    return Slowed(slowdown, tolerance, reached, passes, structures, unhurried, cycle_time)


class _Trace:
    """One pass: where the command was, and how far the tool was off, sample by sample."""

    def __init__(
        self, setup: Setup, shaping: CommandShaping, timing: Timing, structures: tuple[Model, ...]
    ) -> None:
        self._errors: list[FloatArray] = []
        self._places: list[FloatArray] = []
        self._trial = ModelTrial(setup, shaping, timing, structures, self._errors.append)
        self.axes: tuple[str, ...] = ()
        self.cycle_time = 0.0

    def advance(self, block: Block) -> None:
        self.axes, self.cycle_time = block.command.axes, block.cycle_time
        self._places.append(block.command.arc_length)
        self._trial.advance(block)

    def place(self) -> FloatArray:
        """Place of the command on the toolpath before shaping, (n,) mm."""
        return np.concatenate(self._places)

    def error(self) -> FloatArray:
        """Largest contour error of the tool in any model at each sample of the shaped command, (m,) mm."""
        return np.concatenate(self._errors)


def _gentler(
    trace: _Trace,
    error: FloatArray,
    start: FloatArray,
    tolerance: float,
    setup: Setup,
    shaping: CommandShaping,
) -> FloatArray:
    """The next factor of every cell, from the errors of a pass.

    What the tool does at t was asked for between `lag` plus or minus half the shaper before, and the
    structure's own time around that.
    """
    from scipy.ndimage import minimum_filter1d  # pyright: ignore[reportUnknownVariableType]

    period = setup.control.sample_time
    slowest = max((m.longest_period for axis in setup.machine.axes for m in axis.modes), default=0.0)
    lag = 0.0 if trace.axes == () else shaping.lag(trace.axes, period)
    half = shaping.longer(trace.axes, period) / 2.0
    place = trace.place()
    wanted = np.ones(error.size)
    far = error > tolerance
    wanted[far] = np.clip(AIM * tolerance / error[far], GENTLEST, AIM)
    first, last = lag - half - PERIODS_AFTER * slowest, lag + half + PERIODS_BEFORE * slowest
    middle, reach = round((first + last) / 2.0 / period), ceil((last - first) / 2.0 / period)
    padded = np.concatenate([wanted, np.ones(place.size + middle)])
    sliding: FloatArray = minimum_filter1d(padded, 2 * reach + 1)  # pyright: ignore[reportUnknownVariableType]
    causes = sliding[middle : middle + place.size]
    low = np.maximum(np.searchsorted(place, start, side="right") - 1, 0)
    high = np.searchsorted(place, np.append(start[1:], np.inf), side="left") + 1
    ranges = np.ravel(np.column_stack([low, np.maximum(high, low + 1)]))
    worst: FloatArray = np.minimum.reduceat(np.append(causes, [1.0, 1.0]), ranges)[::2]
    return worst
