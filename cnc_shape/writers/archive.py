"""Numpy archives that are the same to the byte whenever they hold the same arrays."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Mapping
from typing import Any, BinaryIO

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

NO_TIME = (1980, 1, 1, 0, 0, 0)  # the earliest time stamp a zip knows


def write_archive(file: BinaryIO, arrays: Mapping[str, NDArray[Any]]) -> None:
    """Write named arrays as `.npz`, in the order given, compressed, without a time stamp.

    Raises
    ------
    ValueError
        A floating-point array that holds NaN or infinity; the message names it.
    """
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, array in arrays.items():
            if np.issubdtype(array.dtype, np.floating) and not np.isfinite(array).all():
                raise ValueError(f"{name} holds a value that is not a number")
            entry = zipfile.ZipInfo(name + ".npy", date_time=NO_TIME)
            entry.compress_type = zipfile.ZIP_DEFLATED
            content = io.BytesIO()
            npy.write_array(content, np.ascontiguousarray(array), allow_pickle=False)
            archive.writestr(entry, content.getvalue(), compresslevel=1)
