"""People where people are, and what a perfect robot could do about them."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from florence_sweep.best_case import best_case

from florence_bt.core.errors import ConfigError
from florence_bt.core.geometry import Pose2
from florence_bt.simulation.home.flat import Solid, load_flat
from florence_bt.simulation.home.free_space import free_space_of
from florence_bt.simulation.home.generate import choose_flat
from florence_bt.simulation.home.people import place_person
from florence_bt.simulation.home.person import PersonSpec
from florence_bt.simulation.home.situations import (
    SITUATIONS,
    company_in,
    led_walk,
    lying,
    person_in,
    room_with_decoy,
)
from florence_bt.simulation.home.world import SimulatedWorld


@pytest.fixture(scope="module")
def flats():
    return [choose_flat(None, seed) for seed in (1, 2, 3)]


@pytest.fixture(scope="module")
def small():
    return load_flat()


def people(flats, situation, each=12):
    return [
        (flat, person_in(situation, flat, np.random.default_rng((index, number))))
        for index, flat in enumerate(flats)
        for number in range(each)
    ]


@pytest.mark.slow
@pytest.mark.parametrize("situation", SITUATIONS)
def test_a_seed_gives_the_same_person_in_a_room(flats, situation):
    placed = people(flats[:2], situation, 4)
    assert all(flat.room_at(spec.pose.x, spec.pose.y) is not None for flat, spec in placed)
    assert placed == people(flats[:2], situation, 4)
    assert len({spec for _, spec in placed}) > 4


@pytest.mark.slow
def test_a_company_is_two_or_three_people_apart_and_the_user_among_them(flats):
    sizes = set()
    for flat in flats:
        for seed in range(4):
            people = company_in(flat, np.random.default_rng(seed))
            assert people == company_in(flat, np.random.default_rng(seed))
            assert people[0].name == "user" and len({person.name for person in people}) == len(people)
            for first, second in itertools.combinations(people, 2):
                assert first.pose.distance_to(second.pose) >= 2.0
            sizes.add(len(people))
    assert sizes == {2, 3}


def test_the_easy_class_is_what_it_was(small):
    for seed in (1, 2, 3):
        easy = person_in("easy", small, np.random.default_rng(seed))
        assert easy == place_person(small, None, np.random.default_rng(seed))


def test_who_stands_is_in_nothing_and_sizes_and_clothes_differ(flats):
    placed = people(flats, "standing", 30)
    for flat, spec in placed:
        assert free_space_of(flat).clearance_at(spec.pose.x, spec.pose.y) >= 0.26
    heights = [spec.height for _, spec in placed]
    assert min(heights) < 1.3 and max(heights) > 1.85
    assert len({spec.shirt for _, spec in placed}) > 80 and {spec.posture for _, spec in placed} == {
        "standing",
        "leaning",
    }


@pytest.mark.slow
def test_who_sits_is_on_a_piece_of_furniture(flats):
    for flat, spec in people(flats, "sitting"):
        under = [
            solid
            for solid in flat.solids
            if math.dist((solid.x, solid.y), (spec.pose.x, spec.pose.y)) < 1.2
            and abs(solid.top - spec.surface) < 0.01
        ]
        assert spec.posture == "seated" and under, (flat.name, spec)


def test_who_lies_is_in_bed_or_on_the_floor(flats):
    specs = [spec for _, spec in people(flats, "lying")]
    assert {spec.surface > 0 for spec in specs} == {True, False}


def test_no_part_of_who_lies_is_where_the_robot_starts(flats):
    flat = replace(flats[0], start=flats[0].rooms[0].hotspot.pose, places=())
    rng = np.random.default_rng(1)
    start = flat.start.x, flat.start.y
    for _ in range(60):
        spec = lying(flat, rng)
        ends = [spec.pose.apply(part * spec.height, 0.0) for part in np.linspace(-0.5, 0.5, 15)]
        assert min(math.dist(each, start) for each in ends) > 0.5


def test_who_walks_gets_through_and_goes_to_another_room(flats):
    for flat, spec in people(flats, "walking", 4):
        space = free_space_of(flat)
        points = [(spec.pose.x, spec.pose.y), *spec.route]
        assert flat.room_at(*points[0]) != flat.room_at(*points[-1])
        for a, b in itertools.pairwise(points):
            for part in np.linspace(0.0, 1.0, 50):
                where = (a[0] + part * (b[0] - a[0]), a[1] + part * (b[1] - a[1]))
                assert space.clearance_at(*where) >= 0.2


@pytest.fixture(scope="module")
def led(small, flats):
    return [(flat, led_walk(flat, np.random.default_rng(3), 20.0)) for flat in (small, flats[1])]


def on_line(points):
    """Points every few centimetres along straight legs."""
    return [
        (a[0] + part * (b[0] - a[0]), a[1] + part * (b[1] - a[1]))
        for a, b in itertools.pairwise(points)
        for part in np.linspace(0.0, 1.0, max(2, math.ceil(math.dist(a, b) / 0.05)))
    ]


def test_beyond_the_home_nothing_fits(small):
    space = free_space_of(small)
    x, y = space.frame.centres()
    corner = (float(x[0]), float(y[0]))
    assert not space.fits((corner[0] - 3.0, corner[1]), corner, 0.0)
    assert not space.fits(corner, (float(x[-1]) + 3.0, float(y[-1]) + 3.0), 0.0)


@pytest.mark.slow
def test_a_led_walk_is_long_and_goes_through_doors_where_the_robot_fits(led):
    for flat, walk in led:
        points = [(walk.leader.pose.x, walk.leader.pose.y), *walk.leader.route]
        assert sum(math.dist(a, b) for a, b in itertools.pairwise(points)) >= 20.0
        space, way = free_space_of(flat), on_line(points)
        reached = space.reachable((walk.start.x, walk.start.y), 0.3)
        assert all(reached[space.frame.cell_of(*point)] for point in points)
        assert min(space.clearance_at(*point) for point in way) >= 0.2
        passed = {
            door.name for door in flat.doors for point in way if math.dist(point, (door.x, door.y)) < 0.4
        }
        assert len(passed) >= 2
        assert 0.25 <= walk.leader.speed <= 0.45 and walk.leader.once


def test_who_leads_stands_for_a_while_in_each_room_that_they_go_to(led):
    for flat, walk in led:
        stops = [
            (point, pause)
            for point, pause in zip(walk.leader.route, walk.leader.pauses, strict=True)
            if pause
        ]
        assert all(2.0 <= pause <= 6.0 for _, pause in stops)
        assert stops[-1][0] == walk.leader.route[-1]
        rooms = [flat.room_at(walk.leader.pose.x, walk.leader.pose.y)]
        rooms += [flat.room_at(*point) for point, _ in stops]
        assert all(a != b for a, b in itertools.pairwise(rooms))
    assert len(stops) >= 2


def test_the_robot_starts_before_the_leader_with_nothing_between(led):
    for flat, walk in led:
        leader = walk.leader.pose
        assert walk.start.distance_to(leader) == pytest.approx(1.2)
        assert walk.start.bearing_to(leader.x, leader.y) == pytest.approx(0.0, abs=1e-9)
        way = on_line([(walk.start.x, walk.start.y), (leader.x, leader.y)])
        assert min(free_space_of(flat).clearance_at(*point) for point in way) >= 0.25


def test_the_visitor_crosses_the_leaders_way(led):
    for _, walk in led:
        leader = on_line([(walk.leader.pose.x, walk.leader.pose.y), *walk.leader.route])
        visitor = on_line([(walk.visitor.pose.x, walk.visitor.pose.y), *walk.visitor.route])
        assert min(math.dist(a, b) for a in leader for b in visitor) < 0.06
        assert math.dist(visitor[0], visitor[-1]) >= 1.0 and not walk.visitor.once
        assert math.dist(visitor[0], leader[0]) > 1.5 and walk.visitor.name != walk.leader.name


def test_the_same_seed_leads_the_same_way(small, led):
    assert led_walk(small, np.random.default_rng(3), 20.0) == led[0][1]
    assert led_walk(small, np.random.default_rng(4), 20.0) != led[0][1]


@pytest.mark.slow
def test_aids_and_loads_come_up(flats):
    specs = [spec for _, spec in people(flats, "aided", 20)]
    assert {spec.aid for spec in specs} == {"none", "rollator", "wheelchair"}
    assert {spec.load for spec in specs} == {"none", "bag", "box"}
    assert {spec.posture for spec in specs} == {"standing", "walking"}


def test_unknown_situations_and_impossible_ones_say_what_would_have_worked(small):
    with pytest.raises(ConfigError, match="sitting"):
        person_in("siting", small, np.random.default_rng(1))


def test_nobody_is_looked_for_where_something_looks_like_a_person(flats):
    for flat in flats:
        room = flat.room(room_with_decoy(flat, np.random.default_rng(1)))
        assert any(room.contains(solid.x, solid.y) for solid in flat.solids)


def test_the_shortest_way_is_straight_where_nothing_is_and_goes_through_doors_else(small):
    space = free_space_of(small)
    way = space.shortest_way((8.0, 2.95), (6.0, 2.95), 0.3)
    assert len(way) == 2 and math.dist(way[0], (8.0, 2.95)) < 0.05 and math.dist(way[1], (6.0, 2.95)) < 0.05
    way = space.shortest_way((8.9, 2.95), (3.3, 5.2), 0.3)
    assert len(way) > 2
    doors = [(door.x, door.y) for door in small.doors]
    near = [
        math.dist(door, (a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])))
        for a, b in itertools.pairwise(way)
        for t in np.linspace(0, 1, 30)
        for door in doors
    ]
    assert min(near) < 0.4
    assert space.shortest_way((8.9, 2.95), (3.3, 5.2), 0.6) is None
    assert space.shortest_way((8.9, 2.95), (99.0, 5.2), 0.3) is None


def best(flat, spec):
    return best_case(flat, SimulatedWorld(flat, people=[spec]), spec, flat.start)


def test_a_perfect_robot_sees_who_stands_in_the_hall_and_gets_to_half_a_metre(small):
    found = best(small, PersonSpec("user", Pose2(6.0, 2.95)))
    assert found.visible and found.distance == 0.5
    assert found.way == pytest.approx(8.9 - 6.0 - 0.6, abs=0.15)


def test_to_who_sits_deep_it_gets_as_near_as_the_legs_let_it(small):
    sofa = PersonSpec("user", Pose2(1.5, 7.4, -math.pi / 2), "seated", surface=0.42)
    found = best(small, sofa)
    assert found.visible and 0.7 < found.distance < 1.2 and found.way > 5.0


@pytest.mark.parametrize(("posture", "nearest"), [("standing", 0.96), ("walking", None)])
def test_to_who_stands_behind_something_low_it_gets_as_near_as_that_lets_it(small, posture, nearest):
    ring = [
        Solid(
            "box",
            6.0 + 0.6 * math.cos(turn),
            2.95 + 0.6 * math.sin(turn),
            turn,
            (0.05, 0.6),
            0.0,
            0.0,
            0.3,
            (90, 90, 90),
        )
        for turn in (0.0, math.pi / 2, math.pi, -math.pi / 2)
    ]
    flat = replace(small, solids=(*small.solids, *ring))
    route = ((5.8, 2.95),) if posture == "walking" else ()
    found = best(flat, PersonSpec("user", Pose2(6.0, 2.95), posture, route))
    assert found.visible
    assert found.distance == (pytest.approx(nearest, abs=0.06) if nearest else None)


@pytest.mark.parametrize(("width", "nearest"), [(0.6, 1.4), (0.75, 0.5)])
def test_an_aisle_in_which_the_robot_could_hardly_turn_is_no_place_to_stand_in(small, width, nearest):
    walls = [
        Solid("wall", 6.5, 2.95 + side * (width / 2 + 0.05), 0.0, (0.7, 0.05), 0.0, 0.0, 1.2, (90, 90, 90))
        for side in (-1.0, 1.0)
    ]
    back = Solid("wall", 5.75, 2.95, 0.0, (0.05, width / 2 + 0.1), 0.0, 0.0, 1.2, (90, 90, 90))
    found = best(replace(small, solids=(*small.solids, *walls, back)), PersonSpec("user", Pose2(6.0, 2.95)))
    assert found.visible and found.distance == pytest.approx(nearest, abs=0.1)


@pytest.mark.parametrize(
    ("aid", "load", "ahead"),
    [("none", "bag", 0.5), ("none", "box", 0.81), ("rollator", "none", 0.97), ("wheelchair", "none", 0.91)],
)
def test_it_may_stand_before_what_somebody_has_ahead(small, aid, load, ahead):
    found = best(small, PersonSpec("user", Pose2(6.0, 2.95), aid=aid, load=load))
    assert found.distance == pytest.approx(ahead, abs=0.01)


def test_who_is_shut_in_can_be_neither_seen_nor_reached(flats):
    flat = next(flat for flat in (choose_flat(None, seed) for seed in range(1, 30)) if shut(flat))
    room = shut(flat)
    spec = PersonSpec("user", room.hotspot.pose)
    found = best(flat, spec)
    assert found.way is None and not found.visible


def shut(flat):
    """A room that the robot cannot get into, or None."""
    space = free_space_of(flat)
    ways = space.reachable((flat.start.x, flat.start.y), 0.2625)
    closed = [
        room
        for room in flat.rooms
        if not ways[space.frame.cell_of(room.hotspot.pose.x, room.hotspot.pose.y)]
        and room.name != "living_room"
    ]
    return closed[0] if closed else None


def test_a_person_behind_a_wall_is_not_seen_from_everywhere(small):
    spec = PersonSpec("user", Pose2(6.0, 2.95))
    world = SimulatedWorld(small, people=[spec])
    assert world.sees((8.0, 2.95, 0.54), "user", (6.0, 2.95, 1.1))
    assert not world.sees((9.0, 5.0, 0.54), "user", (6.0, 2.95, 1.1))
    with pytest.raises(ConfigError, match="user"):
        world.sees((0.0, 0.0, 0.5), "usr", (1.0, 1.0, 1.0))
