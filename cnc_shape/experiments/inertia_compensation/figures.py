"""Figures of paper 003, drawn again: observed torque and contour errors; and what it does not show."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from cnc_shape.arrays import FloatArray
from cnc_shape.experiments.inertia_compensation.better import COMPARED, over_variants, unaware, variants
from cnc_shape.experiments.inertia_compensation.loads import PEAK
from cnc_shape.experiments.inertia_compensation.methods import NONE, OURS, PAPER
from cnc_shape.experiments.inertia_compensation.readings import SEEN
from cnc_shape.experiments.inertia_compensation.rig import (
    INERTIA,
    LOADED,
    UNLOADED,
    errors,
    lap,
)
from cnc_shape.experiments.inertia_compensation.studies import AMPLITUDES, SWEPT, loaded
from cnc_shape.program import XYZ
from cnc_shape.report.style import COLOURS, PATH_COLOUR, WIDTH, look, new_figure, styled
from cnc_shape.units import MICROMETRE

if TYPE_CHECKING:
    from matplotlib.figure import Figure

TOGETHER: Final = 16  # samples
LAST: Final = 19.0  # s
SPREAD: Final = 0.32  # of a method's place, over which its variants are spread


def _time(values: FloatArray, every: int = 1) -> FloatArray:
    return LOADED.circle.sample_time * every * np.arange(len(values), dtype=np.float64)


def _highest(values: FloatArray) -> FloatArray:
    """Largest of every few samples: the curve seen from above."""
    return np.maximum.reduceat(values, np.arange(0, values.size, TOGETHER))


@styled
def disturbance_torque() -> Figure:
    """Fig. 6: the load of every axis and what the observer makes of it."""
    figure, panels = new_figure(WIDTH, 4.8, 3, 1, sharex=True, sharey=True)
    motors = lap(LOADED, PAPER).motors
    for column, axes in enumerate(panels):
        load, seen = motors.load[::4, column], motors.estimate[::4, column]
        axes.plot(_time(load, 4), load, color=PATH_COLOUR, linewidth=3.0, alpha=0.5, label="injected")
        axes.plot(_time(seen, 4), seen, **look(column, 1.0), label="observed")
        axes.set_ylabel(f"{XYZ[column]} (N m)")
        axes.legend(loc="upper left")
    panels[0].set_title("Fig. 6: disturbance torque, up to 2.5 N m along the normal; observer of 300 rad/s")
    panels[-1].set(xlim=(0.0, LAST), ylim=(-2.4, 2.4), xlabel="time (s)")
    return figure


@styled
def contour_errors() -> Figure:
    """Fig. 7: contour errors over time."""
    figure, panels = new_figure(WIDTH, 5.0, 2, 1, sharex=True)
    shown = {
        "load, no compensation": lap(LOADED, NONE),
        "load, the paper's compensation": lap(LOADED, PAPER),
        "no load": lap(UNLOADED, NONE),
        "load, our method": lap(LOADED, OURS),
    }
    for k, (name, found) in enumerate(shown.items()):
        distance = _highest(found.distance / MICROMETRE)
        for axes in panels:
            axes.plot(
                _time(distance, TOGETHER), distance, **look(k, 1.1),
                label=f"{name}: {found.rms:.2f}, {found.max:.2f} µm",
            )  # fmt: skip
    panels[0].set(ylim=(0.0, 19.0), ylabel="contour error (µm)")
    panels[1].set(ylim=(0.0, 3.0), xlim=(0.0, LAST), xlabel="time (s)", ylabel="contour error (µm)")
    panels[0].set_title("Fig. 7: contour error on the circle in space (RMS and largest below)")
    panels[1].set_title("the same, closer")
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=2)
    return figure


@styled
def gain_and_inertia() -> Figure:
    """Beyond the paper: what the compensation sees and does."""
    figure, panels = new_figure(WIDTH, 5.2, 3, 1, sharex=True)
    motors = lap(LOADED, PAPER).motors
    inertia = motors.effective_inertia / INERTIA
    for column, name in enumerate(XYZ):
        style = look(column, 1.0)
        panels[0].plot(_time(inertia[::4], 4), inertia[::4, column], **style, label=name)
        panels[1].plot(_time(inertia[::4], 4), motors.gain_ratio[::4, column], **style, label=name)
        felt = np.where(np.abs(motors.estimate[:, column]) > SEEN, motors.agreement[:, column], np.nan)
        panels[2].plot(_time(inertia[::4], 4), felt[::4], **style, label=name)
    panels[0].set_ylabel("Ĵ over J (-)")
    panels[0].set_title("Effective inertia that the load looks like")
    panels[0].legend(loc="upper left", ncols=3)
    panels[1].set_ylabel("gain ratio κ (-)")
    panels[1].set_title("Velocity gain over the nominal one")
    panels[2].set(ylim=(-0.2, 1.6), xlim=(0.0, LAST), ylabel="-A (-)", xlabel="time (s)")
    panels[2].set_title("How much of the contour error the load explains, where it is above 0.5 N m")
    return figure


@styled
def load_sweep() -> Figure:
    """Beyond the paper: contour error over the size of the load, and over the variants."""
    figure, (sweep, spread) = new_figure(WIDTH, 3.7, 1, 2)
    for k, (name, control) in enumerate(SWEPT.items()):
        rms = [errors(loaded(share), control)[0] for share in AMPLITUDES]
        torque = PEAK * np.array(AMPLITUDES)
        sweep.plot(torque, rms, **look(k, 1.3), marker="o", markersize=3.0, label=name)
    sweep.set(xlim=(0.0, 5.1), ylim=(0.0, None), xlabel="largest load (N m)", ylabel="RMS (µm)")
    sweep.set_title("Burst of growing torque")
    sweep.legend(loc="upper left")
    for k, control in enumerate(COMPARED.values()):
        found = [errors(trial, unaware(control, rougher))[0] for trial, rougher in variants()]
        place = k + SPREAD * np.linspace(-1.0, 1.0, len(found))
        spread.plot(place, found, "o", color=COLOURS[k], markersize=3.0)
        worst = over_variants(control).worst_rms
        spread.annotate(
            f"{worst:.2f}", (k, worst), xytext=(0.0, 4.0), textcoords="offset points", ha="center"
        )
    names = ("none", "paper", "constant\n× 2.5", "observer", "observer,\nfed motion", "ours")
    spread.set_xticks(range(len(names)), names, fontsize=7.5)
    spread.set(ylim=(0.07, 9.0), yscale="log", ylabel="RMS (µm)")
    spread.set_yticks([0.1, 0.2, 0.5, 1.0, 2.0, 5.0], ["0.1", "0.2", "0.5", "1", "2", "5"])
    spread.minorticks_off()
    spread.set_title("20 variants and their worst")
    return figure
