"""Every value of a hotspot file at its limits: lengths, angles, corners, labels, zones and their speeds."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from florence_bt.core.errors import ConfigError
from florence_bt.core.geometry import MAX_DISTANCE_M, Pose2
from florence_bt.core.polygons import area, common_area, contains, crossing_edges, distance_to
from florence_bt.core.sensing import OccupancyGrid
from florence_bt.core.zones import KEEP_OUT, MAX_CORNERS, MAX_ZONES, SLOW, Zone
from florence_bt.skills.locator.filter_masks import keep_out_mask, speed_mask
from florence_bt.skills.locator.hotspot_file import read_hotspot, read_zone
from florence_bt.skills.locator.hotspots import Hotspot, Hotspots, kind_of_new, parse_hotspots, parse_places

FILE = Path("home.yaml")
SQUARE = "[[0, 0], [2, 0], [2, 2], [0, 2]]"


def only(text: str) -> Hotspot:
    (hotspot,) = parse_hotspots(f"hotspots:\n  - {{label: a, {text}}}")
    return hotspot


def problems(text: str) -> list[str]:
    return [str(problem) for problem in parse_places(text.encode(), FILE).problems]


# ---- numbers of a hotspot ------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "metres"),
    [("1.5", 1.5), ("-1.5 m", -1.5), ("150 cm", 1.5), ("1500 mm", 1.5), ("2 km", 2000.0), ("1e1", 10.0)],
)
def test_a_length_is_in_metres_or_has_its_unit(text: str, metres: float) -> None:
    assert only(f"x: {text}, y: 0").pose.x == pytest.approx(metres)
    assert only(f"x: 0, y: {text}").pose.y == pytest.approx(metres)
    corner = only(f"x: 0, y: 0, polygon: [[0, 0], [1, 0], [0, {text}]]").polygon[2]
    assert corner == pytest.approx((0.0, metres))


@pytest.mark.parametrize("sign", ["", "-"])
def test_a_length_may_be_as_far_as_any_home(sign: str) -> None:
    assert abs(only(f"x: {sign}{MAX_DISTANCE_M}, y: 0").pose.x) == MAX_DISTANCE_M
    for too_far in ("10000.1", "10.001 km", "1e300"):
        with pytest.raises(ConfigError, match="at most 10000 m"):
            only(f"x: {sign}{too_far}, y: 0")


@pytest.mark.parametrize("text", ["1.5 deg", "'1,5'", "m", "1.5m/s", "[1]", "''"])
def test_what_is_no_length_is_refused_with_what_would_have_worked(text: str) -> None:
    with pytest.raises(ConfigError, match=r"x must be.*1\.5 m"):
        only(f"x: {text}, y: 0")


@pytest.mark.parametrize(
    ("text", "yaw"),
    [
        ("phi: 1.57", 1.57),
        ("phi: -3", -3.0),
        (f"phi: {math.tau}", math.tau),
        (f"phi: {-math.tau}", -math.tau),
        ("phi: 90 deg", math.pi / 2),
        ("yaw: 90 deg", math.pi / 2),
        ("yaw: -90°", -math.pi / 2),
        ("yaw: 360 deg", math.tau),
        ("yaw: 1.57 rad", 1.57),
    ],
)
def test_an_angle_is_in_radians_or_has_its_unit(text: str, yaw: float) -> None:
    assert only(f"x: 0, y: 0, {text}").pose.yaw == pytest.approx(yaw)


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("phi: 6.3", "6.3 is more than a whole turn (would have worked: 6.3 deg, if degrees are meant)"),
        ("phi: 360", "360 deg, if degrees are meant"),
        ("phi: 361", "(would have worked: -180 deg to 180 deg)"),
        ("phi: -361", "(would have worked: -180 deg to 180 deg)"),
        ("yaw: 361 deg", "yaw is more than a whole turn (would have worked: -180 deg to 180 deg)"),
        ("yaw: -361 deg", "yaw is more than a whole turn"),
        ("yaw: 1.57", "has no unit; a bare number is read as radians in 'phi' alone"),
        ("yaw: 1.57", "(would have worked: 1.57 deg, 1.57 rad)"),
        ("yaw: 2 m", "yaw must be a number with its unit, not '2 m' (would have worked: 90 deg, 1.57 rad)"),
        ("phi: east", "would have worked: 90 deg, 1.57 rad"),
        ("phi: 1, yaw: 60 deg", "'phi' and 'yaw' are the same (would have worked: one of the two)"),
    ],
)
def test_an_angle_that_is_none_is_refused(text: str, problem: str) -> None:
    with pytest.raises(ConfigError) as caught:
        only(f"x: 0, y: 0, {text}")
    assert problem in str(caught.value)


def test_corners_have_two_numbers_and_a_polygon_three_to_a_thousand_corners() -> None:
    def polygon(count: int) -> str:
        return "[" + ", ".join(f"[{n}, {n * n % 7}]" for n in range(count)) + "]"

    for count in (3, MAX_CORNERS):
        assert len(only(f"x: 0, y: 0, polygon: {polygon(count)}").polygon) == count
    for count in (0, 2, MAX_CORNERS + 1):
        with pytest.raises(ConfigError, match=f"at least 3 corners, and at most {MAX_CORNERS}, not {count}"):
            only(f"x: 0, y: 0, polygon: {polygon(count)}")
    for corner in ("[1]", "[1, 2, 3]", "[]"):
        with pytest.raises(ConfigError, match="a corner has two numbers"):
            only(f"x: 0, y: 0, polygon: [[0, 0], [1, 0], {corner}]")
    with pytest.raises(ConfigError, match="a corner must be a list"):
        only("x: 0, y: 0, polygon: [[0, 0], [1, 0], 3]")


# ---- zones ---------------------------------------------------------------------------------------------


def zone(limit: str, kind: str = "slow") -> Zone:
    (found,) = parse_hotspots(
        f"hotspots:\nzones:\n  - {{label: rug, kind: {kind}, polygon: {SQUARE}, {limit}}}"
    ).zones
    return found


@pytest.mark.parametrize(
    ("text", "limit", "is_share", "of_half", "written"),
    [
        ("0.2 m/s", 0.2, False, 0.2, "0.2 m/s"),
        ("20 cm/s", 0.2, False, 0.2, "0.2 m/s"),
        ("3.6 km/h", 1.0, False, 1.0, "1 m/s"),
        ("100 m/s", 100.0, False, 100.0, "100 m/s"),
        ("50 %", 0.5, True, 0.25, "50 %"),
        ("50%", 0.5, True, 0.25, "50 %"),
        ("100 %", 1.0, True, 0.5, "100 %"),
        ("0.1 %", 0.001, True, 0.0005, "0.1 %"),
    ],
)
def test_a_speed_limit_is_a_speed_or_a_share(
    text: str, limit: float, is_share: bool, of_half: float, written: str
) -> None:
    found = zone(f"speed_limit: {text}")
    assert found.speed_limit == pytest.approx(limit)
    assert found.is_share is is_share
    assert found.limit_mps(0.5) == pytest.approx(of_half)
    assert found.limit_text == written
    typed = {"kind": "slow", "polygon": SQUARE, "speed_limit": text}
    assert read_zone("rug", typed) == found


@pytest.mark.parametrize(
    "text", ["5000 %", "100.1 %", "0 %", "-50 %", "0 m/s", "-0.1 m/s", "100.1 m/s", "361 km/h"]
)
def test_a_speed_limit_that_limits_nothing_is_refused(text: str) -> None:
    with pytest.raises(
        ConfigError, match=r"speed_limit must be more than nothing, and at most 100 %.*0\.2 m/s, 50 %"
    ):
        zone(f"speed_limit: {text}")


@pytest.mark.parametrize("text", ["0.5", "50 percent", "fast", "2 m"])
def test_a_speed_limit_without_a_unit_of_speed_is_refused(text: str) -> None:
    with pytest.raises(ConfigError, match=r"speed_limit must be a number with its unit.*0\.2 m/s, 50 %"):
        zone(f"speed_limit: {text}")


def test_a_slow_zone_needs_a_limit_and_a_keep_out_zone_has_none() -> None:
    head = "hotspots:\nzones:\n"
    (problem,) = problems(f"{head}  - {{label: rug, kind: slow, polygon: {SQUARE}}}")
    assert "home.yaml:3:5: a slow zone needs a 'speed_limit'" in problem
    assert "speed_limit: 0.2 m/s, speed_limit: 50 %" in problem
    (problem,) = problems(f"{head}  - {{label: rug, kind: keep_out, polygon: {SQUARE}, speed_limit: 1 m/s}}")
    assert "a keep_out zone has no speed_limit (would have worked: kind: slow)" in problem
    closed = zone("", "keep_out")
    assert (closed.kind, closed.limit_text, closed.speed_limit) == (KEEP_OUT, "", 0.0)


def test_a_zone_without_a_kind_is_told_that_and_nothing_of_its_limit() -> None:
    (problem,) = problems(f"hotspots:\nzones:\n  - {{label: a, polygon: {SQUARE}, speed_limit: 1 m/s}}")
    assert "'kind' is missing" in problem


def test_a_file_has_at_most_so_many_zones() -> None:
    def zones(count: int) -> str:
        lines = [f"  - {{label: z{n}, kind: keep_out, polygon: {SQUARE}}}" for n in range(count)]
        return "\n".join(["hotspots:", "zones:", *lines])

    assert len(parse_hotspots(zones(MAX_ZONES)).zones) == MAX_ZONES
    places = parse_places(zones(MAX_ZONES + 1).encode(), FILE)
    assert [problem.problem for problem in places.problems] == [
        f"{MAX_ZONES + 1} zones; at most 100 are read"
    ]
    assert [zone.label for zone in places.hotspots.zones] == [f"z{n}" for n in range(MAX_ZONES)]


# ---- labels and what is wrong --------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("label", "kind"),
    [
        ("kitchen", "room"),
        ("Living_Room", "room"),
        ("livingroom", "room"),
        ("bedroom 2", "room"),
        ("bedroom12", "room"),
        ("Guest-Room 3", "room"),
        ("room 0", "room"),
        ("2", "object"),
        ("kitchen table", "object"),
        ("2 kitchen", "object"),
        ("bed", "object"),
        ("bedroom 2 window", "object"),
    ],
)
def test_a_taught_hotspot_is_a_room_when_it_is_called_like_one(label: str, kind: str) -> None:
    assert kind_of_new(label) == kind


def test_names_of_rooms_may_be_ones_own() -> None:
    assert kind_of_new("Stube 2", ["stube"]) == "room"
    assert kind_of_new("kitchen", ["stube"]) == "object"


def test_a_key_that_was_meant_to_be_the_label_is_told() -> None:
    (problem,) = problems("hotspots:\n  - {lable: hall, x: 1, y: 2}")
    assert problem == "home.yaml:2:6: 'lable' is not known here (would have worked: label)"
    (problem,) = problems("hotspots:\n  - {colour: red, x: 1, y: 2}")
    assert problem == "home.yaml:2:5: 'label' is missing (would have worked: label: ...)"


def test_everything_that_is_wrong_is_told_in_the_order_of_the_file() -> None:
    text = (
        "zones:\n  - {label: rug, kind: soft, polygon: [[0, 0]]}\n"
        "hotspots:\n  - {label: a, x: one, y: 2}\n  - 7\n"
        "  - {label: b, x: 1, y: 2}\n  - {label: b, x: 3, y: 4}\n"
    )
    places = parse_places(text.encode(), FILE)
    assert [(problem.line, problem.column) for problem in places.problems] == [
        (2, 24),
        (2, 39),
        (4, 19),
        (5, 5),
        (7, 5),
    ]
    assert "the label 'b' is there twice (first in line 6)" in str(places.problems[-1])
    assert [(spot.label, spot.pose) for spot in places.hotspots] == [
        ("a", Pose2(0.0, 2.0)),
        ("b", Pose2(1.0, 2.0)),
    ], "what is wrong has a default in its place"
    with pytest.raises(ConfigError) as caught:
        places.sound()
    assert (caught.value.line, caught.value.column) == (2, 24)
    assert "florence hotspot check tells 4 more" in str(caught.value)


def test_one_problem_alone_has_no_more() -> None:
    with pytest.raises(ConfigError) as caught:
        parse_hotspots("hotspots:\n  - {label: a, x: one, y: 2}", FILE)
    assert "more" not in str(caught.value)


def test_an_entry_is_found_by_section_and_label() -> None:
    places = parse_places(
        f"hotspots:\n  - {{label: hall, x: 1, y: 2}}\nzones:\n"
        f"  - {{label: rug, kind: keep_out, polygon: {SQUARE}}}".encode(),
        FILE,
    )
    assert places.entry("hotspots", "hall").position.line == 2
    assert places.entry("zones", "rug").position.line == 4
    assert places.hotspots.position_of("hall").line == 2
    assert places.hotspots.position_of("nowhere").line == 1
    for section, label, problem in (
        ("hotspots", "hal", "there is no hotspot 'hal' (would have worked: hall)"),
        ("zones", "rag", "there is no zone 'rag' (would have worked: rug)"),
    ):
        with pytest.raises(ConfigError) as caught:
            places.entry(section, label)
        assert problem in str(caught.value)


def test_values_that_were_typed_one_by_one_are_read_as_those_of_a_file() -> None:
    known = read_hotspot("desk", {"x": "1", "y": "2 m", "phi": "1.5", "kind": "object"})
    assert known == Hotspot("desk", Pose2(1.0, 2.0, 1.5), "object")
    moved = read_hotspot("desk", {"y": "3", "yaw": "90 deg"}, known)
    assert moved.pose == Pose2(1.0, 3.0, math.pi / 2)
    assert moved.kind == "object"
    for values, problem in (
        ({"x": "1"}, "'y' is missing"),
        ({"x": "1", "y": "far"}, "y must be a finite number"),
        ({"x": "1", "y": "["}, "y: "),
    ):
        with pytest.raises(ConfigError) as caught:
            read_hotspot("desk", values)
        assert problem in str(caught.value)
        assert caught.value.file is None, "nobody typed a file"


def test_a_turned_heading_is_kept_within_a_turn() -> None:
    """What was added up by a program may be many turns; a file holds one."""
    spot = read_hotspot("a", {"x": "0", "y": "0"}, Hotspot("a", Pose2(0.0, 0.0, 3.0 * math.tau + 1.0)))
    assert spot.pose.yaw == pytest.approx(1.0)


def test_labels_are_kept_in_order_and_rooms_are_those_alone() -> None:
    spots = Hotspots([Hotspot("hall", Pose2()), Hotspot("tv", Pose2(), "object"), Hotspot("attic", Pose2())])
    assert spots.by_name() == {"hotspot": ["hall", "tv", "attic"], "room": ["hall", "attic"]}
    copy = spots.copy()
    copy.put(Hotspot("sofa", Pose2(), "object"))
    copy.put(Hotspot("hall", Pose2(1.0, 0.0)))
    assert copy.labels() == ("hall", "tv", "attic", "sofa")
    assert spots.labels() == ("hall", "tv", "attic")
    hall = spots.get("hall")
    assert hall is not None and hall.pose == Pose2(), "a copy is another list"


# ---- polygons and masks --------------------------------------------------------------------------------


def box(x0: float, y0: float, x1: float, y1: float) -> tuple[tuple[float, float], ...]:
    return ((x0, y0), (x1, y0), (x1, y1), (x0, y1))


def test_a_point_is_inside_or_not_by_all_edges() -> None:
    triangle = ((0.0, 0.0), (4.0, 0.0), (0.0, 2.0))
    assert contains(triangle, 1.0, 1.0) and contains(triangle, 3.5, 0.2)
    assert not contains(triangle, 3.0, 1.0) and not contains(triangle, -0.1, 1.0)
    assert not contains(triangle, 1.0, -0.1) and not contains(triangle, 1.0, 2.1)
    assert not contains((), 0.0, 0.0)


def test_areas_do_not_depend_on_the_direction_of_the_corners() -> None:
    triangle = ((1.0, 1.0), (4.0, 1.0), (1.0, 3.0))
    assert area(triangle) == area(triangle[::-1]) == pytest.approx(3.0)
    assert area(box(-2.0, -1.0, 1.0, 1.0)) == pytest.approx(6.0)


@pytest.mark.parametrize(
    ("polygon", "crossing"),
    [
        (box(0, 0, 2, 1), None),
        (((0, 0), (4, 0), (4, 2), (2, 2), (2, 4), (0, 4)), None),
        (((0, 0), (4, 0), (4, 4), (2, -1), (0, 4)), (1, 3)),
        (((0, 0), (4, 0), (4, 4), (2, 0), (0, 4)), (1, 3)),  # a corner that touches another edge
        (((0, 0), (4, 0), (4, 4), (2, 0.1), (0, 4)), None),
        (((0, 0), (4, 4), (4, 0), (3, 1), (0, 4)), (1, 4)),
        (((0, 0), (1, 0), (1, 1), (5, 1), (5, 5), (-1, 5), (-1, 1), (0, 1)), None),
        (((0, 2), (2, 4), (2, 0), (0, 2.5), (-1, 4)), (1, 3)),
        (((0, 0), (4, 0), (4, 3), (1, 3), (1, -1)), (1, 4)),
    ],
)
def test_edges_that_meet_are_named(
    polygon: tuple[tuple[float, float], ...], crossing: tuple[int, int] | None
) -> None:
    assert crossing_edges(polygon) == crossing


def test_what_two_polygons_share_is_measured() -> None:
    triangle = ((0.0, 0.0), (4.0, 0.0), (0.0, 4.0))
    assert common_area(triangle, triangle) == pytest.approx(8.0, rel=0.01)
    assert common_area(triangle, box(1.0, 1.0, 9.0, 9.0)) == pytest.approx(2.0, rel=0.02)
    assert common_area(box(0, 0, 3, 3), box(2, 2, 5, 5)) == pytest.approx(1.0, rel=0.01)
    assert common_area(box(0, 0, 1, 1), box(1.5, 0, 2, 1)) == 0.0
    assert common_area(box(0, 0, 1, 1), box(0, 1.5, 1, 2)) == 0.0
    notched = ((0.0, 0.0), (6.0, 0.0), (6.0, 3.0), (4.0, 3.0), (4.0, 1.0), (2.0, 1.0), (2.0, 3.0), (0.0, 3.0))
    assert common_area(notched, box(1.0, 1.0, 5.0, 2.0)) == pytest.approx(2.0, rel=0.01)


def test_the_distance_to_a_polygon_is_that_to_its_nearest_edge() -> None:
    square = box(0.0, 0.0, 2.0, 2.0)
    assert distance_to(square, 1.0, 1.0) == 1.0
    assert distance_to(square, 1.0, 0.25) == 0.25
    assert distance_to(square, 5.0, 6.0) == 5.0
    assert distance_to(square, -1.0, 1.0) == 1.0
    slanted = ((0.0, 0.0), (4.0, 3.0), (-3.0, 4.0))
    assert distance_to(slanted, 4.0 + 0.6, 3.0 - 0.8) == pytest.approx(1.0)
    assert distance_to(slanted, 2.0 + 0.6, 1.5 - 0.8) == pytest.approx(1.0)
    assert distance_to(((1.0, 1.0), (1.0, 1.0), (1.0, 1.0)), 4.0, 5.0) == 5.0


GRID = OccupancyGrid(0.5, Pose2(-1.0, 2.0), np.full((6, 8), -1, np.int8))
"""x from -1 to 3, y from 2 to 5."""


def test_a_keep_out_mask_is_100_in_the_zones_and_0_elsewhere() -> None:
    zones = [
        Zone("a", KEEP_OUT, box(-1.0, 2.0, 0.0, 2.5)),
        Zone("b", SLOW, box(-1.0, 2.0, 3.0, 5.0), 0.2),
        Zone("c", KEEP_OUT, box(2.5, 4.5, 9.0, 9.0)),
    ]
    mask = keep_out_mask(zones, GRID)
    assert (mask.resolution, mask.origin) == (0.5, GRID.origin)
    wanted = np.zeros((6, 8), np.int8)
    wanted[0, :2] = wanted[5, 7] = 100
    assert mask.cells.tolist() == wanted.tolist()


def test_a_speed_mask_has_the_lowest_limit_in_centimetres_a_second() -> None:
    left, right = box(-1.0, 2.0, 1.0, 2.5), box(0.0, 2.0, 3.0, 2.5)
    zones = [
        Zone("slow", SLOW, left, 0.2),
        Zone("half", SLOW, right, 0.5, is_share=True),
        Zone("closed", KEEP_OUT, box(-1.0, 4.5, 3.0, 5.0)),
    ]
    for order in (zones, zones[::-1]):
        mask = speed_mask(order, GRID, 0.6)
        assert mask.cells[0].tolist() == [20, 20, 20, 20, 30, 30, 30, 30]
        assert not mask.cells[1:].any()
    for limit, value in ((0.001, 1), (0.004, 1), (1.0, 100), (5.0, 100), (0.126, 13)):
        assert speed_mask([Zone("z", SLOW, left, limit)], GRID, 0.6).cells[0, 0] == value
