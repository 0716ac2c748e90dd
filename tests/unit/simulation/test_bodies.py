import math

import numpy as np
import pytest

from florence_bt.core.errors import ConfigError
from florence_bt.core.geometry import Pose2
from florence_bt.simulation.home.body import body_parts
from florence_bt.simulation.home.flat import load_flat
from florence_bt.simulation.home.person import PersonSpec, forward_reach
from florence_bt.simulation.home.walker import Walker
from florence_bt.simulation.home.world import SimulatedWorld


def cloud(world, spec):
    """Points on the true surfaces of a person as MuJoCo has placed them: the corners of all parts, (n, 3)."""
    rows = [row for row, name in enumerate(world.scene.names) if name == spec.name]
    shapes = world.scene.shapes
    points = []
    for row in rows:
        half = {2: (shapes.size[row][0],) * 2 + (shapes.size[row][1],), 1: (shapes.size[row][0],) * 3}.get(
            int(shapes.kind[row]), tuple(shapes.size[row])
        )
        corners = np.array(np.meshgrid(*[(-h, h) for h in half])).reshape(3, -1).T
        points.append(shapes.position[row] + corners @ shapes.rotation[row].T)
    return np.concatenate(points)


@pytest.fixture(scope="module")
def flat():
    return load_flat()


@pytest.mark.parametrize("height", [0.95, 1.3, 1.95])
def test_a_body_is_as_tall_as_the_person(flat, height):
    spec = PersonSpec("x", Pose2(7.0, 3.0, 1.0), height=height)
    points = cloud(SimulatedWorld(flat, people=[spec]), spec)
    assert points[:, 2].max() == pytest.approx(height, abs=0.001)
    assert points[:, 2].min() == pytest.approx(0.0, abs=0.001)


@pytest.mark.parametrize("surface", [0.42, 0.52])
@pytest.mark.parametrize("height", [1.0, 1.5, 1.9])
def test_who_sits_sits_on_the_surface_and_not_in_the_floor(flat, surface, height):
    spec = PersonSpec("x", Pose2(7.0, 3.0, math.pi / 2), "seated", height=height, surface=surface)
    points = cloud(SimulatedWorld(flat, people=[spec]), spec)
    assert points[:, 2].min() >= -1e-3
    assert points[:, 2].max() == pytest.approx(surface + 0.52 * height, abs=0.01)
    assert points[:, 1].max() > 3.0 + 0.3 * height > points[:, 0].max() - 4.0, "the knees are before the hips"


@pytest.mark.parametrize("surface", [0.0, 0.5])
def test_who_lies_is_long_and_flat(flat, surface):
    spec = PersonSpec("x", Pose2(7.0, 3.0, 0.0), "lying", height=1.7, surface=surface)
    points = cloud(SimulatedWorld(flat, people=[spec]), spec)
    assert np.ptp(points[:, 0]) == pytest.approx(1.7, abs=0.1)
    assert points[:, 2].max() < surface + 0.3 and points[:, 2].min() >= surface - 0.01
    head = max(body_parts(spec), key=lambda part: part.x)
    assert head.shape == "sphere", "the head is where the person's pose points to"


@pytest.mark.parametrize(
    "extra", [{"aid": "rollator"}, {"aid": "wheelchair"}, {"load": "box"}, {"load": "bag"}]
)
def test_what_people_push_and_carry_stands_on_the_floor_before_them(flat, extra):
    spec = PersonSpec("x", Pose2(7.0, 3.0, 0.0), **extra)
    points = cloud(SimulatedWorld(flat, people=[spec]), spec)
    assert points[:, 2].min() >= -1e-3
    assert points[:, 0].max() - 7.0 <= forward_reach(spec) + 0.03


def test_who_pushes_something_stops_further_from_the_robot():
    robot = Pose2(2.0, 0.0)
    stops = {}
    for aid in ("none", "rollator"):
        walker = Walker(PersonSpec("x", Pose2(), "walking", ((4.0, 0.0),), aid=aid))
        for _ in range(500):
            walker.advance(0.02, robot)
        stops[aid] = walker.pose.x
    assert stops["none"] == pytest.approx(1.4, abs=0.011)
    assert 2.0 - 0.17 - stops["rollator"] > 0.66


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"posture": "flying"}, "standing"),
        ({"aid": "bicycle"}, "rollator"),
        ({"load": "piano"}, "bag"),
        ({"posture": "lying", "aid": "rollator"}, "stand or walk"),
        ({"height": 0.9}, "0.95"),
        ({"surface": 2.0}, "surface"),
    ],
)
def test_senseless_people_are_refused_with_what_would_have_worked(wrong, message):
    with pytest.raises(ConfigError, match=message):
        PersonSpec(**{"name": "x", "pose": Pose2(), **wrong})
