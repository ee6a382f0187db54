"""Samples of a command as CSV or numpy archive, read back and compared before anybody sees them.

A command comes as blocks, and goes out block by block: a motion of any length is written in the memory
of one block. While the values go out they are hashed; the finished file is read back under its hidden
name, parsed and hashed again, and appears under its own name only if both agree.

Linear axes are written in mm, rotary ones in degrees, each column's unit in its name.
"""

from __future__ import annotations

import hashlib
import tempfile
import zipfile
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import BinaryIO

import numpy as np
from numpy.lib import format as npy

from cnc_shape.arrays import FloatArray
from cnc_shape.errors import InfeasibleError, OutputError
from cnc_shape.program import ROTARY
from cnc_shape.trajectory import Trajectory
from cnc_shape.units import DEGREE
from cnc_shape.writers.archive import NO_TIME
from cnc_shape.writers.publish import publishing
from cnc_shape.writers.spool import temporary_refusal

Write = Callable[[bytes], object]

TIME_DECIMALS = 12  # a time that is this decimal but for rounding is written as the decimal: 0.009
CHUNK = 1 << 20  # bytes that are read back at a time
MOTION_UNITS = {"position": ("mm", "deg"), "velocity": ("mm_s", "deg_s"), "acceleration": ("mm_s2", "deg_s2")}


def sample_times(first: int, count: int, sample_time: float) -> FloatArray:
    """Times of the samples `first`, `first` + 1, ..., (count,) s, without the noise of the multiplication."""
    times = np.arange(first, first + count, dtype=np.float64) * sample_time
    decimal = np.round(times, TIME_DECIMALS)
    return np.where(np.abs(decimal - times) <= 2.0 * np.spacing(times), decimal, times)


def degrees(angles: FloatArray) -> FloatArray:
    """Angles in degrees; times `DEGREE` they are the same bits again, where there is such a number."""
    best = angles / DEGREE
    for neighbour in (np.nextafter(best, -np.inf), np.nextafter(best, np.inf)):
        best = np.where((best * DEGREE != angles) & (neighbour * DEGREE == angles), neighbour, best)
    return best


def csv_header(axes: Sequence[str]) -> str:
    """Names of the columns with their units: ``time_s,x_mm,y_mm,a_deg``."""
    return ",".join(["time_s", *(f"{axis}_{'deg' if axis in ROTARY else 'mm'}" for axis in axes)])


def write_csv(path: Path | str, blocks: Iterable[Trajectory], *, force: bool = False) -> int:
    """Write the positions of a command as CSV; return how many samples there are.

    Parameters
    ----------
    path
        The file to make.
    blocks
        Consecutive blocks of one command, at least one.
    force
        Replace an existing file.

    Returns
    -------
    int
        Number of samples written.

    Raises
    ------
    OutputError
        The file cannot be written there, or what was read back is not what was written.
    InfeasibleError
        A value that is not finite; it names the axis and the time.
    """
    with publishing(path, force=force) as file:
        count, written = stream_csv(file.write, blocks)
        file.flush()
        _compare(path, written, _csv_digest, Path(file.name))
    return count


def stream_csv(write: Write, blocks: Iterable[Trajectory]) -> tuple[int, bytes]:
    """Write the CSV lines of `blocks`, for standard output; return the number of samples and their hash."""
    digest, count = hashlib.sha256(), 0
    for index, block in enumerate(blocks):
        if index == 0:
            write((csv_header(block.axes) + "\n").encode("ascii"))
        table = np.column_stack([sample_times(count, len(block), block.sample_time), positions(block, count)])
        digest.update(table.tobytes())
        write("".join([",".join(map(repr, row)) + "\n" for row in table.tolist()]).encode("ascii"))
        count += len(block)
    return count, digest.digest()


def write_npz(path: Path | str, blocks: Iterable[Trajectory], *, force: bool = False) -> int:
    """Write a command as numpy archive: time, then position, velocity and acceleration; return the samples.

    The archive holds ``time_s (n,)``, ``linear_axes``, ``position_mm``, ``velocity_mm_s``,
    ``acceleration_mm_s2 (n, linear axes)`` and, where an axis turns, the same as ``rotary_axes``,
    ``position_deg`` and so on. It is not compressed and holds no date: the same command gives the same bytes.

    Raises
    ------
    OutputError
        The file cannot be written there, or what was read back is not what was written.
    InfeasibleError
        A value that is not finite; it names the axis and the time.
    """
    with publishing(path, force=force) as file:
        count, written = stream_npz(file, blocks)
        file.flush()
        _compare(path, written, _npz_digest, Path(file.name))
    return count


def stream_npz(file: BinaryIO, blocks: Iterable[Trajectory]) -> tuple[int, bytes]:
    """Write the archive of `blocks` into an open file; return the number of samples and the arrays' hash.

    The columns grow side by side on the disk, because an archive holds one whole array after the other.
    """
    columns: dict[str, _Column] = {}
    count = 0
    axes: tuple[str, ...] = ()
    try:
        for block in blocks:
            axes = block.axes
            for name, values in _arrays(block, count):
                if name not in columns:
                    columns[name] = _Column(values.shape[1:])
                columns[name].append(values)
            count += len(block)
        digest = hashlib.sha256()
        with zipfile.ZipFile(file, "w", zipfile.ZIP_STORED) as archive:
            for name, names in _axis_names(axes):
                with archive.open(_entry(name), "w") as entry:
                    npy.write_array(entry, np.array(names), allow_pickle=False)
            for name, column in columns.items():
                with archive.open(_entry(name), "w", force_zip64=column.bytes >= 1 << 30) as entry:
                    column.copy(entry.write, digest.update)
    finally:
        for column in columns.values():
            column.close()
    return count, digest.digest()


class _Column:
    """One array of the archive while its length is not known: rows in a nameless file."""

    def __init__(self, width: tuple[int, ...]) -> None:
        self._width = width
        self._file = tempfile.TemporaryFile()  # noqa: SIM115 (it lives as long as the column)
        self.bytes = 0

    def append(self, values: FloatArray) -> None:
        try:
            self.bytes += self._file.write(np.ascontiguousarray(values).tobytes())
        except OSError as fault:
            raise temporary_refusal(fault) from fault

    def copy(self, *sinks: Callable[[bytes], object]) -> None:
        rows = self.bytes // (8 * int(np.prod(self._width, dtype=np.int64)))
        header = {"descr": "<f8", "fortran_order": False, "shape": (rows, *self._width)}
        npy.write_array_header_1_0(_Writer(sinks[0]), header)  # pyright: ignore[reportArgumentType]
        self._file.seek(0)
        for chunk in iter(lambda: self._file.read(CHUNK), b""):
            for sink in sinks:
                sink(chunk)

    def close(self) -> None:
        self._file.close()


class _Writer:
    """The part of a file that numpy's header needs."""

    def __init__(self, write: Callable[[bytes], object]) -> None:
        self.write = write


def _entry(name: str) -> zipfile.ZipInfo:
    entry = zipfile.ZipInfo(name + ".npy", date_time=NO_TIME)
    entry.create_system = 3  # whatever the system: the same bytes
    entry.external_attr = 0o644 << 16
    return entry


def _split(axes: Sequence[str]) -> tuple[list[int], list[int]]:
    linear = [k for k, axis in enumerate(axes) if axis not in ROTARY]
    return linear, [k for k, axis in enumerate(axes) if axis in ROTARY]


def _axis_names(axes: Sequence[str]) -> Iterator[tuple[str, list[str]]]:
    for name, columns in zip(("linear_axes", "rotary_axes"), _split(axes), strict=True):
        if columns:
            yield name, [axes[k] for k in columns]


def _arrays(block: Trajectory, first: int) -> Iterator[tuple[str, FloatArray]]:
    yield "time_s", sample_times(first, len(block), block.sample_time)
    linear, rotary = _split(block.axes)
    for signal, (linear_unit, rotary_unit) in MOTION_UNITS.items():
        values: FloatArray = getattr(block, signal)
        _require_finite(block, values, signal, first)
        if linear:
            yield f"{signal}_{linear_unit}", values[:, linear]
        if rotary:
            yield f"{signal}_{rotary_unit}", degrees(values[:, rotary])


def positions(block: Trajectory, first: int) -> FloatArray:
    """Return the positions of a block in mm and degrees, (n,d); `first`: number of its first sample.

    Raises
    ------
    InfeasibleError
        A value that is not finite.
    """
    _require_finite(block, block.position, "position", first)
    _, rotary = _split(block.axes)
    values = block.position.copy()
    values[:, rotary] = degrees(values[:, rotary])
    return values


def _require_finite(block: Trajectory, values: FloatArray, signal: str, first: int) -> None:
    bad = np.argwhere(~np.isfinite(values))
    if bad.size:
        row, column = bad[0].tolist()
        time = (first + row) * block.sample_time
        raise InfeasibleError(
            f"the {signal} of {block.axes[column].upper()} is {values[row, column]} at t = {time:.6g} s",
            hint="nothing was written; check the shapers and limits of this axis",
        )


def _csv_digest(path: Path) -> bytes:
    digest = hashlib.sha256()
    with path.open("rb") as file:
        file.readline()
        while lines := file.readlines(CHUNK):
            digest.update(np.array([line.split(b",") for line in lines]).astype(np.float64).tobytes())
    return digest.digest()


def _npz_digest(path: Path) -> bytes:
    digest = hashlib.sha256()
    with zipfile.ZipFile(path) as archive:
        for name in archive.namelist():
            with archive.open(name) as entry:
                npy.read_magic(entry)
                _, _, dtype = npy.read_array_header_1_0(entry)
                for chunk in iter(lambda entry=entry: entry.read(CHUNK), b""):
                    if dtype == np.float64:
                        digest.update(chunk)
    return digest.digest()


def _compare(path: Path | str, written: bytes, digest: Callable[[Path], bytes], temporary: Path) -> None:
    try:
        read = digest(temporary)
    except (ValueError, zipfile.BadZipFile):
        read = b""
    if written != read:
        raise OutputError(
            f"{path} does not read back as it was written",
            hint="nothing was published; check the disk, and report this if it is sound",
        )
