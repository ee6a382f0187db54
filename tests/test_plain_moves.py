"""The compiled way through a program reads what the readable way reads: the same bits, the same complaints."""

from __future__ import annotations

import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from programs import AS_USUAL, DEFAULT, assert_same, attempt, attempt_file, chunks, read

from cnc_shape.errors import ProgramError
from cnc_shape.program import concatenate
from cnc_shape.readers import ReadingOptions, source
from cnc_shape.readers.gcode import Dialect, GcodeOptions, interpreter
from cnc_shape.readers.source import CHUNK_ROWS, COMPILED_FROM, ReadingLimits

ALWAYS, NEVER = 0, 1 << 60  # compiled from a length that every text has, or none


def assert_equal_answers(one, other):
    if isinstance(one, ProgramError) or isinstance(other, ProgramError):
        assert str(one) == str(other)
    else:
        assert_same(one, other)
        assert one.notes == other.notes


def assert_two_ways_agree(text, options=DEFAULT, rows=CHUNK_ROWS, limits=AS_USUAL.limits):
    compiled, readable = (
        attempt(text, options, how=ReadingOptions(rows=rows, compiled_from=length, limits=limits))
        for length in (ALWAYS, NEVER)
    )
    assert_equal_answers(compiled, readable)


MODES = [
    "G91", "G90", "G20", "G21", "G93", "G94", "G95 S100", "F50", "G92 X1", "G92.1", "G7", "G8", "G43.1 Z1",
    "G61", "G64 P.1 Q.2", "G80", "G17", "S500", "M3 S10", "T1 M6", "%", "M2", "N10",
]  # fmt: skip
OTHERS = [
    "G3 I2 J1", "G4 P.1", "G0 A45", "G1", "G1 X1 X2", "X1e3", "G1 F0 X1", "(c)", ";", "", "  \t ", "X", "G1 X.",
    "x1(a)y2;b", "X1(a", "X1(a(b))", "(a)(b) Y2 (c)", "G0G1X1", "N5N6X1", "X1N5", "G1.0 X2", "G01.5 X1", "/X5",
    "X1000001", "X-1000001", "S-1", "F-1", "N-1 X1", "X1e", "G53 G0 X1", "$X", "X1?", "E1", "G1 E.5 X1", "G28",
    "X12345678901234567890", "X0.1234567890123456789", "X-0.30000000000000004", "Y1.", "Z+.5", "X - 1", "X1\0",
    "U1", "X=1", "#1=2", "Xé", "(é) X3", "; \0", "(\0)", "G1 X1 F1e15", "F1000000000000000", "X1 M5", "G91 X1",
    "X1.2.3", "X1 (a(b)", "M117 X1 (a", "G2", "G2 F30",
]  # fmt: skip
axis_words = st.tuples(
    st.sampled_from(["", "G0", "G1", "G01", "g00", "N5 G0", "n7"]),
    st.sampled_from(["", "X1", "X-2.5", "x 1 2"]),
    st.sampled_from(["", "Y3", "Y-.5"]),
    st.sampled_from(["", "Z.5", "A45", "B-9.25C3", "S7", "E2"]),
    st.sampled_from(["", "", "F100", "F200.5", "f.0000001"]),
    st.sampled_from(["", "", " ; note", "(note)"]),
).map(" ".join)
LINES = axis_words | axis_words | axis_words | st.sampled_from(MODES) | st.sampled_from(OTHERS)
PROGRAMS = st.lists(LINES, max_size=25).map(lambda lines: "\n".join(["G1 F100 X0", *lines]))


@given(PROGRAMS, st.sampled_from(list(Dialect)), st.sampled_from([1, 2, 5, 100]), st.booleans())
@settings(max_examples=1000)
def test_random_programs(text, dialect, rows, block_delete):
    assert_two_ways_agree(text, GcodeOptions(dialect=dialect, block_delete=block_delete), rows=rows)


@pytest.mark.parametrize("dialect", list(Dialect))
def test_every_kind_of_line_between_plain_ones(dialect):
    for line in [*MODES, *OTHERS]:
        for before in ("", "G0", "G91", "G93", "G2 X1 I2", "G20", "G92 X1 A3", "G80"):
            text = f"G1 F100 X0\nX1\n{before}\n{line}\nY2\nG1 X3 F7\nA2 F8\n"
            assert_two_ways_agree(text, GcodeOptions(dialect=dialect))


@given(st.binary(max_size=60) | st.text(alphabet="GXYFNS01.-+ ()%;\n\t", max_size=120).map(str.encode))
@settings(max_examples=500)
def test_any_bytes(data):
    for dialect in Dialect:
        assert_two_ways_agree(b"G1F9X0\n" + data, GcodeOptions(dialect=dialect))


@given(PROGRAMS, st.integers(1, 12), st.integers(1, 40))
@settings(max_examples=200)
def test_limits_are_hit_at_the_same_line(text, blocks, line_bytes):
    limits = ReadingLimits(blocks=blocks, line_bytes=line_bytes, coordinate=100.0)
    assert_two_ways_agree(text, GcodeOptions(dialect=Dialect.RS274), limits=limits)


def test_pieces_of_any_size(monkeypatch):
    text = "G1 F100 X0\nX1 Y2\n(a) X2\nG3 X4 Y2 I1\nG1 X7\nG1 X9.125\n\n\nG4 P1\nX1"
    whole = read(text, how=ReadingOptions(compiled_from=NEVER))
    for end in ("\n", "\r\n", "\r"):
        for size in range(1, len(text) + 2):
            monkeypatch.setattr(source, "BLOCK_BYTES", size)
            assert_same(read(text.replace("\n", end), how=ReadingOptions(compiled_from=ALWAYS)), whole)


@pytest.mark.parametrize("rows", [1, 3, 1000, 20_000, 10**9])
def test_chunks_of_any_size(rows):
    count = 300 if rows < 100 else 40_000
    program = "F100 G0 X0\n" + "".join(f"G1 X{k * 0.37:.3f} Y{k % 7}\n" for k in range(count))
    parts = chunks(program, how=ReadingOptions(compiled_from=ALWAYS, rows=rows))
    assert all(len(part) == rows for part in parts[:-1])
    assert_same(concatenate(parts), read(program, how=ReadingOptions(compiled_from=NEVER)))


def test_numbers_are_floats_to_the_last_bit():
    values = np.random.default_rng(3).normal(scale=200.0, size=4000).tolist()
    forms = [lambda v: f"{v:.3f}", lambda v: f"{v:.15f}", repr, lambda v: f"{v:.9f}", lambda v: f"{v:.0f}"]
    texts = [forms[k % len(forms)](value) for k, value in enumerate(values)]
    program = read(
        "G1 F100 X0\n" + "".join(f"X{x}\n" for x in texts), how=ReadingOptions(compiled_from=ALWAYS)
    )
    np.testing.assert_array_equal(program.target[1:, 0], [float(text) for text in texts])


def test_long_programs_take_the_compiled_way_by_themselves(monkeypatch):
    taken = []
    ours = interpreter.take_plain_moves

    def watched(*arguments, **named):
        answer = ours(*arguments, **named)
        taken.append(answer.lines)
        return answer

    monkeypatch.setattr(interpreter, "take_plain_moves", watched)
    line = "G1 F100 X1\n"
    read(line)
    assert not taken
    lines = COMPILED_FROM // len(line) + 1
    read(line * lines)
    assert sum(taken) == lines


def test_every_reference_program_probe_and_hostile_input(shared):
    folder = shared / "data" / "gcode"
    paths = [path for path in (folder / "programs").iterdir() if path.suffix not in (".json", ".npz")]
    paths += [path for path in (folder / "hostile").iterdir() if path.name != "EXPECT.json"]
    assert len(paths) > 60
    for path in paths:
        assert_equal_answers(
            attempt_file(path, ReadingOptions(compiled_from=ALWAYS)),
            attempt_file(path, ReadingOptions(compiled_from=NEVER)),
        )
    for case in json.loads((folder / "probes.json").read_text()).values():
        assert_two_ways_agree(case["program"])
