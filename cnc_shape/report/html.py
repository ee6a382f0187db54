"""The report's page: one file that opens offline, without scripts, and that no program text can hijack."""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from importlib.resources import files
from itertools import islice
from pathlib import Path
from typing import Any

from cnc_shape import __version__
from cnc_shape.modes import Mode
from cnc_shape.pipeline import Run, Summary
from cnc_shape.report.limit_table import QUANTITIES, feed_words, limit_rows
from cnc_shape.report.motor_figures import motor_cases
from cnc_shape.report.rows import UNDER, best_case, compared_with, folded, is_mixed, row_names
from cnc_shape.report.table import columns, micrometres
from cnc_shape.report.text import one_line
from cnc_shape.report.trade_table import HEADINGS, cells, explanation
from cnc_shape.report.words import Place, price_of_shaping, verdict, worst_places
from cnc_shape.shapers import Shaper
from cnc_shape.shapers.analysis import contour_factor
from cnc_shape.trade import TradeRow

LONGEST_LINE = 60  # characters of a program line that are shown
LONGEST_NAME = 24  # characters of a case that stand on one line
MOTOR_HEADINGS = (
    ("peak torque", "N m"), ("torque, RMS", "N m"), ("at the limit", "% of time"), ("peak load", "N m"),
    ("peak gain", "× nominal"), ("identified inertia", "kg m²"),
)  # fmt: skip  # name, unit

CAPTIONS = {
    "path": "The programmed path (grey) and the tool, its distance to the path magnified.",
    "error": "Contour error over time, at the tool and at the drives.",
    "vibration": "Deflection of the structure between drive and tool.",
    "motion": "Speed and acceleration of the command.",
    "limits": "The planned motion over time: speed of the tool and the programmed feed, and what each axis "
    "uses of its limits, the largest of every stretch that is drawn.",
    "limits_along_path": "The same along the path.",
    "speed": "The planned path, coloured by the speed of the tool.",
    "trade": "Contour error of the tool by kind of shaping: a dot for the structure as modelled, a bar over "
    "all models that the machine file allows for.",
    "shapers": "Left: the impulses. Right: the vibration a mode keeps where its real frequency is off.",
    "modes": "Left: modes over the position of an axis, the shaper's design point and the band in which it "
    "leaves little. Right: the vibration it leaves where the axis stands.",
}
FROM_SIGNALS = ("path", "error", "vibration", "motion")  # figures that are drawn from the signals


@dataclass(frozen=True, slots=True)
class Page:
    """What a page shows beside the run itself."""

    figures: Mapping[str, bytes] = field(default_factory=dict[str, bytes])  # SVG, the names of `CAPTIONS`
    shapers: Mapping[str, Shaper] = field(default_factory=dict[str, Shaper])  # of every shaped axis
    modes: Mapping[str, Sequence[Mode]] = field(default_factory=dict[str, Sequence[Mode]])
    warnings: Sequence[str] = ()  # of the reader and the machine file
    program: Path | None = None  # where the program's text lies
    machine: str = ""  # the machine file
    trade: Sequence[TradeRow] = ()  # kinds of shaping side by side
    motor_figures: Mapping[str, bytes] = field(default_factory=dict[str, bytes])  # SVG, by case


NO_PAGE = Page()


def render_html(run: Run, page: Page = NO_PAGE) -> str:
    """Fill the page: one file without scripts, without a date, without a request to anywhere.

    Names and program text are escaped where they are shown, and control characters spelled out. The
    content-security policy, which admits our own style sheet by its hash and pictures that lie in the
    page, is the second wall.
    """
    from jinja2 import Environment, StrictUndefined

    folder = files("cnc_shape.report").joinpath("templates")
    style = folder.joinpath("report.css").read_text(encoding="utf-8")
    template = folder.joinpath("report.html.j2").read_text(encoding="utf-8")
    digest = base64.b64encode(hashlib.sha256(style.encode()).digest()).decode()
    environment = Environment(
        autoescape=True, trim_blocks=True, undefined=StrictUndefined, keep_trailing_newline=True
    )
    summary, best = run.summary, best_case(run.summary)
    first = compared_with(summary, best)
    archived = [signals for signals in run.signals if signals.samples is None]  # no more than is drawn
    pictures = {
        name: _picture(page.figures[name], caption + (_thinning(run) if name in FROM_SIGNALS else ""))
        for name, caption in CAPTIONS.items()
        if name in page.figures
    }
    return environment.from_string(template).render(
        style=_safe(style),
        style_hash=f"sha256-{digest}",
        title=one_line(summary.program),
        version=__version__,
        verdict=one_line(verdict(summary)),
        price=price_of_shaping(summary),
        facts=[
            ("Program", one_line(summary.program)),
            ("Machine", one_line(summary.machine)),
            ("Cycle time", f"{summary.cycle_time:.3f} s"),
            ("Servo period", f"{summary.sample_time * 1e3:g} ms"),
            ("Samples", _count(summary.samples)),
        ],
        columns=[(column.name, column.unit, column.numbers) for column in columns(summary)],
        rows=[
            {
                "name": _on_lines(name.removeprefix(UNDER)),
                "under": name.startswith(UNDER),
                "best": case is best and best is not first,
                "cells": [column.cells[k] for column in columns(summary)],
            }
            for k, (case, name) in enumerate(zip(summary.cases, row_names(summary), strict=True))
        ],
        figures=[picture for name, picture in pictures.items() if name in FROM_SIGNALS],
        planned=run.limit_use is not None,
        limit_quantities=QUANTITIES,
        limit_rows=[] if run.limit_use is None else limit_rows(run.limit_use),
        limit_note="" if run.limit_use is None else feed_words(run.limit_use),
        limit_figures=[pictures[name] for name in ("limits", "speed") if name in pictures],
        limits_along_path=pictures.get("limits_along_path"),
        mixed=is_mixed(summary),
        motor_headings=MOTOR_HEADINGS,
        motors=_motor_rows(summary),
        motor_figures=[
            _picture(page.motor_figures[signals.case], _motor_caption(signals.case) + _thinning(run))
            for signals in motor_cases(run)
            if signals.case in page.motor_figures
        ],
        trade_headings=HEADINGS,
        trade_rows=[(row.name, cells(row)) for row in page.trade],
        trade_note=explanation(page.trade) if page.trade else "",
        trade_figure=pictures.get("trade"),
        shapers=[_shaper_row(axis, shaper, page.modes[axis]) for axis, shaper in page.shapers.items()],
        shaper_figures=[pictures[name] for name in ("shapers", "modes") if name in pictures],
        first=one_line(first.name),
        worst_case=one_line(best.name),
        worst=_place_rows(run, best.name, page.program) if run.signals else [],
        warnings=[one_line(warning) for warning in page.warnings],
        machine=page.machine,
        factor=max((signals.factor for signals in archived), default=1),
        bucket=max((signals.bucket for signals in archived), default=1),
    )


def _picture(svg: bytes, caption: str) -> dict[str, str]:
    return {"data": base64.b64encode(svg).decode(), "caption": caption}


def _on_lines(name: str) -> str:
    return folded(name) if len(name) > LONGEST_NAME else name


def _motor_caption(case: str) -> str:
    return (
        f"{one_line(case)}: torque of the motors, the load that was injected, and what was made of it. To an "
        "observer the motor's own friction is a load too."
    )


def _motor_rows(summary: Summary) -> list[dict[str, Any]]:
    """What every motor had to do, case by case; the case is named once."""
    return [
        {
            "case": _on_lines(one_line(case.name)) if k == 0 else "",
            "span": len(case.motors),
            "joint": motor.joint.upper(),
            "numbers": (
                f"{motor.peak_torque:.3g}",
                f"{motor.rms_torque:.3g}",
                f"{100.0 * motor.saturated_share:.3g}",
                f"{motor.peak_load:.3g}",
                f"{motor.peak_gain_ratio:.3g}",
                f"{motor.identified_inertia:.3g}",
            ),
        }
        for case in summary.cases
        for k, motor in enumerate(case.motors)
    ]


def _thinning(run: Run) -> str:
    """What a caption adds where not every sample is in the figure's reach."""
    bucket = max((signals.bucket for signals in run.signals), default=1)
    return f" Drawn from the extremes of every {_count(bucket)} samples." if bucket > 1 else ""


def _count(number: int) -> str:
    return f"{number:,}".replace(",", "\u202f")


def _place_rows(run: Run, case: str, program: Path | None) -> list[dict[str, Any]]:
    places = worst_places(run, case)
    text = _program_lines(program, {place.line for place in places})
    return [
        {
            "line": place.line,
            "text": text.get(place.line, ""),
            "numbers": (
                micrometres(place.error),
                micrometres(place.drive_error),
                _least(place),
                f"{place.time:.3f}",
                *(f"{value:.3f}" for value in place.foot.tolist()),
            ),
        }
        for place in places
    ]


def _least(place: Place) -> str:
    """The first case's error on the line, as far as its samples are there."""
    if place.first_error is None:
        return "–"
    return ("" if place.exact else "≥ ") + micrometres(place.first_error)


def _program_lines(program: Path | None, wanted: set[int]) -> dict[int, str]:
    """Text of the lines `wanted`, shortened; none where the program is not at hand."""
    if program is None or not wanted:
        return {}
    try:
        with program.open("rb") as file:
            found = {
                number: line
                for number, line in enumerate(islice(file, max(wanted)), start=1)
                if number in wanted
            }
    except OSError:
        return {}
    return {number: _shortened(line) for number, line in found.items()}


def _shortened(line: bytes) -> str:
    text = one_line(line.decode("utf-8", "backslashreplace").strip())
    return text if len(text) <= LONGEST_LINE else text[: LONGEST_LINE - 1] + "…"


def _safe(style: str) -> str:
    """Our own style sheet, the only text that is not escaped."""
    from markupsafe import Markup

    if "<" in style:
        raise ValueError("a style sheet holds no markup")
    return Markup(style)


def _shaper_row(axis: str, shaper: Shaper, modes: Sequence[Mode]) -> tuple[str, ...]:
    factor = contour_factor(shaper, modes)
    return (
        axis.upper(),
        ", ".join(f"{mode.natural_frequency:g} Hz (ζ {mode.damping_ratio:g})" for mode in modes) or "-",
        str(shaper.times.size),
        f"{shaper.duration * 1e3:.2f}",
        f"{shaper.delay * 1e3:.2f}",
        f"{shaper.sum_abs_amplitude:.3f}",
        "-" if factor is None else f"{factor:+.3f}",
    )
