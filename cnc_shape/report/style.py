"""How figures look: one palette that colour-blind readers can tell apart, thin lines, byte-stable SVG."""

from __future__ import annotations

from typing import Any

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
