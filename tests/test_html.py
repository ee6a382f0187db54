"""The page: one file, no scripts, no requests, and no text that becomes code."""

from __future__ import annotations

import base64
import hashlib
import os
import re
import shutil
import subprocess
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import pytest
from payloads import PAYLOADS
from runs import MODE, TEXT, driven, make_run, shaper

from cnc_shape.report import figures
from cnc_shape.report.html import Page, render_html
from cnc_shape.report.motor_figures import motor_cases, motor_figure
from cnc_shape.report.style import render
from cnc_shape.report.table import columns
from cnc_shape.report.words import verdict

RUN = make_run(600)
TAGS = {
    "html", "head", "meta", "title", "style", "body", "main", "header", "section", "p", "h1", "h2", "dl",
    "div", "dt", "dd", "table", "thead", "tbody", "tr", "th", "td", "small", "figure", "img", "figcaption",
    "code", "ul", "li", "details", "summary", "pre", "footer",
}  # fmt: skip
BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
QUIET = (
    "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-sync",
    "--disable-background-networking", "--disable-component-update", "--enable-logging=stderr", "--v=0",
)  # fmt: skip


class Reader(HTMLParser):
    """Collects tags, attributes and text of a page."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.tags: list[str] = []
        self.attributes: list[tuple[str, str, str]] = []
        self.text = ""
        self.feed(page)
        self.close()

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        self.attributes += [(tag, name, value or "") for name, value in attrs]

    def handle_data(self, data):
        self.text += data


def page_of(run=RUN, **changes) -> str:
    drawn = {"path": render(figures.path_figure(RUN), "svg")}
    return render_html(run, Page(drawn, {"x": shaper()}, {"x": (MODE,)}, **changes))


@pytest.fixture(scope="module")
def plain() -> str:
    return page_of(machine="name: XY stage\n", warnings=("part.nc:3: warning: odd",))


def test_the_page_says_the_verdict_and_every_number_of_the_table(plain):
    read = Reader(plain)
    text = " ".join(read.text.split())
    assert verdict(RUN.summary) in text
    for column in columns(RUN.summary):
        for cell in column.cells:
            for number in cell:
                assert number in text
    assert "rounds corners" in text
    assert "part.nc:3: warning: odd" in text
    assert read.tags.count("img") == 1


DRIVEN = driven(600)


def driven_page(**changes) -> str:
    drawn = {signals.case: render(motor_figure(signals), "svg") for signals in motor_cases(DRIVEN)}
    return render_html(DRIVEN, Page(motor_figures=drawn, **changes))


def test_servo_motors_have_a_table_and_a_figure_for_every_disturbed_case(plain):
    page = driven_page()
    read, text = Reader(page), " ".join(Reader(page).text.split())
    assert verdict(DRIVEN.summary) in text
    assert read.tags.count("img") == 3
    assert set(read.tags) <= TAGS
    for case in DRIVEN.summary.cases:
        for motor in case.motors:
            assert f"{motor.peak_torque:.3g}" in text
            assert f"{100.0 * motor.saturated_share:.3g}" in text
    assert "of disturbed rows, against the first of them" in text
    assert text.count("+ disturbed") >= 3
    assert "Servo motors" not in Reader(plain).text
    assert "of them" not in Reader(plain).text
    assert driven_page() == page


def test_a_page_of_many_samples_keeps_its_size():
    run = driven(200_000)
    drawn = {signals.case: render(motor_figure(signals), "svg") for signals in motor_cases(run)}
    assert len(render_html(run, Page(motor_figures=drawn))) < 1_500_000


def test_the_policy_admits_the_style_sheet_by_its_hash_and_nothing_else(plain):
    policy = re.search(r'Content-Security-Policy" content="([^"]*)"', plain).group(1).replace("&#39;", "'")
    style = re.search(r"<style>(.*?)</style>", plain, re.S).group(1)
    digest = base64.b64encode(hashlib.sha256(style.encode()).digest()).decode()
    assert policy.startswith(f"default-src 'none'; style-src 'sha256-{digest}'; img-src data:")
    assert "unsafe" not in policy
    assert plain.index("Content-Security-Policy") < plain.index("<style>")


def test_nothing_in_the_page_runs_or_leaves_it(plain):
    read = Reader(plain)
    assert set(read.tags) <= TAGS
    for tag, name, value in read.attributes:
        assert not name.startswith("on")
        assert name not in {"style", "href", "srcset", "action"}
        assert name != "src" or (tag == "img" and value.startswith("data:image/svg+xml;base64,"))
    assert not re.search(r"https?:|url\(|@import", plain)


@pytest.mark.parametrize("payload", PAYLOADS)
def test_payloads_stay_text_wherever_they_come_from(payload, tmp_path, plain):
    program = tmp_path / "program.nc"
    program.write_bytes(b"\n".join([payload.encode("utf-8", "surrogateescape").replace(b"\n", b" ")] * 6))
    summary = replace(RUN.summary, program=payload, machine=payload)
    page = page_of(replace(RUN, summary=summary), machine=payload, warnings=(payload,), program=program)
    page.encode("utf-8", "backslashreplace")
    read, usual = Reader(page), Reader(plain)
    assert read.tags == usual.tags
    assert [(tag, name) for tag, name, _ in read.attributes] == [
        (tag, name) for tag, name, _ in usual.attributes
    ]
    assert "49" not in read.text.split()
    assert "\u202e" not in page.split("<pre>")[0]


def test_case_names_are_text_too():
    cases = tuple(replace(case, name=case.name + "<b>&") for case in RUN.summary.cases)
    signals = tuple(replace(s, case=s.case + "<b>&") for s in RUN.signals)
    page = page_of(replace(RUN, summary=replace(RUN.summary, cases=cases), signals=signals))
    assert "<b>" not in page


def test_the_worst_lines_are_quoted_from_the_program(tmp_path):
    program = tmp_path / "program.nc"
    program.write_bytes(TEXT)
    assert "G3 X0 Y20 I-20 J0" in Reader(page_of(program=program)).text
    assert "G3 X0 Y20 I-20 J0" not in Reader(page_of(program=tmp_path / "absent")).text


def test_a_line_of_any_length_is_cut(tmp_path):
    program = tmp_path / "program.nc"
    program.write_bytes(b"X" * 100_000 + b"\n" + b"(long" + b"g" * 100_000 + b")\n")
    assert len(page_of(program=program)) < 1_000_000
    assert "g" * 70 not in page_of(program=program)


def test_two_pages_are_one(plain):
    assert page_of(machine="name: XY stage\n", warnings=("part.nc:3: warning: odd",)) == plain


@pytest.fixture(scope="module")
def browser() -> str:
    named = os.environ.get("CNC_SHAPE_BROWSER")
    found = named or next((path for name in BROWSERS if (path := shutil.which(name))), None)
    if found is None:
        pytest.skip("no browser: install chromium, or name one with CNC_SHAPE_BROWSER")
    return found


def visit(browser: str, page: Path, profile: Path) -> tuple[str, str]:
    """Open a page without a network; return its document afterwards, and what the console said."""
    done = subprocess.run(
        [
            browser, *QUIET, "--host-resolver-rules=MAP * ~NOTFOUND", f"--user-data-dir={profile}",
            "--dump-dom", page.as_uri(),
        ],
        capture_output=True, text=True, errors="replace", timeout=120, check=False,
    )  # fmt: skip
    console = [line for line in done.stderr.splitlines() if "CONSOLE" in line or "Content Security" in line]
    return done.stdout, "\n".join(console)


def test_a_browser_shows_the_page_without_a_complaint(browser, tmp_path, plain):
    page = tmp_path / "report.html"
    page.write_text(plain, encoding="utf-8")
    document, console = visit(browser, page, tmp_path / "profile")
    assert console == ""
    assert "<h1>corner_and_arc.nc</h1>" in document


def test_a_browser_shows_servo_motors_without_a_complaint(browser, tmp_path):
    page = tmp_path / "report.html"
    page.write_text(driven_page(), encoding="utf-8")
    document, console = visit(browser, page, tmp_path / "profile")
    assert console == ""
    assert document.count("<figure>") == 3


def test_no_payload_runs_in_a_browser(browser, tmp_path):
    everything = " ".join(PAYLOADS)
    program = tmp_path / "program.nc"
    program.write_bytes(b"\n".join([everything.encode("utf-8", "surrogateescape")] * 6))
    summary = replace(RUN.summary, program=everything, machine=everything)
    page = tmp_path / "report.html"
    text = page_of(replace(RUN, summary=summary), machine=everything, warnings=PAYLOADS, program=program)
    page.write_bytes(text.encode("utf-8", "backslashreplace"))
    document, console = visit(browser, page, tmp_path / "profile")
    assert console == ""
    assert not re.search(r"<title>owned", document)
    assert "<script" not in document
    assert "cnc-shape</title>" in document


def test_the_policy_is_a_wall_of_its_own(browser, tmp_path, plain):
    page = tmp_path / "report.html"
    page.write_text(
        plain.replace("<main>", "<main><script>document.title='owned'</script>"), encoding="utf-8"
    )
    document, console = visit(browser, page, tmp_path / "profile")
    assert "<title>owned" not in document
    assert "Content Security Policy" in console
