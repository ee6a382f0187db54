"""Archives of arrays, read whole, so that no file stays open behind a test."""

from __future__ import annotations

from pathlib import Path
from typing import IO

import numpy as np

from cnc_shape.arrays import FloatArray


def arrays_of(archive: Path | IO[bytes]) -> dict[str, FloatArray]:
    """Return every array of an ``.npz``, in its order."""
    with np.load(archive) as file:
        return {name: file[name] for name in file.files}
