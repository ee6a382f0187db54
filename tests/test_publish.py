"""A result is whole or absent, and the old one survives a fault at any step."""

from __future__ import annotations

import errno
import os
import resource
from pathlib import Path

import pytest

from cnc_shape.errors import OutputError
from cnc_shape.writers.publish import publish, publish_folder, publishing


def fail_at(monkeypatch: pytest.MonkeyPatch, step: str, call: int, number: int = errno.EIO) -> list[int]:
    """Let the `call`-th use of ``os.<step>`` fail; return a list that grows with every use."""
    original, calls = getattr(os, step), []

    def faulty(*arguments, **named):
        calls.append(1)
        if len(calls) == call:
            raise OSError(number, os.strerror(number))
        return original(*arguments, **named)

    monkeypatch.setattr(os, step, faulty)
    return calls


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def test_a_file_appears_with_its_content_and_usual_permissions(tmp_path):
    publish(tmp_path / "out.csv", b"content")
    assert (tmp_path / "out.csv").read_bytes() == b"content"
    (tmp_path / "plain").write_bytes(b"")
    assert (tmp_path / "out.csv").stat().st_mode == (tmp_path / "plain").stat().st_mode
    assert names(tmp_path) == ["out.csv", "plain"]


def test_an_existing_file_needs_force(tmp_path):
    target = tmp_path / "out.csv"
    target.write_bytes(b"old")
    with pytest.raises(OutputError, match="exists") as caught:
        publish(target, b"new")
    assert "--force" in caught.value.hint
    assert target.read_bytes() == b"old"
    publish(target, b"new", force=True)
    assert target.read_bytes() == b"new"


def test_a_file_that_appears_meanwhile_is_not_overwritten(tmp_path):
    target = tmp_path / "out.csv"

    def race() -> None:
        with publishing(target) as file:
            file.write(b"mine")
            target.write_bytes(b"theirs")

    with pytest.raises(OutputError, match="exists"):
        race()
    assert target.read_bytes() == b"theirs"
    assert names(tmp_path) == ["out.csv"]


@pytest.mark.parametrize("force", [False, True])
def test_what_is_not_a_regular_file_is_never_replaced(tmp_path, force):
    (tmp_path / "folder").mkdir()
    (tmp_path / "elsewhere").write_bytes(b"kept")
    (tmp_path / "link").symlink_to(tmp_path / "elsewhere")
    (tmp_path / "dangling").symlink_to(tmp_path / "nowhere")
    os.mkfifo(tmp_path / "pipe")
    for name, reason in {
        "folder": "folder",
        "link": "symbolic link",
        "dangling": "symbolic link",
        "pipe": "regular file",
        "": "folder",
    }.items():
        with pytest.raises(OutputError, match=reason):
            publish(tmp_path / name, b"x", force=force)
    assert (tmp_path / "elsewhere").read_bytes() == b"kept"


def test_a_missing_folder_is_named(tmp_path):
    with pytest.raises(OutputError, match="does not exist") as caught:
        publish(tmp_path / "absent" / "out.csv", b"x")
    assert str(tmp_path / "absent") in caught.value.hint


def test_a_read_only_folder_is_refused(tmp_path):
    folder = tmp_path / "locked"
    folder.mkdir()
    folder.chmod(0o500)
    if os.access(folder, os.W_OK):
        folder = Path("/proc/sys")  # read-only whoever asks
    with pytest.raises(OutputError, match="cannot write") as caught:
        publish(folder / "out.csv", b"x")
    assert caught.value.hint


def test_a_name_that_is_too_long_is_refused(tmp_path):
    with pytest.raises(OutputError, match="too long"):
        publish(tmp_path / ("x" * 300), b"x")
    publish(tmp_path / ("x" * 255), b"x")
    assert names(tmp_path) == ["x" * 255]


@pytest.mark.parametrize("old", [None, b"old"])
@pytest.mark.parametrize(
    ("step", "call"), [("write", 1), ("write", 2), ("write", 5), ("fsync", 1), ("rename", 1)]
)
def test_a_fault_leaves_the_old_file_and_nothing_else(tmp_path, monkeypatch, step, call, old):
    target = tmp_path / "out.bin"
    if old is not None:
        target.write_bytes(old)
    calls = fail_at(monkeypatch, step, call)

    def write() -> None:
        with publishing(target, force=True) as file:
            for _ in range(50):
                file.write(b"new" * 1000)

    with pytest.raises(OutputError, match=r"out\.bin"):
        write()
    assert len(calls) >= call
    assert names(tmp_path) == ([] if old is None else ["out.bin"])
    assert old is None or target.read_bytes() == old


def test_a_fault_at_the_last_step_leaves_the_new_file_whole(tmp_path, monkeypatch):
    target = tmp_path / "out.bin"
    fail_at(monkeypatch, "fsync", 2)  # of the folder, after the rename
    with pytest.raises(OutputError):
        publish(target, b"new")
    assert target.read_bytes() == b"new"
    assert names(tmp_path) == ["out.bin"]


def test_a_full_disk_says_so(tmp_path, monkeypatch):
    fail_at(monkeypatch, "write", 1, errno.ENOSPC)
    with pytest.raises(OutputError, match="no space left") as caught:
        publish(tmp_path / "out.bin", b"x")
    assert "free some space" in caught.value.hint


def test_a_real_limit_on_the_file_size_leaves_nothing_behind(tmp_path):
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, hard))
    try:
        with pytest.raises(OutputError, match="too large"):
            publish(tmp_path / "out.bin", bytes(1_000_000))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert names(tmp_path) == []


@pytest.mark.parametrize("error", [KeyboardInterrupt, ValueError, OSError])
def test_an_error_of_the_block_stays_itself_and_leaves_nothing(tmp_path, error):
    def write() -> None:
        with publishing(tmp_path / "out.bin") as file:
            file.write(b"half")
            raise error

    with pytest.raises(error) as caught:
        write()
    assert type(caught.value) is error
    assert names(tmp_path) == []


def test_a_short_write_of_the_system_is_continued(tmp_path, monkeypatch):
    original = os.write
    monkeypatch.setattr(os, "write", lambda descriptor, data: original(descriptor, memoryview(data)[:7]))
    publish(tmp_path / "out.bin", bytes(range(256)) * 100)
    assert (tmp_path / "out.bin").read_bytes() == bytes(range(256)) * 100


def test_what_was_written_can_be_read_back_before_it_is_published(tmp_path):
    with publishing(tmp_path / "out.bin") as file:
        file.write(b"abc")
        file.flush()
        assert Path(file.name).read_bytes() == b"abc"
        assert not (tmp_path / "out.bin").exists()


def build(folder: Path) -> None:
    (folder / "run.json").write_bytes(b"{}")
    (folder / "figures").mkdir()
    (folder / "figures" / "path.svg").write_bytes(b"<svg/>")


def test_a_folder_appears_whole(tmp_path):
    publish_folder(tmp_path / "run", build, marker="run.json")
    assert names(tmp_path) == ["run"]
    assert names(tmp_path / "run") == ["figures", "run.json"]


def test_an_empty_folder_may_be_filled(tmp_path):
    (tmp_path / "run").mkdir()
    publish_folder(tmp_path / "run", build, marker="run.json")
    assert names(tmp_path) == ["run"]
    assert names(tmp_path / "run") == ["figures", "run.json"]


def test_an_older_run_is_replaced_with_force_only(tmp_path):
    target = tmp_path / "run"
    publish_folder(target, build, marker="run.json")
    (target / "stale.txt").write_bytes(b"")
    with pytest.raises(OutputError, match="exists"):
        publish_folder(target, build, marker="run.json")
    assert "stale.txt" in names(target)
    publish_folder(target, build, marker="run.json", force=True)
    assert names(target) == ["figures", "run.json"]
    assert names(tmp_path) == ["run"]


def test_a_folder_of_other_files_is_never_replaced(tmp_path):
    (tmp_path / "thesis").mkdir()
    (tmp_path / "thesis" / "chapter.tex").write_bytes(b"years of work")
    with pytest.raises(OutputError, match="other files"):
        publish_folder(tmp_path / "thesis", build, marker="run.json", force=True)
    assert names(tmp_path / "thesis") == ["chapter.tex"]
    assert names(tmp_path) == ["thesis"]


@pytest.mark.parametrize(
    ("step", "call"), [*[("fsync", n) for n in range(1, 5)], ("rename", 1), ("rename", 2)]
)
def test_a_fault_leaves_the_old_folder_and_nothing_else(tmp_path, monkeypatch, step, call):
    target = tmp_path / "run"
    publish_folder(target, build, marker="run.json")
    (target / "old.txt").write_bytes(b"old")
    calls = fail_at(monkeypatch, step, call)
    with pytest.raises(OutputError):
        publish_folder(target, build, marker="run.json", force=True)
    assert len(calls) >= call
    assert names(tmp_path) == ["run"]
    assert "old.txt" in names(target)


def test_a_fault_while_building_leaves_nothing(tmp_path):
    def half(folder: Path) -> None:
        build(folder)
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        publish_folder(tmp_path / "run", half, marker="run.json")
    assert names(tmp_path) == []
