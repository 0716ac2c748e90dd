"""What the tests of the test tools share: a stage with a small mission, and scenarios read and played."""

import textwrap

import pytest

from florence_bt.mission_testing import MissionTester
from florence_bt.mission_testing.scenarios.scenario import run_scenario
from florence_bt.mission_testing.scenarios.scenario_file import Libraries, read_scenarios
from tests.unit.mission_testing.greeting import GREET, SEEN


@pytest.fixture
def stage(tmp_path):
    stage = MissionTester(scratch=tmp_path)
    stage.load(GREET)
    stage.defaults(
        get_hotspot="SUCCESS (pose=(1 m, 2 m, 90 deg))",
        navigate_to="cancel takes 500 ms, running 10 s, then SUCCESS",
        look_for_user=SEEN,
    )
    return stage


HEAD = """\
mission: goto_room
given:
  inputs: {room: kitchen}
  skills:
    get_hotspot: SUCCESS (pose=(4 m, 5 m, 0 deg))
    navigate_to: cancel takes 500 ms, running 10 s, then SUCCESS
scenarios:
"""


@pytest.fixture(scope="module")
def libraries():
    return Libraries()


@pytest.fixture
def read(tmp_path, libraries):
    def read(text, head=HEAD):
        file = tmp_path / "some.yaml"
        file.write_text(head + textwrap.indent(textwrap.dedent(text), "  " if head else ""))
        return read_scenarios(file, libraries)

    return read


@pytest.fixture
def play(read, libraries):
    def play(text, head=HEAD):
        found = read(text, head)
        assert found.findings == (), found.findings
        return [run_scenario(scenario) for scenario in found.scenarios]

    return play
