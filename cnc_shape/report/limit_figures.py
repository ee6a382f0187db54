"""What the planned motion uses of the limits, over time or along the path, and the path with its speed."""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil
from typing import TYPE_CHECKING, Any

import numpy as np

from cnc_shape.arrays import FloatArray, frozen
from cnc_shape.limit_use import Course, LimitUse
from cnc_shape.program import ROTARY
from cnc_shape.report.style import COLOURS, PATH_COLOUR, WIDTH, new_figure, styled

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

DRAWN = 1024  # stretches of a line
HEADROOM = 1.12  # -, of the highest use that is drawn
LIMIT: dict[str, Any] = {"color": "black", "linewidth": 0.8, "linestyle": (0, (4.0, 2.0))}
PROGRAMMED: dict[str, Any] = {"color": "black", "linewidth": 0.9}
SPEED_COLOURS = "viridis"  # as dark to bright to colour-blind readers as to others
RAPID: dict[str, Any] = {"color": PATH_COLOUR, "linewidth": 0.6, "alpha": 0.7}
PATH_WIDTH = 1.3  # point
TALLEST = 0.8  # -, height of a path's picture to its width
WIDE = 0.1  # -, of the highest speed, between slowest and fastest: their mean is drawn as well
MEAN_OF = 8  # stretches
VECTORS = 1_000  # segments of a path that are drawn as such; more become a picture


@styled
def limits_figure(use: LimitUse, *, along_path: bool = False) -> Figure:
    """Feed, and the use of every axis's acceleration and jerk, over time or along the path."""
    course = _thinned(use.along_path if along_path else use.over_time)
    figure, (feed, acceleration, jerk) = new_figure(WIDTH, 5.6, 3, 1, sharex=True)
    bounded = [axis.jerk is not None for axis in use.axes]
    _draw_feed(feed, course, along_path=along_path)
    _draw_share(acceleration, use, course, [True] * len(bounded), course.acceleration)
    _draw_share(jerk, use, course, bounded, course.jerk)
    acceleration.set_title("Use of the acceleration limits")
    acceleration.set_ylabel("share of the limit (-)")
    free = ", ".join(axis.axis.upper() for axis in use.axes if axis.jerk is None)
    jerk.set_title("Use of the jerk limits" + (f"; none for {free}" if free and any(bounded) else ""))
    jerk.set_ylabel("share of the limit (-)")
    if not any(bounded):
        jerk.text(0.5, 0.45, "no jerk limit", transform=jerk.transAxes, ha="center", color=PATH_COLOUR)
        jerk.set_yticks([])
    for ax in (feed, acceleration, *([jerk] if any(bounded) else [])):
        ax.legend(loc="lower right", bbox_to_anchor=(1.0, 0.99), ncols=8, borderaxespad=0.0)
    jerk.set_xlim(0.0, float(course.at[-1] + 0.5 * course.width))
    jerk.set_xlabel("path length (mm)" if along_path else "time (s)")
    figure.align_ylabels()
    return figure


@styled
def speed_figure(use: LimitUse) -> Figure:
    """The planned path, coloured by the speed of the tool; rapids are grey."""
    from matplotlib.collections import LineCollection
    from matplotlib.colors import Normalize

    spread = np.ptp(use.path, axis=0)
    i, j = sorted(np.argsort(-spread, kind="stable")[:2].tolist())
    slope = min(spread[j] / max(spread[i], 1e-9), TALLEST)
    lying = slope < 0.45
    figure, (ax,) = new_figure(WIDTH, slope * (WIDTH - (1.0 if lying else 2.0)) + (1.7 if lying else 0.8))
    figure.set_layout_engine("compressed")
    segments = np.stack([use.path[:-1, [i, j]], use.path[1:, [i, j]]], axis=1)
    ruled = ~use.rapid
    coloured = ruled if ruled.any() else use.rapid
    style: dict[str, Any] = {"rasterized": len(segments) > VECTORS, "capstyle": "round"}
    ax.add_collection(LineCollection(list(segments[~coloured]), **style, **RAPID))
    lines = LineCollection(list(segments[coloured]), linewidth=PATH_WIDTH, cmap=SPEED_COLOURS, **style)
    lines.set_array(use.speed[coloured])
    lines.set_norm(Normalize(0.0, max(float(use.speed[coloured].max(initial=0.0)), 1e-9)))
    ax.add_collection(lines)
    ax.autoscale_view()
    ax.set_aspect("equal", adjustable="box")
    ax.margins(0.04)
    figure.colorbar(
        lines, ax=ax, label="speed of the tool (mm/s)", orientation="horizontal" if lying else "vertical",
        aspect=30, pad=0.02,
    )  # fmt: skip
    ax.set_xlabel(f"{'XYZ'[i]} (mm)")
    ax.set_ylabel(f"{'XYZ'[j]} (mm)")
    ax.set_title("Speed along the planned path" + ("" if coloured.all() else "; rapids are grey"))
    return figure


def _thinned(course: Course) -> Course:
    """At most `DRAWN` buckets: of several neighbours the extremes."""
    group = ceil(course.fastest.size / DRAWN)
    if group == 1:
        return course
    return Course(
        group * course.width, _largest(course.fastest, group), -_largest(-course.slowest, group),
        _largest(course.feed_rate, group), _largest(course.velocity, group),
        _largest(course.acceleration, group), _largest(course.jerk, group), _largest(course.reached, group),
    )  # fmt: skip


def _largest(values: FloatArray, group: int) -> FloatArray:
    """Largest of every `group` rows; nan where all are."""
    count = -(-values.shape[0] // group)
    padded = np.full((count * group, *values.shape[1:]), -np.inf)
    padded[: values.shape[0]] = np.where(np.isnan(values), -np.inf, values)
    largest = padded.reshape(count, group, *values.shape[1:]).max(axis=1)
    return np.where(largest == -np.inf, np.nan, largest)


def _draw_feed(ax: Axes, course: Course, *, along_path: bool) -> None:
    """Speed with its extremes, and with its mean where these are far apart."""
    at, colour = course.at, COLOURS[1]
    highest = max(
        float(np.nanmax(values, initial=0.0, where=np.isfinite(values)))
        for values in (course.fastest, course.feed_rate)
    )
    ax.fill_between(at, course.slowest, course.fastest, color=colour, alpha=0.2, linewidth=0.0)
    ax.plot(at, course.slowest, color=colour, linewidth=0.6)
    ax.plot(at, course.fastest, color=colour, linewidth=0.9, label="tool")
    if np.nanmean(course.fastest - course.slowest) > WIDE * highest:
        ax.plot(*_means(course, along_path=along_path), color=COLOURS[0], linewidth=1.2, label="tool, mean")
    programmed = np.where(np.isfinite(course.feed_rate), course.feed_rate, np.nan)
    if np.isfinite(programmed).any():
        ax.plot(at, programmed, drawstyle="steps-mid", label="programmed feed", zorder=3, **PROGRAMMED)
    ax.set_title("Speed of the tool")
    ax.set_ylabel("speed (mm/s)")
    ax.set_ylim(0.0, HEADROOM * highest if highest > 0.0 else 1.0)


def _means(course: Course, *, along_path: bool) -> tuple[FloatArray, FloatArray]:
    """Middles of longer stretches, and the mean speed in each."""
    ends = np.arange(1, course.reached.size // MEAN_OF + 1) * MEAN_OF
    reached = np.maximum.accumulate(np.nan_to_num(course.reached))[ends - 1]
    gone, width = np.diff(reached, prepend=0.0), MEAN_OF * course.width
    means = width / np.maximum(gone, 1e-12) if along_path else gone / width
    return frozen((ends - 0.5 * MEAN_OF) * course.width), means


def _draw_share(ax: Axes, use: LimitUse, course: Course, drawn: Sequence[bool], values: FloatArray) -> None:
    colours = _colours(use)
    for k, axis in enumerate(use.axes):
        if drawn[k]:
            width = max(1.9 - 0.5 * k, 0.9)  # what lies below stays visible
            ax.plot(course.at, values[:, k], color=colours[k], linewidth=width, label=axis.axis.upper())
    ax.axhline(1.0, label="limit", **LIMIT)
    ax.set_ylim(0.0, HEADROOM * max(float(np.nanmax(values[:, drawn], initial=0.0)), 1.0))


def _colours(use: LimitUse) -> list[str]:
    """Every axis keeps its colour, whichever axes move."""
    order = ("y", "x", "z", *ROTARY)  # X is the blue of the palette
    return [COLOURS[order.index(axis.axis) % len(COLOURS)] for axis in use.axes]
