"""Simulated depth pictures of generated homes, and what each pixel shows.

So that the network learns people and not the solids of the simulation, bodies and furniture are bent and
stretched, and heaps of random things are put in the way.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from florence_bt.app.bringup.simulated import robot_frames
from florence_bt.core.errors import FlorenceError
from florence_bt.core.geometry import Pose2
from florence_bt.core.sensing import CameraModel, DepthImage
from florence_bt.core.transforms import Transform3
from florence_bt.drivers.kinect.codec import metres_from_raw
from florence_bt.simulation.home.flat import Flat
from florence_bt.simulation.home.free_space import FreeSpace, free_space_of
from florence_bt.simulation.home.generate import generated_flat
from florence_bt.simulation.home.person import PersonSpec
from florence_bt.simulation.home.situations import DECOYS, SITUATIONS, person_in
from florence_bt.simulation.home.world import SimulatedWorld
from florence_bt.simulation.rig.robot import BASE_FRAME, CAMERA_FRAME
from florence_bt.simulation.sensors._camera_kernels import cast_image
from florence_bt.simulation.sensors._image_kernels import to_raw
from florence_bt.simulation.sensors._surface_kernels import follow_pixels
from florence_bt.simulation.sensors.kinect_sensor import KinectNoiseParameters
from florence_bt.simulation.sensors.scene import BOX, CYLINDER, SPHERE, Lens, Shapes, reach_of
from florence_bt.skills.people.user_tracker.person_network import INPUT_SIZE, POSTURES, STRIDE, Pixels

FIRST_SEED = 1_000_000
"""The homes of the training have seeds from here; no trial and no test uses them."""

_SIGHT_M = 6.0
_ROBOT_M = 0.25
_KINECT = KinectNoiseParameters()

Random = np.random.Generator


@dataclass(frozen=True, slots=True)
class Picture:
    """A depth picture and the truth about it.

    Attributes:
        depth: The picture.
        optical_in_base: Takes points of the optical frame to the robot frame.
        robot: Where the robot stands, map frame.
        owner: Shape (height, width): which of the people a pixel shows, -1 for none or out of range.
        people: The people of the home.
        whole: How many pixels each would have if nothing were in front of them.
    """

    depth: DepthImage
    optical_in_base: Transform3
    robot: Pose2
    owner: NDArray[np.int64]
    people: Sequence[PersonSpec]
    whole: Sequence[int]


@dataclass(frozen=True, slots=True)
class Example:
    """The input of the network, and what it should say.

    Attributes:
        given: Shape (3, 120, 160), the network's input.
        person: Shape (60, 80), 1 person, 0 none, -1 not measured.
        middle: Shape (60, 80, 2), metres, as ``NetworkOutput.middle``; 0 where no person is.
        posture: Shape (60, 80), index of ``POSTURES``; -1 where no person is.
    """

    given: NDArray[np.float16]
    person: NDArray[np.int8]
    middle: NDArray[np.float16]
    posture: NDArray[np.int8]


def pictures_of_home(
    seed: int,
    count: int,
    *,
    scenes: int = 4,
    width: int = INPUT_SIZE[0],
    bent: bool = True,
    situations: Sequence[str] = tuple(SITUATIONS),
    empty: bool = False,
) -> Iterator[Picture]:
    """Yield pictures of one home with changing people in it.

    Args:
        seed: Chooses home, people and all noise.
        count: How many pictures.
        scenes: How many times people and things are placed again.
        width: Columns of the pictures.
        bent: Whether bodies and furniture are bent and heaps put in the way.
        situations: What people do.
        empty: Whether nobody is there.
    """
    rng = np.random.default_rng((seed, 77))
    flat = generated_flat(seed)
    mount = robot_frames().lookup(BASE_FRAME, CAMERA_FRAME)
    for _ in range(scenes):
        scene = _Scene(flat, [] if empty else list(_people(flat, rng, situations)), rng, bent=bent)
        for _ in range(count // scenes):
            yield scene.picture(mount, width, rng)


class _Scene:
    """A home with people, everything bent a little when asked."""

    def __init__(self, flat: Flat, people: list[PersonSpec], rng: Random, *, bent: bool) -> None:
        self._people = people
        self._bent = bent
        world = SimulatedWorld(flat, people=people)
        self._shapes = world.scene.shapes
        names = world.scene.names
        who = {spec.name: index for index, spec in enumerate(people)}
        self._owner = np.array([who.get(name, -1) for name in names] + [-1])
        self._space: FreeSpace = free_space_of(flat)
        self._decoys = [(s.x, s.y) for s in flat.solids if s.name.startswith(DECOYS)]
        if bent:
            self._bend(rng)
            self._heap_up(rng)
            self._shapes = self._shapes._replace(reach=reach_of(self._shapes.kind, self._shapes.size))

    def _bend(self, rng: Random) -> None:
        """Move, turn and stretch the parts of bodies and of small things by a little."""
        shapes = self._shapes
        small = (shapes.size.max(axis=1) < 0.8) & (shapes.kind <= max(SPHERE, CYLINDER, BOX))
        small[0] = False
        for row in np.flatnonzero(small & np.isfinite(shapes.reach)):
            shapes.size[row] *= (
                rng.uniform(0.8, 1.25, 3) if shapes.kind[row] == BOX else rng.uniform(0.8, 1.25)
            )
            shapes.position[row] += rng.normal(0.0, 0.015, 3)
            bend = Transform3.from_xyz_rpy((0, 0, 0), rng.normal(0.0, 0.09, 3)).rotation
            shapes.rotation[row] = bend @ shapes.rotation[row]

    def _heap_up(self, rng: Random) -> None:
        """Turn some parts of furniture into heaps and stacks of random solids in free places."""
        shapes = self._shapes
        movable = np.flatnonzero(
            (self._owner[:-1] < 0) & (shapes.size.max(axis=1) < 0.5) & (shapes.surface == 0)
        )
        movable = movable[movable > 0]
        for _ in range(int(rng.integers(0, 5))):
            rows = rng.choice(movable, min(len(movable), int(rng.integers(2, 6))), replace=False)
            x, y = self._free_point(rng, 0.1)
            self._decoys.append((x, y))
            low = 0.0
            for row in rows:
                shapes.kind[row] = rng.choice([BOX, CYLINDER, SPHERE])
                if shapes.kind[row] == SPHERE:
                    shapes.size[row] = (rng.uniform(0.06, 0.3), 0.0, 0.0)
                    half = shapes.size[row, 0]
                elif shapes.kind[row] == CYLINDER:
                    shapes.size[row] = (rng.uniform(0.02, 0.3), rng.uniform(0.05, 0.5), 0.0)
                    half = shapes.size[row, 1]
                else:
                    shapes.size[row] = rng.uniform(0.03, 0.4, 3)
                    half = shapes.size[row, 2]
                shapes.position[row] = (*rng.normal((x, y), 0.06), low + half)
                yaw = float(rng.uniform(-math.pi, math.pi))
                tilt = rng.normal(0.0, 0.1, 2)
                shapes.rotation[row] = Transform3.from_xyz_rpy((0, 0, 0), (*tilt, yaw)).rotation
                low += 2.0 * half * float(rng.uniform(0.7, 1.0))

    def _free_point(self, rng: Random, clearance: float) -> tuple[float, float]:
        x, y = self._space.frame.centres()
        cells = np.argwhere(self._space.clearance >= clearance)
        row, column = cells[int(rng.integers(len(cells)))]
        return float(x[column]), float(y[row])

    def picture(self, mount: Transform3, width: int, rng: Random) -> Picture:
        """Take a picture from a free place, mostly towards a person or something like one."""
        robot = self._view(rng)
        height = width * 3 // 4
        focal = 525.0 * width / 640
        camera = CameraModel(width, height, focal, focal, width / 2 - 0.5, height / 2 - 0.5)
        seen = mount
        if self._bent:
            turn = Transform3.from_xyz_rpy((0.0, 0.0, 0.0), rng.normal(0.0, (0.01, 0.03, 0.01))).rotation
            seen = Transform3(turn @ mount.rotation, mount.translation + rng.normal(0.0, (0.01, 0.01, 0.03)))
        place = Transform3.from_pose2(robot) @ seen
        depth, rows = _cast(self._shapes, place, camera)
        raw = np.empty(depth.shape, np.uint16)
        strength = float(rng.uniform(0.3, 1.2)) if self._bent else _KINECT.raw_noise
        noise = rng.standard_normal(depth.shape, np.float32) * np.float32(strength)
        chance = rng.random(depth.shape, np.float32)
        to_raw(depth, rows, noise, chance, _KINECT.min_depth_m, _KINECT.max_depth_m, raw)
        whole = (
            [] if self._bent else [self._pixels_alone(who, place, camera) for who in range(len(self._people))]
        )
        image = DepthImage(0.0, CAMERA_FRAME, camera, metres_from_raw(raw))
        owner = np.where(_measurable(depth), self._owner[rows], -1)
        return Picture(image, seen, robot, owner, self._people, whole)

    def _pixels_alone(self, who: int, place: Transform3, camera: CameraModel) -> int:
        mine = np.flatnonzero(self._owner[:-1] == who)
        alone = type(self._shapes)(*(values[mine] for values in self._shapes))
        depth, _ = _cast(alone, place, camera)
        return int(_measurable(depth).sum())

    def _view(self, rng: Random) -> Pose2:
        choice = rng.random()
        targets = [(spec.pose.x, spec.pose.y) for spec in self._people]
        if choice < 0.2 and self._decoys:
            targets = self._decoys
        if choice > 0.85 or not targets:
            return Pose2(*self._free_point(rng, _ROBOT_M), float(rng.uniform(-math.pi, math.pi)))
        aim = targets[int(rng.integers(len(targets)))]
        x, y = self._space.frame.centres()
        apart = np.hypot(x[None, :] - aim[0], y[:, None] - aim[1])
        near = (self._space.clearance >= _ROBOT_M) & (apart > 0.35) & (apart < float(rng.uniform(0.8, 4.5)))
        near &= apart > float(rng.uniform(0.35, 3.0))
        cells = np.argwhere(near)
        for _ in range(30):
            if not len(cells):
                break
            row, column = cells[int(rng.integers(len(cells)))]
            place = (float(x[column]), float(y[row]))
            if self._space.sees(place, aim) or rng.random() < 0.1:
                bearing = math.atan2(aim[1] - place[1], aim[0] - place[0])
                return Pose2(*place, bearing + float(rng.uniform(-0.55, 0.55)))
        return Pose2(*self._free_point(rng, _ROBOT_M), float(rng.uniform(-math.pi, math.pi)))


def _measurable(depth: NDArray[np.float32]) -> NDArray[np.bool_]:
    return (depth >= _KINECT.min_depth_m) & (depth <= _KINECT.max_depth_m)


def _cast(
    shapes: Shapes, place: Transform3, camera: CameraModel
) -> tuple[NDArray[np.float32], NDArray[np.int16]]:
    """Return exact depths and which shape each pixel shows."""
    depth = np.empty((camera.height, camera.width), np.float32)
    rows = np.empty(depth.shape, np.int16)
    lens = Lens(camera.fx, camera.cx, camera.cy)
    turn = np.ascontiguousarray(place.rotation)
    for measure in (cast_image, follow_pixels):
        measure(shapes, place.translation, turn, lens, _SIGHT_M, depth, rows)
    return depth, rows


def example_of(picture: Picture) -> Example:
    """Return what the network should say of a picture that has the size of its input."""
    pixels = Pixels.of(picture.depth, picture.optical_in_base)
    depth = pixels.depth[::STRIDE, ::STRIDE]
    points, rays = pixels.points[::STRIDE, ::STRIDE], pixels.rays[::STRIDE, ::STRIDE]
    owner = picture.owner[::STRIDE, ::STRIDE]
    person = np.where(np.isfinite(depth), (owner >= 0).astype(np.int8), np.int8(-1))
    middle = np.zeros((*depth.shape, 2), np.float16)
    posture = np.full(depth.shape, -1, np.int8)
    for index, spec in enumerate(picture.people):
        mine = (owner == index) & (person == 1)
        at = picture.robot.inverse().apply(spec.pose.x, spec.pose.y)
        away = np.array(at, np.float32) - points[..., :2][mine]
        ray = rays[mine]
        middle[mine, 0] = (away * ray).sum(axis=1)
        middle[mine, 1] = away[:, 1] * ray[:, 0] - away[:, 0] * ray[:, 1]
        posture[mine] = posture_of(spec)
    return Example(pixels.as_input().astype(np.float16), person, middle, posture)


def posture_of(spec: PersonSpec) -> int:
    """Return the index in ``POSTURES`` of what a person does."""
    if spec.posture in ("seated", "sitting") or spec.aid == "wheelchair":
        return POSTURES.index("sitting")
    return POSTURES.index("lying" if spec.posture == "lying" else "standing")


def _people(flat: Flat, rng: Random, situations: Sequence[str]) -> Iterator[PersonSpec]:
    """Place 0 to 3 people; walkers somewhere on their way."""
    for number in range(int(rng.choice([0, 1, 2, 3], p=[0.1, 0.35, 0.35, 0.2]))):
        try:
            spec = person_in(str(rng.choice(list(situations))), flat, rng)
        except FlorenceError:
            continue  # this home has no place for such a person
        if spec.route:
            points = [(spec.pose.x, spec.pose.y), *spec.route]
            leg = int(rng.integers(len(points) - 1))
            (x0, y0), (x1, y1) = points[leg], points[leg + 1]
            part = float(rng.random())
            heading = math.atan2(y1 - y0, x1 - x0)
            pose = Pose2(x0 + part * (x1 - x0), y0 + part * (y1 - y0), heading)
            spec = replace(spec, pose=pose, posture="standing", route=())
        yield replace(spec, name=f"person_{number}")
