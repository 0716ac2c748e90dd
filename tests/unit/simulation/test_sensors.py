import math

import numpy as np
import pytest

from florence_bt.core.errors import ConfigError
from florence_bt.core.geometry import Pose2
from florence_bt.core.transforms import Transform3
from florence_bt.simulation.home.flat import load_flat
from florence_bt.simulation.home.people import PersonSpec
from florence_bt.simulation.home.world import SimulatedWorld
from florence_bt.simulation.sensors.kinect_sensor import KinectNoiseParameters, KinectSensor
from florence_bt.simulation.sensors.laser_sensor import LaserParameters, LaserSensor
from tests.unit.simulation.mujoco_rays import cast

UPSIDE_DOWN = Transform3.from_xyz_rpy((0.0573, 0.0, 0.13), (math.pi, 0.0, 0.0))
UPRIGHT = Transform3.from_xyz_rpy((0.0573, 0.0, 0.13), (0.0, 0.0, 0.0))
CAMERA = Transform3.from_xyz_rpy((-0.087, 0.018, 0.54), (-math.pi / 2, 0.0, -math.pi / 2))
QUIET = LaserParameters(noise_mm=0.0, noise_ratio=0.0, sure_range_m=5.6, drop_out=0.0)
STEP_RAD = 2 * math.pi / 1024


@pytest.fixture(scope="module")
def flat():
    return load_flat()


@pytest.fixture(scope="module")
def people():
    return [
        PersonSpec("ann", Pose2(4.4, 5.5, 2.0), shirt=(200, 20, 30)),
        PersonSpec("bob", Pose2(2.85, 6.75, -1.0), "sitting"),
    ]


def metres(raw):
    with np.errstate(divide="ignore"):
        z = 1.0 / (3.3309495161 - 0.0030711016 * raw.astype(float))
    return np.where(raw == 2047, np.nan, z)


def test_laser_ranges_are_the_distances_to_the_walls(flat):
    laser = LaserSensor(SimulatedWorld(flat, start=Pose2(6.7, 2.975, 0.0)), UPSIDE_DOWN, parameters=QUIET)
    scan = laser.measure()
    assert scan.dtype == np.int32 and scan.shape == (682,)
    front = 384 - 44
    assert scan[front] == pytest.approx((9.92 - 6.7 - 0.0573) * 1000, abs=2)
    assert scan[front + 256] == pytest.approx(725, abs=2), "hall wall, 90 degrees to the right"
    assert scan[front - 256] == pytest.approx(725, abs=2)
    angle = 100 * STEP_RAD
    assert scan[front + 256 - 100] == pytest.approx(725 / math.cos(angle), abs=3)


def test_upside_down_mirrors_the_scan(flat, people):
    world = SimulatedWorld(flat, people=people, start=Pose2(3.3, 5.2, 1.0))
    hanging = LaserSensor(world, UPSIDE_DOWN).true_ranges(44, 724)
    upright = LaserSensor(world, UPRIGHT).true_ranges(44, 724)
    assert not np.allclose(hanging, upright)
    assert np.allclose(hanging, upright[::-1], atol=1e-9)


@pytest.mark.parametrize("yaw", [0.0, 1.0, 2.5, 4.0])
@pytest.mark.parametrize(
    "mount", [UPSIDE_DOWN, UPRIGHT, Transform3.from_xyz_rpy((0, 0, 0.5), (0.1, 0.2, 0.3))]
)
def test_laser_agrees_with_general_ray_casting(flat, people, yaw, mount):
    pose = Pose2(3.3, 5.2, yaw)
    world = SimulatedWorld(flat, people=people, start=pose)
    ranges = LaserSensor(world, mount).true_ranges(0, 768)
    angles = (np.arange(769) - 384) * STEP_RAD
    place = Transform3.from_pose2(pose) @ mount
    directions = np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1) @ place.rotation.T
    expected, _ = cast(world, place.translation, directions, 5.6)
    assert np.array_equal(np.isinf(ranges), np.isinf(expected))
    seen = np.isfinite(ranges)
    assert np.allclose(ranges[seen], expected[seen], atol=1e-9)


def test_far_echoes_become_error_codes(flat):
    world = SimulatedWorld(flat, start=Pose2(4.6, 2.9, 0.0))
    scan = LaserSensor(world, UPSIDE_DOWN).measure()
    true = LaserSensor(world, UPSIDE_DOWN).true_ranges()
    assert np.isin(scan[np.isinf(true)], (0, 6, 7, 9)).all()
    weak = (true > 4.0) & np.isfinite(true)
    assert np.isin(scan[weak & (scan < 20)], (1, 2, 6, 7, 9)).all()
    near = true < 4.0
    assert (scan[near] < 20).mean() < 0.02
    good = near & (scan >= 20)
    assert np.abs(scan[good] / 1000 - true[good]).max() < 0.2


def test_laser_noise_has_the_stated_size(flat):
    laser = LaserSensor(SimulatedWorld(flat, start=Pose2(6.7, 2.975, 0.0)), UPSIDE_DOWN, seed=5)
    scans = np.array([laser.measure(384, 384 + 256) for _ in range(400)], float)
    scans[scans < 20] = np.nan
    assert np.nanstd(scans[:, 0]) == pytest.approx(31.6, rel=0.15)
    assert np.nanstd(scans[:, 256]) == pytest.approx(10.0, rel=0.15)
    lost = np.isnan(scans).mean()
    assert 0.001 < lost < 0.004


@pytest.mark.parametrize(("first", "last"), [(-1, 10), (10, 9), (0, 769)])
def test_steps_outside_of_the_scanner_are_refused(flat, first, last):
    with pytest.raises(ValueError, match="768"):
        LaserSensor(SimulatedWorld(flat), UPSIDE_DOWN).measure(first, last)


@pytest.mark.parametrize("size", [(160, 120), (320, 240)])
@pytest.mark.parametrize("pose", [Pose2(3.3, 5.2, 0.4), Pose2(3.15, 2.95, -2.6), Pose2(8.4, 1.35, -2.3)])
def test_depth_agrees_with_general_ray_casting(flat, people, size, pose):
    world = SimulatedWorld(flat, people=people, start=pose)
    kinect = KinectSensor(world, CAMERA, *size)
    camera = kinect.camera
    u, v = np.meshgrid(np.arange(camera.width), np.arange(camera.height))
    rays = np.stack([(u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, np.ones(u.shape)], axis=-1)
    lengths = np.linalg.norm(rays, axis=-1)
    place = Transform3.from_pose2(pose) @ CAMERA
    directions = (rays / lengths[..., None]).reshape(-1, 3) @ place.rotation.T
    expected, _ = cast(world, place.translation, directions, 20.0)
    with np.errstate(invalid="ignore"):
        expected = expected.reshape(u.shape) / lengths
    depth = kinect.true_depth()
    assert (np.isinf(depth) == np.isinf(expected)).mean() > 0.9999
    both = np.isfinite(depth) & np.isfinite(expected)
    assert np.isclose(depth[both], expected[both], atol=1e-4).mean() > 0.9999


def test_depth_of_a_wall(flat):
    world = SimulatedWorld(flat, start=Pose2(2.3, 4.9, math.pi / 2 + math.pi))
    raw, _ = KinectSensor(world, CAMERA).measure()
    assert raw.dtype == np.uint16 and raw.shape == (240, 320) and raw.max() <= 2047
    expected = 4.9 + 0.087 - 3.8
    middle = metres(raw[60:100, 120:155])
    assert np.nanmedian(middle) == pytest.approx(expected, abs=0.01)
    assert 0.001 < np.nanstd(middle) < 0.01
    bottom = metres(raw[239, 150:170])
    assert np.nanmedian(bottom) == pytest.approx(0.54 * 262.5 / 119.5, abs=0.02), "the floor"


def test_the_table_top_is_seen_where_the_laser_sees_nothing(flat):
    pose = Pose2(1.9, 3.3, -math.pi / 2)
    world = SimulatedWorld(flat, start=pose)
    ranges = LaserSensor(world, UPSIDE_DOWN).true_ranges()
    assert ranges[384 - 44] > 2.0
    depth = KinectSensor(world, CAMERA).true_depth()
    row = round(119.5 - 262.5 * (0.735 - 0.54) / (3.3 + 0.087 - 2.6))
    assert depth[row, 160] == pytest.approx(3.3 + 0.087 - 2.6, abs=0.03)


def test_a_person_is_seen_in_depth_and_colour(flat, people):
    pose = Pose2(3.0, 5.5, 0.0)
    with_people, alone = (SimulatedWorld(flat, people=who, start=pose) for who in (people, []))
    raw, rgb = KinectSensor(with_people, CAMERA).measure()
    empty, _ = KinectSensor(alone, CAMERA).measure()
    changed = np.abs(raw.astype(int) - empty.astype(int)) > 20
    assert changed.sum() > 3000
    assert np.nanmedian(metres(raw[changed])) == pytest.approx(1.4, abs=0.15)
    torso = rgb[40:70, 158:162].reshape(-1, 3).mean(axis=0)
    assert torso[0] > 3 * torso[1] and torso[0] > 80


def test_depth_outside_of_the_working_range_is_no_value(flat):
    world = SimulatedWorld(flat, start=Pose2(4.6, 2.975, 0.0))
    kinect = KinectSensor(world, CAMERA)
    raw, true = kinect.measure()[0], kinect.true_depth()
    assert (raw[true > 4.8] == 2047).mean() > 0.99
    assert (raw[(true > 0.6) & (true < 4.5)] != 2047).mean() > 0.97
    close = KinectSensor(SimulatedWorld(flat, start=Pose2(7.2, 3.4, math.pi / 2)), CAMERA)
    assert (close.measure_depth()[:120] == 2047).mean() > 0.99


@pytest.mark.parametrize("size", [(160, 120), (320, 240), (640, 480)])
def test_camera_model_scales_with_the_image(flat, size):
    camera = KinectSensor(SimulatedWorld(flat), CAMERA, *size).camera
    assert camera.fx == 525 * size[0] / 640
    assert (camera.cx, camera.cy) == (size[0] / 2 - 0.5, size[1] / 2 - 0.5)


def test_wrong_parameters_are_refused(flat):
    with pytest.raises(ConfigError, match="320 x 240"):
        KinectSensor(SimulatedWorld(flat), CAMERA, 320, 200)
    for wrong in ({"min_depth_m": 5.0}, {"raw_noise": -1.0}, {"colour_noise": 200}):
        with pytest.raises(ConfigError):
            KinectNoiseParameters(**wrong)
    for wrong in ({"noise_mm": -1.0}, {"sure_range_m": 9.0}, {"drop_out": 2.0}):
        with pytest.raises(ConfigError):
            LaserParameters(**wrong)


def test_same_seed_same_measurements(flat, people):
    def measure(seed):
        world = SimulatedWorld(flat, people=people, start=Pose2(3.3, 5.2, 0.5))
        laser, kinect = LaserSensor(world, UPSIDE_DOWN, seed), KinectSensor(world, CAMERA, 160, 120, seed)
        return [laser.measure(), *kinect.measure(), laser.measure(), kinect.measure_depth()]

    first, second, other = measure(1), measure(1), measure(2)
    assert all(np.array_equal(a, b) for a, b in zip(first, second, strict=True))
    assert not any(np.array_equal(a, b) for a, b in zip(first, other, strict=True))
    assert not np.array_equal(first[0], first[3])


def test_colours_may_follow_their_depth_image_or_be_left_out(people, flat):
    world = SimulatedWorld(flat, people=people, start=Pose2(3.3, 5.2, 0.5))
    both, apart, without = (KinectSensor(world, CAMERA, 160, 120, 3) for _ in range(3))
    depth, colours = both.measure()
    assert np.array_equal(apart.measure_depth(), depth) and np.array_equal(apart.colours(), colours)
    without.measure_depth()
    assert np.array_equal(without.measure_depth(), both.measure_depth()), "their noise is one of its own"


def test_colours_of_some_columns_and_rows_are_those_of_the_whole_image(people, flat):
    world = SimulatedWorld(flat, people=people, start=Pose2(3.3, 5.2, 0.5))
    whole, some = (KinectSensor(world, CAMERA, 320, 240, 3) for _ in range(2))
    colours = whole.measure()[1]
    some.measure_depth()
    assert np.array_equal(some.colours(2), colours[::2, ::2])


def test_sensors_follow_walking_people_and_the_robot(flat):
    walker = PersonSpec("bob", Pose2(5.5, 2.6), "walking", ((7.5, 2.6),), speed=0.5)
    world = SimulatedWorld(flat, people=[walker], start=Pose2(8.8, 2.6, math.pi))
    laser = LaserSensor(world, UPSIDE_DOWN)
    world.step_to(2.0)
    # The legs stand beside the middle beam.
    assert laser.true_ranges(364, 404).min() == pytest.approx(8.8 - 0.0573 - 6.5 - 0.06, abs=0.05)
    world.step_to(3.0)
    assert laser.true_ranges(364, 404).min() == pytest.approx(8.8 - 0.0573 - 7.0 - 0.06, abs=0.05)
