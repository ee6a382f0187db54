"""The file of a measured load: a CSV of time and torque, each fault at its own line."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Final, NoReturn

from cnc_shape.config.disturbance_models import MAX_ROWS
from cnc_shape.config.yaml_tree import Place, refuse
from cnc_shape.errors import ConfigError, ProgramError
from cnc_shape.readers.source import ReadingLimits, open_source
from cnc_shape.readers.source import lines as numbered

COLUMNS: Final = ("time_s", "torque_nm")
LARGEST: Final = 1e6  # s and N m
MAX_BYTES: Final = 4 << 20

Columns = tuple[tuple[float, ...], tuple[float, ...]]


def read_load_table(source: str, place: Place, key: str, name: str) -> Columns:
    """Return the times, s, and torques, N m, of the table that `key` names at `place` of a machine file.

    Its name is relative to the machine file.

    Raises
    ------
    ConfigError
        No such file, at `place`; a fault in it, at its own line and column.
    """
    path = Path(source).parent / name
    if path.exists() and not path.is_file() and not path.is_dir():
        refuse(source, place, f"{key}: {path}: is a pipe or a device", "give a file that can be read again")
    try:
        # absolute: the name "-" is a file's, too, and not standard input
        with open_source(path.absolute(), ReadingLimits(file_bytes=MAX_BYTES)) as text:
            rows = [(number, line) for number, line in numbered(text) if line.strip()]
    except ProgramError as error:
        if error.line is None:
            refuse(
                source, place, f"{key}: {path}: {error.reason}", "its name is relative to the machine file"
            )
        raise ConfigError(str(path), error.line, error.column, error.reason, hint=error.hint) from None
    return _Table(str(path)).columns(rows)


class _Table:
    """The rows of one file."""

    def __init__(self, name: str) -> None:
        self._name = name

    def columns(self, rows: list[tuple[int, str]]) -> Columns:
        if not rows:
            self._refuse(1, 1, "the table is empty", "begin with the header " + ",".join(COLUMNS))
        order = self._order(*rows[0])
        if len(rows) < 3:
            self._refuse(rows[-1][0], 1, "a table needs two rows", "give the torque at two times or more")
        if len(rows) - 1 > MAX_ROWS:
            number = rows[MAX_ROWS + 1][0]
            reason = f"more than {MAX_ROWS} rows"
            self._refuse(number, 1, reason, "leave rows out: between them the torque is linear")
        times: list[float] = []
        torques: list[float] = []
        for number, line in rows[1:]:
            values = self._values(number, line, order)
            if times and values[0] <= times[-1]:
                reason = f"{values[0]:g} s is not after {times[-1]:g} s"
                self._refuse(number, 1, reason, "sort the rows by time, and keep one of each time")
            times.append(values[0])
            torques.append(values[1])
        return tuple(times), tuple(torques)

    def _order(self, number: int, line: str) -> tuple[str, ...]:
        """Names of the columns as they stand."""
        hint = "name the columns " + ",".join(COLUMNS)
        names: list[str] = []
        for cell, column in _cells(line):
            name = cell.lower()
            if name not in COLUMNS:
                self._refuse(number, column, f"unknown column {cell[:40]!a}", hint)
            if name in names:
                self._refuse(number, column, f"a second column {name}", hint)
            names.append(name)
        if len(names) < len(COLUMNS):
            missing = next(name for name in COLUMNS if name not in names)
            self._refuse(number, 1, f"no column {missing}", hint)
        return tuple(names)

    def _values(self, number: int, line: str, order: tuple[str, ...]) -> tuple[float, float]:
        cells = _cells(line)
        if len(cells) != len(order):
            hint = "every row has one number for each column"
            self._refuse(number, 1, f"{len(cells)} cells, the header has {len(order)}", hint)
        found = dict[str, float]()
        for (cell, column), name in zip(cells, order, strict=True):
            value = _number(cell)
            if value is None:
                self._refuse(
                    number, column, f"{cell[:40]!a} is no number for {name}", "write it as 1.5 or 1e-3"
                )
            if not abs(value) <= LARGEST:
                reason = f"{name} is beyond the limit of {LARGEST:g}"
                self._refuse(number, column, reason, "check the number and its unit")
            found[name] = value
        return found[COLUMNS[0]], found[COLUMNS[1]]

    def _refuse(self, line: int, column: int, reason: str, hint: str) -> NoReturn:
        raise ConfigError(self._name, line, column, reason, hint=hint)


def _cells(line: str) -> list[tuple[str, int]]:
    """Return the cells of a line without the blanks around them, and the columns they begin at."""
    found: list[tuple[str, int]] = []
    at = 1
    for cell in line.split(","):
        found.append((cell.strip(), at + len(cell) - len(cell.lstrip())))
        at += len(cell) + 1
    return found


def _number(cell: str) -> float | None:
    if re.fullmatch(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?", cell, re.ASCII) is None:
        return None
    return float(cell)
