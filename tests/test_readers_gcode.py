"""G-code: what each rule of the language says, one test a rule."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from programs import DEFAULT, assert_same, attempt, chunks, from_memory, messages, read

from cnc_shape.errors import ProgramError
from cnc_shape.program import Motion, PathMode
from cnc_shape.readers import ReadingOptions
from cnc_shape.readers.gcode import Dialect, GcodeOptions
from cnc_shape.readers.source import ReadingLimits
from cnc_shape.toolpath import travel_lengths
from cnc_shape.tools import Tool

INF = math.inf


def ends(text: str, options: GcodeOptions = DEFAULT) -> list[list[float]]:
    return read(text, options).target[:, :3].tolist()


# words


@pytest.mark.parametrize(
    "line",
    [
        "G1 X12.5 Y-.5 F600",
        "g1x12.5y-.5f600",
        "F600 Y-0.500 X+12.5 G01",
        "G1 X 1 2 . 5 Y-  .5 F6 00",
        "N20 G1 X12.5 (right) Y-.5 F600 ; down",
        "/G1\tX12.50 Y-.5 F600.",
        "G1 (a;b) X12.5Y-.5 F600",
    ],
)
@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
@pytest.mark.parametrize("mark", ["", "\ufeff"])
def test_one_move_in_many_spellings(line, end, mark):
    program = read(f"{mark}G21{end}{line}{end}M2{end}")
    assert_allclose(program.target, [[12.5, -0.5, 0.0]], rtol=0, atol=0)
    assert program.feed_rate.tolist() == [10.0]
    assert program.line.tolist() == [2]


def test_block_delete_skips_on_request_only():
    text = "G0 X1\n/G0 X2\nM2\n"
    assert len(read(text)) == 2
    assert len(read(text, GcodeOptions(block_delete=True))) == 1


def test_what_follows_the_end_is_not_parsed():
    assert ends("G0 X1\nM2\n!!! garbage [") == [[1.0, 0.0, 0.0]]
    assert ends("%\nG0 X1\n%\nG0 X9 !!!\n") == [[1.0, 0.0, 0.0]]
    assert ends("G0 X1\nG0 X2 M30\nG0 X3") == [[1.0, 0.0, 0.0], [2.0, 0.0, 0.0]]


def test_a_program_without_an_end_is_noted():
    assert messages(read("G0 X1\n")) == ["the program ends without M2 or M30"]
    assert messages(read("%\nG0 X1\n")) == ["no closing % and no M2 or M30: the program ends with the file"]
    assert messages(read("G0 X1\nM30\n")) == []


# modes


def test_units_scale_lengths_and_the_feed_survives_the_switch():
    program = read("G20 G0 X1\nF10\nG1 X2\nG21 G1 X30\nM2\n")
    assert_allclose(program.target[:, 0], [25.4, 50.8, 30.0])
    assert_allclose(program.feed_rate, [INF, 254 / 60, 254 / 60])


def test_order_in_a_block_is_fixed():  # F before G20, the dwell before the motion
    program = read("G1 F60 X1\nG20 F120 G4 P0.5 X1\nM2\n")
    assert program.motion.tolist() == [Motion.FEED, Motion.DWELL, Motion.FEED]
    assert_allclose(program.feed_rate[[0, 2]], [1.0, 2.0])
    assert_allclose(program.target[-1, 0], 25.4)
    assert program.dwell.tolist() == [0.0, 0.5, 0.0]


def test_incremental_distances_add_up():
    assert ends("G91 G0 X1 Y2\nX1\nG90 X1\nM2\n") == [[1, 2, 0], [2, 2, 0], [1, 2, 0]]


def test_position_offsets():  # G92 X0 here, then off, on again, gone
    text = "G0 X10\nG92 X0\nG0 X5\nG92.2\nG0 X5\nG92.3\nG0 X5\nG92.1\nG0 X5\nM2\n"
    assert [end[0] for end in ends(text)] == [10, 15, 5, 15, 5]


def test_a_position_set_while_suspended_does_not_revive_the_others():
    text = "G0 X10 Y10\nG92 X0 Y0\nG92.2\nG92 X0\nG0 X1 Y1\nG92.2\nG92.3\nG0 X2 Y2\nM2\n"
    assert ends(text) == [[10, 10, 0], [11, 1, 0], [12, 2, 0]]


def test_tool_length_moves_the_frame_not_the_machine():
    text = "T3 M6\nG43\nG0 Z10\nG43 H4\nG0 Z10\nG49\nG0 Z10\nM2\n"
    options = GcodeOptions(tools=(Tool(3, 50.0, 6.0), Tool(4, 20.0, 6.0)))
    assert [end[2] for end in ends(text, options)] == [60.0, 30.0, 10.0]
    program = read(text)
    assert program.target[:, 2].tolist() == [10.0, 10.0, 10.0]
    assert messages(program) == [
        f"tool {n} is not in the tool table: its length and diameter are taken as 0" for n in (3, 4)
    ]


def test_dynamic_tool_length():
    assert [end[2] for end in ends("G43.1 Z5\nG0 Z1\nG43.2 Z2\nG0 Z1\nG49 G0 Z1\nM2\n")] == [6.0, 8.0, 1.0]


def test_machine_frame_knows_no_offset():
    assert ends("G92 X5\nG53 G0 X1\nG0 X1\nM2\n") == [[1, 0, 0], [-4, 0, 0]]


def test_diameter_mode_halves_x():
    assert ends("G7 G0 X10 Z1\nG91 X10\nG8 G90 X10\nM2\n") == [[5, 0, 1], [10, 0, 1], [10, 0, 1]]


def test_path_modes_and_tolerances():
    program = read("G0 X1\nG61 X2\nG61.1 X3\nG20 G64 P.1 Q.01 X4\nG21 G64 P0.2 X5\nM2\n")
    assert program.path_mode.tolist() == [
        PathMode.BLEND, PathMode.EXACT_PATH, PathMode.EXACT_STOP, PathMode.BLEND, PathMode.BLEND,
    ]  # fmt: skip
    assert_allclose(program.path_tolerance, [np.nan, np.nan, np.nan, 2.54, 0.2])
    assert_allclose(program.merge_tolerance, [np.nan, np.nan, np.nan, 0.254, np.nan])


def test_cancel_codes_change_nothing():
    assert_same(read("G17 G40 G49 G80 G54 G90 G94 G98\nG0 X1\nM2\n"), read("\nG0 X1\nM2\n"))


# feeds


def test_inverse_time_takes_the_arc_length():
    program = read("G93 G1 X30 F2\nG3 X30 Y0 I-10 J0 F6\nG1 A90 F4\nM2\n")
    assert_allclose(travel_lengths(program) / program.feed_rate, [30.0, 10.0, 0.0])
    assert_allclose(program.feed_rate[2], math.pi / 2 * 4 / 60)  # rad/s


def test_feed_per_revolution():
    assert_allclose(read("G95 S120 F0.5\nG1 X1\nM2\n").feed_rate, [1.0])  # 0.5 mm/rev at 2 rev/s


def test_rotary_moves_take_degrees_where_nothing_else_travels():
    program = read("G20\nF60\nG1 A90\nG1 X1 A0\nM2\n")
    assert program.axes == ("x", "y", "z", "a")
    assert_allclose(program.target[:, 3], [math.pi / 2, 0.0])
    assert_allclose(program.feed_rate, [math.radians(1.0), 25.4])  # F is 60 degrees/min, 60 in/min


def test_a_feed_mode_forgets_the_feed():
    with pytest.raises(ProgramError, match="without a feed"):
        read("F100 G1 X1\nG93\nG94\nG1 X2\nM2\n")


@pytest.mark.parametrize("text", ["G1 F100\nG1\nM2\n", "F100 G1\nS5\nT1\nM2\n"])
def test_a_motion_code_without_axes_makes_no_move(text):
    assert len(read(text)) == 0


# arcs


@pytest.mark.parametrize(
    ("text", "sweep", "length"),
    [
        ("G2 X20 Y0 I10 J0", -math.pi, 10 * math.pi),
        ("G3 X20 Y0 I10", math.pi, 10 * math.pi),
        ("G3 X10 Y10 I0 J10", math.pi / 2, 5 * math.pi),
        ("G2 I10", -2 * math.pi, 20 * math.pi),  # no end: the full circle
        ("G2 X0 Y0 I10 P3", -6 * math.pi, 60 * math.pi),
        ("G3 X10 Y10 R10", math.pi / 2, 5 * math.pi),
        ("G3 X10 Y10 R-10", 3 * math.pi / 2, 15 * math.pi),
        ("G3 X10 Y10 R10 P2", 5 * math.pi / 2, 25 * math.pi),
        ("G2 X20 R9.999", -math.pi, 10 * math.pi),  # 1 um too small: half the chord
        ("G90.1 G3 X10 Y10 I0 J10", math.pi / 2, 5 * math.pi),
        ("G91 G90.1 G3 X10 Y10 I0 J10", math.pi / 2, 5 * math.pi),
        ("G2 X20 Z30 I10", -math.pi, math.hypot(10 * math.pi, 30)),
        ("G18 G2 X10 Z10 I0 K10", -math.pi / 2, 5 * math.pi),
        ("G18 G3 X10 Z10 I10 K0", math.pi / 2, 5 * math.pi),
        ("G19 G3 Y10 Z10 J0 K10", math.pi / 2, 5 * math.pi),
        ("G19 G2 Y10 Z10 X5 J0 K10", -3 * math.pi / 2, math.hypot(15 * math.pi, 5)),
    ],
)
def test_arcs_in_closed_form(text, sweep, length):
    program = read(f"F600\n{text}\nM2\n")
    assert program.motion.tolist() == [Motion.ARC]
    assert_allclose(program.sweep, [sweep], rtol=1e-12)
    assert_allclose(travel_lengths(program), [length], rtol=1e-12)


@given(
    st.sampled_from(["G17", "G18", "G19"]),
    st.floats(0.05, 2 * math.pi - 0.05),
    st.floats(0.0, 2 * math.pi),
    st.floats(0.5, 100.0),
    st.sampled_from([2, 3]),
)
@settings(max_examples=60)
def test_turning_about_the_centre_leads_from_start_to_end(plane, turn, begin, radius, code):
    """R and centre arcs agree, and rotating the start by the sweep about the normal gives the end."""
    first, second, letters = {"G17": (0, 1, "XYIJ"), "G18": (2, 0, "ZXKI"), "G19": (1, 2, "YZJK")}[plane]
    sign = 1.0 if code == 3 else -1.0
    start = radius * np.array([math.cos(begin), math.sin(begin)])
    end = radius * np.array([math.cos(begin + sign * turn), math.sin(begin + sign * turn)])
    head = f"{plane} F100 G0 {letters[0]}{start[0]:.12f} {letters[1]}{start[1]:.12f}\n"
    arc = f"G{code} {letters[0]}{end[0]:.12f} {letters[1]}{end[1]:.12f}"
    by_center = read(head + arc + f" {letters[2]}{-start[0]:.12f} {letters[3]}{-start[1]:.12f}\nM2\n")
    by_radius = read(head + arc + f" R{radius if turn < math.pi else -radius:.12f}\nM2\n")
    normal = np.eye(3)[{"G17": 2, "G18": 1, "G19": 0}[plane]]
    for program in (by_center, by_radius):
        assert_allclose(program.normal[1], normal)
        arm = program.target[0, :3] - program.center[1]
        sweep = program.sweep[1]
        turned = arm * math.cos(sweep) + np.cross(normal, arm) * math.sin(sweep)
        assert_allclose(program.center[1] + turned, program.target[1, :3], atol=1e-5)
    if abs(turn - math.pi) > 0.05:  # there R leaves the centre nearly undetermined
        assert_allclose(by_center.sweep[1], by_radius.sweep[1], atol=1e-5)
    assert {first, second} == set(np.flatnonzero(normal == 0.0).tolist())


def test_unequal_radii_make_a_spiral():  # radius linear in the angle: mean radius times pi, to first order
    program = read("F100\nG2 X10.01 Y0 I5\nM2\n")
    assert_allclose(travel_lengths(program), [15.723674411], rtol=1e-9)  # LinuxCNC's


def test_a_tiny_chord_on_a_large_radius_is_no_full_circle():
    program = read("F100\nG3 X0 Y0.0005 I-1000 J0\nG3 X0 Y0.001 R1000\nM2\n")
    assert_allclose(travel_lengths(program), [0.0005, 0.0005], rtol=1e-5)


# errors: one input each, at its line and column


@pytest.mark.parametrize(
    ("text", "column", "reason"),
    [
        ("G1 X", 4, "X has no number"),
        ("G1 Xnan", 4, "X has no number"),
        ("G1 X-", 4, "X has no number"),
        ("G1 X1.2.3", 8, "a number goes wrong"),
        ("G1 X1_000", 6, "bad character '_'"),
        ("G1 X1 ?5", 7, "bad character '?'"),
        ("G1 X1*71", 6, r"bad character '\*'"),
        ("G1 X\u0661", 4, "X has no number"),
        ("G1 X1 \u01315", 7, "bad character"),
        ("G1 X1e400", 6, "an E word"),
        ("G1 X" + "9" * 400, 4, "X is beyond the limit"),
        ("G0 X1000001", 4, "X reaches"),
        ("G1 X1 (open", 7, "not closed"),
        ("(a (b) c) G1", 4, "nested"),
        ("G1 X1) Y2", 6, r"bad character '\)'"),
        ("G1 X1 X2", 7, "two X words"),
        ("G0 G1 X1", 4, "exclude each other"),
        ("M3 M5", 4, "exclude each other"),
        ("G1 X1 N5", 7, "N stands at the beginning"),
        ("G77 X1", 1, "unknown code G77"),
        ("G1.5 X1", 1, "unknown code G1.5"),
        ("M999", 1, "unknown code M999"),
        ("X1", 1, "without a motion code"),
        ("G80 X1", 5, "G80 takes no axis words"),
        ("G1 X1", 1, "without a feed"),
        ("G1 F-5 X1", 4, "negative"),
        ("G1 F0.0000000001 X1", 4, "below the limit"),
        ("S-1", 1, "negative"),
        ("T1.5", 1, "not a whole number"),
        ("G93 G1 X1", 5, "needs its own F"),
        ("G95 G1 X1 F1", 5, "no motion"),
        ("G4 X1", 1, "needs P"),
        ("G4 P-1", 4, "negative"),
        ("G0 X1 I5", 7, "no code that uses it"),
        ("G0 X1 P5", 7, "no code that uses it"),
        ("G4 P1 G64 X1", 4, "two codes use the P"),
        ("G92", 1, "needs an axis word"),
        ("G43.1", 1, "needs an axis word"),
        ("G92 G0 X1", 8, "both use the axis words"),
        ("G53", 1, "needs G0 or G1"),
        ("G91 G53 G0 X1", 5, "under G90 only"),
        ("G64 P-1", 5, "negative"),
        ("M61", 1, "needs Q"),
        ("F9 G2 X1", 4, "G2 needs R or I/J"),
        ("F9 G2 X1 R5 I5", 10, "both R and a centre"),
        ("F9 G2 X10 R3", 11, "too small"),
        ("F9 G2 X0 R3", 10, "ends where it starts"),
        ("F9 G2 X10 I5 K0", 14, "K in the plane of G17"),
        ("F9 G2 X10 Y5 I5", 1, "at its start and"),
        ("F9 G2 X10 I0", 1, "radius is zero"),
        ("F9 G2 X10 I5 P0", 14, "turns"),
        ("F9 G2 X10 I5 P1.5", 14, "not a whole number"),
        ("F9 G90.1 G2 X10 I5", 10, "under G90.1"),
        ("%x", 1, "follows the %"),
        ("G1 X[1+2]", 5, "expressions in brackets are not built yet"),
        ("G1 X#5", 5, r"parameters \(#\) are not built yet"),
        ("#1=5", 1, r"parameters \(#\) are not built yet"),
        ("o100 sub", 1, "O-words"),
        ("O100", 1, "O-words"),
        ("@5 ^30", 1, "polar"),
        ("G1 U1", 4, "axis U is not built yet"),
        ("G81 X1 Z-1 R1", 1, r"G81 \(canned drilling cycles\) is not built yet"),
        ("G41 D1", 1, "G41 .* not built yet"),
        ("G55", 1, "G55 .* not built yet"),
        ("G10 L2 P1 X1", 1, "G10 .* not built yet"),
        ("G28", 1, "G28 .* not built yet"),
        ("G5.1 X1", 1, "G5.1 .* not built yet"),
        ("G38.2 X1", 1, "G38.2 .* not built yet"),
        ("G33 Z1 K1", 1, "G33 .* not built yet"),
        ("G76 P1", 1, "G76 .* not built yet"),
        ("G96 S1", 1, "G96 .* not built yet"),
        ("G71", 1, "not supported"),
        ("M98 P1", 1, "M98 .* not built yet"),
        ("M70", 1, "M70 .* not built yet"),
        ("0 BEGIN PGM 7 MM", 1, "Heidenhain"),
        ("G1 X1 \0", 7, "NUL"),
    ],
)
def test_what_is_refused_and_where(text, column, reason):
    with pytest.raises(ProgramError, match=reason) as caught:
        read(f"G21 G90\n{text}\nM2\n", GcodeOptions(dialect=Dialect.RS274))
    assert (caught.value.source, caught.value.line, caught.value.column) == ("part.nc", 2, column)
    assert caught.value.hint


@pytest.mark.parametrize(
    ("limits", "text", "reason"),
    [
        (ReadingLimits(blocks=2), "G0 X1\nG0 X2\nG0 X3\n", "blocks were executed than the limit of 2"),
        (ReadingLimits(line_bytes=10), "G0 X1\nG0 X1       Y1\n", "longer than the limit of 10 bytes"),
        (ReadingLimits(coordinate=5.0), "G0 X5\nG0 X5.1\n", "beyond the limit of 5 mm"),
        (ReadingLimits(turns=2), "F9 G2 I1 P3\n", "limit of 2"),
    ],
)
def test_limits_are_named_when_hit(limits, text, reason):
    with pytest.raises(ProgramError, match=reason):
        read(text, how=ReadingOptions(limits=limits))


# dialects


@pytest.mark.parametrize(
    ("text", "dialect"),
    [
        ("G1 X1 F5\n", "rs274"),
        ("(PrusaSlicer)\nG0 X1\n", "rs274"),
        ("; generated by PrusaSlicer 2.7\nG0 X1\n", "marlin"),
        (";FLAVOR:Marlin\nG0 X1\n", "marlin"),
        ("G0 X1\nM82\n", "marlin"),
        ("SET_VELOCITY_LIMIT ACCEL=5\n", "marlin"),
        ("G0 X1\nM204 P500\n", "marlin"),
        ("(M104 S200)\nG0 X1\n", "rs274"),
        ("$H\nG0 X1\n", "grbl"),
        ("%\nO1006 (BRACKET)\nG0 X1\nM30\n%\n", "fanuc"),
        ("%\nG0 X1\n%\n", "rs274"),
    ],
)
def test_the_dialect_follows_from_evidence(text, dialect):
    from cnc_shape.readers.gcode import survey

    seen = survey(from_memory(text), None)
    assert seen.dialect.value == dialect
    assert seen.evidence
    read(text)


PRINT = """; generated by PrusaSlicer 2.7
M201 X500 Y500
SET_VELOCITY_LIMIT ACCEL=500 A=1
M117 printing Größe (5
M84 X Y E
T0
G28 X Y
G28
G92 E0
G21
M83
G4 S2
G4 P500
G0 X10 F6000
G1 X20 E1.5 F1200
G1 E-2 F1800
G2 X30 Y0 I5 J0 K0 E.5
G92 X0 E0
G1 Y5*71
"""


def test_a_printers_program():
    program = read(PRINT)
    assert program.axes == ("x", "y", "z")
    assert program.motion.tolist() == [0, 0, 6, 6, 0, 1, 1, 2, 1]
    assert program.dwell[2:4].tolist() == [2.0, 0.5]
    assert program.feed_rate[4] == 100.0  # G0 runs at its F
    assert_allclose(program.target[-1], [30.0, 5.0, 0.0])
    assert travel_lengths(program)[6] == 0.0  # filament only
    noted = messages(program)
    assert [m for m in noted if "limits set by the program" in m] == [
        "M201: limits set by the program are not applied yet"
    ]
    assert not any("M2 or M30" in m for m in noted)


def test_homing_a_printer_clears_the_offset():
    program = read("M82\nG0 X5 Y5 F600\nG92 X1\nG28 X\nG0 X2\n")
    assert program.target[:, 0].tolist() == [5.0, 0.0, 2.0]
    assert program.target[1, 1] == 5.0


def test_grbl_settings_and_real_time_characters_are_skipped():
    program = read("$21=1\n$H\n!\n~\nG2 X10 I5 K0 F100?\nM2\n")
    assert program.motion.tolist() == [Motion.ARC]
    assert "grbl's settings" in messages(program)[0]


def test_fanuc_headers_and_codes():
    program = read("%\nO1006 (BRACKET)\nG187 P2 E.01\nM31\nG0 X1\nM30\n%\n")
    assert len(program) == 1


def test_machine_codes_are_noted_once_each_kind():
    program = read("M3 S100\nM5\nM8\nM3 G4 P1\nM62 P1\nM19 R5 P1\nM67 E0 Q5\nM100 P1 Q2\nM428\nM0\nM2\n")
    assert [message.split(": ")[1].removesuffix(" are ignored") for message in messages(program)] == [
        "spindle and coolant", "digital and analogue outputs", "user-defined M codes", "kinematics switches",
        "program stops",
    ]  # fmt: skip
    assert program.dwell.tolist() == [1.0]


# chunks

LONG = "F100 G0 X1\n" + "G1 X2 Y1\nG3 X3 I.5 J.2\nG93 G1 X1 A10 F9\nG94\nF50\nG4 P1\nG1 A0\n" * 40 + "M2\n"
LONG = LONG.replace("G3 X3 I.5 J.2", "G3 X3 Y1 I.5")


@pytest.mark.parametrize("rows", [1, 2, 7, 1000])
def test_chunks_of_any_size_hold_the_same_bits(rows):
    whole = read(LONG, how=ReadingOptions(rows=10**9))
    parts = chunks(LONG, how=ReadingOptions(rows=rows))
    assert len(parts) > 1 or rows == 1000
    assert all(len(part) == rows for part in parts[:-1])
    for before, after in pairwise(parts):
        np.testing.assert_array_equal(before.end, after.start)
    assert_same(read(LONG, how=ReadingOptions(rows=rows)), whole)


ANY_TEXT = st.text(alphabet="GMXYZABCIJKRPQFSTNOHE0123456789.-+ ()%;/#[]\n\t$*=", max_size=120)


@given(st.binary(max_size=200) | ANY_TEXT.map(str.encode))
@settings(max_examples=600)
def test_nothing_ends_in_anything_but_an_answer(data):
    for dialect in Dialect:
        answer = attempt(data, GcodeOptions(dialect=dialect))
        if isinstance(answer, ProgramError):
            assert answer.line
            assert answer.column
            assert answer.hint
        else:
            assert np.isfinite(answer.target).all()
            assert (answer.feed_rate > 0.0).all()
