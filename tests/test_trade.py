"""The trade: kinds of shaping side by side, with the structure nominal and off by what the machine file says."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest
from answers import answer

from cnc_shape.api import simulate_program
from cnc_shape.cases import default_cases, timings
from cnc_shape.config.bundled import bundled
from cnc_shape.config.machine_file import load_machine
from cnc_shape.modes import Mode
from cnc_shape.opening import open_motion
from cnc_shape.pipeline import run
from cnc_shape.shapers import cascade
from cnc_shape.trade import NOMINAL, Trade, models, off_by


def traded(sample, setup):
    trade = Trade(setup)
    cases = default_cases(setup)[:1]
    with open_motion(str(bundled(sample)), setup, None, timings(cases), trade.timings) as motion:
        run(motion.blocks, setup, cases, motion.name, observers=[trade])
    return {row.name: row for row in trade.rows()}


def test_models_are_the_corners_of_what_the_machine_file_allows():
    machine = load_machine(bundled("xy_stage.yaml")).machine
    nominal, *corners = models(machine)
    assert nominal == NOMINAL
    assert [dict(model.factors) for model in corners] == [
        {"x": 0.97, "y": 0.97}, {"x": 0.97, "y": 1.03}, {"x": 1.03, "y": 0.97}, {"x": 1.03, "y": 1.03},
    ]  # fmt: skip
    moved = off_by(machine, corners[1])
    assert [mode.natural_frequency for mode in moved.axis("y").modes] == pytest.approx([30.9, 103.0])
    sure = replace(machine.axes[0], modes=(replace(machine.axes[0].modes[0], frequency_uncertainty=0.0),))
    assert models(replace(machine, axes=(sure,))) == (NOMINAL,)


def test_contour_shaping_is_the_best_of_all_kinds_on_the_bundled_sample():
    rows = traded("bracket.nc", load_machine(bundled("xy_stage.yaml")))
    assert list(rows) == ["unshaped", "axis_shaped", "path_shaped", "contour_shaped"]
    for pick in (
        lambda row: row.nominal.tool.rms,
        lambda row: row.worst.tool.rms,
        lambda row: row.worst_max,
    ):
        values = {name: pick(row) for name, row in rows.items()}
        assert values["contour_shaped"] < values["axis_shaped"] < values["path_shaped"] < values["unshaped"]
    for row in rows.values():
        assert row.worst.tool.rms == max(result.tool.rms for result in row.results) > row.nominal.tool.rms
    assert rows["contour_shaped"].contour_factors == {"x": 0.0, "y": 0.0}
    assert rows["axis_shaped"].contour_factors["x"] == pytest.approx(-0.643, abs=1e-3)


def test_shapers_with_no_common_one_leave_path_shaping_out():
    setup = load_machine(bundled("xy_stage.yaml"))
    modes = [[Mode(f + 7.0 * k, 0.01) for k in range(6)] for f in (30.0, 31.0)]
    setup = replace(setup, shapers=dict(zip("xy", map(cascade, modes), strict=True)))
    assert list(traded("clover.csv", setup)) == ["unshaped", "axis_shaped", "contour_shaped"]


def test_a_corner_is_the_case_run_on_a_machine_that_is_off_so_much():
    setup = load_machine(bundled("xy_stage.yaml"))
    row = traded("clover.csv", setup)["axis_shaped"]
    found = row.results[2]
    other = replace(setup, machine=off_by(setup.machine, found.model))
    case = simulate_program(bundled("clover.csv"), other, ["axis_shaped"], record=False).summary.cases[0]
    assert found.tool == case.tool
    assert found.residual_vibration == case.residual_vibration
    nominal = simulate_program(bundled("clover.csv"), setup, ["axis_shaped"], record=False).summary.cases[0]
    assert (row.nominal.tool, row.command, row.cycle_time) == (
        nominal.tool, nominal.command, nominal.cycle_time,
    )  # fmt: skip


def test_a_time_trajectory_has_no_path_shaping():
    rows = traded("circle_time.csv", load_machine(bundled("xy_stage.yaml")))
    assert list(rows) == ["unshaped", "axis_shaped", "contour_shaped"]


def test_the_report_shows_the_trade(capfd, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    got = answer(capfd, "simulate", str(bundled("clover.csv")), "--report", "-o", "run")
    assert [row["name"] for row in got["trade"]] == [
        "unshaped", "axis_shaped", "path_shaped", "contour_shaped",
    ]  # fmt: skip
    assert [len(row["models"]) for row in got["trade"]] == [5] * 4
    assert json.loads((tmp_path / "run/results.json").read_text())["trade"] == got["trade"]
    page = (tmp_path / "run/report.html").read_text()
    assert "path_shaped" in page
    assert "with the frequencies off by what the machine file says (4 models" in page
    assert (tmp_path / "run/figures/trade.svg").is_file()


def test_a_machine_without_shapers_has_no_trade():
    setup = load_machine(bundled("xy_stage.yaml"))
    assert traded("clover.csv", replace(setup, shapers={}, planning=setup.planning)) == {}
