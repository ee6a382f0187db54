"""The doctor: what is missing is named with what to do about it, and what is compiled ahead stays compiled."""

from __future__ import annotations

import json
import logging
import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from cnc_shape import diagnosis
from cnc_shape.cli import run
from cnc_shape.cli.progress import progress
from cnc_shape.config import bundled
from cnc_shape.diagnosis import DEPENDENCIES, OLDEST_PYTHON, Status, diagnose

ROOT = Path(__file__).resolve().parent.parent
NOTICE = "compiling the numerical kernels for this processor, which happens once\n"


def cnc_shape(*words: str, without: tuple[str, ...] = (), **environment: str):
    """Run a command line in a process of its own, in which some modules cannot be imported."""
    code = (
        f"import sys\nsys.modules.update(dict.fromkeys({without!r}))\nfrom cnc_shape.cli import main\nmain()"
    )
    return subprocess.run(
        [sys.executable, "-c", code, *words],
        capture_output=True, text=True, cwd=ROOT, env={**os.environ, **environment}, timeout=900, check=False,
    )  # fmt: skip


def found(name: str) -> diagnosis.Check:
    return next(check for check in diagnose() if check.name == name)


def test_the_doctor_knows_the_dependencies_of_the_package():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    asked = [re.fullmatch(r"([a-z0-9]+)>=([0-9.]+)", text).groups() for text in project["dependencies"]]
    assert asked == [(name, oldest) for name, (_, oldest) in DEPENDENCIES.items()]
    assert project["requires-python"] == ">=" + ".".join(map(str, OLDEST_PYTHON))


def test_a_sound_installation_lacks_nothing_essential(capfd):
    assert run(["doctor", "--json"]) == 0
    out, err = capfd.readouterr()
    told = json.loads(out)
    assert told["schema"] == "cnc-shape/doctor/1"
    assert err == ""
    names = [check["name"] for check in told["checks"]]
    assert len(names) == len(set(names))
    assert {"Python", "numba", "cores", "memory", "kernel cache", "kernels", "browser"} <= set(names)
    for check in told["checks"]:
        assert list(check) == ["name", "status", "value", "hint"]
        assert check["status"] in ("ok", "warning")
        assert check["hint"] or check["status"] == "ok"


def test_text_says_the_same_and_names_what_to_do(capfd):
    assert run(["doctor"]) == 0
    lines = capfd.readouterr().out.splitlines()
    checks = diagnose()
    assert len(lines) == len(checks) + sum(check.hint is not None for check in checks)
    assert re.match(r"ok +numpy +[0-9.]+", lines[2])


def test_without_a_dependency_the_doctor_still_speaks_and_exits_with_1():
    done = cnc_shape("doctor", "--warm", "--json", without=("numba", "yaml"))
    assert done.returncode == 1, done.stderr
    missing = {
        check["name"]: check["hint"]
        for check in json.loads(done.stdout)["checks"]
        if check["status"] == "missing"
    }
    assert missing["numba"].startswith('python -m pip install "numba>=')
    assert missing["pyyaml"].startswith('python -m pip install "pyyaml>=')
    assert "kernels" in missing
    assert "numpy" not in missing


def test_a_numba_that_fails_in_its_own_way_is_missing_too():
    done = cnc_shape("doctor", "--json", NUMBA_NUM_THREADS="0")  # numba raises ValueError when imported
    assert done.returncode == 1, done.stderr
    status = {check["name"]: check["status"] for check in json.loads(done.stdout)["checks"]}
    assert {status[name] for name in ("numba", "kernel cache", "kernels")} == {"missing"}


def test_an_empty_choice_of_a_machine_is_none(monkeypatch):
    monkeypatch.setenv("CNC_SHAPE_MACHINE", "")
    assert found("machine").status is Status.OK


def test_a_version_that_is_too_old_or_absent_is_missing(monkeypatch):
    monkeypatch.setitem(diagnosis.DEPENDENCIES, "numpy", ("numpy", "1000.0"))
    assert found("numpy").status is Status.MISSING
    assert "1000.0" in found("numpy").value
    monkeypatch.setitem(diagnosis.DEPENDENCIES, "no-such-distribution", ("nothing", "1.0"))
    assert found("no-such-distribution").value == "not installed"


def test_what_a_run_can_do_without_is_a_warning(monkeypatch, tmp_path):
    monkeypatch.setattr(diagnosis, "writable", lambda folder: "cnc-shape" in str(folder))
    monkeypatch.setattr(diagnosis.shutil, "which", lambda name: None)
    monkeypatch.setattr(diagnosis.sys, "platform", "linux")
    monkeypatch.setattr(diagnosis, "_available_memory", lambda: 100.0)
    monkeypatch.setenv("CNC_SHAPE_MACHINE", str(tmp_path / "gone.yaml"))
    monkeypatch.setenv("NUMBA_DISABLE_JIT", "1")
    monkeypatch.chdir(tmp_path)
    for name in ("working folder", "temporary folder", "browser", "memory", "machine", "kernels"):
        check = found(name)
        assert check.status is Status.WARNING, name
        assert check.hint, name


def test_interpreted_kernels_cannot_be_warmed(monkeypatch, capfd):
    monkeypatch.setenv("NUMBA_DISABLE_JIT", "1")
    assert run(["doctor", "--warm"]) == 2
    assert "unset NUMBA_DISABLE_JIT" in capfd.readouterr().err


def test_a_cache_that_nobody_can_write_is_missing(monkeypatch):
    monkeypatch.setattr(diagnosis, "writable", lambda folder: False)
    assert found("kernel cache").status is Status.MISSING


def test_kernels_of_other_versions_are_told_with_their_size(monkeypatch, tmp_path):
    from cnc_shape import kernels

    current, other = tmp_path / "cnc-shape" / "now", tmp_path / "cnc-shape" / "before"
    for folder in (current, other / "kernels_1"):
        folder.mkdir(parents=True)
        (folder / "a.nbi").write_bytes(b"")
    (other / "kernels_1" / "a.1.nbc").write_bytes(bytes(2_500_000))
    monkeypatch.setattr(kernels, "cache_folder", lambda: current)
    assert list(diagnosis.stale_caches()) == [other]
    assert "2.5 MB" in found("older kernels").value
    monkeypatch.setattr(kernels, "cache_folder", lambda: tmp_path)
    assert list(diagnosis.stale_caches()) == []


@pytest.mark.parametrize("quiet", [False, True])
def test_what_the_kernels_log_is_one_line_unless_quiet(quiet, capfd):
    with progress("simulating", None, quiet=quiet):
        logging.getLogger("cnc_shape.kernels").info(NOTICE.strip())
    logging.getLogger("cnc_shape.kernels").info("nobody listens")
    assert capfd.readouterr().err == ("" if quiet else NOTICE)


def test_after_warming_no_command_compiles_anything(tmp_path):
    """The one slow test here: it compiles every kernel, in an empty cache."""
    environment = {"XDG_CACHE_HOME": str(tmp_path / "cache"), "NUMBA_CACHE_DIR": "", "NUMBA_DISABLE_JIT": "0"}

    def files() -> set[Path]:
        return {path for path in (tmp_path / "cache" / "cnc-shape").rglob("*") if path.is_file()}

    done = cnc_shape("doctor", "--warm", **environment)
    assert done.returncode == 0, done.stderr
    assert done.stderr == NOTICE
    counted = re.search(r"ok +kernels +(\d+) of (\d+) compiled", done.stdout)
    assert counted, done.stdout
    assert counted[1] == counted[2]
    compiled = files()

    samples = sorted(bundled("bracket.nc").parent.iterdir())
    long = tmp_path / "long.nc"  # read by compiled code
    long.write_text("G21 G90\nF3000\n" + "".join(f"G1 X{i % 7} Y{i % 5}\n" for i in range(8000)) + "M2\n")
    commands = [["check", *map(str, samples), str(long)], ["doctor", "--warm"]]
    commands += [["check", "--time", *map(str, samples), str(long)]]
    commands += [["simulate", str(sample)] for sample in samples]
    commands += [["simulate", str(samples[0]), "-o", str(tmp_path / "run")]]
    commands += [["apply", str(samples[0]), "-o", str(tmp_path / name)] for name in ("out.csv", "out.nc")]
    for command in commands:
        done = cnc_shape(*command, **environment)
        assert done.returncode == 0, done.stderr
        assert NOTICE not in done.stderr
    assert files() == compiled
