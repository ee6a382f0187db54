"""Figures of shaper design: one shaper in four views, and many by duration and robustness."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from cnc_shape.report.shaper_figure import draw_impulses, draw_sensitivity
from cnc_shape.report.style import COLOURS, PATH_COLOUR, WIDTH, look, new_figure, styled
from cnc_shape.shapers.analysis import vibration
from cnc_shape.shapers.comparison import Design, pareto_front
from cnc_shape.shapers.measures import step_response
from cnc_shape.shapers.shaper import NONE

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

PANEL, LETTER = (470.0, 245.0), (4.2, 9.0)  # points, about: a panel of the comparison, a letter in it
PERIODS_SHOWN = 4.0  # of the slowest mode, after the last impulse
LEVELS = (0.01, 0.02, 0.05, 0.1, 0.2, 0.4, 0.7, 1.0)  # -, V of the contour lines
MOST_DAMPING = 0.3  # -, of the surface


@styled
def design_figure(designs: Sequence[Design]) -> Figure:
    """Impulses, step response, sensitivity, and V over frequency and damping (paper 000, Fig. 4).

    Axes that share a shaper and its modes share their four panels.
    """
    groups = _alike(designs)
    figure, axes = new_figure(WIDTH, 5.6 * len(groups), 2 * len(groups), 2)
    for row, group in enumerate(groups):
        design = group[0]
        names = ", ".join(one.axis.upper() for one in group if one.axis)
        impulses, step, sensitivity, surface = axes[4 * row : 4 * row + 4]
        draw_impulses(impulses, design.shaper)
        impulses.set_title(": ".join([*([names] if names else []), design.name]))
        _draw_step(step, design)
        draw_sensitivity(sensitivity, design.shaper, design.modes, design.assessment.insensitivity)
        sensitivity.set_title("vibration left")
        _draw_surface(surface, design)
    return figure


def _alike(designs: Sequence[Design]) -> list[list[Design]]:
    groups: dict[tuple[object, ...], list[Design]] = {}
    for design in designs:
        key = (design.modes, design.shaper.times.tobytes(), design.shaper.amplitudes.tobytes())
        groups.setdefault(key, []).append(design)
    return list(groups.values())


def _draw_step(axes: Axes, design: Design) -> None:
    slowest = max(mode.damped_period for mode in design.modes)
    time = np.linspace(0.0, design.shaper.duration + PERIODS_SHOWN * slowest, 1200)
    for k, (shaper, label) in enumerate(((NONE, "unshaped"), (design.shaper, design.name))):
        axes.plot(1e3 * time, step_response(shaper, design.modes, time), **look(k), label=label)
    axes.axhline(1.0, color=PATH_COLOUR, linewidth=0.6)
    axes.set_title("step of 1")
    axes.set_xlabel("time (ms)")
    axes.set_ylabel("tool (-)")
    axes.set_ylim(bottom=min(0.0, axes.get_ylim()[0]), top=max(2.35, axes.get_ylim()[1]))
    axes.margins(x=0.0)
    axes.legend(loc="upper right", ncols=2)


def _draw_surface(axes: Axes, design: Design) -> None:
    """V as filled steps: over the actual frequency of the slowest mode, and its actual damping."""
    mode = min(design.modes, key=lambda mode: mode.natural_frequency)
    ratio, damping = np.linspace(0.5, 1.5, 201), np.linspace(0.0, MOST_DAMPING, 61)
    surface = vibration(design.shaper, mode.omega * ratio[None, :], damping[:, None])
    levels = [0.0, *LEVELS]
    filled = axes.contourf(ratio, damping, surface, levels=levels, cmap="Blues", extend="max")
    lines = axes.contour(ratio, damping, surface, levels=[0.05], colors=[COLOURS[0]], linewidths=1.2)
    axes.clabel(lines, fmt={0.05: "5 %"}, fontsize=8.0)
    axes.plot([1.0], [mode.damping_ratio], "o", color=COLOURS[0], markersize=4.0)
    bar = axes.figure.colorbar(filled, ax=axes, ticks=levels)
    bar.ax.set_yticklabels([f"{100.0 * level:g}" for level in levels])
    bar.set_label("V (%)")
    axes.set_title(f"V at {mode.natural_frequency:g} Hz")
    axes.set_xlabel("actual / modelled frequency (-)")
    axes.set_ylabel("actual damping ratio (-)")
    axes.grid(visible=False)


@styled
def pareto_figure(comparisons: Sequence[tuple[str, Sequence[Design], Sequence[str]]]) -> Figure:
    """Duration against the margin of frequency; the line joins the designs that no other beats.

    Each of `comparisons` is the axes' names, the designs and their titles, and gets a panel.
    """
    figure, panels = new_figure(WIDTH, 4.2 * len(comparisons), len(comparisons))
    for axes, (names, designs, titles) in zip(panels, comparisons, strict=True):
        _draw_pareto(axes, designs, titles)
        tolerance = 100.0 * designs[0].assessment.insensitivity.tolerance
        about = f"duration and robustness (V {tolerance:g} % at most)"
        axes.set_title(": ".join([*([names] if names else []), about]))
    return figure


def _draw_pareto(axes: Axes, designs: Sequence[Design], titles: Sequence[str]) -> None:
    durations = [1e3 * design.shaper.duration for design in designs]
    margins = [100.0 * design.assessment.insensitivity.margin for design in designs]
    easy = [design.is_easy for design in designs]
    front = pareto_front(designs)
    axes.plot(
        [durations[row] for row in front], [margins[row] for row in front], drawstyle="steps-post",
        color=PATH_COLOUR, linewidth=0.8, zorder=1,
    )  # fmt: skip
    for row in range(len(designs)):
        axes.plot(
            durations[row], margins[row], "o" if easy[row] else "s", color=COLOURS[1 if easy[row] else 0],
            markersize=5.0 if row in front else 3.5,
        )  # fmt: skip
    for kind, colour, label in (("o", COLOURS[1], "positive impulses"), ("s", COLOURS[0], "Σ|A| above 1")):
        axes.plot([], [], kind, color=colour, markersize=5.0, label=label)
    axes.legend(loc="lower right")
    axes.set_xlabel("duration (ms)")
    axes.set_ylabel("frequency may be off by (%)")
    width, height = 1.25 * max(durations), 1.08 * max(max(margins), 1.0)  # names stand right of their points
    axes.set_xlim(0.0, width)
    axes.set_ylim(0.0, height)
    for row, rise in enumerate(_rises(durations, margins, titles, width, height)):
        axes.annotate(
            titles[row], (durations[row], margins[row]), xytext=(4.0, 3.0 + rise), textcoords="offset points",
            fontsize=7.5,
        )  # fmt: skip


def _rises(
    x: Sequence[float], y: Sequence[float], names: Sequence[str], width: float, height: float
) -> list[float]:
    """How far each name is raised, points, so that none lies on an earlier one."""
    placed, rises = list[tuple[float, float, float]](), list[float]()
    for left, bottom, name in zip(x, y, names, strict=True):
        start, level, rise = left / width * PANEL[0], bottom / height * PANEL[1], 0.0
        end = start + LETTER[0] * len(name)
        while any(start < e and s < end and abs(level + rise - at) < LETTER[1] for s, e, at in placed):
            rise += 1.0
        placed.append((start, end, level + rise))
        rises.append(rise)
    return rises
