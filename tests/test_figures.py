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
from runs import MODE, make_run, shaper

from cnc_shape.arrays import frozen
from cnc_shape.report import figures
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
