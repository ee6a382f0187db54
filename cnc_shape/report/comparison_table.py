"""All shapers of an axis side by side, as a table and in two sentences."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from cnc_shape.report.shaper_sheet import Corner
from cnc_shape.report.text import one_line
from cnc_shape.shapers.comparison import Comparison, Design

if TYPE_CHECKING:
    from rich.table import Table

HEADINGS = (
    ("duration", "ms"), ("left", "%, off"), ("band", "f / f0"), ("Σ|A|", "-"), ("step", "-"),
    ("corner", "mm/s²"), ("curve", "κ"),
)  # fmt: skip


def comparison_table(
    comparison: Comparison, titles: Sequence[str], axes: Sequence[str], corner: Corner, width: int
) -> Table:
    """Lay the comparison out for a terminal of `width` columns: from the left, what fits."""
    from rich import box
    from rich.table import Table
    from rich.text import Text

    modes = ", ".join(
        f"{m.natural_frequency:g} Hz (damping {m.damping_ratio:g})" for m in comparison.designs[0].modes
    )
    cells = [_cells(design, corner) for design in comparison.designs]
    names = [one_line(name) + _mark(comparison, row) for row, name in enumerate(titles)]
    shown = len(HEADINGS)
    widths = [max(map(len, [*heading, *(row[k] for row in cells)])) for k, heading in enumerate(HEADINGS)]
    while shown > 1 and max(map(len, names)) + sum(w + 2 for w in widths[:shown]) > width:
        shown -= 1
    tolerance = 100.0 * comparison.designs[0].assessment.insensitivity.tolerance
    table = Table(
        title=Text(one_line(f"{', '.join(axes)}: {modes}" if axes else modes)),
        caption=Text(
            "left: with frequency and damping as far off as they may be; band: at most "
            f"{tolerance:g} % left; step: largest value of a shaped step; "
            f"corner: acceleration that keeps a corner with a stop to {1e3 * corner.tolerance:g} µm"
        ),
        box=box.SIMPLE_HEAD, title_justify="left", caption_justify="left", title_style="bold",
        caption_style="dim", header_style="", padding=(0, 1, 0, 0), pad_edge=False, show_edge=False,
    )  # fmt: skip
    table.add_column("shaper", no_wrap=True)
    for name, unit in HEADINGS[:shown]:
        table.add_column(
            Text(name, style="bold").append(f"\n{unit}", style="dim"), justify="right", no_wrap=True
        )
    for row, name in enumerate(names):
        chosen = row in (comparison.fastest.row, comparison.most_robust.row)
        table.add_row(Text(name, style="bold green" if chosen else ""), *cells[row][:shown])
    return table


def _mark(comparison: Comparison, row: int) -> str:
    words = [
        word
        for word, choice in (("fastest", comparison.fastest), ("most robust", comparison.most_robust))
        if choice.row == row
    ]
    return f"  <- {', '.join(words)}" if words else ""


def _cells(design: Design, corner: Corner) -> tuple[str, ...]:
    found, band = design.assessment, design.assessment.insensitivity
    acceleration = found.corner_acceleration(corner.tolerance)
    return (
        f"{1e3 * design.shaper.duration:.2f}",
        f"{100.0 * found.worst_residual:.1f}",
        f"{band.low:.3f} - {'∞' if band.high is None else f'{band.high:.3f}'}",
        f"{design.shaper.sum_abs_amplitude:.2f}",
        f"{design.shaper.max_running_sum:.2f}",
        "∞" if acceleration is None else f"{acceleration:.0f}",
        "" if found.contour_factor is None else f"{found.contour_factor:+.2f}",
    )


def comparison_words(comparison: Comparison, titles: Sequence[str]) -> str:
    """The two recommendations, each with its reason, and what these modes have no shaper of."""
    return "\n".join(
        [
            f"fastest: {titles[comparison.fastest.row]}: {comparison.fastest.reason}",
            f"most robust: {titles[comparison.most_robust.row]}: {comparison.most_robust.reason}",
            *(f"left out: {one.name}: {one.reason}" for one in comparison.left_out),
        ]
    )
