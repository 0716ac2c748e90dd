"""The ROS node of the Hokuyo scanner: port, thread and messages around the driver."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from rclpy.context import Context
from sensor_msgs.msg import LaserScan as LaserScanMsg

from florence_bt.core.clock import Timer, call_every
from florence_bt.core.errors import DeviceError
from florence_bt.drivers.connection import Connection
from florence_bt.drivers.hokuyo.diagnosis import diagnose
from florence_bt.drivers.hokuyo.driver import HokuyoDriver
from florence_bt.drivers.hokuyo.parameters import HokuyoParameters, HokuyoPortParameters
from florence_bt.drivers.serial_port import BytePort, SerialPort
from florence_bt.ros.conversions import scan_to_ros
from florence_bt.ros.diagnostics import diagnostics_to_ros
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.qos import RELIABLE, SENSOR

DIAGNOSTICS_PERIOD_S = 1.0


class HokuyoNode(FlorenceNode):
    """Publishes ``scan`` and ``diagnostics``. Opens the port again, with growing pauses, whenever it is lost.

    Parameters: the fields of :class:`HokuyoParameters` and :class:`HokuyoPortParameters`.

    Source: document, section 2.1; REFERENCE 4.9.
    """

    def __init__(
        self,
        *,
        parameters: Mapping[str, Any] | None = None,
        namespace: str = "",
        context: Context | None = None,
        open_port: Callable[[str, int], BytePort] = SerialPort,
    ) -> None:
        """Make the node and try to open the port.

        Args:
            parameters: Values of parameters by name.
            namespace: Goes before the node's name and topics.
            context: The ROS context.
            open_port: Opens a path at a baud rate.
        """
        super().__init__("hokuyo_node", parameters=parameters, namespace=namespace, context=context)
        self._settings = self.read_parameters(HokuyoPortParameters)
        self._measuring = self.read_parameters(HokuyoParameters)
        self._driver = HokuyoDriver(self._measuring, lambda problem: self.get_logger().warning(problem))
        self._scans = self.create_publisher(LaserScanMsg, "scan", SENSOR)
        self._diagnostics = self.create_publisher(DiagnosticArray, "diagnostics", RELIABLE)
        self._deadline: Timer | None = None
        self._reports = call_every(self.timebase, DIAGNOSTICS_PERIOD_S, self._report)
        self._connection: Connection[BytePort, bytes] = Connection(
            self.timebase,
            self.call_soon,
            lambda: open_port(self._settings.port, self._settings.baud_rate),
            on_open=self._on_open,
            on_item=self._receive,
            on_lost=self._on_lost,
            on_problem=lambda problem: self.get_logger().error(problem),
            delay_s=self._settings.reconnect_delay_s,
            name=self._settings.port,
        )
        self._connection.open()

    def close(self) -> None:
        """Switch the laser off and let go of the port."""
        self._reports.cancel()
        self._set_deadline(None)
        port = self._connection.device
        if port is not None:
            try:
                port.write(self._driver.shutdown())
            except DeviceError as error:
                self.get_logger().warning(f"the laser may still be on: {error}")
        self._connection.close()

    def _on_open(self, port: BytePort) -> None:
        self._connection.works()
        self.get_logger().info(f"opened {port.name}")
        self._driver.start(self.timebase.now())
        self._pump()

    def _on_lost(self, error: DeviceError) -> None:
        self._set_deadline(None)
        self._driver.disconnected(str(error))

    def _receive(self, data: bytes, arrived: float) -> None:
        for scan in self._driver.receive(data, arrived):
            self._scans.publish(scan_to_ros(scan))
        self._pump()

    def _pump(self) -> None:
        """Send what the driver wants to say, and come back when it next has something to do."""
        port = self._connection.device
        if port is None:
            return
        data = self._driver.poll(self.timebase.now())
        if data:
            try:
                port.write(data)
            except DeviceError as error:
                self._connection.lose(error)
                return
        self._set_deadline(self._driver.next_deadline(), self._on_deadline)

    def _on_deadline(self) -> None:
        self._connection.serve()
        self._pump()

    def _set_deadline(self, when: float | None, callback: Callable[[], None] | None = None) -> None:
        if self._deadline is not None:
            self._deadline.cancel()
        self._deadline = None if when is None or callback is None else self.timebase.call_at(when, callback)

    def _report(self) -> None:
        now = self.timebase.now()
        found = diagnose(self._driver, self._measuring, self._settings.port, self._connection.problem, now)
        self._diagnostics.publish(
            diagnostics_to_ros({"laser scanner": found}, self.get_name(), found.values["Device ID"], now)
        )
