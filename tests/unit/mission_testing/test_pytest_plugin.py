"""The pytest plugin in a project of its own: light, with the fixture, the settings and scenario files."""

import os
import subprocess
import sys

import pytest

TESTS = """
def test_a_mission_of_the_project(florence):
    florence.mock("navigate_to", "running 3 s, then SUCCESS")
    florence.run("park").assert_succeeded().assert_duration(3)

def test_a_failure(florence):
    florence.mock("navigate_to", "FAILURE no_path")
    florence.run("park").assert_succeeded()

def test_a_call_that_nobody_looked_at(florence):
    try:
        florence.run("park")
    except AssertionError:
        pass

def test_a_mock_with_a_mistake(florence):
    florence.mock("navigate_to", lambda inputs: inputs["gaol"])
    florence.run("park").assert_failed()
"""
LIGHT = """
import sys

def test_nothing_is_loaded_before_it_is_asked_for():
    loaded = [name for name in sys.modules if name.startswith(("florence_bt.", "py_trees", "numpy", "yaml"))]
    assert sorted(loaded) == ["florence_bt.mission_testing", "florence_bt.mission_testing.plugin"]
"""
PARK = """\
mission: park
description: Drives home.
tree:
  navigate_to: {goal: {x: 0 m, y: 0 m, yaw: 0 deg}}
"""
SCENARIOS = """\
mission: park
given: {skills: {navigate_to: running 3 s then SUCCESS}}
scenarios:
  - {name: it parks, then: {status: SUCCEEDED}}
  - {name: it crashes, then: {status: FAILED}}
  - {name: it lies, then: {statsu: FAILED}}
"""


@pytest.fixture
def project(tmp_path):
    (tmp_path / "missions").mkdir()
    (tmp_path / "missions" / "park.yaml").write_text(PARK)
    (tmp_path / "cases").mkdir()
    (tmp_path / "cases" / "parking.yaml").write_text(SCENARIOS)
    (tmp_path / "cases" / "nap.yaml").write_text("mission: nap\ndescription: Naps.\ntree:\n  wait: 1 s\n")
    (tmp_path / "test_park.py").write_text(TESTS)
    (tmp_path / "pytest.ini").write_text(
        "[pytest]\nflorence_missions = missions\nflorence_scenarios = cases\nfilterwarnings = error\n"
    )

    def run(*arguments):
        environment = {k: v for k, v in os.environ.items() if not k.startswith("PYTEST")}
        command = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", "-p", "no:xdist", *arguments]
        if not _registered():
            command += ["-p", "florence_bt.mission_testing.plugin"]
        done = subprocess.run(
            command, cwd=tmp_path, capture_output=True, text=True, timeout=300, env=environment
        )
        return done.stdout + done.stderr

    return run


def _registered():
    """Whether the installed Florence names its plugin; one that was installed by an older setup does not."""
    from importlib.metadata import entry_points

    return any(
        entry.value == "florence_bt.mission_testing.plugin" for entry in entry_points(group="pytest11")
    )


@pytest.mark.slow
def test_a_project(project):
    text = project("-v", "--tb=short")
    for line in (
        "test_park.py::test_a_mission_of_the_project PASSED",
        "test_park.py::test_a_failure FAILED",
        "test_park.py::test_a_call_that_nobody_looked_at ERROR",
        "test_park.py::test_a_mock_with_a_mistake FAILED",
        "cases/parking.yaml::it parks PASSED",
        "cases/parking.yaml::it crashes FAILED",
        "cases/parking.yaml::the file can be read FAILED",
    ):
        assert line in text, text
    assert "test_a_mock_with_a_mistake ERROR" not in text, "it is told twice"
    assert "the mock of park raised KeyError: 'gaol' (test_park.py:" in text
    assert "cases/parking.yaml:5:31: park is SUCCEEDED, not FAILED" in text
    assert "then has no key 'statsu'" in text
    assert "park is FAILED: no way leads to the goal [no_path] at park" in text
    assert "cases/nap.yaml" not in text, "a mission beside scenarios is none"
    assert "play.py" not in text, "pytest shows our lines instead of those of the test"


def test_a_project_that_names_no_scenarios_is_left_alone(project, tmp_path):
    (tmp_path / "pytest.ini").write_text("[pytest]\n")
    (tmp_path / "test_park.py").write_text(LIGHT)
    text = project("-q", "-p", "no:hypothesispytest")
    assert "1 passed" in text and "parking.yaml" not in text, text


@pytest.mark.parametrize("setting", ["florence_missions", "florence_scenarios"])
def test_a_setting_that_names_nothing_is_told(project, tmp_path, setting):
    (tmp_path / "pytest.ini").write_text(f"[pytest]\n{setting} = nowhere\n")
    text = project("-q")
    assert text.startswith(f"ERROR: {setting}: there is no file or folder"), text
