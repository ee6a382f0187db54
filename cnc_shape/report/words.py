"""A run in words: the verdict in one sentence, the price of shaping, the worst places."""

from __future__ import annotations

import numpy as np

from cnc_shape.pipeline import CaseSummary, Summary
from cnc_shape.recording import Signals
from cnc_shape.report.table import micrometres

WORST_PLACES = 10
APART = 0.02  # share of the motion's time that two worst places lie apart at least


def best_case(summary: Summary) -> CaseSummary:
    """The case with the smallest RMS contour error of the tool."""
    return min(summary.cases, key=lambda case: case.tool.rms)


def verdict(summary: Summary) -> str:
    """What the run says, in one sentence with its numbers."""
    first, best = summary.cases[0], best_case(summary)
    start = (
        f"{_capital(first.name)}, the tool leaves the programmed path by up to {micrometres(first.tool.max)} µm "
        f"({micrometres(first.tool.rms)} µm RMS)"
    )
    if best is first:
        others = "" if len(summary.cases) == 1 else ", and no other case does better"
        return f"{start}{others}; the program takes {first.cycle_time:.3f} s."
    later = best.cycle_time - first.cycle_time
    price = f"{later * 1e3:.0f} ms more" if later >= 5e-4 else "no more time"
    return (
        (
            f"{start}; {best.name}, by up to {micrometres(best.tool.max)} µm ({micrometres(best.tool.rms)} µm RMS), "
            f"{best.tool.rms / first.tool.rms - 1.0:+.0%} in RMS for {price}."
        ).replace("-", "−", 1)
        if best.tool.rms > 0.0
        else f"{start}; {best.name}, it stays on it."
    )


def price_of_shaping(summary: Summary) -> str | None:
    """What shaping costs in corner rounding, where a case is shaped."""
    plain, shaped = (
        summary.cases[0],
        next((c for c in summary.cases if c.name != summary.cases[0].name), None),
    )
    if shaped is None or shaped.cycle_time <= plain.cycle_time:
        return None
    return (
        f"Shaping has its price: the command itself now rounds corners by up to "
        f"{micrometres(shaped.command.max)} µm ({micrometres(plain.command.max)} µm unshaped) and arrives "
        f"{(shaped.cycle_time - plain.cycle_time) * 1e3:.1f} ms later; the vibration left after the end goes from "
        f"{micrometres(max(plain.residual_vibration.values(), default=0.0))} to "
        f"{micrometres(max(shaped.residual_vibration.values(), default=0.0))} µm."
    )


def worst_places(signals: Signals) -> list[tuple[str, ...]]:
    """Rows of the worst places of a case: line, error, time, x, y, z; places apart in time."""
    order = np.argsort(-signals.tool_error, kind="stable")
    apart = APART * float(signals.time[-1] - signals.time[0]) if signals.time.size else 0.0
    picked: list[int] = []
    blocked = np.zeros(signals.time.size, dtype=np.bool_)
    for row in order.tolist():
        if blocked[row]:
            continue
        picked.append(row)
        if len(picked) == WORST_PLACES:
            break
        blocked |= np.abs(signals.time - signals.time[row]) < apart
    return [
        (
            str(int(signals.line[row])),
            micrometres(float(signals.tool_error[row])),
            f"{signals.time[row]:.3f}",
            *(f"{value:.3f}" for value in signals.foot[row].tolist()),
        )
        for row in picked
    ]


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]
