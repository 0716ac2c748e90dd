"""What the check says to be impossible never happens: held against random missions that really run.

Each mission is checked and then run with skills that end as they like. Whatever a node does must be among
what the check holds to be possible, and a mission whose keys it finds in order never misses a key.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from py_trees.common import Status

from florence_bt.behaviours.why import explain
from florence_bt.core.clock import ManualClock
from florence_bt.core.declaration import Kind, Port, SkillDeclaration
from florence_bt.core.outcome import failure, success
from florence_bt.mission_testing.mocks.mocks import Step
from florence_bt.trees.checks.lint import check
from florence_bt.trees.language.analysis import Analysis
from florence_bt.trees.language.compile import compile_mission, origin_of
from florence_bt.trees.language.loader import MissionLibrary
from florence_bt.trees.language.parse import parse_mission
from tests.scripted_skill import ScriptedSkill
from tests.sweeps import examples
from tests.ticking import make_context, tick_until

WORK = SkillDeclaration(
    "work",
    "Work",
    inputs={"n": Port(Kind.INTEGER, "a number", default=0)},
    outputs={"count": Port(Kind.INTEGER, "a number")},
    failures={"broken": "it broke", "lost": "it got lost"},
)
SKILLS = {"work": WORK}
HEAD = "mission: m\ninputs: {i: {type: integer, default: 1}}\nkeys: {z: {type: integer, default: 2}}\ntree: "

KEYS = st.sampled_from(["a", "b", "i", "z"])
WRITTEN = st.sampled_from(["a", "b"])
EXPRESSIONS = st.one_of(
    st.builds("${} > {}".format, KEYS, st.integers(0, 3)),
    st.builds("${} == ${}".format, KEYS, KEYS),
    st.builds("6 / ${} > 2".format, KEYS),
    st.sampled_from(["true", "1 > 2", "2 m > 1 m", "false or $i > 0"]),
)
LEAVES = st.one_of(
    st.just("{work: }"),
    st.builds("{{work: , out: {{count: {}}}}}".format, WRITTEN),
    st.builds("{{work: {{n: ${}}}}}".format, KEYS),
    st.builds('{{work: {{n: "${{${} * 9999999999}}"}}}}'.format, KEYS),
    st.builds("{{set: {{{}: {}}}}}".format, WRITTEN, st.integers(0, 3)),
    st.builds('{{set: {{{}: "${{$i + ${}}}"}}}}'.format, WRITTEN, KEYS),
    st.builds("{{condition: {}}}".format, EXPRESSIONS),
    st.just("{wait: 1 s}"),
    st.just("{fail: no}"),
)


def lists(nodes):
    return st.lists(nodes, min_size=1, max_size=3).map(", ".join)


LISTS = st.sampled_from(["[]", "[1]", "[1, 2]"])
MORE = st.sampled_from(
    [
        "",
        ", first_success: true",
        ", go_on_over: [broken]",
        ", first_success: true, go_on_over: [lost], code: odd",
    ]
)


def larger(nodes):
    memory = st.sampled_from(["", ", memory: false"])
    policy = st.sampled_from(["all", "any", "{succeed: 1}", "{succeed: 1, fail: 1}"])
    plain = st.one_of(
        st.builds("{{sequence: [{}]{}}}".format, lists(nodes), memory),
        st.builds("{{selector: [{}]{}}}".format, lists(nodes), memory),
        st.builds("{{parallel: [{}], policy: {}}}".format, lists(nodes), policy),
        st.builds("{{if: {}, then: {}}}".format, st.one_of(EXPRESSIONS, nodes), nodes),
        st.builds(
            "{{if: {}, then: {}, else: {}{}}}".format, st.one_of(EXPRESSIONS, nodes), nodes, nodes, memory
        ),
        st.builds("{{switch: ${}, cases: {{1: {}, 2: {}}}}}".format, KEYS, nodes, nodes),
        st.builds("{{switch: ${}, cases: {{1: {}}}, default: {}}}".format, KEYS, nodes, nodes),
        st.builds("{{retry: 2, do: {}}}".format, nodes),
        st.builds("{{retry: 2, attempt: b, do: {}}}".format, nodes),
        st.builds("{{retry: 2, do: {}, between: {}}}".format, nodes, nodes),
        st.builds("{{repeat: 2, do: {}}}".format, nodes),
        st.builds("{{timeout: 1500 ms, do: {}}}".format, nodes),
        st.builds("{{repeat: forever, do: {}}}".format, nodes),
        st.builds("{{retry: forever, on: [{}], do: {}}}".format, st.sampled_from(["broken", "lost"]), nodes),
        st.builds("{{for_each: {}, as: {}, do: {}{}}}".format, LISTS, KEYS, nodes, MORE),
        st.builds("{{once: {}}}".format, nodes),
        st.builds("{{timeout: 2 s, do: {{wait_until: {}}}}}".format, EXPRESSIONS),
        st.builds("{{invert: {}}}".format, nodes),
        st.builds("{{succeed: {}}}".format, nodes),
    )
    guard = st.builds(", {}: {}".format, st.sampled_from(["when", "while"]), EXPRESSIONS)
    cleanup = st.builds(", finally: {}".format, nodes)
    until = st.builds(", until: {}".format, st.one_of(EXPRESSIONS, nodes))
    codes = st.sampled_from(["any", "broken", "timed_out", "failed"])
    caught = st.builds(", on_failure: {{{}: {}}}".format, codes, nodes)
    ensure = st.builds(", ensure: {}".format, EXPRESSIONS)
    more = st.one_of(guard, cleanup, until, caught, ensure)
    modified = st.builds(lambda node, more: f"{node[:-1]}{more}}}", plain, more)
    return st.one_of(plain, plain, modified)


NODES = st.recursive(LEAVES, larger, max_leaves=7)
STEPS = st.lists(
    st.builds(
        Step,
        st.one_of(
            st.integers(0, 3).map(lambda n: success(count=n)),
            st.sampled_from(["broken", "lost"]).map(lambda code: failure(code, "as the test wants")),
        ),
        st.sampled_from([0.0, 1.0]),
    ),
    min_size=1,
    max_size=5,
)


@pytest.mark.slow
@settings(max_examples=examples(400))
@given(NODES, STEPS)
def test_nothing_happens_that_the_check_excludes(tree, steps):
    mission = parse_mission(HEAD + tree + "\n", Path(tempfile.gettempdir()) / "m.yaml")
    library = MissionLibrary()
    library.put(mission)
    assume(not mission.findings)
    findings = check(mission, library, SKILLS)
    known = Analysis(library, SKILLS).of(mission)
    keys_in_order = not any("the key" in f.message or "no node writes" in f.message for f in findings)
    unreached = {
        (f.line, f.column)
        for f in findings
        if "is never reached" in f.message or "never tried" in f.message
        # That one points at an `until` that holds from the start, which is asked all the same.
        if "succeeds at once" not in f.message
    }

    clock = ManualClock()
    context = make_context(clock, {"work": ScriptedSkill(WORK, clock, steps)}, SKILLS)
    compiled = compile_mission(mission, library, {"i": 1}, context)

    looks = 0

    def look():
        nonlocal looks
        looks += 1
        for behaviour in compiled.root.iterate():
            origin = origin_of(behaviour)
            if origin is None or behaviour.status is Status.INVALID:
                continue
            ends = known.of(origin.node).outcomes
            place = (origin.node.position.line, origin.node.position.column)
            assert place not in unreached, f"{behaviour.name} was reached"
            assert behaviour.status is not Status.SUCCESS or ends.can_succeed, f"{behaviour.name} succeeded"
            assert behaviour.status is not Status.FAILURE or ends.can_fail, f"{behaviour.name} failed"
            if behaviour.status is Status.FAILURE:
                why = explain(behaviour)
                assert why is None or why.code in ends.codes, f"{behaviour.name} failed with {why}"
                assert why is None or why.code != "missing_key" or not keys_in_order, why
        return looks > 100  # some trees without memory begin again for ever

    tick_until(compiled.root, clock, context, look)
