"""The page's part of ROS: a thread of its own that serves the node, and asks services for the page."""

from __future__ import annotations

import asyncio
import itertools
import threading
import time
from collections.abc import Callable
from typing import Any

import rclpy
from geometry_msgs.msg import PoseWithCovarianceStamped, Twist
from std_msgs.msg import Bool, String

from florence_bt.app.page.driving import HandDriving
from florence_bt.app.page.node import MAP_FRAME, PageNode, SceneNode
from florence_bt.core.closing import Closing
from florence_bt.core.errors import DeviceTimeout, FlorenceError
from florence_bt.core.geometry import Pose2
from florence_bt.ros.arguments import start_ros
from florence_bt.ros.conversions import pose_with_covariance_to_ros, twist_to_ros
from florence_bt.ros.executor import SpinLoop
from florence_bt.ros.qos import RELIABLE
from florence_bt.ros.topics import INITIAL_POSE, OVERRIDE_BY, SWITCH_OVERRIDE

ANSWER_S = 10.0
"""Wall seconds to wait for the answer of a service."""
CONFIRM_S = 5.0
"""Wall seconds in which the base's driver must confirm that the manual override was switched."""
REPEAT_S = 0.25
"""How often to switch it again while there is no confirmation."""
_CONFIRM_LOOK_S = 0.02
_SPIN_S = 0.2
LOOK_S = 1.0
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
        velocity = self.node.create_publisher(Twist, "manual_cmd_vel", RELIABLE)
        self.driving = HandDriving(
            self.node.steady,
            lambda: self.node.overridden,
            lambda twist: velocity.publish(twist_to_ros(twist)),
            self.node.show_speeds,
        )
        self._scene: SceneNode | None = None
        self._wanted: frozenset[str] = frozenset()
        self._next_look = 0.0
        self._clients: dict[str, Any] = {}
        self._switches = 0
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
        self._next_look = now + LOOK_S
        if wanted:
            self.node.look_for_questions()
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

    async def override(self, on: bool, by: str) -> None:
        """Switch the manual override: on, it stops the base at once. The journal is told who did it.

        It is published until the base's driver confirms it, or somebody switches again.

        Raises:
            DeviceTimeout: There is no confirmation.
        """

        def publish() -> None:
            self._override_by.publish(String(data=by))
            self._override.publish(Bool(data=on))

        self._switches += 1
        switch, begin = self._switches, time.monotonic()
        for number in itertools.count(1):
            self.on_thread(publish)
            while (now := time.monotonic()) < begin + number * REPEAT_S:
                await asyncio.sleep(_CONFIRM_LOOK_S)
                heard = (
                    self._override.get_subscription_count() > 0
                )  # else the state is of a driver that is gone
                if switch != self._switches or (heard and self.node.overridden is on):
                    return
            if now > begin + CONFIRM_S:
                break
        raise DeviceTimeout(
            "the base's driver did not confirm it: "
            + ("if the robot moves, switch it off by hand" if on else "the manual override may still be on")
        )

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
                ANSWER_S,
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
            return await asyncio.wait_for(answer, 2.0 * ANSWER_S)
        except TimeoutError as error:
            raise DeviceTimeout(f"{name} did not answer within {ANSWER_S:g} s") from error

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
