"""The figure of the shapers: their impulses, and the vibration they leave where a frequency is off."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from cnc_shape.modes import Mode
from cnc_shape.report.style import COLOURS, PATH_COLOUR, WIDTH, look, new_figure, styled
from cnc_shape.shapers import Shaper
from cnc_shape.shapers.analysis import residual_vibration
from cnc_shape.shapers.insensitivity import Insensitivity, insensitivity

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


@styled
def shaper_figure(shapers: Mapping[str, Shaper], modes: Mapping[str, Sequence[Mode]]) -> Figure:
    """Impulses of every shaped axis, and the vibration it leaves when the frequencies are off."""
    alike = _alike(shapers, modes)
    figure, axes = new_figure(WIDTH, 2.5 * len(alike), len(alike), 2)
    for row, names in enumerate(alike):
        axis, title = names[0], ", ".join(names).upper()
        shaper = shapers[axis]
        left, right = axes[2 * row], axes[2 * row + 1]
        draw_impulses(left, shaper)
        left.set_title(f"{title}: impulses")
        if modes[axis]:
            band = insensitivity(shaper, modes[axis])
            draw_sensitivity(right, shaper, modes[axis], band)
            right.set_title(f"{title}: vibration left (band: {100.0 * band.tolerance:.0f} % at most)")
    return figure


def draw_impulses(axes: Axes, shaper: Shaper) -> None:
    """Amplitudes over time."""
    axes.vlines(shaper.times * 1e3, 0.0, shaper.amplitudes, color=COLOURS[1], linewidth=1.6)
    axes.plot(shaper.times * 1e3, shaper.amplitudes, "o", color=COLOURS[1], markersize=4.0)
    axes.axhline(0.0, color=PATH_COLOUR, linewidth=0.6)
    axes.set_ylim(1.15 * min(0.0, float(shaper.amplitudes.min())), 1.15 * float(shaper.amplitudes.max()))
    axes.set_ylabel("amplitude (-)")
    axes.set_xlabel("time (ms)")


def draw_sensitivity(axes: Axes, shaper: Shaper, modes: Sequence[Mode], band: Insensitivity) -> None:
    """V of every mode over the error of its frequency, and the band in which it stays small."""
    ratio = np.linspace(0.5, 1.5, 1001)
    for k, mode in enumerate(modes):
        label = f"{mode.natural_frequency:g} Hz, ζ {mode.damping_ratio:g}"
        axes.plot(ratio, 100.0 * residual_vibration(shaper, mode, ratio), **look(k), label=label)
    high = 1.5 if band.high is None else min(band.high, 1.5)
    axes.axvspan(max(band.low, 0.5), high, color=PATH_COLOUR, alpha=0.25, linewidth=0.0)
    axes.axhline(100.0 * band.tolerance, color=PATH_COLOUR, linewidth=0.8, linestyle=(0, (4, 3)))
    axes.legend(loc="upper center", ncols=2)
    axes.set_ylabel("V (%)")
    axes.set_xlabel("actual / modelled frequency (-)")
    axes.set_ylim(0.0, 115.0)
    axes.set_yticks([0.0, 25.0, 50.0, 75.0, 100.0])
    axes.margins(x=0.0)


def _alike(shapers: Mapping[str, Shaper], modes: Mapping[str, Sequence[Mode]]) -> list[list[str]]:
    """Axes in groups that share their impulses and modes."""
    groups: list[list[str]] = []
    for axis, shaper in shapers.items():
        for group in groups:
            other = shapers[group[0]]
            if (
                np.array_equal(shaper.times, other.times)
                and np.array_equal(shaper.amplitudes, other.amplitudes)
                and tuple(modes[axis]) == tuple(modes[group[0]])
            ):
                group.append(axis)
                break
        else:
            groups.append([axis])
    return groups
