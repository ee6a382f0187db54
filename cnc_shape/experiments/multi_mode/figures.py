"""The figures of paper 001, drawn again in their layout: design and amplitudes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cnc_shape.experiments.multi_mode import designs
from cnc_shape.experiments.multi_mode.designs import REAL, with_virtual
from cnc_shape.experiments.multi_mode.stage import stage_run
from cnc_shape.report.figures import path_figure
from cnc_shape.report.style import COLOURS, PATH_COLOUR, WIDTH, look, new_figure, styled
from cnc_shape.shapers import Shaper, cascade, multi_mode, umzv, zv

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

DOTTED = (0, (4, 3))
SEARCHED = (1.2, 1.6, 2.0, 2.5, 3.5, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0)  # Hz, of Fig. 1's points
PANELS = ((3.0, "(a) f* = 3: ZV"), (4.0, "(b) f* = 4"), (5.0, "(c) f* = 5: UMZV"), (6.5, "(d) f* = 6.5"))
EXAMPLE = 4.0  # f* of Fig. 2's sequence


@styled
def shaper_duration() -> Figure:
    """Fig. 1: duration of a shaper for two modes over the frequency of the second."""
    figure, (axes,) = new_figure(WIDTH, 3.6)
    frequency = np.linspace(1.02, 10.0, 600)
    for m in (2, 3):
        axes.plot(frequency, 2.0 * m / (frequency + 1.0), color=PATH_COLOUR, linewidth=0.8,
                  label="2m/(f2 + f1), m = 2, 3" if m == 2 else None)  # fmt: skip
    axes.plot(frequency, 2.0 / (frequency - 1.0), color=PATH_COLOUR, linewidth=0.8, linestyle=DOTTED,
              label="2/(f2 - f1)")  # fmt: skip
    axes.plot(frequency, 0.5 + 0.5 / frequency, **look(2), label="a ZV for each mode")
    axes.plot(frequency, 2.0 / (frequency + 1.0), **look(0), label="2/(f2 + f1)")
    found = [designs.two_modes(ratio).duration for ratio in SEARCHED]
    axes.plot(
        SEARCHED,
        found,
        "o",
        color=COLOURS[0],
        markersize=4.5,
        clip_on=False,
        label="shortest found by search",
    )
    axes.axhline(zv(REAL).duration, **look(1), label="ZV of mode 1 alone")
    axes.set(xlim=(1.0, 10.0), ylim=(0.0, 2.0), xlabel="frequency of mode 2 (Hz)", ylabel="duration (s)")
    axes.set_title("Fig. 1: duration for two modes, the first at 1 Hz")
    axes.legend(loc="upper right", ncols=2)
    return figure


@styled
def impulse_sequence() -> Figure:
    """Fig. 2: three impulses and their places."""
    figure, (axes,) = new_figure(0.6 * WIDTH, 2.6)
    shaper = with_virtual(EXAMPLE)
    _draw_impulses(axes, shaper)
    pairs = zip(shaper.times.tolist(), shaper.amplitudes.tolist(), strict=True)
    for k, (time, amplitude) in enumerate(pairs, start=1):
        axes.annotate(f"A{k}", (time, amplitude), xytext=(7.0, -2.0), textcoords="offset points")
    axes.set_xticks(shaper.times.tolist(), ["0", "t2", "t3"])
    axes.set(xlim=(-0.05, 0.5), ylim=(-0.8, 1.1), xlabel="time (s)", ylabel="amplitude (-)")
    axes.set_title("Fig. 2: the sequence, drawn for f* = 4")
    return figure


@styled
def dimensionless_duration() -> Figure:
    """Fig. 3: duration over the virtual frequency."""
    figure, (axes,) = new_figure(0.75 * WIDTH, 3.2)
    ratio = np.linspace(0.05, 10.0, 400)
    axes.plot(ratio, [with_virtual(f).duration for f in ratio.tolist()], **look(1))
    for f, name in ((1.0, "ZVD"), (3.0, "ZV"), (5.0, "UMZV")):
        duration = with_virtual(f).duration
        axes.plot([f], [duration], "o", color=COLOURS[0], markersize=4.5)
        axes.annotate(name, (f, duration), xytext=(5.0, 5.0), textcoords="offset points")
    axes.set(xlim=(0.0, 10.0), ylim=(0.0, 2.0))
    axes.set(xlabel="virtual frequency f* = fv/fs (-)", ylabel="duration t* = fs t3 (-)")
    axes.set_title("Fig. 3: duration over the virtual frequency")
    return figure


@styled
def shapers_and_commands() -> Figure:
    """Fig. 4: shapers, and a step after them."""
    figure, panels = new_figure(WIDTH, 6.4, len(PANELS), 2, sharex=True)
    for row, (ratio, title) in enumerate(PANELS):
        shaper = with_virtual(ratio)
        left, right = panels[2 * row : 2 * row + 2]
        _draw_impulses(left, shaper)
        left.set_title(f"{title}, impulses" if row else f"Fig. 4: {title}, impulses")
        times = np.concatenate([[-0.1], shaper.times, [0.7]])
        sums = np.concatenate([[0.0], np.cumsum(shaper.amplitudes), [1.0]])
        right.plot(times, sums, drawstyle="steps-post", **look(1))
        right.axhline(1.0, color=PATH_COLOUR, linewidth=0.8, linestyle=DOTTED)
        right.set_title("shaped step")
        for axes in (left, right):
            axes.set(xlim=(-0.1, 0.7), ylim=(-2.4, 1.9))
        left.set_ylabel("amplitude (-)")
        right.set_ylabel("command (-)")
    for axes in panels[-2:]:
        axes.set_xlabel("time (s)")
    return figure


@styled
def amplitudes_over_frequency() -> Figure:
    """Fig. 5: amplitudes over the virtual frequency."""
    figure, (axes,) = new_figure(0.75 * WIDTH, 3.4)
    ratio = np.linspace(0.12, 10.0, 500)
    amplitudes = np.array([with_virtual(f).amplitudes for f in ratio.tolist()])
    axes.plot(ratio, amplitudes[:, 0], **look(1), label="A1 = A3")
    axes.plot(ratio, amplitudes[:, 1], **look(0), label="A2")
    for level in (-1.0, 0.0, 1.0):
        axes.axhline(level, color=PATH_COLOUR, linewidth=0.6)
    for f in (0.5, 2.0, 3.0, 5.0):
        axes.plot([f, f], with_virtual(f).amplitudes[:2], "o", color=PATH_COLOUR, markersize=3.5)
    axes.set(xlim=(0.0, 10.0), ylim=(-5.5, 5.5))
    axes.set(xlabel="virtual frequency f* = fv/fs (-)", ylabel="amplitude (-)")
    axes.set_title("Fig. 5: amplitudes over the virtual frequency")
    axes.legend(loc="upper center", ncols=2)
    return figure


@styled
def amplitudes_over_duration() -> Figure:
    """Fig. 6: amplitudes over the duration."""
    figure, (axes,) = new_figure(0.75 * WIDTH, 3.4)
    duration = np.linspace(0.15, 1.85, 500)
    amplitudes = np.array([with_virtual(2.0 / t - 1.0).amplitudes for t in duration.tolist()])
    axes.plot(duration, amplitudes[:, 0], **look(1), label="A1 = A3")
    axes.plot(duration, amplitudes[:, 1], **look(0), label="A2")
    for level in (-1.0, 0.0, 1.0):
        axes.axhline(level, color=PATH_COLOUR, linewidth=0.6)
    for shaper, name in ((umzv(REAL), "UMZV"), (zv(REAL), "ZV"), (with_virtual(1.0), "ZVD")):
        place = (shaper.duration, float(shaper.amplitudes[0]))
        axes.plot(*[[value] for value in place], "o", color=PATH_COLOUR, markersize=3.5)
        axes.annotate(name, place, xytext=(3.0, 6.0), textcoords="offset points")
    axes.set(xlim=(0.0, 2.0), ylim=(-5.5, 5.5))
    axes.set(xlabel="duration t* = fs t3 (-)", ylabel="amplitude (-)")
    axes.set_title("Fig. 6: amplitudes over the duration")
    axes.legend(loc="upper center", ncols=2)
    return figure


@styled
def two_mode_shapers() -> Figure:
    """Appendix: 30 and 100 Hz, by one ZV for each mode and by three impulses."""
    pair = [designs.SLOW, designs.FAST]
    figure, panels = new_figure(WIDTH, 2.6, 1, 2, sharey=True)
    shown = (("one ZV for each mode", cascade(pair)), ("three impulses for both", multi_mode(pair)))
    for axes, (title, shaper) in zip(panels, shown, strict=True):
        axes.vlines(1e3 * shaper.times, 0.0, shaper.amplitudes, color=COLOURS[1], linewidth=1.6)
        axes.plot(1e3 * shaper.times, shaper.amplitudes, "o", color=COLOURS[1], markersize=4.0)
        axes.axhline(0.0, color=PATH_COLOUR, linewidth=0.6)
        axes.set(xlim=(-1.0, 25.0), ylim=(-0.25, 0.7), xlabel="time (ms)")
        axes.set_title(f"30 and 100 Hz: {title}")
    panels[0].set_ylabel("amplitude (-)")
    return figure


def stage_contour() -> Figure:
    """Beyond the paper: the bracket on the two-mode stage."""
    return path_figure(stage_run())


def _draw_impulses(axes: Axes, shaper: Shaper) -> None:
    """Amplitudes over seconds."""
    axes.vlines(shaper.times, 0.0, shaper.amplitudes, color=COLOURS[1], linewidth=1.6)
    axes.plot(shaper.times, shaper.amplitudes, "o", color=COLOURS[1], markersize=4.0)
    axes.axhline(0.0, color=PATH_COLOUR, linewidth=0.6)
