"""Cycle time: how long each move takes, what that sums up to, and what ``check --time`` says of it."""

from __future__ import annotations

import csv
import json
from dataclasses import fields, replace

import naive
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from paths import arc, dwell, line, program

from cnc_shape.arrays import frozen
from cnc_shape.cli import run
from cnc_shape.cycle_time import ClockState, clocked, cycle_time
from cnc_shape.feedrate import rotary_only
from cnc_shape.kernels.passing import add_time_at_feed
from cnc_shape.limits import Limits, PathLimits
from cnc_shape.machine import Axis, Machine
from cnc_shape.motion import moving, planned
from cnc_shape.passing import Moves, passing
from cnc_shape.program import Motion, PathMode, Program
from cnc_shape.readers import ReadingOptions, read_chunks

STOP = PathMode.EXACT_STOP


def machine(velocity=200.0, acceleration=500.0, jerk=np.inf, rotary=()) -> Machine:
    limits = Limits(velocity, acceleration, jerk)
    return Machine("test", tuple(Axis(name, limits) for name in ("x", "y", "z", *rotary)))


def measured(whole, of, tolerance=0.01):
    """Moves of a program, joined, and the sums."""
    chunks = [whole] if isinstance(whole, Program) else whole
    parts, state = [], None
    for sums, moves in clocked(planned(chunks, of, tolerance), of):
        state = sums
        parts.append(moves)
    assert isinstance(state, ClockState)
    columns = [np.concatenate([getattr(part, f.name) for part in parts]) for f in fields(Moves)]
    return Moves(*columns), state.total()


def cut(whole: Program, sizes) -> list[Program]:
    """A program in chunks of `sizes` rows, over and over."""
    names = [f.name for f in fields(Program) if f.name not in ("source", "axes", "start", "notes")]
    chunks, first, n = [], 0, len(whole)
    while first < n:
        for size in sizes:
            rows = slice(first, min(n, first + size))
            start = whole.target[first - 1] if first else whole.start
            columns = {name: getattr(whole, name)[rows] for name in names}
            chunks.append(Program(whole.source, whole.axes, frozen(start), **columns))
            first = rows.stop
    return chunks


# --- closed forms -------------------------------------------------------------------------------------


def test_a_straight_move_with_jerk():
    """All seven phases: d/v + v/a + a/j."""
    moves, total = measured(program(line(100.0, feed_rate=50.0)), machine(jerk=25_000.0))
    assert_allclose(total.cycle_time, 100 / 50 + 50 / 500 + 500 / 25_000, rtol=1e-9)
    assert_allclose(moves.time, [total.cycle_time], rtol=1e-12)
    assert_allclose((total.naive_time, total.ratio), (2.0, total.cycle_time / 2.0), rtol=1e-12)
    # from 0.99 F it is sqrt(2 * 0.01 F / j) to F: at feed for the cruise and twice that
    cruise = total.cycle_time - 2 * (50 / 500 + 500 / 25_000)
    assert_allclose(total.at_feed, cruise + 2 * np.sqrt(2 * 0.5 / 25_000), rtol=1e-3)
    assert_allclose(total.share_at_feed, total.at_feed / total.cycle_time, rtol=1e-12)
    assert total.stops == 0


@pytest.mark.parametrize(("jerk", "side"), [(np.inf, 0.5), (25_000.0, 0.52)])
def test_a_square_with_exact_stops(jerk, side):
    """20/50 + 50/500 (+ 500/25000) a side: the 2.00 and 2.08 s of the whole."""
    corners = [(20.0, 0.0), (20.0, 20.0), (0.0, 20.0), (0.0, 0.0)]
    moves, total = measured(
        program(*(line(*at, feed_rate=50.0, mode=STOP) for at in corners)), machine(jerk=jerk)
    )
    assert_allclose(total.cycle_time, 4 * side, rtol=1e-9)
    assert_allclose(moves.time, side, rtol=1e-9)
    assert_allclose(moves.start, side * np.arange(4), rtol=1e-9)
    assert_allclose(moves.naive_time, 0.4, rtol=1e-12)
    assert total.stops == 3
    assert [line.line for line in total.worst] == [1, 2, 3, 4]  # equal: in their order
    assert_allclose([line.lost for line in total.worst], side - 0.4, rtol=1e-7)


def test_waits_at_one_place_are_told_apart():
    """Before the first move, one after the other, of no length, and after the last."""
    moves, total = measured(
        program(
            dwell(0.25), line(10.0, mode=STOP), dwell(0.5), dwell(0.125), line(20.0), dwell(0.0), line(30.0),
            dwell(1.0),
        ),
        machine(),
    )  # fmt: skip
    waits = moves.kind == Motion.DWELL
    assert_allclose(moves.time[waits], [0.25, 0.5, 0.125, 0.0, 1.0], rtol=0, atol=1e-12)
    assert_allclose(moves.time[~waits], 10 / 20 + 20 / 500, rtol=1e-9)
    assert_allclose((total.dwell_time, total.naive_time), (1.875, 1.875 + 1.5), rtol=1e-12)
    assert total.stops == 2


def test_a_rapid_goes_at_the_limit_of_its_slowest_axis():
    """10 of x at 200 mm/s and 30 of y at 50 mm/s take 0.6 s but for acceleration."""
    limits = (Limits(200.0, 500.0), Limits(50.0, 500.0), Limits(50.0, 500.0))
    of = Machine("test", tuple(Axis(name, limit) for name, limit in zip("xyz", limits, strict=True)))
    rapid = {"motion": Motion.RAPID, "target": (10.0, 30.0)}
    moves, total = measured(program(rapid), of)
    assert_allclose(total.naive_time, 0.6, rtol=1e-12)
    assert_allclose(total.rapid_time, 0.6 + 50.0 / 500.0, rtol=1e-9)
    assert (total.feed_time, total.at_feed, total.share_at_feed) == (0.0, 0.0, 0.0)
    assert np.isinf(moves.feed_rate).all()


def test_rotary_axes_alone_have_rows_of_their_own():
    """Three turns at one place, a wait between them: 1 rad at 0.5 rad/s, up and down at 2 rad/s^2."""
    turn = Limits(5.0, 2.0)
    of = Machine("test", (*machine().axes, Axis("a", turn)))
    moves, total = measured(
        program(
            line(10.0, 0.0, 0.0, 0.0), line(10.0, 0.0, 0.0, 1.0, feed_rate=0.5), dwell(0.5),
            line(10.0, 0.0, 0.0, 0.0, feed_rate=0.5), line(10.0, 0.0, 0.0, 1.0, feed_rate=0.5),
            line(20.0, 0.0, 0.0, 1.0), axes=("x", "y", "z", "a"),
        ),
        of,
    )  # fmt: skip
    assert_allclose(moves.time, [0.54, 2.25, 0.5, 2.25, 2.25, 0.54], rtol=1e-9)
    assert_allclose(moves.naive_time, [0.5, 2.0, 0.5, 2.0, 2.0, 0.5], rtol=1e-12)
    assert_allclose(moves.length, [10.0, 0, 0, 0, 0, 10.0])
    assert total.stops == 4


def test_short_lines_that_share_a_chord_are_passed_one_by_one():
    """A straight of 1000 lines: the time at s is that of one long line."""
    n, v, a = 1000, 50.0, 500.0
    moves, total = measured(program(*(line(0.1 * k, feed_rate=v) for k in range(1, n + 1))), machine())
    s, d = 0.1 * np.arange(1, n + 1), 0.1 * n
    rise = 0.5 * v * v / a
    time = np.where(s < rise, np.sqrt(2 * s / a), v / a + (s - rise) / v)
    late = s > d - rise
    time[late] = d / v + v / a - np.sqrt(2 * np.maximum(d - s[late], 0.0) / a)
    assert_allclose(moves.start + moves.time, time, rtol=0, atol=1e-6)  # 1e-13 mm before rest is 1e-8 s
    assert_allclose(total.cycle_time, d / v + v / a, rtol=1e-9)


def test_a_rounded_corner_belongs_to_both_sides():
    moves, total = measured(
        program(line(20.0, feed_rate=50.0), line(20.0, 20.0, feed_rate=50.0)), machine(), 0.1
    )
    assert total.stops == 0
    assert_allclose(moves.time[0], moves.time[1], rtol=1e-3)
    assert total.cycle_time < 1.0


# --- properties ---------------------------------------------------------------------------------------


def part(times=1) -> Program:
    """Arcs, short lines, corners, stops, waits, a rotary axis; over and over."""
    angle = np.linspace(0.0, 2.0, 60)[1:]
    wave = [line(40 + 10 * a, 3 * np.sin(3 * a), 0.0, 0.0, feed_rate=80.0) for a in angle]
    x = 40 + 10 * 2.0
    y = 3 * np.sin(6.0)
    moves = [
        dwell(0.1), line(20.0, 0.0, 0.0, 0.0, feed_rate=60.0), line(20.0, 10.0, 0.0, 0.0, feed_rate=60.0),
        arc((40.0, 10.0, 0.0, 0.0), (30.0, 10.0, 0.0), -np.pi, feed_rate=40.0),
        line(40.0, 0.0, 0.0, 0.0, feed_rate=60.0, mode=STOP), dwell(0.05), dwell(0.2), *wave,
        line(x, y, 0.0, 1.0, feed_rate=1.0), line(x, y, 0.0, 2.0, feed_rate=1.0), dwell(0.3),
        {"motion": Motion.RAPID, "target": (0.0, 0.0, 0.0, 0.0)}, dwell(0.05),
    ]  # fmt: skip
    return program(*(moves * times), axes=("x", "y", "z", "a"))


@pytest.mark.parametrize("jerk", [np.inf, 20_000.0])
def test_moves_add_up_and_follow_each_other(jerk):
    of = machine(jerk=jerk, rotary="a")
    whole = part()
    moves, total = measured(whole, of)
    assert len(moves) == len(whole)
    assert_allclose(moves.time.sum(), total.cycle_time, rtol=0, atol=1e-9)
    assert_allclose(moves.start[1:], (moves.start + moves.time)[:-1], rtol=0, atol=1e-12)
    assert (moves.time > 0.0).all()
    assert_allclose(total.feed_time + total.rapid_time + total.dwell_time, total.cycle_time, rtol=1e-12)
    assert_allclose(total.naive_time, moves.naive_time.sum(), rtol=1e-12)
    assert total.cycle_time == cycle_time(planned([whole], of, 0.01), of).cycle_time
    assert max(total.excess.velocity, total.excess.acceleration, total.excess.feed) <= 1e-6
    assert total.excess.jerk <= 1e-3


@pytest.mark.parametrize("jerk", [np.inf, 20_000.0])
def test_the_cycle_time_is_that_of_the_simulation(jerk):
    of, whole = machine(jerk=jerk, rotary="a"), part()
    *_, last = moving([whole], of, 0.01, 1e-3)
    assert measured(whole, of)[1].cycle_time == last.cycle_time


@pytest.mark.parametrize("jerk", [np.inf, 20_000.0])
@pytest.mark.parametrize("sizes", [(1,), (3, 0, 7), (500,)])
def test_streamed_moves_are_the_same_bits(jerk, sizes):
    of, whole = machine(jerk=jerk, rotary="a"), part(20)
    one, total = measured(whole, of)
    other, streamed = measured(cut(whole, sizes), of)
    for field in fields(Moves):
        assert_array_equal(getattr(one, field.name), getattr(other, field.name), err_msg=field.name)
    assert streamed == total


def test_lines_that_come_again_are_one():
    """A loop: each of its two lines is told once, with all its time."""
    there, back = line(10.0, mode=STOP), line(0.0, mode=STOP)
    whole = program(*([there, back] * 2000))
    whole = replace(whole, line=np.tile([7, 4], 2000))
    moves, total = measured(cut(whole, (500,)), machine())
    assert len(moves) == 4000
    assert [line.line for line in total.worst] == [4, 7]
    assert_allclose([line.time for line in total.worst], total.cycle_time / 2, rtol=1e-9)


def test_the_worst_lines_are_told_in_order():
    ends = [10.0, 10.5, 30.0, 30.2, 60.0, 60.1, 60.4, 90.0]
    moves, total = measured(program(*(line(at, feed_rate=50.0, mode=STOP) for at in ends)), machine())
    lost = moves.time - moves.naive_time
    assert_allclose([line.lost for line in total.worst], np.sort(lost)[::-1][:5], rtol=1e-9)


def test_excess_over_path_limits_is_told():
    """A motion planned without the limits that it is held against."""
    of = machine()
    plain = planned([program(line(20.0, feed_rate=50.0))], of, 0.01)
    assert_allclose(cycle_time(plain, of, PathLimits(250.0)).excess.path_acceleration, 1.0, rtol=1e-9)
    slower = machine(acceleration=400.0)
    plain = planned([program(line(20.0, feed_rate=50.0))], of, 0.01)
    assert_allclose(cycle_time(plain, slower).excess.acceleration, 0.25, rtol=1e-6)


# --- slow twins ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("jerk", [np.inf, 20_000.0])
def test_ends_of_moves_are_where_the_law_says(jerk):
    of, whole = machine(jerk=jerk, rotary="a"), part()
    (stretch,) = planned([whole], of, 0.01)
    toolpath, profile = stretch.toolpath, stretch.profile
    _, moves = passing([200.0] * 4)(None, toolpath, profile, True)
    length = np.diff(toolpath.arc_length)
    what = np.where(toolpath.kind == Motion.DWELL, 1, np.where(length > 0.0, 0, 2))
    names = ("time", "duration", "u", "velocity", "acceleration", "jerk", "cell")
    pieces = list(zip(*(getattr(profile, name).tolist() for name in names), strict=True))
    path = profile.path
    cells = list(zip(path.stop, path.arc_length, path.stretch, strict=True))
    rows = list(zip(what, toolpath.arc_length[1:], toolpath.dwell, strict=True))
    ends = naive.passing_times(rows, pieces, cells)
    assert_allclose(moves.start + moves.time, ends, rtol=0, atol=1e-8)


@pytest.mark.parametrize("jerk", [np.inf, 20_000.0])
def test_time_at_feed_is_what_counting_finds(jerk):
    (stretch,) = planned([part()], machine(jerk=jerk, rotary="a"), 0.01)
    profile, total = stretch.profile, np.array([1.0])
    path, alone = profile.path, rotary_only(profile.path)
    columns = [
        profile.duration,
        profile.u,
        profile.velocity,
        profile.acceleration,
        profile.jerk,
        profile.cell,
    ]
    add_time_at_feed(*columns, path.coefficients, path.feed_rate, alone, 0.99, total)
    pieces = zip(profile.time, *columns, strict=True)
    assert_allclose(
        total[0] - 1.0, naive.time_at_feed(pieces, path.coefficients, path.feed_rate, alone, 0.99), rtol=2e-3
    )


# --- real programs ------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["lcnc_lathe_pawn.ngc", "ugs_no_spaces.gcode", "lcnc_arcspiral.ngc"])
def test_real_programs(shared, name):
    source = shared / "data" / "gcode" / "programs" / name
    want = json.loads(source.with_name(f"{name}.expected.json").read_text())
    of = machine(500.0, 3000.0)
    moves, total = measured(read_chunks(source), of, 0.01)
    fed = np.isin(moves.kind, (Motion.FEED, Motion.ARC))
    assert_allclose(moves.time.sum(), total.cycle_time, rtol=0, atol=1e-9)
    assert_allclose(moves.naive_time[fed].sum(), want["feed_time_s"], rtol=1e-9)
    assert_allclose(moves.length[fed].sum(), want["feed_length_mm"], rtol=1e-9)
    *_, last = moving(read_chunks(source, ReadingOptions(rows=500)), of, 0.01, 0.01)
    assert total.cycle_time == last.cycle_time


# --- the command line ---------------------------------------------------------------------------------

SQUARE = "G21 G90 G61.1 F3000\nG1 X20\nY20\nX0\nY0\nM2\n"


@pytest.fixture
def square(tmp_path):
    path = tmp_path / "square.nc"
    path.write_text(SQUARE)
    return path


@pytest.fixture
def mill(tmp_path):
    path = tmp_path / "mill.yaml"
    axis = (
        "{limits: {velocity_mm_s: 200, acceleration_mm_s2: 500, jerk_mm_s3: 25000, travel_mm: [-100, 100]}}"
    )
    path.write_text(
        f"name: test\nkinematics: {{type: cartesian}}\naxes: {{x: {axis}, y: {axis}}}\n"
        "control: {sample_time_s: 0.001, position_gain_per_s: 20}\n"
    )
    return path


def ask(capsys, *words):
    status = run(["check", *map(str, words), "--json"])
    said = capsys.readouterr()
    return status, json.loads(said.out), said.err


def test_the_object(square, mill, capsys):
    status, said, told = ask(capsys, square, "--time", "-m", mill)
    assert (status, told) == (0, "")
    time = said["time"]
    assert list(time) == [
        "planned", "cycle_time_s", "naive_time_s", "feed_s", "rapid_s", "dwell_s", "stops", "share_at_feed",
        "worst", "violation",
    ]  # fmt: skip
    assert time["planned"] is True
    assert time["cycle_time_s"] == pytest.approx(2.08, rel=1e-9)
    assert (time["naive_time_s"], time["stops"]) == (pytest.approx(1.6), 3)
    assert time["worst"][0] == {"line": 2, "time_s": pytest.approx(0.52), "naive_s": pytest.approx(0.4)}
    assert list(time["violation"]) == ["velocity", "acceleration", "jerk", "feed"]
    assert max(time["violation"].values()) <= 1e-3
    assert "time" not in ask(capsys, square)[1]


def test_the_table(square, mill, capsys):
    assert run(["check", str(square), "--time", "-m", str(mill)]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "cycle time 2.080 s, 1.300 × the 1.600 s of lengths over feeds" in said
    assert "of that feeds 2.080 s, rapids 0.000 s, dwells 0.000 s" in said
    assert "stops 3 on the way" in said
    assert "most lost line 2: 0.120 s (0.520 s for 0.400 s)" in said
    assert "limits kept, largest relative excess: velocity 0, acceleration" in said


def test_without_a_machine_it_is_the_bundled_one(square, capsys):
    _, said, _ = ask(capsys, square, "--time")
    assert said["time"]["violation"]["jerk"] is None
    assert said["time"]["cycle_time_s"] > said["time"]["naive_time_s"]


def test_several_files_and_tables(square, mill, tmp_path, capsys):
    table, times = tmp_path / "way.csv", tmp_path / "times.csv"
    table.write_text("x_mm,y_mm,feed_mm_min\n0,0,3000\n20,0,3000\n")
    times.write_text("time_s,x_mm,y_mm\n0,0,0\n0.01,0.1,0\n0.05,0.5,0.2\n")
    status, said, _ = ask(capsys, square, table, times, mill, "--time", "-m", mill)
    assert status == 0
    program_, way, own, yaml = said["files"]
    assert program_["time"]["cycle_time_s"] == pytest.approx(2.08, rel=1e-9)
    assert way["time"]["cycle_time_s"] == pytest.approx(0.52, rel=1e-9)
    assert own["time"] == {"planned": False, "cycle_time_s": 0.05}
    assert "time" not in yaml
    assert run(["check", str(times), "--time"]) == 0
    assert "0.050 s, as the file tells" in capsys.readouterr().out


def test_times_of_moves_as_a_file(square, mill, tmp_path, capsys):
    out = tmp_path / "out.csv"
    status, said, _ = ask(capsys, square, "--times", out, "-m", mill)
    assert status == 0
    with out.open() as file:
        rows = list(csv.DictReader(file))
    assert list(rows[0]) == ["line", "start_s", "time_s", "naive_s", "length_mm", "feed_mm_s", "kind"]
    assert [row["line"] for row in rows] == ["2", "3", "4", "5"]
    assert sum(float(row["time_s"]) for row in rows) == pytest.approx(said["time"]["cycle_time_s"], abs=1e-9)
    assert rows[1] == {
        "line": "3", "start_s": rows[1]["start_s"], "time_s": rows[1]["time_s"], "naive_s": "0.4",
        "length_mm": "20.0", "feed_mm_s": "50.0", "kind": "feed",
    }  # fmt: skip
    before = out.read_bytes()
    status, said, _ = ask(capsys, square, "--times", out, "-m", mill)
    assert status == 2
    assert said["error"]["hint"] == "use --force to replace it, or name another file"
    assert ask(capsys, square, "--times", out, "-m", mill, "--force")[0] == 0
    assert out.read_bytes() == before


def test_rows_without_a_feed(tmp_path, capsys):
    source, out = tmp_path / "part.nc", tmp_path / "out.csv"
    source.write_text("G21\nG0 X10\nG4 P0.5\nG1 A90 F600\nM2\n")
    assert run(["check", str(source), "--times", str(out), "-q"]) == 0
    lines = [text.split(",") for text in out.read_text().splitlines()[1:]]
    assert [(cells[0], cells[5], cells[6]) for cells in lines] == [
        ("2", "", "rapid"), ("3", "", "dwell"), ("4", "", "feed"),
    ]  # fmt: skip
    capsys.readouterr()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("G1 X500 F3000\nM2\n", ":1: error: "),  # beyond the travel
        ("G1 X1 F3000\nG1 X\n", ":2:4: error: X has no number"),
        ("G21\nM2\n", "moves nothing"),
    ],
)
def test_what_cannot_be_timed_is_refused(mill, tmp_path, capsys, text, message):
    source, out = tmp_path / "part.nc", tmp_path / "out.csv"
    source.write_text(text)
    status, said, told = ask(capsys, source, "--times", out, "-m", mill)
    assert status == 2
    assert message in told
    assert said["error"]["file"] == str(source)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["mill.yaml", "part.nc"]


def test_times_are_of_one_program_and_never_replace_it(square, mill, tmp_path, capsys):
    trajectory, out = tmp_path / "times.csv", tmp_path / "out.csv"
    trajectory.write_text("time_s,x_mm,y_mm\n0,0,0\n0.01,0.1,0\n")
    for words in ((square, square), (mill,), (trajectory,)):
        assert ask(capsys, *words, "--times", out, "-m", mill)[0] == 2
        assert not out.exists()
    assert ask(capsys, square, "--times", square, "-m", mill, "--force")[0] == 2
    assert square.read_text() == SQUARE
    assert ask(capsys, square, "--time", "-m", tmp_path / "none.yaml")[0] == 2


def test_axes_that_the_machine_lacks_are_warned_of(tmp_path, mill, capsys):
    source = tmp_path / "part.nc"
    source.write_text("G21\nG1 X1 Z1 F600\nM2\n")
    assert run(["check", str(source), "--time", "-m", str(mill)]) == 0
    assert "warning: the machine lacks Z, which the program moves" in capsys.readouterr().err
