"""Paper 002's figures, drawn anew: impulse vectors, sensitivity, steps, the container; and two of our own."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from cnc_shape.experiments.specified_duration.container import Run, motor_gain, run
from cnc_shape.experiments.specified_duration.equations import UNDAMPED, Design, designs
from cnc_shape.experiments.specified_duration.sweep import HALVES, sweep
from cnc_shape.report.style import COLOURS, PATH_COLOUR, WIDTH, look, new_figure, styled
from cnc_shape.shapers import NONE, zv
from cnc_shape.shapers.analysis import residual_vibration
from cnc_shape.shapers.insensitivity import DEFAULT_VIBRATION_TOLERANCE, insensitivity
from cnc_shape.shapers.measures import step_response

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COMPARED: Final = (17, 18, 15, 19, 16)  # Figs 5 and 6, by duration
NAMES: Final = {
    15: "SD 0.8 s", 16: "SD 1.3 s", 17: "SD 0.4 s", 18: "ZV", 19: "ZVD",
    20: "SD 0.35 periods", 21: "SD 0.8 periods", 22: "ZV",
}  # fmt: skip
WATCHED: Final = 6.0  # s, of Fig. 8
SHOWN_DURATIONS: Final = (0.4, 0.6, 0.8, 1.0, 1.3, 1.5, 1.8, 2.0)  # damped periods


@styled
def vector_figure() -> Figure:
    """Impulse vectors that add up to zero (Figs 3a, 3b and 4)."""
    found = designs()
    figure, panels = new_figure(WIDTH, 2.55, 1, 3)
    for axes, number in zip(panels, (15, 16, 17), strict=True):
        _draw_vectors(axes, found[number])
        axes.set_title(f"eq {number}: {NAMES[number]}")
    panels[0].set_ylabel("I sin θ (-)")
    return figure


def _draw_vectors(axes: Axes, design: Design) -> None:
    mode, shaper = design.mode, design.shaper
    magnitude = shaper.amplitudes * np.exp(mode.damping_ratio * mode.omega * shaper.times)
    angle = mode.omega_damped * shaper.times
    reach = 1.4 * float(np.abs(magnitude).max())
    for k, (size, theta) in enumerate(zip(magnitude.tolist(), angle.tolist(), strict=True)):
        outer = (abs(size) * np.cos(theta), abs(size) * np.sin(theta))
        start, end = ((0.0, 0.0), outer) if size > 0.0 else (outer, (0.0, 0.0))
        arrow = {"arrowstyle": "-|>", "color": COLOURS[k], "linewidth": 1.5, "shrinkA": 0.0, "shrinkB": 0.0}
        axes.annotate("", end, start, arrowprops=arrow)
        scale = 1.0 + 0.14 * reach / abs(size)
        above = 0.14 * reach if k == 0 else 0.0  # the first lies on the axis
        axes.text(scale * outer[0], scale * outer[1] + above, f"$I_{k + 1}$", ha="center", va="center")
    axes.axhline(0.0, color=PATH_COLOUR, linewidth=0.6, zorder=0)
    axes.axvline(0.0, color=PATH_COLOUR, linewidth=0.6, zorder=0)
    axes.set_aspect("equal")
    axes.set_xlim(-reach, reach)
    axes.set_ylim(-reach, reach)
    axes.locator_params(nbins=5)
    axes.set_xlabel("I cos θ (-)")


@styled
def sensitivity_figure() -> Figure:
    """V over the error of the frequency (Fig. 5)."""
    found = designs()
    figure, (axes,) = new_figure(WIDTH, 3.6)
    ratio = np.linspace(0.4, 1.8, 1401)
    for k, number in enumerate(COMPARED):
        left = residual_vibration(found[number].shaper, found[number].mode, ratio)
        axes.plot(ratio, 100.0 * left, **look(k), label=NAMES[number])
    axes.axhline(100.0 * DEFAULT_VIBRATION_TOLERANCE, color=PATH_COLOUR, linewidth=0.8, linestyle=(0, (4, 3)))
    axes.set_title("Fig. 5: vibration left where the frequency is off (1 Hz, ζ 0.1)")
    axes.set_xlabel("actual / modelled frequency (-)")
    axes.set_ylabel("V (%)")
    axes.set_ylim(0.0, 70.0)
    axes.margins(x=0.0)
    axes.legend(loc="upper center", bbox_to_anchor=(0.43, 1.0), ncols=3)
    return figure


@styled
def step_figure() -> Figure:
    """Unit steps (Fig. 6)."""
    found = designs()
    figure, (axes,) = new_figure(WIDTH, 3.8)
    time = np.linspace(0.0, 3.0, 3001)
    mode = found[15].mode
    axes.plot(time, step_response(NONE, [mode], time), color=PATH_COLOUR, label="unshaped")
    for k, number in enumerate(COMPARED):
        design = found[number]
        axes.plot(time, step_response(design.shaper, [mode], time), **look(k), label=NAMES[number])
        axes.plot([design.shaper.duration], [1.0], "o", color=look(k)["color"], markersize=4.0)
    axes.set_title("Fig. 6: unit step; the dots mark the duration of each shaper (1 Hz, ζ 0.1)")
    axes.set_xlabel("time (s)")
    axes.set_ylabel("position (-)")
    axes.set_ylim(0.0, 2.0)
    axes.margins(x=0.0)
    axes.legend(loc="upper right", ncols=3)
    return figure


@styled
def transport_figure() -> Figure:
    """The container after a step of 10 cm (Fig. 8), with and without a motor."""
    found = designs()
    figure, panels = new_figure(WIDTH, 5.6, 2, 1, sharex=True)
    for axes, gain, name in (
        (panels[0], None, "a trolley that steps"), (panels[1], motor_gain(), "a trolley with a motor"),
    ):  # fmt: skip
        _draw_run(axes, run(NONE, gain), "unshaped", {"color": PATH_COLOUR})
        for k, number in enumerate((20, 22, 21)):
            shaper = found[number].shaper
            _draw_run(axes, run(shaper, gain), NAMES[number], look(k))
            axes.axvline(shaper.duration, color=look(k)["color"], linewidth=0.7, linestyle=(0, (2, 2)))
        axes.set_title(f"Fig. 8: {name}; dotted: the end of each shaper")
        axes.set_ylabel("container (mm)")
        axes.set_ylim(0.0, 270.0)
    panels[0].legend(loc="upper center", ncols=4)
    panels[1].set_xlabel("time (s)")
    panels[1].set_xlim(0.0, WATCHED)
    return figure


def _draw_run(axes: Axes, moved: Run, label: str, style: dict[str, object]) -> None:
    rows = moved.time <= WATCHED
    time = np.append(moved.time[rows], WATCHED)
    place = np.append(moved.container[rows], moved.container[rows][-1])
    axes.plot(time[::5], place[::5], label=label, **style)  # pyright: ignore[reportArgumentType]


@styled
def duration_figure() -> Figure:
    """Insensitivity and margin over the duration."""
    found = sweep()
    figure, (axes,) = new_figure(WIDTH, 3.8)
    for k, (values, label) in enumerate(
        ((found.width, "width of the band, I$_{0.05}$"), (found.margin, "margin: its nearer end"))
    ):
        axes.plot(found.periods, values, **look(k), marker="o", markersize=2.5, label=label)
    for derivatives, periods in enumerate(HALVES):
        shaper = zv(UNDAMPED, derivatives=derivatives)
        band = insensitivity(shaper, [UNDAMPED])
        width = (band.high or np.inf) - band.low
        axes.plot([periods], [width], "s", color="black", markersize=5.0, fillstyle="none")
        axes.annotate(
            "ZV" + "D" * derivatives, (periods, width), xytext=(0.0, -13.0 if derivatives else 7.0),
            textcoords="offset points", ha="center", fontsize=8.5,
        )  # fmt: skip
    axes.set_title("robustness over the duration, undamped: longer is not always more robust")
    axes.set_xlabel("duration (damped periods)")
    axes.set_ylabel("actual / modelled frequency (-)")
    axes.set_ylim(-0.05, 1.0)
    axes.legend(loc="upper left")
    return figure


@styled
def impulse_figure() -> Figure:
    """Impulses of shapers of growing duration."""
    found = sweep()
    figure, panels = new_figure(WIDTH, 3.8, 2, 4, sharex=True)
    for k, (axes, periods) in enumerate(zip(panels, SHOWN_DURATIONS, strict=True)):
        shaper = found.shapers[found.at(periods)]
        colour = COLOURS[0 if shaper.amplitudes.min() < 0.0 else 1]
        axes.vlines(shaper.times, 0.0, shaper.amplitudes, color=colour, linewidth=1.6)
        axes.plot(shaper.times, shaper.amplitudes, "o", color=colour, markersize=3.5)
        axes.axhline(0.0, color=PATH_COLOUR, linewidth=0.6)
        axes.set_title(f"{found.periods[found.at(periods)]:.2f} periods")
        axes.set_ylim(*((-1.5, 1.7) if shaper.amplitudes.min() < 0.0 else (0.0, 0.6)))
        if k % 4 == 0:
            axes.set_ylabel("amplitude (-)")
        if k >= 4:
            axes.set_xlabel("time (periods)")
    panels[0].set_xlim(-0.1, 2.1)
    return figure
