"""The simulated hardware as a whole: the world, and the emulators that put it behind real ports.

Time here is simulated time: the world is stepped ``STEP_S`` at a time, and each step serves the emulators.
Who drives it (``node.py``) decides how fast that goes against the wall clock.
"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import ExitStack
from typing import Any

from florence_bt.core.geometry import Pose2
from florence_bt.simulation.emulators.create import CreateEmulator
from florence_bt.simulation.emulators.kinect_frames import KinectFrameServer
from florence_bt.simulation.emulators.pty_port import PseudoTerminal
from florence_bt.simulation.emulators.scip import ScipEmulator
from florence_bt.simulation.hardware.ports import HardwareMounts, HardwareSettings
from florence_bt.simulation.home.world import SimulatedWorld
from florence_bt.simulation.sensors.base_noise import BaseSensors
from florence_bt.simulation.sensors.kinect_sensor import KinectSensor
from florence_bt.simulation.sensors.laser_sensor import LaserSensor

STEP_S = 0.005
"""Simulated seconds between two looks at the ports."""


class HardwareServer:
    """The world, the emulators and the ports together.

    Args:
        world: The simulated flat with robot and people.
        mounts: Where the sensors sit.
        settings: Ports and rates.

    Attributes:
        laser_sent_at: Simulated seconds when bytes left the laser last.
    """

    def __init__(self, world: SimulatedWorld, mounts: HardwareMounts, settings: HardwareSettings) -> None:
        self.world = world
        self._settings = settings
        self._mounts = mounts
        self._steps = 0
        self._next_frame = self.laser_sent_at = self.time

    @property
    def time(self) -> float:
        """Simulated seconds since the start; the physics is at the last whole step of its own before that."""
        return self._steps * STEP_S

    def open(self) -> None:
        """Make the ports; the devices behind them are powered from now on.

        Raises:
            DeviceLost: A port cannot be made; then none is left.
            OSError: The folder or the socket cannot be made; then no port is left.
        """
        seed = self._settings.seed
        self._settings.folder.mkdir(parents=True, exist_ok=True)
        self._create = CreateEmulator(self.world, BaseSensors(self.world, seed + 1))
        self._laser = ScipEmulator(LaserSensor(self.world, self._mounts.laser, seed + 2))
        self._kinect = KinectSensor(self.world, self._mounts.camera, seed=seed + 3)
        with ExitStack() as ports:
            self._base_port = PseudoTerminal(self._settings.base_port)
            ports.callback(self._base_port.close)
            self._laser_port = PseudoTerminal(self._settings.laser_port)
            ports.callback(self._laser_port.close)
            self._frames = KinectFrameServer(self._settings.kinect_socket)
            ports.callback(self._frames.close)
            self._ports = ports.pop_all()

    def close(self) -> None:
        """Unplug everything and remove the links."""
        self.world.set_wheels(0.0, 0.0)
        self._ports.close()

    def step(self) -> None:
        """Advance the world by one step and serve the ports."""
        self._steps += 1
        self.world.step_to(self.time)
        self.serve()

    def serve(self) -> None:
        """Serve the ports without advancing the world."""
        now = self.time
        for emulator, port in ((self._create, self._base_port), (self._laser, self._laser_port)):
            received = port.read()
            answer = emulator.receive(received, now) if received else b""
            answer += emulator.poll(now)
            if answer:
                port.write(answer)
                if emulator is self._laser:
                    self.laser_sent_at = now
        self._serve_frames(now)

    def _serve_frames(self, now: float) -> None:
        if now < self._next_frame:
            if self._frames.pending:
                self._frames.poll()
            return
        self._frames.poll()
        self._next_frame = now + 1.0 / self._settings.kinect_rate
        if self._frames.client_count:
            if self._frames.colour_wanted:
                depth, colour = self._kinect.measure()
                self._frames.send_raw_depth(depth, now)
                self._frames.send_colour(colour, now)
            else:
                self._frames.send_raw_depth(self._kinect.measure_depth(), now)

    @property
    def motion(self) -> tuple[tuple[float, float], bool]:
        """The wheel speeds that the base was given, m/s left and right, and whether it moves."""
        return self.world.wheels, self.world.moving

    def truth(self) -> Mapping[str, Any]:
        """Return what is true, for judging a run; no part of the robot may use it."""
        robot = self.world.robot_pose
        wheels, moving = self.motion
        return {
            "time": round(self.world.time, 3),
            "robot": _pose_json(robot),
            "wheels": [round(speed, 3) for speed in wheels],
            "moving": moving,
            "people": {
                person.name: _pose_json(self.world.person_pose(person.name)) for person in self.world.people
            },
            "contacts": [
                {"time": round(contact.time, 3), "name": contact.name} for contact in self.world.contacts
            ],
        }


def _pose_json(pose: Pose2) -> list[float]:
    return [round(pose.x, 4), round(pose.y, 4), round(pose.yaw, 4)]
