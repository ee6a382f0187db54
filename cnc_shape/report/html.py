"""The report's page: one file that opens offline, without scripts, and that no program text can hijack."""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Mapping, Sequence
from importlib.resources import files

from cnc_shape import __version__
from cnc_shape.modes import Mode
from cnc_shape.pipeline import Run
from cnc_shape.report.table import rows
from cnc_shape.report.words import best_case, price_of_shaping, verdict, worst_places
from cnc_shape.shapers import Shaper
from cnc_shape.shapers.analysis import contour_factor

CAPTIONS = {
    "path": "The programmed path (grey) and where the tool went, its contour error magnified.",
    "error": "Contour error over time, at the tool and at the drives.",
    "motion": "Speed and acceleration of the command.",
    "vibration": "Deflection of the structure between drive and tool.",
    "shapers": "Impulses of every shaped axis, and the vibration left where the real frequency is off.",
}


def render_html(
    run: Run,
    figures: Mapping[str, bytes],
    shapers: Mapping[str, Shaper],
    modes: Mapping[str, Sequence[Mode]],
    warnings: Sequence[str],
) -> str:
    """Fill the page.

    Parameters
    ----------
    run
        Summary and signals.
    figures
        Name to SVG, the names of `CAPTIONS`.
    shapers, modes
        Of every shaped axis.
    warnings
        What the reader and the machine file had to say.
    """
    from jinja2 import Environment, StrictUndefined

    folder = files("cnc_shape.report").joinpath("templates")
    style = folder.joinpath("report.css").read_text(encoding="utf-8")
    template = folder.joinpath("report.html.j2").read_text(encoding="utf-8")
    digest = base64.b64encode(hashlib.sha256(style.encode()).digest()).decode()
    page = Environment(autoescape=True, undefined=StrictUndefined, keep_trailing_newline=True)
    summary, best = run.summary, best_case(run.summary)
    pictures = {
        name: {"data": base64.b64encode(figure).decode(), "caption": CAPTIONS[name]}
        for name, figure in figures.items()
    }
    return page.from_string(template).render(
        style=_safe(style),
        style_hash=f"sha256-{digest}",
        summary=summary,
        version=__version__,
        verdict=verdict(summary),
        price=price_of_shaping(summary),
        facts=[
            ("Program", summary.program),
            ("Machine", summary.machine),
            ("Cycle time, unshaped", f"{summary.cycle_time:.3f} s"),
            ("Servo period", f"{summary.sample_time * 1e3:g} ms"),
            ("Samples", f"{summary.samples:,}".replace(",", " ")),
        ],
        rows=[
            {"cells": cells, "best": case is best and len(summary.cases) > 1}
            for cells, case in zip(rows(summary), summary.cases, strict=True)
        ],
        figures=[pictures[name] for name in CAPTIONS if name in pictures and name != "shapers"],
        shapers=[_shaper_row(axis, shaper, modes[axis]) for axis, shaper in shapers.items()],
        shaper_figure=pictures.get("shapers"),
        worst=worst_places(run.signals[-1]),
        warnings=warnings,
        factor=run.signals[-1].factor,
    )


def _safe(style: str) -> str:
    """Our own style sheet, the only text that is not escaped."""
    from markupsafe import Markup

    if "<" in style:
        raise ValueError("a style sheet holds no markup")
    return Markup(style)


def _shaper_row(axis: str, shaper: Shaper, modes: Sequence[Mode]) -> tuple[str, ...]:
    return (
        axis.upper(),
        ", ".join(f"{mode.natural_frequency:g} Hz (ζ {mode.damping_ratio:g})" for mode in modes) or "–",
        str(shaper.times.size),
        f"{shaper.duration * 1e3:.2f}",
        f"{shaper.delay * 1e3:.2f}",
        f"{shaper.sum_abs_amplitude:.3f}",
        f"{contour_factor(shaper, modes):+.3f}" if modes else "–",
    )
