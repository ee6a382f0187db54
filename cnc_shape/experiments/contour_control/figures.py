"""Figures of paper 004, drawn again: the machine, the fan, its feed, responses and errors."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from cnc_shape.arrays import FloatArray
from cnc_shape.experiments.contour_control.comparisons import BEST
from cnc_shape.experiments.contour_control.contours import FAN, FEED_RATE, contours
from cnc_shape.experiments.contour_control.laws import (
    COMMON,
    COMPARED,
    INDEPENDENT,
    PAPER,
    SAME_LOOP,
    fed,
    foot,
    tangent,
)
from cnc_shape.experiments.contour_control.rigs import (
    CUBIC,
    HALF_WIDTH,
    RAILS,
    SMOOTH,
    TOOL_OFFSET,
    Result,
    errors,
    run,
)
from cnc_shape.experiments.contour_control.time_law import chord_speeds, speed_along
from cnc_shape.report.style import COLOURS, PATH_COLOUR, WIDTH, look, new_figure, styled
from cnc_shape.units import MICROMETRE

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SHOWN: Final = {
    "independent": INDEPENDENT,
    "tangent, Kc 10": PAPER,
    "foot point, Kc 10, feedforward": SAME_LOOP,
}
MAGNIFIED: Final = 25.0
TRAVEL: Final = 70.0  # mm of rail drawn to both sides of home
DETAIL: Final = 0.3  # mm to both sides
TOGETHER: Final = 16  # samples
GAINS: Final = (5.0, 6.5, 8.0, 10.0, 12.0, 15.0, 20.0, 30.0, 40.0, 60.0, 80.0, 120.0, 160.0, 240.0, 320.0)


@cache
def responses() -> dict[str, Result]:
    """The fan on the cubic machine under the controllers that are shown."""
    return {name: run(CUBIC, "fan", control) for name, control in SHOWN.items()}


@styled
def machine() -> Figure:
    """Fig. 3: the cubic machine at home."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(0.8 * WIDTH, 4.6))
    FigureCanvasAgg(figure)
    axes: Any = figure.add_axes((0.02, 0.0, 0.96, 0.95), projection="3d")
    centre = -np.array(TOOL_OFFSET)
    for k in range(6):
        d, length = RAILS.direction[k], float(RAILS.link_length[k])
        end = RAILS.platform_point[k] + centre
        slider = end - length * d
        rail = np.array([slider - TRAVEL * d, slider + TRAVEL * d])
        axes.plot(*rail.T, color=PATH_COLOUR, linewidth=4.0, alpha=0.5)
        axes.plot(*np.array([slider, end]).T, color=COLOURS[k // 2], linewidth=1.6)
        axes.plot(*slider[:, None], "s", color=COLOURS[k // 2], markersize=5.0)
        axes.plot(*end[:, None], "o", color=COLOURS[k // 2], markersize=4.0)
        axes.text(*(slider - 30.0 * d), f"q{k + 1}", fontsize=9.0)
    for side in ((0, 2, 4), (1, 3, 5)):
        ring = (RAILS.platform_point[[*side, side[0]]] + centre).T
        axes.plot(*ring, color="black", linewidth=0.8)
    for k in range(6):
        axes.plot(*np.array([RAILS.platform_point[k] + centre, centre]).T, color="black", linewidth=0.8)
    axes.plot(*np.array([centre, np.zeros(3)]).T, color="black", linewidth=2.5)
    fan = contours()["fan"]
    path = fan.at(np.linspace(0.0, fan.length, 600)).position
    axes.plot(*path.T, color=COLOURS[3], linewidth=1.2)
    axes.set(xlabel="x (mm)", ylabel="y (mm)", zlabel="z (mm)")
    axes.set_aspect("equal")
    axes.view_init(24.0, 40.0)
    axes.set_box_aspect(None, zoom=0.97)
    axes.set_title(f"Fig. 3: six sliders, links of 300 mm, platform of ±{HALF_WIDTH:g} mm", loc="left")
    return figure


@styled
def fan_and_feed() -> Figure:
    """Fig. 4: the contour with its points, and the feed along it."""
    figure, (shape, feed) = new_figure(WIDTH, 3.5, 1, 2)
    fan = contours()["fan"]
    path = fan.at(np.linspace(0.0, fan.length, 3000)).position
    points = np.array(FAN)
    shape.plot(path[:, 0], path[:, 1], color=COLOURS[1])
    shape.plot(points[:, 0], points[:, 1], "o", color=COLOURS[1], markersize=3.0)
    shape.plot(*points[0], "o", color=COLOURS[0], markersize=5.0)
    shape.annotate("start", points[0], xytext=(8.0, -3.0), textcoords="offset points")
    shape.set(xlabel="x (mm)", ylabel="y (mm)", aspect="equal")
    shape.set_title("Fig. 4: fan, 33 points")
    law = speed_along(fan, SMOOTH)
    allowed = chord_speeds(fan, law.arc_length, SMOOTH)
    feed.plot(law.arc_length, np.minimum(allowed, 60.0), **look(1, 0.9), label="allowed by 1 µm, every 8 ms")
    feed.plot(law.arc_length, law.speed, **look(0, 1.3), label="run")
    feed.set(xlim=(0.0, fan.length), ylim=(0.0, 30.0), xlabel="arc length (mm)", ylabel="feed (mm/s)")
    feed.set_title(f"Feed: {FEED_RATE:g} mm/s, less where it curves")
    feed.legend(loc="lower center")
    return figure


@styled
def magnified_response() -> Figure:
    """Fig. 5: the responses, their errors magnified, and a detail as it is."""
    figure, (whole, detail) = new_figure(WIDTH, 4.0, 1, 2)
    fan = contours()["fan"]
    path = fan.at(np.linspace(0.0, fan.length, 6000)).position
    for axes in (whole, detail):
        axes.plot(path[:, 0], path[:, 1], color=PATH_COLOUR, linewidth=3.5, alpha=0.5, label="contour")
        axes.set(aspect="equal", xlabel="x (mm)", ylabel="y (mm)")
    law = speed_along(fan, SMOOTH)
    middle = fan.at(law.arc_length[[np.argmin(law.limit)]]).position[0]
    for k, (name, result) in enumerate(responses().items()):
        foot_point, tool = result.error.foot, result.response.position
        shown = foot_point + MAGNIFIED * (tool - foot_point)
        whole.plot(shown[:, 0], shown[:, 1], **look(k), label=name)
        detail.plot(tool[:, 0], tool[:, 1], **look(k), label=name)
    detail.set(xlim=(middle[0] - DETAIL, middle[0] + DETAIL), ylim=(middle[1] - DETAIL, middle[1] + DETAIL))
    whole.set_title(f"Fig. 5: errors {MAGNIFIED:g} times")
    detail.set_title("where it curves most, as it is")
    handles, labels = whole.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=4)
    return figure


@styled
def contour_errors() -> Figure:
    """Fig. 6: contour errors over time."""
    figure, panels = new_figure(WIDTH, 4.4, 2, 1, sharex=True)
    shown = {**SHOWN, "foot point, Kc 80, one model for all": COMPARED[BEST]}
    for k, (name, control) in enumerate(shown.items()):
        result = responses().get(name) or run(CUBIC, "fan", control)
        distance = _highest(result.error.distance / MICROMETRE)
        time = SMOOTH.sample_time * TOGETHER * np.arange(distance.size)
        for axes in panels:
            axes.plot(time, distance, **look(k, 1.0), label=f"{name}: {result.rms:.2f} µm RMS")
    panels[0].set(ylim=(0.0, 80.0), ylabel="contour error (µm)")
    panels[1].set(ylim=(0.0, 10.0), xlim=(0.0, 16.5), xlabel="time (s)", ylabel="contour error (µm)")
    panels[0].set_title("Fig. 6: contour error on the fan")
    panels[1].set_title("the same, closer")
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=2)
    return figure


def _highest(values: FloatArray) -> FloatArray:
    """Largest of every few samples: the curve seen from above."""
    return np.maximum.reduceat(values, np.arange(0, values.size, TOGETHER))


@styled
def gain_sweep() -> Figure:
    """Beyond the paper: RMS over the cross-coupling gain."""
    figure, (axes,) = new_figure(0.85 * WIDTH, 3.8)
    shown = (
        ("tangent", tangent, INDEPENDENT),
        ("foot point", foot, INDEPENDENT),
        ("feedforward, tangent", tangent, fed(COMMON)),
        ("feedforward, foot point", foot, fed(COMMON)),
    )
    for k, (name, coupled, base) in enumerate(shown):
        rms = [errors(CUBIC, "fan", coupled(gain, base))[0] for gain in GAINS]
        axes.plot(GAINS, rms, **look(k, 1.3), marker="o", markersize=3.0, label=name)
    for base, name in ((INDEPENDENT, "independent"), (fed(COMMON), "feedforward alone")):
        level, _ = errors(CUBIC, "fan", base)
        axes.axhline(level, color=PATH_COLOUR, linewidth=0.9, linestyle=(0, (4, 3)))
        axes.annotate(name, (330.0, level), xytext=(0.0, 3.0), textcoords="offset points", ha="right")
    axes.set(xscale="log", yscale="log", xlim=(4.7, 340.0), ylim=(0.15, 60.0))
    axes.set_xticks([5.0, 10.0, 20.0, 40.0, 80.0, 160.0, 320.0], ["5", "10", "20", "40", "80", "160", "320"])
    axes.set_yticks(
        [0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0], ["0.2", "0.5", "1", "2", "5", "10", "20", "50"]
    )
    axes.minorticks_off()
    axes.set(xlabel="cross-coupling gain Kc (1/s)", ylabel="contour error, RMS (µm)")
    axes.set_title("The fan on the cubic machine, Kp = 20 1/s")
    axes.legend(loc="lower left", ncols=2)
    return figure
