"""What the servo motors of a case did over time: torque, what their observers made of the load, and gains."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from cnc_shape.arrays import FloatArray
from cnc_shape.pipeline import Run
from cnc_shape.recording import Signals
from cnc_shape.report.figures import worst_rows
from cnc_shape.report.style import COLOURS, PATH_COLOUR, WIDTH, look, new_figure, styled
from cnc_shape.response import MotorSignals

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

DRAWN = 600  # buckets of a line
LOAD: Mapping[str, Any] = {"color": PATH_COLOUR, "linewidth": 2.4, "alpha": 0.6}
TORQUE: Mapping[str, Any] = {"color": COLOURS[4], "linewidth": 0.8}
ESTIMATE: Mapping[str, Any] = {"color": COLOURS[1], "linewidth": 1.1}


def motor_cases(run: Run) -> list[Signals]:
    """The cases whose motors are drawn: the disturbed ones; where there are none, the last."""
    moved = [signals for signals in run.signals if signals.motors is not None]
    disturbed = {case.name for case in run.summary.cases if case.disturbed}
    return [signals for signals in moved if signals.case in disturbed] or moved[-1:]


@styled
def motor_figure(signals: Signals) -> Figure:
    """Torque, load and its estimate of every motor, and below what the compensation made of them.

    Raises
    ------
    ValueError
        A case without servo motors.
    """
    motors = signals.motors
    if motors is None:
        raise ValueError(f"{signals.case=} has no servo motors")
    below = _below(motors)
    count = len(motors.joints)
    figure, axes = new_figure(WIDTH, 0.75 + 1.25 * (count + len(below)), count + len(below), 1, sharex=True)
    for k, (ax, joint) in enumerate(zip(axes, motors.joints, strict=False)):
        _draw(ax, signals.time, motors.load[:, k], "load, injected", LOAD)
        _draw(ax, signals.time, motors.torque[:, k], "torque of the motor", TORQUE)
        if motors.estimate.any():
            _draw(ax, signals.time, motors.estimate[:, k], "load, as the observer sees it", ESTIMATE)
        ax.set_title(f"Motor {joint.upper()}")
        ax.set_ylabel("torque (N m)")
    for ax, (title, label, values) in zip(axes[count:], below, strict=True):
        for k, joint in enumerate(motors.joints):
            _draw(ax, signals.time, values[:, k], f"motor {joint.upper()}", look(k))
        ax.set_title(title)
        ax.set_ylabel(label)
    for ax in axes:
        ax.margins(x=0.0)
    axes[-1].set_xlabel("time (s)")
    _legend(figure, axes[:1] + axes[count : count + 1])
    return figure


def _below(motors: MotorSignals) -> list[tuple[str, str, FloatArray]]:
    """Title, label and values of what is worth a panel of its own: what does not stand still."""
    panels = [
        ("Velocity gain over the nominal one", "gain ratio (-)", motors.gain_ratio),
        ("Effective inertia of the load", "inertia (kg m²)", motors.effective_inertia),
        ("Identified inertia", "inertia (kg m²)", motors.inertia),
    ]
    return [panel for panel in panels if (panel[2] != panel[2][:1]).any()]


def _draw(ax: Axes, time: FloatArray, values: FloatArray, label: str, style: Mapping[str, Any]) -> None:
    rows = worst_rows(values, DRAWN)
    ax.plot(time[rows], values[rows], label=label, **style)


def _legend(figure: Figure, axes: Sequence[Axes]) -> None:
    found = [pair for ax in axes for pair in zip(*ax.get_legend_handles_labels(), strict=True)]
    handles, labels = zip(*found, strict=True)
    figure.legend(handles, labels, loc="outside lower center", ncols=3)
