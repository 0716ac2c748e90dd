"""docs/manual/idioms.md is true: every snippet passes the check, and does what the page says."""

import re
from pathlib import Path

import pytest

from florence_bt.trees.checks.lint import check
from florence_bt.trees.language.declarations import own_declarations
from florence_bt.trees.language.loader import MissionLibrary

IDIOMS = (Path(__file__).parents[3] / "docs" / "manual" / "idioms.md").read_text()
SNIPPETS = re.findall(r"```yaml(?: node)?\n(.*?)```", IDIOMS, re.DOTALL)
DECLARATIONS = own_declarations()


def as_mission(snippet):
    """A snippet as the text of a mission, and its name."""
    tree = "".join(f"  {line}\n" for line in snippet.splitlines())
    text = snippet if snippet.startswith("mission:") else f"mission: idiom\ntree:\n{tree}"
    return text, text.splitlines()[0].removeprefix("mission: ")


@pytest.mark.parametrize("snippet", SNIPPETS)
def test_an_idiom_passes_the_check(snippet, tmp_path):
    text, name = as_mission(snippet)
    (tmp_path / f"{name}.yaml").write_text(text)
    library = MissionLibrary.load([tmp_path], third_party=False)
    found = check(library.get(name), library, DECLARATIONS)
    # That nobody reads what a snippet writes is no fault of the snippet.
    assert [str(finding) for finding in found if "read" not in finding.message] == []


def idiom(heading):
    """The first snippet below a heading of the idioms."""
    return re.search(rf"^## {heading}$.*?```yaml(?: node)?\n(.*?)```", IDIOMS, re.DOTALL | re.MULTILINE)[1]


@pytest.fixture
def play(florence):
    def play(heading, **mocks):
        for name, script in mocks.items():
            florence.mock(name, script)
        text, name = as_mission(idiom(heading))
        florence.load(text)
        return florence.run(name)

    return play


SEEN = "SUCCESS (user=(1 m, 2 m, 0 deg), distance=2 m, user_id=1)"


def test_a_recovery_before_each_further_attempt(play):
    played = play(
        "Try again after a recovery",
        goto_room="FAILURE blocked, then SUCCESS",
        clear_costmap="SUCCESS",
        drive_back="SUCCESS",
    )
    assert played.assert_succeeded().order == ["goto_room", "clear_costmap", "drive_back", "goto_room"]


def test_another_recovery_each_time(play):
    played = play(
        "Another recovery each time", goto_room="FAILURE blocked", clear_costmap="SUCCESS", turn="SUCCESS"
    )
    order = ["goto_room", "clear_costmap", "goto_room", "turn", "goto_room", "goto_room"]
    assert played.assert_failed(code="blocked").order == order
    played.assert_duration("10 s")


def test_until_somebody_is_seen(play):
    seen = f"running 2 s, then FAILURE no_user_seen twice, then {SEEN}"
    played = play("Until something is so", goto_room="running 60 s, then SUCCESS", look_for_user=seen)
    played.assert_succeeded()
    assert played.duration < 10.0


def test_nobody_is_seen_on_the_way(play):
    nobody = "running 2 s, then FAILURE no_user_seen"
    play("Until something is so", goto_room="running 9 s, then SUCCESS", look_for_user=nobody).assert_failed(
        code="nobody_on_the_way"
    )


def test_a_guard_stops_the_drive(play):
    low = "SUCCESS for 5 s, then FAILURE battery_low"
    played = play("A guard that always watches", battery_above=low, goto_room="running 60 s, then SUCCESS")
    played.assert_failed(code="battery_low").assert_duration("5 s")


def test_only_as_long_as_something_is_so(play):
    nobody = "running 2 s, then FAILURE no_user_seen"
    played = play("Only as long as something is so", look_for_user=nobody, say="SUCCESS")
    played.assert_succeeded().assert_called("look_for_user", times=5)


def test_a_failure_is_caught(play):
    play("Catch a failure", goto_room="FAILURE blocked", say="SUCCESS").assert_succeeded()


def test_any_other_failure_is_caught(play):
    failure = 'FAILURE battery "the battery is empty"'
    played = play("Catch a failure", goto_room=failure, say="SUCCESS")
    played.assert_failed(code="no_drive", reason="no drive: the battery is empty")


def test_it_fails_whatever_happens(play):
    play("Fail whatever happens", say="FAILURE server_lost").assert_failed(code="given_up")


def test_it_goes_on_until_it_fails(play):
    seen = f"running 1 s, then {SEEN} 3 times, then FAILURE no_user_seen"
    played = play("Go on until it fails", look_for_user=seen, say="SUCCESS")
    played.assert_succeeded().assert_called("say", times=1)


def test_only_once(play):
    played = play("Only once", look_for_user=f"running 1 s, then {SEEN}", say="SUCCESS")
    assert played.assert_succeeded().order.count("say") == 1


def test_one_of_two_ways_gives_way_to_the_other(play):
    played = play(
        "One of two ways",
        robot_in_room="FAILURE elsewhere for 4.5 s, then SUCCESS",
        goto_room="running 60 s, then SUCCESS",
        say="running 2 s, then SUCCESS",
    )
    played.assert_succeeded().assert_duration("7 s").assert_called("say", times=1)


def test_the_way_home_stands_though_the_battery_reads_more(play):
    played = play(
        "Go home when the battery gets low",
        battery_above="SUCCESS for 5 s, then FAILURE battery_low for 3 s, then SUCCESS",
        goto_room="running 60 s, then SUCCESS",
        go_home="running 10 s, then SUCCESS",
    )
    played.assert_succeeded().assert_duration("15 s").assert_called("goto_room", times=1)


def test_it_picks_up_where_it_left_off(play):
    played = play("Pick up where it left off", goto_room="SUCCESS, then FAILURE blocked, then SUCCESS")
    assert [call["room"] for call in played.assert_succeeded().inputs("goto_room")] == [
        "kitchen",
        "hall",
        "hall",
    ]


def test_a_clean_up_follows_a_stop(florence):
    florence.mock("set_speed_limit", "SUCCESS")
    florence.mock("goto_room", "running 60 s, then SUCCESS")
    text, name = as_mission(idiom("Cancel and clean up"))
    florence.load(text)
    played = florence.start(name)
    florence.advance("10 s")
    florence.stop("enough")
    florence.run_until_done()
    assert played.order == ["set_speed_limit", "goto_room", "set_speed_limit"]
