"""The simulated world: the flat, the robot on its wheels and the people, moved by MuJoCo.

No clock runs here: :meth:`SimulatedWorld.step_to` is given the time. The same seed and the same calls give
the same numbers, bit for bit.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from florence_bt.core.errors import ConfigError, SimulationError, closest_first
from florence_bt.core.geometry import Pose2, normalize_angle
from florence_bt.simulation.home.flat import Flat
from florence_bt.simulation.home.mjcf import (
    BASE_GEOM,
    SCENE_GROUP,
    TIMESTEP_S,
    WHEEL_RADIUS_M,
    build_mjcf,
)
from florence_bt.simulation.home.person import PersonSpec
from florence_bt.simulation.home.walker import Walker
from florence_bt.simulation.sensors.scene import (
    BOX,
    CYLINDER,
    PLANE,
    SPHERE,
    SURFACES,
    RayScene,
    Shapes,
    reach_of,
)

Point3 = tuple[float, float, float]

MAX_WHEEL_MPS = 0.5
"""Source: REFERENCE 1.3 (a wheel turns with at most 500 mm/s)."""

_SAME_TOUCH_S = 0.5
"""Touches of one thing with shorter gaps are one contact."""

_BUMPER_HOLD_S = 0.05
"""A pressed bumper springs back after this time; longer than a period of the sensor stream."""

_BUMPER_OVERLAP_RAD = math.radians(10.0)
"""A touch this near to straight ahead presses both sides."""

_WALK_STEPS = 5
"""Physics steps between two steps of a walking person."""

_REST_MPS = 1e-3
"""Slower than this (m/s and rad/s) is standing still; what is left then is the give of the tyres."""

_REST_STEPS = 50
"""Physics steps of standing still after which the robot is left alone until its wheels are driven again."""

# Without this MuJoCo writes each of its warnings into a file of the working folder.
mujoco.set_mju_user_warning(lambda text: None)

_UNSTABLE = [
    int(mujoco.mjtWarning.mjWARN_BADQPOS),
    int(mujoco.mjtWarning.mjWARN_BADQVEL),
    int(mujoco.mjtWarning.mjWARN_BADQACC),
]
"""MuJoCo's warnings of states that are not finite, or huge."""

_KINDS = {
    int(mujoco.mjtGeom.mjGEOM_PLANE): PLANE,
    int(mujoco.mjtGeom.mjGEOM_SPHERE): SPHERE,
    int(mujoco.mjtGeom.mjGEOM_CYLINDER): CYLINDER,
    int(mujoco.mjtGeom.mjGEOM_BOX): BOX,
}


@dataclass(frozen=True, slots=True)
class Contact:
    """The robot's body touched something other than the floor.

    Attributes:
        time: When, in seconds.
        name: The wall, the piece of furniture or the person.
        position: Where, map frame, metres.
    """

    time: float
    name: str
    position: tuple[float, float, float]


class SimulatedWorld:
    """The flat with the robot and people in it.

    Args:
        flat: The flat.
        people: Who is there.
        start: Where the robot stands at first; the flat's own start when not given.
        seed: Draws what differs between days: how well the tyres grip.

    Raises:
        ConfigError: Two people, or a person and a thing of the flat, share a name.
    """

    def __init__(
        self, flat: Flat, *, people: Sequence[PersonSpec] = (), start: Pose2 | None = None, seed: int = 0
    ) -> None:
        _check_names(flat, people)
        self.flat = flat
        self.people = tuple(people)
        self.contacts: list[Contact] = []
        """Every touch so far, oldest first."""
        friction = float(np.random.default_rng(seed).uniform(0.7, 1.0))
        text = build_mjcf(flat, people, flat.start if start is None else start, friction)
        self._model = mujoco.MjModel.from_xml_string(text)
        self._data = mujoco.MjData(self._model)
        self._steps = 0
        self._walkers = {
            mocap: Walker(spec, flat) for mocap, spec in enumerate(people) if spec.posture == "walking"
        }
        self._people_poses = [
            Pose2(spec.pose.x, spec.pose.y, normalize_angle(spec.pose.yaw)) for spec in people
        ]
        for mocap, walker in self._walkers.items():
            self._people_poses[mocap] = walker.pose
        self._floor = self._model.geom("floor").id
        self._base = self._model.geom(BASE_GEOM).id
        self._robot_body = self._model.body("robot").id
        self._last_touch: dict[str, int] = {}
        self._last_bump = [-(10**9), -(10**9)]
        self._driven = False
        self._still_steps = 0
        mujoco.mj_forward(self._model, self._data)
        self.scene = self._make_scene()

    @property
    def time(self) -> float:
        """Seconds since the start."""
        return self._steps * TIMESTEP_S

    @property
    def resting(self) -> bool:
        """Tell whether nothing moves: nobody walks, and the robot stands still and touches nothing."""
        return self._still_steps >= _REST_STEPS

    def step_to(self, time: float) -> None:
        """Let the world go on until a moment; the last whole physics step before it.

        Args:
            time: Seconds since the start; what has passed already changes nothing.

        Raises:
            SimulationError: The physics is no longer finite; nothing of the world can be trusted.
        """
        target = math.floor(time / TIMESTEP_S + 1e-6)
        moved = self._steps < target
        while self._steps < target and not self.resting:
            if self._walkers and self._steps % _WALK_STEPS == 0:
                self._walk()
            mujoco.mj_step(self._model, self._data)
            self._steps += 1
            touched = False
            for index, (first, second) in enumerate(self._data.contact.geom.tolist()):
                if first != self._floor:
                    self._touch(index, first, second)
                    touched = True
            self._still_steps = 0 if touched or self._moves() else self._still_steps + 1
        if any(self._data.warning.number[_UNSTABLE]):
            raise SimulationError(f"the physics became unstable before {self.time:.1f} s of simulated time")
        self._steps = max(self._steps, target)
        if moved and self._walkers:
            self._refresh_scene()

    def set_wheels(self, left_mps: float, right_mps: float) -> None:
        """Set the speeds that the wheels are driven to.

        Args:
            left_mps: Speed of the left tyre, m/s, forward positive; limited to 0.5.
            right_mps: Speed of the right tyre.
        """
        self._data.ctrl[0] = min(max(left_mps, -MAX_WHEEL_MPS), MAX_WHEEL_MPS) / WHEEL_RADIUS_M
        self._data.ctrl[1] = min(max(right_mps, -MAX_WHEEL_MPS), MAX_WHEEL_MPS) / WHEEL_RADIUS_M
        self._driven = left_mps != 0.0 or right_mps != 0.0
        if self._driven:
            self._still_steps = 0

    @property
    def wheels(self) -> tuple[float, float]:
        """The speeds that the left and the right tyre are driven to, m/s."""
        left, right = self._data.ctrl[:2] * WHEEL_RADIUS_M
        return float(left), float(right)

    @property
    def moving(self) -> bool:
        """Tell whether the robot drives faster than 0.01 m/s or turns faster than 0.02 rad/s."""
        speed, rate = np.hypot(*self._data.qvel[:2]), abs(self._data.qvel[5])
        return bool(speed > 0.01 or rate > 0.02)

    def travel(self) -> tuple[float, float]:
        """Return the metres that the left and the right wheel turned since the start (slip included)."""
        return float(self._data.qpos[7]) * WHEEL_RADIUS_M, float(self._data.qpos[8]) * WHEEL_RADIUS_M

    def yaw_rate(self) -> float:
        """Return how fast the robot truly turns, rad/s, counter-clockwise positive."""
        return float(self._data.qvel[5])

    def bumpers(self) -> tuple[bool, bool]:
        """Tell whether the left and the right half of the bumper are pressed."""
        since = self._steps - round(_BUMPER_HOLD_S / TIMESTEP_S)
        return self._last_bump[0] > since, self._last_bump[1] > since

    @property
    def robot_pose(self) -> Pose2:
        """Give the true pose of the robot: base_footprint in the map frame."""
        x, y, _, qw, qx, qy, qz = self._data.qpos[:7].tolist()
        return Pose2(x, y, math.atan2(2 * (qw * qz + qx * qy), 1 - 2 * (qy * qy + qz * qz)))

    def carry_robot(self, pose: Pose2) -> None:
        """Put the robot elsewhere, as somebody who lifts it: its wheels do not turn.

        Args:
            pose: base_footprint in the map frame; the robot has to fit there.
        """
        self._data.qpos[:2] = pose.x, pose.y
        self._data.qpos[3:7] = math.cos(pose.yaw / 2), 0.0, 0.0, math.sin(pose.yaw / 2)
        self._data.qvel[:6] = 0.0
        self._still_steps = 0
        mujoco.mj_forward(self._model, self._data)

    def person_pose(self, name: str) -> Pose2:
        """Return where a person is and looks, map frame.

        Raises:
            ConfigError: There is no such person; the message lists those that are there.
        """
        return self._people_poses[self._mocap_of(name)]

    def walks(self, name: str) -> bool:
        """Tell whether a person walks, or will: not at the end of a route that is walked once.

        Raises:
            ConfigError: There is no such person.
        """
        walker = self._walkers.get(self._mocap_of(name))
        return walker is not None and not walker.arrived

    def sees(self, eye: Point3, name: str, point: Point3) -> bool:
        """Tell whether nothing but a person is between an eye and a point of them; glass is in the way too.

        Args:
            eye: Map frame, metres.
            name: The person.
            point: Map frame, metres.

        Raises:
            ConfigError: There is no such person.
        """
        along = np.subtract(point, eye)
        group, met = np.zeros(6, np.uint8), np.full(1, -1, np.int32)
        group[SCENE_GROUP] = 1
        part = mujoco.mj_ray(self._model, self._data, np.array(eye, float), along, group, 1, -1, met, None)
        if not 0.0 <= part < 1.0:
            return True
        return bool(self._model.geom_bodyid[met[0]] == 1 + self._mocap_of(name))

    def _mocap_of(self, name: str) -> int:
        names = [spec.name for spec in self.people]
        if name not in names:
            raise ConfigError(f"there is no person {name!r}", valid=closest_first(name, names))
        return names.index(name)

    def _moves(self) -> bool:
        walking = any(not walker.arrived for walker in self._walkers.values())
        return self._driven or walking or bool(np.abs(self._data.qvel).max() > _REST_MPS)

    def _walk(self) -> None:
        robot, poses = self.robot_pose, self._people_poses
        for mocap, walker in self._walkers.items():
            others = poses[:mocap] + poses[mocap + 1 :]
            pose = poses[mocap] = walker.advance(_WALK_STEPS * TIMESTEP_S, robot, others)
            self._data.mocap_pos[mocap] = (pose.x, pose.y, 0.0)
            self._data.mocap_quat[mocap] = (math.cos(pose.yaw / 2), 0.0, 0.0, math.sin(pose.yaw / 2))

    def _touch(self, index: int, first: int, second: int) -> None:
        """Remember a contact that is not one of the wheels with the floor."""
        ours, other = (first, second) if self._is_robot(first) else (second, first)
        position = self._data.contact.pos[index].tolist()
        name = self.scene.names[other]
        last = self._last_touch.get(name)
        if last is None or (self._steps - last) * TIMESTEP_S > _SAME_TOUCH_S:
            self.contacts.append(Contact(self.time, name, (position[0], position[1], position[2])))
        self._last_touch[name] = self._steps
        if ours == self._base:
            bearing = self.robot_pose.bearing_to(position[0], position[1])
            if -_BUMPER_OVERLAP_RAD <= bearing <= math.pi / 2:
                self._last_bump[0] = self._steps
            if -math.pi / 2 <= bearing <= _BUMPER_OVERLAP_RAD:
                self._last_bump[1] = self._steps

    def _is_robot(self, geom: int) -> bool:
        return bool(self._model.geom_bodyid[geom] >= self._robot_body)

    def _make_scene(self) -> RayScene:
        """Make the scene. Its geoms come before the robot's, so their ids are the scene's rows."""
        model, data = self._model, self._data
        count = int(np.count_nonzero(model.geom_bodyid < self._robot_body))
        kind = np.array([_KINDS[int(each)] for each in model.geom_type[:count]], np.int8)
        names = ["floor", *(solid.name for solid in self.flat.solids)]
        names += [self.people[int(body) - 1].name for body in model.geom_bodyid[len(names) : count]]
        size = np.array(model.geom_size[:count], float)
        surface = np.zeros(count, np.int8)
        surface[1 : 1 + len(self.flat.solids)] = [SURFACES[solid.surface] for solid in self.flat.solids]
        shapes = Shapes(
            kind=kind,
            position=np.array(data.geom_xpos[:count]),
            rotation=np.array(data.geom_xmat[:count]).reshape(count, 3, 3),
            size=size,
            reach=reach_of(kind, size),
            colour=np.array(np.rint(model.geom_rgba[:count, :3] * 255), np.uint8),
            surface=surface,
        )
        return RayScene(shapes, tuple(names))

    def _refresh_scene(self) -> None:
        """Take over where the people are; they are the last rows."""
        first, count, shapes = 1 + len(self.flat.solids), len(self.scene.names), self.scene.shapes
        shapes.position[first:] = self._data.geom_xpos[first:count]
        shapes.rotation[first:] = self._data.geom_xmat[first:count].reshape(-1, 3, 3)


def _check_names(flat: Flat, people: Sequence[PersonSpec]) -> None:
    taken = {"floor", *(solid.name for solid in flat.solids)}
    for spec in people:
        if spec.name in taken:
            raise ConfigError(f"the name {spec.name!r} is taken by something or somebody else in the flat")
        taken.add(spec.name)
