"""Figures: the same bytes each time, the worst points always drawn, units on every axis."""

from __future__ import annotations

import re
from dataclasses import replace

import matplotlib as mpl
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from runs import INERTIA, MODE, driven, make_run, shaper

from cnc_shape.arrays import frozen
from cnc_shape.report import figures
from cnc_shape.report.motor_figures import motor_cases, motor_figure
from cnc_shape.report.shaper_figure import shaper_figure
from cnc_shape.report.style import render

RUN = make_run(2000)
SHAPERS = {"x": shaper(), "y": shaper()}
MODES = {"x": (MODE,), "y": (MODE,)}
DRAW = {
    "path": figures.path_figure,
    "error": figures.error_figure,
    "motion": figures.motion_figure,
    "vibration": figures.vibration_figure,
}


@pytest.mark.parametrize("name", DRAW)
@pytest.mark.parametrize("kind", ["svg", "png", "pdf"])
def test_a_figure_drawn_twice_is_the_same_to_the_byte(name, kind):
    first = render(DRAW[name](RUN), kind)
    with mpl.rc_context({"font.size": 20.0, "lines.linewidth": 9.0, "svg.hashsalt": "other"}):
        second = render(DRAW[name](RUN), kind)
    assert first == second
    assert b"20" + b"26-" not in first  # no date


@pytest.mark.parametrize("name", DRAW)
def test_every_axis_carries_its_unit(name):
    for ax in DRAW[name](RUN).axes:
        for label in (ax.get_xlabel(), ax.get_ylabel()):
            assert label == "" or re.search(r"\((mm|s|µm|mm/s|mm/s²)\)$", label)
    assert any(ax.get_xlabel() for ax in DRAW[name](RUN).axes)


DRIVEN = driven(2000)


def test_disturbed_cases_have_their_motors_drawn_or_else_the_last():
    assert [signals.case for signals in motor_cases(DRIVEN)] == [
        "independent+disturbed", "disturbance_observer+disturbed",
        "disturbance_observer+inertia_compensation+disturbed",
    ]  # fmt: skip
    assert motor_cases(RUN) == []
    rows = tuple(replace(case, disturbed=False) for case in DRIVEN.summary.cases)
    calm = replace(DRIVEN, summary=replace(DRIVEN.summary, cases=rows))
    assert motor_cases(calm) == [DRIVEN.signals[-1]]
    with pytest.raises(ValueError, match="no servo motors"):
        motor_figure(RUN.signals[0])


def test_load_torque_and_estimate_of_every_motor_are_drawn_with_their_extremes():
    for signals, panels in zip(motor_cases(DRIVEN), (2, 2, 4), strict=True):
        figure, motors = motor_figure(signals), signals.motors
        assert len(figure.axes) == panels
        for k, ax in enumerate(figure.axes[:2]):
            drawn = [motors.load, motors.torque, *([motors.estimate] if motors.estimate.any() else [])]
            assert len(ax.lines) == len(drawn)
            for line, values in zip(ax.lines, drawn, strict=True):
                assert np.max(line.get_ydata()) == values[:, k].max()
                assert np.min(line.get_ydata()) == values[:, k].min()
        for ax, values in zip(figure.axes[2:], (motors.gain_ratio, motors.effective_inertia), strict=False):
            assert [np.max(line.get_ydata()) for line in ax.lines] == values.max(axis=0).tolist()
        for ax in figure.axes:
            assert re.search(r"\((N m|-|kg m²)\)$", ax.get_ylabel())
        assert figure.axes[-1].get_xlabel() == "time (s)"
        assert render(figure, "svg") == render(motor_figure(signals), "svg")


def test_an_inertia_that_is_identified_has_a_panel():
    signals = DRIVEN.signals[-1]
    learnt = INERTIA * np.linspace(1.0, 2.0, signals.time.size)[:, None] * [1.0, 0.9]
    figure = motor_figure(replace(signals, motors=replace(signals.motors, inertia=frozen(learnt))))
    assert figure.axes[-1].get_title(loc="left") == "Identified inertia"
    assert [line.get_ydata()[-1] for line in figure.axes[-1].lines] == learnt[-1].tolist()


def test_a_disturbed_case_has_the_colour_of_its_undisturbed_dotted_self():
    lines = figures.error_figure(DRIVEN).axes[0].lines
    for calm, disturbed in zip(lines[::2], lines[1::2], strict=True):
        assert calm.get_color() == disturbed.get_color()
        assert (calm.get_linestyle(), disturbed.get_linestyle()) == ("--", "-")
    assert len({line.get_color() for line in lines}) == 3


@pytest.mark.parametrize("draw", [figures.error_figure, figures.motion_figure, figures.vibration_figure])
def test_no_legend_is_cut_however_long_the_names(draw):
    figure = draw(DRIVEN)
    figure.canvas.draw()
    (legend,) = figure.legends
    box = legend.get_window_extent()
    assert figure.bbox.x0 <= box.x0 < box.x1 <= figure.bbox.x1
    assert box.y0 >= figure.bbox.y0
    assert all(box.y1 <= ax.get_tightbbox().y0 for ax in figure.axes)


def test_svg_holds_no_font_and_no_reference_outside():
    for draw in DRAW.values():
        svg = render(draw(RUN), "svg").decode()
        assert "<text" not in svg
        assert "script" not in svg
        assert not re.search(r'href="(?!#)', svg)


@given(arrays(np.float64, st.integers(1, 300), elements=st.integers(-3, 3).map(float)), st.integers(1, 40))
def test_thinning_keeps_both_ends_and_the_extremes_of_every_stretch(values, buckets):
    rows = figures.worst_rows(values, buckets)
    assert rows[0] == 0
    assert rows[-1] == values.size - 1
    assert (np.diff(rows) > 0).all()
    assert rows.size <= max(2 * buckets + 2, 1)
    kept = values[rows]
    assert kept.max() == values.max()
    assert kept.min() == values.min()


@pytest.mark.parametrize("samples", [20, 200_000])
def test_few_and_many_samples_are_drawn_with_the_worst_in_them(samples):
    run = make_run(samples)
    figure = figures.error_figure(run)
    for ax, name in zip(figure.axes, ("tool_error", "drive_error"), strict=True):
        for line, signals in zip(ax.lines, run.signals, strict=True):
            worst = getattr(signals, name).max()
            assert np.max(line.get_ydata()) == worst / 1e-3
            assert len(line.get_ydata()) <= 2 * figures.DRAWN + 2
    for draw in DRAW.values():
        assert len(render(draw(run), "svg")) < 1_500_000


def test_the_magnified_tool_is_as_far_off_as_the_legend_says():
    figure = figures.path_figure(RUN)
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    factor = float(next(label for label in labels if "\N{MULTIPLICATION SIGN}" in label).split()[-1])
    unshaped = RUN.signals[0]
    drawn = np.column_stack(figure.axes[0].lines[2].get_data())[0]
    worst = int(unshaped.tool_error.argmax())
    away = np.linalg.norm(drawn - unshaped.foot[worst, :2])
    assert away == pytest.approx(factor * unshaped.tool_error[worst], rel=1e-9)
    size = np.ptp(RUN.path, axis=0).max()
    assert 0.02 * size <= away <= figures.MAGNIFIED_SHARE * size


def test_more_cases_than_colours_are_all_drawn_and_told_apart():
    cases = [replace(RUN.signals[0], case=f"case {k}") for k in range(8)]
    rows = [replace(RUN.summary.cases[0], name=signals.case) for signals in cases]
    run = replace(RUN, signals=tuple(cases), summary=replace(RUN.summary, cases=tuple(rows)))
    lines = figures.error_figure(run).axes[0].lines
    assert len({(line.get_color(), line.get_linestyle(), line.get_linewidth()) for line in lines}) == 8
    assert sum(ax.get_visible() for ax in figures.path_figure(run).axes) == 8


@pytest.mark.parametrize("shape", [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [1.0, 1e-3, 0.0], [0.0, 0.0, 0.0]])
def test_flat_and_empty_paths_are_drawn(shape):
    flat = [
        replace(
            s, tool=frozen(s.tool * shape), foot=frozen(s.foot * shape), tool_error=frozen(0.0 * s.tool_error)
        )
        for s in RUN.signals
    ]
    run = replace(RUN, path=frozen(RUN.path * shape), signals=tuple(flat))
    assert render(figures.path_figure(run), "png")


def test_axes_with_one_shaper_share_a_row():
    assert len(shaper_figure(SHAPERS, MODES).axes) == 2
    other = {**SHAPERS, "z": replace(shaper(), times=frozen([0.0, 0.01]))}
    assert len(shaper_figure(other, {**MODES, "z": ()}).axes) == 4
    first, second = (render(shaper_figure(SHAPERS, MODES), "svg") for _ in range(2))
    assert first == second


def test_what_the_structure_does_after_the_end_is_drawn_and_may_be_nothing():
    rest = figures.vibration_figure(RUN).axes[1]
    for line, signals in zip(rest.lines, RUN.signals, strict=True):
        assert np.max(np.abs(line.get_ydata())) in np.abs(signals.settling).max(axis=0) / 1e-3
    still = [replace(s, settling_time=frozen([]), settling=frozen(np.zeros((0, 3)))) for s in RUN.signals]
    assert render(figures.vibration_figure(replace(RUN, signals=tuple(still))), "png")


def test_no_title_of_a_path_is_cut():
    for case in ("shaped", "shaped+cross_coupled+disturbance_observer"):
        flat = [replace(s, case=case, tool=s.tool * [1.0, 0.6, 1.0]) for s in RUN.signals]
        figure = figures.path_figure(
            replace(RUN, path=frozen(RUN.path * [1.0, 0.6, 1.0]), signals=tuple(flat))
        )
        figure.canvas.draw()
        for ax in figure.axes:
            assert ax.title.get_window_extent().y1 <= figure.bbox.y1
