"""Small changes of missions: of every kind of node and modifier, each at one place, the rest as it was."""

from pathlib import Path

import pytest

from florence_bt.assurance.mutating.mission_mutations import (
    CLEAN_UP,
    CODE,
    COMPARISON,
    COUNT,
    FAMILIES,
    GUARD,
    HANDLER,
    LIMIT,
    ORDER,
    PART,
    WORD,
    WRAPPER,
    Mutation,
    mutations_of,
)
from florence_bt.core.plain_yaml import parse_yaml
from florence_bt.mission_testing.paths import all_declarations
from florence_bt.trees import kinds
from florence_bt.trees.kinds.words import MODIFIERS
from florence_bt.trees.language import vocabulary
from florence_bt.trees.language.code_groups import groups_of
from florence_bt.trees.language.loader import BUILT_IN
from tests.sweeps import sweep

EXAMPLES = Path(__file__).parents[3] / "examples"
FILES = [
    file
    for folder in (BUILT_IN, *EXAMPLES.glob("**/*missions"), EXAMPLES / "missions" / "first_steps")
    for file in sorted(folder.glob("*.yaml"))
    if "." not in file.stem
]
GROUPS = groups_of(all_declarations())
HEAD = "mission: tried\ntree:\n"

OF_KINDS = {
    "sequence": ("sequence: [{wait: 1 s}, {wait: 2 s}]", ORDER, "sequence: [{wait: 2 s}, {wait: 1 s}]"),
    "selector": ("selector: [{wait: 1 s}, {fail: no}]", ORDER, "selector: [{fail: no}, {wait: 1 s}]"),
    "parallel": ("parallel: [{wait: 1 s}]\n  policy: all", WORD, "parallel: [{wait: 1 s}]\n  policy: any"),
    "if": ("if: $a < 1\n  then: {wait: 1 s}", COMPARISON, "if: $a <= 1\n  then: {wait: 1 s}"),
    "switch": ("switch: $a\n  cases: {x: {wait: 1 s}}", LIMIT, "switch: $a\n  cases: {x: {wait: 1.1 s}}"),
    "for_each": (
        "for_each: $a\n  as: b\n  do: {wait: 1 s}",
        LIMIT,
        "for_each: $a\n  as: b\n  do: {wait: 1.1 s}",
    ),
    "retry": ("retry: 3\n  do: {fail: no}", COUNT, "retry: 4\n  do: {fail: no}"),
    "repeat": ("repeat: 3\n  do: {wait: 1 s}", COUNT, "repeat: 2\n  do: {wait: 1 s}"),
    "timeout": ("timeout: 1 min\n  do: {wait: 1 s}", WRAPPER, "{wait: 1 s}"),
    "once": ("once: {wait: 1 s}", WRAPPER, "{wait: 1 s}"),
    "invert": ("invert:\n    wait: 1 s", WRAPPER, "wait: 1 s"),
    "succeed": ("succeed: {fail: no}", WRAPPER, "{fail: no}"),
    "condition": ("condition: $a and not $b", COMPARISON, "condition: $a and $b"),
    "fail": ("fail: no\n  code: mine", CODE, "fail: no\n  code: some_other_failure"),
    "wait": ("wait: 2.5 s", LIMIT, "wait: 2.75 s"),
    "wait_until": ("wait_until: $a >= 2 m", COMPARISON, "wait_until: $a > 2 m"),
    "set": ("set: {a: 3}", COUNT, "set: {a: 2}"),
    "add": ('add: {a: "${$b == 1}"}', COMPARISON, 'add: {a: "${$b != 1}"}'),
    "append": ("append: {a: 3 m}", LIMIT, "append: {a: 3.3 m}"),
    "run": ("run: goto_user\n  with: {distance: 50 cm}", LIMIT, "run: goto_user\n  with: {distance: 55 cm}"),
    "skill": ("turn: {angle: -90 deg}", LIMIT, "turn: {angle: -99 deg}"),
    "interrupted_by": ("wait: 1 s\n  interrupted_by: {if: $a, do: {wait: 2 s}}", GUARD, "wait: 1 s"),
    "until": ("wait: 1 s\n  until: $a", GUARD, "wait: 1 s"),
    "on_failure": (
        "fail: no\n  on_failure: {battery: {wait: 1 s}, any: {wait: 2 s}}",
        HANDLER,
        "fail: no\n  on_failure: {any: {wait: 2 s}}",
    ),
    "ensure": ("wait: 1 s\n  ensure: $a", GUARD, "wait: 1 s"),
}
"""Kind of node -> a node of it, a kind of change, and what it makes of the node."""
OF_MODIFIERS = {
    "when": ("wait: 1 s\n  when: $a", GUARD, "wait: 1 s"),
    "while": ("while: $a\n  wait: 1 s", GUARD, "wait: 1 s"),
    "finally": ("wait: 1 s\n  finally:\n    stop_tracker:\n", CLEAN_UP, "wait: 1 s"),
    "memory": ("sequence: [{wait: 1 s}]\n  memory: false", WORD, "sequence: [{wait: 1 s}]\n  memory: true"),
    "policy": ("parallel: [{wait: 1 s}]\n  policy: [a]", PART, "parallel: [{wait: 1 s}]"),
    "else": ("if: $a\n  then: {wait: 1 s}\n  else: {fail: no}", PART, "if: $a\n  then: {wait: 1 s}"),
    "default": ("switch: $a\n  cases: {}\n  default: {fail: no}", PART, "switch: $a\n  cases: {}"),
    "go_on_over": ("for_each: $a\n  go_on_over: [battery]", PART, "for_each: $a"),
    "first_success": ("for_each: $a\n  first_success: true", WORD, "for_each: $a\n  first_success: false"),
    "code": ("condition: $a\n  code: mine", CODE, "condition: $a\n  code: some_other_failure"),
    "on": ("retry: $a\n  on: [no_path, blocked]", CODE, "retry: $a\n  on: [blocked]"),
    "between": ("retry: $a\n  between: {wait: 1 s}", PART, "retry: $a"),
    "every": ("robot_in_room: {}\n  every: 2 s", PART, "robot_in_room: {}"),
}
"""Modifier -> the same for it."""
NO_CHANGE = {"do", "then", "cases", "with", "out", "as", "index", "attempt", "name", "because"}
"""Modifiers that name something, or without which there is no such node; what is below them is changed."""


def changes(tree: str) -> list[Mutation]:
    return mutations_of(f"{HEAD}  {tree}\n", GROUPS)


@pytest.mark.parametrize("word", [*OF_KINDS, *OF_MODIFIERS])
def test_a_change_of_each_kind_and_modifier(word: str):
    tree, family, wanted = {**OF_KINDS, **OF_MODIFIERS}[word]
    made = [each.text.removeprefix(HEAD).strip() for each in changes(tree) if each.family == family]
    assert wanted in made


def test_no_kind_and_no_modifier_is_forgotten():
    assert OF_KINDS.keys() == {node.kind.word for node in kinds.ALL}
    of_kinds = {node.kind.word for node in kinds.OF_MODIFIERS.values()}
    assert OF_MODIFIERS.keys() == {*vocabulary.ANYWHERE, *MODIFIERS} - NO_CHANGE - of_kinds


def test_each_kind_of_change_is_made_and_is_explained():
    made = {
        each.family for tree, *_ in (*OF_KINDS.values(), *OF_MODIFIERS.values()) for each in changes(tree)
    }
    assert made == FAMILIES.keys()


@pytest.mark.parametrize("file", sweep(FILES, every=4), ids=lambda file: file.stem)
def test_comments_stay_and_the_text_stays_yaml(file: Path):
    text = file.read_text(encoding="utf-8")
    comments = sorted(line.strip() for line in text.splitlines() if line.strip().startswith("#"))
    mutations = mutations_of(text, GROUPS)
    for each in mutations:
        assert parse_yaml(each.text.encode(), file)
        kept = sorted(line.strip() for line in each.text.splitlines() if line.strip().startswith("#"))
        assert kept == comments or set(comments) - set(kept) <= comments_in_dropped_part(text, each), each
    assert len({each.text for each in mutations}) == len(mutations)
    assert text not in {each.text for each in mutations}


def comments_in_dropped_part(text: str, change: Mutation) -> set[str]:
    """What stands within a part that is left out goes with it."""
    if change.family not in (GUARD, CLEAN_UP, HANDLER, PART, WRAPPER):
        return set()
    kept = change.text.splitlines()
    return {line.strip() for line in text.splitlines() if line not in kept and line.strip().startswith("#")}


def test_the_line_is_where_the_change_begins():
    [change] = [
        each for each in changes("wait: 1 s\n  # A comment.\n  when: $a  # and one") if each.family == GUARD
    ]
    assert change.line == 5
    assert change.text == f"{HEAD}  wait: 1 s\n  # A comment.\n"


def test_a_group_becomes_one_of_its_codes_and_a_code_any():
    texts = [each.text for each in changes("fail: no\n  on_failure: {unreachable: {wait: 1 s}}")]
    first = min(GROUPS["unreachable"].codes)
    assert any(f"on_failure: {{{first}: " in text for text in texts)
    texts = [each.text for each in changes("fail: no\n  on_failure: {no_path: {wait: 1 s}}")]
    assert any("on_failure: {any: " in text for text in texts)


def test_texts_and_names_are_left_as_they_are():
    assert changes("say: {text: wait 3 s and not more}\n  name: 3 s") == []


def test_the_first_word_after_a_dash_can_go():
    tree = "sequence:\n    - when: $a\n      wait: 1 s\n    - wait: 2 s"
    texts = [each.text for each in changes(tree) if each.family == GUARD]
    assert texts == [f"{HEAD}  sequence:\n    - wait: 1 s\n    - wait: 2 s\n"]
