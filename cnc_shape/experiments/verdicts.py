"""Verdicts: the rows of a paper as JSON, as tables for a terminal, and counted."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from math import ceil, log10
from textwrap import fill
from typing import TYPE_CHECKING, Any

from cnc_shape.experiments.experiment import Experiment, Row, Status, Table
from cnc_shape.report.text import one_line

if TYPE_CHECKING:
    from rich.table import Table as RichTable

ROUNDING = 1e-6  # a zero that is tolerated to less is one up to rounding, whose digits say nothing
COLOUR = {Status.REPRODUCED: "green", Status.DIFFERS: "bold yellow", Status.NOT_PUBLISHED: "dim"}


@dataclass(frozen=True, slots=True)
class Result:
    """A paper, run again."""

    experiment: Experiment
    tables: tuple[Table, ...]

    @property
    def rows(self) -> Iterator[Row]:
        """All rows, table by table."""
        return (row for table in self.tables for row in table.rows)

    def count(self, status: Status) -> int:
        """How many rows have a verdict."""
        return sum(row.status is status for row in self.rows)


def compute(experiment: Experiment, advance: Callable[[float], None]) -> Result:
    """Run a paper's tables again; `advance` is told 1 when they are done."""
    tables = tuple(experiment.tables())
    advance(1.0)
    return Result(experiment, tables)


def results_json(results: Sequence[Result]) -> dict[str, Any]:
    """Every row, as the JSON that others rely on; a quantity has its table's title, its place, in front."""
    return {"papers": [{"id": result.experiment.id, "rows": _rows_json(result)} for result in results]}


def _rows_json(result: Result) -> list[dict[str, Any]]:
    return [_row_json(row, table.title) for table in result.tables for row in table.rows]


def _row_json(row: Row, place: str) -> dict[str, Any]:
    return {
        "quantity": f"{place}: {row.quantity}",
        "unit": row.unit,
        "published": row.published,
        "ours": float(row.ours),
        "tolerance": row.tolerance,
        "status": row.status.value,
        "note": row.note,
    }


def published_text(row: Row) -> str:
    """The published number as printed; empty where there is none."""
    return "" if row.published is None else f"{row.published:.10g}"


def ours_text(row: Row) -> str:
    """Our number, to one digit more than the paper prints; rounding errors are not shown."""
    if row.status is Status.REPRODUCED and row.tolerance <= ROUNDING:
        return f"{row.ours:.6g}" if row.published else f"≤ {row.tolerance:.1g}" if row.tolerance else "0"
    if row.tolerance <= 0.0:
        return f"{row.ours:.6g}"
    decimals = max(0, ceil(-log10(2.0 * row.tolerance) - 1e-9))
    decimals += row.published is not None and row.tolerance != round(row.tolerance)
    return f"{row.ours:.{decimals}f}"


def tolerance_text(row: Row) -> str:
    """The tolerance of a number that was published."""
    return "" if row.published is None else f"{row.tolerance:g}"


def verdicts_table(table: Table) -> RichTable:
    """Lay a table out for a terminal; where that is narrow, quantities are folded, numbers never."""
    from rich import box
    from rich.table import Table as RichTable
    from rich.text import Text

    laid = RichTable(
        title=Text(one_line(table.title)), box=box.SIMPLE_HEAD, title_justify="left", title_style="bold",
        header_style="bold", padding=(0, 1, 0, 0), pad_edge=False, show_edge=False,
    )  # fmt: skip
    laid.add_column("quantity", overflow="fold")
    laid.add_column("unit", no_wrap=True)
    for name in ("published", "ours", "±"):
        laid.add_column(name, justify="right", no_wrap=True)
    laid.add_column("verdict", no_wrap=True)
    for row in table.rows:
        laid.add_row(
            Text(one_line(row.quantity)),
            row.unit,
            published_text(row),
            ours_text(row),
            tolerance_text(row),
            Text(row.status.value, style=COLOUR[row.status]),
        )
    return laid


def reasons(table: Table, width: int) -> str:
    """Why rows differ, a paragraph each, for a terminal of `width` columns."""
    told = [one_line(f"{row.quantity}: {row.note}") for row in table.rows if row.status is Status.DIFFERS]
    return "\n".join(fill(text, width, initial_indent="  ", subsequent_indent="    ") for text in told)


def summary_words(result: Result) -> str:
    """How many rows have which verdict."""
    counts = ", ".join(
        f"{result.count(status)} {words}"
        for status, words in (
            (Status.REPRODUCED, "reproduced"), (Status.DIFFERS, "differ"),
            (Status.NOT_PUBLISHED, "not published"),
        )
    )  # fmt: skip
    return f"paper {result.experiment.id}: {counts}"
