"""Spool: rows that are too many for memory, in a nameless file, read back column by column.

Rows are gathered in a block and written column after column, so that each column of a block lies in one
piece. Reading one column of a long spool then costs a seek a block, and never the other columns.
"""

from __future__ import annotations

import tempfile
import weakref
from collections.abc import Iterator

import numpy as np

from cnc_shape.arrays import FloatArray
from cnc_shape.errors import OutputError

BLOCK = 16_384  # rows that are written at once


class Spool:
    """Rows of `columns` numbers each; the file vanishes with this value.

    Raises
    ------
    OutputError
        From `append` and `pieces`: the folder for temporary files is full, or cannot be used.
    """

    def __init__(self, columns: int, block: int = BLOCK) -> None:
        self._block = np.empty((columns, block))
        self._filled = 0  # rows of the block
        self._written = 0  # blocks in the file
        self._file = None

    def __len__(self) -> int:
        return self._written * self._block.shape[1] + self._filled

    def append(self, rows: FloatArray) -> None:
        """Add rows, (n,columns)."""
        start, size = 0, self._block.shape[1]
        while start < rows.shape[0]:
            stop = min(start + size - self._filled, rows.shape[0])
            self._block[:, self._filled : self._filled + stop - start] = rows[start:stop].T
            self._filled += stop - start
            start = stop
            if self._filled == size:
                self._write()

    def pieces(self, column: int) -> Iterator[FloatArray]:
        """Yield one column, block by block."""
        size = self._block.shape[1]
        for block in range(self._written):
            yield self._read((block * self._block.shape[0] + column) * size, size)
        if self._filled:
            yield self._block[column, : self._filled].copy()

    def _write(self) -> None:
        try:
            if self._file is None:
                # unbuffered: a fault shows at the write, and closing has nothing left to fail at
                self._file = tempfile.TemporaryFile(buffering=0)  # noqa: SIM115 (it lives as long as the spool)
                weakref.finalize(self, self._file.close)
            rest = self._block.data.cast("B")
            while rest:
                rest = rest[self._file.write(rest) :]
        except OSError as fault:
            raise temporary_refusal(fault) from fault
        self._written += 1
        self._filled = 0

    def _read(self, first: int, count: int) -> FloatArray:
        values = np.empty(count)
        rest = values.data.cast("B")
        try:
            if self._file is None:
                raise ValueError("nothing was written")
            self._file.seek(first * values.itemsize)
            while rest:
                got = self._file.readinto(rest)
                if not got:
                    raise OSError("it has become shorter")
                rest = rest[got:]
        except OSError as fault:
            raise temporary_refusal(fault) from fault
        return values


def temporary_refusal(fault: OSError) -> OutputError:
    """Say that the folder for temporary files refuses."""
    reason = (fault.strerror or str(fault)).lower()
    return OutputError(
        f"cannot use the folder for temporary files: {reason}",
        hint="free some space there, or name another folder with TMPDIR",
    )
