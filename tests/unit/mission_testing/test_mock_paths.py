"""Patterns of paths: what they match, which of two wins, and what a wrong one is told."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from florence_bt.core.errors import ConfigError
from florence_bt.mission_testing.paths import (
    all_declarations,
    closest_paths,
    made_up_node,
    map_mission,
    matching,
    read_pattern,
)
from florence_bt.trees.language.loader import MissionLibrary

LAST = "stop before them"


@pytest.fixture(scope="module")
def goto_user():
    library = MissionLibrary.load()
    return map_mission(library.get("goto_user"), library, all_declarations())


@pytest.mark.parametrize(
    ("pattern", "count"),
    [
        ("navigate_to", 5),
        ("navigate to", 5),
        ("Navigate_To", 5),
        ("approach_user/**/navigate_to", 3),
        (f"{LAST}/**/navigate_to", 1),
        ("make sure from nearby/**/navigate_to", 1),
        ("goto_user/**/navigate_to", 5),
        ("/goto_user/**/navigate_to", 5),
        ("/navigate_to", 0),
        ("run approach_user/**/navigate to", 3),
        (f"{LAST}/**/navigate to", 1),
        ("approach_user/navigate_to", 0),
        ("detect_user/**/turn", 5),
        ("turn and look/turn", 0),  # the guard of the turn is between
        ("turn and look/**/turn", 5),
        ("look round/**/turn", 2),
        ("watch out on the way/*", 1),
        ("look */**/look_for_user", 10),
        ("turn and look/*_tracker", 10),
        ("search in a circle/stop_tracker", 5),
        ("goto_user/*", 2),
        ("**/**/turn", 10),
        ("*tracker", 23),
        ("approach_user/**", 27),
        ("make sure from nearby/**", 16),
        ("get_user_rom", 0),
    ],
)
def test_what_a_pattern_matches(goto_user, pattern, count):
    assert len(matching(pattern, goto_user.uses())) == count


def test_everything_is_matched_by_two_stars(goto_user):
    assert matching("**", goto_user.uses()) == goto_user.uses() == matching("*", goto_user.uses())


def test_the_short_form_of_a_path_is_a_pattern_for_it_alone(goto_user):
    for node in goto_user.nodes.values():
        assert matching(node.short, goto_user.nodes.values()) == [node]


def test_a_mission_whose_tree_has_a_name_of_its_own_can_be_named_too():
    library = MissionLibrary.load()
    places = map_mission(library.get("detect_user"), library, all_declarations()).uses()
    assert len(matching("detect_user/**/turn", places)) == 1
    assert len(matching("/detect_user/search in a circle/**/turn", places)) == 1
    assert len(matching("search in a circle/**/turn", places)) == 1


def test_the_pattern_that_says_more_has_the_higher_rank():
    ordered = ["**", "*", "*_to", "navigate_to", "**/a/navigate_to", "approach_user/**/navigate_to"]
    ranks = [read_pattern(text).rank for text in ordered]
    assert ranks == sorted(ranks)
    assert read_pattern("navigate_to").rank == read_pattern("**/navigate_to").rank


def test_a_wrong_pattern_is_told_the_closest_paths(goto_user):
    nearby, last = closest_paths("aproach_user/**/navigat_to", goto_user.uses())[:2]
    assert nearby == "make sure from nearby/**/navigate_to" and last.endswith("/navigate_to")
    assert closest_paths("face it nearby/drive to before", goto_user.uses())[0] == "drive to before it"
    assert closest_paths("get_user_rom", goto_user.uses())[0] == "get_user_room"
    assert closest_paths("**", goto_user.uses())


@pytest.mark.parametrize("text", ["", "/", "a//b", "a/ /b", "  "])
def test_what_is_no_pattern(text):
    with pytest.raises(ConfigError, match="pattern of paths"):
        read_pattern(text)


names = st.lists(st.sampled_from(["a", "b", "c d"]), min_size=1, max_size=6)


@given(names, st.lists(st.sampled_from(["a", "b", "c_d", "*", "**"]), min_size=1, max_size=6))
def test_matching_is_that_of_a_plain_reference(path, pattern):
    def reference(parts, rest):
        if not parts:
            return not rest
        if parts[0] == "**":
            return any(reference(parts[1:], rest[n:]) for n in range(len(rest) + 1))
        return bool(rest) and parts[0].replace("_", " ") in ("*", rest[0]) and reference(parts[1:], rest[1:])

    text = "/" + "/".join(pattern)
    assert read_pattern(text).matches(made_up_node("/".join(path))) == reference(pattern, path)
    assert read_pattern(text[1:]).matches(made_up_node("/".join(path))) == reference(["**", *pattern], path)
