"""The table like the papers': one row a case, contour error RMS and maximum in micrometres."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from cnc_shape.pipeline import CaseSummary, Deviation, Summary
from cnc_shape.program import ROTARY
from cnc_shape.units import DEGREE, MICROMETRE

if TYPE_CHECKING:
    from rich.table import Table

SCHEMA = "cnc-shape/simulate/1"
FORMULA_STARTS = "=+-@\t\r"  # a cell that begins so is a formula to a spreadsheet


def _um(value: float) -> float:
    return value / MICROMETRE


def _in_user_units(axis: str, value: float) -> float:
    """Micrometres of a linear axis, thousandths of a degree of a rotary one."""
    return value / DEGREE * 1e3 if axis in ROTARY else _um(value)


def case_json(case: CaseSummary) -> dict[str, Any]:
    """One row as JSON; see the contract of `simulate`."""
    return {
        "name": case.name,
        "cycle_time_s": case.cycle_time,
        "command_contour_rms_um": _um(case.command.rms),
        "command_contour_max_um": _um(case.command.max),
        "contour_rms_um": _um(case.drives.rms),
        "contour_max_um": _um(case.drives.max),
        "contour_max_line": case.drives.line,
        "tool_contour_rms_um": _um(case.tool.rms),
        "tool_contour_max_um": _um(case.tool.max),
        "following_rms_um": {axis: _in_user_units(axis, v) for axis, v in case.following_rms.items()},
        "residual_vibration_um": {
            axis: _in_user_units(axis, v) for axis, v in case.residual_vibration.items()
        },
    }


def summary_json(summary: Summary) -> dict[str, Any]:
    """Everything a run says, as the JSON that others rely on."""
    return {
        "schema": SCHEMA,
        "program": summary.program,
        "machine": summary.machine,
        "cycle_time_s": summary.cycle_time,
        "sample_time_s": summary.sample_time,
        "samples": summary.samples,
        "cases": [case_json(case) for case in summary.cases],
    }


def micrometres(value: float) -> str:
    """A length in micrometres with three significant digits, and no more than two decimals."""
    um = _um(value)
    if um >= 99.95:
        return f"{um:.0f}"
    return f"{um:.1f}" if um >= 9.995 else f"{um:.2f}"


def change(value: float, first: float) -> str:
    """Change against the first row, signed per cent or a factor."""
    if first <= 0.0:
        return "–" if value <= 0.0 else "new"
    ratio = value / first
    return f"×{ratio:.1f}" if ratio >= 10.0 else f"{(ratio - 1.0) * 100.0:+.0f} %"


HEADERS = (
    ("case", ""),
    ("cycle", "s"),
    ("command", "rms / max"),
    ("drives", "rms / max"),
    ("tool", "rms / max"),
    ("change", "of max"),
    ("following", "rms"),
    ("vibration", "after end"),
)


def _pair(deviation: Deviation) -> str:
    return f"{micrometres(deviation.rms)} / {micrometres(deviation.max)}"


def rows(summary: Summary) -> list[tuple[str, ...]]:
    """Cells of the table, one tuple a case, in the order of `HEADERS`; lengths in micrometres."""
    first = summary.cases[0]
    return [
        (
            case.name,
            f"{case.cycle_time:.3f}",
            _pair(case.command),
            _pair(case.drives),
            _pair(case.tool),
            "" if case is first else change(case.tool.max, first.tool.max),
            micrometres(_worst_linear(case.following_rms)),
            micrometres(_worst_linear(case.residual_vibration)),
        )
        for case in summary.cases
    ]


def _worst_linear(values: Any) -> float:
    return max((value for axis, value in values.items() if axis not in ROTARY), default=0.0)


def build_table(summary: Summary, width: int) -> Table:
    """Lay the table out for a terminal of `width` columns; a narrow one leaves columns out from the right."""
    from rich import box
    from rich.table import Table

    cells = rows(summary)
    columns = list(range(len(HEADERS)))
    while _width(cells, columns) > width and len(columns) > 5:
        columns.remove(columns[-1] if len(columns) != 6 else 2)
    table = Table(
        title=f"{summary.program} on {summary.machine}",
        caption="contour error, following error and vibration in µm",
        box=box.SIMPLE_HEAD,
        title_justify="left",
        caption_justify="left",
        title_style="bold",
        padding=(0, 1),
    )
    for index in columns:
        top, below = HEADERS[index]
        table.add_column(f"{top}\n{below}", justify="left" if index == 0 else "right", no_wrap=True)
    for row in cells:
        table.add_row(*(_plain(row[index]) for index in columns))
    return table


def _plain(text: str) -> str:
    from rich.markup import escape

    return escape(text)


def _width(cells: Sequence[tuple[str, ...]], columns: Sequence[int]) -> int:
    return (
        sum(max(len(HEADERS[i][0]), len(HEADERS[i][1]), *(len(row[i]) for row in cells)) + 2 for i in columns)
        + 2
    )


def tables_csv(summary: Summary) -> str:
    """The table's numbers at full precision as CSV, one row a case."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    flat = [_flatten(case_json(case)) for case in summary.cases]
    writer.writerow(flat[0])
    for row in flat:
        writer.writerow([_guarded(value) for value in row.values()])
    return out.getvalue()


def _flatten(row: dict[str, Any]) -> dict[str, Any]:
    flat: dict[str, Any] = {}
    for key, value in row.items():
        if isinstance(value, dict):
            stem, unit = key.rsplit("_", 1)
            for axis, number in value.items():  # pyright: ignore[reportUnknownVariableType]
                flat[f"{stem}_{axis}_{'mdeg' if axis in ROTARY else unit}"] = number
        else:
            flat[key] = value
    return flat


def _guarded(value: Any) -> Any:
    """Text that a spreadsheet would run as a formula gets an apostrophe in front."""
    return "'" + value if isinstance(value, str) and value[:1] in FORMULA_STARTS and value else value
