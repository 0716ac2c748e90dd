"""Mistakes that people make: each is told once, in its place, with what would have worked."""

from __future__ import annotations

from pathlib import Path

import pytest

from florence_bt.wiring.checking import check_files

HEAD = "mission: example\ntree:\n"

MISTAKES = {
    # name: (the file, what the check says: "line:column message | the first thing that would have worked")
    "a colon in a text": (
        "mission: example\ndescription: Look: then go\ntree: {wait: 1 s}\n",
        '2:18 not YAML: a text with a colon needs quotes | description: "Look: then go"',
    ),
    "quotes that end too soon": (
        HEAD + "  fail: 'it's over'\n",
        "3:13 not YAML: the text goes on after its closing quote"
        ' | quotes round the whole value: "it\'s over"',
    ),
    "quotes that never end": (
        HEAD + '  fail: "nobody\n',
        "3:16 not YAML: a quote is not closed | a closing quote",
    ),
    "a missing colon": (
        HEAD + "  sequence\n    - wait: 1 s\n",
        "4:11 not YAML: a colon is missing in line 3 | sequence:",
    ),
    "one space too many": (
        HEAD + "  sequence:\n    - turn:\n        angle: 45 deg\n       time_allowance: 3 s\n",
        "6:8 not YAML: this line does not fit those above it (begun in line 4)"
        " | 6 spaces before it, as in line 4",
    ),
    "do below retry": (
        HEAD + "  retry: 3\n    do:\n      look_for_user: {}\n",
        "4:7 not YAML: this line is indented deeper than line 3, which has a value already"
        " | 2 spaces before it, as in line 3",
    ),
    "a dash in another column": (
        HEAD + "  sequence:\n    - wait: 1 s\n   - wait: 2 s\n",
        "5:4 not YAML: this line does not fit those above it (begun in line 3)"
        " | 2 spaces before it, as in line 3",
    ),
    "a tab behind a dash": (HEAD + "  sequence:\n    -\twait: 1 s\n", "4:6 not YAML: a tab | spaces"),
    "a sign that YAML keeps": (
        "mission: example\ndescription: @home\ntree: {wait: 1 s}\n",
        '2:14 not YAML: this character cannot begin a value | description: "@home"',
    ),
    "an open brace": (
        HEAD + "  turn: {angle: 45 deg\n",
        "3:23 not YAML: the { before is not closed, or a comma is missing | a } where it ends",
    ),
    "an expression without quotes": (
        HEAD + "  turn: {angle: ${45 deg * 2}}\n",
        '3:18 not YAML: ${...} needs quotes between { and } | quotes round it: "${...}"',
    ),
    "no colon behind wait": (
        HEAD + "  sequence:\n    - wait 1 s\n",
        "4:7 'wait 1 s' is no node: a node is a name, a colon and a space | wait: 1 s",
    ),
    "no space behind a dash": (
        HEAD + "  sequence:\n    -wait: 1 s\n    -turn: {angle: 45 deg}\n",
        "4:5 sequence needs a list of nodes | a space behind the dash: - wait: ...",
    ),
    "no dashes": (
        HEAD + "  sequence:\n    turn: {angle: 45 deg}\n    wait: 1 s\n",
        "4:5 sequence needs a list of nodes | a dash before each node: - turn: ...",
    ),
    "a list as the tree": (
        HEAD + "  - wait: 1 s\n  - wait: 2 s\n",
        "3:3 one node is needed here, not a list | sequence: with the list below it",
    ),
    "no tree": (
        "mission: example\nsequence:\n  - wait: 1 s\n",
        "2:1 unknown key of a mission 'sequence' | tree: with sequence below it",
    ),
    "capitals": ("Mission: example\ntree: {wait: 1 s}\n", "1:1 unknown key of a mission 'Mission' | mission"),
    "an input without a table": (
        "mission: example\ninputs:\n  c: text\ntree: {fail: $c}\n",
        "3:3 an input is a table with its type | c: {type: text}",
    ),
    "a type of another language": (
        "mission: example\ninputs:\n  c: {type: string}\ntree: {fail: $c}\n",
        "3:13 the type of 'c' cannot be 'string' | text",
    ),
    "a misspelt type key": (
        "mission: example\ninputs:\n  c: {typ: text}\ntree: {fail: $c}\n",
        "3:7 unknown key of 'c' 'typ' | type",
    ),
    "a comma in a number": (HEAD + "  wait: 1,5 s\n", "3:9 wait: a duration is needed, not '1,5 s' | 1.5 s"),
    "times and do below retry": (
        HEAD + "  retry:\n    times: 3\n    do: {look_for_user: {}}\n",
        "3:3 a single value is needed behind retry; `do` has the same indentation as retry | retry: 3",
    ),
    "a decorator without do": (
        HEAD + "  retry: 3\n  look_for_user: {}\n",
        "4:3 a node has exactly one kind, not 'retry' and 'look_for_user' | do: with look_for_user below it",
    ),
    "elif": (
        HEAD + "  if: {robot_in_room: {room: hall}}\n  then: {wait: 1 s}\n  elif: {wait: 2 s}\n",
        "5:3 a node has exactly one kind, not 'if' and 'elif' | else",
    ),
    "all of an if below it": (
        HEAD + "  if:\n    condition: 1 < 2\n    then: {wait: 1 s}\n",
        "4:5 what is to be done stands in the condition of the if | then: indented like if",
    ),
    "inputs beside run": (
        HEAD + "  run: goto_room\n  room: kitchen\n",
        "4:3 a node has exactly one kind, not 'run' and 'room' | with: {room: kitchen}",
    ),
    "inputs below run": (
        HEAD + "  run: {goto_room: {room: kitchen}}\n",
        "3:8 run needs the name of a mission, not a table | run: goto_room",
    ),
    "a misspelt policy": (
        HEAD + "  parallel:\n    - wait: 1 s\n    - look_for_user: {}\n  policy: {success: 1}\n",
        "6:12 unknown key of a policy 'success' | succeed",
    ),
    "a pose as a list": (
        HEAD + "  navigate_to: {goal: [1, 2, 90]}\n",
        "3:23 'goal' cannot be a list | {x: 1 m, y: 2 m, yaw: 90 deg}",
    ),
    "a pose in parentheses": (
        HEAD + "  navigate_to: {goal: (1 m, 2 m, 90 deg)}\n",
        "3:23 'goal': a text with commas needs quotes here, and a pose is a table"
        " | {x: 1 m, y: 2 m, yaw: 90 deg}",
    ),
    "another name for yaw": (
        HEAD + "  navigate_to: {goal: {x: 1 m, y: 2 m, theta: 90 deg}}\n",
        "3:40 unknown part of a pose 'theta' | yaw",
    ),
    "a key without its dollar": (
        HEAD + "  sequence:\n    - get_robot_pose:\n      out: {pose: here}\n"
        "    - navigate_to: {goal: here}\n    - navigate_to: {goal: $here}\n",
        "6:27 goal: a pose is needed, not 'here' | $here",
    ),
    "a part of a pose without braces": (
        HEAD + "  sequence:\n    - get_robot_pose:\n      out: {pose: here}\n"
        "    - set: {y: $here.y}\n    - fail: at $y\n",
        "6:16 y: $here.y is a text here: the whole pose, then '.y' | ${$here.y}",
    ),
    "a key that is read too early": (
        HEAD + "  sequence:\n    - set_user_position: {user: $user}\n    - look_for_user: {}\n"
        "      out: {user: user}\n",
        "4:33 the key 'user' is read before any node has written it | the node of line 6 before this one",
    ),
    "a broken node that writes a key": (
        HEAD + "  sequence:\n    - look_for_user: {}\n      turn: {angle: 45 deg}\n      out: {user: user}\n"
        "    - set_user_position: {user: $user}\n",
        "5:7 a node has exactly one kind, not 'look_for_user' and 'turn'"
        " | a dash before each of them in a list",
    ),
}


@pytest.mark.parametrize("name", MISTAKES)
def test_a_mistake_is_told_once_with_what_would_have_worked(tmp_path: Path, name: str) -> None:
    text, said = MISTAKES[name]
    file = tmp_path / "example.yaml"
    file.write_text(text)
    report, _ = check_files([file])
    lines = report.replace(f"{file}:", "").splitlines()
    found = [line for line in lines[:-1] if not line.startswith(" ")]
    worked = [line.partition("would have worked: ")[2] for line in lines if "would have worked: " in line]
    assert len(found) == 1, report
    message, _, valid = said.partition(" | ")
    place, _, problem = message.partition(" ")
    assert found[0] in (f"{place}: error: {problem}", f"{place}: warning: {problem}")
    assert worked[0] == valid or worked[0].startswith(f"{valid}, ")
