"""Shaped motions as programs: what a control reads is the motion, in place and in time."""

from __future__ import annotations

import json
import re

import naive
import numpy as np
import pytest
from answers import answer, refused
from archives import arrays_of
from commands import part, point_to_point, straight
from hypothesis import example, given
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from cnc_shape.applying import Application
from cnc_shape.arrays import frozen
from cnc_shape.cli import run
from cnc_shape.config.bundled import bundled
from cnc_shape.config.machine_file import load_machine
from cnc_shape.errors import InfeasibleError, OptionError, OutputError
from cnc_shape.kernels.knots import find_knots
from cnc_shape.modes import Mode
from cnc_shape.opening import open_motion
from cnc_shape.shapers import umzv, zv
from cnc_shape.shapers.shaping import shape
from cnc_shape.trajectory import Trajectory, join_trajectories
from cnc_shape.writers import program as writer
from cnc_shape.writers.knots import REST, make_grid
from cnc_shape.writers.program import decimal, significant, stream_program, write_program
from cnc_shape.writers.proof import read_back

T = 1e-3
PROGRAMS = [
    "camotics_tiger.nc", "cncjs_tball_pocket_laser.gcode", "gp_screw.gcode", "lcnc_arcspiral.ngc",
    "lcnc_boat_xyzbc.ngc", "lcnc_cds.ngc", "lcnc_lathe_pawn.ngc", "ugs_communicator.nc",
    "ugs_no_spaces.gcode", "ugs_rotation.ngc", "webgcode_pycam.ngc",
]  # fmt: skip
NEGATIVE = """name: impatient stage
axes:
  x: &axis
    limits: {velocity_mm_s: 200, acceleration_mm_s2: 3000}
    modes: [{frequency_hz: 30, damping_ratio: 0.02}]
    shaper: {type: umzv}
  y:
    limits: {velocity_mm_s: 200, acceleration_mm_s2: 3000}
    modes: [{frequency_hz: 37, damping_ratio: 0.05}]
    shaper: {type: umzv}
""".replace("&axis", "")
HATCH = "G21 G90 G61.1\nG1 Z0.5 F9000\n" + "G1 X0.1\nG1 X0 Y0.1\nG1 X0.1 Y0.2\nG1 X0 Y0\n" * 4 + "G1 Z0\nM2\n"
CORNERS = "G21 G90 G64 P0.02\nG1 X40 F9000\nG1 Y20\nG3 X20 Y40 I-20 J0\nG4 P0.2\nG0 X0 Y0\nM2\n"


def command_of(position, axes=("x", "y", "z"), sample_time=T) -> Trajectory:
    """A command that goes through `position` (n,d), mm and rad."""
    position = frozen(position)
    still = frozen(np.zeros_like(position))
    return Trajectory(axes, sample_time, frozen(np.zeros(len(position))), position, still, still)


def understood(text: str, axes) -> tuple[np.ndarray, np.ndarray]:
    """What a control makes of the text: times (m,) and places (m,d), mm and degrees, of the ends of its moves.

    A reader of these programs alone, that shares nothing with the one in the package.
    """
    clock, place, modes = 0.0, dict.fromkeys(axes, 0.0), set()
    times, places = [0.0], [list(place.values())]
    for line in re.sub(r"\(.*\)", "", text).split("\n"):
        words = [(letter, float(number)) for letter, number in re.findall(r"([A-Z])(-?\d+(?:\.\d+)?)", line)]
        assert "".join(f"{letter}{number:g}" for letter, number in words) or not line.strip(), line
        codes = [number for letter, number in words if letter == "G"]
        values = {letter.lower(): number for letter, number in words if letter != "G"}
        modes |= set(codes) - {0.0, 1.0, 4.0}
        moves = {axis: values[axis] for axis in axes if axis in values}
        if codes == [4.0]:
            clock += values["p"]
        elif codes == [1.0]:
            assert 93.0 in modes
            assert 94.0 not in modes
            assert set(moves) == set(axes)
            assert moves != place, "a move without travel takes no time on some controls"
            clock += 60.0 / values["f"]
        elif codes == [0.0]:
            assert len(times) == 1, "only the way to the start is a rapid"
            places[0] = list(moves.values())
        place = {**place, **moves}
        if codes in ([4.0], [1.0]):
            times.append(clock)
            places.append(list(place.values()))
    assert {21.0, 90.0, 93.0, 94.0} <= modes
    return np.array(times), np.array(places)


def in_degrees(command: Trajectory) -> np.ndarray:
    return command.position * [180 / np.pi if axis in "abc" else 1.0 for axis in command.axes]


def assert_follows(text: str, command: Trajectory, tolerance: float, decimals=6) -> None:
    """The program is where the command is at every sample, ends where it ends, and when."""
    times, places = understood(text, command.axes)
    want = in_degrees(command)
    clock = np.arange(len(command)) * command.sample_time
    got = np.column_stack([np.interp(clock, times, column) for column in places.T])
    rotary = np.array([axis in "abc" for axis in command.axes])
    assert np.linalg.norm((got - want)[:, ~rotary], axis=1).max() <= tolerance
    assert np.linalg.norm((got - want)[:, rotary], axis=1).max() <= tolerance
    assert_allclose(times[-1], clock[-1], rtol=0, atol=1e-8)
    assert_allclose(places[[0, -1]], want[[0, -1]], rtol=0, atol=0.5001 * 10.0**-decimals)


def text_of(blocks, tolerance=1e-3, remarks=()) -> str:
    parts: list[bytes] = []
    stream_program(parts.append, blocks, make_grid(tolerance), remarks)
    return b"".join(parts).decode("ascii")


def moves_in(text: str) -> int:
    return len(re.findall("^G1 ", text, re.MULTILINE))


@st.composite
def motions(draw) -> Trajectory:
    """Random motions: speeds that wander, rests of any length, with and without rotary axes."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    turning = draw(st.sampled_from([(), ("a",), ("b", "c"), ("a", "b", "c")]))
    axes = ("x", "y", "z", *turning)
    n = draw(st.integers(2, 400))
    speed = np.cumsum(rng.normal(size=(n, len(axes))), axis=0) * draw(st.sampled_from([1e-5, 1e-3, 0.1]))
    for _ in range(draw(st.integers(0, 4))):
        begin = rng.integers(0, n)
        speed[begin : begin + rng.integers(1, 40)] = 0.0
    start = rng.normal(size=len(axes)) * draw(st.sampled_from([0.0, 1.0, 500.0]))
    return command_of(start + np.cumsum(speed, axis=0), axes, draw(st.sampled_from([1e-3, 2.5e-4, 1 / 3000])))


# --- the motion in the file ---------------------------------------------------------------------------


@given(command=motions(), tolerance=st.sampled_from([1e-6, 3e-5, 1e-3, 0.1]))
def test_any_motion_is_followed_within_the_tolerance_at_every_sample(command, tolerance):
    assert_follows(text_of([command], tolerance), command, tolerance)


@given(command=motions(), cuts=st.lists(st.integers(0, 400), max_size=5))
@example(command=point_to_point(T), cuts=[1, 1, 2])
def test_blocks_of_any_size_give_the_same_bytes(command, cuts):
    ends = sorted({0, len(command), *(min(cut, len(command)) for cut in cuts)})
    blocks = [part(command, low, high) for low, high in zip(ends, [*ends[1:], len(command)], strict=True)]
    assert text_of(blocks) == text_of([command])


@given(command=motions(), slack=st.sampled_from([1.0, 100.0, 1e5]))
def test_knots_equal_their_slow_twin(command, slack):
    rng = np.random.default_rng(len(command))
    ways = rng.normal(size=(7, len(command.axes)))
    points = np.rint(command.position * 1e6)
    state = [np.zeros(len(command.axes)), np.zeros(len(command.axes)), np.zeros(7), np.zeros(7)]
    slacks = np.full(7, slack)
    numbers, places, _, seen, _ = find_knots(points, ways, slacks, REST, *state, 0, 0, 0)
    assert seen == len(points)
    assert_array_equal([*numbers, seen - 1], naive.knots(points, ways, slacks, REST))
    assert_array_equal(places, points[numbers])


def test_constant_speed_is_one_move():
    line = straight(T, (1.0, 2.0, 0.5), 50.0, 4.0)
    text = text_of([line])
    assert moves_in(text) == 1
    assert_follows(text, line, 1e-3)


@pytest.mark.parametrize("acceleration", [10.0, 50.0, 300.0])
def test_constant_acceleration_takes_the_chords_of_a_parabola(acceleration):
    """A chord over h periods leaves the parabola by a T^2/2 * floor(h/2) * ceil(h/2) at its middle sample."""
    time = np.arange(1001) * T
    position = np.outer(0.5 * acceleration * time**2, [0.6, 0.8, 0.0])

    def longest(tolerance: float) -> int:
        sag = 0.5 * acceleration * T**2
        return max(h for h in range(1, 200) if sag * (h // 2) * (h - h // 2) <= tolerance)

    moves = moves_in(text_of([command_of(position)]))
    assert (
        1000 / longest(1e-3) <= moves <= 1000 / longest(0.79e-3) + 1
    )  # 89 % in the worst direction, less drift


def test_a_rest_is_a_dwell_and_nothing_creeps_through_it():
    there = point_to_point(T).position[:, :1] * [1.0, 0.5, 0.0]
    command = command_of(np.vstack([there, np.repeat(there[-1:], 1500, axis=0), there[::-1]]))
    text = text_of([command])
    pauses = [float(seconds) for seconds in re.findall(r"^G4 P(\S+)$", text, re.MULTILINE)]
    assert_allclose(pauses, [1.501], atol=1e-9)
    assert_follows(text, command, 1e-3)


def test_a_motion_of_rotary_axes_alone():
    time = np.linspace(0.0, 1.0, 1001)
    turn = np.outer(1.0 - np.cos(np.pi * time), [0.0, 0.0, 0.0, 1.0, -0.2])
    command = command_of(turn, ("x", "y", "z", "a", "c"))
    assert_follows(text_of([command]), command, 1e-3)


@pytest.mark.parametrize(
    ("drift", "turn"),
    [(4e-6, 40.0), (1e-4, 40.0), (1.2e-3, 40.0), (1e-3, 0.0), (1e-4, 0.02), (0.0, 0.02)],
    ids=["hardly a drift", "a drift", "X creeps while A turns", "X creeps", "both creep", "A creeps"],
)
def test_no_move_is_so_slow_that_a_control_hurries_it(drift, turn):
    """LinuxCNC takes length times F for 0.1 per minute at least; drift in mm/s, turn in degrees/s / 20."""
    time = np.arange(12_000) * T
    columns = [drift * time, 0 * time, 0 * time, np.deg2rad(turn / 20.0) * time]
    command = command_of(np.column_stack(columns), ("x", "y", "z", "a"))
    text = text_of([command])
    assert_follows(text, command, 1e-3)
    place = np.zeros(4)
    for words in re.findall(r"^G1 X(\S+) Y(\S+) Z(\S+) A(\S+) F(\S+)$", text, re.MULTILINE):
        *there, feed = (float(word) for word in words)
        travel, place = np.array(there) - place, np.array(there)
        assert (abs(travel[0]) or abs(travel[3])) * feed >= 0.1


def test_rounded_times_do_not_add_up(monkeypatch):
    monkeypatch.setattr(writer, "TIME_DIGITS", 4)
    turns = np.linspace(0.0, 40.0, 20_001)[:, None]
    command = command_of(np.hstack([5.0 * np.cos(turns), 5.0 * np.sin(turns), turns]), sample_time=0.7e-3)
    times, _ = understood(text_of([command]), command.axes)
    samples = times / command.sample_time
    assert len(times) > 1000
    assert_allclose(samples, np.rint(samples), rtol=0, atol=0.01)
    assert_allclose(samples[-1], 20_000, atol=0.01)


@given(value=st.floats(1e-9, 1e12))
def test_numbers_have_no_exponent_and_ten_digits(value):
    for text in (significant(value), decimal(-value, 6)):
        assert re.fullmatch(r"-?\d+(\.\d*[1-9])?", text)
    assert_allclose(float(significant(value)), value, rtol=5.1e-10)


def test_no_zero_is_negative():
    assert "-0 " not in text_of([command_of(np.linspace(-1e-8, 1.0, 50)[:, None] * [1.0, -1e-9, 0.0])])


# --- reading back ---------------------------------------------------------------------------------------


def test_what_is_told_is_what_an_independent_reader_finds(tmp_path):
    command = shape(point_to_point(T), {"x": zv(Mode(33.7, 0.02))})
    done = write_program(tmp_path / "out.nc", [command])
    text = (tmp_path / "out.nc").read_text()
    assert_follows(text, command, 1e-3)
    times, places = understood(text, command.axes)
    got = np.interp(np.arange(len(command)) * T, times, places[:, 0])
    assert_allclose(done.deviation, np.abs(got - command.position[:, 0]).max(), rtol=1e-9)
    assert (done.samples, done.segments) == (len(command), moves_in(text))
    assert abs(done.time_difference) < 1e-9


@pytest.mark.parametrize(
    ("name", "wrong"),
    [
        ("decimal", lambda value, decimals: f"{value:.2f}"),
        ("significant", lambda value: decimal(float(f"{value:.0e}"), 9)),
        ("significant", lambda value: f"{1.001 * value:.6f}"),
        ("decimal", lambda value, decimals: f"{value:.6f}e0"),
    ],
    ids=["coarse places", "coarse times", "slow clock", "no G-code"],
)
def test_a_wrong_writer_is_found_out_and_nothing_is_published(tmp_path, monkeypatch, name, wrong):
    monkeypatch.setattr(writer, name, wrong)
    command = command_of(np.linspace(0.0, 1.0, 700)[:, None] ** 2 * [7.0, 3.3, 0.1])
    with pytest.raises(OutputError, match="read back"):
        write_program(tmp_path / "out.nc", [command])
    assert list(tmp_path.iterdir()) == []


def test_a_rest_of_another_length_is_found_out(tmp_path, monkeypatch):
    monkeypatch.setattr(writer, "significant", lambda value: significant(value + (value == 1.0) * 0.001))
    command = command_of(np.minimum(np.linspace(0.0, 2.0, 2001), 1.0)[:, None] * [7.0, 3.3, 0.1])
    with pytest.raises(OutputError, match=r"0\.001 s longer"):
        write_program(tmp_path / "out.nc", [command])


def test_other_axes_are_found_out(tmp_path):
    (tmp_path / "out.nc").write_text("G21 G90 G93\nG1 X1 A1 F60\nG94\nM2\n")
    with pytest.raises(OutputError, match="moves X, Y, Z, A, the command X, Y, Z"):
        read_back(tmp_path / "out.nc", ("x", "y", "z"), [[np.zeros(2)] * 3], T)


def test_lost_lines_are_found_out(tmp_path, monkeypatch):
    monkeypatch.setattr(writer._Text, "add", lambda self, knots: None)
    with pytest.raises(OutputError, match="read back"):
        write_program(tmp_path / "out.nc", [point_to_point(T)])
    assert list(tmp_path.iterdir()) == []


def test_refusals(tmp_path):
    for tolerance in (0.0, -1.0, 1e-9, 5.0, np.nan, np.inf):
        with pytest.raises(OptionError, match="tolerance"):
            write_program(tmp_path / "out.nc", [point_to_point(T)], tolerance=tolerance)
    broken = command_of([[0.0, 0.0, 0.0], [0.0, np.nan, 0.0]])
    with pytest.raises(InfeasibleError, match=r"Y is nan at t = 0\.001 s"):
        write_program(tmp_path / "out.nc", [broken])
    assert list(tmp_path.iterdir()) == []


def test_remarks_are_comments_and_nothing_else(tmp_path):
    evil = "MSG, x)\nG0 X99 (LOG, ü\x1b" + 300 * "y"
    write_program(tmp_path / "out.nc", [point_to_point(T)], remarks=[f"machine: {evil}"])
    head = (tmp_path / "out.nc").read_text().splitlines()[0]
    assert re.fullmatch(r"\(machine: [ -'*-~]*\)", head)
    assert len(head) < 256


# --- real programs --------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", PROGRAMS)
def test_real_programs_come_back(shared, tmp_path, name):
    """The first lines of each, shaped, written, and read by the reader above."""
    head = tmp_path / name
    text = (shared / "data" / "gcode" / "programs" / name).read_text(errors="replace")
    head.write_text("\n".join(text.splitlines()[:300]) + "\n")
    setup = load_machine(bundled("xy_stage.yaml"))
    kind = setup.planning.shaping
    with open_motion(str(head), setup, timings=[setup.timing(kind)]) as motion:
        work = Application(motion.blocks, setup.machine, setup.command_shaping(kind), T)
        blocks = list(work.blocks())
    command = join_trajectories(blocks)
    done = write_program(tmp_path / "out.nc", blocks)
    assert_follows((tmp_path / "out.nc").read_text(), command, 1e-3)
    assert max(done.deviation, done.turn_deviation) <= 1e-3
    assert done.segments < 0.7 * len(command)


# --- the command line -----------------------------------------------------------------------------------


@pytest.fixture
def place(tmp_path, monkeypatch):
    """A fresh working folder with a small program and a machine whose shapers have negative impulses."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("CNC_SHAPE_MACHINE", raising=False)
    (tmp_path / "part.nc").write_text(CORNERS)
    (tmp_path / "hatch.nc").write_text(HATCH)
    (tmp_path / "impatient.yaml").write_text(NEGATIVE)
    return tmp_path


def test_apply_writes_a_program_beside_where_it_runs(place, capfd):
    result = answer(capfd, "apply", "part.nc")
    assert result["output"] == "part.shaped.nc"
    assert 0.0 < result["program_deviation_um"] <= 1.0
    assert abs(result["time_difference_s"]) < 1e-9
    assert set(result["limits"]) == {"x", "y", "z"}
    text = (place / "part.shaped.nc").read_text()
    assert result["segments"] == moves_in(text)
    assert "(motion alone: no spindle" in text
    assert text.endswith("\nG94\nM2\n")
    times, places = understood(text, ("x", "y", "z"))
    assert_allclose(times[-1], (result["samples"] - 1) * result["sample_time_s"], atol=1e-9)
    assert_array_equal(places[-1], 0.0)
    before = (place / "part.shaped.nc").read_bytes()
    assert "exists" in refused(capfd, "apply", "part.nc")
    assert run(["apply", "part.nc", "--force"]) == 0
    said = capfd.readouterr()
    assert "read back: within" in said.out
    assert "holds the motion alone" in said.err
    assert (place / "part.shaped.nc").read_bytes() == before


def test_the_program_follows_the_samples_that_apply_writes(place, capfd):
    answer(capfd, "apply", "part.nc", "-o", "out.csv")
    answer(capfd, "apply", "part.nc", "-o", "out.ngc", "--tolerance-um", "20")
    table = np.loadtxt(place / "out.csv", delimiter=",", skiprows=1)
    loose = (place / "out.ngc").read_text()
    assert_follows(loose, command_of(table[:, 1:]), 0.02)
    answer(capfd, "apply", "part.nc", "-o", "fine.gcode")
    assert moves_in(loose) < 0.5 * moves_in((place / "fine.gcode").read_text())


def test_a_time_trajectory_becomes_a_program(place, capfd):
    rows = "".join(f"{0.01 * k:.2f},{k * k / 50},{10 * (k % 2)}\n" for k in range(20))
    (place / "times.csv").write_text("time_s,x_mm,a_deg\n" + rows)
    result = answer(capfd, "apply", "times.csv", "-o", "times.nc")
    answer(capfd, "apply", "times.csv", "-o", "times.npz")
    archive = arrays_of(place / "times.npz")
    position = np.hstack([archive["position_mm"], np.deg2rad(archive["position_deg"])])
    assert_follows((place / "times.nc").read_text(), command_of(position, ("x", "y", "z", "a")), 1e-3)
    assert 0.0 < result["program_deviation_mdeg"] <= 1.0


def test_a_time_trajectory_is_not_told_to_be_planned_anew(place, capfd):
    rows = "".join(f"{0.01 * k:.2f},{(k % 2) * 0.5}\n" for k in range(40))
    (place / "shaken.csv").write_text("time_s,x_mm\n" + rows)
    assert run(["apply", "shaken.csv"]) == 0
    told = capfd.readouterr().err
    assert "exceeds limits: X by" in told
    assert "--respect-limits" not in told


def test_the_cycle_time_is_that_before_shaping_whatever_is_shaped(place, capfd):
    alike = NEGATIVE.replace("frequency_hz: 37, damping_ratio: 0.05", "frequency_hz: 30, damping_ratio: 0.02")
    for kind in ("path", "axis"):
        (place / f"{kind}.yaml").write_text(f"{alike}planning: {{shaping: {kind}}}\n")
    path, axis = (
        answer(capfd, "apply", "part.nc", "-m", f"{kind}.yaml", "-o", f"{kind}.npz")
        for kind in ("path", "axis")
    )
    duration = umzv(Mode(30.0, 0.02)).duration
    for result in (path, axis):
        assert result["shaped_time_s"] - result["cycle_time_s"] == pytest.approx(duration, abs=1e-9)
    assert path["cycle_time_s"] == pytest.approx(axis["cycle_time_s"], abs=1e-9)


def test_a_program_that_starts_elsewhere_goes_there_first(place, capfd):
    (place / "points.csv").write_text("x_mm,y_mm,feed_mm_min\n3,4,600\n10,4,600\n")
    answer(capfd, "apply", "points.csv", "-o", "out.nc")
    assert "\nG0 X3 Y4 Z0\nG93\n" in (place / "out.nc").read_text()


def test_wrong_usage_is_told(place, capfd):
    assert "input itself" in refused(capfd, "apply", "part.nc", "-o", "part.nc", "--force")
    assert "for programs" in refused(capfd, "apply", "part.nc", "-o", "out.csv", "--tolerance-um", "2")
    assert "outside 0.001" in refused(capfd, "apply", "part.nc", "--tolerance-um", "0")
    assert "outside 0.001" in refused(capfd, "apply", "part.nc", "--tolerance-um", "nan")
    (place / "times.csv").write_text("time_s,x_mm\n0,0\n0.5,1\n")
    assert "its own times" in refused(capfd, "apply", "times.csv", "-o", "out.nc", "--respect-limits")
    assert "not for --stream" in refused(capfd, "apply", "--stream", "--respect-limits")
    assert "more than once" in refused(capfd, "apply", "-", "-o", "out.nc", "--respect-limits")
    assert sorted(path.name for path in place.iterdir()) == [
        "hatch.nc", "impatient.yaml", "part.nc", "times.csv",
    ]  # fmt: skip


# --- limits ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("file", "least"), [("hatch.nc", 1.5), ("part.nc", 1.01)])
def test_negative_impulses_exceed_limits_and_say_so(place, capfd, file, least):
    result = answer(capfd, "apply", file, "-m", "impatient.yaml", "-o", "out.nc")
    assert result["worst_limit_violation"] <= 1e-6
    assert least < result["shaped_acceleration_ratio"] <= 3.0  # UMZV: 1, -1, 1
    ratios = [ratio for axis in result["limits"].values() for ratio in axis.values()]
    assert max(ratios) == pytest.approx(result["shaped_acceleration_ratio"])
    archive = answer(capfd, "apply", file, "-m", "impatient.yaml", "-o", "out.npz")["output"]
    signals = arrays_of(place / archive)
    for k, axis in enumerate("xy"):
        want = np.abs(signals["acceleration_mm_s2"][:, k]).max() / 3000.0
        assert result["limits"][axis]["acceleration_ratio"] == pytest.approx(want)
        want = np.abs(signals["velocity_mm_s"][:, k]).max() / 200.0
        assert result["limits"][axis]["velocity_ratio"] == pytest.approx(want)
    assert run(["apply", file, "-m", "impatient.yaml", "-o", "out.nc", "--force"]) == 0
    assert "exceeds limits: X by" in capfd.readouterr().err


@pytest.mark.parametrize("file", ["hatch.nc", "part.nc"])
def test_limits_are_respected_after_shaping_where_asked_for(place, capfd, file):
    plain = answer(capfd, "apply", file, "-m", "impatient.yaml")
    words = ("apply", file, "-m", "impatient.yaml", "--respect-limits")
    result = answer(capfd, *words, "-o", "kept.nc")
    assert max(ratio for axis in result["limits"].values() for ratio in axis.values()) <= 1.0 + 1e-9
    assert result["shaped_acceleration_ratio"] > 0.8  # and not much is given away
    respected = result["respected"]
    assert 1 < respected["plans"] <= 6
    assert respected["cycle_time_added_s"] == pytest.approx(result["cycle_time_s"] - plain["cycle_time_s"])
    assert respected["cycle_time_added_s"] > 0.0
    shares = respected["planned_limits"]
    assert 0.3 < shares["x"]["acceleration_ratio"] < 1.0
    assert shares["z"] == {"velocity_ratio": 1.0, "acceleration_ratio": 1.0}
    assert run([*words, "-o", "text.nc"]) == 0
    said = capfd.readouterr()
    assert "limits kept after" in said.out
    assert "exceeds" not in said.err
    assert ("lacks Z" in said.err) == (file == "hatch.nc")


def test_a_motion_that_keeps_its_limits_is_planned_as_it_was(place, capfd):
    (place / "calm.yaml").write_text(NEGATIVE.replace("umzv", "zvd"))
    plain = answer(capfd, "apply", "hatch.nc", "-m", "calm.yaml", "-o", "plain.csv")
    kept = answer(capfd, "apply", "hatch.nc", "-m", "calm.yaml", "-o", "kept.csv", "--respect-limits")
    if max(ratio for axis in plain["limits"].values() for ratio in axis.values()) <= 1.0:
        assert (place / "plain.csv").read_bytes() == (place / "kept.csv").read_bytes()
        assert kept["respected"]["plans"] == 1
    assert json.dumps(kept["respected"]["cycle_time_added_s"])
