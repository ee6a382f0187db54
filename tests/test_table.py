"""The table: every number of the JSON, rounded once, never cut, at any width."""

from __future__ import annotations

import csv
import io
import json
import re
from dataclasses import replace
from math import inf, nan

import pytest
from runs import make_run

from cnc_shape.errors import InfeasibleError
from cnc_shape.motors import MotorDuty
from cnc_shape.pipeline import CaseSummary, Deviation, Summary
from cnc_shape.report.table import change, columns, micrometres, summary_json, table_text, tables_csv
from cnc_shape.units import DEGREE


def case(name: str = "unshaped", scale: float = 1.0, **changes) -> CaseSummary:
    deviation = Deviation(0.0123 * scale, 0.0456 * scale, 14)
    axes = {"x": 0.001 * scale, "y": 0.002 * scale}
    return replace(CaseSummary(name, 6.12, deviation, deviation, deviation, axes, axes), **changes)


def summary(*cases: CaseSummary, program: str = "part.nc", machine: str = "XY stage") -> Summary:
    return Summary(program, machine, 6.12, 1e-3, 6500, cases or (case(), case("shaped", 0.25)))


LONG = summary(
    case("unshaped", 30.0),
    case("shaped", 1.0),
    case("shaped+cross_coupled", 0.01),
    case("shaped+cross_coupled+disturbance_observer", 0.002),
    case("shaped+cross_coupled+disturbance_observer+inertia_compensation", 1e-9),
)


MOTORS = tuple(MotorDuty(joint, 7.1, 1.25, 2.5, 2.4, 0.03, 4.6e-4) for joint in ("x", "y"))
DISTURBED = summary(
    case("independent", 2.0),
    case("independent+disturbed", 8.0, disturbed=True, motors=MOTORS),
    case("cross_coupled+disturbance_observer+inertia_compensation", 1.0),
    case(
        "cross_coupled+disturbance_observer+inertia_compensation+disturbed",
        4.0,
        disturbed=True,
        motors=MOTORS,
    ),
)


def test_like_is_compared_with_like():
    change_of = next(column for column in columns(DISTURBED) if column.name == "change")
    assert [cell[0] for cell in change_of.cells] == ["", "", "-50 %", "-50 %"]
    assert "disturbed rows are compared with the first of them" in " ".join(table_text(DISTURBED).split())
    assert "compared" not in table_text(LONG)
    assert [cell[0] for cell in columns(summary(*DISTURBED.cases[1::2]))[1].cells] == ["", "-50 %"]


def test_a_disturbed_row_stands_under_its_undisturbed_self():
    lines = table_text(DISTURBED, 180).splitlines()
    names = [line[:55].rstrip() for line in lines]
    first = names.index("independent")
    assert names[first : first + 4] == [
        "independent", "  + disturbed", "cross_coupled+disturbance_observer+inertia_compensation", "  + disturbed",
    ]  # fmt: skip
    alone = table_text(summary(*DISTURBED.cases[1::2]), 180)
    assert "independent+disturbed" in alone


def test_names_are_folded_before_numbers_are():
    lines = table_text(DISTURBED, 120).splitlines()
    assert "24.6 / 91.2" in next(line for line in lines if line.startswith("independent"))
    assert "+ inertia_compensation" in lines


def test_what_motors_had_to_do_is_in_the_json_where_there_are_any():
    rows = summary_json(DISTURBED)["cases"]
    assert "motors" not in rows[0]
    assert rows[1]["motors"][1] == {
        "joint": "y", "peak_torque_nm": 7.1, "rms_torque_nm": 1.25, "peak_load_nm": 2.5,
        "peak_gain_ratio": 2.4, "saturated_share": 0.03, "identified_inertia_kg_m2": 4.6e-4,
    }  # fmt: skip
    bad = replace(MOTORS[1], rms_torque=nan)
    with pytest.raises(InfeasibleError, match="motor_y_rms_torque_nm of the case loaded is nan"):
        summary_json(summary(case("loaded", motors=(MOTORS[0], bad))))
    (row,) = csv.DictReader(io.StringIO(tables_csv(summary(case(motors=MOTORS)))))
    assert float(row["motor_y_identified_inertia_kg_m2"]) == 4.6e-4


def test_json_is_the_contract():
    text = summary_json(summary())
    assert list(text) == ["schema", "program", "machine", "cycle_time_s", "sample_time_s", "samples", "cases"]
    assert text["schema"] == "cnc-shape/simulate/1"
    assert list(text["cases"][0]) == [
        "name", "cycle_time_s", "command_contour_rms_um", "command_contour_max_um", "contour_rms_um",
        "contour_max_um", "contour_max_line", "tool_contour_rms_um", "tool_contour_max_um",
        "following_rms_um", "residual_vibration_um",
    ]  # fmt: skip
    assert text["cases"][0]["tool_contour_max_um"] == pytest.approx(45.6, rel=1e-15)
    assert text["cases"][0]["following_rms_um"] == {"x": pytest.approx(1.0), "y": pytest.approx(2.0)}
    json.dumps(text, allow_nan=False)


def test_angles_are_not_told_in_micrometres():
    turning = summary(case(following_rms={"x": 0.001, "a": 0.5 * DEGREE}))
    row = summary_json(turning)["cases"][0]
    assert row["following_rms_um"] == {"x": 1.0}
    assert row["following_rms_mdeg"] == {"a": pytest.approx(500.0)}
    assert "following_rms_a_mdeg" in tables_csv(turning).splitlines()[0]


@pytest.mark.parametrize("value", [nan, inf, -inf])
def test_a_number_that_is_none_is_named_and_stops_everything(value):
    bad = summary(case(), case("shaped", tool=Deviation(value, 0.1, 3)))
    for make in (summary_json, tables_csv):
        with pytest.raises(InfeasibleError, match=rf"tool_contour_rms_um of the case shaped is {value}"):
            make(bad)
    with pytest.raises(InfeasibleError, match="residual_vibration_y_um"):
        summary_json(summary(case(residual_vibration={"x": 0.0, "y": value})))


@pytest.mark.parametrize(
    ("um", "text"),
    [
        (0.0, "0.00"), (0.0049, "0.00"), (0.0051, "0.01"), (9.994, "9.99"), (9.996, "10.0"), (99.94, "99.9"),
        (99.96, "100"), (1234.4, "1234"), (99_999.0, "99999"), (1.5e6, "1.50e+06"),
    ],
)  # fmt: skip
def test_lengths_keep_three_digits(um, text):
    assert micrometres(um * 1e-3) == text


def test_change_is_against_the_first_row():
    assert change(0.25, 1.0) == "-75 %"
    assert change(1.5, 1.0) == "+50 %"
    assert change(20.0, 1.0) == "20x"
    assert change(0.0, 0.0) == "0 %"
    assert change(1.0, 0.0) == "new"


@pytest.mark.parametrize("width", [80, 81, 100, 119, 120, 200])
@pytest.mark.parametrize("what", [summary(), LONG, DISTURBED, make_run(500).summary])
def test_every_number_stands_whole_at_80_columns_and_more(width, what):
    text = table_text(what, width)
    assert max(map(len, text.splitlines())) <= width
    assert "…" not in text
    words = text.split()
    for column in columns(what):
        assert column.name in words
        for cell in column.cells:
            for number in cell:
                for part in number.split():
                    assert part in words


@pytest.mark.parametrize("width", [30, 40, 60, 70])
def test_a_narrow_terminal_gets_fewer_columns_but_whole_numbers(width):
    text = table_text(summary(), width)
    assert max(map(len, text.splitlines())) <= width
    assert "…" not in text
    assert "12.3" in text
    assert "45.6" in text


def test_the_table_says_what_results_json_says():
    run = make_run(800).summary
    rows = summary_json(run)["cases"]
    shown = {column.name: column for column in columns(run)}
    names = {"tool": "tool_contour", "drives": "contour", "command": "command_contour"}
    for column, stem in names.items():
        for cell, row in zip(shown[column].cells, rows, strict=True):
            told = (row[f"{stem}_rms_um"], row[f"{stem}_max_um"])
            assert cell == tuple(micrometres(value * 1e-3) for value in told)
    for column, stem in {"vibration": "residual_vibration_um", "following": "following_rms_um"}.items():
        for cell, row in zip(shown[column].cells, rows, strict=True):
            assert cell == (micrometres(max(row[stem].values()) * 1e-3),)
    assert [cell for (cell,) in shown["cycle"].cells] == [f"{row['cycle_time_s']:.3f}" for row in rows]


def test_at_80_columns_rms_stands_above_the_maximum():
    lines = table_text(summary(), 80).splitlines()
    first = next(n for n, line in enumerate(lines) if "unshaped" in line)
    assert "12.3" in lines[first]
    assert "45.6" in lines[first + 1]
    wide = table_text(summary(), 120)
    assert "12.3 / 45.6" in wide
    assert re.search(r"-75 % / -75 %", wide)


@pytest.mark.parametrize(
    "name", ["[red]x[/red]", "[link=https://x]y", "a\x1b[2Jb", "a\nb", "\u202egpj", "\udcff"]
)
def test_names_cannot_speak_to_the_terminal(name):
    text = table_text(summary(program=name, machine=name), 120)
    assert "\x1b" not in text
    assert "\u202e" not in text
    assert "a\nb" not in text
    if name.startswith("["):
        assert name in text
    text.encode("utf-8")


def test_csv_holds_every_number_to_the_last_bit():
    rows = list(csv.DictReader(io.StringIO(tables_csv(LONG))))
    for row, told in zip(rows, summary_json(LONG)["cases"], strict=True):
        assert row["name"] == told["name"]
        assert float(row["tool_contour_max_um"]) == told["tool_contour_max_um"]
        assert float(row["following_rms_y_um"]) == told["following_rms_um"]["y"]


@pytest.mark.parametrize("start", ["=", "+", "-", "@", "\t", "\r", "\n"])
def test_csv_cells_are_never_formulas(start):
    text = tables_csv(summary(case(start + "cmd|' /C calc'!A0")))
    _, row = csv.reader(io.StringIO(text, newline=""))
    assert row[0].startswith("'")
    assert row[0].endswith("cmd|' /C calc'!A0")
