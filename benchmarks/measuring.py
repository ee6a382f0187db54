"""What the benchmarks measure with, and the row that each of them prints.

Time is processor time, the least of several rounds: other work on the machine stretches a clock on the wall,
and the least is what the code needs.
"""

from __future__ import annotations

import json
import os
import platform
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Generator, Iterable, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from enum import StrEnum
from importlib import metadata
from pathlib import Path

from cnc_shape.cli import start_quickly

start_quickly()  # as the command line does, before anything heavy is imported

ROOT = Path(__file__).resolve().parent.parent
SHARED = Path(os.environ.get("CNC_SHAPE_SHARED", ROOT.parent / "shared"))
NOT_BUILT = "not built yet"
CNC_SHAPE = (sys.executable, "-m", "cnc_shape")


class Kind(StrEnum):
    """Which number of a row counts, and which way."""

    SHARE = "share"  # ours / peer, at most the budget
    SPEED_UP = "speed-up"  # peer / ours, at least the budget
    LIMIT = "limit"  # ours itself, at most the budget


@dataclass(frozen=True, slots=True)
class Row:
    """One row of the table: our number, the peer's, and what was promised.

    A row without `ours` could not be measured; `note` says why. One without `budget` is for information.
    """

    stage: str
    kind: Kind
    budget: float | None
    peer_name: str = ""
    unit: str = ""
    ours: float | None = None
    peer: float | None = None  # in the unit of `ours`
    note: str = ""

    @property
    def value(self) -> float | None:
        """The number that counts."""
        if self.ours is None or self.kind is Kind.LIMIT:
            return self.ours
        if self.peer is None:
            return None
        return self.peer / self.ours if self.kind is Kind.SPEED_UP else self.ours / self.peer

    @property
    def kept(self) -> bool | None:
        """Whether the budget is kept; None where there is none or nothing was measured."""
        if self.budget is None or self.value is None:
            return None
        return self.value >= self.budget if self.kind is Kind.SPEED_UP else self.value <= self.budget

    def cells(self) -> tuple[str, str, str, str, str, str]:
        """Stage, ours, peer, ratio, budget and verdict, to be read."""
        missing = NOT_BUILT if self.note == NOT_BUILT else "not measured"
        ours = missing if self.ours is None else quantity(self.ours, self.unit)
        told = None if self.peer is None else quantity(self.peer, self.unit)
        peer = ": ".join(part for part in (self.peer_name, told) if part) or "–"
        ratio = "–" if self.value is None or self.kind is Kind.LIMIT else quantity(self.value, "×")
        unit = self.unit if self.kind is Kind.LIMIT else "×"
        sign = "≥" if self.kind is Kind.SPEED_UP else "≤"
        budget = "–" if self.budget is None else f"{sign} {quantity(self.budget, unit)}"
        verdict = {None: "–", True: "kept", False: "missed"}[self.kept]
        return self.stage, ours, peer, ratio, budget, verdict

    def human(self) -> str:
        """One line for a terminal."""
        stage, ours, peer, ratio, budget, verdict = self.cells()
        told = f"{stage}: {ours}; {peer}; {ratio} (budget {budget}): {verdict}"
        return f"{told} [{self.note}]" if self.note else told

    def machine_readable(self) -> str:
        """One line of JSON; `parse` reads it."""
        return json.dumps(asdict(self), ensure_ascii=False)


def parse(line: str) -> Row | None:
    """The row that a line of output holds, or None where it holds another thing."""
    if not line.startswith('{"stage"'):
        return None
    values = json.loads(line)
    return Row(kind=Kind(values.pop("kind")), **values)


def not_built(stage: str, kind: Kind, budget: float, peer_name: str) -> Row:
    """Keep the place of a stage that does not exist yet."""
    return Row(stage, kind, budget, peer_name, note=NOT_BUILT)


def report(rows: Iterable[Row]) -> None:
    """Print every row as soon as it is measured: a line to read and a line to parse."""
    for row in rows:
        print(row.human())
        print(row.machine_readable(), flush=True)


def figures(value: float) -> str:
    """Three significant figures, without an exponent."""
    return f"{value:.0f}" if abs(value) >= 100.0 else f"{value:.3g}"


def quantity(value: float, unit: str) -> str:
    """A number with its unit."""
    return f"{figures(value)} {unit}"


def best_of(rounds: int, call: Callable[[], object]) -> float:
    """Least processor time of `rounds` calls, s, after one that is not counted: it compiles and warms up."""
    call()
    times: list[float] = []
    for _ in range(rounds):
        start = time.process_time()
        call()
        times.append(time.process_time() - start)
    return min(times)


@dataclass(frozen=True, slots=True)
class Usage:
    """What a child process took."""

    cpu: float  # s, user and system
    peak: float  # MB, most resident memory
    output: str  # what it printed
    complaints: str  # what it printed on standard error


def child(
    command: Sequence[str],
    folder: Path,
    *,
    environment: Mapping[str, str | None] | None = None,
    keep: bool = True,
) -> Usage:
    """Run a process to its end and measure it.

    A child starts in its parent's memory, and the system counts that as the child's peak: keep the arrays
    out of a parent that measures memory.

    Parameters
    ----------
    command
        Program and arguments.
    folder
        Where it runs.
    environment
        Variables beside the inherited ones; None takes one away.
    keep
        Whether to keep what it prints; otherwise it goes to the null device.

    Raises
    ------
    RuntimeError
        It did not end well; holds what it said.
    """
    wanted = {**os.environ, "PYTHONPATH": os.pathsep.join(_search_path()), **(environment or {})}
    variables = {name: value for name, value in wanted.items() if value is not None}
    with (
        tempfile.TemporaryFile("w+") as output,
        tempfile.TemporaryFile("w+") as complaints,
        subprocess.Popen(
            command,
            cwd=folder,
            env=variables,
            stdin=subprocess.DEVNULL,
            stdout=output if keep else subprocess.DEVNULL,
            stderr=complaints,
        ) as process,
    ):
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        output.seek(0)
        complaints.seek(0)
        told = Usage(
            usage.ru_utime + usage.ru_stime,
            usage.ru_maxrss * (1.0 if sys.platform == "darwin" else 1024.0) / 1e6,
            output.read(),
            complaints.read(),
        )
    if process.returncode != 0:
        raise RuntimeError(f"{Path(command[0]).name} ended with {process.returncode}: {told.complaints}")
    return told


def _search_path() -> list[str]:
    inherited = os.environ.get("PYTHONPATH", "")
    return [str(ROOT), *inherited.split(os.pathsep)] if inherited else [str(ROOT)]


def best_child(
    rounds: int,
    command: Sequence[str],
    folder: Path,
    *,
    environment: Mapping[str, str | None] | None = None,
) -> Usage:
    """Of `rounds` runs the one with the least processor time."""
    return min(
        (child(command, folder, environment=environment) for _ in range(rounds)), key=lambda used: used.cpu
    )


@contextmanager
def workshop() -> Generator[Path]:
    """Lend a folder that is gone afterwards."""
    with tempfile.TemporaryDirectory(prefix="cnc-shape-benchmark-") as name:
        yield Path(name)


def written(kind: str, blocks: int, folder: Path) -> Path:
    """Write a program by `programs.py`, in a process of its own so that this one stays small."""
    path = folder / f"{kind}-{blocks}.nc"
    script = str(Path(__file__).with_name("programs.py"))
    child([sys.executable, script, kind, str(blocks), str(path)], folder)
    return path


def machine_lines() -> list[str]:
    """Say what was measured on: processor, cores, versions; nothing that names the machine."""
    versions = {name: _version(name) for name in ("numpy", "scipy", "numba", "pandas")}
    told = ", ".join(f"{name} {version}" for name, version in versions.items() if version)
    return [
        f"{_processor()}, {os.cpu_count()} cores, {platform.system()} {platform.machine()}",
        f"Python {platform.python_version()}, {told}",
    ]


def _version(package: str) -> str | None:
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return None


def _processor() -> str:
    try:
        text = Path("/proc/cpuinfo").read_text()
    except OSError:
        return platform.processor() or "unknown processor"
    names = [line.partition(":")[2].strip() for line in text.splitlines() if line.startswith("model name")]
    return names[0] if names else platform.machine()
