"""The figures of paper 001, drawn again in their layout: step response and robustness."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cnc_shape.experiments.multi_mode import designs
from cnc_shape.experiments.multi_mode.designs import REAL, with_virtual
from cnc_shape.experiments.surface import surface_figure
from cnc_shape.report.style import COLOURS, PATH_COLOUR, WIDTH, look, new_figure, styled
from cnc_shape.shapers.analysis import residual_vibration

if TYPE_CHECKING:
    from matplotlib.figure import Figure

VIRTUAL = np.linspace(3.0, 10.0, 29)  # Hz, of the surfaces
BANDS = (3.0, 5.0, 7.0, 10.0)  # Hz, of the enlarged curves


@styled
def step_responses() -> Figure:
    """Fig. 7: step response over time and virtual frequency."""
    time = np.linspace(0.0, 1.0, 101)
    position = np.array([designs.response(with_virtual(f), time) for f in VIRTUAL.tolist()])
    labels = ("time (s)", "virtual frequency (Hz)", "response (-)")
    return surface_figure(time, VIRTUAL, position, labels, "Fig. 7: shaped step response", (28.0, -125.0))


@styled
def sensitivity_surface() -> Figure:
    """Fig. 8: vibration left over model error and virtual frequency."""
    ratio = np.linspace(0.8, 1.2, 81)
    left = np.array([residual_vibration(with_virtual(f), REAL, ratio) for f in VIRTUAL.tolist()])
    labels = ("actual / modelled frequency (-)", "virtual frequency (Hz)", "V (%)")
    return surface_figure(ratio, VIRTUAL, 100.0 * left, labels, "Fig. 8: sensitivity", (28.0, -60.0))


@styled
def sensitivity_bands() -> Figure:
    """Fig. 9: sensitivity near the design, and the 5 % bands."""
    figure, (axes,) = new_figure(WIDTH, 3.6)
    ratio = np.linspace(0.955, 1.045, 361)
    for k, f in enumerate(BANDS):
        left = residual_vibration(with_virtual(f), REAL, ratio)
        width = 100.0 * designs.width(f)
        name = "ZV" if f == 3.0 else f"fv = {f:g} Hz"
        axes.plot(ratio, 100.0 * left, **look(k), label=f"{name}: band {width:.2f} % wide")
        found, level = designs.band(f), -0.45 - 0.45 * k
        axes.plot([found.low, found.high or 1.0], [level, level], **look(k), marker="|", markersize=7.0)
    axes.axhline(5.0, color=PATH_COLOUR, linewidth=0.8, linestyle=(0, (4, 3)))
    axes.axhline(0.0, color=PATH_COLOUR, linewidth=0.6)
    axes.set(xlim=(0.955, 1.045), ylim=(-2.2, 9.5), yticks=[0.0, 2.5, 5.0, 7.5])
    axes.set(xlabel="actual / modelled frequency (-)", ylabel="V (%)")
    axes.set_title("Fig. 9: where V is 5 % at most")
    axes.legend(loc="upper center", ncols=2)
    return figure


@styled
def band_width() -> Figure:
    """Fig. 10: width of the 5 % band over the virtual frequency."""
    figure, (axes,) = new_figure(0.75 * WIDTH, 3.2)
    virtual = np.linspace(3.0, 10.0, 71)
    axes.plot(virtual, [designs.width(f) for f in virtual.tolist()], **look(1), label="width of the band")
    axes.plot([3.0, 10.0], [0.064, 0.052], "x", color=COLOURS[0], markersize=7.0, label="in the paper's text")
    limit = float(np.sqrt(1.05) - np.sqrt(0.95))
    axes.axhline(limit, color=PATH_COLOUR, linewidth=0.8, linestyle=(0, (4, 3)), label="limit √1.05 − √0.95")
    axes.set(xlim=(2.8, 10.2), ylim=(0.048, 0.066))
    axes.set(xlabel="virtual frequency (Hz)", ylabel="width of the 5 % band (-)")
    axes.set_title("Fig. 10: robustness over the virtual frequency")
    axes.legend(loc="upper right")
    return figure
