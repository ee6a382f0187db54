"""Way-points and time trajectories as CSV, and the table of readers."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from programs import assert_same, from_memory
from programs import read as read_gcode

from cnc_shape.errors import InfeasibleError, OptionError, ProgramError
from cnc_shape.program import Motion, Program, concatenate
from cnc_shape.readers import Curve, ReadingOptions, read_chunks, read_program, read_trajectory, reading
from cnc_shape.readers.source import ReadingLimits
from cnc_shape.toolpath import Toolpath, build_toolpath


@pytest.fixture
def file(tmp_path):
    def write(text: str | bytes, name: str = "path.csv"):
        path = tmp_path / name
        path.write_bytes(text.encode() if isinstance(text, str) else text)
        return path

    return write


def test_waypoints_become_straight_feeds_from_the_first(file):
    program = read_program(file("x_mm,y_mm,feed_mm_min\n1,2,60\n4,6,600\n\n4,7,1200\n"))
    assert program.axes == ("x", "y", "z")
    assert program.start.tolist() == [1.0, 2.0, 0.0]
    assert program.target.tolist() == [[4.0, 6.0, 0.0], [4.0, 7.0, 0.0]]
    assert program.feed_rate.tolist() == [10.0, 20.0]
    assert program.line.tolist() == [3, 5]


def test_units_stand_in_the_header(file):
    program = read_program(file("\ufeffA_deg, X_in ,y_um,feed_in_min\r\n0,0,0,1\r\n180,1,1e3,60\r\n"))
    assert program.axes == ("x", "y", "z", "a")
    assert_allclose(program.target, [[25.4, 1.0, 0.0, math.pi]])
    assert_allclose(program.feed_rate, [25.4])


def test_a_closed_path_returns_to_the_first_point(file):
    path = file("x_mm,y_mm\n1,0\n2,0\n2,1\n")
    program = read_program(path, ReadingOptions(closed=True))
    assert program.target.tolist() == [[2, 0, 0], [2, 1, 0], [1, 0, 0]]
    assert program.feed_rate.tolist() == [math.inf] * 3
    assert "as fast as they can" in program.notes[0].message


@pytest.mark.parametrize("rows", [1, 2, 7, 1000])
@pytest.mark.parametrize("closed", [False, True])
@pytest.mark.parametrize("count", [2, 3, 8, 50])
def test_chunks_of_any_size_hold_the_same_bits(file, rows, closed, count):
    text = "x_mm,a_deg,feed_mm_min\n" + "".join(f"{i % 3},{i * 0.1},{i + 1}\n" for i in range(count))
    path = file(text)
    whole = read_program(path, ReadingOptions(closed=closed, rows=10**9))
    parts = list(read_chunks(path, ReadingOptions(closed=closed, rows=rows)))
    assert_same(concatenate(parts), whole)
    assert max(len(part) for part in parts) <= rows + closed


coordinates = st.integers(-99999, 99999).map(lambda i: f"{i / 100:.2f}")
points = st.lists(
    st.tuples(coordinates, coordinates, coordinates, st.integers(1, 9999)), min_size=1, max_size=20
)


@given(points)
@settings(max_examples=50)
def test_gcode_and_csv_of_one_shape_give_equal_toolpaths(shape):
    gcode = "".join(f"G1 X{x} Y{y} A{a} F{f}\n" for x, y, a, f in shape) + "M2\n"
    table = "x_mm,y_mm,a_deg,feed_mm_min\n0,0,0,1\n" + "".join(f"{x},{y},{a},{f}\n" for x, y, a, f in shape)
    one, other = build_toolpath(read_gcode(gcode + "(A0)")), build_toolpath(read_table(table))
    for name in set(Toolpath.__slots__) - {"source", "line"}:
        if isinstance(getattr(one, name), np.ndarray):
            assert_allclose(getattr(one, name), getattr(other, name), rtol=1e-15, err_msg=name)
        else:
            assert getattr(one, name) == getattr(other, name)
    assert_array_equal(one.line + 2, other.line)


def read_table(text: str) -> Program:
    from cnc_shape.readers import table_reading

    source = from_memory(text, name="path.csv")
    return concatenate(table_reading(source, ReadingOptions()).chunks)


@pytest.mark.parametrize(
    ("text", "line", "column", "reason"),
    [
        ("x_mm,y_mm\n1,2\n3\n", 3, 1, "1 cells, the header has 2"),
        ("x_mm,y_mm\n1,2\n3,4,5\n", 3, 1, "3 cells, the header has 2"),
        ("x_mm,y_mm\n1,2\n3, four\n", 3, 4, "'four' is no number for y"),
        ("x_mm,y_mm\n1,2\n3,nan\n", 3, 3, "'nan' is no number"),
        ("x_mm,y_mm\n1,2\n3,inf\n", 3, 3, "'inf' is no number"),
        ("x_mm,y_mm\n1,2\n3,1_0\n", 3, 3, "'1_0' is no number"),
        ("x_mm,y_mm\n1,2\n3,\n", 3, 3, "'' is no number"),
        ("x_mm,y_mm\n1,2\n3,1e999\n", 3, 3, "y is beyond the limit of 1e"),
        ("x_mm,y_mm\n1,2\n3,2e6\n", 3, 3, "y is beyond the limit of 1e"),
        ("x_mm,y_mmm\n1,2\n", 1, 6, "unknown column 'y_mmm'"),
        ("x_mm,x_in\n1,2\n", 1, 6, "a second column for x"),
        ("time_s,feed_mm_min\n1,2\n", 1, 1, "no column is an axis"),
        ("x_mm,y_mm\n1,2\n", None, None, "fewer than two way-points"),
        ("x_mm,feed_mm_min\n1,2\n2,0\n", 3, 1, "the feed is below the limit"),
        ("time_s,x_mm\n0,1\n1,2\n0.5,3\n", 4, 1, "time runs backwards at 0.5 s"),
        ("time_s,x_mm\n0,1\n1,2\n1,3\n", 4, 1, "time stands still at 1 s"),
        ("time_s,x_mm\n0,1\n", None, None, "fewer than two rows"),
        ("x_mm,y_mm\n1,2\n3,\0\n", 3, 3, "NUL"),
    ],
)
def test_what_is_refused_and_where(file, text, line, column, reason):
    with pytest.raises(ProgramError, match=reason) as caught:
        read_program(file(text))
    assert (caught.value.line, caught.value.column) == (line, column)
    assert caught.value.hint


@given(st.text(alphabet="xyatime_s,mdegfin0123456789.-+eE \n\r", max_size=80))
@settings(max_examples=200)
def test_no_text_ends_in_anything_but_an_answer(text):
    for head in ("", "x_mm,y_mm\n", "time_s,x_mm\n0,0\n"):
        try:
            program = read_table(head + text)
        except ProgramError:
            continue
        assert np.isfinite(program.target).all()


# time trajectories

TIMED = "time_s,x_mm,y_mm\n10,0,0\n10.2,3,4\n10.4,3,4\n11,3,10\n"


def test_a_trajectory_is_resampled_linearly(file):
    trajectory, toolpath = read_trajectory(file(TIMED), 0.1)
    assert_allclose(trajectory.position[:, 0], [0, 1.5, 3, 3, 3, 3, 3, 3, 3, 3, 3], atol=1e-12)
    assert_allclose(trajectory.position[:, 1], [0, 2, 4, 4, 4, 5, 6, 7, 8, 9, 10], atol=1e-12)
    assert_allclose(trajectory.arc_length, [0, 2.5, 5, 5, 5, 6, 7, 8, 9, 10, 11], atol=1e-12)
    assert_allclose(trajectory.velocity[:, 1], [0, 20, 10, 0, 5, 10, 10, 10, 10, 10, 0], atol=1e-9)
    assert_allclose(trajectory.acceleration[:, 1], [0, 0, -200, 0, 100, 0, 0, 0, 0, 0, 0], atol=1e-9)
    assert trajectory.replayed
    assert toolpath.kind.tolist() == [Motion.FEED, Motion.DWELL, Motion.FEED]
    assert_allclose(toolpath.arc_length, [0, 5, 5, 11])
    assert_allclose(toolpath.feed_rate[[0, 2]], [25.0, 10.0])
    assert toolpath.dwell[1] == pytest.approx(0.2)


def test_the_last_sample_is_the_first_at_or_after_the_end(file):
    trajectory, _ = read_trajectory(file("time_s,x_mm\n0,0\n0.25,1\n"), 0.1)
    assert trajectory.position[:, 0].tolist() == pytest.approx([0.0, 0.4, 0.8, 1.0])


def test_a_trajectory_beyond_the_limit_of_samples_is_refused(file):
    with pytest.raises(InfeasibleError, match="limit of 5"):
        read_trajectory(file(TIMED), 0.1, ReadingOptions(limits=ReadingLimits(samples=5)))


def test_way_points_are_no_trajectory(file):
    with pytest.raises(ProgramError, match="no column is the time"):
        read_trajectory(file("x_mm,y_mm\n0,0\n1,1\n"), 0.1)


# the door


def test_readers_go_by_suffix_and_else_by_the_first_line(file):
    for name, dialect in (("a.nc", "rs274"), ("a.NGC", "rs274"), ("a.strange", "rs274")):
        with reading(file("G0 X1\nM2\n", name)) as opened:
            assert (opened.dialect, opened.lines) == (dialect, 2)
    for name in ("a.csv", "a.strange"):
        with reading(file("x_mm,y_mm\n0,0\n1,1", name)) as opened:
            assert (opened.dialect, opened.lines) == ("csv", 3)


@pytest.mark.parametrize("curve", [Curve.SPLINE, Curve.CIRCLE])
def test_curves_through_way_points_are_not_built_yet(file, curve):
    with pytest.raises(OptionError, match=f"--path {curve.value} is not built yet"):
        read_program(file("x_mm,y_mm\n0,0\n1,1\n"), ReadingOptions(curve=curve))


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        (b"", "the file is empty"),
        (b"\xff\xfeG\x000\x00", "UTF-16"),
        (b"G0 X1\n" * 10, "more than the limit of 50 bytes"),
        (b"G0 X1" + b" " * 44, "longer than the limit of 40 bytes"),
    ],
)
def test_files_that_are_no_text_or_too_long(file, data, reason):
    options = ReadingOptions(limits=ReadingLimits(file_bytes=50, line_bytes=40))
    with pytest.raises(ProgramError, match=reason):
        read_program(file(data, "a.nc"), options)


def test_files_that_cannot_be_read(tmp_path):
    for path in (tmp_path / "absent.nc", tmp_path, "a\0.nc"):
        with pytest.raises(ProgramError, match="cannot read"):
            read_program(path)


def test_a_fault_of_the_caller_is_not_the_files(file):
    with pytest.raises(BrokenPipeError), reading(file("G0 X1\nM2\n", "a.nc")):
        raise BrokenPipeError


def test_an_endless_line_is_refused_before_it_is_gathered(file):
    with pytest.raises(ProgramError, match="longer than the limit"):
        read_program(file(b"G" * 5_000_000, "a.nc"))


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_line_ends_across_the_border_of_two_blocks(monkeypatch, end):
    from cnc_shape.readers import source

    text = end.join(["G0 X1", "", "G0 X22", "", "", "M2"])
    for size in range(1, len(text) + 2):
        monkeypatch.setattr(source, "BLOCK_BYTES", size)
        opened = from_memory(text)
        assert list(source.lines(opened)) == list(enumerate(["G0 X1", "", "G0 X22", "", "", "M2"], 1))
