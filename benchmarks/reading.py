"""Reading plain blocks: ``cnc-shape check``, the whole process, against LinuxCNC's own interpreter."""

from __future__ import annotations

import shutil
import sys
from collections.abc import Iterator
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from benchmarks.measuring import (
    CNC_SHAPE,
    Kind,
    Row,
    best_child,
    child,
    not_built,
    report,
    workshop,
    written,
)

BLOCKS = 1_000_000
MIXED_BLOCKS = 200_000
ROUNDS = 3
RECORDED = 272e3  # blocks/s of rs274, where it is not installed


def interpreter(path: Path, folder: Path) -> float | None:
    """Processor time of rs274 on a program, s; None where it is not installed."""
    if shutil.which("rs274") is None:
        return None
    command = ["rs274", "-g", str(path)]
    return min(child(command, folder, keep=False).cpu for _ in range(ROUNDS))


def compare(stage: str, kind: str, blocks: int, budget: float | None, folder: Path) -> Row:
    """Read a program of `blocks` blocks by both."""
    path = written(kind, blocks, folder)
    command = [*CNC_SHAPE, "check", "--json", str(path)]
    child(command, folder)  # what has to be compiled is compiled now
    ours = best_child(ROUNDS, command, folder).cpu
    peer, name, note = interpreter(path, folder), "rs274", f"{blocks / ours / 1e3:.0f} k blocks/s"
    if peer is None:
        peer, name = blocks / RECORDED, "rs274 (recorded)"
        note += "; rs274 is not installed (Debian: linuxcnc-uspace)"
    return Row(stage, Kind.SHARE, budget, name, "s", ours, peer, note)


def rows() -> Iterator[Row]:
    """Measure."""
    with workshop() as folder:
        yield compare("read G-code, 1 M plain blocks", "raster", BLOCKS, 0.4, folder)
        yield compare("read G-code, 200 k lines, arcs, dwells", "mixed", MIXED_BLOCKS, None, folder)
    yield not_built("read G-code, expressions, O-words, cycles", Kind.SHARE, 10.0, "rs274")


if __name__ == "__main__":
    report(rows())
