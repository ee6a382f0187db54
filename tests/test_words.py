"""A run in words: the sentence holds the numbers of the table, and says better or worse as it is."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np
from runs import driven, make_run

from cnc_shape.motors import MotorDuty
from cnc_shape.pipeline import CaseSummary, Deviation, Summary
from cnc_shape.report.words import price_of_shaping, saturations, verdict, worst_places

RUN = make_run(2000)


def case(name: str, rms: float, largest: float, cycle_time: float, command: float = 0.0) -> CaseSummary:
    tool, told = Deviation(rms, largest, 7), Deviation(command / 2, command, 9)
    return CaseSummary(name, cycle_time, told, tool, tool, {"x": 0.0}, {"x": rms, "a": 1e9})


def summary(*cases: CaseSummary) -> Summary:
    return Summary("part.nc", "stage", cases[0].cycle_time, 1e-3, 100, cases)


def test_the_verdict_names_what_was_what_is_and_the_price_in_time():
    text = verdict(summary(case("unshaped", 0.04, 0.1, 10.0), case("shaped", 0.01, 0.02, 10.05)))
    assert text == (
        "Unshaped, the tool leaves the programmed path by up to 100 µm (line 7) and 40.0 µm RMS; shaped, by "
        "up to 20.0 µm (line 7) and 10.0 µm RMS, 75 % less, for 50.0 ms (0.5 %) more."
    )


def test_where_shaping_does_not_help_the_verdict_says_so():
    text = verdict(summary(case("unshaped", 0.01, 0.02, 10.0), case("shaped", 0.04, 0.1, 10.05)))
    assert "no other case does better" in text
    assert "less" not in text


def test_one_case_has_no_rival():
    text = verdict(summary(case("independent", 0.01, 0.02, 10.0)))
    assert text.endswith("; the program takes 10.000 s.")
    assert price_of_shaping(summary(case("independent", 0.01, 0.02, 10.0))) is None


def test_a_machine_without_error_is_no_division_by_zero():
    assert "0.00 µm" in verdict(summary(case("a", 0.0, 0.0, 1.0), case("b", 0.0, 0.0, 1.0)))


def test_where_rows_are_disturbed_the_best_of_them_is_told_against_the_first_of_them():
    rows = (
        case("independent", 0.0014, 0.005, 10.0),
        replace(case("independent+disturbed", 0.0045, 0.0177, 10.0), disturbed=True),
        case("disturbance_observer", 0.0013, 0.003, 10.0),
        replace(case("disturbance_observer+disturbed", 0.0018, 0.0044, 10.0), disturbed=True),
    )
    assert verdict(summary(*rows)) == (
        "Independent, the tool leaves the programmed path by up to 5.00 µm (line 7) and 1.40 µm RMS; "
        "independent+disturbed, by up to 17.7 µm (line 7) and 4.50 µm RMS; disturbance_observer+disturbed, "
        "by up to 4.40 µm (line 7) and 1.80 µm RMS, 60 % less, in the same time."
    )
    assert "no other disturbed case does better" in verdict(
        summary(*rows[:3], replace(rows[3], tool=rows[1].tool))
    )
    assert verdict(summary(*rows[:2])).endswith("4.50 µm RMS; the program takes 10.000 s.")
    assert "60 % less" in verdict(summary(rows[1], rows[3]))


def test_a_motor_at_its_limit_is_a_warning_with_joint_case_and_share():
    motors = tuple(
        MotorDuty(joint, 7.1, 1.0, 2.5, 1.0, share, 4.6e-4)
        for joint, share in (("x", 0.0101), ("y", 0.01), ("z", 1.0))
    )
    rows = (case("independent", 0.1, 0.1, 1.0), replace(case("loaded", 0.1, 0.1, 1.0), motors=motors))
    (told,) = saturations(summary(*rows))
    assert told == (
        "loaded: torque limit reached by motor X for 1.01 %, motor Z for 100 % of the time; the loop is open then"
    )


def test_the_worst_places_of_a_disturbed_case_are_told_against_the_first_disturbed_one():
    run = driven(600)
    run = replace(run, signals=(run.signals[0], replace(run.signals[1], tool_error=2.0 * run.signals[1].tool_error),
                                *run.signals[2:]))  # fmt: skip
    first = run.signals[1]
    for place in worst_places(run, "disturbance_observer+disturbed"):
        assert place.first_error == first.tool_error[first.line == place.line].max()


def test_the_price_is_the_command_s_own_error_and_the_gain_is_calm():
    text = price_of_shaping(
        summary(
            case("unshaped", 0.04, 0.1, 10.0), case("shaped-feedforward", 0.001, 0.02, 10.05, command=0.03)
        )
    )
    assert (
        "shaped-feedforward, it leaves the programmed path by up to 30.0 µm (line 9) and 15.0 µm RMS" in text
    )
    assert "ends 50.0 ms later" in text
    assert "from 40.0 to 1.00 µm" in text  # the rotary axis is no length


def test_the_worst_places_start_with_the_worst_and_lie_apart():
    for name in ("unshaped", "shaped"):
        signals = RUN.signal(name)
        places = worst_places(RUN, name)
        assert len(places) == 10
        worst = int(signals.tool_error.argmax())
        assert (places[0].error, places[0].line) == (signals.tool_error[worst], signals.line[worst])
        errors = [place.error for place in places]
        assert errors == sorted(errors, reverse=True)
        times = np.sort([place.time for place in places])
        assert np.diff(times).min() > 0.02 * np.ptp(signals.time)


def test_a_place_tells_what_the_first_case_did_on_its_line():
    first = RUN.signals[0]
    for place in worst_places(RUN, "shaped"):
        assert place.first_error == first.tool_error[first.line == place.line].max()


def test_a_thinned_case_tells_of_the_first_case_what_it_has():
    few = np.zeros(RUN.signals[0].time.size, dtype=bool)
    few[::10] = True
    first = RUN.signals[0]
    cut = {
        item.name: getattr(first, item.name)[few]
        for item in fields(first)
        if getattr(getattr(first, item.name), "shape", (0,))[0] == few.size
    }
    places = worst_places(replace(RUN, signals=(replace(first, factor=5, **cut), *RUN.signals[1:])), "shaped")
    assert not any(place.exact for place in places)
    for place in places:
        on_line = cut["tool_error"][cut["line"] == place.line]
        assert place.first_error == (on_line.max() if on_line.size else None)
    assert all(place.exact for place in worst_places(RUN, "shaped"))


def test_a_perfect_case_has_no_worst_place():
    calm = tuple(replace(s, tool_error=0.0 * s.tool_error) for s in RUN.signals)
    assert worst_places(replace(RUN, signals=calm), "shaped") == []
