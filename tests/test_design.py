"""`cnc-shape design`: the contract, the reference shapers, what is refused, comparison and figures."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest
from answers import answer, refused
from numpy.testing import assert_allclose
from oscillator import swing_after

from cnc_shape.cli import run
from cnc_shape.config.bundled import bundled
from cnc_shape.shapers import SHAPERS, make_shaper
from cnc_shape.shapers.analysis import vibration

NAMES = {
    "SD": "sd", "ZV": "zv", "ZVD": "zvd", "ZVDD": "zvdd", "ZVDDD": "zvddd", "UMZV": "umzv", "EI": "ei",
    "virtual_mode": "virtual_mode", "multimode_n+1": "multi_mode", "multimode_n+1_positive": "multi_mode",
    "ZV*ZV": "cascade", "EI_heuristic": "klipper_ei",
}  # fmt: skip
OPTIONS = {
    "TN": "--duration-periods", "Amax": "--max-amplitude", "tmin_s": "--min-gap-s", "fv_hz": "--virtual-frequency-hz",
    "Vtol": "--vibration-tolerance",
}  # fmt: skip


def words_for(case):
    words = ["design", NAMES[case["shaper"]]]
    for mode in case["modes"]:
        words += [
            "--frequency-hz",
            repr(mode["frequency_hz"]),
            "--damping-ratio",
            repr(mode["damping_ratio"]),
        ]
    for name, value in case["options"].items():
        if name in OPTIONS and value is not None:
            words += [OPTIONS[name], repr(value)]
    return [*words, "--positive"] if case["shaper"].endswith("positive") else words


def test_every_reference_shaper(shared, capfd):
    cases = json.loads((shared / "data" / "shapers.json").read_text())["cases"]
    assert {case["shaper"] for case in cases.values()} == set(NAMES)
    for case in cases.values():
        (design,) = answer(capfd, *words_for(case))["designs"]
        times, amplitudes = np.array(design["times_s"]), np.array(design["amplitudes"])
        period = 1.0 / min(mode["frequency_hz"] for mode in case["modes"])
        loose = case["shaper"] == "SD"  # whose optimum is flat
        mirrored = not np.allclose(times, case["times_s"], atol=1e-4 * period)
        if mirrored:
            times, amplitudes = times[-1] - times[::-1], amplitudes[::-1]
        assert_allclose(times, case["times_s"], atol=(2e-4 if loose else 1e-6) * period)
        assert_allclose(amplitudes, case["amplitudes"], atol=2e-4 if loose else 1e-6)
        if expected := case.get("insensitivity_5pct"):
            assert_allclose(design["insensitivity"]["width"], expected["width"], atol=1e-6)
        left = 0.05 if case["shaper"] == "EI" else 0.03552496436 if case["shaper"] == "EI_heuristic" else 0.0
        for mode in case["modes"]:
            swing = swing_after(
                make_shaper(design["times_s"], design["amplitudes"]),
                mode["frequency_hz"],
                mode["damping_ratio"],
            )
            assert_allclose(swing, left, atol=1e-9)


def test_the_contract(capfd):
    result = answer(capfd, "design", "zv", "--frequency-hz", "1", "--damping-ratio", "0.1")
    (design,) = result["designs"]
    assert result["schema"] == "cnc-shape/design/1"
    assert design["axis"] is None
    assert design["options"] == {}
    assert_allclose(design["times_s"], [0.0, 0.502518907629606], atol=1e-9)
    assert_allclose(design["amplitudes"], [0.5782861816535916, 0.42171381834640836], atol=1e-9)
    assert_allclose(design["insensitivity"]["width"], 0.0751, atol=5e-5)
    assert design["residual_vibration"][0] <= 1e-12
    assert set(design) == {
        "axis", "shaper", "modes", "options", "times_s", "amplitudes", "duration_s", "delay_s", "residual_vibration",
        "sum_abs_amplitude", "max_running_sum", "contour_factor", "insensitivity", "model_error", "corner",
        "tool",
    }  # fmt: skip


def test_a_machine_gets_a_shaper_an_axis(capfd):
    result = answer(capfd, "design", "cascade", "-m", str(bundled("xy_stage.yaml")))
    assert [design["axis"] for design in result["designs"]] == ["x", "y"]
    assert all(len(design["modes"]) == 2 for design in result["designs"])


def test_without_modes_the_bundled_machine_is_designed_for(capfd):
    designs = answer(capfd, "design", "multi_mode")["designs"]
    assert [mode["frequency_hz"] for mode in designs[0]["modes"]] == [30.0, 100.0]


def test_every_shaper_can_be_asked_for(capfd):
    extra = {
        "sd": ["--duration-periods", "0.8"], "virtual_mode": ["--virtual-frequency-hz", "80"],
        "impulses": ["--times-s", "0", "--times-s", "0.01", "--amplitudes", "0.5", "--amplitudes", "0.5"],
    }  # fmt: skip
    for name in SHAPERS:
        (design,) = answer(capfd, "design", name, "--frequency-hz", "40", *extra.get(name, []))["designs"]
        assert design["shaper"] == name
        assert_allclose(sum(design["amplitudes"]), 1.0, atol=1e-12)


def test_options_come_back_as_given(capfd):
    (design,) = answer(
        capfd, "design", "sd", "--frequency-hz", "1", "--duration-s", "0.4", "--max-amplitude", "1.5",
        "--min-gap-s", "0.001", "--metric", "margin",
    )["designs"]  # fmt: skip
    assert design["options"] == {
        "duration_s": 0.4, "max_amplitude": 1.5, "min_gap_s": 0.001, "metric": "margin",
    }  # fmt: skip
    (design,) = answer(
        capfd, "design", "multi_mode", "--frequency-hz", "30", "--frequency-hz", "100", "--positive"
    )["designs"]
    assert design["options"] == {"positive": True}


def test_an_uncertain_mode_is_measured_and_designed_for(capfd):
    words = ["--frequency-hz", "40", "--damping-ratio", "0.05", "--frequency-uncertainty", "0.15",
             "--damping-uncertainty", "0.5"]  # fmt: skip
    (plain,) = answer(capfd, "design", "zv", *words)["designs"]
    (best,) = answer(capfd, "design", "optimal", "--positive", *words)["designs"]
    for design, most in ((plain, 0.3), (best, 0.05 * (1.0 + 1e-6))):
        (error,) = design["model_error"]
        assert (error["frequency"], error["damping"], error["assumed"]) == (0.15, 0.5, False)
        shaper = make_shaper(design["times_s"], design["amplitudes"])
        omega = 2.0 * np.pi * 40.0 * np.linspace(0.85, 1.15, 601)[:, None]
        worst = vibration(shaper, omega, 0.05 * np.linspace(0.5, 1.5, 21)).max()
        assert_allclose(error["residual_vibration"], worst, rtol=1e-3)
        assert worst <= most


def test_the_corner_of_zv_in_closed_form(capfd):
    """Two halves, T/2 apart: a corner at speed v is cut by v T/8, one with a stop by a (T/4)^2 / 4."""
    (design,) = answer(
        capfd,
        "design",
        "zv",
        "--frequency-hz",
        "10",
        "--corner-speed-mm-s",
        "8",
        "--corner-tolerance-mm",
        "0.02",
    )["designs"]
    assert_allclose(design["corner"]["smoothing_mm"], 8.0 * 0.1 / 8.0)
    assert_allclose(design["corner"]["acceleration_mm_s2"], 0.02 / (0.25 * 0.025**2), rtol=1e-6)


def test_sensitivity_over_frequency_and_damping(shared, capfd):  # paper 000, Fig. 4
    figure = json.loads((shared / "data" / "shapers.json").read_text())["checks"]["paper000"][
        "fig4_ZV_designed_z0"
    ]
    (design,) = answer(capfd, "design", "zv", "--frequency-hz", "1", "--sensitivity")["designs"]
    table = design["sensitivity"]
    assert table["damping_ratio"] == figure["zeta"]
    columns = [int(np.argmin(np.abs(np.array(table["frequency_ratio"]) - r))) for r in figure["r"]]
    ours = np.array(table["residual_vibration"][0])[:, columns]
    assert_allclose(ours, figure["V"], atol=1e-12)


# --- comparison -----------------------------------------------------------------------------------


def test_the_comparison_recommends_two(capfd):
    result = answer(
        capfd, "design", "--frequency-hz", "40", "--damping-ratio", "0.05", "--frequency-uncertainty", "0.1"
    )
    designs, recommended = result["designs"], result["recommended"]
    fastest, robust = designs[recommended["fastest"]], designs[recommended["most_robust"]]
    durations = [design["duration_s"] for design in designs]
    assert durations == sorted(durations)
    calm = [
        d for d in designs if d["sum_abs_amplitude"] <= 1.0 + 1e-9 and d["model_error"][0]["residual_vibration"] <= 0.05 * (1 + 1e-6)
    ]  # fmt: skip
    assert fastest["duration_s"] == min(d["duration_s"] for d in calm)
    assert robust["insensitivity"]["margin"] >= max(d["insensitivity"]["margin"] for d in calm) - 0.01
    assert "at most 5%" in recommended["fastest_reason"]
    assert {d["shaper"] for d in designs} >= {"zv", "zvd", "ei", "sd", "optimal", "mzv", "umzv", "3hump_ei"}


def test_every_row_of_a_comparison_can_be_asked_for_by_itself(capfd):
    words = [
        "--frequency-hz",
        "30",
        "--damping-ratio",
        "0.02",
        "--frequency-hz",
        "100",
        "--damping-ratio",
        "0.01",
    ]
    result = answer(capfd, "design", *words)
    for row in result["designs"]:
        given = list[str]()
        for key, value in row["options"].items():
            option = "--" + key.replace("_", "-")
            values = value if isinstance(value, list) else [value]
            given += [option] if value is True else [w for v in values for w in (option, str(v))]
        (alone,) = answer(capfd, "design", row["shaper"], *words, *given)["designs"]
        assert alone["times_s"] == row["times_s"]
        assert alone["amplitudes"] == row["amplitudes"]


def test_the_comparison_of_a_machine_names_axes(capfd):
    result = answer(capfd, "design", "-m", str(bundled("xy_stage.yaml")))
    assert {design["axis"] for design in result["designs"]} == {"x", "y"}
    assert set(result["recommended_by_axis"]) == {"x", "y"}
    assert result["designs"][result["recommended_by_axis"]["y"]["fastest"]]["axis"] == "y"


def test_the_comparison_as_a_person_reads_it(capfd):
    assert run(["design", "--frequency-hz", "40", "--damping-ratio", "0.05"]) == 0
    out = capfd.readouterr().out
    assert "most robust: " in out
    assert "fastest: " in out


# --- figures --------------------------------------------------------------------------------------


@pytest.mark.parametrize("shaper", [["ei"], []])
@pytest.mark.parametrize("kind", ["png", "svg"])
def test_figures_are_drawn_once_and_replaced_only_by_force(tmp_path, capfd, shaper, kind):
    target = tmp_path / f"shaper.{kind}"
    words = ["design", *shaper, "--frequency-hz", "40", "--damping-ratio", "0.05", "--plot", str(target)]
    assert run(words) == 0
    first = target.read_bytes()
    assert first[:5] == {"png": b"\x89PNG\r", "svg": b"<?xml"}[kind]
    capfd.readouterr()
    assert "exists" in refused(capfd, *words)
    assert run([*words, "--force"]) == 0
    assert target.read_bytes() == first


# --- what is refused ------------------------------------------------------------------------------

HZ = ["--frequency-hz", "1"]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["sd", *HZ, "--duration-periods", "0.2", "--max-amplitude", "1.5"], "--max-amplitude: 0.2 damped periods .* 4.2361"),
        (["sd", *HZ, "--duration-periods", "0.35", "--max-amplitude", "0.9"], "0.91573"),
        (["sd", *HZ, "--duration-periods", "0.4"], "--max-amplitude: .* needs a bound"),
        (["sd", *HZ, "--duration-periods", "0"], "--duration-periods: the duration must be positive"),
        (["sd", *HZ, "--duration-s", "0.4", "--max-amplitude", "1", "--min-gap-s", "0.2"], "--min-gap-s: "),
        (["zv", *HZ, "--min-gap-s", "0.2"], "--min-gap-s belongs to sd, not to zv"),
        (["cascade", *HZ, "--of", "sd"], "--of is zv or zvd"),
        (["sd", *HZ, "--duration-periods", "1", "--metric", "width"], "--metric is insensitivity or margin, not 'width'"),
        (["zv", *HZ, "--derivatives", "1", "--derivatives", "2"], "--derivatives once, not 2 times"),
        (["multi_mode", *HZ, *HZ], "given twice"),
        (["multi_mode", "--frequency-hz", "30", "--frequency-hz", "100", "--max-amplitude", "0.2"], "--max-amplitude: no solution"),
        (["impulses", *HZ], "impulses needs times_s"),
        (["ei", *HZ, "--vibration-tolerance", "1"], "--vibration-tolerance: "),
        (["zv", *HZ, "--frequency-uncertainty", "1"], "below 1, not 1.0"),
        (["zv", *HZ, "--damping-ratio", "0.6", "--damping-uncertainty", "0.9"], "is 1 when 90% off"),
        (["zv", "--damping-ratio", "0.6"], "belong to a frequency"),
        (["zv", *HZ, "--corner-speed-mm-s", "0"], "corner's speed must be positive"),
        (["zv", *HZ, "--plot", "shaper.jpg"], "cannot draw to shaper.jpg"),
        ([*HZ, "--max-amplitude", "1"], "is an option of a shaper"),
        (["optimal", *HZ, "--max-running-sum", "0.5"], "--max-running-sum: "),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)  # fmt: skip
def test_what_cannot_be_designed_is_one_line_and_a_hint(capfd, words, message):
    said = refused(capfd, "design", *words)
    assert re.search(message, said)
    assert "\nhint: " in said
