"""Publish a file or a folder whole: either everything is there or nothing is, and the old one survives.

A result is built under a hidden name beside its target, so that both lie on one file system, flushed to
the disk, and renamed. A fault at any write leaves the target as it was and no half-written file behind.
"""

from __future__ import annotations

import contextlib
import errno
import io
import os
import secrets
import shutil
import stat
from collections.abc import Callable, Generator
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO

from cnc_shape.errors import OutputError

if TYPE_CHECKING:
    from _typeshed import ReadableBuffer

_HINTS = {
    errno.ENOSPC: "free some space, or write to another disk",
    errno.EDQUOT: "free some of your quota, or write to another disk",
    errno.EFBIG: "raise the limit on the size of files, or write to another disk",
    errno.EACCES: "choose a folder that you may write to",
    errno.EPERM: "choose a folder that you may write to",
    errno.EROFS: "the disk is read-only: choose another folder",
    errno.ENAMETOOLONG: "choose a shorter name",
}


def publish(path: Path | str, data: bytes, *, force: bool = False) -> None:
    """Write `data` to `path`, whole or not at all.

    Parameters
    ----------
    path
        The file to make, in a folder that exists.
    data
        Its content.
    force
        Replace an existing file.

    Raises
    ------
    OutputError
        The file exists and `force` is not given, its folder is missing or read-only, the target is no
        regular file, or the disk refuses.
    """
    with publishing(path, force=force) as file:
        file.write(data)


@contextlib.contextmanager
def publishing(path: Path | str, *, force: bool = False) -> Generator[BinaryIO]:
    """Open a file that appears at `path` when the block ends, and only if it ends well.

    The file can be written and sought; ``file.name`` is where it lies meanwhile: flush it and open that
    name to read back what was written, before it is published.

    Raises
    ------
    OutputError
        As `publish`; also raised by ``file.write``, so that other errors of the block stay what they are.
    """
    target = Path(path)
    check_target(target, force=force)
    temporary = _beside(target)
    try:
        sink = _Sink(temporary, target)
    except OSError as fault:
        raise _refusal(target, fault) from fault
    try:
        with io.BufferedWriter(sink) as file:
            yield file
            file.flush()
            with _faults_of(target):
                os.fsync(sink.fileno())
        check_target(target, force=force)
        with _faults_of(target):
            os.rename(temporary, target)
    except BaseException:
        with contextlib.suppress(OSError):
            os.unlink(temporary)
        raise
    with _faults_of(target):
        _sync(target.parent)


def publish_folder(
    target: Path | str, build: Callable[[Path], None], *, marker: str, force: bool = False
) -> None:
    """Let `build` fill a hidden folder, then rename it to `target`, whole or not at all.

    An empty folder may be in the way; a full one is replaced with `force`, and only if it holds the
    file `marker`: what this program did not make, it does not remove.

    Parameters
    ----------
    target
        The folder to make, in a folder that exists.
    build
        Writes the content into the folder it is given.
    marker
        A file that every such folder holds.
    force
        Replace an older folder of this kind.

    Raises
    ------
    OutputError
        The folder exists and may not be replaced, its parent is missing or read-only, or the disk refuses.
    """
    target = Path(target)
    check_folder(target, marker, force=force)
    temporary = _beside(target)
    with _faults_of(target):
        temporary.mkdir()
    try:
        with _faults_of(target):
            build(temporary)
            if not (temporary / marker).is_file():
                raise ValueError(f"the folder was built without its {marker=}")
            for folder, _, names in os.walk(temporary):
                for name in names:
                    _sync(Path(folder, name))
                _sync(Path(folder))
        check_folder(target, marker, force=force)
        with _faults_of(target):
            _swap(temporary, target)
    except BaseException:
        shutil.rmtree(temporary, ignore_errors=True)
        raise
    with _faults_of(target):
        _sync(target.parent)


def make_folder(path: Path) -> None:
    """Make a folder for results, unless it is there.

    Raises
    ------
    OutputError
        It cannot be made, or is something else.
    """
    mode = _mode(path)
    if mode is not None and stat.S_ISDIR(mode):
        return
    if mode is not None:
        raise OutputError(f"{path} is not a folder", hint="move it, or name another folder")
    with _faults_of(path):
        path.mkdir(exist_ok=True)


def _swap(temporary: Path, target: Path) -> None:
    """Rename `temporary` to `target`; what was there stands aside, and comes back after a fault."""
    if not os.path.lexists(target):
        os.rename(temporary, target)
        return
    aside = _beside(target)
    os.rename(target, aside)
    try:
        os.rename(temporary, target)
    except BaseException:
        os.rename(aside, target)
        raise
    shutil.rmtree(aside, ignore_errors=True)


class _Sink(io.FileIO):
    """The file under its temporary name: a fault speaks of the target, and closing never fails again."""

    def __init__(self, temporary: Path, target: Path) -> None:
        super().__init__(temporary, "xb")
        self._target = target
        self._failed = False

    def write(self, data: ReadableBuffer, /) -> int:
        if self._failed:
            return memoryview(data).nbytes
        try:
            return os.write(self.fileno(), data)
        except OSError as fault:
            self._failed = True
            raise _refusal(self._target, fault) from fault


def _beside(target: Path) -> Path:
    """Return a fresh hidden name in the folder of `target`, short whatever the target's name is."""
    return target.parent / f".cnc-shape-{secrets.token_hex(8)}.tmp"


def check_target(target: Path, *, force: bool) -> None:
    """Refuse a file that `publish` would refuse, before the work is done."""
    _check_parent(target)
    mode = _mode(target)
    if mode is None:
        return
    if stat.S_ISDIR(mode):
        raise OutputError(f"{target} is a folder", hint="name a file in it")
    if stat.S_ISLNK(mode):
        raise OutputError(f"{target} is a symbolic link", hint="name the file it points to")
    if not stat.S_ISREG(mode):
        raise OutputError(f"{target} is not a regular file", hint="use - to write to standard output")
    if not force:
        raise OutputError(f"{target} exists", hint="use --force to replace it, or name another file")


def check_folder(target: Path, marker: str, *, force: bool) -> None:
    """Refuse a folder that `publish_folder` would refuse, before the work is done."""
    _check_parent(target)
    mode = _mode(target)
    if mode is None:
        return
    if stat.S_ISLNK(mode):
        raise OutputError(f"{target} is a symbolic link", hint="name the folder it points to")
    if not stat.S_ISDIR(mode):
        raise OutputError(f"{target} is a file", hint="name a folder")
    with _faults_of(target):
        empty = not os.listdir(target)
    if empty:
        return
    if not (target / marker).is_file():
        raise OutputError(
            f"{target} holds other files: no {marker} is in it", hint="name a new folder, or an empty one"
        )
    if not force:
        raise OutputError(f"{target} exists", hint="use --force to replace it, or name another folder")


def _check_parent(target: Path) -> None:
    parent = target.parent
    if not target.name or target.name == "..":
        raise OutputError(f"{target} is no name for a result", hint="name a file")
    if not parent.is_dir():
        raise OutputError(f"the folder {parent} does not exist", hint=f"make it first: mkdir -p {parent}")


def _mode(target: Path) -> int | None:
    """Return the mode of what lies at `target`, a link itself rather than its end; None if nothing does."""
    try:
        return os.lstat(target).st_mode
    except FileNotFoundError:
        return None
    except OSError as fault:
        raise _refusal(target, fault) from fault


def _sync(path: Path) -> None:
    """Flush a file or a folder to the disk; a system that cannot open folders has nothing to flush."""
    if os.name == "nt" and path.is_dir():
        return
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


@contextlib.contextmanager
def _faults_of(target: Path) -> Generator[None]:
    try:
        yield
    except OSError as fault:
        raise _refusal(target, fault) from fault


def _refusal(target: Path, fault: OSError) -> OutputError:
    reason = (fault.strerror or str(fault)).lower()
    return OutputError(
        f"cannot write {target}: {reason}",
        hint=_HINTS.get(fault.errno or 0, "check the disk and the folder's permissions"),
    )
