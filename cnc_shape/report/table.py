"""The table like the papers': one row a case, contour error RMS and maximum in micrometres."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import isfinite
from typing import TYPE_CHECKING, Any, cast

from cnc_shape.errors import InfeasibleError
from cnc_shape.pipeline import CaseSummary, Deviation, Summary
from cnc_shape.program import ROTARY
from cnc_shape.report.rows import best_case, compared_with, folded, is_mixed, row_names
from cnc_shape.report.text import one_line
from cnc_shape.units import DEGREE, MICROMETRE

if TYPE_CHECKING:
    from rich.table import Table

SCHEMA = "cnc-shape/simulate/1"
FORMULA_STARTS = "=+-@\t\r\n"  # a cell that begins so is a formula to a spreadsheet
MILLIDEGREE = 1e-3 * DEGREE  # rad


def summary_json(summary: Summary) -> dict[str, Any]:
    """Everything a run says, as the JSON that others rely on.

    Rotary axes have keys of their own, in thousandths of a degree, and only where there are any:
    ``following_rms_mdeg``, ``residual_vibration_mdeg``; so have machines that turn tool or workpiece:
    ``orientation_rms_mdeg``, ``orientation_max_mdeg``, apart from the contour error. Where there are servo
    motors, ``motors`` has what each of them had to do.

    Raises
    ------
    InfeasibleError
        A number that is not finite; it names the case and the number.
    """
    for case in summary.cases:
        for name, value in _flatten(case_json(case)).items():
            if isinstance(value, float) and not isfinite(value):
                raise InfeasibleError(
                    f"{name} of the case {case.name} is {value}",
                    hint="the motion ran away: lower the gains of its loop, or check its shapers",
                )
    return {
        "schema": SCHEMA,
        "program": summary.program,
        "machine": summary.machine,
        "cycle_time_s": summary.cycle_time,
        "sample_time_s": summary.sample_time,
        "samples": summary.samples,
        "cases": [case_json(case) for case in summary.cases],
    }


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
        **by_unit("following_rms", case.following_rms),
        **by_unit("residual_vibration", case.residual_vibration),
        **_turn(case),
        **_motors(case),
    }


def _turn(case: CaseSummary) -> dict[str, float]:
    if case.turn is None:
        return {}
    return {
        "orientation_rms_mdeg": case.turn.rms / MILLIDEGREE,
        "orientation_max_mdeg": case.turn.max / MILLIDEGREE,
    }


def _motors(case: CaseSummary) -> dict[str, list[dict[str, Any]]]:
    if not case.motors:
        return {}
    return {
        "motors": [
            {
                "joint": motor.joint,
                "peak_torque_nm": motor.peak_torque,
                "rms_torque_nm": motor.rms_torque,
                "peak_load_nm": motor.peak_load,
                "peak_gain_ratio": motor.peak_gain_ratio,
                "saturated_share": motor.saturated_share,
                "identified_inertia_kg_m2": motor.identified_inertia,
            }
            for motor in case.motors
        ]
    }


def _um(value: float) -> float:
    return value / MICROMETRE


def by_unit(name: str, values: Mapping[str, float]) -> dict[str, dict[str, float]]:
    """A number of each axis under the key of its unit: micrometres, thousandths of a degree."""
    parts = {f"{name}_um": {axis: _um(value) for axis, value in values.items() if axis not in ROTARY}}
    turning = {axis: value / MILLIDEGREE for axis, value in values.items() if axis in ROTARY}
    return {**parts, f"{name}_mdeg": turning} if turning else parts


def tables_csv(summary: Summary) -> str:
    """The table's numbers at full precision as CSV, one row a case."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    flat = [_flatten(case) for case in summary_json(summary)["cases"]]
    writer.writerow(flat[0])
    for row in flat:
        writer.writerow([_guarded(row[column]) for column in flat[0]])
    return out.getvalue()


def _flatten(row: Mapping[str, Any]) -> dict[str, Any]:
    """``{"following_rms_um": {"x": 1.0}}`` as ``{"following_rms_x_um": 1.0}``; motors: ``motor_x_<name>``."""
    flat: dict[str, Any] = {}
    for key, value in row.items():
        if isinstance(value, dict):
            stem, unit = key.rsplit("_", 1)
            for axis, number in value.items():  # pyright: ignore[reportUnknownVariableType]
                flat[f"{stem}_{axis}_{unit}"] = number
        elif isinstance(value, list):
            for motor in cast("list[dict[str, Any]]", value):
                flat |= {f"motor_{motor['joint']}_{name}": motor[name] for name in motor if name != "joint"}
        else:
            flat[key] = value
    return flat


def _guarded(value: Any) -> Any:
    """Text on one line; what a spreadsheet would run as a formula gets an apostrophe in front."""
    if not isinstance(value, str):
        return value
    return ("'" if value[:1] in FORMULA_STARTS and value else "") + one_line(value)


def worst_linear(values: Mapping[str, float]) -> float:
    """Largest value of the linear axes, mm; the contour is theirs."""
    return max((value for axis, value in values.items() if axis not in ROTARY), default=0.0)


def micrometres(value: float) -> str:
    """A length in micrometres with three significant digits, and no more than two decimals."""
    um = _um(value)
    if um >= 99_999.5:
        return f"{um:.2e}"
    if um >= 99.95:
        return f"{um:.0f}"
    return f"{um:.1f}" if um >= 9.995 else f"{um:.2f}"


def _mdeg(angle: float) -> str:
    return f"{angle / MILLIDEGREE:.3g}"


def change(value: float, first: float) -> str:
    """Change against the first row: signed per cent, or a factor from tenfold on."""
    if first <= 0.0:
        return "0 %" if value <= 0.0 else "new"
    ratio = value / first
    return f"{ratio:.3g}x" if ratio >= 10.0 else f"{(ratio - 1.0) * 100.0:+.0f} %"


@dataclass(frozen=True, slots=True)
class Column:
    """A column of the table: what it shows, its unit, and its cell for every case."""

    name: str
    unit: str
    cells: tuple[tuple[str, ...], ...]  # a case: one number, or RMS and maximum

    @property
    def numbers(self) -> int:
        """How many numbers a cell holds."""
        return max(len(cell) for cell in self.cells)


def columns(summary: Summary) -> tuple[Column, ...]:
    """The table, most important columns first from the left; the case itself is not among them."""
    cases = summary.cases

    def pair(deviation: Deviation) -> tuple[str, str]:
        return micrometres(deviation.rms), micrometres(deviation.max)

    def changes(case: CaseSummary) -> tuple[str, str]:
        now, first = case.tool, compared_with(summary, case).tool
        return ("", "") if now is first else (change(now.rms, first.rms), change(now.max, first.max))

    turns = [case.turn for case in cases if case.turn is not None]
    turning = (Column("turned", "m°", tuple((_mdeg(t.rms), _mdeg(t.max)) for t in turns)),) if turns else ()
    return (
        Column("tool", "µm", tuple(pair(case.tool) for case in cases)),
        Column("change", "of tool", tuple(changes(case) for case in cases)),
        Column("drives", "µm", tuple(pair(case.drives) for case in cases)),
        Column("command", "µm", tuple(pair(case.command) for case in cases)),
        *turning,
        Column("cycle", "s", tuple((f"{case.cycle_time:.3f}",) for case in cases)),
        Column("vibration", "µm", tuple((micrometres(worst_linear(c.residual_vibration)),) for c in cases)),
        Column("following", "µm", tuple((micrometres(worst_linear(case.following_rms)),) for case in cases)),
    )


def build_table(summary: Summary, width: int) -> Table:
    """Lay the table out for a terminal of `width` columns; numbers are never cut.

    Names stand on one line and RMS and maximum side by side where there is room; else names are folded, then
    RMS stands above the maximum. A terminal that is too narrow even so gets the columns that fit, from the
    left.
    """
    from rich import box
    from rich.table import Table
    from rich.text import Text

    shown, stacked, gap = columns(summary), False, 3
    names = row_names(summary)
    if _width(names, shown, gap, stacked=False) > width:
        names = [folded(name) for name in names]
    if _width(names, shown, gap, stacked=False) > width:
        stacked = True
        gap = 2 if _width(names, shown, 2, stacked=True) <= width else 1
        while _width(names, shown, gap, stacked=True) > width and len(shown) > 1:
            shown = shown[:-1]
    table = Table(
        title=Text(one_line(f"{summary.program} on {summary.machine}") + "\n"),
        caption=Text(
            f"\ncontour error: RMS {'above' if stacked else '/'} maximum over all samples; "
            "vibration after the end and following error (RMS) of the worst axis"
            + ("; disturbed rows are compared with the first of them" if is_mixed(summary) else "")
        ),
        box=box.SIMPLE_HEAD,
        title_justify="left",
        caption_justify="left",
        title_style="bold",
        caption_style="dim",
        header_style="",
        padding=(0, gap - 1, 0, 0),  # the box itself draws one more
        pad_edge=False,
        show_edge=False,
    )
    table.add_column("case", no_wrap=True)
    for column in shown:
        heading = Text(column.name, style="bold").append(f"\n{column.unit}", style="dim")
        table.add_column(heading, justify="right", no_wrap=True)
    best = best_case(summary)
    improved = best is not compared_with(summary, best)
    rows = zip(*(_laid_out(column, stacked=stacked) for column in shown), strict=True)
    for case, name, row in zip(summary.cases, names, rows, strict=True):
        cells = [Text(cell) for cell in row]
        if improved and case is best:
            cells[0].stylize("bold green")
        table.add_row(Text(name), *cells)
    return table


def _laid_out(column: Column, *, stacked: bool) -> list[str]:
    """Cells of a column as text; side by side, all RMS values end at one place and all maxima at another."""
    if stacked:
        return ["\n".join(cell) for cell in column.cells]
    widths = [max(map(len, numbers)) for numbers in zip(*column.cells, strict=True)]
    return [
        (" / " if any(cell) else "   ").join(f"{n:>{w}}" for n, w in zip(cell, widths, strict=True))
        for cell in column.cells
    ]


def _width(names: Sequence[str], shown: Sequence[Column], gap: int, *, stacked: bool) -> int:
    """How wide the table is."""
    total = max(len(line) for name in [*names, "case"] for line in name.split("\n"))
    for column in shown:
        lines = [line for cell in _laid_out(column, stacked=stacked) for line in cell.split("\n")]
        total += gap + max(map(len, [column.name, column.unit, *lines]))
    return total


def table_text(summary: Summary, width: int = 120) -> str:
    """The table as plain text."""
    from rich.console import Console

    out = io.StringIO()
    Console(file=out, width=width, force_terminal=False, color_system=None, highlight=False).print(
        build_table(summary, width)
    )
    return "\n".join(line.rstrip() for line in out.getvalue().splitlines()) + "\n"
