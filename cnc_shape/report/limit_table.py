"""The largest use of every limit, axis by axis, as rows of the page and as JSON."""

from __future__ import annotations

from typing import Any

from cnc_shape.limit_use import LimitUse, Peak

QUANTITIES = ("velocity", "acceleration", "jerk")


def limit_rows(use: LimitUse) -> list[tuple[str, tuple[str, ...]]]:
    """Name of each moving axis, and share of the limit in % and source line of each of `QUANTITIES`."""
    return [
        (
            axis.axis.upper(),
            tuple(text for name in QUANTITIES for text in _told(getattr(axis, name))),
        )
        for axis in use.axes
    ]


def feed_words(use: LimitUse) -> str:
    """How near the motion comes to the programmed feed, in a sentence."""
    if use.feed is None:
        return "No feed is programmed: all moves are rapids."
    share, line = _told(use.feed)
    return f"The programmed feed is used up to {share} %, on line {line}."


def limits_json(use: LimitUse) -> dict[str, Any]:
    """One object an axis, and the largest share of the programmed feed; None where there is no limit."""
    axes = {
        axis.axis: {
            **{f"{name}_share": _share(getattr(axis, name)) for name in QUANTITIES},
            "lines": {name: _line(getattr(axis, name)) for name in QUANTITIES},
        }
        for axis in use.axes
    }
    return {**axes, "feed_share": _share(use.feed), "feed_line": _line(use.feed)}


def _told(peak: Peak | None) -> tuple[str, str]:
    return ("–", "–") if peak is None else (f"{100.0 * peak.share:.1f}", str(peak.line))


def _share(peak: Peak | None) -> float | None:
    return None if peak is None else peak.share


def _line(peak: Peak | None) -> int | None:
    return None if peak is None else peak.line
