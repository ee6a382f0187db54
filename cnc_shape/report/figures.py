"""Static figures of a run: path with magnified error, error over time, motion, vibration, shapers."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from math import floor, log10
from typing import TYPE_CHECKING, Literal

import numpy as np

from cnc_shape.arrays import FloatArray, IntArray
from cnc_shape.modes import Mode
from cnc_shape.pipeline import Run
from cnc_shape.program import ROTARY
from cnc_shape.recording import Signals
from cnc_shape.report.style import COLOURS, METADATA, PATH_COLOUR, RC
from cnc_shape.shapers import Shaper
from cnc_shape.shapers.analysis import insensitivity, residual_vibration
from cnc_shape.units import MICROMETRE

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Format = Literal["svg", "png", "pdf"]
DRAWN = 1_000  # buckets of a line over time; the worst and the best of each is drawn
DRAWN_PATH = 20_000  # points of a path that are drawn
MAGNIFIED_SHARE = 0.06  # of the part's size: how large the largest contour error is drawn


def render(figure: Figure, kind: Format) -> bytes:
    """Draw a figure to bytes that depend on nothing but its content."""
    import matplotlib as mpl

    content = io.BytesIO()
    with mpl.rc_context(RC):
        figure.savefig(content, format=kind, metadata=METADATA[kind], dpi=160, bbox_inches="tight")
    return content.getvalue()


def _figure(
    width: float, height: float, rows: int = 1, columns: int = 1, **options: bool
) -> tuple[Figure, list[Axes]]:
    import matplotlib as mpl
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    with mpl.rc_context(RC):
        figure = Figure(figsize=(width, height), layout="constrained")
        FigureCanvasAgg(figure)
        grid = figure.subplots(rows, columns, squeeze=False, **options)
    return figure, list(grid.ravel())


def worst_rows(values: FloatArray, buckets: int = DRAWN) -> IntArray:
    """Rows of the largest and smallest value in each of `buckets` stretches, in order: what a line must show."""
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


def path_figure(run: Run) -> Figure:
    """Programmed path, and the tool of every case with its contour error magnified."""
    factor, (i, j) = _magnification(run), _plane(run)
    count = len(run.signals)
    figure, axes = _figure(3.4 * count + 0.3, 3.9, 1, count, sharex=True, sharey=True)
    for ax, signals, colour in zip(axes, run.signals, COLOURS, strict=False):
        ax.plot(run.path[:, i], run.path[:, j], color=PATH_COLOUR, linewidth=0.8)
        rows = worst_rows(signals.tool_error, DRAWN_PATH // 2)
        drawn = _magnified(signals, factor, rows)
        ax.plot(drawn[:, i], drawn[:, j], color=colour, linewidth=0.9)
        worst = signals.tool_error.max(initial=0.0) / MICROMETRE
        ax.set_title(f"{signals.case}\ntool max {worst:.3g} µm")
        ax.set_aspect("equal", adjustable="datalim")
        ax.set_xlabel(f"{'XYZ'[i]} (mm)")
    axes[0].set_ylabel(f"{'XYZ'[j]} (mm)")
    figure.suptitle(
        f"Path (grey) and tool, contour error × {factor:g}",
        x=0.01,
        ha="left",
        fontsize=10.0,
        fontweight="bold",
    )
    return figure


def error_figure(run: Run) -> Figure:
    """Contour error of the tool over time, and of the drives, one line a case."""
    figure, axes = _figure(7.2, 4.2, 2, 1, sharex=True)
    for ax, name, title in zip(axes, ("tool_error", "drive_error"), ("Tool", "Drives"), strict=True):
        for signals, colour in zip(run.signals, COLOURS, strict=False):
            values = getattr(signals, name)
            rows = worst_rows(values)
            ax.plot(signals.time[rows], values[rows] / MICROMETRE, color=colour, label=signals.case)
        ax.set_title(title)
        ax.set_ylabel("contour error (µm)")
        ax.set_ylim(bottom=0.0)
    axes[-1].set_xlabel("time (s)")
    _legend(figure, axes[0])
    return figure


def motion_figure(run: Run) -> Figure:
    """Speed and acceleration of every case's command over time."""
    figure, axes = _figure(7.2, 4.2, 2, 1, sharex=True)
    for signals, colour in zip(run.signals, COLOURS, strict=False):
        speed = np.sqrt((signals.velocity[:, :3] ** 2).sum(axis=1))
        acceleration = np.abs(signals.acceleration[:, :3]).max(axis=1, initial=0.0)
        for ax, values in zip(axes, (speed, acceleration), strict=True):
            rows = worst_rows(values)
            ax.plot(signals.time[rows], values[rows], color=colour, label=signals.case)
    axes[0].set_title("Path speed of the command")
    axes[0].set_ylabel("speed (mm/s)")
    axes[1].set_title("Largest axis acceleration of the command")
    axes[1].set_ylabel("acceleration (mm/s²)")
    axes[1].set_xlabel("time (s)")
    _legend(figure, axes[0])
    return figure


def vibration_figure(run: Run) -> Figure:
    """Deflection of the structure, tool minus drive, of the axis that vibrates most."""
    figure, axes = _figure(7.2, 2.6)
    linear = [k for k, axis in enumerate(run.signals[0].axes) if axis not in ROTARY]
    largest = [
        max(np.abs(s.tool[:, k] - s.position[:, k]).max(initial=0.0) for s in run.signals) for k in linear
    ]
    axis = linear[int(np.argmax(largest))]
    for signals, colour in zip(run.signals, COLOURS, strict=False):
        values = signals.tool[:, axis] - signals.position[:, axis]
        rows = worst_rows(values)
        axes[0].plot(signals.time[rows], values[rows] / MICROMETRE, color=colour, label=signals.case)
    axes[0].set_title(f"Deflection of the structure, {run.signals[0].axes[axis].upper()}: tool minus drive")
    axes[0].set_ylabel("deflection (µm)")
    axes[0].set_xlabel("time (s)")
    _legend(figure, axes[0])
    return figure


def shaper_figure(shapers: Mapping[str, Shaper], modes: Mapping[str, Sequence[Mode]]) -> Figure:
    """Impulses of every shaped axis, and the vibration it leaves when the frequencies are off."""
    figure, axes = _figure(7.2, 2.4 * len(shapers), len(shapers), 2)
    for row, (axis, shaper) in enumerate(shapers.items()):
        left, right = axes[2 * row], axes[2 * row + 1]
        left.vlines(shaper.times * 1e3, 0.0, shaper.amplitudes, color=COLOURS[1], linewidth=1.6)
        left.plot(shaper.times * 1e3, shaper.amplitudes, "o", color=COLOURS[1], markersize=4.0)
        left.axhline(0.0, color=PATH_COLOUR, linewidth=0.6)
        left.set_ylim(min(0.0, 1.15 * float(shaper.amplitudes.min())), 1.15 * float(shaper.amplitudes.max()))
        left.set_title(f"{axis.upper()}: impulses")
        left.set_ylabel("amplitude")
        left.set_xlabel("time (ms)")
        ratio = np.linspace(0.5, 1.5, 801)
        for mode, colour in zip(modes[axis], COLOURS, strict=False):
            label = f"{mode.natural_frequency:g} Hz, ζ {mode.damping_ratio:g}"
            right.plot(ratio, 100.0 * residual_vibration(shaper, mode, ratio), color=colour, label=label)
        if modes[axis]:
            band = insensitivity(shaper, modes[axis])
            right.axvspan(band.low, min(band.high or 1.5, 1.5), color=PATH_COLOUR, alpha=0.18, linewidth=0.0)
            right.axhline(100.0 * band.tolerance, color=PATH_COLOUR, linewidth=0.8, linestyle=(0, (4, 3)))
        right.set_title("Vibration left (band: at most 5 % at every mode)")
        right.set_ylabel("V (%)")
        right.set_xlabel("actual / modelled frequency")
        right.set_ylim(0.0, 100.0)
        right.legend(loc="upper center")
    return figure


def _legend(figure: Figure, ax: Axes) -> None:
    handles, labels = ax.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=min(len(labels), 4))
