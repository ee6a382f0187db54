"""How figures look: one palette that colour-blind readers can tell apart, thin lines, byte-stable SVG."""

from __future__ import annotations

import functools
import io
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Literal, ParamSpec

from numpy.typing import NDArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

P = ParamSpec("P")
Format = Literal["svg", "png", "pdf"]
WIDTH = 7.2  # inch, two columns of a journal

# Okabe and Ito's palette, ordered so that the first cases contrast most
COLOURS = ("#D55E00", "#0072B2", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
PATH_COLOUR = "#7F7F7F"
GRID_COLOUR = "#7F7F7F33"

RC: Any = {
    "font.family": "DejaVu Sans",
    "font.size": 9.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.7,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": GRID_COLOUR,
    "grid.linewidth": 0.6,
    "axes.titlesize": 9.5,
    "axes.titlelocation": "left",
    "axes.titleweight": "bold",
    "figure.constrained_layout.h_pad": 0.08,  # inch
    "figure.constrained_layout.w_pad": 0.06,  # inch
    "legend.frameon": False,
    "legend.fontsize": 8.5,
    "lines.linewidth": 1.0,
    "svg.hashsalt": "cnc-shape",
    "svg.fonttype": "path",
    "path.simplify": True,
    "axes.formatter.useoffset": False,
    "axes.unicode_minus": True,
}
METADATA: dict[str, Any] = {
    "svg": {"Date": None, "Creator": None},
    "png": {"Software": None},
    "pdf": {"CreationDate": None, "Creator": None, "Producer": None},
}


def look(index: int, width: float | None = None) -> dict[str, Any]:
    """Colour, dash and width of the case at `index`; beyond the palette the colours come again, dashed."""
    turns, place = divmod(index, len(COLOURS))
    return {
        "color": COLOURS[place],
        "linestyle": "-" if turns == 0 else (0, (4.0, 1.5 * turns)),
        "linewidth": width or max(1.5 - 0.25 * index, 0.8),  # what lies below stays visible
    }


def styled(draw: Callable[P, Figure]) -> Callable[P, Figure]:
    """Draw in our own style, whatever the style of the process is."""

    @functools.wraps(draw)
    def styled(*arguments: P.args, **named: P.kwargs) -> Figure:
        import matplotlib as mpl

        with mpl.rc_context(RC):
            return draw(*arguments, **named)

    return styled


def new_figure(
    width: float,
    height: float,
    rows: int = 1,
    columns: int = 1,
    *,
    sharex: bool = False,
    sharey: bool = False,
) -> tuple[Figure, list[Axes]]:
    """A figure without a window, inch by inch, and its axes row by row."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    grid: NDArray[Any] = figure.subplots(rows, columns, squeeze=False, sharex=sharex, sharey=sharey)
    return figure, list(grid.ravel())


def render(figure: Figure, kind: Format) -> bytes:
    """Draw a figure to bytes that depend on nothing but its content."""
    import matplotlib as mpl

    content = io.BytesIO()
    with mpl.rc_context(RC):
        figure.savefig(content, format=kind, metadata=METADATA[kind], dpi=160)
    return content.getvalue()
