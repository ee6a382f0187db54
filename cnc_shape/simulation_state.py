"""Where a simulation stands between two chunks."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from cnc_shape.arrays import FloatArray
from cnc_shape.controllers.loop import Memory
from cnc_shape.loading import LoadState
from cnc_shape.servo import copied
from cnc_shape.trajectory import Trajectory
from cnc_shape.windows import WindowState


@dataclass(frozen=True, eq=False, slots=True)
class SimulationState:
    """Where the loop stands between two chunks."""

    loop: Memory
    structure: Memory | None  # of the axes behind the joints; None where these are the axes
    begun: bool  # loop and structure rest where the command begins, or have gone on from there
    held: Trajectory  # samples that wait for the one after them, or for their windows
    ticks: int  # run so far
    before: FloatArray  # (1,j) mm or rad, what the drives were told last; (0,) before the first
    inverse: FloatArray  # (1,c,c) inverse Jacobian in use, (0,c,c) before the first
    windows: WindowState | None
    load: LoadState | None  # None before the first sample
    source: str  # of the toolpath
    settling: FloatArray  # (m,d) mm or rad, tool minus drive at and after the end; (0,d) before

    @property
    def residual(self) -> FloatArray:
        """Largest |tool - drive| of every axis once the command has come to rest, (d,) mm or rad."""
        return np.abs(self.settling).max(axis=0, initial=0.0)


def copied_state(state: SimulationState) -> SimulationState:
    """Copy what the loops change in place, so that the state before stays as it was."""
    bent = None if state.structure is None else copied(state.structure)
    return replace(state, loop=copied(state.loop), structure=bent)
