"""Static figures of a run: path with magnified error, error over time, motion, vibration."""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil, floor, log10
from typing import TYPE_CHECKING, Any

import numpy as np

from cnc_shape.arrays import FloatArray, IntArray
from cnc_shape.pipeline import Run
from cnc_shape.program import ROTARY
from cnc_shape.recording import Signals
from cnc_shape.report.rows import UNDER, folded, is_mixed, row_names
from cnc_shape.report.style import PATH_COLOUR, WIDTH, look, new_figure, styled
from cnc_shape.units import MICROMETRE

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

PANELS = 3  # paths side by side at most
DRAWN = 1_000  # buckets of a line over time; the worst and the best of each is drawn
DRAWN_PATH = 20_000  # points of a path that are drawn
TITLE = 24  # characters of a narrow title
LABEL = 48  # characters of a label that stands for several cases
LETTER, HANDLE, LINE = 0.073, 0.55, 0.18  # inch, of a legend
DOTS = (0, (1.2, 1.2))
MAGNIFIED_SHARE = 0.1  # of the part's size: how large the largest contour error is drawn


def worst_rows(values: FloatArray, buckets: int = DRAWN) -> IntArray:
    """Rows of the largest and smallest value in each of `buckets` stretches, in order."""
    n = values.size
    if n <= 2 * buckets:
        return np.arange(n)
    edges = np.linspace(0, n, buckets + 1).astype(np.int64)
    picks = [
        low + offset
        for low, high in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True)
        for offset in (int(values[low:high].argmax()), int(values[low:high].argmin()))
    ]
    return np.unique(np.array([0, *picks, n - 1]))


def looks(run: Run) -> list[dict[str, Any]]:
    """How every case's line looks: a disturbed one has the colour of its undisturbed, dotted self."""
    if not is_mixed(run.summary):
        return [look(k) for k in range(len(run.signals))]
    found: list[dict[str, Any]] = []
    colours = 0
    for name, case in zip(row_names(run.summary), run.summary.cases, strict=True):
        colours += not name.startswith(UNDER)
        style = look(colours - 1)
        found.append(style if case.disturbed else {**style, "linestyle": DOTS})
    return found


def _magnification(run: Run) -> float:
    """A round factor that draws the largest error as a visible share of the part."""
    size = float(np.ptp(run.path, axis=0).max()) if run.path.size else 1.0
    worst = max((s.tool_error.max(initial=0.0) for s in run.signals), default=0.0)
    if worst <= 0.0 or size <= 0.0:
        return 1.0
    factor = MAGNIFIED_SHARE * size / worst
    power = 10.0 ** floor(log10(factor))
    return max(next(step * power for step in (5.0, 2.0, 1.0) if step * power <= factor), 1.0)


def _plane(run: Run) -> tuple[int, int]:
    """The two axes along which the path extends most, in their natural order."""
    spread = np.ptp(run.path, axis=0) if run.path.size else np.ones(3)
    first, second = sorted(np.argsort(-spread, kind="stable")[:2].tolist())
    return first, second


def _magnified(signals: Signals, factor: float, rows: IntArray) -> FloatArray:
    foot = signals.foot[rows]
    return foot + factor * (signals.tool[rows, :3] - foot)


@styled
def path_figure(run: Run) -> Figure:
    """Programmed path, and drives and tool of every case with their distance to it magnified."""
    factor, (i, j), cases = _magnification(run), _plane(run), looks(run)
    count = len(run.signals)
    extent = np.ptp(run.path, axis=0)[[i, j]] if run.path.size else np.ones(2)
    slope = min(max(extent[1] / max(extent[0], 1e-9), 0.12), 1.4)
    columns = 1 if slope < 0.4 else min(count, PANELS)
    rows = ceil(count / columns)
    panel = (WIDTH - 0.6) / columns if columns > 1 or slope < 0.4 else 4.5
    titles = [f"{_folded(signals.case)}\n{_worst_place(signals)}" for signals in run.signals]
    lines = max((title.count("\n") + 1 for title in titles), default=1)
    height = (slope * (panel - 0.3) + 0.5 + 0.19 * lines) * rows + 0.55
    figure, axes = new_figure(panel * columns + 0.6, height, rows, columns, sharex=True, sharey=True)
    handles: list[Line2D] = []
    for k, (ax, signals) in enumerate(zip(axes, run.signals, strict=False)):
        programmed = ax.plot(run.path[:, i], run.path[:, j], color=PATH_COLOUR, linewidth=2.2, alpha=0.45)
        kept = worst_rows(signals.tool_error, DRAWN_PATH // 2)
        drawn = _magnified(signals, factor, kept)
        style: dict[str, Any] = {**cases[k], "linewidth": 0.8}
        if style["linestyle"] == DOTS:
            style["linestyle"] = "-"
        tool = ax.plot(drawn[:, i], drawn[:, j], **style)
        worst = int(signals.tool_error.argmax())
        mark = _magnified(signals, factor, np.array([worst]))
        circle = ax.plot(
            mark[:, i], mark[:, j], "o", color="black", markersize=5.5, fillstyle="none", markeredgewidth=0.8
        )
        ax.set_title(titles[k])
        ax.set_aspect("equal", adjustable="box")
        ax.margins(0.06)
        if k + columns >= count:
            ax.set_xlabel(f"{'XYZ'[i]} (mm)")
            ax.tick_params(labelbottom=True)
        if k % columns == 0:
            ax.set_ylabel(f"{'XYZ'[j]} (mm)")
        handles = [programmed[0], *_neutral(tool), circle[0]]
    for ax in axes[count:]:
        ax.set_visible(False)
    labels = ["programmed path", f"tool, contour error × {factor:g}", "worst place"]
    figure.legend(handles, labels, loc="outside lower center", ncols=3)
    return figure


def _worst_place(signals: Signals) -> str:
    worst = int(signals.tool_error.argmax())
    return f"max {signals.tool_error[worst] / MICROMETRE:.3g} µm, line {signals.line[worst]}"


def _neutral(lines: Sequence[Line2D]) -> list[Line2D]:
    """A line for the legend that stands for lines of every colour."""
    from matplotlib.lines import Line2D

    return [Line2D([], [], color="black", linewidth=line.get_linewidth()) for line in lines]


@styled
def error_figure(run: Run) -> Figure:
    """Contour error of the tool over time, and of the drives, one line a case."""
    figure, axes = new_figure(WIDTH, 4.4, 2, 1, sharex=True)
    for ax, name, title in zip(axes, ("tool_error", "drive_error"), ("Tool", "Drives"), strict=True):
        for signals, style in zip(run.signals, looks(run), strict=True):
            values = getattr(signals, name)
            rows = worst_rows(values)
            ax.plot(signals.time[rows], values[rows] / MICROMETRE, **style, label=signals.case)
        ax.set_title(title)
        ax.set_ylabel("contour error (µm)")
        ax.set_ylim(bottom=0.0)
        ax.margins(x=0.0)
    axes[-1].set_xlabel("time (s)")
    _legend(figure, axes[0])
    return figure


@styled
def motion_figure(run: Run) -> Figure:
    """Speed and acceleration of every case's command over time; cases with one command share a line."""
    figure, axes = new_figure(WIDTH, 4.4, 2, 1, sharex=True)
    commands = _by_command(run)
    for k, (names, signals) in commands.items():
        label = "all cases" if len(names) > 2 and len(commands) == 1 else _several(names)
        speed = np.sqrt((signals.velocity[:, :3] ** 2).sum(axis=1))
        acceleration = np.abs(signals.acceleration[:, :3]).max(axis=1, initial=0.0)
        for ax, values in zip(axes, (speed, acceleration), strict=True):
            rows = worst_rows(values)
            ax.plot(signals.time[rows], values[rows], **look(k), label=label)
    axes[0].set_title("Path speed of the command")
    axes[0].set_ylabel("speed (mm/s)")
    axes[1].set_title("Largest axis acceleration of the command")
    axes[1].set_ylabel("acceleration (mm/s²)")
    axes[1].set_xlabel("time (s)")
    for ax in axes:
        ax.set_ylim(bottom=0.0)
        ax.margins(x=0.0)
    _legend(figure, axes[0])
    return figure


def _by_command(run: Run) -> dict[int, tuple[list[str], Signals]]:
    """Index of the first case of every command, with the names of all cases that share it."""
    groups: dict[int, tuple[list[str], Signals]] = {}
    for k, signals in enumerate(run.signals):
        same = next((g for g, (_, s) in groups.items() if np.array_equal(s.command, signals.command)), None)
        if same is None:
            groups[k] = ([signals.case], signals)
        else:
            groups[same][0].append(signals.case)
    return groups


@styled
def vibration_figure(run: Run) -> Figure:
    """Deflection of the structure, tool minus drive, of the axis that vibrates most."""
    linear = [k for k, axis in enumerate(run.signals[0].axes) if axis not in ROTARY]
    largest = [
        max(np.abs(s.tool[:, k] - s.position[:, k]).max(initial=0.0) for s in run.signals) for k in linear
    ]
    axis = linear[int(np.argmax(largest))]
    figure, (whole, rest) = new_figure(WIDTH, 2.8, 1, 2)
    for signals, style in zip(run.signals, looks(run), strict=True):
        values = (signals.tool[:, axis] - signals.position[:, axis]) / MICROMETRE
        rows = worst_rows(values)
        whole.plot(signals.time[rows], values[rows], **style, label=signals.case)
        after = signals.settling[:, axis] / MICROMETRE
        rows = worst_rows(after)
        rest.plot(signals.settling_time[rows], after[rows], **style)
    name = run.signals[0].axes[axis].upper()
    whole.set_title(f"Deflection in {name}: tool minus drive")
    whole.set_ylabel("deflection (µm)")
    whole.set_xlabel("time (s)")
    rest.set_title("After the command has come to rest")
    rest.set_xlabel("time after the end (s)")
    for ax in (whole, rest):
        ax.margins(x=0.0)
    _legend(figure, whole)
    return figure


def _folded(case: str) -> str:
    """Name of a case for a narrow title: its last term on a line of its own, or each if that is too wide."""
    head, plus, tail = case.rpartition("+")
    if len(head) > TITLE:
        return folded(case)
    return f"{head}\n+ {tail}" if plus else case


def _several(cases: Sequence[str]) -> str:
    """A label for cases that share a line."""
    label = " = ".join(cases)
    return label if len(label) <= LABEL or len(cases) < 3 else f"{cases[0]} and {len(cases) - 1} more"


def _legend(figure: Figure, ax: Axes) -> None:
    """Name the lines below, in as many columns as fit; the figure grows with the lines that this takes."""
    handles, labels = ax.get_legend_handles_labels()
    width = max(map(len, labels), default=1) * LETTER + HANDLE
    columns = max(min(len(labels), 4, int(WIDTH / width)), 1)
    figure.set_figheight(figure.get_figheight() + LINE * (ceil(len(labels) / columns) - 1))
    figure.legend(handles, labels, loc="outside lower center", ncols=columns)
