"""Findings as people, programs and services read them."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from florence_bt.core.errors import ConfigError
from florence_bt.core.plain_yaml import read_yaml
from florence_bt.trees.checks.report import (
    MAX_MESSAGE,
    MAX_WIDTH,
    Excerpts,
    marks_under,
    report_full,
    report_github,
    report_json,
    report_text,
    summary,
    width,
)
from florence_bt.trees.language.findings import MAX_FINDINGS, Finding, finding_from_error, limit_findings

FINDINGS = [
    Finding("a.yaml", 3, 5, "error", "unknown skill 'trun', 100%", ("turn",)),
    Finding("b.yaml", 1, 1, "warning", "odd"),
]
TEXT = "mission: a\ntree:\n    trun: {angle: 5}\n"


def test_one_line_per_finding():
    assert report_text(FINDINGS) == (
        "a.yaml:3:5: error: unknown skill 'trun', 100% (would have worked: turn)\nb.yaml:1:1: warning: odd"
    )


def test_the_offending_line_with_marks_under_the_offending_text():
    assert report_full(FINDINGS, Excerpts({"a.yaml": TEXT})) == (
        "a.yaml:3:5: error: unknown skill 'trun', 100%\n"
        "    3 |     trun: {angle: 5}\n"
        "      |     ^^^^\n"
        "      = would have worked: turn\n"
        "b.yaml:1:1: warning: odd"
    )


def test_colours_change_nothing_but_the_colour():
    excerpts = Excerpts({"a.yaml": TEXT})
    coloured = report_full(FINDINGS, excerpts, colour=True)
    assert "\x1b[1;31m" in coloured and "\x1b[1;33m" in coloured
    for code in ("\x1b[1;31m", "\x1b[1;33m", "\x1b[32m", "\x1b[1m", "\x1b[0m"):
        coloured = coloured.replace(code, "")
    assert coloured == report_full(FINDINGS, excerpts)


def test_json():
    assert json.loads(report_json(FINDINGS, Excerpts({"a.yaml": TEXT})))[0] == {
        "file": "a.yaml",
        "line": 3,
        "column": 5,
        "severity": "error",
        "message": "unknown skill 'trun', 100%",
        "valid": ["turn"],
        "text": "trun",
    }
    assert json.loads(report_json([])) == []


def test_annotations():
    assert report_github(FINDINGS, Excerpts({"a.yaml": TEXT})).splitlines() == [
        "::error file=a.yaml,line=3,col=5,endColumn=8,title=florence check"
        "::unknown skill 'trun', 100%25 (would have worked: turn)",
        "::warning file=b.yaml,line=1,col=1,endColumn=1,title=florence check::odd",
    ]


def test_summary():
    assert [summary(FINDINGS), summary(FINDINGS[:1] * 2), summary([])] == [
        *["1 error, 1 warning", "2 errors, 0 warnings", "no problem found"],
    ]


@pytest.mark.parametrize(
    ("line", "column", "text"),
    [
        ("  - turn: {angle: 45}", 5, "turn"),
        ("  - turn: {angle: 45}", 19, "45"),
        ("  - turn: {angle: 4.5 m, b: 1}", 19, "4.5 m"),
        ("  - turn: {angle: -4.5 km/h}", 19, "-4.5 km/h"),
        ('  - turn: {angle: "5 \\" m"} # x', 19, '"5 \\" m"'),
        ("  - turn: {angle: 'it''s'}", 19, "'it''s'"),
        ("  goal: $pose.x + 1", 9, "$pose.x"),
        ("  goal: ${$a + 1 m}", 9, "${$a + 1 m}"),
        ("  when: $a <= 5 s", 12, "<="),
        ("  wait: 5 s", 9, "5 s"),
        ("  wait: 12:30 # noon", 9, "12:30"),
        ("  a: {x: 1}", 6, "{"),
        ("  a: b", 7, ""),
    ],
)
def test_the_offending_text(line, column, text):
    excerpt = Excerpts({"m.yaml": line}).of(Finding("m.yaml", 1, column, "error", "no"))
    assert excerpt.text == text
    assert marks_under(excerpt) == " " * (column - 1) + "^" * max(1, len(text))


def test_long_lines_are_shown_in_part():
    line = "{" + "a: 1, " * 200 + "oops: 1" + ", b: 2" * 200 + "}"
    excerpt = Excerpts({"m.yaml": line}).of(Finding("m.yaml", 1, line.index("oops") + 1, "error", "no"))
    assert excerpt.text == "oops" and excerpt.line[excerpt.start :].startswith("oops")
    assert excerpt.line[0] == excerpt.line[-1] == "…" and len(excerpt.line) == MAX_WIDTH + 2


def test_marks_are_as_wide_as_the_text_in_a_terminal():
    line = "  名前: {'漢字': ü}"
    excerpt = Excerpts({"m.yaml": line}).of(Finding("m.yaml", 1, line.index("'") + 1, "error", "no"))
    assert excerpt.text == "'漢字'"
    assert marks_under(excerpt) == " " * width("  名前: {") + "^" * 6


def test_control_characters_do_not_reach_the_terminal():
    excerpt = Excerpts({"m.yaml": "a: \x1b[31mb"}).of(Finding("m.yaml", 1, 4, "error", "no"))
    assert "\x1b" not in excerpt.line


@pytest.mark.parametrize("place", [(0, 1), (9, 1), (2, 1)])
def test_a_place_that_is_not_there_has_no_excerpt(place):
    assert Excerpts({"m.yaml": "a: b\n"}).of(Finding("m.yaml", *place, "error", "no")) is None
    assert Excerpts().of(Finding("/nowhere/m.yaml", 1, 1, "error", "no")) is None


def test_long_messages_and_lists_are_cut():
    finding = Finding("a.yaml", 1, 1, "error", "no", tuple(f"n{i}" for i in range(10)))
    assert report_text([finding]).endswith("n7 and 2 more)")
    long = Finding("a.yaml", 1, 1, "error", "x" * 10_000 + "\nend", ("y" * 10_000,))
    assert len(report_text([long])) < 3 * MAX_MESSAGE and "\n" not in report_text([long])
    assert report_text([long]).count("…") == 2


def test_only_so_many_findings_of_one_file_are_kept():
    many = [Finding("a.yaml", line, 1, "warning", "no") for line in range(1, 1000)]
    kept = limit_findings([*many, *FINDINGS[1:], *many])
    assert len(kept) == MAX_FINDINGS + 2
    assert kept[MAX_FINDINGS].message == "more than 200 problems in this file; the rest is not shown"
    assert kept[MAX_FINDINGS].severity == "error" and kept[-1].file == "b.yaml"


HEAD = "mission: m\ndescription: In die K\u00fcche fahren\n"


@pytest.mark.parametrize(
    ("data", "report"),
    [
        (
            HEAD.encode("latin-1"),
            "m.yaml:2:22: error: byte 0xfc is not UTF-8\n"
            "    2 | description: In die K\ufffdche fahren\n"
            "      |                      ^\n"
            "      = would have worked: saving the file as UTF-8",
        ),
        (
            HEAD.encode()[:34] + b"\xfftz",
            "m.yaml:2:23: error: byte 0xff is not UTF-8\n"
            "    2 | description: In die Kü�tz\n"
            "      |                       ^\n"
            "      = would have worked: saving the file as UTF-8",
        ),
        (
            HEAD.encode("utf-16"),
            "m.yaml:1:1: error: the file is written in UTF-16\n"
            "    1 | mission: m\n"
            "      | ^^^^^^^\n"
            "      = would have worked: saving the file as UTF-8",
        ),
        (
            b"\x89PNG\r\n\x1a\n\x00\x00",
            "m.yaml:1:1: error: the file is not text (byte 0x89 is not UTF-8)\n"
            "      = would have worked: a text file in UTF-8",
        ),
    ],
)
def test_people_can_read_the_line_of_a_file_that_is_no_utf_8(tmp_path, monkeypatch, data, report):
    monkeypatch.chdir(tmp_path)
    Path("m.yaml").write_bytes(data)
    with pytest.raises(ConfigError) as caught:
        read_yaml(Path("m.yaml"))
    assert report_full([finding_from_error(caught.value)], Excerpts()) == report
