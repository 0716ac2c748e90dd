import math

import numpy as np
import pytest

from florence_bt.core.errors import ConfigError
from florence_bt.core.geometry import Pose2
from florence_bt.simulation.home.body import body_parts
from florence_bt.simulation.home.flat import load_flat
from florence_bt.simulation.home.free_space import free_space_of
from florence_bt.simulation.home.people import PersonSpec, approach_spots, place_person
from florence_bt.simulation.home.walker import Walker


@pytest.fixture(scope="module")
def flat():
    return load_flat()


@pytest.mark.parametrize("room", [None, "living_room", "kitchen", "bedroom", "bathroom", "hall", "study"])
def test_people_stand_free_and_can_be_approached(flat, room):
    space = free_space_of(flat)
    for seed in range(40):
        person = place_person(flat, room, np.random.default_rng(seed))
        where = flat.room_at(person.pose.x, person.pose.y)
        assert room is None or where.name == room
        assert space.clearance_at(person.pose.x, person.pose.y) >= 0.25
        hotspot = where.hotspot.pose
        assert flat.start.distance_to(person.pose) >= 0.8
        assert 1.1 <= hotspot.distance_to(person.pose) <= 3.9
        ways = space.reachable((hotspot.x, hotspot.y), 0.27, (person.pose.x, person.pose.y, 0.2))
        spots = approach_spots(person.pose, hotspot)
        assert any(ways[space.frame.cell_of(*spot)] for spot in spots)
        assert all(math.dist(spot, (person.pose.x, person.pose.y)) == pytest.approx(0.5) for spot in spots)


def test_the_same_seed_gives_the_same_person(flat):
    people = [place_person(flat, None, np.random.default_rng(7)) for _ in range(2)]
    assert people[0] == people[1]
    assert people[0] != place_person(flat, None, np.random.default_rng(8))


def test_all_rooms_and_postures_come_up(flat):
    people = [place_person(flat, None, np.random.default_rng(seed)) for seed in range(60)]
    assert {flat.room_at(person.pose.x, person.pose.y).name for person in people} == {
        room.name for room in flat.rooms
    }
    assert {person.posture for person in people} == {"standing", "sitting"}


def test_posture_can_be_chosen(flat):
    person = place_person(flat, "kitchen", np.random.default_rng(1), name="ann", posture="sitting")
    assert person.name == "ann" and person.posture == "sitting"
    assert person.pose in [seat.pose for seat in flat.seats if seat.room == "kitchen"]
    with pytest.raises(ConfigError, match="no place for a sitting person in 'study'"):
        place_person(flat, "study", np.random.default_rng(1), posture="sitting")


def test_unknown_room_lists_the_rooms(flat):
    with pytest.raises(ConfigError, match="kitchen"):
        place_person(flat, "kitchem", np.random.default_rng(0))


@pytest.mark.parametrize(
    "wrong",
    [
        {"posture": "flying"},
        {"posture": "walking"},
        {"route": ((1.0, 2.0),)},
        {"speed": 0.0},
        {"height": 3.0},
        {"pose": Pose2(math.nan, 0.0)},
    ],
)
def test_senseless_people_are_refused(wrong):
    with pytest.raises(ConfigError):
        PersonSpec(**{"name": "x", "pose": Pose2(), **wrong})


@pytest.mark.parametrize(("posture", "limit"), [("standing", 0.18), ("sitting", 0.2)])
@pytest.mark.parametrize("height", [1.6, 1.8])
def test_bodies_keep_their_measures(posture, limit, height):
    for part in body_parts(PersonSpec("x", Pose2(), posture, height=height)):
        if part.shape == "box":
            reach = math.hypot(abs(part.x) + part.size[0], abs(part.y) + part.size[1])
        else:
            reach = math.hypot(part.x, part.y) + part.size[0]
        assert reach <= (limit if part.bottom < 0.6 else 0.25) + 1e-9, part
    top = max(part.top for part in body_parts(PersonSpec("x", Pose2(), posture, height=height)))
    assert top == pytest.approx(height if posture == "standing" else 1.26)


def test_walker_goes_there_and_back():
    walker = Walker(PersonSpec("x", Pose2(), "walking", ((1.0, 0.0), (1.0, 1.0)), speed=0.5))
    far = Pose2(100.0, 0.0)
    assert walker.advance(2.0, far) == Pose2(1.0, 0.0, math.pi / 2)
    here = walker.advance(1.0, far)
    assert (here.x, here.y) == pytest.approx((1.0, 0.5))
    here = walker.advance(2.0, far)
    assert (here.x, here.y, here.yaw) == pytest.approx((1.0, 0.5, -math.pi / 2))
    here = walker.advance(3.0, far)
    assert (here.x, here.y) == pytest.approx((0.0, 0.0))


def test_walker_waits_for_the_robot_and_walks_on():
    walker = Walker(PersonSpec("x", Pose2(), "walking", ((4.0, 0.0),), speed=0.5))
    for _ in range(500):
        walker.advance(0.02, Pose2(2.0, 0.0))
    assert walker.pose.x == pytest.approx(1.4, abs=0.011)
    walker.advance(0.02, Pose2(2.0, 3.0))
    assert walker.pose.x > 1.4


def test_route_to_nowhere_is_refused():
    with pytest.raises(ConfigError, match="nowhere"):
        Walker(PersonSpec("x", Pose2(1, 1), "walking", ((1.0, 1.0),)))
