"""Maps that the robot has made, judged by the home."""

from __future__ import annotations

from pathlib import Path

import pytest
from florence_sweep.experiment import Case, Setup
from florence_sweep.explored import are_right
from florence_sweep.outcome import ALL_SEEN
from florence_sweep.running import run_case
from florence_sweep.summary import why

from florence_bt.simulation.home.flat import Flat, load_flat
from florence_bt.simulation.home.free_space import free_space_of
from florence_bt.skills.locator.hotspots import Hotspot
from tests.two_rooms import write_two_rooms


def proposals(flat: Flat, *rectangles: tuple[float, float]) -> list[Hotspot]:
    """Return rooms from one x to another of the home, in the frame of the map."""
    to_map = flat.start.inverse()
    return [
        Hotspot(
            f"room_{low}",
            to_map,
            polygon=tuple(to_map.apply(*corner) for corner in ((low, 0), (high, 0), (high, 3), (low, 3))),
        )
        for low, high in rectangles
    ]


@pytest.mark.parametrize(
    ("rectangles", "right"),
    [
        ([(0, 3), (3, 6)], True),
        ([(0, 2.9), (2.9, 6)], True),
        ([(0, 6)], False),
        ([(0, 3)], False),
        ([(0, 3), (3, 4.5), (4.5, 6)], False),
    ],
)
def test_rooms_are_right_when_each_has_one_proposal_and_no_other_is_there(
    rectangles: list[tuple[float, float]], right: bool, tmp_path: Path
) -> None:
    flat = load_flat(write_two_rooms(tmp_path))
    assert are_right(flat, free_space_of(flat), proposals(flat, *rectangles)) is right


@pytest.mark.slow
def test_who_has_only_looked_round_has_not_seen_every_room() -> None:
    setup = Setup("explore", home="flat", people="nobody", map="made", limit=3.0, good=("all_rooms_seen",))
    outcome = run_case(Case(0, "", 1, setup))
    assert outcome.status == "STOPPED" and not outcome.good, outcome.reason
    assert outcome.measures["rooms seen"] < outcome.measures["rooms"]
    assert outcome.measures[ALL_SEEN] is False and why(outcome) == "did not see every room"
