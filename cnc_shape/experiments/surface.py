"""Surfaces in perspective, as the papers draw them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from cnc_shape.arrays import FloatArray
from cnc_shape.report.style import WIDTH, new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FLAT = (1.0, 1.0, 0.0, 0.0)  # the walls behind the surface are clear
MESH = "#00000040"


def surface_figure(
    x: FloatArray,
    y: FloatArray,
    z: FloatArray,
    labels: tuple[str, str, str],
    title: str,
    view: tuple[float, float],
) -> Figure:
    """Draw z (m,n) over x (n,) and y (m,); `view` is elevation and azimuth in degrees."""
    figure, (flat,) = new_figure(0.8 * WIDTH, 4.0)
    flat.remove()
    axes: Any = figure.add_subplot(projection="3d")
    axes.plot_surface(
        *np.meshgrid(x, y), z, cmap="viridis", edgecolor=MESH, linewidth=0.3, rcount=60, ccount=60
    )
    for axis in (axes.xaxis, axes.yaxis, axes.zaxis):
        axis.set_pane_color(FLAT)
    for name in ("x", "y", "z"):
        axes.locator_params(axis=name, nbins=5)
    axes.set(xlabel=labels[0], ylabel=labels[1], zlabel=labels[2], title=title)
    axes.view_init(elev=view[0], azim=view[1])
    axes.set_box_aspect(None, zoom=0.88)
    return figure
