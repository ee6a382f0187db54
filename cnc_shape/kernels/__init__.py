"""The one decorator of all compiled code, and where its machine code is kept.

Kernels take arrays and floats, have no defaults, and know neither units nor names of axes.

numba's disk cache does not notice an edit of a callee in another file, and fails where the package
folder is read-only. So the cache lives in the user's cache folder, under a hash of every source file
that holds a kernel: an edit names a new folder, nothing goes stale, and installs may be read-only.
"""

from __future__ import annotations

import hashlib
import os
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

_PACKAGE = Path(__file__).resolve().parent.parent


def _user_cache() -> Path:
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA", Path.home() / "AppData" / "Local"))
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Caches"
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")


def _sources_hash() -> str:
    digest = hashlib.sha256()
    for path in sorted(_PACKAGE.rglob("*.py")):
        text = path.read_bytes()
        if b"@kernel" in text:
            digest.update(text)
    return digest.hexdigest()[:16]


def cache_folder() -> Path:
    """Return the folder that holds the machine code of these very kernel sources.

    Falls back to a folder below the system's temporary one where the user's cache is not writable.
    """
    name = Path("cnc-shape") / _sources_hash()
    try:
        home = _user_cache()
    except RuntimeError:  # no home folder for this user
        home = Path(tempfile.gettempdir())
    for base in (home, Path(tempfile.gettempdir())):
        folder = base / name
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError:
            continue
        if os.access(folder, os.W_OK):
            return folder
    return Path(tempfile.mkdtemp(prefix="cnc-shape-"))


os.environ.setdefault("NUMBA_CACHE_DIR", str(cache_folder()))

import numba  # noqa: E402  # the cache folder must be named first


def compiled_before() -> bool:
    """Whether this installation has compiled kernels on this machine already."""
    folder = os.environ["NUMBA_CACHE_DIR"]
    return any(name.endswith(".nbc") for _, _, names in os.walk(folder) for name in names)


def kernel(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile `function` to cached, serial machine code with IEEE arithmetic.

    To the type checker a kernel takes anything and returns anything: its docstring gives shapes and
    units, and the API function that calls it checks them.
    """
    return numba.njit(cache=True, error_model="numpy")(function)
