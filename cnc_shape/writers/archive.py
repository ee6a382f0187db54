"""Numpy archives that are the same to the byte whenever they hold the same arrays."""

from __future__ import annotations

import zipfile
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, BinaryIO

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

NO_TIME = (1980, 1, 1, 0, 0, 0)  # the earliest time stamp a zip knows; an entry opened by its name has it
LARGE = 1 << 30  # bytes beyond which an entry gets the header of large files
PIECE = 16_384  # numbers of an array that are written at once


@dataclass(frozen=True, eq=False, slots=True)
class Stream:
    """A one-dimensional array that comes in pieces, and only once."""

    size: int
    dtype: type[np.float64] | type[np.int64]
    pieces: Iterable[NDArray[Any]]


def write_archive(file: BinaryIO, arrays: Mapping[str, NDArray[Any] | Stream]) -> None:
    """Write named arrays as `.npz`, in the order given, compressed, without a time stamp.

    A stream goes out as it comes in: an archive of any size takes the memory of one piece. It gives the
    same bytes as the array it stands for.

    Raises
    ------
    ValueError
        Values that are not finite, or a stream that is not as long as it says; the message names the array.
    """
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        for name, array in arrays.items():
            stream = array if isinstance(array, Stream) else _cut(array)
            shape = (stream.size,) if isinstance(array, Stream) else array.shape
            dtype, count = np.dtype(stream.dtype), 0
            with archive.open(name + ".npy", "w", force_zip64=stream.size * dtype.itemsize >= LARGE) as entry:
                header = {"descr": npy.dtype_to_descr(dtype), "fortran_order": False, "shape": shape}
                npy.write_array_header_1_0(entry, header)  # pyright: ignore[reportArgumentType]
                for piece in stream.pieces:
                    if not np.isfinite(piece).all():
                        raise ValueError(f"{name} holds a value that is not a number")
                    entry.write(piece.astype(dtype, copy=False).tobytes())
                    count += piece.size
            if count != stream.size:
                raise ValueError(f"{name} has {count} values, not {stream.size}")


def _cut(array: NDArray[Any]) -> Stream:
    flat = array.ravel()
    return Stream(flat.size, array.dtype.type, (flat[k : k + PIECE] for k in range(0, flat.size, PIECE)))
