"""Two versions of a mission are told apart, or proved to do the same."""

from pathlib import Path

import pytest

from florence_bt.assurance.mutating.draft import draft_of
from florence_bt.assurance.mutating.names import name_of
from florence_bt.assurance.mutating.pairs import Pair
from florence_bt.assurance.verifier import Verifier
from florence_bt.mission_testing.paths import all_declarations
from florence_bt.trees.language.loader import MissionLibrary
from florence_bt.trees.language.parse import parse_mission

STEPS = 3000
LOOK = "      - look_for_user:\n        out: {distance: distance, user: user}\n"
FAR = f"  sequence:\n{LOOK}      - {{when: $distance > 1 m, set: {{far: 1 m}}}}\n      - say: {{text: $far}}"
NEVER = f"  sequence:\n{LOOK}      - when: $distance < 1 m and $distance > 2 m\n        say: {{text: Hello.}}"
NEAR = f"  sequence:\n{LOOK}      - when: $distance < 1 m\n        say: {{text: Hello.}}"
APART = {
    "a number of attempts": ("  retry: 2\n  do: {turn: {angle: 1 rad}}", "retry: 2", "retry: 3"),
    "a time-out": ("  timeout: 10 s\n  do: {turn: {angle: 1 rad}}", "10 s", "11 s"),
    "an input": ("  turn: {angle: 1 rad}", "1 rad", "1.1 rad"),
    "a pause": ("  sequence: [{wait: 5 s}, {say: {text: Hello.}}]", "5 s", "5.5 s"),
    "a limit": (NEAR, "< 1 m", "< 1.1 m"),
    "whether the limit belongs to it": (NEAR, "< 1 m", "<= 1 m"),
    "a code": ("  fail: no\n  code: mine", "mine", "another"),
    "a sentence": ("  fail: no", "no", "nothing"),
    "which codes are tried again": (
        "  retry: 2\n  on: [no_scan]\n  do: {navigate_to: {goal: {x: 1 m, y: 1 m, yaw: 0}}}",
        "no_scan",
        "any",
    ),
    "a clean-up": (
        "  turn: {angle: 1 rad}\n  finally: {say: {text: Done.}}",
        "\n  finally: {say: {text: Done.}}",
        "",
    ),
    "the order": (
        "  sequence: [{say: {text: One.}}, {say: {text: Two.}}]",
        "{say: {text: One.}}, {say: {text: Two.}}",
        "{say: {text: Two.}}, {say: {text: One.}}",
    ),
    "what a key holds": (
        f"  sequence:\n{LOOK}      - set: {{place: $user}}\n      - navigate_to: {{goal: $place}}",
        "{place: $user}",
        "{place: {x: 0, y: 0, yaw: 0}}",
    ),
    "what a sentence says": (
        FAR,
        "> 1 m",
        ">= 1 m",
    ),
}
"""What is another -> a tree, and what of its text becomes what."""
ALIKE = {
    "a pause never fails": ("  succeed: {wait: 1 s}", "succeed: {wait: 1 s}", "wait: 1 s"),
    "a code that cannot come": (
        "  retry: 2\n  on: [no_user_seen]\n  do: {turn: {angle: 1 rad}}",
        "no_user_seen",
        "not_said",
    ),
    "two keys are set": (
        "  sequence: [{set: {a: 1}}, {set: {b: 2}}, {turn: {angle: 1 rad}}]",
        "{set: {a: 1}}, {set: {b: 2}}",
        "{set: {b: 2}}, {set: {a: 1}}",
    ),
    "a condition that never holds": (
        NEVER,
        "> 2 m",
        "> 2.2 m",
    ),
}


@pytest.fixture
def pair(tmp_path: Path):
    """Return what pairs two trees."""

    def make(tree: str, old: str, new: str) -> tuple[Pair, Verifier]:
        assert tree.count(old) == 1
        verifiers = []
        for text in (tree, tree.replace(old, new)):
            library = MissionLibrary.load([])
            library.put(parse_mission(f"mission: tried\ntree:\n{text}\n", tmp_path / "tried.yaml"))
            verifiers.append(Verifier(library, all_declarations()))
        return Pair(*verifiers, "tried"), verifiers[0]

    return make


@pytest.mark.parametrize("what", APART)
def test_two_versions_are_told_apart(pair, what: str):
    versions, verifier = pair(*APART[what])
    way = next(versions.differences(60.0, STEPS))
    assert not versions.explored.equivalent
    assert draft_of(versions, way, verifier.library.get("tried"), versions.declarations) is not None


@pytest.mark.parametrize("what", ALIKE)
def test_two_versions_are_proved_to_do_the_same(pair, what: str):
    versions, _ = pair(*ALIKE[what])
    assert list(versions.differences(60.0, STEPS)) == []
    assert versions.explored.equivalent
    assert versions.explored.states > 1


NAMES = {
    "a number of attempts": "it does not go on with turn when turn fails with no_response",
    "a time-out": "it fails with timed_out after 10 s",
    "an input": "tried is given its angle",
    "a pause": "it goes on with say after 5 s",
    "a code": "it fails with mine",
    "a clean-up": "it goes on with say",
    "the order": "say is given its text",
}
"""The same differences -> how a scenario is called that shows them, up to which code a skill fails with."""


@pytest.mark.parametrize("what", NAMES)
def test_a_scenario_is_called_by_what_the_first_version_does(pair, what: str):
    versions, _ = pair(*APART[what])
    way = next(versions.differences(60.0, STEPS))
    name = name_of(versions.last_step(way))
    assert name.split(" when ")[0] == NAMES[what].split(" when ")[0]


def test_texts_are_told_apart_where_they_are_said_and_read_like_words(pair):
    ask = "      - wait_for_answer: {}\n        out: {answer: a}\n"
    tree = f"  sequence:\n{ask}{ask.replace('answer: a', 'answer: b')}      - say: {{text: $a}}"
    versions, verifier = pair(tree, "text: $a", "text: $b")
    way = next(versions.differences(60.0, STEPS))
    draft = draft_of(versions, way, verifier.library.get("tried"), versions.declarations)
    assert draft is not None
    assert (
        "answer=this" in draft.skills["wait_for_answer"] and "answer=that" in draft.skills["wait_for_answer"]
    )


def test_what_was_not_explored_to_the_end_is_not_equivalent(pair):
    versions, _ = pair(*ALIKE["two keys are set"])
    assert list(versions.differences(60.0, 2)) == []
    assert not versions.explored.complete
    assert not versions.explored.equivalent


@pytest.mark.parametrize("name", ["goto_room", "stand_before", "go_home", "look_again"])
def test_a_shipped_mission_does_what_it_does(name: str):
    library = MissionLibrary.load([])
    verifier = Verifier(library, all_declarations())
    versions = Pair(verifier, verifier.with_changed(library, [name]), name)
    assert list(versions.differences(60.0, STEPS)) == []
    assert versions.explored.equivalent
