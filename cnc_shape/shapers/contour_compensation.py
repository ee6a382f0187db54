"""Contour compensation: what shaper and structure do to curves, taken back before the shaper.

On a curve the shaper pulls the command inward by half its variance times the acceleration, and the
structure pushes the tool outward by ``sum g/omega^2`` times it. To the second order in frequency the tool
is off by ``gamma a``, axis by axis, with ``gamma = variance/2 - sum_k g_k/omega_k^2``. Its part normal to
the motion is what leaves the path; that part, smoothed, is subtracted. What the shaper cancels stays
cancelled, because all this happens before it.

::

    a(t) --> o = (I - t t^T)(gamma o a) --> triangle of half width h --+
                                                                       v
    r(t) ------------------------------------------------ late by h -> r - o  --> shapers
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import ceil, sqrt

import numpy as np

from cnc_shape.arrays import FloatArray, frozen
from cnc_shape.errors import InfeasibleError
from cnc_shape.kernels.offsets import normal_offsets, weighted_means
from cnc_shape.kernels.taps import delayed_sum
from cnc_shape.modes import Mode
from cnc_shape.program import ROTARY
from cnc_shape.shapers.shaper import NONE, Shaper
from cnc_shape.trajectory import Trajectory, with_past

WIDTH_FACTOR = 2.5  # -, half width of the smoothing over sqrt(|gamma|): peak acceleration grows by <= 20 %
MOST_TAPS = 200_000  # samples of a smoothing window
GRID_TOLERANCE = 1e-9  # -, of a sample

Step = Callable[[Trajectory | None, Trajectory, bool], tuple[Trajectory | None, Trajectory]]


def curve_gain(shaper: Shaper, modes: Sequence[Mode]) -> float:
    """``gamma = variance/2 - sum_k g_k/omega_k^2``, s^2: offset of the tool over the command's acceleration.

    Damping enters at the third order in frequency only.
    """
    return shaper.variance / 2.0 - sum(mode.participation / mode.omega**2 for mode in modes)


def curve_gains(
    shapers: Mapping[str, Shaper], modes: Mapping[str, Sequence[Mode]], axes: Sequence[str]
) -> dict[str, float]:
    """`curve_gain` of every linear axis; rotary axes have no path to leave."""
    return {
        axis: curve_gain(shapers.get(axis, NONE), modes.get(axis, ())) for axis in axes if axis not in ROTARY
    }


def half_width(gains: Mapping[str, float]) -> float:
    """Half width h of the smoothing, s: ``2.5 sqrt(max |gamma|)``, 0 where nothing is off."""
    return WIDTH_FACTOR * sqrt(max((abs(gain) for gain in gains.values()), default=0.0))


@dataclass(frozen=True, eq=False, slots=True)
class Window:
    """The smoothing on the servo grid: what it makes of samples that are joined by straight lines."""

    weights: FloatArray  # (3,k) of the value, its derivative (1/s) and its second derivative (1/s^2)
    whole: int  # samples, how late the command is: whole - 1 < delay / sample time <= whole
    share: float  # of a sample


def triangle_window(width: float, sample_time: float) -> Window:
    """Return the window of a triangle of half width `width` s, late by it.

    The triangle is two boxcars of length `width`, one after the other. The second differences of the cubic
    ``x^3/6`` over h and over the sample are the integral of the triangle times the straight lines.

    Raises
    ------
    InfeasibleError
        More than `MOST_TAPS` samples long.
    """
    samples = width / sample_time
    if 2.0 * samples > MOST_TAPS:
        raise InfeasibleError(
            f"contour shaping would look ahead {width:g} s, {2 * samples:.0f} samples",
            hint="use shaping: axis for modes as slow as that, or a longer sample_time_s",
        )
    h = samples
    offset = np.arange(ceil(2.0 * h - GRID_TOLERANCE) + 2, dtype=np.float64) - h  # centre minus sample
    second = ((-1.0, 1.0), (0.0, -2.0), (1.0, 1.0))
    weights = np.zeros((3, offset.size))
    for i, over_width in second:
        for j, over_sample in second:
            x = np.maximum(offset + i * h + j, 0.0)
            scale = over_width * over_sample / h**2
            weights[0] += scale * x**3 / 6.0
            weights[1] += scale * x**2 / 2.0
            weights[2] += scale * x
    weights[0] /= weights[0].sum()
    weights[1] /= sample_time
    weights[2] /= sample_time**2
    nearest = round(samples)
    if abs(samples - nearest) <= GRID_TOLERANCE:
        return Window(frozen(weights), nearest, 0.0)
    return Window(frozen(weights), int(samples), samples - int(samples))


def compensating(gains: Mapping[str, float], sample_time: float) -> Step:
    """Return the resumable stage that takes back what shapers and structure do to curves.

    Parameters
    ----------
    gains
        `curve_gains`: gamma of the linear axes, s^2.
    sample_time
        s.

    Returns
    -------
    step
        ``step(history, chunk, last) -> (history, chunk)``. The command comes out late by the half width,
        and lasts two of them longer; it starts and ends where it did.

    Raises
    ------
    InfeasibleError
        A window too long for its sample time.
    """
    width = half_width(gains)
    window = triangle_window(width, sample_time)
    taps = window.weights.shape[1]
    kept = max(taps, window.whole + 2)

    def step(
        history: Trajectory | None, command: Trajectory, last: bool
    ) -> tuple[Trajectory | None, Trajectory]:
        if history is None and len(command) == 0:
            return None, command
        after = ceil(2.0 * width / sample_time - GRID_TOLERANCE) if last else 0
        whole, first = with_past(history, command, kept, after)
        count = len(whole) - first
        gain = frozen([gains.get(axis, 0.0) for axis in whole.axes])
        offset = normal_offsets(whole.velocity, whole.acceleration, gain)
        away = weighted_means(frozen(offset), first, count, window.weights)
        axes = len(whole.axes)
        late = delayed_sum(
            whole.position, whole.velocity, whole.acceleration, first, count,
            np.full((axes, 1), window.whole), np.full((axes, 1), window.share), np.ones((axes, 1)),
            np.ones(axes, dtype=np.int64), sample_time,
        )  # fmt: skip
        place = whole.late_arc_length(first, width / sample_time)
        signals = (frozen(plain - curved) for plain, curved in zip(late, away, strict=True))
        return whole.cut(slice(len(whole) - kept, None)), Trajectory(
            whole.axes, sample_time, frozen(place), *signals, rounded=whole.rounded
        )

    return step


def compensate(command: Trajectory, gains: Mapping[str, float]) -> Trajectory:
    """Compensate a whole motion; late by the half width, two of them longer."""
    return compensating(gains, command.sample_time)(None, command, True)[1]
