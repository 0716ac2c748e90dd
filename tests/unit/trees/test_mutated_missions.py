"""Missions with mistakes in them: the check never breaks, and what it lets through can be built."""

import tempfile
from pathlib import Path

from hypothesis import given, settings
from hypothesis import strategies as st

from florence_bt.core.clock import ManualClock
from florence_bt.core.errors import ConfigError
from florence_bt.trees.checks.lint import check
from florence_bt.trees.drawings.draw import FORMATS, draw
from florence_bt.trees.language.compile import compile_mission
from florence_bt.trees.language.declarations import own_declarations
from florence_bt.trees.language.findings import has_errors
from florence_bt.trees.language.loader import BUILT_IN, MissionLibrary
from florence_bt.trees.language.parse import parse_mission
from tests.sweeps import examples
from tests.ticking import make_context

DECLARATIONS = own_declarations()
LIBRARY = MissionLibrary.load(third_party=False)
EVERYTHING = """\
mission: everything
inputs:
  mode: {type: text, default: fast}
  limit: {type: length, default: 2 m, min: 0 m}
keys:
  tries: {type: integer, default: 0}
  goal: {type: pose}
tree:
  sequence:
    - set: {goal: {x: "${$limit / 2}", y: 1 m, yaw: "${-90 deg}"}, tries: "${$tries + 1}"}
      when: $tries < 3 and not ($mode == "slow")
    - if: distance($goal, $goal) <= $limit
      then: {turn: {angle: 45 deg}, when: $tries != 2}
      else: {fail: "too far: $limit", code: too_far}
      memory: false
    - switch: $mode
      cases:
        fast: {once: {start_tracker: }}
        slow: {stop_tracker: , until: $tries > 3, on_failure: {any: {wait: 2 s}}}
      default: {retry: 2, do: {wait: "${max(1 s, 2 s)}"}, between: {wait: 1 s}}
    - parallel:
        - {name: looking, timeout: 30 s, do: {look_for_user: {window: 2 s}}}
        - {condition: $tries > 0, because: {condition_false: "no tries yet"}}
      policy: [looking]
      while: $tries < 9
      finally: {stop_tracker: }
    - parallel: [{wait: 1 s}, {wait: 2 s}]
      policy: {succeed: 1, fail: 2}
"""
TEXTS = {name: (BUILT_IN / f"{name}.yaml").read_text() for name in LIBRARY.names()} | {
    "everything": EVERYTHING
}
ODD_WORDS = ("", "[]", "{}", "$", "~", "5", "- ", "${", "}", "not", "<", "$tries", "0.5 m")
WORDS = [*sorted({word for text in TEXTS.values() for word in text.split()}), *ODD_WORDS]


@st.composite
def mutations(draw_from):
    name = draw_from(st.sampled_from(sorted(TEXTS)))
    lines = TEXTS[name].split("\n")
    for _ in range(draw_from(st.integers(1, 3))):
        row = draw_from(st.integers(0, len(lines) - 1))
        words = lines[row].split(" ")
        match draw_from(st.sampled_from(["drop line", "indent", "dedent", "word"])):
            case "drop line":
                lines[row] = ""
            case "indent":
                lines[row] = "  " + lines[row]
            case "dedent":
                lines[row] = lines[row].removeprefix("  ")
            case "word":
                words[draw_from(st.integers(0, len(words) - 1))] = draw_from(st.sampled_from(WORDS))
                lines[row] = " ".join(words)
    return name, "\n".join(lines)


@settings(max_examples=examples(200))
@given(mutations())
def test_checking_a_mutated_mission(mutated):
    name, text = mutated
    try:
        mission = parse_mission(text, Path(tempfile.gettempdir()) / f"{name}.yaml")
    except ConfigError as error:
        assert error.line is not None
        return
    findings = check(mission, LIBRARY, DECLARATIONS, ["kitchen", "dock"])
    assert all(finding.line >= 1 and finding.column >= 1 and finding.message for finding in findings)
    for format_name in FORMATS:
        draw(mission, format_name, LIBRARY, expand=True)
    if not has_errors(findings):
        inputs = {key: port.default for key, port in mission.inputs.items() if not port.required}
        compile_mission(mission, LIBRARY, inputs, make_context(ManualClock(), {}, DECLARATIONS))


def test_what_is_mutated_was_right_before():
    for name, text in TEXTS.items():
        mission = parse_mission(text, Path(f"{name}.yaml"))
        assert not has_errors(check(mission, LIBRARY, DECLARATIONS, ["kitchen", "dock"])), name
