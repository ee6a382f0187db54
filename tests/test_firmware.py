"""Texts for controllers, read back by readers of our own under each controller's rules, and what is refused."""

from __future__ import annotations

import configparser
import json
import re
from math import exp, pi, sqrt

import numpy as np
import pytest
import yaml as pyyaml
from answers import answer, refused
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from cnc_shape.cli import run
from cnc_shape.config.bundled import bundled
from cnc_shape.config.machine_file import load_machine, parse_machine
from cnc_shape.errors import InfeasibleError
from cnc_shape.modes import Mode
from cnc_shape.shapers import PLAIN, SHAPERS, fitted_ei, make_shaper
from cnc_shape.shapers.analysis import residual_vibration
from cnc_shape.writers.firmware import EMITTERS, Handover, Target

FEW = settings(max_examples=25)
FREQUENCIES = st.floats(10.0, 200.0)
DAMPINGS = st.one_of(st.just(0.0), st.floats(1e-4, 0.19))
CLOCK = 750e3  # Hz

# --- readers --------------------------------------------------------------------------------------

TWO = (
    [(0.0,) * 4, (0.49890, 0.16270, -0.54262, 6.16180), (0.99748, 0.18382, -1.58270, 8.17120), (1.49920, -0.09297, -0.28338, 1.85710)],
    [(0.16054, 0.76699, 2.26560, -1.22750), (0.33911, 0.45081, -2.58080, 1.73650), (0.34089, -0.61533, -0.68765, 0.42261), (0.15997, -0.60246, 1.00280, -0.93145)],
)  # fmt: skip
THREE = (
    [(0.0,) * 4, (0.49974, 0.23834, 0.44559, 12.4720), (0.99849, 0.29808, -2.36460, 23.3990), (1.49870, 0.10306, -2.01390, 17.0320), (1.99960, -0.28231, 0.61536, 5.40450)],
    [(0.11275, 0.76632, 3.29160, -1.44380), (0.23698, 0.61164, -2.57850, 4.85220), (0.30008, -0.19062, -2.14560, 0.13744), (0.23775, -0.73297, 0.46885, -2.08650), (0.11244, -0.45439, 0.96382, -1.46000)],
)  # fmt: skip


def polynomials(rows, zeta):
    return np.array([sum(c * zeta**k for k, c in enumerate(row)) for row in rows])


def damped(frequency, zeta):
    root = sqrt(1.0 - zeta**2)
    return 1.0 / (frequency * root), exp(-pi * zeta / root)


def letters(line):
    """Words of a G-code line: letter to what follows it."""
    return {word[0]: word[1:] for word in line.split()[1:]}


def commands(text):
    """Lines that are no comments."""
    return [line for line in text.splitlines() if not line.startswith((";", "#"))]


def completed(amplitudes):
    amplitudes = list(amplitudes)
    return np.array([*amplitudes, 1.0 - sum(amplitudes)])


def read_rrf(text):
    (line,) = commands(text)
    assert line.startswith("M593 ")
    words = letters(line)
    if words["P"] == '"custom"':
        heights, delays = (np.array(words[letter].split(":"), float) for letter in "HT")
        assert heights.size == delays.size <= 4
        assert heights.sum() < 1.0
        assert (np.diff([0.0, *delays]) > 0.0).all()
        return np.append(0.0, np.rint(delays * CLOCK) / CLOCK), completed(heights)
    frequency, zeta = float(words["F"]), float(words["S"])
    period = round(CLOCK / (frequency * sqrt(1.0 - zeta**2)))
    _, k = damped(frequency, zeta)
    order = {'"zvd"': 2, '"zvdd"': 3, '"zvddd"': 4}.get(words["P"])
    if order is not None:
        weights = np.poly(np.full(order, -k))
        ticks = [i * period // 2 for i in range(order + 1)]
    elif words["P"] == '"mzv"':
        m = k**0.75
        weights = np.array([1.0 - sqrt(0.5), (sqrt(2.0) - 1.0) * m, (1.0 - sqrt(0.5)) * m**2])[::-1]
        ticks = [0, 3 * period // 8, 2 * (3 * period // 8)]
    else:
        times, heights = {'"ei2"': TWO, '"ei3"': THREE}[words["P"]]
        weights = completed(polynomials(heights[:-1], zeta))
        ticks = np.rint(polynomials(times, zeta) * period)
    return np.array(ticks) / CLOCK, weights / weights.sum()


def read_rrf_3_4(text):
    (line,) = commands(text)
    words = letters(line)
    if words["P"] != '"custom"':
        return read_rrf(text)
    sums, segments = (np.array(words[letter].split(":"), float) for letter in "HT")
    assert sums.size == segments.size <= 4
    steps = np.diff([0.0, *sums, 1.0])
    assert (steps > 0.0).all()
    assert (segments > 0.0).all()
    return np.append(0.0, np.cumsum(segments)), steps


def section(text):
    parser = configparser.ConfigParser()
    parser.read_string(text)
    assert parser.sections() == ["input_shaper"]
    return parser["input_shaper"]


def read_klipper(text, axis="x"):
    keys = section(text)
    word, frequency = keys[f"shaper_type_{axis}"], float(keys[f"shaper_freq_{axis}"])
    zeta = float(keys[f"damping_ratio_{axis}"])
    period, k = damped(frequency, zeta)
    name, _, inner = word.partition("(")
    given = {key: float(value) for key, value in re.findall(r"(\w+)=([\d.]+)", inner)}
    assert zeta <= {"ei": 0.4, "2hump_ei": 0.3, "3hump_ei": 0.2}.get(name, 0.99)
    if name in ("zv", "zvd"):
        order = {"zv": 1, "zvd": 2}[name]
        times, heights = 0.5 * period * np.arange(order + 1), np.poly(np.full(order, -k))
    elif name == "mzv":
        n, t = int(given.get("n", 3)), given.get("t", 0.75)
        tau, steps = t * (n - 2.0) / (n - 2.0 * t - 1.0), np.arange(n) * t / (n - 1.0)
        angles = 2.0 * pi * np.outer(1.0 + np.arange(n - 1) / tau, steps)
        rows = np.vstack([np.ones(n), np.cos(angles), np.sin(angles)])
        heights = np.linalg.lstsq(rows, np.eye(len(rows))[0], rcond=None)[0] * k ** (2.0 * steps)
        times = steps * period
    elif name == "ei":
        own = fitted_ei(Mode(frequency, zeta), vibration_tolerance=given.get("v_tol", 0.05))
        times, heights = own.times, own.amplitudes
    else:
        fits = {"2hump_ei": TWO, "3hump_ei": THREE}[name]
        times, heights = (polynomials(rows, zeta) for rows in fits)
        times = times / frequency
    return times, heights / heights.sum()


def read_klipper_custom(text, axis="x"):
    keys = section(text)
    assert keys[f"shaper_type_{axis}"] == "custom"
    heights, times = (np.array(keys[f"shaper_{what}_{axis}"].split(","), float) for what in "at")
    assert heights.size == times.size <= 5
    assert np.abs(heights).min() >= 1e-3
    assert (np.diff(times) > 0.0).all()
    assert 1e-3 <= times[-1] - times[0] <= 0.2
    return times, heights / heights.sum()


def read_marlin(text, axis="X"):
    """The echo comes half a period of F later; its height is counted in 128ths."""
    (line,) = [line for line in commands(text) if line.startswith(f"M593 {axis} ")]
    words = letters(line.replace(f" {axis} ", " "))
    _, k = damped(1.0, float(words["D"]))
    echo = round(128.0 * k / (1.0 + k)) / 128.0
    return np.array([0.0, 0.5 / float(words["F"])]), np.array([1.0 - echo, echo])


def read_marlin_ft(text, axis="X"):
    first, *lines = commands(text)
    assert first == "M493 S1"
    (line,) = [line for line in lines if line.startswith(f"M493 {axis} ")]
    words = letters(line.replace(f" {axis} ", " "))
    kind, frequency, zeta = int(words["C"]), float(words["A"]), float(words["I"])
    assert 10.0 <= frequency <= 500.0
    assert zeta <= 0.25
    assert ("Q" in words) == (kind in (5, 6, 7))
    v = float(words.get("Q", 0.05))
    period, k = damped(frequency, zeta)
    if kind <= 4:
        heights = np.poly(np.full(kind, -1.0))
    elif kind == 5:
        heights = np.array([(1.0 + v) / 4.0, (1.0 - v) / 2.0, (1.0 + v) / 4.0])
    elif kind == 6:
        x = np.cbrt(v**2 * (sqrt(1.0 - v**2) + 1.0))
        a = (3.0 * x**2 + 2.0 * x + 3.0 * v**2) / (16.0 * x)
        heights = np.array([a, 0.5 - a, 0.5 - a, a])
    elif kind == 7:
        a, b = (1.0 + 3.0 * v + 2.0 * sqrt(2.0 * (v**2 + v))) / 16.0, (1.0 - v) / 4.0
        heights = np.array([a, b, 1.0 - 2.0 * (a + b), b, a])
    else:
        heights = np.array([1.0, sqrt(2.0), 1.0])
    heights = heights * k ** np.arange(heights.size)
    samples = round((0.375 if kind == 8 else 0.5) * period * 1000.0)
    return samples / 1000.0 * np.arange(heights.size), heights / heights.sum()


READERS = {
    Target.RRF: read_rrf,
    Target.RRF_3_4: read_rrf_3_4,
    Target.KLIPPER: read_klipper,
    Target.KLIPPER_CUSTOM: read_klipper_custom,
    Target.MARLIN: read_marlin,
    Target.MARLIN_FT: read_marlin_ft,
}
NAMED = ("zv", "zvd", "mzv", "ei", "2hump_ei", "3hump_ei", "klipper_ei", "fitted_ei", "duet_ei2", "duet_ei3")
NAMES = {
    Target.RRF: ("zv", "zvd", "zvdd", "zvddd", "umzv", *NAMED[2:]),
    Target.RRF_3_4: ("zv", "zvd", "zvdd", "zvddd", *NAMED[2:]),
    Target.KLIPPER: NAMED,
    Target.KLIPPER_CUSTOM: ("zv", "zvd", "zvdd", "zvddd", "umzv", *NAMED[2:]),
    Target.MARLIN: ("zv",),
    Target.MARLIN_FT: ("zv", "zvd", "zvdd", "zvddd", *NAMED[2:]),
}
EXACT = {
    Target.KLIPPER: ("zv", "zvd", "mzv", "fitted_ei"),
    Target.MARLIN_FT: ("zv", "zvd", "zvdd", "zvddd", "klipper_ei", "klipper_2hump_ei", "klipper_3hump_ei"),
}
RESOLUTION = {  # of times, s, and amplitudes
    Target.RRF: (2.0 / CLOCK, 2e-5),
    Target.RRF_3_4: (2.0 / CLOCK, 2e-5),
    Target.KLIPPER: (1e-9, 1e-7),
    Target.KLIPPER_CUSTOM: (1e-9, 5e-9),
    Target.MARLIN: (1e-8, 0.5 / 128.0 + 1e-6),
    Target.MARLIN_FT: (4 * 0.5e-3 + 1e-6, 1e-5),
}


def hand_over(name, mode, options=None, axis=None):
    return Handover(axis, name, options or {}, (mode,), SHAPERS[name](mode, **(options or {})))


@pytest.mark.parametrize("target", list(READERS), ids=lambda target: target.value)
@given(data=st.data(), frequency=FREQUENCIES, damping=DAMPINGS)
@FEW
def test_what_is_read_back_is_what_was_designed(target, data, frequency, damping):
    name = data.draw(st.sampled_from(EXACT.get(target, NAMES[target])))
    handover = hand_over(name, Mode(frequency, damping))
    if target is Target.KLIPPER_CUSTOM:
        assume(1e-3 <= handover.shaper.duration <= 0.2)
    times, amplitudes = READERS[target](EMITTERS[target]([handover]))
    assert_allclose(times, handover.shaper.times, rtol=0.0, atol=RESOLUTION[target][0])
    assert_allclose(amplitudes, handover.shaper.amplitudes, rtol=0.0, atol=RESOLUTION[target][1])


@pytest.mark.parametrize(
    ("target", "name"),
    [(target, name) for target, names in NAMES.items() for name in names],
    ids=lambda value: value if isinstance(value, str) else value.value,
)
@given(frequency=FREQUENCIES, damping=DAMPINGS)
@settings(max_examples=4)
def test_the_comment_tells_what_is_left_with_what_is_read_back(target, name, frequency, damping):
    mode = Mode(frequency, damping)
    handover = hand_over(name, mode)
    if target is Target.KLIPPER_CUSTOM:
        assume(1e-3 <= handover.shaper.duration <= 0.2)
    text = EMITTERS[target]([handover])
    theirs, ours = re.search(r"leaves (\S+) % of the vibration, designed for (\S+) %", text).groups()
    left = float(residual_vibration(make_shaper(*READERS[target](text)), mode))
    assert_allclose(float(theirs) / 100.0, left, rtol=1e-3, atol=1e-6)
    assert_allclose(float(ours) / 100.0, residual_vibration(handover.shaper, mode), rtol=1e-3, atol=1e-11)


@given(frequency=FREQUENCIES, damping=st.floats(0.0, 0.3), tolerance=st.floats(1e-3, 0.3))
@FEW
def test_klipper_is_told_the_tolerance_of_ei(frequency, damping, tolerance):
    mode = Mode(frequency, damping)
    text = EMITTERS[Target.KLIPPER]([hand_over("fitted_ei", mode, {"vibration_tolerance": tolerance})])
    own = fitted_ei(mode, vibration_tolerance=tolerance)
    times, amplitudes = read_klipper(text)
    assert_allclose(times, own.times, atol=1e-8)
    assert_allclose(amplitudes, own.amplitudes, atol=1e-7)


@given(n=st.integers(3, 5), share=st.floats(0.55, 0.95), damping=DAMPINGS)
@FEW
def test_klipper_is_told_impulses_and_periods_of_mzv(n, share, damping):
    handover = hand_over(
        "mzv", Mode(57.0, damping), {"impulses": n, "duration_periods": share * 0.5 * (n - 1)}
    )
    assume((handover.shaper.amplitudes > 0.0).all())
    times, amplitudes = read_klipper(EMITTERS[Target.KLIPPER]([handover]))
    assert_allclose(times, handover.shaper.times, atol=1e-9)
    assert_allclose(amplitudes, handover.shaper.amplitudes, atol=1e-6)


@pytest.mark.parametrize("name", ["ei", "2hump_ei", "3hump_ei"])
@given(damping=st.floats(0.0, 0.19), tolerance=st.floats(0.01, 0.2))
@FEW
def test_fixed_time_motion_is_told_the_tolerance(name, damping, tolerance):
    exact = {"ei": "klipper_ei", "2hump_ei": "klipper_2hump_ei", "3hump_ei": "klipper_3hump_ei"}[name]
    handover = hand_over(exact, Mode(31.0, damping), {"vibration_tolerance": tolerance})
    _, amplitudes = read_marlin_ft(EMITTERS[Target.MARLIN_FT]([handover]))
    assert_allclose(amplitudes, handover.shaper.amplitudes, atol=1e-5)


def test_duet_is_told_by_name_what_it_makes_by_itself_and_impulse_by_impulse_what_not():
    """Its mzv comes in reverse, and its ei2 and ei3 are in damped periods: without damping all is one."""
    for name, word in (("zvd", "zvd"), ("mzv", "mzv"), ("duet_ei2", "ei2"), ("duet_ei3", "ei3")):
        assert f'P"{word}" F40 S0\n' in EMITTERS[Target.RRF]([hand_over(name, Mode(40.0, 0.0))])
    assert 'M593 P"zvddd" F40.5 S0.1\n' in EMITTERS[Target.RRF]([hand_over("zvddd", Mode(40.5, 0.1))])
    text = EMITTERS[Target.RRF]([hand_over("mzv", Mode(40.0, 0.1))])
    assert 'M593 P"custom"' in text
    assert 'P"mzv" leaves 16.23 %, in releases that reverse it' in text


@pytest.mark.parametrize(("name", "word"), [("mzv", "mzv"), ("duet_ei2", "ei2"), ("duet_ei3", "ei3")])
def test_duet_would_leave_that_much_by_name(name, word):
    mode = Mode(40.0, 0.1)
    text = EMITTERS[Target.RRF]([hand_over(name, mode)])
    by_name = make_shaper(*read_rrf(f'M593 P"{word}" F40 S0.1'))
    (told,) = re.findall(rf'P"{word}" leaves (\S+) %', text)
    assert_allclose(float(told) / 100.0, residual_vibration(by_name, mode), rtol=1e-3)


def test_the_worst_of_all_modes_is_told():
    """A zv for 30 Hz leaves 100 Hz what it leaves there."""
    modes = (Mode(30.0, 0.02), Mode(100.0, 0.01))
    shaper = SHAPERS["zv"](modes[0])
    text = EMITTERS[Target.KLIPPER]([Handover("x", "zv", {}, modes, shaper)])
    (told,) = re.findall(r"leaves (\S+) %", text)
    assert_allclose(float(told) / 100.0, residual_vibration(shaper, modes[1]), rtol=1e-3)
    assert float(told) > 10.0


def test_an_example_worked_by_hand():
    """ZVD at 40 Hz, zeta 0: a quarter, a half, a quarter, 12.5 ms apart."""
    handover = Handover(
        None, "impulses", {}, (Mode(40.0, 0.0),), make_shaper([0, 0.0125, 0.025], [0.25, 0.5, 0.25])
    )
    assert commands(EMITTERS[Target.RRF]([handover])) == ['M593 P"custom" H0.25:0.5 T0.0125:0.025']
    assert commands(EMITTERS[Target.RRF_3_4]([handover])) == ['M593 P"custom" H0.25:0.75 T0.0125:0.0125']
    assert "shaper_a_y: 0.25,0.5,0.25\nshaper_t_y: 0,0.0125,0.025\n" in EMITTERS[Target.KLIPPER_CUSTOM](
        [handover]
    )


def test_nothing_is_said_about_modes_that_are_not_known():
    handover = Handover("x", "impulses", {}, (), make_shaper([0, 0.01], [0.5, 0.5]))
    assert "no mode" in EMITTERS[Target.RRF]([handover])


# --- machine files --------------------------------------------------------------------------------

MACHINE = """
axes:
  x:
    limits: {{velocity_mm_s: 100, acceleration_mm_s2: 1000}}
    modes: [{{frequency_hz: {f!r}, damping_ratio: {z!r}}}]
    {shaper}
"""


@pytest.mark.parametrize("name", sorted(PLAIN))
@given(frequency=FREQUENCIES, damping=DAMPINGS)
@settings(max_examples=3)
def test_the_block_of_a_machine_file_makes_the_same_impulses(name, frequency, damping):
    handover = hand_over(name, Mode(frequency, damping))
    comment, block = EMITTERS[Target.YAML]([handover]).splitlines()
    assert comment.startswith("#")
    machine = MACHINE.format(f=frequency, z=damping, shaper=block)
    again = parse_machine(machine.encode(), "machine.yaml").shapers["x"]
    assert again.times.tolist() == handover.shaper.times.tolist()
    assert again.amplitudes.tolist() == handover.shaper.amplitudes.tolist()


WORDS = ["--frequency-hz", "30", "--damping-ratio", "0.02"]
IMPULSES = ["--times-s", "0", "--times-s", "1e-05", "--amplitudes", "0.1", "--amplitudes", "0.9"]


@pytest.mark.parametrize(
    "words",
    [
        ["mzv", "--impulses", "4", "--duration-periods", "0.9"],
        ["sd", "--duration-periods", "0.8", "--metric", "margin", "--max-amplitude", "2"],
        ["sd", "--duration-s", "0.03", "--positive", "--min-gap-s", "1e-5"],
        ["ei", "--vibration-tolerance", "0.02"],
        ["impulses", *IMPULSES],
        ["cascade", "--of", "zvd"],
        ["multi_mode", "--derivatives", "1"],
        ["optimal", "--vibration-tolerance", "0.03"],
    ],
    ids=lambda words: words[0],
)
def test_options_come_back_through_a_machine_file(capfd, words):
    (design,) = answer(capfd, "design", *words, *WORDS)["designs"]
    assert run(["design", *words, *WORDS, "--emit", "yaml"]) == 0
    block = capfd.readouterr().out.splitlines()[-1]
    assert pyyaml.safe_load(block)["shaper"] == {"type": words[0], **design["options"]}
    machine = MACHINE.format(f=30.0, z=0.02, shaper=block)
    again = parse_machine(machine.encode(), "machine.yaml").shapers["x"]
    assert again.times.tolist() == design["times_s"]
    assert again.amplitudes.tolist() == design["amplitudes"]


def test_a_machine_hands_over_its_own_shapers(capfd):
    path = bundled("mill_three_axis.yaml")
    assert run(["design", "-m", str(path), "--emit", "yaml"]) == 0
    emitted = pyyaml.safe_load(capfd.readouterr().out)
    document = pyyaml.safe_load(path.read_text())
    setup = load_machine(path)
    assert set(emitted["axes"]) == set(setup.shapers)
    for name, keys in emitted["axes"].items():
        assert keys["shaper"] == document["axes"][name]["shaper"]
        document["axes"][name].pop("shaper")
        document["axes"][name].update(keys)
    again = parse_machine(pyyaml.safe_dump(document).encode(), "again.yaml")
    for name, shaper in setup.shapers.items():
        assert again.shapers[name].times.tolist() == shaper.times.tolist()
        assert again.shapers[name].amplitudes.tolist() == shaper.amplitudes.tolist()


# --- the command ----------------------------------------------------------------------------------


def test_the_text_stands_alone_on_stdout(capfd):
    assert run(["design", "zvd", "--frequency-hz", "40", "--damping-ratio", "0.1", "--emit", "rrf"]) == 0
    said = capfd.readouterr()
    assert said.err == ""
    times, _ = read_rrf(said.out)
    assert_allclose(times, [0.0, 0.01256, 0.02513], atol=5e-6)


@pytest.mark.parametrize("target", [t for t in Target if t is not Target.MARLIN_FT], ids=lambda t: t.value)
def test_json_has_the_design_and_the_text(capfd, target):
    words = ["design", "zv", "--frequency-hz", "40", "--damping-ratio", "0.1"]
    alone = answer(capfd, *words)
    assert run([*words, "--emit", target.value]) == 0
    text = capfd.readouterr().out
    result = answer(capfd, *words, "--emit", target.value)
    assert result.pop("emitted") == {
        "target": target.value,
        "text": text if target is not Target.JSON else text[:-1],
    }
    assert result == alone


def test_the_target_json_is_the_design_itself(capfd):
    words = ["design", "ei", "--frequency-hz", "40"]
    assert run([*words, "--emit", "json"]) == 0
    assert json.loads(capfd.readouterr().out) == answer(capfd, *words)


def test_klipper_gets_all_axes_in_one_section(capfd):
    assert run(["design", "cascade", "--emit", "klipper-custom"]) == 0
    text = capfd.readouterr().out
    setup = load_machine(bundled("xy_stage.yaml"))
    for axis in ("x", "y"):
        times, amplitudes = read_klipper_custom(text, axis)
        assert_allclose(times, setup.shapers[axis].times, atol=1e-9)
        assert_allclose(amplitudes, setup.shapers[axis].amplitudes, atol=1e-8)


def test_an_axis_can_be_picked(capfd):
    assert run(["design", "zvd", "--frequency-hz", "40", "--axis", "y", "--emit", "klipper"]) == 0
    assert set(section(capfd.readouterr().out)) == {"shaper_type_y", "shaper_freq_y", "damping_ratio_y"}
    mill = str(bundled("mill_three_axis.yaml"))
    said = refused(capfd, "design", "-m", mill, "--emit", "rrf")
    assert "shapes all axes alike" in said
    assert "--axis x or --axis y" in said
    assert run(["design", "-m", mill, "--axis", "y", "--emit", "rrf"]) == 0
    times, amplitudes = read_rrf(capfd.readouterr().out)
    shaper = load_machine(mill).shapers["y"]
    assert_allclose(times, shaper.times, atol=2.0 / CLOCK)
    assert_allclose(amplitudes, shaper.amplitudes, atol=2e-5)
    (design,) = answer(capfd, "design", "zvd", "-m", mill, "--axis", "y")["designs"]
    assert design["axis"] == "y"


def test_alike_axes_are_one_for_duet(capfd):
    assert run(["design", "cascade", "--emit", "rrf"]) == 0
    times, _ = read_rrf(capfd.readouterr().out)
    assert_allclose(times, load_machine(bundled("xy_stage.yaml")).shapers["x"].times, atol=1.0 / CLOCK)


def test_a_c_header_has_the_machines_sample_time_or_the_one_given(capfd):
    assert run(["design", "zvd", *WORDS, "--emit", "c"]) == 0
    assert "#define CNC_SHAPE_SAMPLE_TIME_S 0.001\n" in capfd.readouterr().out
    assert run(["design", "zvd", *WORDS, "--emit", "c", "--sample-time-s", "0.002"]) == 0
    assert "#define CNC_SHAPE_SAMPLE_TIME_S 0.002\n" in capfd.readouterr().out
    assert run(["design", "-m", str(bundled("container.yaml")), "--emit", "c"]) == 0
    said = capfd.readouterr().out
    assert "#define CNC_SHAPE_SAMPLE_TIME_S 0.005\n" in said
    assert "static const double cnc_shape_x_taps[" in said
    assert "taps of --emit c" in refused(
        capfd, "design", "zvd", *WORDS, "--emit", "rrf", "--sample-time-s", "1"
    )


def test_help_tells_of_every_target(capfd):
    assert run(["design", "--help"]) == 0
    said = " ".join(capfd.readouterr().out.replace("│", " ").split())
    for target in Target:
        assert target.value in said


# --- what is refused ------------------------------------------------------------------------------

HZ = ["--frequency-hz", "40"]
SIX = ["zv", "--derivatives", "4", *HZ]
CLOSE = ["impulses", *HZ, "--times-s", "0", "--times-s", "4e-7", "--times-s", "0.01", *(w for a in (0.2, 0.3, 0.5) for w in ("--amplitudes", str(a)))]  # fmt: skip
CLOSER = [word.replace("4e-7", "4e-10") for word in CLOSE]
TINY = [
    "impulses",
    *HZ,
    "--times-s",
    "0",
    "--times-s",
    "0.01",
    "--amplitudes",
    "0.9995",
    "--amplitudes",
    "0.0005",
]
ONE = ["impulses", *HZ, "--times-s", "0", "--amplitudes", "1"]
LAST_NEGATIVE = [
    "impulses",
    *HZ,
    "--times-s",
    "0",
    "--times-s",
    "0.01",
    "--amplitudes",
    "1.2",
    "--amplitudes",
    "-0.2",
]


def damped_by(zeta):
    return [*HZ, "--damping-ratio", str(zeta)]


@pytest.mark.parametrize(
    ("target", "words", "message"),
    [
        ("rrf", SIX, "at most 5 impulses, not the 6 of zv\nhint: .*zvddd"),
        ("rrf", ONE, "one impulse shapes nothing"),
        ("rrf", ["zvd", "--frequency-hz", "3.9"], "from 4 to 1000 Hz, not 3.9 Hz"),
        ("rrf", ["zvd", "--frequency-hz", "1001"], "from 4 to 1000 Hz, not 1001 Hz"),
        ("rrf", LAST_NEGATIVE, "add up to less than 1, not 1.2\nhint: .*--positive"),
        ("rrf", CLOSE, "closer than RepRapFirmware can tell apart, a step clock of 1.33 us\nhint: .*--min-gap-s"),
        ("rrf-3.4", SIX, "at most 5 impulses"),
        ("rrf-3.4", ONE, "one impulse shapes nothing"),
        ("rrf-3.4", ["zvd", "--frequency-hz", "5.7"], "from 5.722 to 1000 Hz"),
        ("rrf-3.4", ["umzv", *HZ], "no negative impulses: .*\nhint: .*--emit rrf"),
        ("rrf-3.4", LAST_NEGATIVE, "no negative impulses"),
        ("rrf-3.4", CLOSER, "closer than RepRapFirmware 3.4 can tell apart, 0.01 us"),
        ("klipper", ["umzv", *HZ], "takes no arbitrary impulses, .* this umzv\nhint: use zv, .*klipper-custom"),
        ("klipper", ["zvdd", *HZ], "none of its types is this zvdd"),
        ("klipper", SIX, "this zv\nhint: use zv, zvd, mzv, ei, 2hump_ei, 3hump_ei$"),
        ("klipper", ["zvd", *damped_by(0.995)], "the zvd of Klipper takes damping ratios up to 0.99, not 0.995"),
        ("klipper", ["zv", *damped_by(0.995)], "the zv of Klipper takes damping ratios up to 0.99"),
        ("klipper", ["mzv", *damped_by(0.995)], "the mzv of Klipper takes damping ratios up to 0.99"),
        ("klipper", ["ei", *damped_by(0.41)], "the ei of Klipper takes damping ratios up to 0.4, .*\nhint: use zvd"),
        ("klipper", ["klipper_2hump_ei", *damped_by(0.31)], "2hump_ei .* up to 0.3, .*\nhint: use ei"),
        ("klipper", ["3hump_ei", *damped_by(0.21)], "3hump_ei .* up to 0.2, .*\nhint: use 2hump_ei"),
        ("klipper", ["2hump_ei", *HZ, "--vibration-tolerance", "0.02"], "leaves 5 %, not 2 %\nhint: use ei"),
        ("klipper", ["mzv", *HZ, "--duration-periods", "1.2"], "lasts less than 1 periods"),
        ("klipper", ["mzv", *HZ, "--impulses", "4", "--duration-periods", "0.3"], "no negative ones"),
        ("klipper", ["mzv", *HZ, "--impulses", "6", "--duration-periods", "1.8"], "at most 5 impulses"),
        ("klipper", ["zvd", *HZ, "--axis", "a"], "shapes x, y, z, not a"),
        ("klipper-custom", SIX, "at most 5 impulses"),
        ("klipper-custom", ONE, "one impulse shapes nothing"),
        ("klipper-custom", TINY, "impulses of 0.001 and more, not 0.0005"),
        ("klipper-custom", CLOSER, "closer than a Klipper with custom shapers can tell apart, 1 ns"),
        ("klipper-custom", ["zv", "--frequency-hz", "600"], "0.001 to 0.2 s, not 0.0008333 s\nhint: use a longer"),
        ("klipper-custom", ["zvd", "--frequency-hz", "4.9"], "0.001 to 0.2 s, not 0.2041 s\nhint: use a shorter"),
        ("klipper-custom", ["zvd", *HZ, "--axis", "c"], "shapes x, y, z, not c"),
        ("marlin", ["zvd", *HZ], "knows zv, not zvd\nhint: use zv; or --emit marlin-ft"),
        ("marlin", ["zv", *HZ, "--axis", "b"], "Marlin shapes x, y, z, not b"),
        ("marlin-ft", ["umzv", *HZ], "no arbitrary impulses, .*\nhint: use zv, zvd"),
        ("marlin-ft", ["mzv", *HZ, "--duration-periods", "0.9"], "this mzv\nhint: .*the usual mzv"),
        ("marlin-ft", ["zv", "--frequency-hz", "9"], "from 10 to 500 Hz, not 9 Hz"),
        ("marlin-ft", ["zv", "--frequency-hz", "501"], "from 10 to 500 Hz, not 501 Hz"),
        ("marlin-ft", ["zv", *damped_by(0.26)], "damping ratios up to 0.25, not 0.26"),
        ("marlin-ft", ["zv", *HZ, "--axis", "a"], "shapes x, y, z, not a"),
        ("rff", ["zvd", *HZ], "knows no 'rff'\nhint: use one of rrf, rrf-3.4, klipper"),
        ("rrf", HZ, "one shaper, not a comparison\nhint: name the shaper"),
        ("rrf", ["--damping-ratio", "0.1"], "one shaper, not a comparison"),
        ("rrf", ["--plot", "shapers.svg"], "one shaper, not a comparison"),
        ("rrf", ["--duration-s", "0.1"], "--duration-s is an option of a shaper"),
        ("json", [], "json is the result of a design"),
        ("rrf", ["zvd", *HZ, "--axis", "q"], "--axis is x, y, z, a, b, c, not 'q'"),
        ("rrf", ["cascade", "--axis", "z"], "--axis is x, y, not 'z'"),
        ("rrf", ["--axis", "z"], "--axis is x, y, not 'z'"),
    ],
    ids=lambda value: value if isinstance(value, str) else " ".join(value),
)  # fmt: skip
def test_what_a_target_cannot_carry_is_refused_with_what_it_can(capfd, target, words, message):
    said = refused(capfd, "design", *words, "--emit", target)
    assert re.search(message, said.rstrip("\n")), said
    assert "\nhint: " in said


def test_a_machine_without_shapers_has_none_to_hand_over(capfd, tmp_path):
    path = tmp_path / "plain.yaml"
    path.write_text("axes: {x: {limits: {velocity_mm_s: 100, acceleration_mm_s2: 1000}}}\n")
    assert "has no shapers" in refused(capfd, "design", "-m", str(path), "--emit", "yaml")


def test_measured_impulses_of_a_machine_need_no_mode(capfd, tmp_path):
    path = tmp_path / "measured.yaml"
    path.write_text(
        "axes: {x: {limits: {velocity_mm_s: 100, acceleration_mm_s2: 1000}, "
        "shaper: {type: impulses, times_s: [0, 0.01], amplitudes: [0.5, 0.5]}}}\n"
    )
    result = answer(capfd, "design", "-m", str(path), "--emit", "rrf")
    assert result["schema"] == "cnc-shape/design/1"
    assert_allclose(read_rrf(result["emitted"]["text"]), [[0.0, 0.01], [0.5, 0.5]])
    assert "this impulses" in refused(capfd, "design", "-m", str(path), "--emit", "klipper")


def test_a_target_refuses_in_python_too():
    with pytest.raises(InfeasibleError, match="knows zv"):
        EMITTERS[Target.MARLIN]([hand_over("ei", Mode(40.0, 0.0))])


def test_a_fit_far_out_of_its_range_is_no_shaper_and_no_reason_to_fail():
    mode = Mode(40.0, 0.5)
    for name in ("duet_ei2", "fitted_ei"):
        with pytest.raises(InfeasibleError, match="out of order"):
            PLAIN[name](Mode(40.0, 0.5 if name == "duet_ei2" else 0.95))
    exact = PLAIN["2hump_ei"](mode)  # of three impulses where the firmware has four
    text = EMITTERS[Target.RRF]([Handover(None, "2hump_ei", {}, (mode,), exact)])
    assert 'P"ei2" is out of order' in text
    assert 'M593 P"custom"' in text
