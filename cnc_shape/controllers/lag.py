"""First-order lags, sampled: of currents, of windows, of what is forgotten."""

from __future__ import annotations

from math import exp


def remaining(time_constant: float, period: float) -> float:
    """Share of a lag's error that is left after `period` (s); none where the time constant (s) is 0."""
    return exp(-period / time_constant) if time_constant > 0.0 else 0.0
