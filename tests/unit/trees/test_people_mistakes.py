"""Mistakes that people make: each is told once, in its place, with what would have worked."""

from __future__ import annotations

from pathlib import Path

import pytest

from florence_bt.app.mission_files.checking import check_files

HEAD = "mission: example\ntree:\n"

NO_SPACE = "looks like a space and is none outside quotes | a plain space"

MISTAKES = {
    # name: (the file, what the check says: "line:column message | the first thing that would have worked")
    "a colon in a text": (
        "mission: example\ndescription: Look: then go\ntree: {wait: 1 s}\n",
        '2:18 not YAML: text with a colon needs quotes | description: "Look: then go"',
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
    "a missing colon in the last line of a node": (
        HEAD + "  sequence:\n    - wait: 1 s\n      finally\n    - wait: 2 s\n",
        "5:14 not YAML: a colon is missing | finally:",
    ),
    "text that begins with a bracket": (
        "mission: example\ndescription: [draft] a round\ntree: {wait: 1 s}\n",
        "2:22 not YAML: the line goes on after the closing ]"
        ' | nothing after it, if it is text: description: "[draft] a round"',
    ),
    "a text that goes on after its quotes": (
        'mission: example\ndescription: "my" example\ntree: {wait: 1 s}\n',
        "2:19 not YAML: the text goes on after its closing quote"
        " | quotes round the whole value: '\"my\" example'",
    ),
    "a brace too many": (
        HEAD + "  turn: {angle: 45 deg}}\n",
        "3:24 not YAML: a } too many | the line without it",
    ),
    "a list in the line of its key": (
        HEAD + "  sequence: - wait: 1 s\n",
        "3:13 not YAML: a list cannot begin here | each dash on a line of its own",
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
        "4:7 'wait 1 s' is not a node: a node is a name, a colon and a space | wait: 1 s",
    ),
    "no space behind a dash": (
        HEAD + "  sequence:\n    -wait: 1 s\n    -turn: {angle: 45 deg}\n",
        "4:5 sequence needs a list of nodes | a space after the dash: - wait: ...",
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
        "3:3 an input is a mapping with its type | c: {type: text}",
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
        "3:3 a single value is needed after retry; `do` has the same indentation as retry | retry: 3",
    ),
    "a decorator without do": (
        HEAD + "  retry: 3\n  look_for_user: {}\n",
        "4:3 a node has exactly one kind, not 'retry' and 'look_for_user' | do: with look_for_user below it",
    ),
    "elif": (
        HEAD + "  if: {robot_in_room: {room: hall}}\n  then: {wait: 1 s}\n  elif: {wait: 2 s}\n",
        "5:3 a node has exactly one kind, not 'if' and 'elif' | else: {if: ..., then: ...}",
    ),
    "all of an if below it": (
        HEAD + "  if:\n    condition: 1 < 2\n    then: {wait: 1 s}\n",
        "4:5 the branch is inside the condition of the if | then: indented like if",
    ),
    "inputs beside run": (
        HEAD + "  run: goto_room\n  room: kitchen\n",
        "4:3 a node has exactly one kind, not 'run' and 'room' | with: {room: kitchen}",
    ),
    "inputs below run": (
        HEAD + "  run: {goto_room: {room: kitchen}}\n",
        "3:8 run needs the name of a mission, not a mapping | run: goto_room",
    ),
    "a misspelt policy": (
        HEAD + "  parallel:\n    - wait: 1 s\n    - look_for_user: {}\n  policy: {success: 1}\n",
        "6:12 unknown key of a policy 'success' | succeed",
    ),
    "a pose as a list": (
        HEAD + "  navigate_to: {goal: [1, 2, 90]}\n",
        "3:23 goal: a pose is needed, not a list | {x: 1 m, y: 2 m, yaw: 90 deg}",
    ),
    "a pose in parentheses": (
        HEAD + "  navigate_to: {goal: (1 m, 2 m, 90 deg)}\n",
        "3:23 'goal': text with commas needs quotes here, and a pose is a mapping"
        " | {x: 1 m, y: 2 m, yaw: 90 deg}",
    ),
    "a reason that begins with a parenthesis": (
        HEAD + "  sequence:\n    - {fail: (not here), sorry}\n",
        "4:14 'fail': text with commas needs quotes here | fail: \"(not here), sorry\"",
    ),
    "a reason with a comma": (
        HEAD + "  sequence:\n    - {fail: nobody is here, sorry}\n",
        "4:14 'fail': text with commas needs quotes here | fail: \"nobody is here, sorry\"",
    ),
    "a name with commas before the kind": (
        HEAD + "  sequence:\n    - {name: here, there and everywhere, wait: 1 s}\n",
        "4:14 'name': text with commas needs quotes here | name: \"here, there and everywhere\"",
    ),
    "a text with commas in a key": (
        HEAD
        + "  sequence:\n    - set: {text: 'a', other: one, two \"or\" three, four}\n    - wait: $other\n",
        "4:31 'other': text with commas needs quotes here | other: 'one, two \"or\" three, four'",
    ),
    "a program's way to set": (
        HEAD + "  set: tries = 3\n",
        "3:8 set must be a mapping (key: value) | set: {tries: 3}",
    ),
    "a dollar before the key that is set": (
        HEAD + "  set: {$tries: 3}\n",
        "3:9 a name in set must be a name of lower-case letters, digits and underscores, not '$tries'"
        " | tries",
    ),
    "inputs behind the name of a mission": (
        HEAD + "  run: goto_room kitchen\n",
        "3:8 run must be a name of lower-case letters, digits and underscores, not 'goto_room kitchen'"
        " | run: goto_room",
    ),
    "a program's way to call": (
        HEAD + "  run: goto_room(room=kitchen)\n",
        "3:8 run must be a name of lower-case letters, digits and underscores, not 'goto_room(room=kitchen)'"
        " | run: goto_room",
    ),
    "a mission without its inputs": (
        HEAD + "  run: goto_room\n",
        "3:3 goto_room needs the input 'room' (label of the room or object) | with: {room: kitchen}",
    ),
    "a skill without its inputs": (
        HEAD + "  robot_in_room:\n",
        "3:3 robot_in_room needs the input 'room' (the label of the room) | robot_in_room: {room: kitchen}",
    ),
    "nothing to be done": (
        HEAD + "  if: 1 < 2\n  then: {wait: 1 s}\n  else: nothing\n",
        "5:9 'nothing' is not a node | wait: 0 s, which does nothing",
    ),
    "a clean-up as a step": (
        HEAD + "  sequence:\n    - wait: 1 s\n    - finally: {stop_tracker: }\n",
        "5:7 'finally' is not a node: it belongs to a node"
        " | finally without a dash, indented like the node that it belongs to",
    ),
    "a key in capitals": (
        HEAD
        + "  sequence:\n    - get_robot_pose:\n      out: {pose: here}\n    - navigate_to: {goal: $HERE}\n",
        "6:27 keys have lower-case letters, not $HERE in '$HERE' | $here",
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
        "6:16 y: $here.y is text here: the whole pose, then '.y' | ${$here.y}",
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
    "an input beside its skill": (
        HEAD + "  sequence:\n    - turn:\n      angle: 45 deg\n",
        "5:7 a node has exactly one kind, not 'turn' and 'angle' | turn: {angle: 45 deg}",
    ),
    "an input without its name": (
        HEAD + "  turn: 45 deg\n",
        "3:3 the inputs of turn must be a mapping | turn: {angle: 45 deg}",
    ),
    "the word of another language": (
        HEAD + "  fallback:\n    - wait: 1 s\n",
        "3:3 there is no skill and no kind of node 'fallback' | selector",
    ),
    "minutes and seconds": (
        HEAD + "  wait: 1 minute 30 seconds\n",
        "3:9 wait: a duration is needed, not '1 minute 30 seconds' | 90 s",
    ),
    "an hour and a half": (
        HEAD + "  wait: 1h 30\n",
        "3:9 wait: a duration is needed, not '1h 30' | 90 min",
    ),
    "the time of a clock": (
        HEAD + "  wait: 12:30\n",
        "3:9 wait: a duration is needed, not '12:30' | 12 min 30 s",
    ),
    "a clock with hours": (
        HEAD + "  wait: 01:00:05\n",
        "3:9 wait: a duration is needed, not '01:00:05' | 1 h 5 s",
    ),
    "a printed minus": (
        HEAD + "  turn: {angle: \N{MINUS SIGN}45 deg}\n",
        "3:17 angle: an angle is needed, not '\N{MINUS SIGN}45 deg' | -45 deg",
    ),
    "more than any number": (HEAD + "  wait: 1e308 h\n", "3:9 wait: '1e308 h' is too large | 30 s"),
    "no as in English": (
        HEAD + "  sequence: [wait: 1 s]\n  memory: no\n",
        "4:11 memory cannot be 'no' | false",
    ),
    "a sum that is only a text": (
        HEAD + "  sequence:\n    - set: {a: 3}\n    - set: {b: $a + 1}\n    - fail: $b\n",
        "5:16 b: '$a + 1' is text here, and nothing is computed | \"${$a + 1}\"",
    ),
    "outputs the wrong way round": (
        HEAD + "  sequence:\n    - look_for_user: {}\n      out: {person: user}\n"
        "    - set_user_position: {user: $person}\n",
        "5:13 look_for_user has no output 'person' | user: person",
    ),
    "a mission with its ending": (
        HEAD + "  run: goto_room.yaml\n  with: {room: kitchen}\n",
        "3:8 run must be a name of lower-case letters, digits and underscores, not 'goto_room.yaml'"
        " | goto_room",
    ),
    "a unit as a type": (
        "mission: example\ninputs: {a: {type: meters}}\ntree: {wait: 1 s, when: $a > 0}\n",
        "2:20 the type of 'a' cannot be 'meters' | length",
    ),
    "an output with a value": (
        "mission: example\noutputs: {a: {type: integer, default: 3}}\ntree: {set: {a: 3}}\n",
        "2:30 an output has no default | keys: {a: {default: 3, ...}}",
    ),
    "inputs with dashes": (
        "mission: example\ninputs:\n  - a: {type: length}\ntree: {wait: 1 s}\n",
        "3:3 inputs must be a mapping (key: value) | inputs: {name: ...}, without dashes",
    ),
    "braces of a template": (
        HEAD + "  wait: {{ pause }}\n",
        "3:10 a key must be a plain text | $key for the value of a key, without braces",
    ),
    "quotes of a word processor": (
        HEAD + "  sequence:\n    - set: {r: a}\n    - condition: $r == \N{LEFT DOUBLE QUOTATION MARK}a\n",
        "5:24 '\N{LEFT DOUBLE QUOTATION MARK}' is not known here | \"",
    ),
    "text that begins with a sign of YAML": (
        HEAD + "  fail: !urgent call\n",
        "3:9 the tag !urgent is not allowed | the value without a tag",
    ),
    "a comment for a text": (HEAD + "  fail: #5\n", "3:8 fail has no value | a value"),
    "a room by its short name": (
        HEAD + "  get_hotspot: {label: door}\n",
        "3:24 there is no hotspot 'door' in flat.yaml, the flat of Florence; give --hotspots FILE"
        " | front_door",
    ),
    "a colon in a text between braces": (
        HEAD + "  say: {text: Hello: I am here}\n",
        '3:20 not YAML: text with a colon needs quotes | say: {text: "Hello: I am here"}',
    ),
    "a colon and a comma in a text between braces": (
        HEAD + "  say: {text: Two things: eat, drink, allow: 3 s}\n",
        '3:25 not YAML: text with a colon needs quotes | say: {text: "Two things: eat, drink", allow: 3 s}',
    ),
    "a colon in a text with quotes between braces": (
        HEAD + '  say: {text: She said "now": go}\n',
        "3:29 not YAML: text with a colon needs quotes | say: {text: 'She said \"now\": go'}",
    ),
    "a colon in an item of a list": (
        HEAD + "  set: {l: [first: a b: c, second]}\n",
        "3:23 not YAML: text with a colon needs quotes, or a comma is missing"
        ' | set: {l: [first: "a b: c, second"]}',
    ),
    "a comma is missing between inputs": (
        HEAD + "  turn: {angle: 45 deg time_allowance: 3 s}\n",
        "3:38 not YAML: a comma is missing before 'time_allowance'"
        " | turn: {angle: 45 deg, time_allowance: 3 s}",
    ),
    "a number sign in a text between braces": (
        HEAD + "  say: {text: room #1}\n",
        '3:20 not YAML: text with # needs quotes, because a comment begins with # | say: {text: "room #1"}',
    ),
    "a number sign in a text between braces, and more lines": (
        HEAD + "  sequence:\n    - say: {text: room #1}\n    - wait: 1 s\n      name: pause\n",
        '4:24 not YAML: text with # needs quotes, because a comment begins with # | - say: {text: "room #1"}',
    ),
    "a number sign in a list": (
        HEAD + "  set: {rooms: [room #1, room #2]}\n",
        "3:22 not YAML: text with # needs quotes, because a comment begins with #"
        ' | set: {rooms: ["room #1", "room #2"]}',
    ),
    "a sign that YAML keeps for itself between braces": (
        HEAD + "  say: {text: @home}\n",
        '3:15 not YAML: text that begins with @ needs quotes | say: {text: "@home"}',
    ),
    "the inputs of a call in its line": (
        HEAD + "  run: goto_room with: {room: kitchen}\n",
        "3:22 not YAML: 'with' goes on a line of its own below 'run'"
        " | run: goto_room on this line, with: {room: kitchen} on the next, indented like run",
    ),
    "the node below a retry in its line": (
        HEAD + "  retry: 3, do: {look_for_user: }\n",
        "3:15 not YAML: 'do' goes on a line of its own below 'retry'"
        " | retry: 3 on this line, do: {look_for_user: } on the next, indented like retry",
    ),
    "the outputs of a skill in its line": (
        HEAD + "  look_for_user: {} out: {user: user}\n",
        "3:21 not YAML: 'out' goes on a line of its own below 'look_for_user'"
        " | look_for_user: {} on this line, out: {user: user} on the next, indented like look_for_user",
    ),
    "the inputs of a call between braces": (
        HEAD + "  sequence:\n    - {run: goto_room with: {room: kitchen}}\n",
        "4:27 not YAML: a comma is missing before 'with' | - {run: goto_room, with: {room: kitchen}}",
    ),
    "a no-break space behind a colon": (
        HEAD + "  wait:\u00a05 s\n",
        f"3:8 U+00A0 (no-break space) {NO_SPACE}",
    ),
    "a no-break space in the indentation": (
        HEAD + "  sequence:\n\u00a0   - wait: 5 s\n",
        f"4:1 U+00A0 (no-break space) {NO_SPACE}",
    ),
    "a no-break space behind a dash": (
        HEAD + "  sequence:\n    - wait: 1 s\n    -\u00a0wait: 5 s\n",
        f"5:6 U+00A0 (no-break space) {NO_SPACE}",
    ),
    "an em space before a unit": (
        HEAD + "  wait: 5\u2003s\n",
        f"3:10 U+2003 (em space) {NO_SPACE}",
    ),
    "a space without width in a name": (
        HEAD + "  w\u200bait: 5 s\n",
        "3:4 U+200B (zero width space) cannot be seen and is not allowed outside quotes"
        " | the text without it",
    ),
    "a byte order mark in the middle": (
        HEAD + "  \ufeffwait: 5 s\n",
        "3:3 the character U+FEFF (byte order mark) is not allowed | the text without it",
    ),
    "typographic quotes": (
        HEAD + "  turn: {angle: “45 deg”}\n",
        '3:17 the quote U+201C (left double quotation mark) is none for YAML but part of the text | "45 deg"',
    ),
    "German quotes round a text with commas": (
        HEAD + "  say: {text: „Guten Tag, Anna“}\n",
        "3:15 'text': text with commas needs quotes here | text: \"Guten Tag, Anna\"",
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


ANSWERED = HEAD + "  sequence:\n    - wait_for_answer: {}\n      out: {answer: a}\n"
COUNTED = "mission: example\nkeys: {n: {type: integer, default: 0}}\ntree:\n"
LISTED = "mission: example\nkeys: {seen: {type: list of text, default: []}}\ntree:\n"

REMEDIES = {
    # name: (the file, where the first finding is, what would have worked first)
    "a time of twelve hours": (HEAD + "  wait_until: 8 pm\n", "3:15", '"20:00"'),
    "midnight of twelve hours": (HEAD + "  wait_until: 12:30 am\n", "3:15", '"00:30"'),
    "a time with a point": (HEAD + "  wait_until: 20.15\n", "3:15", '"20:15"'),
    "a time in German": (HEAD + "  wait_until: 20 Uhr\n", "3:15", '"20:00"'),
    "a day of the week": (HEAD + "  wait_until: Monday 08:00\n", "3:15", '"08:00"'),
    "until a time": (
        HEAD + '  repeat: forever\n  do: {wait: 5 min}\n  until: "20:00"\n',
        "5:10",
        '{wait_until: "20:00"}',
    ),
    "a skill as a word": (
        HEAD + "  if: user_lying\n  then: {wait: 1 s}\n",
        "3:7",
        "$user_lying, {user_lying: }, if it is a skill",
    ),
    "a skill after condition": (
        HEAD + "  condition: {robot_in_room: {room: hall}}\n",
        "3:14",
        "robot_in_room itself, in place of condition",
    ),
    "a skill after when": (
        HEAD + "  wait: 1 s\n  when: {robot_in_room: {room: hall}}\n",
        "4:9",
        "if: {robot_in_room: ...}",
    ),
    "a skill after while": (
        HEAD + "  wait: 1 s\n  while: {battery_above: {}}\n",
        "4:10",
        "memory: false, with sequence: [{battery_above: ...}, the node]",
    ),
    "while as a loop": (COUNTED + "  while: $n < 3\n  do: {wait: 1 s}\n", "4:3", "repeat: forever"),
    "a time-out beside its node": (
        HEAD + "  run: patrol\n  timeout: 2 min\n",
        "4:3",
        "do: with run below it, beside timeout",
    ),
    "what follows a success": (
        HEAD + "  run: patrol\n  on_success: {wait: 1 s}\n",
        "4:3",
        "sequence: [the node, what follows when it succeeds]",
    ),
    "a handler in other words": (
        HEAD + "  run: patrol\n  on_error: {any: {wait: 1 s}}\n",
        "4:3",
        "on_failure",
    ),
    "a handler without a code": (
        HEAD + "  run: patrol\n  on_failure: {say: {text: Sorry}}\n",
        "4:16",
        "any: {say: ...}",
    ),
    "a clean-up at the edge": (
        HEAD + "  start_tracker:\nfinally:\n  stop_tracker:\n",
        "4:1",
        "finally below tree, indented like the node that it belongs to",
    ),
    "a schedule": (
        'mission: example\nschedule: "08:00"\ntree: {wait: 1 s}\n',
        "2:1",
        'tree: a sequence that begins with wait_until: "08:00"',
    ),
    "steps": ("mission: example\nsteps: {wait: 1 s}\n", "2:1", "tree"),
    "scenarios": ("mission: example\nscenarios:\n  - name: a\n", "1:1", "florence test example.yaml"),
    "no end of attempts": (HEAD + "  retry: infinite\n  do: {look_for_user: {}}\n", "3:10", "forever"),
    "a skill that is run": (HEAD + "  run: say\n  with: {text: Hello}\n", "3:8", "say: {text: Hello}"),
    "a mission that is near in name": (
        HEAD + "  run: goto_kitchen\n",
        "3:8",
        "goto_pose, goto_room, goto_user",
    ),
    "to speak": (HEAD + "  speak: Hello\n", "3:3", "say"),
    "to drive": (HEAD + "  drive: kitchen\n", "3:3", "run: goto_room, with: {room: ...}"),
    "a list of conditions": (
        ANSWERED + '    - if: {and: [$a == "x", $a != "y"]}\n      then: {wait: 1 s}\n',
        "6:12",
        "$near and not $done, as the expression itself",
    ),
    "a text that is greater": (ANSWERED + "    - condition: $a > 3\n", "6:18", '$a == "3"'),
    "true in quotes": (
        'mission: example\ninputs: {loud: {type: boolean}}\ntree:\n  condition: $loud == "true"\n',
        "4:20",
        "true",
    ),
    "texts that are added": (
        ANSWERED + "    - set: {b: '${$a + \"!\"}'}\n    - say: {text: $b}\n",
        "6:19",
        '"${a}!", append: {key: text}',
    ),
    "a sum without its braces": (COUNTED + "  set: {n: $n + 1}\n", "4:12", '"${$n + 1}"'),
    "one more": (COUNTED + "  set: {n: $n++}\n", "4:12", '"${$n + 1}"'),
    "a sum of a program": (COUNTED + "  set: n = n + 1\n", "4:8", 'set: {n: "${$n + 1}"}'),
    "a number that names a place": (
        COUNTED + "  get_hotspot: {label: $n}\n",
        "4:24",
        'a text with it: "n: $n"',
    ),
    "a length of a list": (LISTED + "  condition: len($seen) > 1\n", "4:14", "count(...)"),
    "a function with a dollar": (LISTED + "  condition: $count(seen) > 1\n", "4:14", "count($seen)"),
    "not in": (LISTED + "  condition: $seen not in $seen\n", "4:20", "not $item in $list"),
    "a list that is appended": (LISTED + "  append: {seen: [hall]}\n", "4:18", "hall"),
    "no dollar before a list": (
        LISTED + "  sequence:\n    - append: {seen: hall}\n    - for_each: seen\n      as: one\n"
        "      do: {say: {text: $one}}\n",
        "6:17",
        "$seen",
    ),
    "a loop of a program": (
        HEAD + "  for_each: one in [a, b]\n  do: {say: {text: $one}}\n",
        "3:3",
        "for_each: [a, b], as: one",
    ),
    "a key in braces": (
        'mission: example\ninputs: {room: {type: text}}\ntree:\n  say: {text: "In {{ room }}, $room"}\n',
        "4:15",
        "$room",
    ),
    "an output that nobody takes": (
        HEAD + "  sequence:\n    - look_for_user:\n    - navigate_to: {goal: $user}\n",
        "5:27",
        "out: {user: user} below look_for_user of line 4",
    ),
    "per cent": (HEAD + "  battery_above: {charge: 30 %}\n", "3:27", "0.3"),
    "a comma in a number between braces": (HEAD + "  turn: {angle: 1,5 rad}\n", "3:17", "angle: 1.5 rad"),
    "a comment without its space": (HEAD + "  wait: 5 s# short\n", "3:9", "5 s # short"),
    "a comment of a program": (HEAD + "  wait: 5 s // short\n", "3:9", "5 s # short"),
    "a code in words": (HEAD + "  fail: no\n  code: No Taxi!\n", "4:9", "no_taxi"),
    "letters of other languages": (COUNTED + "  set: {größe: 1}\n", "4:9", "groesse"),
    "a key of other letters": (HEAD + "  say: {text: So $größe}\n", "3:15", "$groesse"),
    "a negation of a program": (COUNTED + "  wait: 1 s\n  when: !$n\n", "5:9", "not $n"),
    "stars": (HEAD + "  say: {text: *now*}\n", "3:15", 'say: {text: "*now*"}'),
    "an apostrophe": (HEAD + "  say: {text: 'It's time'}\n", "3:19", 'say: {text: "It\'s time"}'),
    "quotes twice": (HEAD + '  say: {text: ""Hello""}\n', "3:17", 'say: {text: "Hello"}'),
    "dashes between brackets": (HEAD + "  pick_random: {items: [- a, - b]}\n", "3:25", "[kitchen, hall]"),
    "a sentence on two lines": (
        HEAD + "  say:\n    text: Good morning,\n    get up.\n",
        "5:12",
        "get up.:, 6 spaces before it",
    ),
    "a unit behind a key": (COUNTED + "  wait: $n min\n", "4:9", '"${$n * 1 min}"'),
    "a list in an expression": (
        ANSWERED + "    - condition: $a in [yes, ja]\n",
        "6:25",
        '$yes, "yes"',
    ),
    "a case for two values": (
        ANSWERED + "    - switch: $a\n      cases:\n        yes, ja: {wait: 1 s}\n",
        "8:9",
        "yes: and ja: each with its node",
    ),
    "inputs in the line of with": (
        HEAD + "  run: goto_room\n  with: room: kitchen\n",
        "4:13",
        "with: {room: kitchen}",
    ),
    "the tree in its line": (
        "mission: example\ntree: sequence:\n  - wait: 1 s\n",
        "2:15",
        "tree: on this line, sequence: on the next, indented further",
    ),
    "what time it is": (
        HEAD + '  wait_until: $time == "20:00"\n',
        "3:15",
        'wait_until: "20:00", which waits for a time',
    ),
    "a failure that is not dealt with": (
        HEAD + "  say: {text: $failure_code}\n",
        "3:15",
        "a node under on_failure",
    ),
    "an addition to nothing": (
        "mission: example\nkeys: {seen: {type: list of text}}\ntree: {append: {seen: hall}}\n",
        "3:17",
        "a default of 'seen' under keys:",
    ),
    "an input that is written": (
        "mission: example\ninputs: {room: {type: text}}\ntree:\n  sequence:\n"
        "    - say: {text: $room}\n    - get_user_room:\n      out: {room: room}\n",
        "7:19",
        "another key, such as new_room",
    ),
    "an output of another type": (
        "mission: example\noutputs: {who: {type: integer}}\n"
        "tree:\n  wait_for_answer: {}\n  out: {answer: who}\n",
        "2:11",
        "type: text",
    ),
    "a room where a pose is needed": (
        HEAD + "  navigate_to: kitchen\n",
        "3:3",
        "run: goto_room, with: {room: kitchen}",
    ),
    "a label where a pose is needed": (
        HEAD + "  navigate_to: {goal: kitchen}\n",
        "3:23",
        "$place, after get_hotspot: {label: kitchen}, out: {pose: place}",
    ),
    "repeat until": (HEAD + "  repeat: until noon\n  do: {wait: 1 s}\n", "3:11", "forever"),
    "a list below a skill": (HEAD + "  say:\n    - Hello\n    - you\n", "3:3", "say: {text: value}"),
    "an end with success": (
        HEAD + "  return: found\n",
        "3:3",
        "fail: done, with code: done; at the top on_failure: {done: a node} makes it good",
    ),
    "two rooms in one text": (
        HEAD + "  run: patrol\n  with: {rooms: kitchen and hall}\n",
        "4:17",
        "[kitchen, hall]",
    ),
    "a mission that calls itself": (HEAD + "  run: example\n", "3:8", "repeat: forever"),
    "two codes in one text": (
        HEAD + "  retry: 3\n  on: not_found, no_image\n  do: {look_for_user: {}}\n",
        "4:7",
        "[not_found, no_image]",
    ),
    "a handler for two codes": (
        HEAD + "  look_for_user: {}\n  on_failure:\n    not_found, no_image: {wait: 1 s}\n",
        "5:5",
        "not_found: with its node, no_image: with its node",
    ),
    "poses that are subtracted": (
        HEAD + "  sequence:\n    - look_for_user: {}\n      out: {user: u}\n    - condition: $u - $u < 1 m\n",
        "6:18",
        "distance($u, $u)",
    ),
    "every as a loop": (
        HEAD + "  every: 5 min\n  do: {run: patrol}\n",
        "3:3",
        "repeat: forever, with a wait at the end of what is under do",
    ),
    "a pause beside repeat": (
        HEAD + "  repeat: 3\n  wait: 5 min\n  do: {run: patrol}\n",
        "4:3",
        "do: {sequence: [the node, {wait: 5 min}]}",
    ),
    "a pause beside retry": (
        HEAD + "  retry: 3\n  wait: 5 min\n  do: {run: patrol}\n",
        "4:3",
        "between: {wait: 5 min}",
    ),
    "repeat for a time": (
        HEAD + "  repeat: 5 min\n  do: {run: patrol}\n",
        "3:11",
        "repeat: forever, with until: {wait: 5 min}",
    ),
    "no time-out": (HEAD + "  timeout: never\n  do: {run: patrol}\n", "3:12", "the node without it"),
    "unless, which is when not": (
        COUNTED + "  wait: 1 s\n  unless: $n > 2 or $n == 1\n",
        "5:3",
        "when: not ($n > 2 or $n == 1)",
    ),
    "unless not": (COUNTED + "  wait: 1 s\n  unless: not $n > 2\n", "5:3", "when: $n > 2"),
    "unless beside when": (
        COUNTED + "  wait: 1 s\n  when: $n < 9\n  unless: $n == 1\n",
        "6:3",
        "when: ($n < 9) and not $n == 1",
    ),
    "a time of day that is waited for": (
        HEAD + "  wait: until 22:00\n",
        "3:9",
        "wait_until: 22:00",
    ),
    "a time of day in an expression": (
        HEAD + "  wait: 1 s\n  when: $time >= 22:00\n",
        "4:20",
        "wait_until: 22:00, as a node",
    ),
    "a sum of another language": (HEAD + "  increment: n\n", "3:3", "add: {key: 1}"),
    "a difference of another language": (HEAD + "  decrement: {n: 1}\n", "3:3", "add: {key: -1}"),
    "add without a number": (
        HEAD + "  sequence:\n    - set: {n: 0}\n    - add: n\n    - fail: $n\n",
        "5:12",
        "add: {n: 1}",
    ),
    "add to a text": (
        HEAD + "  sequence:\n    - set: {t: a}\n    - add: {t: b}\n    - fail: $t\n",
        "5:16",
        "append: {t: b}, to a text or a list",
    ),
    "do something for a time": (HEAD + "  run: patrol\n  until: 5 min\n", "4:10", "until: {wait: 5 min}"),
    "only for a time": (HEAD + "  run: patrol\n  while: 5 min\n", "4:10", "until: {wait: 5 min}"),
    "after a time": (HEAD + "  run: patrol\n  when: 5 min\n", "4:9", "sequence: [{wait: 5 min}, the node]"),
    "wait until a time has passed": (HEAD + "  wait_until: 5 min\n", "3:15", "wait: 5 min"),
    "else below then": (
        HEAD + "  if: {look_for_user: {}}\n  then:\n    wait: 1 s\n    else: {wait: 2 s}\n",
        "6:5",
        "else indented like the if that it belongs to",
    ),
    "an input that may be left out": (
        "mission: example\ninputs: {a: {type: text, optional: true}}\ntree: {say: {text: $a}}\n",
        "2:26",
        "default",
    ),
    "no space behind a colon": (HEAD + "  say: {text:Hello}\n", "3:9", "text: Hello"),
    "no cases": (
        ANSWERED + "    - switch: $a\n      tea: {wait: 1 s}\n      milk: {wait: 2 s}\n",
        "7:7",
        "cases: with tea below it",
    ),
    "the default among the cases": (
        ANSWERED + "    - switch: $a\n      cases:\n        tea: {wait: 1 s}\n        default: {wait: 2 s}\n",
        "9:9",
        "default: indented like cases",
    ),
    "a misspelt success": (
        HEAD + "  for_each: [hall, study]\n  as: one\n  until: succes\n  do: {robot_in_room: {room: $one}}\n",
        "5:10",
        "first_success: true",
    ),
    "the word that a list had before": (
        HEAD + "  for_each: [hall, study]\n  as: one\n  until: success\n"
        "  do: {robot_in_room: {room: $one}}\n  on_failure: {any: {wait: 1 s}}\n",
        "5:10",
        "first_success: true",
    ),
    "hours and minutes": (HEAD + "  wait: 1h30\n", "3:9", "90 min"),
    "an item between braces": (
        LISTED + "  say: {text: $seen[0]}\n",
        "4:20",
        'say: {text: "${$seen[0]}"}',
    ),
    "a unit in an expression": (COUNTED + "  wait: ${$n s}\n", "4:14", "$n * 1 s"),
    "a pause as a node": (
        HEAD + "  retry: 3\n  do: {look_for_user: {}}\n  between: 10 s\n",
        "5:12",
        "{wait: 10 s}",
    ),
    "a list of conditions below until": (
        HEAD + "  repeat: 3\n  do: {wait: 1 s}\n  until:\n    - user_lying:\n",
        "6:5",
        "sequence: with the list below it",
    ),
    "choices as a table": (HEAD + "  wait_for_answer: {choices: {tea: 1, milk: 2}}\n", "3:30", "[tea, milk]"),
    "out among the inputs of a mission": (
        HEAD + "  run: find_user\n  with:\n    rooms: [hall]\n    out: {user: u}\n",
        "6:5",
        "out indented like with",
    ),
    "a number that is appended": (COUNTED + "  append: {n: 1}\n", "4:12", "add: {n: 1}"),
    "a handler for all others": (
        HEAD + "  look_for_user: {}\n  on_failure:\n    default: {wait: 1 s}\n",
        "5:5",
        "any",
    ),
    "on_restart at a node": (
        HEAD + "  wait: 1 s\n  on_restart: resume\n",
        "4:3",
        "on_restart at the left edge of the file",
    ),
    "a policy after parallel": (
        HEAD + "  parallel: any\n  name: two\n",
        "3:13",
        "parallel: a list of nodes, with policy: any beside it",
    ),
    "a list of codes as a key": (
        HEAD + "  look_for_user: {}\n  on_failure:\n    [not_found, no_image]: {wait: 1 s}\n",
        "5:5",
        "a line of its own for each item of the list",
    ),
    "a default that is no place": (
        "mission: example\ninputs: {rooms: {type: list of text, default: [hall, kichen]}}\n"
        "tree: {run: patrol, with: {rooms: $rooms}}\n",
        "2:54",
        "kitchen",
    ),
}


@pytest.mark.parametrize("name", REMEDIES)
def test_a_mistake_is_told_in_its_place_with_its_remedy(tmp_path: Path, name: str) -> None:
    text, place, remedy = REMEDIES[name]
    file = tmp_path / "example.yaml"
    file.write_text(text, encoding="utf-8")
    report = check_files([file])[0].replace(f"{file}:", "")
    found = next(part for part in report.split("\n\n")[0].splitlines() if not part.startswith(" "))
    worked = report.partition("would have worked: ")[2].splitlines()[0]
    assert found.startswith(f"{place}: "), report
    assert worked == remedy or worked.startswith(f"{remedy}, "), report


def test_words_of_other_scripts_may_follow_a_key(tmp_path: Path) -> None:
    text = "mission: example\ninputs: {who: {type: text}}\ntree: {say: {text: $whoさん、おはよう}}\n"
    assert found_in(tmp_path, text) == []


def found_in(tmp_path: Path, text: str) -> list[str]:
    """The findings of a file without what would have worked."""
    file = tmp_path / "example.yaml"
    file.write_text(text)
    lines = check_files([file])[0].replace(f"{file}:", "").splitlines()
    return [line for line in lines[:-1] if not line.startswith(" ")]


def test_what_can_be_passed_over_hides_no_other_error(tmp_path: Path) -> None:
    text = (
        "mission: example\ntree:\n  sequence: &all\n    - {turn: {angle: 45, angle: 5 deg}}\n"
        "    - fail: !now x\n    - wait: 5 m\n---\nmission: another\n"
    )
    assert [
        line.partition("error: ")[0] + line.partition("error: ")[2][:28] for line in found_in(tmp_path, text)
    ] == [
        "3:13: anchors and aliases are not ",
        "4:22: angle: an angle needs a unit",
        "4:26: the key 'angle' is duplicate",
        "5:13: the tag !now is not allowed",
        "6:13: wait: 'm' is not a unit of a",
        "7:1: a second document begins her",
    ]


@pytest.mark.parametrize("word", ["foreach", "forEach", "for-each", "ForEach", "For each"])
def test_a_kind_in_another_spelling_is_named_and_what_is_below_it_checked(tmp_path: Path, word: str) -> None:
    text = HEAD + f"  {word}: [a, b]\n  as: room\n  do:\n    turn: {{angle: 45}}\n"
    file = tmp_path / "example.yaml"
    file.write_text(text)
    report = check_files([file])[0]
    assert f"3:3: error: there is no skill and no kind of node '{word}'" in report
    assert "would have worked: for_each\n" in report
    assert "6:19: error: angle: an angle needs a unit: '45'" in report
    assert report.endswith("2 errors, 0 warnings")


@pytest.mark.parametrize(
    ("word", "meant"),
    [
        ("lookForUser", "look_for_user"),
        ("Look-for-user", "look_for_user"),
        ("lookforuser", "look_for_user"),
        ("waitUntil", "wait_until"),
        ("goto room", "run: goto_room"),
        ("gotoRoom", "run: goto_room"),
        ("goto_rom", "run: goto_room, "),
        ("runOnce", "once"),
    ],
)
def test_names_in_another_spelling(tmp_path: Path, word: str, meant: str) -> None:
    file = tmp_path / "example.yaml"
    file.write_text(HEAD + f"  {word}: {{}}\n")
    report = check_files([file])[0]
    assert f"would have worked: {meant}" in report and report.endswith("1 error, 0 warnings")


def test_an_unknown_skill_can_be_declared(tmp_path: Path) -> None:
    file = tmp_path / "example.yaml"
    file.write_text(HEAD + "  open_fridge: {door: left}\n")
    report = check_files([file])[0]
    assert "skills: {open_fridge: {summary: ...}} in NAME.skills.yaml beside the mission" in report
    assert "docs/reference/missions.md#skills-of-your-own" in report and "approach_person" not in report
    (tmp_path / "mine.skills.yaml").write_text(
        "skills:\n  open_fridge:\n    summary: Open a door of the fridge\n    inputs: {door: {type: text}}\n"
    )
    report = check_files([file])[0]
    assert "declared but not implemented" in report and "0 errors, 1 warning" in report


def test_unknown_keys_are_told_beside_other_errors_and_below_unknown_kinds(tmp_path: Path) -> None:
    text = (
        "mission: example\ninputs:\n  room: {type: text}\ntree:\n  sequence:\n"
        "    - fallback:\n        - turn: {angle: 45}\n        - fail: no $romm\n"
        "    - gather:\n        - look_for_user:\n          out: {user: user}\n        - wait: $pause\n"
        "    - try:\n        turn: {angel: 45 deg}\n"
        "    - set: {far: }\n"
        "    - navigate_to: {goal: $user}\n"
        "    - say: {text: $room is far, $far}\n"
    )
    found = [line.partition(": error: ") for line in found_in(tmp_path, text)]
    assert [(place, message) for place, _, message in found] == [
        ("6:7", "there is no skill and no kind of node 'fallback'"),
        ("7:25", "angle: an angle needs a unit: '45'"),
        ("8:17", "no node writes a key 'romm'"),
        ("9:7", "there is no skill and no kind of node 'gather'"),
        ("12:17", "no node writes a key 'pause'"),
        ("13:7", "there is no skill and no kind of node 'try'"),
        ("14:16", "turn has no input 'angel'"),
        ("15:18", "'far' has no value"),
        ("17:19", "'text': text with commas needs quotes here"),
    ]


def test_what_cannot_be_read_brings_no_findings_about_its_names(tmp_path: Path) -> None:
    for section in ("input: {room: {type: text}}", "inputs: [room]", "inputs: [{name: room, type: text}]"):
        text = f"mission: example\n{section}\ntree: {{fail: no $room}}\n"
        assert len(found_in(tmp_path, text)) == 1, found_in(tmp_path, text)
    for node in ("set: [room: hall]", "set: room = hall", "set: {room: }"):
        text = HEAD + f"  sequence:\n    - {node}\n    - fail: no $room\n"
        assert len(found_in(tmp_path, text)) == 1, found_in(tmp_path, text)


def test_odd_spaces_in_quotes_and_comments_are_text(tmp_path: Path) -> None:
    assert found_in(tmp_path, HEAD + '  fail: "Guten\u00a0Tag"  # ein\u2003Wort\n') == []
    assert found_in(tmp_path, HEAD + "  fail: |\n    Guten\u00a0Tag, “Anna”\n") == []
    assert found_in(tmp_path, HEAD + "  fail: it’s \N{WOMAN}\u200d\N{PERSONAL COMPUTER}\n") == []


def test_every_odd_space_of_a_file_is_told(tmp_path: Path) -> None:
    text = HEAD + "  sequence:\n    -\u00a0wait: 5 s\n    - turn:\u00a0{angle: 45}\n    - wait:\u20073 s\n"
    assert [line.split(":")[:2] for line in found_in(tmp_path, text)] == [
        ["4", "6"],
        ["5", "12"],
        ["5", "21"],
        ["6", "12"],
    ]


def test_a_quoted_text_with_a_sum_in_it_is_a_text(tmp_path: Path) -> None:
    head = "mission: example\ntree:\n  sequence:\n    - set: {a: 3}\n"
    for text in ('"$a + 1"', "the $a", "$a of $a", "${$a + 1}"):
        assert (
            found_in(
                tmp_path,
                f"{head}    - set: {{b: {text!s}}}\n    - fail: $b\n".replace(
                    "b: ${$a + 1}", 'b: "${$a + 1}"'
                ),
            )
            == []
        ), text


def test_a_key_that_was_meant_where_a_label_stands(tmp_path: Path) -> None:
    file = tmp_path / "example.yaml"
    file.write_text(
        "mission: example\ninputs: {room: {type: text}}\ntree: {run: goto_room, with: {room: room}}\n"
    )
    assert "would have worked: $room" in check_files([file])[0]


def test_files_with_another_ending_are_pointed_out(tmp_path: Path) -> None:
    (tmp_path / "example.yml").write_text("mission: example\ntree: {wait: 1 s}\n")
    (tmp_path / "other.yaml").write_text("mission: other\ntree: {wait: 1 s}\n")
    (tmp_path / ".hidden.yaml").write_text("nothing\n")
    report, errors = check_files([tmp_path])
    assert not errors
    assert "example.yml:1:1: warning: missions are files that end in .yaml" in report
    assert "hidden" not in report and report.endswith("1 mission checked: 0 errors, 1 warning")


def test_the_whole_of_what_a_message_quotes_is_marked(tmp_path: Path) -> None:
    file = tmp_path / "example.yaml"
    file.write_text(HEAD + "  wait: 1,5 s\n")
    assert "|         ^^^^^\n" in check_files([file])[0]


@pytest.mark.parametrize("sign", list("&*|>?,]}"))
def test_a_text_that_begins_with_a_sign_of_yaml(tmp_path: Path, sign: str) -> None:
    file = tmp_path / "example.yaml"
    file.write_text(f"mission: example\ndescription: {sign} all of it\ntree: {{wait: 1 s}}\n")
    report, _ = check_files([file])
    first, *_, worked, _ = report.splitlines()
    assert first.endswith(f" error: not YAML: text that begins with {sign} needs quotes")
    assert first.startswith(f"{file}:2:1")
    assert worked.endswith(f'= would have worked: description: "{sign} all of it"')


def test_the_key_behind_a_time_of_day_is_offered_to_nobody(tmp_path: Path) -> None:
    file = tmp_path / "example.yaml"
    end = "    - {repeat: forever, do: {turn: {angle: 5 deg}}, until: $done}\n"
    file.write_text(HEAD + '  sequence:\n    - wait_until: "22:00"\n' + end)
    report = check_files([file])[0]
    assert "would have worked: done under inputs:, set: {done: ...} before it\n" in report
    file.write_text(
        HEAD + '  sequence:\n    - wait_until: "22:00"\n    - set: {time_22_00: 1}\n    - fail: $time_22_00\n'
    )
    assert "no problem found" in check_files([file])[0]
    text = '  sequence:\n    - wait_until: "22:00"\n    - set: {room: kitchen, share: 0.5}\n'
    file.write_text(HEAD + text + "    - battery_above: {charge: $room}\n    - fail: $share\n")
    assert "would have worked: $share\n" in check_files([file])[0]
