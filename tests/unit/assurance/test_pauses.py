"""A pause is explored wherever a mission waits for skills: what ran is started again, with its whole time."""

from pathlib import Path

import pytest

from florence_bt.assurance.replay import replay
from florence_bt.assurance.report import text_of
from florence_bt.assurance.verifier import Verifier
from florence_bt.trees.language.declarations import collect_declarations
from florence_bt.trees.language.loader import MissionLibrary

SPEAKS = "  sequence:\n    - say: {text: Hello}\n    - turn: {angle: 90 deg}\n"


def pauses_of(graph):
    return [
        (state, edge)
        for state, edges in enumerate(graph.edges)
        for edge in edges
        if edge.event.what == "pause"
    ]


def reached_without_pauses(graph):
    found, todo = {0}, [0]
    while todo:
        for edge in graph.edges[todo.pop()]:
            if edge.event.what != "pause" and edge.target not in found:
                found.add(edge.target)
                todo.append(edge.target)
    return found


@pytest.mark.parametrize("name", ["go_home", "stand_before", "go_near", "approach_me", "goto_room"])
def test_after_a_pause_a_mission_is_where_it_was(name: str):
    """No state of these is reached by a pause alone: what can follow can follow without one, too."""
    graph = Verifier(MissionLibrary.load(), collect_declarations()).explored(name).graph
    assert not graph.unexplored
    paused = pauses_of(graph)
    assert paused
    assert all(edge.target == state for state, edge in paused)
    assert reached_without_pauses(graph) == set(range(len(graph.edges)))


def test_a_skill_that_was_paused_may_outlast_a_time_out(verify):
    """It has its whole time again; without a pause the turn is over after 30 s."""
    wait = "sequence: [{wait: 70 s}, {fail: it takes long, code: too_long}]"
    tree = f"  parallel:\n    - turn: {{angle: 90 deg}}\n    - {wait}\n  policy: {{succeed: 1, fail: 1}}\n"
    verdict = verify(tree)
    assert verdict.holds, text_of(verdict)
    graph = verdict.explored.graph
    without = reached_without_pauses(graph)
    assert "too_long" in {ending.code for ending in graph.endings.values()}
    assert "too_long" not in {ending.code for state, ending in graph.endings.items() if state in without}
    assert verdict.longest_s == pytest.approx(30.0)


def test_a_pause_makes_no_time_longer_and_is_no_begin(verify, tmp_path: Path):
    properties = (
        "properties:\n  - at_most: {say: 1}\n  - {after: say begins, eventually: say ends, within: 2 min}\n"
    )
    (tmp_path / "tried.properties.yml").write_text(properties)
    verdict = verify(SPEAKS)
    assert verdict.holds, text_of(verdict)
    assert verdict.longest_s < 1e4


def test_a_way_says_that_somebody_pauses(verify):
    verdict = verify(SPEAKS)
    _, edge = pauses_of(verdict.explored.graph)[0]
    begin = verdict.explored.graph.edges[0][0]
    tick = next(e for e in verdict.explored.graph.edges[begin.target] if e.event.what == "tick")
    lines = replay(verdict.explored, [begin, tick, edge]).lines
    assert [each.what for _, each in lines if each.what in ("start", "pause")] == ["start", "pause"]
