"""The verb ``florence test``: what it prints and writes, and its exit codes."""

from xml.etree import ElementTree as ET

import pytest
from typer.testing import CliRunner

from florence_bt.cli.application import app
from florence_bt.cli.exit_codes import FAILED, OK, USAGE
from florence_bt.core.errors import ConfigError
from florence_bt.mission_testing.scenarios.files import looks_like_scenarios, scenario_files
from florence_bt.mission_testing.scenarios.keyword import keyword_filter

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
    assert florence("good.yaml", "--quiet").stdout.splitlines() == ["", "1 scenario: 1 passed"]


def test_many_that_pass_are_not_named_each(florence, tmp_path):
    rows = ", ".join(str(number) for number in range(26))
    example = f"  - {{name: drive <n>, examples: {{n: [{rows}]}}, then: {{status: SUCCEEDED}}}}\n"
    (tmp_path / "many.yaml").write_text(GOOD + example)
    done = florence("many.yaml")
    assert done.stdout.splitlines() == ["[+] many.yaml: 27 passed", "", "27 scenarios: 27 passed"]
    assert "  [+] drive 25" in florence("many.yaml", "--verbose").stdout.splitlines()
    (tmp_path / "many.yaml").write_text(BAD + example)
    lines = florence("many.yaml").stdout.splitlines()
    assert lines[:2] == ["[x] many.yaml: 27 passed, 1 failed", "  [x] it flies"]
    assert florence("many.yaml", "-q").stdout.splitlines()[:2] == lines[:2]


def test_what_holds_no_scenarios_is_left_out_of_a_folder(florence, tmp_path):
    (tmp_path / "missions").mkdir()
    (tmp_path / "missions" / "nap.yaml").write_text("mission: nap\ndescription: x\ntree:\n  wait: 1 s\n")
    (tmp_path / ".hidden").mkdir()
    (tmp_path / ".hidden" / "bad.yaml").write_text(BAD)
    for name in ("bad", "torn"):
        (tmp_path / f"{name}.yaml").unlink()
    done = florence(".")
    assert done.exit_code == OK
    assert done.stdout.splitlines()[-2:] == [
        "not scenarios, left out: missions/nap.yaml",
        "1 scenario: 1 passed",
    ]
    done = florence("missions")
    assert done.exit_code == USAGE and "no scenario file in 'missions'" in done.stderr
    assert florence("missions/nap.yaml").exit_code == FAILED, "what is named itself is read"


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


ALLOWED = {
    "testsuites": {"name", "time", "tests", "failures", "disabled", "errors"},
    "testsuite": {"name", "tests", "failures", "errors", "skipped", "time", "timestamp", "hostname"},
    "testcase": {"name", "classname", "time", "file", "line", "status", "assertions"},
    "failure": {"message", "type"},
    "error": {"message", "type"},
    "system-out": set(),
}
"""The attributes that Jenkins and GitLab know."""


def test_junit_is_what_continuous_integration_services_read(florence, tmp_path):
    odd = tmp_path / 'odd\x07 <&" names'
    odd.mkdir()
    name = r'"bell \a, escape \e, null \0, <tag> & \"quotes\", \U0001F600, line\nbreak"'
    (odd / "a.yaml").write_text(GOOD + f"  - {{name: {name}, then: {{duration: 1 s}}}}\n")
    assert florence(".", "--junit", "report.xml").exit_code == FAILED
    root = ET.parse(tmp_path / "report.xml").getroot()
    for element in root.iter():
        assert set(element.keys()) <= ALLOWED[element.tag]
    for suite in root:
        cases = suite.findall("testcase")
        assert all(case.get("name") and case.get("classname") for case in cases)
        assert all(float(case.get("time")) >= 0.0 for case in cases)
        assert int(suite.get("tests")) == len(cases)
        assert int(suite.get("failures")) == len(suite.findall("testcase/failure"))
        assert int(suite.get("errors")) == len(suite.findall("testcase/error"))
    for total in ("tests", "failures", "errors"):
        assert int(root.get(total)) == sum(int(suite.get(total)) for suite in root)
    failed = next(case for suite in root for case in suite if case.find("failure") is not None)
    assert "10 s" not in failed.find("failure").get("message")
    assert "3 s  drive to the hotspot: SUCCESS" in failed.find("system-out").text
    (odd_case,) = (case for case in root.iter("testcase") if case.get("name").startswith("bell"))
    assert '<tag> & "quotes", \U0001f600' in odd_case.get("name") and "\x07" not in odd_case.get("name")


def test_no_coverage_is_told_when_nothing_could_be_played(florence, tmp_path):
    (tmp_path / "none.yaml").write_text(GOOD.replace("SUCCEEDED", "SUCCESFUL"))
    done = florence("none.yaml", "--coverage", "--min-coverage", "10")
    assert done.exit_code == FAILED
    assert "no status 'SUCCESFUL'" in done.stdout
    assert "outcomes" not in done.stdout and "never reached" not in done.stdout
    assert done.stdout.splitlines()[-1] == "0 scenarios: 0 passed, 1 error in the files"


def test_coverage_and_its_minimum(florence):
    done = florence("good.yaml", "--coverage")
    assert done.exit_code == OK and "goto_room       3/3        3/8            0/18" in done.stdout
    assert "37.5 % of the outcomes" in done.stdout
    assert "drive to the hotspot: never failed, was never stopped while running" in done.stdout
    assert florence("good.yaml", "--min-coverage", "37").exit_code == OK
    done = florence("good.yaml", "--min-coverage", "38")
    assert done.exit_code == FAILED
    assert "the coverage is 37.5 %, below the 38 % that are asked for" in done.stdout
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
        "  - {name: b, when: [stop], then: {status: STOPPED}}\n"
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
    done = florence("bad.yaml", "-k", "swims")
    assert done.exit_code == USAGE and "it drives" in done.stderr


@pytest.mark.parametrize("arguments", [["none.yaml"], ["empty"], ["good.yaml", "--missions", "none"], []])
def test_wrong_usage(florence, tmp_path, arguments):
    (tmp_path / "empty").mkdir()
    assert florence(*arguments).exit_code == USAGE


def test_files_of_folders_come_once_and_in_order(florence, tmp_path):
    found = scenario_files([tmp_path, tmp_path / "bad.yaml"])
    assert [file.name for file in found.files] == ["bad.yaml", "good.yaml", "torn.yaml"]
    assert found.left_out == ()
    with pytest.raises(ConfigError, match="there is no file that is called like"):
        scenario_files([tmp_path / "none*.yaml"])


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


@pytest.mark.parametrize(
    ("keyword", "names"),
    [
        ("", "abc"),
        ("a", "a"),
        ("a or B", "ab"),
        ("not a", "bc"),
        ("file and not a and not b", "c"),
        ("test a", "a"),
        ("not (a or b)", "c"),
        ("(a or b) and not b", "a"),
        ("not not a", "a"),
        ("'or'", "abc"),
        ("x", ""),
    ],
)
def test_the_keyword(keyword, names):
    chosen = keyword_filter(keyword)
    assert "".join(name for name in "abc" if chosen(f"FILE for::test {name.upper()}")) == names


def test_an_apostrophe_in_a_word_is_no_quote():
    chosen = keyword_filter("robot's base and not (user's room)")
    assert chosen("the Robot's base") and not chosen("the robot's base in the user's room")


@pytest.mark.parametrize("keyword", ["a and", "or", "not", "(a", "a)", "(a) b", "'a", "()"])
def test_a_keyword_that_cannot_be_read(florence, keyword):
    with pytest.raises(ConfigError, match="would have worked"):
        keyword_filter(keyword)
    assert florence("good.yaml", "-k", keyword).exit_code == USAGE
