"""Figs. 1 to 4 of paper 000, drawn again: what a shaper does to a step, and to a wrong model."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cnc_shape.experiments.measuring_machine.tables import EXAMPLE, FAMILY, OFF
from cnc_shape.experiments.surface import surface_figure
from cnc_shape.modes import Mode
from cnc_shape.report.style import COLOURS, PATH_COLOUR, WIDTH, look, new_figure, styled
from cnc_shape.shapers import NONE, zv
from cnc_shape.shapers.analysis import vibration
from cnc_shape.shapers.measures import step_response

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@styled
def shaped_step() -> Figure:
    """Fig. 1: a step, the shaper's impulses, and the two steps that come out."""
    figure, (step, impulses, shaped) = new_figure(WIDTH, 2.3, 1, 3, sharey=True)
    shaper = zv(EXAMPLE)
    for axes, height in ((step, [0.0, 1.0, 1.0]), (shaped, [0.0, *np.cumsum(shaper.amplitudes).tolist()])):
        times = [-0.25, 0.0, shaper.duration]
        axes.plot([*times, 1.0], [*height, height[-1]], drawstyle="steps-post", **look(1))
    impulses.vlines(shaper.times, 0.0, shaper.amplitudes, color=COLOURS[0], linewidth=1.6)
    impulses.plot(shaper.times, shaper.amplitudes, "o", color=COLOURS[0], markersize=4.0)
    impulses.axhline(0.0, color=PATH_COLOUR, linewidth=0.6)
    for axes, title in (
        (step, "Fig. 1: step"),
        (impulses, "convolved with ZV"),
        (shaped, "is the shaped command"),
    ):
        axes.set(xlim=(-0.25, 1.0), ylim=(0.0, 1.15), xlabel="time (s)")
        axes.set_title(title)
    step.set_ylabel("amplitude (-)")
    return figure


@styled
def step_with_and_without() -> Figure:
    """Fig. 2: response to a step, unshaped and through ZV."""
    figure, (axes,) = new_figure(0.75 * WIDTH, 3.0)
    time = np.linspace(0.0, 4.0, 801)
    axes.plot(time, step_response(NONE, [EXAMPLE], time), **look(1), label="unshaped")
    axes.plot(time, step_response(zv(EXAMPLE), [EXAMPLE], time), **look(0), label="ZV")
    axes.set(xlim=(0.0, 4.0), ylim=(0.0, 2.5), xlabel="time (s)", ylabel="response (-)")
    axes.set_title("Fig. 2: step of 1, undamped 1 Hz")
    axes.legend(loc="upper right", ncols=2)
    return figure


@styled
def model_errors() -> Figure:
    """Fig. 3: responses with a model that is exact, and one that is 30 % off."""
    figure, panels = new_figure(WIDTH, 5.0, 2, 1, sharex=True)
    time = np.linspace(0.0, 4.0, 801)
    shown = (
        (1.0, "Fig. 3(a): exact model"),
        (1.0 + OFF, "(b): modelled frequency 30 % above the actual"),
    )
    for axes, (modelled, title) in zip(panels, shown, strict=True):
        model = Mode(modelled * EXAMPLE.natural_frequency, 0.0)
        for k, (name, design) in enumerate(FAMILY.items()):
            axes.plot(time, step_response(design(model), [EXAMPLE], time), **look(k), label=name)
        axes.set(xlim=(0.0, 4.0), ylim=(0.0, 1.7), ylabel="response (-)")
        axes.set_title(title)
        axes.legend(loc="upper right", ncols=3)
    panels[1].set_xlabel("time (s)")
    return figure


@styled
def vibration_surface() -> Figure:
    """Fig. 4: V over frequency ratio and damping."""
    ratio, damping = np.linspace(0.5, 1.5, 61), np.linspace(0.0, 0.3, 31)
    left = 100.0 * vibration(zv(EXAMPLE), EXAMPLE.omega * ratio[None, :], damping[:, None])
    labels = ("frequency ratio ωa/ωm (-)", "damping ratio (-)", "V (%)")
    title = "Fig. 4: vibration left by ZV designed for ζ = 0"
    return surface_figure(ratio, damping, left, labels, title, (28.0, -60.0))
