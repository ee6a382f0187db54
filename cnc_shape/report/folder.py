"""The run folder: page, numbers, signals, figures, and what it takes to run it again."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cnc_shape import __version__
from cnc_shape.modes import Mode
from cnc_shape.pipeline import Run
from cnc_shape.program import ROTARY
from cnc_shape.recording import Signals
from cnc_shape.report import figures
from cnc_shape.report.html import render_html
from cnc_shape.report.table import summary_json, tables_csv
from cnc_shape.shapers import Shaper
from cnc_shape.units import DEGREE
from cnc_shape.writers.archive import write_archive
from cnc_shape.writers.publish import publish_folder

RUNS = "cnc-shape-runs"
MARKER = "run.json"


@dataclass(frozen=True, slots=True)
class Context:
    """What a run was made from; nothing in it may depend on the time or the place of the run."""

    command: Sequence[str]  # the command line, without paths of this machine's own
    inputs: Mapping[str, str]  # name: SHA-256 of every file that was read
    machine: str  # resolved machine file, YAML
    shapers: Mapping[str, Shaper] = field(default_factory=dict[str, Shaper])
    modes: Mapping[str, Sequence[Mode]] = field(default_factory=dict[str, Sequence[Mode]])
    warnings: Sequence[str] = ()
    figure_format: figures.Format = "svg"


def default_folder(run: Run, context: Context) -> Path:
    """``cnc-shape-runs/<program>-<hash of inputs, machine and command>``."""
    digest = hashlib.sha256(_run_json(context).encode()).hexdigest()[:8]
    stem = "".join(c if c.isalnum() or c in "-_" else "-" for c in Path(run.summary.program).stem)
    return Path(RUNS) / f"{stem[:60] or 'run'}-{digest}"


def write_report(run: Run, folder: Path, context: Context, *, force: bool = False) -> Path:
    """Write the run folder, whole or not at all.

    Returns
    -------
    Path
        Of the page, ``report.html``.

    Raises
    ------
    OutputError
        The folder exists and `force` is not given, or cannot be written.
    ValueError
        A number that is not finite: a bug of ours, named.
    """
    drawn = draw(run, context)
    svg = {name: figures.render(figure, "svg") for name, figure in drawn.items()}
    page = render_html(run, svg, context.shapers, context.modes, context.warnings)
    results = json.dumps(summary_json(run.summary), indent=1, allow_nan=False, ensure_ascii=False) + "\n"

    def build(target: Path) -> None:
        (target / "figures").mkdir()
        for name, figure in drawn.items():
            kind = context.figure_format
            content = svg[name] if kind == "svg" else figures.render(figure, kind)
            (target / "figures" / f"{name}.{kind}").write_bytes(content)
        (target / "report.html").write_text(page, encoding="utf-8", newline="\n")
        (target / "results.json").write_text(results, encoding="utf-8", newline="\n")
        (target / "tables.csv").write_text(tables_csv(run.summary), encoding="utf-8", newline="\n")
        (target / "machine.yaml").write_text(context.machine, encoding="utf-8", newline="\n")
        (target / MARKER).write_text(_run_json(context), encoding="utf-8", newline="\n")
        with (target / "signals.npz").open("wb") as file:
            write_archive(file, signal_arrays(run.signals))

    publish_folder(folder, build, marker=MARKER, force=force)
    return folder / "report.html"


def draw(run: Run, context: Context) -> dict[str, Any]:
    """All figures of a run, by name."""
    drawn = {
        "path": figures.path_figure(run),
        "error": figures.error_figure(run),
        "motion": figures.motion_figure(run),
        "vibration": figures.vibration_figure(run),
    }
    if context.shapers:
        drawn["shapers"] = figures.shaper_figure(context.shapers, context.modes)
    return drawn


def signal_arrays(signals: Sequence[Signals]) -> dict[str, NDArray[Any]]:
    """Arrays of `signals.npz`: time first, the unit in every name; ``<case>/<signal>_<axis>_<unit>``."""
    arrays: dict[str, NDArray[Any]] = {}
    for case in signals:
        stem = case.case
        arrays[f"{stem}/time_s"] = case.time
        for name, values, unit in (
            ("command", case.command, ""),
            ("drives", case.position, ""),
            ("tool", case.tool, ""),
            ("velocity", case.velocity, "_s"),
            ("acceleration", case.acceleration, "_s2"),
        ):
            for k, axis in enumerate(case.axes):
                rotary = axis in ROTARY
                scale = 1.0 / DEGREE if rotary else 1.0
                arrays[f"{stem}/{name}_{axis}_{'deg' if rotary else 'mm'}{unit}"] = values[:, k] * scale
        arrays[f"{stem}/command_contour_error_mm"] = case.command_error
        arrays[f"{stem}/contour_error_mm"] = case.drive_error
        arrays[f"{stem}/tool_contour_error_mm"] = case.tool_error
        arrays[f"{stem}/line"] = case.line
        arrays[f"{stem}/decimation"] = np.array([case.factor])
    return arrays


def _run_json(context: Context) -> str:
    content = {
        "schema": "cnc-shape/run/1",
        "version": __version__,
        "command": list(context.command),
        "inputs": dict(context.inputs),
        "machine_sha256": hashlib.sha256(context.machine.encode()).hexdigest(),
        "warnings": list(context.warnings),
    }
    return json.dumps(content, indent=1, ensure_ascii=False) + "\n"
