"""What ``tools/exploration.py`` counts."""

from __future__ import annotations

from florence_bt.simulation.home.flat import Flat, load_flat
from florence_bt.simulation.home.free_space import free_space_of
from florence_bt.skills.locator.hotspots import Hotspot
from tests.two_rooms import write_two_rooms
from tools.exploration import Explored, _are_right, row_of, total_of


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


def test_rooms_are_right_when_each_has_one_proposal_and_no_other_is_there(tmp_path):
    flat = load_flat(write_two_rooms(tmp_path))
    space = free_space_of(flat)
    for rectangles, right in (
        ([(0, 3), (3, 6)], True),
        ([(0, 2.9), (2.9, 6)], True),
        ([(0, 6)], False),
        ([(0, 3)], False),
        ([(0, 3), (3, 4.5), (4.5, 6)], False),
    ):
        assert _are_right(flat, space, proposals(flat, *rectangles)) is right, rectangles


def test_the_totals_count_homes():
    good = Explored(1, "", 60.0, 10.0, {"den": 1.0}, (), 1, right=True, reached=1, misses=())
    bad = Explored(
        2, "blocked", 90.0, 5.0, {"den": 0.5}, ("mirror",), 2, right=False, reached=1, misses=("x",)
    )
    assert row_of(bad)[1:7] == ["blocked", "1.5", "5", "0 of 1", "50", "mirror"]
    told = total_of([good, bad])
    assert "Of 2 homes: every room seen in 1, nothing touched in 1, rooms proposed right in 1" in told
    assert "2 of 3 proposed rooms" in told
