"""What the check says of comparisons with texts that never come, and of divisors that may be 0."""

# ruff: noqa: E501  (missions on one line)

import pytest

from florence_bt.core.declaration import Kind, Port, SkillDeclaration

DOOR = Port(Kind.TEXT, "", choices=("open", "shut"))
ASK = SkillDeclaration("ask_door", "Ask", {}, {"door": DOOR, "word": Port(Kind.TEXT, "")}, {})
ASKED = "{ask_door: , out: {door: door, word: word}}"


@pytest.fixture
def lines_of(workshop):
    workshop.declarations = {**workshop.declarations, ASK.name: ASK}
    return workshop.lines


@pytest.mark.parametrize(
    ("condition", "never"),
    [
        ('$door == "shut"', ""),
        ('$door == "shutt"', "shutt"),
        ('"Shut" != $door', "Shut"),
        ('$door in ["open", "ajar"]', "ajar"),
        ('$word == "shutt"', ""),
        ("$door == $word", ""),
    ],
)
def test_a_text_that_a_skill_never_gives(lines_of, condition, never):
    found = [
        each
        for each in lines_of(f"tree: {{sequence: [{ASKED}, {{condition: '{condition}'}}]}}\n")
        if "never" in each
    ]
    assert bool(found) == bool(never) and all(
        f"error condition: $door is never '{never}'" in each for each in found
    )


@pytest.mark.parametrize(
    ("before", "known"),
    [
        ("{set: {door: ajar}}", True),
        ('{set: {door: "$word"}}', False),
        ("{append: {door: x}}", False),
    ],
)
def test_all_that_write_a_key_count(lines_of, before, known):
    tree = f"tree: {{sequence: [{ASKED}, {before}, {{condition: '$door == \"closed\"'}}, {{condition: '$door == \"ajar\"'}}]}}\n"
    found = [each for each in lines_of(tree) if "never" in each]
    assert len(found) == known and all("'closed'" in each for each in found)


def test_numbers_are_no_texts(lines_of):
    tree = "tree: {sequence: [{set: {n: 1}}, {condition: $n == 3}]}\n"
    assert not [each for each in lines_of(tree) if "never" in each]


def test_an_input_can_be_any_text_and_a_key_is_what_it_begins_with(lines_of):
    head = "inputs: {word: {type: text}}\nkeys: {mode: {type: text, default: slow}}\n"
    tree = 'tree: {sequence: [{condition: \'$word == "x"\'}, {set: {mode: fast}}, {condition: \'$mode in ["slow", "fast", "stop"]\'}]}\n'
    [found] = lines_of(head + tree)
    assert "error condition: $mode is never 'stop' | " in found


def test_the_outputs_of_a_called_mission_and_the_cases_of_a_switch(lines_of, workshop):
    workshop.write(f"outputs: {{door: {{type: text}}}}\ntree: {{sequence: [{ASKED}]}}\n", "look")
    found = lines_of(
        "tree: {sequence: [{run: look, out: {door: seen}}, {switch: $seen, cases: {open: {wait: 1 s}, closed: {wait: 2 s}}, default: {wait: 3 s}}]}\n"
    )
    assert len(found) == 1 and "'closed' is none of its choices" in found[0]


@pytest.mark.parametrize(
    ("limits", "divisor", "doubted"),
    [
        ("min: 1", "$n", False),
        ("min: 1", "($n - 1)", True),
        ("min: 2", "($n - 1)", False),
        ("min: 1, max: 5", "(6 - $n)", False),
        ("min: 1, max: 6", "(6 - $n)", True),
        ("max: -1", "$n", False),
        ("description: any", "$n", True),
        ("min: 1", "($n * 2 + 1)", False),
        ("description: any", "$k", False),
    ],
)
def test_a_divisor_that_an_input_may_make_0(lines_of, limits, divisor, doubted):
    head = f"inputs: {{n: {{type: integer, {limits}}}}}\nkeys: {{k: {{type: integer, default: 0}}}}\n"
    found = lines_of(f"{head}tree: {{turn: {{angle: '${{360 deg / {divisor}}}'}}}}\n")
    assert bool([each for each in found if " warning angle: " in each and "can be 0" in each]) == doubted, (
        found
    )


def test_who_compares_the_divisor_is_trusted(lines_of):
    head = "inputs: {n: {type: integer}}\n"
    found = lines_of(f"{head}tree: {{condition: '$n > 0 and 6 / $n > 2'}}\n")
    assert not [each for each in found if "can be 0" in each]
