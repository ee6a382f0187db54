"""A mode over position against the shaper's design point: what is left, told, warned of and drawn."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from conftest import ROOT
from numpy.testing import assert_allclose, assert_array_equal
from runs import make_run, shaper

from cnc_shape.cli import run
from cnc_shape.config import check_machine
from cnc_shape.config.machine_file import load_machine, parse_machine
from cnc_shape.limits import Limits
from cnc_shape.machine import Axis, Machine
from cnc_shape.modes import Mode, ModeTable
from cnc_shape.report.folder import Context, write_report
from cnc_shape.report.position_figure import modes_over_position
from cnc_shape.shapers import zvd
from cnc_shape.shapers.analysis import residual_vibration
from cnc_shape.shapers.insensitivity import insensitivity
from cnc_shape.shapers.over_position import over_position
from cnc_shape.trade import Model, off_by

TABLE = ModeTable("z", (-300.0, -100.0, 0.0), (28.0, 40.0, 48.0), (0.03, 0.03, 0.03))
MODE = Mode(40.0, 0.03, table=TABLE)
EXAMPLE = (ROOT / "docs" / "machine-file.md").read_text(encoding="utf-8")
EXAMPLE = EXAMPLE.split("## Modes over position")[1].split("```yaml")[1].split("```")[0]


@pytest.fixture
def machine(tmp_path):
    path = tmp_path / "mill.yaml"
    path.write_text(EXAMPLE)
    return path


# --- the numbers ----------------------------------------------------------------------------------


def test_a_mode_is_followed_over_the_rows_or_the_travel():
    whole, part = over_position(MODE, zvd(MODE)), over_position(MODE, zvd(MODE), (-250.0, 50.0))
    assert (whole.position[0], whole.position[-1]) == (-300.0, 0.0)
    assert (part.position[0], part.position[-1]) == (-250.0, 50.0)
    assert set(TABLE.position) <= set(whole.position)
    assert {-100.0, 0.0} <= set(part.position)
    assert_allclose(whole.deviation, (-0.3, 0.2), rtol=1e-15)
    assert_allclose(part.deviation, (-0.225, 0.2), rtol=1e-12)
    assert over_position(MODE, None, (-np.inf, np.inf)).position[0] == -300.0
    with pytest.raises(ValueError, match="no table"):
        over_position(replace(MODE, table=None), None)


def test_what_is_left_is_the_residual_vibration_of_the_mode_that_stands_there():
    found = over_position(MODE, zvd(MODE))
    for row in range(0, found.position.size, 97):
        there = MODE.at(found.position[row])
        assert_allclose(found.vibration[row], residual_vibration(zvd(MODE), there), rtol=1e-12)
    assert found.worst == (found.vibration[0], -300.0)
    assert_array_equal(over_position(MODE, None).vibration, 1.0)


def test_it_stays_calm_where_the_frequency_is_in_the_band():
    """With one damping ratio everywhere the ends of both are the same."""
    found, interval = over_position(MODE, zvd(MODE)), insensitivity(zvd(MODE), [MODE])
    assert_allclose(found.band, (40.0 * interval.low, 40.0 * interval.high), rtol=1e-12)
    inside = (found.frequency >= found.band[0]) & (found.frequency <= found.band[1])
    assert_array_equal(inside, found.vibration <= 0.05)
    low, high = found.calm()
    assert_allclose([TABLE.at(low)[0], TABLE.at(high)[0]], found.band, atol=0.05)


def test_a_shaper_for_another_mode_has_no_band_and_is_nowhere_calm():
    found = over_position(MODE, zvd(Mode(100.0, 0.0)))
    assert found.band is None
    assert found.calm() is None


def test_models_of_a_trade_take_the_table_with_them():
    machine = Machine("test", (Axis("x", Limits(1.0, 1.0), modes=(MODE,)),))
    (mode,) = off_by(machine, Model({"x": 1.1})).axes[0].modes
    assert_allclose([mode.natural_frequency, *mode.table.natural_frequency], [44.0, 30.8, 44.0, 52.8])


# --- what is told ---------------------------------------------------------------------------------


def test_a_check_tells_where_modes_go_and_what_is_left(machine):
    found = check_machine(machine)
    (mode,) = found["position_modes"]
    assert (mode["axis"], mode["over"], mode["design_frequency_hz"]) == ("x", "z", 40.0)
    assert mode["position_mm"] == [-250.0, 0.0]
    assert_allclose(mode["frequency_hz"], [31.0, 48.0], rtol=1e-12)
    assert_allclose(mode["deviation"], [-0.225, 0.2], rtol=1e-12)
    setup = load_machine(machine)
    shaped, there = setup.shapers["x"], setup.machine.axis("x").modes[0].at(-250.0)
    assert_allclose(mode["residual_vibration"], residual_vibration(shaped, there), rtol=1e-12)
    assert mode["residual_vibration_position_mm"] == -250.0
    (warning,) = found["warnings"]
    assert warning["line"] == EXAMPLE.split("over_position")[0].count("\n") + 2
    assert warning["message"].startswith(
        "axis x: mode of 40 Hz goes from 31 to 48 Hz (-22.5 to +20 %) over Z"
    )
    assert (
        "zvd leaves up to 11.3 % of its vibration, at Z -250, and at most 5 % from -199" in warning["message"]
    )


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ("    shaper: {type: zvd}\n", ""),
        ("axes:", "planning: {shaping: none}\naxes:"),
        ("[28, 40, 48]", "[38, 40, 42]"),
    ],
    ids=["no shaper", "shapers at rest", "within the band"],
)
def test_there_is_nothing_to_warn_of(before, after):
    assert before in EXAMPLE
    assert parse_machine(EXAMPLE.replace(before, after).encode(), "mill.yaml").warnings == ()


def test_angles_are_told_in_degrees():
    text = EXAMPLE.replace("axis: z", "axis: a").replace("position_mm: [-300", "position_deg: [-300")
    (warning,) = parse_machine(text.encode(), "mill.yaml").warnings
    assert "over A -300 to 0 °" in warning
    assert "at A -300" in warning


@pytest.mark.parametrize("command", ["check", "simulate"])
def test_commands_warn(command, machine, tmp_path, capsys):
    part = tmp_path / "part.nc"
    part.write_text("G21 F600\nG1 X1\nM2\n")
    words = [command, str(part), "-m", str(machine), "--json"]
    assert run(words) == 0
    told = capsys.readouterr()
    assert json.loads(told.out)["schema"]
    assert f"{machine}:10: warning: axis x: mode of 40 Hz goes" in told.err
    assert run([*words, "--quiet"]) == 0
    assert "mode of 40 Hz" not in capsys.readouterr().err


def test_the_table_of_a_check_shows_the_mode(machine, capsys):
    assert run(["check", str(machine)]) == 0
    assert "X: mode of 40 Hz goes from 31 to 48 Hz" in " ".join(capsys.readouterr().out.split())


# --- what is drawn --------------------------------------------------------------------------------


def test_a_report_draws_it_and_only_where_there_is_a_table(tmp_path):
    caption = "Left: modes over the position of an axis"
    shapers = {"x": shaper()}
    for modes, drawn in (((MODE,), True), ((replace(MODE, table=None),), False)):
        folder = tmp_path / str(drawn)
        page = write_report(make_run(600), folder, Context(shapers=shapers, modes={"x": modes}))
        assert (folder / "figures" / "modes.svg").exists() == drawn
        assert (caption in page.read_text(encoding="utf-8")) == drawn


def test_the_figure_holds_the_curves_band_and_design_point():
    from cnc_shape.report.position_figure import position_figure

    shaped = zvd(MODE)
    found = modes_over_position({"x": shaped, "y": shaped}, {"x": (MODE, Mode(90.0, 0.01)), "y": ()})
    assert [axis for axis, _ in found] == ["x"]
    left, right = position_figure(found).axes
    design, mode, rows = (line.get_ydata() for line in left.lines)
    assert_array_equal(design, 40.0)
    assert_array_equal(mode, found[0][1].frequency)
    assert_array_equal(rows, TABLE.natural_frequency)
    (band,) = left.patches
    assert_allclose((band.get_y(), band.get_y() + band.get_height()), found[0][1].band, rtol=1e-12)
    assert_allclose(right.lines[0].get_ydata(), 100.0 * found[0][1].vibration)
    assert left.get_xlabel() == "Z (mm)"
