"""Diagnosis: what this installation has, what it lacks, and what to do about it.

It must answer where cnc-shape cannot run, so nothing that may be missing is imported up here.
"""

from __future__ import annotations

import os
import platform
import shutil
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from enum import Enum
from importlib import import_module
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Final

from cnc_shape import __version__

OLDEST_PYTHON: Final = (3, 11)
DEPENDENCIES: Final = {  # distribution: its module, the oldest version
    "numpy": ("numpy", "2.0"), "scipy": ("scipy", "1.13"), "numba": ("numba", "0.61"),
    "typer": ("typer", "0.15"), "rich": ("rich", "13.7"), "pydantic": ("pydantic", "2.9"),
    "pyyaml": ("yaml", "6.0.2"), "matplotlib": ("matplotlib", "3.9"), "jinja2": ("jinja2", "3.1.4"),
}  # fmt: skip
BROWSERS: Final = ("xdg-open", "firefox", "chromium", "chromium-browser", "google-chrome", "microsoft-edge")
ENOUGH_MEMORY: Final = 500.0  # MB, of a run with what the system does besides
MEGABYTE: Final = 1e6  # bytes
MACHINE: Final = "CNC_SHAPE_MACHINE"


class Status(Enum):
    """How a check came out."""

    OK = "ok"
    WARNING = "warning"  # cnc-shape works, something is less than it could be
    MISSING = "missing"  # cnc-shape does not work


@dataclass(frozen=True, slots=True)
class Check:
    """One thing that was looked at."""

    name: str
    status: Status
    value: str
    hint: str | None = None  # what to do about it, in one line


def diagnose() -> tuple[Check, ...]:
    """Look at everything that cnc-shape needs or can use."""
    return (
        Check("cnc-shape", Status.OK, f"{__version__} in {Path(__file__).resolve().parent}"),
        _python(),
        *(_dependency(name, module, oldest) for name, (module, oldest) in DEPENDENCIES.items()),
        _bundled(),
        _machine(),
        _cores(),
        _memory(),
        _cache(),
        _kernels(),
        _stale(),
        _working_folder(),
        _temporary_folder(),
        _browser(),
        _terminal(),
    )


def _python() -> Check:
    value = f"{platform.python_version()} on {platform.system()} {platform.machine()}, {sys.executable}"
    if sys.version_info < OLDEST_PYTHON:
        oldest = ".".join(str(part) for part in OLDEST_PYTHON)
        return Check("Python", Status.MISSING, value, f"install Python {oldest} or newer")
    return Check("Python", Status.OK, value)


def _dependency(name: str, module: str, oldest: str) -> Check:
    hint = f'python -m pip install "{name}>={oldest}"'
    try:
        found = version(name)
    except PackageNotFoundError:
        return Check(name, Status.MISSING, "not installed", hint)
    if _release(found) < _release(oldest):
        return Check(name, Status.MISSING, f"{found} is older than {oldest}", hint)
    try:
        import_module(module)
    except Exception as error:  # whatever a broken installation raises
        reason = str(error).partition("\n")[0]
        return Check(
            name, Status.MISSING, f"{found} cannot be imported: {reason}", f"{hint} --force-reinstall"
        )
    return Check(name, Status.OK, found)


def _release(text: str) -> tuple[int, ...]:
    """Leading numbers of a version: 2.0.1rc1 is (2, 0)."""
    numbers: list[int] = []
    for part in text.split("."):
        if not part.isdecimal():
            break
        numbers.append(int(part))
    return tuple(numbers)


def _bundled() -> Check:
    try:
        from cnc_shape.config.bundled import bundled

        folder = bundled("xy_stage.yaml").parent
        bundled("bracket.nc")
    except ImportError as error:
        return Check("bundled files", Status.MISSING, f"not looked for: {error}", "see above")
    except ValueError as error:
        return Check("bundled files", Status.MISSING, str(error), "install cnc-shape again")
    return Check("bundled files", Status.OK, str(folder.parent))


def _machine() -> Check:
    chosen = os.environ.get(MACHINE)
    if not chosen:
        return Check("machine", Status.OK, f"the bundled XY stage; -m FILE or {MACHINE} chooses another")
    if Path(chosen).is_file():
        return Check("machine", Status.OK, f"{chosen}, from {MACHINE}", f"cnc-shape check {chosen}")
    hint = f"correct {MACHINE}, or unset it"
    return Check("machine", Status.WARNING, f"{chosen}, from {MACHINE}, is no file", hint)


def _cores() -> Check:
    usable = len(os.sched_getaffinity(0)) if sys.platform == "linux" else os.cpu_count() or 1
    return Check("cores", Status.OK, f"{usable} of {os.cpu_count() or usable}")


def _memory() -> Check:
    free = _available_memory()
    if free is None:
        return Check("memory", Status.OK, "this system does not say")
    value = f"{free:.0f} MB available"
    if free < ENOUGH_MEMORY:
        return Check("memory", Status.WARNING, value, f"leave {ENOUGH_MEMORY:.0f} MB to a run")
    return Check("memory", Status.OK, value)


def _available_memory() -> float | None:
    """Memory a new process can have, MB, where Linux tells; the limit of a container counts too."""
    told = _text("/proc/meminfo").splitlines()
    free = [int(line.split()[1]) * 1024 / MEGABYTE for line in told if line.startswith("MemAvailable:")]
    limit, used = _text("/sys/fs/cgroup/memory.max").strip(), _text("/sys/fs/cgroup/memory.current").strip()
    if limit.isdecimal() and used.isdecimal():
        free.append((int(limit) - int(used)) / MEGABYTE)
    return min(free, default=None)


def _text(path: str) -> str:
    try:
        return Path(path).read_text()
    except OSError:
        return ""


def _cache() -> Check:
    try:
        from cnc_shape.kernels import cache_folder, user_cache
    except Exception:  # as in _dependency, which names it
        return Check("kernel cache", Status.MISSING, "no kernels without numba", "see numba above")
    folder = cache_folder()
    try:
        wanted = user_cache()
    except RuntimeError:
        wanted = None
    if not writable(folder):
        return Check("kernel cache", Status.MISSING, f"{folder} cannot be written", "set XDG_CACHE_HOME")
    if wanted is None or not folder.is_relative_to(wanted):
        hint = "set XDG_CACHE_HOME to a folder that stays and can be written: kernels compile once then"
        return Check("kernel cache", Status.WARNING, f"{folder}, as {wanted} cannot be written", hint)
    return Check("kernel cache", Status.OK, str(folder))


def _kernels() -> Check:
    try:
        from cnc_shape.kernels import cache_folder, compiled_count, kernel_count
    except Exception:  # as in _dependency, which names it
        return Check("kernels", Status.MISSING, "none without numba", "see numba above")
    if interpreted():
        hint = "unset NUMBA_DISABLE_JIT: a hundred times faster"
        return Check("kernels", Status.WARNING, "interpreted", hint)
    compiled, total = compiled_count(), kernel_count()
    value = f"{compiled} of {total} compiled, {_size([cache_folder()]):.1f} MB"
    if compiled < total:
        hint = "cnc-shape doctor --warm compiles them ahead; else the first run does"
        return Check("kernels", Status.WARNING, value, hint)
    return Check("kernels", Status.OK, value)


def interpreted() -> bool:
    """Whether kernels run as Python: NUMBA_DISABLE_JIT is set."""
    return os.environ.get("NUMBA_DISABLE_JIT", "0") not in ("", "0")


def _stale() -> Check:
    """Kernels of other versions, of other installations, and of Python programs with other numba settings."""
    others = tuple(stale_caches())
    if not others:
        return Check("older kernels", Status.OK, "none")
    value = f"{len(others)} caches of other versions, installations or numba settings, {_size(others):.1f} MB"
    hint = f"may be deleted: all in {others[0].parent} but the kernel cache named above"
    return Check("older kernels", Status.OK, value, hint)


def stale_caches() -> Iterator[Path]:
    """Yield the folders with machine code that this installation does not use."""
    try:
        from cnc_shape.kernels import FOLDER_NAME, cache_folder
    except Exception:  # as in _dependency, which names it
        return
    current = cache_folder()
    if current.parent.name != FOLDER_NAME:  # a folder for this run alone, among those of other programs
        return
    for folder in sorted(current.parent.iterdir()):
        if folder.is_dir() and folder != current and next(folder.rglob("*.nbi"), None) is not None:
            yield folder


def _size(folders: Sequence[Path]) -> float:
    """Size of all files in `folders`, MB."""
    size = 0
    for folder in folders:
        for file in folder.rglob("*"):
            with suppress(OSError):  # another process may be tidying up
                size += file.stat().st_size
    return size / MEGABYTE


def writable(folder: Path) -> bool:
    """Whether a file can be made in `folder`, found out by making one."""
    try:
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError:
        return False


def _working_folder() -> Check:
    hint = "run elsewhere, or name outputs with -o"
    try:
        folder = Path.cwd()
    except OSError:
        return Check("working folder", Status.WARNING, "it is no longer there", hint)
    if not writable(folder):
        return Check("working folder", Status.WARNING, f"{folder} cannot be written", hint)
    return Check("working folder", Status.OK, str(folder))


def _temporary_folder() -> Check:
    try:
        folder = Path(tempfile.gettempdir())
    except FileNotFoundError:
        folder = None
    if folder is not None and writable(folder):
        return Check("temporary folder", Status.OK, str(folder))
    return Check("temporary folder", Status.WARNING, "none can be written", "set TMPDIR to a folder that can")


def _browser() -> Check:
    if sys.platform in ("win32", "darwin"):
        return Check("browser", Status.OK, "the system's own")
    found = next((path for name in BROWSERS if (path := shutil.which(name))), None)
    if found is not None:
        return Check("browser", Status.OK, found)
    hint = "report.html is one file: look at it on a machine that has a browser, or install firefox"
    return Check("browser", Status.WARNING, "none found", hint)


def _terminal() -> Check:
    out = sys.stdout
    encoding = (getattr(out, "encoding", None) or "unknown").lower()
    if out.isatty():
        plain = bool(os.environ.get("NO_COLOR")) or os.environ.get("TERM") == "dumb"
        value = f"{shutil.get_terminal_size().columns} columns, {'no ' if plain else ''}colour, {encoding}"
    else:
        value = f"not a terminal, {encoding}"
    if encoding.replace("-", "") != "utf8":
        return Check("terminal", Status.WARNING, value, "set PYTHONUTF8=1: µ and ² need UTF-8")
    return Check("terminal", Status.OK, value)
