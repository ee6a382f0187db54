"""Figs. 5 to 13 of paper 000, drawn again: real-time shaping, the stage, the probing cycle."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cnc_shape.experiments.measuring_machine import probing, sampled, stage
from cnc_shape.experiments.straight_motion import move
from cnc_shape.report.style import COLOURS, PATH_COLOUR, WIDTH, look, new_figure, styled
from cnc_shape.shapers import NONE, zv, zvd
from cnc_shape.shapers.discretisation import Interpolation, discretise, worst_residual
from cnc_shape.units import MICROMETRE

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

DOTTED = (0, (4, 3))
INTERVAL = 0.1  # s, of the hand-driven motion; its mode has a period of 1 s
SPEEDS = np.array([2.0, 5.0, 8.0, 9.0, 8.0, 8.0, 8.0, 6.0, 3.0, 1.0])  # mm/s, by hand


@styled
def real_time_buffer() -> Figure:
    """Fig. 5: what the intervals ask, and what the buffer makes of it."""
    figure, (asked, given) = new_figure(WIDTH, 4.2, 2, 1, sharex=True)
    taps = discretise(zv(sampled.MODE), INTERVAL, Interpolation.EXACT, [sampled.MODE])
    asked.bar(np.arange(SPEEDS.size), SPEEDS, width=1.0, align="edge", color=COLOURS[1], edgecolor="white")
    base = np.zeros(SPEEDS.size + int(taps.used[-1]))
    names = ("now, times A1", "from the buffer, times A2")
    for k, name in zip(taps.used.tolist(), names, strict=True):
        part = np.zeros(base.size)
        part[k : k + SPEEDS.size] = taps.weights[k] * SPEEDS
        colour = COLOURS[1] if k == 0 else COLOURS[0]
        given.bar(np.arange(base.size), part, 1.0, base, align="edge", color=colour, edgecolor="white",
                  label=name)  # fmt: skip
        base += part
    for axes, title in ((asked, "Fig. 5: command by hand"), (given, "shaped by ZV, interval by interval")):
        axes.set(ylim=(0.0, 11.0), ylabel="speed (mm/s)", xlim=(0.0, base.size))
        axes.set_title(title)
    given.legend(loc="upper right", ncols=2)
    given.set_xlabel(f"interval (one is {INTERVAL:g} of a period)")
    return figure


@styled
def real_time_error() -> Figure:
    """Fig. 6: position error of a hand-driven motion, without and with shapers."""
    figure, (axes,) = new_figure(WIDTH, 3.2)
    time = np.linspace(0.0, 4.0, 1601)
    mode = sampled.MODE
    for k, (name, shaper) in enumerate((("unshaped", NONE), ("ZV", zv(mode)), ("ZVD", zvd(mode)))):
        sampled_shaper = shaper
        if shaper is not NONE:
            sampled_shaper = discretise(shaper, INTERVAL, Interpolation.EXACT, [mode]).shaper
        motion = sampled.jog(INTERVAL, SPEEDS, sampled_shaper)
        axes.plot(time, motion.deflection([mode], time), **look(k), label=name)
    axes.axhline(0.0, color=PATH_COLOUR, linewidth=0.6)
    axes.set(xlim=(0.0, 4.0), ylim=(-2.6, 3.2), xlabel="time (periods)", ylabel="deflection (mm)")
    axes.set_title("Fig. 6: deflection under the command of Fig. 5")
    axes.legend(loc="upper right", ncols=3)
    return figure


@styled
def cost_of_sampling() -> Figure:
    """Beyond the paper: what is left over the interval, by what becomes of an impulse between samples."""
    figure, (axes,) = new_figure(0.75 * WIDTH, 3.4)
    interval = np.geomspace(0.005, 0.3, 200)
    found = np.geomspace(0.0053, 0.247, 60)
    ways = (("rounded", Interpolation.ROUNDED), ("linear", Interpolation.LINEAR))
    for k, (name, way) in enumerate(ways):
        worst = [100.0 * worst_residual(way, one, sampled.MODE) for one in interval.tolist()]
        axes.plot(interval, worst, **look(k), label=f"{name}: at worst")
        left = [100.0 * sampled.left(one, way) for one in found.tolist()]
        axes.plot(found, left, ".", color=COLOURS[k], markersize=4.0, label=f"{name}: taps")
    axes.axhline(5.0, color=PATH_COLOUR, linewidth=0.8, linestyle=DOTTED)
    axes.annotate("5 %", (0.0052, 5.0), xytext=(0.0, 3.0), textcoords="offset points")
    axes.set(xscale="log", yscale="log", xlim=(0.005, 0.3), ylim=(1e-3, 400.0))
    axes.set(xlabel="interval over period (-)", ylabel="V (%)")
    axes.set_title("What a ZV shaper leaves on a grid (exact taps: nothing)")
    axes.legend(loc="upper left", ncols=2)
    return figure


@styled
def stage_error() -> Figure:
    """Fig. 8: position error of the stage without shaping."""
    figure, (axes,) = new_figure(WIDTH, 2.9)
    _draw_stage_errors(axes, ("unshaped",))
    axes.set_title("Fig. 8: position error, unshaped (dashed: end of the move)")
    return figure


@styled
def stage_velocity() -> Figure:
    """Fig. 9: velocity profiles, unshaped and shaped."""
    figure, (whole, close) = new_figure(WIDTH, 3.0, 1, 2)
    for axes in (whole, close):
        time = np.linspace(-0.02, 0.35, 3001)
        for k, (name, shaper) in enumerate(stage.shapers().items()):
            axes.plot(time, stage.unshaped_move().shaped(shaper).velocity(time), **look(k), label=name)
        axes.set_xlabel("time (s)")
    whole.set(xlim=(-0.02, 0.35), ylim=(0.0, 720.0), ylabel="velocity (mm/s)")
    whole.set_title("Fig. 9: velocity of the command")
    whole.legend(loc="upper left", ncols=2)
    close.set(xlim=(0.0, 0.05), ylim=(0.0, 250.0), ylabel="velocity (mm/s)")
    close.set_title("its beginning")
    return figure


@styled
def stage_errors() -> Figure:
    """Fig. 10: position errors with and without shaping."""
    figure, (axes,) = new_figure(WIDTH, 3.4)
    _draw_stage_errors(axes, tuple(stage.shapers()))
    axes.set_title("Fig. 10: position error, unshaped and shaped (dashed: end of the unshaped move)")
    return figure


def _draw_stage_errors(axes: Axes, names: tuple[str, ...]) -> None:
    time = np.linspace(0.0, 0.6, 4001)
    shapers = stage.shapers()
    for k, name in enumerate(names):
        motion = stage.unshaped_move().shaped(shapers[name])
        bent = motion.deflection(stage.axis_modes(), time)
        axes.plot(time, -bent / MICROMETRE, **look(k), label=name)
    axes.axhline(0.0, color=PATH_COLOUR, linewidth=0.6)
    axes.axvline(stage.unshaped_move().end, color=PATH_COLOUR, linewidth=0.8, linestyle=DOTTED)
    axes.set(xlim=(0.0, 0.6), xlabel="time (s)", ylabel="command − tool (µm)")
    low, high = axes.get_ylim()
    axes.set_ylim(low, high + 0.25 * (high - low))
    if len(names) > 1:
        axes.legend(loc="upper right", ncols=3)


@styled
def probe_position() -> Figure:
    """Fig. 12: position of the probe during a measurement."""
    figure, (whole, close) = new_figure(WIDTH, 3.2, 1, 2)
    start = probing.approach_start(NONE)
    approach = move(*probing.APPROACH, start=start)
    cycle = probing.whole_cycle(NONE)
    time = np.linspace(0.0, cycle.end + 0.05, 3001)
    for axes in (whole, close):
        axes.plot(time, cycle.position(time), **look(1))
        for edge in (probing.GROSS.end, start, approach.end):
            axes.axvline(edge, color=PATH_COLOUR, linewidth=0.8, linestyle=DOTTED)
        axes.set_xlabel("time (s)")
    edges = (0.0, probing.GROSS.end, start, approach.end, cycle.end)
    names = ("gross move", "pause", "approach", "retract")
    for low, high, name in zip(edges, edges[1:], names, strict=False):
        axes, level = (whole, 57.0) if name == "gross move" else (close, 55.3)
        axes.text(0.5 * (low + high), level, name, ha="center", va="bottom",
                  rotation=0 if name in ("gross move", "approach") else 90)  # fmt: skip
    whole.set(xlim=(0.0, cycle.end + 0.05), ylim=(0.0, 64.0), ylabel="position (mm)")
    whole.set_title("Fig. 12: probing cycle")
    close.set(xlim=(0.55, cycle.end + 0.05), ylim=(48.5, 58.0), ylabel="position (mm)")
    close.set_title("its end")
    return figure


@styled
def probe_deflection() -> Figure:
    """Fig. 13: deflection in pause and approach, unshaped and shaped."""
    figure, (wide, near) = new_figure(WIDTH, 5.2, 2, 1, sharex=True)
    shapers = {name: probing.shapers()[name] for name in ("unshaped", "ZV", "ZVD")}
    time = probing.GROSS.end + np.linspace(-0.12, 0.48, 3001)
    for k, (name, shaper) in enumerate(shapers.items()):
        bent = probing.whole_cycle(shaper).deflection([probing.COLUMN], time) / MICROMETRE
        label = name if shaper is NONE else f"{name}: approach {1e3 * shaper.duration:.0f} ms later"
        for axes in (wide, near):
            axes.plot(1e3 * (time - probing.GROSS.end), bent, **look(k), label=label)
    for axes, height in ((wide, 140.0), (near, 26.0)):
        axes.axhline(0.0, color=PATH_COLOUR, linewidth=0.6)
        for edge in (0.0, 1e3 * probing.PAUSE):
            axes.axvline(edge, color=PATH_COLOUR, linewidth=0.8, linestyle=DOTTED)
        axes.set(xlim=(-120.0, 480.0), ylim=(-0.8 * height, height), ylabel="deflection (µm)")
    wide.set_title("Fig. 13: deflection of the probe (dashed: pause of the unshaped cycle)")
    wide.legend(loc="upper right", ncols=3)
    near.set_title("the same, closer")
    near.set_xlabel("time from the end of the unshaped gross move (ms)")
    return figure
