import math

import numpy as np
import pytest

from florence_bt.core.errors import ConfigError, SimulationError
from florence_bt.core.geometry import Pose2, angle_difference
from florence_bt.simulation.home.flat import load_flat
from florence_bt.simulation.home.people import PersonSpec
from florence_bt.simulation.home.world import SimulatedWorld
from tests.unit.simulation.mujoco_rays import cast

HALL = Pose2(8.9, 2.95, math.pi)


@pytest.fixture(scope="module")
def flat():
    return load_flat()


def test_the_robot_stands_still_without_a_command(flat):
    world = SimulatedWorld(flat)
    world.step_to(5.0)
    assert world.time == pytest.approx(5.0)
    assert world.robot_pose.distance_to(flat.start) < 1e-6
    assert world.travel() == pytest.approx((0.0, 0.0), abs=1e-9)
    assert world.contacts == [] and world.bumpers() == (False, False)


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_it_drives_straight(flat, seed):
    world = SimulatedWorld(flat, seed=seed)
    world.set_wheels(0.3, 0.3)
    world.step_to(8.0)
    left, right = world.travel()
    assert left == pytest.approx(0.3 * 8, rel=0.02) and right == pytest.approx(left, rel=1e-3)
    pose = world.robot_pose
    assert HALL.x - pose.x == pytest.approx(left, rel=0.02)
    assert pose.y == pytest.approx(HALL.y, abs=0.01)
    assert world.yaw_rate() == pytest.approx(0.0, abs=0.01)
    world.set_wheels(0.0, 0.0)
    world.step_to(9.0)
    assert world.robot_pose.distance_to(pose) < 0.05
    assert world.contacts == []


@pytest.mark.parametrize("rate", [0.5, -1.2])
def test_it_turns_on_the_spot(flat, rate):
    world = SimulatedWorld(flat, start=Pose2(3.3, 5.2, 0.3))
    world.set_wheels(-rate * 0.13, rate * 0.13)
    world.step_to(2.0)
    assert world.yaw_rate() == pytest.approx(rate, rel=0.03)
    left, right = world.travel()
    assert angle_difference(world.robot_pose.yaw, 0.3) == pytest.approx((right - left) / 0.26, rel=0.02)
    assert world.robot_pose.distance_to(Pose2(3.3, 5.2)) < 0.01


def test_unstable_physics_is_an_error_and_leaves_no_file(flat, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    world = SimulatedWorld(flat)
    world.set_wheels(math.nan, math.nan)
    world.step_to(1.0)
    assert world.robot_pose.distance_to(flat.start) < 1e-3  # MuJoCo takes no such command
    world._data.qvel[0] = math.nan
    world.set_wheels(0.1, 0.1)
    with pytest.raises(SimulationError, match=r"unstable before 1\.1 s"):
        world.step_to(1.1)
    assert list(tmp_path.iterdir()) == []


def test_wheels_have_a_highest_speed(flat):
    world = SimulatedWorld(flat)
    world.set_wheels(2.0, 2.0)
    world.step_to(1.0)
    fast = world.travel()[0]
    world.step_to(2.0)
    assert world.travel()[0] - fast == pytest.approx(0.5, rel=0.02)


@pytest.mark.parametrize(
    ("yaw", "pressed"),
    [(math.pi / 2, (True, True)), (math.pi / 2 - 0.7, (True, False)), (math.pi / 2 + 0.7, (False, True))],
)
def test_a_wall_is_a_contact_and_presses_the_bumper(flat, yaw, pressed):
    world = SimulatedWorld(flat, start=Pose2(7.15, 3.3, yaw))
    world.set_wheels(0.3, 0.3)
    seen = (False, False)
    for step in range(1, 400):
        world.step_to(0.015 * step)
        if any(world.bumpers()):
            seen = world.bumpers()
            break
    assert seen == pressed
    assert [contact.name for contact in world.contacts] == ["middle_wall"]
    assert world.contacts[0].position[1] == pytest.approx(3.7, abs=0.02)
    world.step_to(world.time + 2.0)
    assert len(world.contacts) == 1, "leaning on a wall is one contact"
    world.set_wheels(-0.2, -0.2)
    world.step_to(world.time + 1.0)
    assert world.bumpers() == (False, False)
    world.set_wheels(0.3, 0.3)
    world.step_to(world.time + 3.0)
    assert len(world.contacts) == 2


def test_driving_backwards_into_a_wall_presses_no_bumper(flat):
    world = SimulatedWorld(flat, start=Pose2(5.6, 2.8, -math.pi / 2))
    world.set_wheels(-0.3, -0.3)
    world.step_to(4.0)
    assert world.contacts and world.bumpers() == (False, False)


def test_the_body_hits_the_table_top_above_the_laser(flat):
    world = SimulatedWorld(flat, start=Pose2(1.9, 3.3, -math.pi / 2))
    world.set_wheels(0.3, 0.3)
    world.step_to(4.0)
    assert world.contacts[0].name == "dining_table"
    assert world.contacts[0].position[2] > 0.7
    assert world.bumpers() == (False, False)


def test_driving_into_a_person_is_a_contact_with_that_name(flat):
    world = SimulatedWorld(flat, people=[PersonSpec("ann", Pose2(7.0, 2.95))])
    world.set_wheels(0.3, 0.3)
    world.step_to(8.0)
    assert world.contacts[0].name == "ann"
    assert world.robot_pose.distance_to(Pose2(7.0, 2.95)) > 0.2


def test_a_walking_person_stops_for_the_robot(flat):
    walker = PersonSpec("bob", Pose2(5.5, 2.95), "walking", ((9.0, 2.95),), speed=0.6)
    world = SimulatedWorld(flat, people=[walker])
    world.step_to(2.0)
    assert world.person_pose("bob").x == pytest.approx(6.7, abs=0.03)
    world.step_to(12.0)
    assert world.person_pose("bob").x == pytest.approx(8.3, abs=0.03)
    assert world.contacts == []
    ranges, rows = cast(world, np.array([5.0, 2.95, 1.0]), np.array([[1.0, 0.0, 0.0]]), 10.0)
    assert world.scene.names[rows[0]] == "bob" and ranges[0] == pytest.approx(3.3 - 0.11, abs=0.05)


def test_unknown_and_double_names_are_refused(flat):
    ann = PersonSpec("ann", Pose2(7.0, 2.95))
    world = SimulatedWorld(flat, people=[ann])
    assert world.person_pose("ann") == ann.pose
    with pytest.raises(ConfigError, match="ann"):
        world.person_pose("anna")
    with pytest.raises(ConfigError, match="taken"):
        SimulatedWorld(flat, people=[ann, ann])
    with pytest.raises(ConfigError, match="taken"):
        SimulatedWorld(flat, people=[PersonSpec("sofa", Pose2(7.0, 2.95))])


def test_cast_meets_walls_but_never_the_robot(flat):
    world = SimulatedWorld(flat)
    directions = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, -1.0], [-1.0, 0.0, 0.0]])
    origin = np.array([8.9, 2.95, 0.5])
    ranges, rows = cast(world, origin, directions, 3.0)
    assert ranges[1] == pytest.approx(0.75) and world.scene.names[rows[1]] == "middle_wall"
    assert ranges[2] == pytest.approx(0.5) and world.scene.names[rows[2]] == "floor"
    assert ranges[0] == pytest.approx(1.02) and world.scene.names[rows[0]] == "front_door"
    assert math.isinf(ranges[3]) and rows[3] == -1


def test_the_past_changes_nothing(flat):
    world = SimulatedWorld(flat)
    world.set_wheels(0.3, 0.3)
    world.step_to(1.0)
    pose = world.robot_pose
    world.step_to(0.5)
    assert world.robot_pose == pose and world.time == pytest.approx(1.0)


def drive_around(flat, seed, chunks):
    world = SimulatedWorld(
        flat, people=[PersonSpec("bob", Pose2(5.5, 2.6), "walking", ((7.0, 2.6),))], seed=seed
    )
    for index, (left, right) in enumerate([(0.3, 0.3), (0.1, 0.3), (0.5, 0.2), (-0.2, 0.2)]):
        world.set_wheels(left, right)
        for part in range(1, chunks + 1):
            world.step_to(2.0 * (index + part / chunks))
    return world


def test_same_seed_same_numbers_bit_for_bit(flat):
    first, second, other = drive_around(flat, 3, 1), drive_around(flat, 3, 10), drive_around(flat, 4, 1)
    assert first.robot_pose == second.robot_pose
    assert first.travel() == second.travel() and first.yaw_rate() == second.yaw_rate()
    assert first.contacts == second.contacts and first.person_pose("bob") == second.person_pose("bob")
    assert first.robot_pose != other.robot_pose


def test_a_world_at_rest_stands_still_until_the_wheels_are_driven(flat):
    world = SimulatedWorld(flat)
    assert not world.resting  # it has yet to settle on its wheels
    world.step_to(2.0)
    assert world.resting
    pose = world.robot_pose
    world.step_to(60.0)
    assert (world.time, world.robot_pose) == (pytest.approx(60.0), pose)
    world.set_wheels(0.2, 0.2)
    assert not world.resting
    world.step_to(61.0)
    assert pose.distance_to(world.robot_pose) > 0.1
    world.set_wheels(0.0, 0.0)
    assert not world.resting  # it still rolls
    world.step_to(63.0)
    assert world.resting


def test_nothing_rests_while_somebody_walks(flat):
    walker = PersonSpec("Ada", Pose2(2.0, 2.0), "walking", route=((3.0, 2.0),))
    world = SimulatedWorld(flat, people=[walker])
    world.step_to(3.0)
    assert not world.resting
