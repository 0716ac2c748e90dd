"""The services of the base beside driving: lights, songs, docking."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from florence_interfaces.srv import PlaySong, SetLeds
from std_srvs.srv import SetBool

from florence_bt.core.errors import ConfigError
from florence_bt.drivers.driver_port import DriverPort
from florence_bt.drivers.turtlebot.driver import TurtlebotDriver
from florence_bt.ros.node import FlorenceNode


class BaseServices:
    """Serves ``~/set_leds``, ``~/play_song`` and ``~/dock``; a refusal says why.

    Args:
        node: The node of the base.
        driver: Its driver.
        port: Gives its port.
    """

    def __init__(
        self,
        node: FlorenceNode,
        driver: TurtlebotDriver,
        port: Callable[[], DriverPort],
    ) -> None:
        self._node = node
        self._driver = driver
        self._port = port
        node.create_service(SetLeds, "~/set_leds", self._on_leds)
        node.create_service(PlaySong, "~/play_song", self._on_song)
        node.create_service(SetBool, "~/dock", self._on_dock)

    def _on_leds(self, request: SetLeds.Request, response: SetLeds.Response) -> SetLeds.Response:
        driver = self._driver
        return self._answer(
            response, lambda: driver.set_leds(request.leds, request.power_colour, request.power_intensity)
        )

    def _on_song(self, request: PlaySong.Request, response: PlaySong.Response) -> PlaySong.Response:
        return self._answer(
            response, lambda: self._driver.play_song(list(request.notes), list(request.durations))
        )

    def _on_dock(self, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        return self._answer(response, self._dock if request.data else self._leave_dock)

    def _dock(self) -> None:
        self._driver.dock(self._node.timebase.now())

    def _leave_dock(self) -> None:
        self._driver.end_docking(self._node.timebase.now())

    def _answer(self, response: Any, do: Callable[[], None]) -> Any:
        try:
            if self._port().device is None:
                raise ConfigError("the base is not connected")
            do()
        except ConfigError as error:
            response.message = str(error)
            self._node.get_logger().warning(response.message)
            return response
        response.success = True
        self._port().pump()
        return response
