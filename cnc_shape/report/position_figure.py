"""The figure of modes over position: where they go, and what the shapers leave of them there."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from cnc_shape.modes import Mode
from cnc_shape.program import ROTARY, unit_of
from cnc_shape.report.style import COLOURS, PATH_COLOUR, WIDTH, new_figure, styled
from cnc_shape.shapers import Shaper
from cnc_shape.shapers.insensitivity import DEFAULT_VIBRATION_TOLERANCE
from cnc_shape.shapers.over_position import ModeOverPosition, over_position

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

HEADROOM = 1.08  # above the largest value that is drawn


def modes_over_position(
    shapers: Mapping[str, Shaper], modes: Mapping[str, Sequence[Mode]]
) -> list[tuple[str, ModeOverPosition]]:
    """Modes with tables, each with its axis, over the rows of their tables: of all axes that are shaped."""
    return [
        (axis, over_position(mode, shaper))
        for axis, shaper in shapers.items()
        for mode in modes[axis]
        if mode.table is not None
    ]


@styled
def position_figure(found: Sequence[tuple[str, ModeOverPosition]]) -> Figure:
    """A row a mode: its frequency with the band that the shaper forgives, and the vibration it leaves."""
    figure, panels = new_figure(WIDTH, 2.6 * len(found), len(found), 2)
    for row, (axis, mode) in enumerate(found):
        left, right = panels[2 * row], panels[2 * row + 1]
        _draw_frequency(left, mode)
        left.set_title(f"{axis.upper()}: mode of {mode.mode.natural_frequency:g} Hz")
        _draw_vibration(right, mode)
        right.set_title(f"{axis.upper()}: vibration left")
        for panel in (left, right):
            over = mode.table.axis
            panel.set_xlabel(f"{over.upper()} ({'°' if over in ROTARY else 'mm'})")
            panel.margins(x=0.0)
    return figure


def _draw_frequency(axes: Axes, mode: ModeOverPosition) -> None:
    unit, table, design = unit_of(mode.table.axis), mode.table, mode.mode.natural_frequency
    ends = [float(mode.frequency.min()), float(mode.frequency.max()), design]
    if mode.band is not None:
        low, high = mode.band
        ends += [low] if high is None else [low, high]
        label = f"{100.0 * DEFAULT_VIBRATION_TOLERANCE:g} % at most"
        top = 2.0 * max(ends) if high is None else high
        axes.axhspan(low, top, color=PATH_COLOUR, alpha=0.25, linewidth=0.0, label=label)
    axes.axhline(design, color=PATH_COLOUR, linewidth=0.8, linestyle=(0, (4, 3)), label="design point")
    axes.plot(mode.position / unit, mode.frequency, color=COLOURS[1], label="mode")
    places = [place / unit for place in table.position]
    axes.plot(places, table.natural_frequency, "o", color=COLOURS[1], markersize=4.0, clip_on=False)
    room = (HEADROOM - 1.0) * (max(ends) - min(ends) or 1.0)
    axes.set_ylim(min(ends) - room, max(ends) + room)
    axes.set_ylabel("frequency (Hz)")
    axes.legend(loc="best")


def _draw_vibration(axes: Axes, mode: ModeOverPosition) -> None:
    tolerance = 100.0 * DEFAULT_VIBRATION_TOLERANCE
    left = 100.0 * mode.vibration
    axes.plot(mode.position / unit_of(mode.table.axis), left, color=COLOURS[0])
    axes.axhline(tolerance, color=PATH_COLOUR, linewidth=0.8, linestyle=(0, (4, 3)))
    axes.set_ylim(0.0, HEADROOM * max(float(left.max()), 2.0 * tolerance))
    axes.set_ylabel("V (%)")
