"""Slowing down: only where the tool would leave its tolerance, and what was shown is what is told."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from answers import answer, refused

from cnc_shape.cases import pick_cases, timings
from cnc_shape.config.bundled import bundled
from cnc_shape.config.machine_file import load_machine
from cnc_shape.config.setup import Shaping
from cnc_shape.errors import OptionError
from cnc_shape.opening import open_motion, path_places
from cnc_shape.pipeline import run
from cnc_shape.readers import ReadingOptions
from cnc_shape.slowing import slow_down
from cnc_shape.trade import models, off_by

OPTIONS = ReadingOptions()
PROGRAM = str(bundled("bracket.nc"))


def stage(**planning):
    setup = load_machine(bundled("xy_stage.yaml"))
    return replace(setup, planning=replace(setup.planning, **planning))


def summary(setup, slowdown):
    cases = pick_cases(setup, ["unshaped", "shaped"], slowdown)
    with open_motion(PROGRAM, setup, OPTIONS, timings(cases)) as motion:
        return run(motion.blocks, setup, cases, motion.name).summary


@pytest.fixture(scope="module")
def slowed():
    return slow_down(PROGRAM, stage(), OPTIONS, 0.05)


def test_what_was_shown_is_true_in_every_model(slowed):
    assert slowed.met
    setup = stage()
    worst = 0.0
    for model in models(setup.machine):
        off = replace(setup, machine=off_by(setup.machine, model))
        # the compensation stays as designed for the nominal structure: only the simulated one is off
        cases = [replace(case, shaping=setup.command_shaping(Shaping.CONTOUR)) if case.name == "shaped" else case
                 for case in pick_cases(off, ["shaped"], slowed.slowdown)]  # fmt: skip
        with open_motion(PROGRAM, off, OPTIONS, timings(cases)) as motion:
            worst = max(worst, run(motion.blocks, off, cases, "x").summary.cases[0].tool.max)
    assert worst == pytest.approx(slowed.reached, rel=1e-9)
    assert worst <= 0.05


def test_the_rest_of_the_program_keeps_its_pace(slowed):
    """A little slower where it must be; most cells, and the unshaped motion, are as fast as before."""
    factor = slowed.slowdown.factor
    assert factor.size == path_places(PROGRAM, stage(), OPTIONS).size
    assert (factor == 1.0).mean() > 0.4
    found = summary(stage(), slowed.slowdown)
    plain = summary(stage(), None)
    assert found.cycle_time == plain.cycle_time == slowed.unhurried
    assert plain.cases[1].cycle_time < found.cases[1].cycle_time < 1.25 * plain.cases[1].cycle_time
    assert found.cases[1].tool.max < 0.05 < plain.cases[1].tool.max


def test_only_what_leads_to_an_error_is_slowed(tmp_path):
    """One sharp turn between two long lines: nothing is slowed that is passed long before or after it."""
    part = tmp_path / "turn.nc"
    part.write_text("G21 G90 G64 P0.005\nG1 X200 F6000\nY200\nM2\n")
    found = slow_down(str(part), stage(), OPTIONS, 0.02)
    assert found.met
    slowed = path_places(str(part), stage(), OPTIONS)[found.slowdown.factor < 1.0]
    inner = slowed[(slowed > 20.0) & (slowed < 380.0)]  # away from start and end
    assert inner.size > 0
    assert 190.0 < inner.min() < 200.0 < inner.max() < 210.0


def test_slowing_everything_alike_costs_more(slowed):
    """The least factor for all cells keeps the tolerance, too, but takes much longer."""
    alike = replace(
        slowed.slowdown, factor=np.full_like(slowed.slowdown.factor, slowed.slowdown.factor.min())
    )
    found = summary(stage(), alike).cases[1]
    assert found.tool.max < 0.05
    assert found.cycle_time > 1.15 * summary(stage(), slowed.slowdown).cases[1].cycle_time


def test_contour_shaping_needs_less_slowing_than_axis_shaping(slowed):
    axis = slow_down(PROGRAM, stage(shaping=Shaping.AXIS), OPTIONS, 0.05)
    assert axis.met
    assert axis.cycle_time > slowed.cycle_time


def test_a_tolerance_that_holds_anyway_changes_nothing():
    easy = slow_down(PROGRAM, stage(), OPTIONS, 1.0)
    assert (easy.slowdown, easy.passes, easy.met) == (None, 1, True)
    assert easy.cycle_time == easy.unhurried


def test_what_cannot_be_kept_is_told():
    """The program itself rounds its corners by up to 20 um."""
    hopeless = slow_down(PROGRAM, stage(), OPTIONS, 0.0105)
    assert not hopeless.met
    assert hopeless.passes <= 15
    assert "does not keep 10.5 µm" in hopeless.summary()


@pytest.mark.parametrize(
    ("file", "reason"), [("-", "standard input is gone"), (str(bundled("circle_time.csv")), "its own times")]
)
def test_what_cannot_be_planned_again_is_refused(file, reason):
    with pytest.raises(OptionError, match=reason):
        slow_down(file, stage(), OPTIONS, 0.05)


def test_the_commands_slow_down(capfd, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    text = (
        bundled("xy_stage.yaml")
        .read_text()
        .replace("path_tolerance_mm: 0.01 ", "path_tolerance_mm: 0.01\n  tool_tolerance_mm: 0.05 ")
    )
    (tmp_path / "m.yaml").write_text(text)
    got = answer(capfd, "simulate", PROGRAM, "-m", "m.yaml", "--cases", "unshaped,shaped")
    assert got["tool_tolerance"]["met"]
    assert got["cases"][1]["tool_contour_max_um"] <= 50.0
    applied = answer(capfd, "apply", PROGRAM, "-m", "m.yaml", "-o", "part.csv")
    assert applied["tool_tolerance"] == got["tool_tolerance"]
    assert applied["shaped_time_s"] == pytest.approx(got["cases"][1]["cycle_time_s"], abs=1e-12)
    (tmp_path / "m.yaml").write_text(text.replace("tool_tolerance_mm: 0.05", "tool_tolerance_mm: 0.01"))
    assert "not more than path_tolerance_mm" in refused(capfd, "simulate", PROGRAM, "-m", "m.yaml")
