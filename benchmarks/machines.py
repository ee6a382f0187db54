"""The bundled stage with a jerk limit for every axis."""

from __future__ import annotations

import re
from pathlib import Path

from cnc_shape.config.bundled import bundled

RATE = 50  # 1/s, jerk over acceleration


def jerk_limited(folder: Path) -> Path:
    """Write the machine file and return its path."""
    text = bundled("xy_stage.yaml").read_text(encoding="utf-8")
    file = folder / "jerk_limited.yaml"
    limited = re.sub(r"acceleration_mm_s2: (\d+)", lambda m: f"{m[0]}, jerk_mm_s3: {RATE * int(m[1])}", text)
    file.write_text(limited, encoding="utf-8")
    return file
