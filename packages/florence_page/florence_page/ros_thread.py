"""The page's part of ROS: a thread of its own that serves the node, and asks services for the page."""

from __future__ import annotations

import asyncio
import threading
import time
from collections.abc import Callable
from typing import Any

import rclpy
from florence_interfaces.srv import ReleaseOverride
from geometry_msgs.msg import PoseWithCovarianceStamped, Twist
from std_msgs.msg import Bool, String

from florence_bt.core.closing import Closing
from florence_bt.core.errors import DeviceTimeout, FlorenceError
from florence_bt.core.geometry import Pose2
from florence_bt.core.topic_names import (
    INITIAL_POSE,
    MANUAL_CMD_VEL,
    OVERRIDE_BY,
    RELEASE_OVERRIDE,
    SWITCH_OVERRIDE,
)
from florence_bt.ros.arguments import start_ros
from florence_bt.ros.conversions import pose_with_covariance_to_ros, twist_to_ros
from florence_bt.ros.executor import SpinLoop
from florence_bt.ros.qos import RELIABLE
from florence_page.driving import HandDriving
from florence_page.node import MAP_FRAME, PageNode, SceneNode

SERVICE_ANSWER_S = 10.0
"""Wall seconds to wait for the answer of a service."""
CONFIRM_S = 0.25
"""Wall seconds to wait for the base's driver to confirm a stop, before the browser sends it again."""
STOPPED = "the robot is stopped"
DRIVEN = "the robot is stopped for missions; a hand drives it"
MOST_PRESSES = 1_000
"""How many presses are remembered."""
_CONFIRM_LOOK_S = 0.02
_SPIN_S = 0.2
SIMULATION_LOOK_S = 1.0
"""How often to look whether a simulation has begun or ended."""


class RosThread(Closing):
    """Serves a node on a thread, until it is closed. A context manager."""

    def __init__(self) -> None:
        self._context = rclpy.Context()
        start_ros(self._context)
        self.node = PageNode(context=self._context)
        self._loop = SpinLoop(self._context, keep_going=True)
        self._loop.add(self.node)
        self._override_by = self.node.create_publisher(String, OVERRIDE_BY, RELIABLE)
        self._override = self.node.create_publisher(Bool, SWITCH_OVERRIDE, RELIABLE)
        self._initial_pose = self.node.create_publisher(PoseWithCovarianceStamped, INITIAL_POSE, RELIABLE)
        velocity = self.node.create_publisher(Twist, MANUAL_CMD_VEL, RELIABLE)
        self.driving = HandDriving(
            self.node.steady,
            lambda: self.node.overridden,
            lambda twist: velocity.publish(twist_to_ros(twist)),
            self.node.show_speeds,
        )
        self.node.on_stop = self.driving.stop
        self._scene: SceneNode | None = None
        self._wanted: frozenset[str] = frozenset()
        self._next_look = 0.0
        self._clients: dict[str, Any] = {}
        self._pressed: dict[str, int | None] = {}
        self._confirmed: dict[str, None] = {}
        self._closing = False
        self._thread = threading.Thread(target=self._serve, name="ros")
        self._thread.start()

    def close(self) -> None:
        """Leave ROS."""
        self._closing = True
        self._loop.interrupt()
        self._thread.join()

    def _serve(self) -> None:
        while not self._closing:
            self._loop.spin_once(_SPIN_S)
            # Between two events: the executor of the nodes may not lose one amid a callback.
            self._keep_scene()
        self._wanted = frozenset()
        self._keep_scene()
        self.node.shut_down()
        self._loop.close()
        self.node.destroy_node()
        rclpy.shutdown(context=self._context)

    def look(self, wanted: frozenset[str]) -> None:
        """Begin to hear what somebody wants to see (:data:`WANTS`), and cease to hear the rest, soon."""
        self._wanted = wanted
        self._loop.interrupt()

    def _keep_scene(self) -> None:
        """Have the node of what comes often while somebody looks; a new one when the time is another."""
        scene, wanted = self._scene, self._wanted
        now = time.monotonic()
        if now < self._next_look and wanted == (scene.wanted if scene is not None else frozenset()):
            return
        self._next_look = now + SIMULATION_LOOK_S
        simulated = self.node.simulated
        if scene is not None and not (wanted and scene.simulated == simulated):
            scene.shut_down()
            self._loop.remove(scene)
            scene.destroy_node()
            scene = None
        if scene is None and wanted:
            scene = SceneNode(self.node, simulated=simulated, context=self._context)
            self._loop.add(scene)
        if scene is not None:
            scene.want(wanted)
        self._scene = scene

    def on_thread(self, work: Callable[[], None]) -> None:
        """Run something on the thread of the node, soon."""
        self.node.call_soon(work)

    async def stop(self, press: str, by: str) -> tuple[bool, str]:
        """Stop the robot by the manual override, for one press; call it again until it is confirmed.

        Args:
            press: Names the press: what was confirmed once is not done again, however often it comes.
            by: Who pressed, for the journal.

        Returns:
            Whether the base's driver has counted a stop since the press came, and the base stands or a hand
            drives it; and what to tell the person.
        """
        if press in self._confirmed:
            return True, self._word_of_stop()
        heard = self.node.override.last
        before = self._pressed.setdefault(press, heard.stops if heard is not None else None)

        def publish() -> None:
            self._override_by.publish(String(data=by))
            self._override.publish(Bool(data=True))

        begin = time.monotonic()
        counted = heard is not None and heard.on and before is not None and heard.stops != before
        if not counted:  # one press is one stop: the next one would take the robot out of a hand again
            self.on_thread(publish)
        while time.monotonic() < begin + CONFIRM_S:
            await asyncio.sleep(_CONFIRM_LOOK_S)
            if before is None:  # the first word that is heard may be of before the press
                heard = self.node.override.last
                before = self._pressed[press] = None if heard is None else heard.stops
                self.on_thread(publish)
            elif self._problem_of_stop(before) == "":
                self._confirmed[press] = None
                self._pressed.pop(press, None)
                _bound(self._confirmed)
                return True, self._word_of_stop()
        _bound(self._pressed)
        return False, self._problem_of_stop(before)

    def _word_of_stop(self) -> str:
        """Say how the robot is after a stop that was confirmed."""
        heard = self.node.override.last
        return STOPPED if heard is None or not heard.driven_by_hand else DRIVEN

    def _problem_of_stop(self, before: int | None) -> str:
        """Say why a stop is not confirmed yet; empty when it is."""
        state = self.node.override.fresh
        if state is None:
            return "the base's driver says nothing"
        if not state.on or state.stops == before:
            return "the base's driver has not answered yet"
        if state.problem:
            return str(state.problem)
        return "" if state.standing or state.driven_by_hand else "the wheels still turn"

    async def release(self, stops: int, ago_s: float, by: str) -> tuple[bool, str]:
        """End the manual override for somebody who pressed a moment ago, by what they saw.

        Args:
            stops: How many stops there were on their screen.
            ago_s: Seconds since they pressed.
            by: Who pressed.

        Returns:
            Whether it was released; and what to tell the person.

        Raises:
            FlorenceError: The base's driver is not there, or says nothing.
        """
        state, heard_ago_s = self.node.override.fresh, self.node.override.since_s
        if state is None:
            raise FlorenceError("not released: the base's driver says nothing")
        pressed_at = state.sent_at + heard_ago_s - ago_s
        request = ReleaseOverride.Request(stops=stops, pressed_at=pressed_at, by=by)
        self.on_thread(lambda: self._override_by.publish(String(data=by)))
        answer = await self.ask(ReleaseOverride, RELEASE_OVERRIDE, request)
        return bool(answer.success), str(answer.message)

    def tell_pose(self, pose: Pose2) -> None:
        """Tell the localiser where the robot stands in the map, as sure as it takes a pose by default."""

        def publish() -> None:
            now = (self._scene or self.node).timebase.now()  # the scene's node knows the time of a simulation
            message = pose_with_covariance_to_ros(pose, [0.0] * 36, MAP_FRAME, now)
            self._initial_pose.publish(message)

        self.on_thread(publish)

    async def ask(self, service_type: Any, name: str, request: Any) -> Any:
        """Call a service and return its answer.

        Raises:
            FlorenceError: Nobody serves it.
            DeviceTimeout: It does not answer.
        """
        loop = asyncio.get_running_loop()
        answer: asyncio.Future[Any] = loop.create_future()

        def settle(result: Any) -> None:
            if not answer.done():
                answer.set_exception(result) if isinstance(result, Exception) else answer.set_result(result)

        def begin() -> None:
            client = self._clients.get(name)
            if client is None:
                client = self._clients[name] = self.node.create_client(service_type, name)
            self._when_there(
                client,
                SERVICE_ANSWER_S,
                send,
                lambda: tell(FlorenceError(f"nobody serves {name}: is the system up?")),
            )

        def send() -> None:
            future = self._clients[name].call_async(request)
            future.add_done_callback(self.node.guarded(lambda done: tell(done.result())))

        def tell(result: Any) -> None:
            loop.call_soon_threadsafe(settle, result)

        self.on_thread(begin)
        try:
            return await asyncio.wait_for(answer, 2.0 * SERVICE_ANSWER_S)
        except TimeoutError as error:
            raise DeviceTimeout(f"{name} did not answer within {SERVICE_ANSWER_S:g} s") from error

    def _when_there(
        self, client: Any, left_s: float, then: Callable[[], None], give_up: Callable[[], None]
    ) -> None:
        """Wait for a server without holding up the node."""
        if client.service_is_ready():
            then()
        elif left_s <= 0.0:
            give_up()
        else:
            again = self.node.steady.now() + _SPIN_S
            self.node.steady.call_at(again, lambda: self._when_there(client, left_s - _SPIN_S, then, give_up))


def _bound(remembered: dict[str, Any]) -> None:
    """Forget the oldest of what is remembered."""
    while len(remembered) > MOST_PRESSES:
        del remembered[next(iter(remembered))]
