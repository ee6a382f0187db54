"""Where the reference data lies, and a machine-code cache that outlives the test run."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from hypothesis import settings

settings.register_profile("cnc-shape", deadline=None, derandomize=True)
settings.load_profile("cnc-shape")

ROOT = Path(__file__).resolve().parent.parent


@pytest.fixture(scope="session")
def shared() -> Path:
    """Return the folder of reference data beside the project; skip where it is absent."""
    folder = Path(os.environ.get("CNC_SHAPE_SHARED", ROOT.parent / "shared"))
    if not folder.is_dir():
        if os.environ.get("CNC_SHAPE_REQUIRE_SHARED") == "1":
            pytest.fail(f"reference data is required here and absent: {folder}")
        pytest.skip(f"reference data absent: {folder} (name it with CNC_SHAPE_SHARED)")
    return folder
