"""Start-up: what a command takes before it has anything to do, and a simulation that is over at once."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from benchmarks.measuring import CNC_SHAPE, Kind, Row, best_child, child, report, workshop, written

ROUNDS = 5
PEER = "python -c pass"
AT_ONCE, WARM = 0.3, 1.0  # s
COMPLETION = {"_CNC_SHAPE_COMPLETE": "complete_bash", "COMP_WORDS": "cnc-shape si", "COMP_CWORD": "1"}


def rows() -> Iterator[Row]:
    """Measure."""
    with workshop() as folder:
        python = best_child(ROUNDS, [sys.executable, "-c", "pass"], folder).cpu
        for words in (["--help"], ["--version"]):
            used = best_child(ROUNDS, [*CNC_SHAPE, *words], folder)
            yield Row(f"start-up, {words[0]}", Kind.LIMIT, AT_ONCE, PEER, "s", used.cpu, python)
        used = best_child(ROUNDS, CNC_SHAPE, folder, environment=COMPLETION)
        if "simulate" not in used.output:
            raise RuntimeError(f"completion of 'si' says {used.output!r}")
        yield Row("start-up, completion", Kind.LIMIT, AT_ONCE, PEER, "s", used.cpu, python)
        tiny = str(written("raster", 1, folder))
        for command in (["check", tiny], ["simulate", tiny]):
            child([*CNC_SHAPE, *command], folder)
            used = best_child(ROUNDS, [*CNC_SHAPE, *command], folder)
            stage = f"start-up, {command[0]} of one line, warm"
            yield Row(stage, Kind.LIMIT, WARM, PEER, "s", used.cpu, python)


if __name__ == "__main__":
    report(rows())
