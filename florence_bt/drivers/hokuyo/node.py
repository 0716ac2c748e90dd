"""The ROS node of the Hokuyo scanner: port, thread and self test around the driver and its component."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus
from diagnostic_msgs.srv import SelfTest
from rcl_interfaces.msg import ParameterDescriptor
from rclpy.parameter import Parameter
from sensor_msgs.msg import MultiEchoLaserScan

from florence_bt.core.diagnosis import Severity
from florence_bt.core.errors import DeviceError, DeviceTimeout
from florence_bt.drivers.driver_port import DriverPort
from florence_bt.drivers.hokuyo.driver import HokuyoDriver
from florence_bt.drivers.hokuyo.geometry import MultiEchoScan
from florence_bt.drivers.hokuyo.parameters import HokuyoParameters, HokuyoPortParameters
from florence_bt.drivers.hokuyo.scanning import ECHOES, LaserScanning
from florence_bt.drivers.hokuyo.self_test import SelfTestResult
from florence_bt.drivers.serial_port import BytePort, SerialPort
from florence_bt.drivers.tcp_port import TcpPort
from florence_bt.ros.answers import Deferred
from florence_bt.ros.conversions import echoes_to_ros
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.ports import RosPorts


class HokuyoNode(FlorenceNode):
    """Publishes ``scan``, ``diagnostics`` and, with ``multi_echo``, ``echoes``; serves ``~/self_test``.

    It opens the port again when it is lost.

    Parameters: the fields of :class:`HokuyoParameters` and :class:`HokuyoPortParameters`. Once the sensor has
    told them, the parameters ``min_ang_limit``, ``max_ang_limit``, ``min_range`` and ``max_range`` hold what
    it can do.

    Source: document, section 2.1; REFERENCE 4.9.
    """

    parameter_classes = (HokuyoPortParameters, HokuyoParameters)

    def __init__(
        self,
        *,
        parameters: Mapping[str, Any] | None = None,
        namespace: str = "",
        open_port: Callable[[str, int], BytePort] = SerialPort,
        open_tcp: Callable[[str, int], BytePort] = TcpPort,
    ) -> None:
        """Make the node and try to open the port.

        Args:
            parameters: Values of parameters by name.
            namespace: Goes before the node's name and topics.
            open_port: Opens a path at a baud rate.
            open_tcp: Opens a port of a host.
        """
        super().__init__("hokuyo_node", parameters=parameters, namespace=namespace)
        self._settings = self.read_parameters(HokuyoPortParameters)
        self._measuring = self.read_parameters(HokuyoParameters)
        self._driver = HokuyoDriver(
            self._measuring, lambda problem: self.get_logger().warning(problem), self._settings.line_rate
        )
        self._open_port, self._open_tcp = open_port, open_tcp
        self.create_service(SelfTest, "~/self_test", self._on_self_test)
        self._port = DriverPort(
            self._driver,
            self.timebase,
            self.call_soon,
            self._open,
            on_open=self._on_open,
            on_bytes=self._receive,
            on_lost=lambda error: self._driver.disconnected(str(error)),
            on_problem=lambda problem: self.get_logger().error(problem),
            send=self._send,
            delay_s=self._settings.reconnect_delay_s,
            name=self._settings.place,
            # The sensor's clock takes the earliest arrival for the true one.
            arrival_time=self.ros_timebase.arrival_time,
        )
        self._scanning = LaserScanning(
            RosPorts(self, {ECHOES: self._echoes_to_ros}),
            self._driver,
            self._port,
            self._measuring,
            self._settings.place,
            self._declare_limits,
        )
        self._port.open()

    def close(self) -> None:
        """Switch the laser off and release the port."""
        self._scanning.close()
        if not_sent := self._port.close():
            self.get_logger().warning(f"the laser may still be on: {not_sent}")

    # ---- port -------------------------------------------------------------------------------------------

    def _open(self) -> BytePort:
        settings = self._settings
        if settings.ip_address:
            return self._open_tcp(settings.ip_address, settings.ip_port)
        return self._open_port(settings.port, settings.baud_rate)

    def _on_open(self, port: BytePort) -> None:
        self.get_logger().info(f"opened {port.name}")
        self._driver.start(self.timebase.now())

    def _receive(self, data: bytes, arrived: float) -> None:
        self._scanning.take(self._driver.receive(data, arrived))

    def _send(self, port: BytePort, data: bytes) -> None:
        if data:
            if self._driver.bit_rate is not None and isinstance(port, SerialPort):
                port.set_baud_rate(self._driver.bit_rate)
            port.write(data)
        if self._driver.no_answer:
            # A port that is open but dead, such as a plug that was out and in: begin with a new one.
            raise DeviceTimeout(f"nothing that speaks SCIP 2.0 answers at {port.name}")

    # ---- what people see --------------------------------------------------------------------------------

    def _echoes_to_ros(self, scan: MultiEchoScan) -> MultiEchoLaserScan:
        return echoes_to_ros(self.stamped(scan), scan.echoes, scan.echo_intensities)

    def _declare_limits(self, limits: Mapping[str, float]) -> None:
        for name, value in limits.items():
            if not self.has_parameter(name):
                self.declare_parameter(name, value, ParameterDescriptor(description="reported by the sensor"))
        self.set_parameters([Parameter(name, value=value) for name, value in limits.items()])

    def _on_self_test(self, request: SelfTest.Request, response: SelfTest.Response) -> Deferred:
        """Run the tests of hokuyo_node; meanwhile no scans are published."""
        later = Deferred()

        def finish(results: Sequence[SelfTestResult]) -> None:
            later.answer(
                self._self_test_to_ros(results or (_failed("the port was lost meanwhile"),), response)
            )

        try:
            self._driver.begin_self_test(finish, self.timebase.now())
        except DeviceError as error:
            finish((_failed(self._port.problem or str(error)),))
        self._port.pump()
        return later

    def _self_test_to_ros(
        self, results: Sequence[SelfTestResult], response: SelfTest.Response
    ) -> SelfTest.Response:
        sensor = self._driver.sensor
        response.id = "unknown" if sensor is None else sensor.device_id
        response.passed = bytes([all(result.level < Severity.ERROR for result in results)])
        response.status = [
            DiagnosticStatus(
                level=bytes([result.level]),
                name=result.name,
                message=result.message,
                hardware_id=response.id,
            )
            for result in results
        ]
        return response


def _failed(problem: str) -> SelfTestResult:
    return SelfTestResult("Connection Test", Severity.ERROR, problem)
