"""The verb ``florence test``: pytest with our plugin; what it prints and writes, and its exit codes."""

import sys
from xml.etree import ElementTree as ET

import pytest
from typer.testing import CliRunner

from florence_bt.cli.application import app
from florence_bt.cli.exit_codes import FAILED, OK, USAGE
from florence_bt.core.installation import how_to_get
from florence_bt.mission_testing.plugin import looks_like_scenarios

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
    assert "1 passed" in done.stdout and "good.yaml ." in done.stdout
    assert "good.yaml::it drives PASSED" in florence("good.yaml", "-v").stdout
    assert "it drives" not in florence("good.yaml", "-q").stdout


def test_what_holds_no_scenarios_is_left_out_of_a_folder(florence, tmp_path):
    (tmp_path / "missions").mkdir()
    (tmp_path / "missions" / "nap.yaml").write_text("mission: nap\ndescription: x\ntree:\n  wait: 1 s\n")
    (tmp_path / "missions" / "test_python.py").write_text("def test_it():\n    raise SystemExit\n")
    (tmp_path / ".hidden").mkdir()
    (tmp_path / ".hidden" / "bad.yaml").write_text(BAD)
    for name in ("bad", "torn"):
        (tmp_path / f"{name}.yaml").unlink()
    done = florence(".", "-v")
    assert done.exit_code == OK
    assert "1 passed" in done.stdout and "nap" not in done.stdout and "python" not in done.stdout
    assert florence("missions").exit_code == USAGE
    assert florence("missions/nap.yaml").exit_code == FAILED, "what is named itself is read"


def test_one_failed(florence):
    done = florence("bad.yaml")
    assert done.exit_code == FAILED
    lines = done.stdout.splitlines()
    assert "bad.yaml:7:29: goto_room took 3 s, not 1 s" in lines
    assert "[+] goto_room (sequence)" in lines
    assert "FAILED bad.yaml::it flies - bad.yaml:7:29: goto_room took 3 s, not 1 s" in lines
    assert "1 failed, 1 passed" in lines[-1]


def test_an_error_in_a_file(florence):
    done = florence("torn.yaml", "good.yaml")
    assert done.exit_code == FAILED
    assert "torn.yaml:7:28: error: then has no key 'statsu'" in done.stdout
    assert "would have worked: status" in done.stdout
    assert "1 failed, 2 passed" in done.stdout


def test_junit(florence, tmp_path):
    assert florence(".", "--junit", "out/report.xml").exit_code == FAILED
    (suite,) = ET.parse(tmp_path / "out" / "report.xml").getroot()
    assert (suite.get("tests"), suite.get("failures")) == ("5", "2")
    cases = {(case.get("classname"), case.get("name")): case for case in suite}
    assert ("good.yaml", "it drives") in cases
    failure = cases["bad.yaml", "it flies"].find("failure")
    assert "goto_room took 3 s, not 1 s" in failure.get("message")
    assert "bad.yaml:7:29" in failure.text and "[+] goto_room" in failure.text
    assert "statsu" in cases["torn.yaml", "the file can be read"].find("failure").text


def test_a_report_is_written_like_every_other_file(florence, tmp_path):
    mission = (tmp_path / "good.yaml").read_text()
    (tmp_path / "link.xml").symlink_to(tmp_path / "elsewhere.xml")
    for name in ("link.xml", "good.yaml"):
        done = florence("good.yaml", "--junit", name)
        assert done.exit_code == USAGE and name in done.stderr
    assert not (tmp_path / "elsewhere.xml").exists() and (tmp_path / "good.yaml").read_text() == mission
    for _ in range(2):
        assert florence("good.yaml", "--junit", "report.xml").exit_code == OK


def test_no_coverage_is_reported_when_nothing_could_be_played(florence, tmp_path):
    (tmp_path / "none.yaml").write_text(GOOD.replace("SUCCEEDED", "SUCCESFUL"))
    done = florence("none.yaml", "--coverage", "--min-coverage", "10")
    assert done.exit_code == FAILED
    assert "status cannot be 'SUCCESFUL'" in done.stdout
    assert "outcomes" not in done.stdout and "never reached" not in done.stdout


def test_coverage_and_its_minimum(florence):
    done = florence("good.yaml", "--coverage")
    assert done.exit_code == OK and "goto_room       3/3        3/8            0/18" in done.stdout
    assert "37.5 % of the outcomes" in done.stdout
    assert "drive to the hotspot: never failed, was never stopped while running" in done.stdout
    assert florence("good.yaml", "--min-coverage", "37").exit_code == OK
    done = florence("good.yaml", "--min-coverage", "38")
    assert done.exit_code == FAILED
    assert "the coverage is 37.5 %, below the required 38 %" in done.stdout
    assert florence("good.yaml", "--min-coverage", "101").exit_code == USAGE


def test_missions_that_no_scenario_starts_count_as_not_covered(florence, tmp_path):
    (tmp_path / "mine").mkdir()
    for name in ("nap", "doze"):
        text = f"mission: {name}\ndescription: x\ntree:\n  wait: 1 s\n"
        (tmp_path / "mine" / f"{name}.yaml").write_text(text)
    (tmp_path / "cases").mkdir()
    (tmp_path / "cases" / "nap.yaml").write_text(
        "missions: [../mine]\nmission: nap\nscenarios:\n"
        "  - {name: a, then: {status: SUCCEEDED}}\n"
        "  - {name: b, when: [stop: ], then: {status: STOPPED}}\n"
    )
    done = florence("cases", "--coverage")
    assert "nap           1/1        2/2             0/0" in done.stdout
    assert "doze          0/1        0/2             0/0" in done.stdout
    assert "\nmine/doze.yaml:4:3: wait 1 s: was never reached\n" in done.stdout
    assert florence("cases", "--min-coverage", "100").exit_code == FAILED
    assert florence("cases", "--min-coverage", "100", "-k", "nap").exit_code == OK


def test_only_some(florence):
    assert florence("bad.yaml", "-k", "drives").exit_code == OK
    assert florence("bad.yaml", "-k", "not flies").exit_code == OK
    assert florence("bad.yaml", "-k", "swims").exit_code == USAGE
    assert florence("bad.yaml", "-k", "not (").exit_code == USAGE


def test_further_options_go_to_pytest(florence):
    assert "stopping after 1 failures" in florence("bad.yaml", "torn.yaml", "-x").stdout


def test_pytest_is_an_extra(florence, monkeypatch):
    monkeypatch.setitem(sys.modules, "pytest", None)
    done = florence("good.yaml")
    assert done.exit_code == USAGE
    assert "florence test needs pytest" in done.stderr and how_to_get("pytest") in done.stderr


@pytest.mark.parametrize("arguments", [["none.yaml"], ["empty"], ["good.yaml", "--missions", "none"], []])
def test_wrong_usage(florence, tmp_path, arguments):
    (tmp_path / "empty").mkdir()
    assert florence(*arguments).exit_code == USAGE


@pytest.mark.parametrize(
    ("text", "counts"),
    [
        (GOOD, True),
        ("scenario:\n  - {name: x}\n", True),
        ("mission: nap\ngiven: {}\n", True),
        ("a: [", False),
        ("", False),
        ("mission: nap\ntree:\n  wait: 1 s\n", False),
        ("mission: nap\ntree:\n  wait: 1 s\nscenarios: []\n", True),
        ("services:\n  web: {}\n", False),
    ],
)
def test_what_counts_as_scenarios_in_a_folder(tmp_path, text, counts):
    file = tmp_path / "some.yml"
    file.write_text(text)
    assert looks_like_scenarios(file) is counts
