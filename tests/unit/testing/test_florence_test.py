"""The verb ``florence test``: what it prints and writes, and its exit codes."""

from xml.etree import ElementTree as ET

import pytest
from typer.testing import CliRunner

from florence_bt.cli import FAILED, OK, USAGE, app
from florence_bt.core.errors import ConfigError
from florence_bt.wiring.scenario_runs import keyword_filter, scenario_files

GOOD = """\
mission: goto_room
given:
  inputs: {room: kitchen}
  skills: {get_hotspot: "SUCCESS (pose=(1 m, 2 m, 0 deg))", navigate_to: running 3 s then SUCCESS}
scenarios:
  - {name: it drives, then: {status: SUCCEEDED}}
"""
BAD = GOOD + "  - {name: it flies, then: {duration: 1 s}}\n"
TORN = GOOD + "  - {name: it lies, then: {statsu: SUCCEEDED}}\n"


@pytest.fixture
def florence(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name, text in {"good": GOOD, "bad": BAD, "torn": TORN}.items():
        (tmp_path / f"{name}.yaml").write_text(text)

    def call(*arguments):
        return CliRunner().invoke(app, ["test", *map(str, arguments)], catch_exceptions=False)

    return call


def test_all_passed(florence):
    done = florence("good.yaml")
    assert done.exit_code == OK
    assert done.stdout.splitlines() == ["good.yaml", "  [+] it drives", "", "1 scenario: 1 passed"]
    assert florence("good.yaml", "--quiet").stdout.splitlines()[0:2] == ["good.yaml", ""]


def test_one_failed(florence):
    done = florence("bad.yaml")
    assert done.exit_code == FAILED
    lines = done.stdout.splitlines()
    assert lines[:3] == ["bad.yaml", "  [+] it drives", "  [x] it flies"]
    assert "bad.yaml:7:29: goto_room took 3 s, not 1 s" in lines
    assert "    [+] goto_room (sequence)" in lines
    assert lines[-1] == "2 scenarios: 1 passed, 1 failed"


def test_what_is_printed_is_the_same_every_time(florence):
    assert florence("bad.yaml", "--coverage").stdout == florence("bad.yaml", "--coverage").stdout


def test_an_error_in_a_file(florence):
    done = florence("torn.yaml", "good.yaml")
    assert done.exit_code == FAILED
    assert "torn.yaml:7:28: error: then has no key 'statsu'" in done.stdout
    assert "would have worked: status" in done.stdout
    assert done.stdout.splitlines()[-1] == "2 scenarios: 2 passed, 1 error in the files"


def test_junit(florence, tmp_path):
    assert florence(".", "--junit", "out/report.xml").exit_code == FAILED
    root = ET.parse(tmp_path / "out" / "report.xml").getroot()
    assert (root.tag, root.get("tests"), root.get("failures"), root.get("errors")) == (
        "testsuites",
        "5",
        "1",
        "1",
    )
    suites = {suite.get("name"): suite for suite in root}
    assert set(suites) == {"bad.yaml", "good.yaml", "torn.yaml"}
    failure = suites["bad.yaml"].find("testcase/failure")
    assert failure.get("message") == "goto_room took 3 s, not 1 s"
    assert "bad.yaml:7:29" in failure.text and "[+] goto_room" in failure.text
    assert "statsu" in suites["torn.yaml"].find("testcase/error").text
    assert florence("good.yaml", "--junit", tmp_path).exit_code == USAGE


def test_coverage_and_its_minimum(florence):
    done = florence("good.yaml", "--coverage")
    assert done.exit_code == OK and "goto_room       3/3        3/8            0/10" in done.stdout
    assert "37.5 % of the outcomes" in done.stdout
    assert "drive to the hotspot: never failed, was never stopped while running" in done.stdout
    assert florence("good.yaml", "--min-coverage", "37").exit_code == OK
    done = florence("good.yaml", "--min-coverage", "38")
    assert done.exit_code == FAILED
    assert "the coverage is 37.5 %, below the 38 % that are asked for" in done.stdout
    assert florence("good.yaml", "--min-coverage", "101").exit_code == USAGE


def test_only_some(florence):
    assert florence("bad.yaml", "-k", "drives").exit_code == OK
    assert florence("bad.yaml", "-k", "not flies").exit_code == OK
    done = florence("bad.yaml", "-k", "swims")
    assert done.exit_code == USAGE and "it drives" in done.stderr


@pytest.mark.parametrize("arguments", [["none.yaml"], ["empty"], ["good.yaml", "--missions", "none"], []])
def test_wrong_usage(florence, tmp_path, arguments):
    (tmp_path / "empty").mkdir()
    assert florence(*arguments).exit_code == USAGE


def test_files_of_folders_come_once_and_in_order(florence, tmp_path):
    assert [file.name for file in scenario_files([tmp_path, tmp_path / "bad.yaml"])] == [
        *["bad.yaml", "good.yaml", "torn.yaml"]
    ]
    with pytest.raises(ConfigError):
        scenario_files([tmp_path / "none"])


@pytest.mark.parametrize(
    ("keyword", "names"),
    [
        ("", "abc"),
        ("a", "a"),
        ("a or B", "ab"),
        ("not a", "bc"),
        ("file and not a and not b", "c"),
        ("x", ""),
    ],
)
def test_the_keyword(keyword, names):
    chosen = keyword_filter(keyword)
    assert "".join(name for name in "abc" if chosen(f"FILE::test {name.upper()}")) == names
