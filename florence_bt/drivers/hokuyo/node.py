"""The ROS node of the Hokuyo scanner: port, thread and messages around the driver."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.context import Context
from sensor_msgs.msg import LaserScan as LaserScanMsg

from florence_bt.core.clock import Timer, call_every
from florence_bt.core.errors import DeviceError
from florence_bt.drivers.hokuyo.diagnosis import diagnose
from florence_bt.drivers.hokuyo.driver import HokuyoDriver
from florence_bt.drivers.hokuyo.parameters import HokuyoParameters, HokuyoPortParameters
from florence_bt.drivers.serial_port import BytePort, PortReader, SerialPort
from florence_bt.ros.conversions import scan_to_ros, stamp_to_ros
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
        self._open_port = open_port
        self._port: BytePort | None = None
        self._reader: PortReader | None = None
        self._port_problem = ""
        self._attempts = 0
        self._scans = self.create_publisher(LaserScanMsg, "scan", SENSOR)
        self._diagnostics = self.create_publisher(DiagnosticArray, "diagnostics", RELIABLE)
        self._deadline: Timer | None = None
        self._reports = call_every(self.timebase, DIAGNOSTICS_PERIOD_S, self._report)
        self._connect()

    def close(self) -> None:
        """Switch the laser off and let go of the port."""
        self._reports.cancel()
        self._set_deadline(None)
        port = self._port
        if port is None:
            return
        try:
            port.write(self._driver.shutdown())
        except DeviceError as error:
            self.get_logger().warning(f"the laser may still be on: {error}")
        self._release()

    # --- port -------------------------------------------------------------------------------------------

    def _connect(self) -> None:
        try:
            port = self._open_port(self._settings.port, self._settings.baud_rate)
        except DeviceError as error:
            self._retry_later(error)
            return
        self._port, self._port_problem, self._attempts = port, "", 0
        self._reader = PortReader(port, partial(self._on_data, port), partial(self._on_lost, port))
        self._reader.start()
        self.get_logger().info(f"opened {self._settings.port}")
        self._driver.start(self.timebase.now())
        self._pump()

    def _release(self) -> None:
        port, reader = self._port, self._reader
        self._port = self._reader = None
        if reader is not None:
            reader.stop()
        if port is not None:
            port.close()

    def _retry_later(self, error: DeviceError) -> None:
        if str(error) != self._port_problem:
            self.get_logger().error(str(error))
        self._port_problem = str(error)
        delay = self._settings.reconnect_delay_s * min(2 ** min(self._attempts, 4), 10)
        self._attempts += 1
        self._set_deadline(self.timebase.now() + delay, self._connect)

    def _lose(self, error: DeviceError) -> None:
        self._driver.disconnected(str(error))
        self._release()
        self._retry_later(error)

    # --- the reader's thread -------------------------------------------------------------------------------

    def _on_data(self, port: BytePort, data: bytes) -> None:
        arrived = self.timebase.now()
        self.call_soon(lambda: self._receive(port, data, arrived))

    def _on_lost(self, port: BytePort, error: DeviceError) -> None:
        self.call_soon(lambda: self._lose(error) if port is self._port else None)

    # --- the executor's thread -----------------------------------------------------------------------------

    def _receive(self, port: BytePort, data: bytes, arrived: float) -> None:
        if port is not self._port:
            return  # left over from before the port was lost
        for scan in self._driver.receive(data, arrived):
            self._scans.publish(scan_to_ros(scan))
        self._pump()

    def _pump(self) -> None:
        """Send what the driver wants to say, and come back when it next has something to do."""
        if self._port is None:
            return
        data = self._driver.poll(self.timebase.now())
        if data:
            try:
                self._port.write(data)
            except DeviceError as error:
                self._lose(error)
                return
        self._set_deadline(self._driver.next_deadline(), self._pump)

    def _set_deadline(self, when: float | None, callback: Callable[[], None] | None = None) -> None:
        if self._deadline is not None:
            self._deadline.cancel()
        self._deadline = None if when is None or callback is None else self.timebase.call_at(when, callback)

    def _report(self) -> None:
        now = self.timebase.now()
        found = diagnose(self._driver, self._measuring, self._settings.port, self._port_problem, now)
        status = DiagnosticStatus(
            level=bytes([found.level]),
            name=f"{self.get_name()}: laser scanner",
            message=found.message,
            hardware_id=found.values["Device ID"],
            values=[KeyValue(key=key, value=value) for key, value in found.values.items()],
        )
        message = DiagnosticArray(status=[status])
        message.header.stamp = stamp_to_ros(now)
        self._diagnostics.publish(message)
