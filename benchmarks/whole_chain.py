"""The whole chain: 200 k lines of a printer's program, one case shaped and simulated, no report.

Processor time of the whole process with warm kernels. The peer plans the same lines and stops there: no
servo, no structure, no contour error. `klipper.py` says how it is measured, and when its number is recorded.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from benchmarks.klipper import peer
from benchmarks.measuring import CNC_SHAPE, Kind, Row, best_child, child, report, workshop, written

LINES = 200_000
ROUNDS = 3


def rows() -> Iterator[Row]:
    """Measure."""
    with workshop() as folder:
        path = written("printer", LINES, folder)
        warm = written("printer", 100, folder)
        bundled: dict[str, str | None] = {"CNC_SHAPE_MACHINE": None}  # the machine that the peer has
        command = [*CNC_SHAPE, "simulate", "--json", "--cases", "shaped"]
        child([*command, str(warm)], folder, environment=bundled)
        used = best_child(ROUNDS, [*command, str(path)], folder, environment=bundled)
        motion = json.loads(used.output)["cycle_time_s"]
        stage = "whole chain, 200 k lines, one case"
        klipper = peer(path, warm, folder, ROUNDS)
        yield Row(stage, Kind.SHARE, 0.5, klipper.name, "s", used.cpu, klipper.cpu, klipper.note)
        yield Row(stage, Kind.SPEED_UP, 500.0, "the motion itself", "s", used.cpu, motion)


if __name__ == "__main__":
    report(rows())
