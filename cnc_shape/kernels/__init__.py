"""The two decorators of all compiled code, and where its machine code is kept.

Kernels take arrays and floats, have no defaults, and know neither units nor names of axes.

numba's disk cache does not notice an edit of a callee in another file, and fails where the package
folder is read-only. So machine code lies in the user's cache folder, under a hash of all that it depends on:
every source file that holds a kernel, where the package lies, the compiler and the processor. An edit or an
upgrade names a new folder, nothing goes stale, and installs may be read-only.
"""

from __future__ import annotations

import hashlib
import logging
import os
import re
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any, Final

import numba
from llvmlite import binding
from numba.core import config, event

_PACKAGE: Final = Path(__file__).resolve().parent.parent
_MARK: Final = re.compile(rb"^@(?:kernel|inlined)\b", re.MULTILINE)
FOLDER_NAME: Final = "cnc-shape"
_LOG: Final = logging.getLogger(__name__)


def _sources() -> Iterator[bytes]:
    """Yield the text of every file that holds a kernel, in a fixed order."""
    for folder, folders, names in os.walk(_PACKAGE):
        folders.sort()
        for name in sorted(names):
            if name.endswith(".py"):
                with open(os.path.join(folder, name), "rb") as file:
                    text = file.read()
                if _MARK.search(text):
                    yield text


def kernel_count() -> int:
    """Return how many kernels the package holds."""
    return sum(len(_MARK.findall(text)) for text in _sources())


def _key() -> str:
    """Hash of all that machine code depends on."""
    digest = hashlib.sha256()
    for text in _sources():
        digest.update(text)
    vectors = getattr(config, "LOOP_VECTORIZE")  # noqa: B009  # numba makes its settings' names at run time
    compiler = (sys.implementation.cache_tag, str(numba.__version__), vectors)
    processor = (binding.get_host_cpu_name(), binding.get_host_cpu_features().flatten())
    digest.update(repr((str(_PACKAGE), compiler, processor)).encode())
    return digest.hexdigest()[:16]


def user_cache() -> Path:
    """Return the folder below which caches of this user lie, or that NUMBA_CACHE_DIR chooses."""
    if chosen := os.environ.get("NUMBA_CACHE_DIR"):
        return Path(chosen)
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local")
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Caches"
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")


@cache
def cache_folder() -> Path:
    """Return the folder that holds the machine code of these very kernels.

    Falls back to a folder below the system's temporary one where the user's cache is not writable.
    """
    temporary = Path(tempfile.gettempdir())
    bases = [temporary]
    with suppress(RuntimeError):  # no home folder for this user
        bases.insert(0, user_cache())
    key = _key()
    for base in bases:
        folder = base / FOLDER_NAME / key
        with suppress(OSError):
            folder.mkdir(parents=True, exist_ok=True)
            if os.access(folder, os.W_OK):
                return folder
    return Path(tempfile.mkdtemp(prefix=f"{FOLDER_NAME}-"))


class _Compilation(event.Listener):
    """Logs the first compilation of this process; where machine code comes from the cache there is none."""

    def __init__(self) -> None:
        self._told = False

    def on_start(self, event: event.Event) -> None:
        if not self._told:
            self._told = True
            _LOG.info("compiling the numerical kernels for this processor, which happens once")

    def on_end(self, event: event.Event) -> None:
        pass


event.register("numba:compile", _Compilation())


def compiled_count() -> int:
    """Return how many kernels have machine code in the cache."""
    return sum(1 for _ in cache_folder().glob("*/*.nbi"))


def kernel(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile `function` to cached, serial machine code with IEEE arithmetic.

    To the type checker a kernel takes anything and returns anything: its docstring gives shapes and
    units, and the API function that calls it checks them.
    """
    return _compiled(function)


def inlined(function: Callable[..., Any]) -> Callable[..., Any]:
    """As `kernel`, and made part of every kernel that calls it.

    For what is called at every tick and handed arrays: a call counts the references of each of them, up and
    down again, which takes longer than a few multiplications.
    """
    return _compiled(function, forceinline=True)


def _compiled(function: Callable[..., Any], *, forceinline: bool = False) -> Callable[..., Any]:
    others = getattr(config, "CACHE_DIR")  # noqa: B009  # numba makes its settings' names at run time
    setattr(config, "CACHE_DIR", str(cache_folder()))  # noqa: B010
    try:
        return numba.njit(cache=True, error_model="numpy", forceinline=forceinline)(function)
    finally:
        setattr(config, "CACHE_DIR", others)  # noqa: B010
