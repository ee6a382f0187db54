"""The run folder: page, numbers, signals, figures, and what it takes to run it again."""

from __future__ import annotations

import hashlib
import json
import string
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cnc_shape import __version__
from cnc_shape.modes import Mode
from cnc_shape.pipeline import Run
from cnc_shape.program import ROTARY
from cnc_shape.recording import MOTORS, Samples, Signals, require_finite
from cnc_shape.report import figures
from cnc_shape.report.html import Page, render_html
from cnc_shape.report.limit_figures import limits_figure, speed_figure
from cnc_shape.report.limit_table import limits_json
from cnc_shape.report.motor_figures import motor_cases, motor_figure
from cnc_shape.report.position_figure import modes_over_position, position_figure
from cnc_shape.report.shaper_figure import shaper_figure
from cnc_shape.report.style import Format, render
from cnc_shape.report.table import summary_json, tables_csv
from cnc_shape.report.trade_table import trade_figure, trade_json
from cnc_shape.shapers import Shaper
from cnc_shape.trade import TradeRow
from cnc_shape.units import DEGREE
from cnc_shape.writers.archive import Stream, write_archive
from cnc_shape.writers.publish import make_folder, publish_folder

RUNS = "cnc-shape-runs"
MARKER = "run.json"
MOTOR_UNITS = {
    "torque": "_nm", "load": "_nm", "estimate": "_nm", "effective_inertia": "_kg_m2", "inertia": "_kg_m2",
}  # fmt: skip  # the others are ratios
NAME_LETTERS = frozenset(string.ascii_letters + string.digits + "-_")


@dataclass(frozen=True, slots=True)
class Context:
    """What a run was made from; nothing in it may depend on the time or the place of the run."""

    command: Sequence[str] = ()  # the command line, without paths of this machine's own
    inputs: Mapping[str, str] = field(default_factory=dict[str, str])  # name: SHA-256 of every file read
    machine: str = ""  # resolved machine file, YAML
    shapers: Mapping[str, Shaper] = field(default_factory=dict[str, Shaper])
    modes: Mapping[str, Sequence[Mode]] = field(default_factory=dict[str, Sequence[Mode]])
    warnings: Sequence[str] = ()
    figure_format: Format = "svg"
    program: Path | None = None  # where the program's text lies, to show its worst lines


NO_CONTEXT = Context()


def default_folder(run: Run, context: Context) -> Path:
    """``cnc-shape-runs/<program>-<hash of inputs, machine and command>``."""
    digest = hashlib.sha256(_run_json(context)).hexdigest()[:8]
    stem = "".join(c if c in NAME_LETTERS else "-" for c in Path(run.summary.program).stem)
    return Path(RUNS) / f"{stem[:60].strip('-') or 'run'}-{digest}"


def write_report(
    run: Run,
    folder: Path | str,
    context: Context = NO_CONTEXT,
    trade: Sequence[TradeRow] = (),
    *,
    force: bool = False,
) -> Path:
    """Write the run folder, whole or not at all; the same run gives the same bytes.

    Parameters
    ----------
    run
        Summary and signals, one set of signals a case.
    folder
        The folder to make; one under ``cnc-shape-runs`` may be the first there.
    context
        What the run was made from.
    trade
        Kinds of shaping side by side, where the machine has shapers.
    force
        Replace an older run folder.

    Returns
    -------
    Path
        Of the page, ``report.html``.

    Raises
    ------
    OutputError
        The folder exists and `force` is not given, or cannot be written.
    InfeasibleError
        A number that is not finite; it names the signal and the time.
    ValueError
        A run without signals.
    """
    if len(run.signals) != len(run.summary.cases):
        raise ValueError(f"{len(run.signals)=} for {len(run.summary.cases)=}")
    folder = Path(folder)
    for signals in run.signals:
        _require_finite(signals)
    drawn = draw(run, context)
    if trade:
        drawn["trade"] = trade_figure(trade)
    driven = {signals.case: motor_figure(signals) for signals in motor_cases(run)}
    drawn |= {_motor_file(case): figure for case, figure in driven.items()}
    svg = {name: render(figure, "svg") for name, figure in drawn.items()}
    page = Page(
        svg, context.shapers, context.modes, context.warnings, context.program, context.machine, trade,
        {case: svg[_motor_file(case)] for case in driven},
    )  # fmt: skip
    kind = context.figure_format
    content = {
        "report.html": _encoded(render_html(run, page)),
        "results.json": _json(_results(run, trade)),
        "tables.csv": _encoded(tables_csv(run.summary)),
        "machine.yaml": _encoded(context.machine),
        MARKER: _run_json(context),
    }
    for name, figure in drawn.items():
        content[f"figures/{name}.{kind}"] = svg[name] if kind == "svg" else render(figure, kind)

    def build(target: Path) -> None:
        (target / "figures").mkdir()
        for name, data in content.items():
            (target / name).write_bytes(data)
        with (target / "signals.npz").open("wb") as file:
            write_archive(file, signal_arrays(run.signals))

    if folder.parent.name == RUNS:
        make_folder(folder.parent)
    publish_folder(folder, build, marker=MARKER, force=force)
    return folder / "report.html"


def _results(run: Run, trade: Sequence[TradeRow]) -> dict[str, Any]:
    results = summary_json(run.summary)
    if run.limit_use is not None:
        results["planned"] = limits_json(run.limit_use)
    if trade:
        results["trade"] = trade_json(trade)
    return results


def _motor_file(case: str) -> str:
    """Name of a case's figure of motors, without what a file name may not hold."""
    return "motors_" + "".join(c if c in NAME_LETTERS or c == "+" else "-" for c in case)


def _require_finite(signals: Signals) -> None:
    for item in fields(Signals):
        values = getattr(signals, item.name)
        if isinstance(values, np.ndarray):
            time = signals.settling_time if item.name.startswith("settling") else signals.time
            require_finite(item.name, np.asarray(values, np.float64), signals.case, signals.axes, time)
    if (motors := signals.motors) is not None:
        for name in MOTORS:
            require_finite(name, getattr(motors, name), signals.case, motors.joints, signals.time)


def draw(run: Run, context: Context) -> dict[str, Any]:
    """All figures of a run, by name."""
    drawn = {
        "path": figures.path_figure(run),
        "error": figures.error_figure(run),
        "motion": figures.motion_figure(run),
        "vibration": figures.vibration_figure(run),
    }
    if run.limit_use is not None:
        drawn["limits"] = limits_figure(run.limit_use)
        if run.limit_use.travels:
            drawn["limits_along_path"] = limits_figure(run.limit_use, along_path=True)
            drawn["speed"] = speed_figure(run.limit_use)
    if context.shapers:
        drawn["shapers"] = shaper_figure(context.shapers, context.modes)
        if varying := modes_over_position(context.shapers, context.modes):
            drawn["modes"] = position_figure(varying)
    return drawn


def signal_arrays(signals: Sequence[Signals]) -> dict[str, NDArray[Any] | Stream]:
    """Arrays of `signals.npz`: time first, the unit in every name; ``<case>/<signal>_<axis>_<unit>``.

    They hold every sample, or, of every 8 `decimation` samples, up to 8: see `cnc_shape.recording`. Where
    there are servo motors it is 11 instead of 8, and ``<case>/<signal>_<joint>_<unit>`` has what they did.
    """
    arrays: dict[str, NDArray[Any] | Stream] = {}
    for case in signals:
        stem = case.case
        arrays[f"{stem}/time_s"] = _stream(case.source, "time")
        for name, signal, unit in (
            ("command", "command", ""),
            ("drives", "position", ""),
            ("tool", "tool", ""),
            ("velocity", "velocity", "_s"),
            ("acceleration", "acceleration", "_s2"),
        ):
            for k, axis in enumerate(case.axes):
                scale, length = _unit(axis)
                arrays[f"{stem}/{name}_{axis}_{length}{unit}"] = _stream(case.source, signal, k, scale)
        arrays[f"{stem}/settling_time_s"] = case.settling_time  # after the end of the motion
        for k, axis in enumerate(case.axes):
            scale, length = _unit(axis)
            arrays[f"{stem}/settling_{axis}_{length}"] = case.settling[:, k] * scale
        for name, signal in (
            ("command_contour_error_mm", "command_error"),
            ("contour_error_mm", "drive_error"),
            ("tool_contour_error_mm", "tool_error"),
        ):
            arrays[f"{stem}/{name}"] = _stream(case.source, signal)
        for k, joint in enumerate(case.motors.joints if case.motors is not None else ()):
            for signal in MOTORS:
                unit = MOTOR_UNITS.get(signal, "")
                arrays[f"{stem}/{signal}_{joint}{unit}"] = _stream(case.source, signal, k)
        arrays[f"{stem}/line"] = _stream(case.source, "line", dtype=np.int64)
        arrays[f"{stem}/decimation"] = np.array([case.factor if case.samples is None else 1])
    return arrays


def _unit(axis: str) -> tuple[float, str]:
    return (1.0 / DEGREE, "deg") if axis in ROTARY else (1.0, "mm")


def _stream(
    source: Signals | Samples,
    name: str,
    axis: int = 0,
    scale: float = 1.0,
    dtype: type[np.float64] | type[np.int64] = np.float64,
) -> Stream:
    return Stream(len(source), dtype, (piece * scale for piece in source.pieces(name, axis)))


def _run_json(context: Context) -> bytes:
    return _json(
        {
            "schema": "cnc-shape/run/1",
            "versions": versions(),
            "command": list(context.command),
            "inputs": dict(context.inputs),
            "machine_sha256": hashlib.sha256(_encoded(context.machine)).hexdigest(),
            "warnings": list(context.warnings),
        }
    )


def versions() -> dict[str, str]:
    """Versions of what the numbers and the pictures of a run depend on."""
    names = ("numpy", "scipy", "numba", "matplotlib")
    python = ".".join(map(str, sys.version_info[:3]))
    return {"cnc-shape": __version__, "python": python, **{name: version(name) for name in names}}


def _json(content: Mapping[str, Any]) -> bytes:
    return _encoded(json.dumps(content, indent=2, allow_nan=False, ensure_ascii=False) + "\n")


def _encoded(text: str) -> bytes:
    """UTF-8; bytes of a file name that are no text are spelled out."""
    return text.encode("utf-8", "backslashreplace")
