"""The trade as table, JSON and picture: kinds of shaping side by side, nominal and as wrong as it may be."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from cnc_shape.report.style import PATH_COLOUR, WIDTH, look, new_figure, styled
from cnc_shape.report.table import by_unit, micrometres, worst_linear
from cnc_shape.trade import ModelResult, TradeRow
from cnc_shape.units import MICROMETRE

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from rich.table import Table

HEADINGS = (
    ("curve", "κ", 1), ("drives", "µm", 2), ("tool", "µm", 2), ("tool, worst model", "µm", 2),
    ("vibration, worst", "µm", 1), ("cycle", "s", 1),
)  # fmt: skip  # name, unit, numbers in a cell


def cells(row: TradeRow) -> tuple[tuple[str, ...], ...]:
    """One row of the table, a tuple of numbers for each of `HEADINGS`."""
    factors = list(dict.fromkeys(f"{factor:+.2f}" for factor in row.contour_factors.values()))
    nominal = row.nominal.tool
    vibration = max(worst_linear(result.residual_vibration) for result in row.results)
    return (
        (" ".join(factors) or "-",),
        (micrometres(row.drives.rms), micrometres(row.drives.max)),
        (micrometres(nominal.rms), micrometres(nominal.max)),
        (micrometres(row.worst.tool.rms), micrometres(row.worst_max)),
        (micrometres(vibration),),
        (f"{row.cycle_time:.3f}",),
    )


def explanation(rows: Sequence[TradeRow]) -> str:
    """What stands in the table, in two sentences."""
    corners = len(rows[0].results) - 1
    off = (
        f"nominal, and with the frequencies off by what the machine file says ({corners} models; the worst "
        f"is {rows[-1].worst.model.summary()} for {rows[-1].name})"
        if corners
        else "nominal alone, because no mode of the machine file has a frequency_uncertainty"
    )
    return (
        f"Contour error, RMS and maximum, {off}. κ: the tool's error on a curve as a share of the unshaped "
        "one, axis by axis."
    )


def trade_json(rows: Sequence[TradeRow]) -> list[dict[str, Any]]:
    """The trade as JSON: one object a kind of shaping, with every model."""
    return [
        {
            "name": row.name,
            "cycle_time_s": row.cycle_time,
            "contour_factor": dict(row.contour_factors),
            "command_contour_rms_um": row.command.rms / MICROMETRE,
            "command_contour_max_um": row.command.max / MICROMETRE,
            "contour_rms_um": row.drives.rms / MICROMETRE,
            "contour_max_um": row.drives.max / MICROMETRE,
            "models": [_model_json(result) for result in row.results],
        }
        for row in rows
    ]


def _model_json(result: ModelResult) -> dict[str, Any]:
    return {
        "frequency_factor": dict(result.model.factors),
        "tool_contour_rms_um": result.tool.rms / MICROMETRE,
        "tool_contour_max_um": result.tool.max / MICROMETRE,
        **by_unit("residual_vibration", result.residual_vibration),
    }


def trade_table(rows: Sequence[TradeRow], width: int) -> Table:
    """Lay the trade out for a terminal of `width` columns: from the left, what fits."""
    from rich import box
    from rich.table import Table
    from rich.text import Text

    lines = [[" / ".join(cell) for cell in cells(row)] for row in rows]
    names = [row.name for row in rows]
    widths = [
        max(map(len, [*name.split(", "), unit, *(line[k] for line in lines)]))
        for k, (name, unit, _) in enumerate(HEADINGS)
    ]
    shown = len(HEADINGS)
    while shown > 1 and max(map(len, names)) + sum(w + 2 for w in widths[:shown]) > width:
        shown -= 1
    table = Table(
        title=Text("\nWhat each kind of shaping costs, and what it buys\n"),
        caption=Text("\n" + explanation(rows) + "\n"),
        box=box.SIMPLE_HEAD, title_justify="left", caption_justify="left", title_style="bold",
        caption_style="dim", header_style="", padding=(0, 1, 0, 0), pad_edge=False, show_edge=False,
    )  # fmt: skip
    table.add_column("shaping", no_wrap=True)
    for name, unit, _ in HEADINGS[:shown]:
        heading = Text(name.replace(", ", "\n"), style="bold").append(f"\n{unit}", style="dim")
        table.add_column(heading, justify="right", no_wrap=True)
    for name, line in zip(names, lines, strict=True):
        table.add_row(name, *line[:shown])
    return table


@styled
def trade_figure(rows: Sequence[TradeRow]) -> Figure:
    """Contour error of every kind of shaping: a dot for the nominal structure, a bar over all models."""
    figure, panels = new_figure(WIDTH, 0.42 * len(rows) + 1.1, 1, 2, sharey=True)
    for axes, title, errors in (
        (panels[0], "RMS", [[result.tool.rms for result in row.results] for row in rows]),
        (panels[1], "maximum", [[result.tool.max for result in row.results] for row in rows]),
    ):
        for k, found in enumerate(errors):
            values = np.array(found) / MICROMETRE
            colour = look(k)["color"]
            axes.hlines(k, values.min(), values.max(), color=colour, linewidth=5.0, alpha=0.35)
            axes.plot(values[0], k, "o", color=colour, markersize=5.0)
            axes.annotate(
                f"{values[0]:.3g}" + (f" … {values.max():.3g}" if values.max() > values[0] else ""),
                (values.max(), k), xytext=(7, 0), textcoords="offset points", va="center", fontsize=8.0,
                color=PATH_COLOUR,
            )  # fmt: skip
        axes.set_xscale("log")
        axes.set_title(f"contour error of the tool, {title}")
        axes.set_xlabel("µm")
        axes.set_yticks(range(len(rows)), [row.name for row in rows])
        axes.set_ylim(len(rows) - 0.5, -0.5)
        low, high = axes.get_xlim()
        axes.set_xlim(low, high * (high / low) ** 0.35)  # room for the numbers
    return figure
