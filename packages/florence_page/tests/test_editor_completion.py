"""Which words the editor offers where, and where a node of the palette goes."""

from __future__ import annotations

import time

import pytest
from florence_page.editor.completion import complete, insertion, keys_in
from florence_page.editor.looking import look_at
from florence_page.editor.words import TEMPLATES, words_of

from florence_bt.core.paths import find_data


@pytest.fixture(scope="module")
def words():
    return words_of([], find_data("hotspots", "flat.yaml"))


HEAD = "mission: tea\ninputs:\n  room: {type: text}\nkeys:\n  goal: {type: pose}\ntree:\n  "


@pytest.mark.parametrize(
    ("text", "offered", "not_offered"),
    [
        ("mis|", "mission", "sequence"),
        ("mission: tea\n|", "tree", "mission"),
        ("mission: tea\non_restart: re|", "resume", "abort"),
        ("inputs:\n  room:\n    |", "type", "wait"),
        ("inputs:\n  room: {type: len|", "length", "angle"),
        ("keys:\n  far:\n    type: length\n    default: 0.5 |", "0.5 cm", "0.5 s"),
        (HEAD + "seq|", "sequence", "tree"),
        (HEAD + "sequence:\n    - navi|", "navigate_to", "goto_room"),
        (HEAD + "sequence:\n    - navigate_to:\n        |", "goal", "out"),
        (HEAD + "sequence:\n    - navigate_to: {goal: $goal}\n      |", "out", "then"),
        (HEAD + "sequence:\n    - navigate_to: {goal: $|", "$goal", "$tea"),
        (HEAD + "sequence:\n    - get_hotspot: {label: k|", "kitchen", "bedroom"),
        (HEAD + "sequence:\n    - get_hotspot:\n        label: $room\n      out: {|", "pose", "label"),
        (HEAD + "sequence:\n    - wait: 5|", "5 min", "5 m"),
        (HEAD + "run: go|", "goto_room", "go"),
        (HEAD + "run: goto_room\n  with: {|", "room", "goal"),
        (HEAD + "run: goto_room\n  with:\n    |", "room", "sequence"),
        (HEAD + "run: goto_room\n  on_failure:\n    |", "unreachable", "sequence"),
        (HEAD + "retry: 3\n  on: [no_p|", "no_path", "blocked"),
        (HEAD + "retry: 3\n  |", "do", "then"),
        ("properties:\n  - |", "always_before", "eventually"),
        ("properties:\n  - after: say fails\n    |", "eventually", "never"),
        ("properties:\n  - never: say\n    |", "because", "within"),
        ("properties:\n  - after: say\n    within: 5 |", "5 min", "5 m"),
        ("properties:\n  - never: say while t|\ntree:\n  turn:\n", "turn", "navigate_to"),
        ("properties:\n  - never: say while $r|\n" + HEAD, "$room", "turn"),
        ("properties:\n  - at_most: {t|\ntree:\n  turn:\n", "turn", "navigate_to"),
        ("properties:\n  - always_before: {turn: s|\ntree:\n  say:\n", "say", "turn"),
        (HEAD + "parallel:\n    - wait: 1 s\n  policy: a|", "any", "abort"),
    ],
)
def test_what_fits_at_a_place_is_offered(words, text, offered, not_offered):
    before = text[: text.index("|")]
    answer = complete(text.replace("|", ""), before.count("\n") + 1, len(before) - before.rfind("\n"), words)
    labels = [each["label"] for each in answer["options"]]
    assert offered in labels and not_offered not in labels


def test_what_is_typed_already_is_replaced(words):
    text = "tree:\n  sequence:\n    - navi"
    answer = complete(text, 3, 11, words)
    assert text.split("\n")[2][answer["from"] - 1 :] == "navi"


@pytest.mark.parametrize(
    "text",
    ["", "{" * 50_000, "- " * 40_000, "a:\n" * 30_000 + "  b", '"' * 9, "\t\ud800: ${"],
    ids=["nothing", "braces", "dashes", "keys", "quotes", "surrogate"],
)
def test_any_text_gets_an_answer(words, text):
    lines = text.split("\n")
    for line, column in ((len(lines), len(lines[-1]) + 1), (1, 1), (10**6, 10**6)):
        assert complete(text, line, column, words)["from"] <= 10**6
    insertion(text, len(lines), "- wait: 1 s")


def test_keys_come_from_all_places_that_name_one():
    text = HEAD + "for_each: $rooms\n  as: one\n  do:\n    get_user_room:\n    out: {room: where}\n"
    assert set(keys_in(text)) >= {"room", "goal", "rooms", "one", "where"}


@pytest.mark.parametrize("template", TEMPLATES)
def test_every_template_is_a_mission_without_a_finding(template):
    look = look_at(TEMPLATES[template][1].format(name="tea"), "tea", [], None)
    assert look["fits"] and look["findings"] == []


def test_every_node_of_the_palette_goes_into_a_list_and_can_be_read(words):
    text = "mission: tea\ntree:\n  sequence:\n    - wait: 1 s"
    items = [
        *words["node_kinds"].values(),
        *(each["snippet"] for group in ("skills", "missions") for each in words[group].values()),
    ]
    for item in items:
        after, lines = insertion(text, 4, item)
        assert after == 4
        above = text.split("\n")
        text = "\n".join([*above[:after], lines, *above[after:]])
    outline = look_at(text, "tea", [], None)["outline"]
    assert sum(row["depth"] == 1 for row in outline) == len(items) + 1


def test_a_node_goes_behind_the_whole_item_of_the_cursor():
    text = "tree:\n  sequence:\n    - run: goto_room\n      with: {room: $room}\n    - wait: 1 s"
    assert insertion(text, 3, "- wait: 2 s") == (4, "    - wait: 2 s")
    assert insertion(text, 2, "- wait: 2 s") == (2, "    - wait: 2 s")
    assert insertion("tree:\n  sequence:", 2, "- wait: 2 s") == (2, "    - wait: 2 s")
    spaced = "tree:\n  sequence:\n    - if: $a\n      then:\n\n        wait: 1 s\n\n    - wait: 1 s\n\n"
    assert insertion(spaced, 3, "- wait: 2 s") == (6, "    - wait: 2 s")
    assert insertion(spaced, 8, "- wait: 2 s") == (8, "    - wait: 2 s")


@pytest.mark.parametrize(
    ("text", "column"),
    [("{a: {" + "a" * 99_000, 99_000), ("out: {" * 16_000 + "\nwait: $", 8), ("wait: $" + "$" * 90_000, 9)],
)
def test_a_text_that_is_meant_to_hurt_is_soon_done_with(words, text, column):
    begin = time.process_time()
    complete(text, text.count("\n") + 1, column, words)
    keys_in(text)
    assert time.process_time() - begin < 1.0, "nobody else is served meanwhile"
