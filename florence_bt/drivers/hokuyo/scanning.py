"""The laser scanner as a component: what was measured in; scans and how the scanner does out."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from florence_bt.core import topic_names
from florence_bt.core.clock import call_every
from florence_bt.core.diagnosis import Diagnoses
from florence_bt.core.ports import Delivery, Ports, Topic
from florence_bt.core.sensing import LaserScan
from florence_bt.core.topics import DIAGNOSES, SCAN
from florence_bt.drivers.device_line import DeviceLine
from florence_bt.drivers.diagnosis import DIAGNOSTICS_PERIOD_S
from florence_bt.drivers.hokuyo.diagnosis import diagnose
from florence_bt.drivers.hokuyo.driver import HokuyoDriver
from florence_bt.drivers.hokuyo.geometry import MultiEchoScan
from florence_bt.drivers.hokuyo.parameters import HokuyoParameters

ECHOES = Topic(topic_names.ECHOES, MultiEchoScan, Delivery.SENSOR, "sensor_msgs/msg/MultiEchoLaserScan")


class LaserScanning:
    """Tells each scan, with all echoes where the sensor measures them, and once a second how it does.

    Source: document, section 2.1; REFERENCE 4.9.
    """

    def __init__(
        self,
        ports: Ports,
        driver: HokuyoDriver,
        line: DeviceLine,
        measuring: HokuyoParameters,
        place: str,
        tell_limits: Callable[[Mapping[str, float]], None],
    ) -> None:
        """Connect the scanner.

        Args:
            ports: Its connections.
            driver: Speaks with it.
            line: Carries that.
            measuring: How it is to measure.
            place: Where it is, for people.
            tell_limits: Given what the sensor can do, by the names of hokuyo_node, when that has changed.
        """
        self._ports, self._driver, self._line = ports, driver, line
        self._measuring, self._place = measuring, place
        self._tell_limits = tell_limits
        self._limits: Mapping[str, float] = {}
        self._scans, self._echoes = ports.output(SCAN), ports.output(ECHOES)
        self._diagnoses = ports.output(DIAGNOSES)
        self._diagnosing = call_every(ports.clock, DIAGNOSTICS_PERIOD_S, self._tell_diagnoses)

    def close(self) -> None:
        """Tell nothing more."""
        self._diagnosing.cancel()

    def take(self, scans: Sequence[LaserScan]) -> None:
        """Take what the driver made of what the scanner sent."""
        for scan in scans:
            self._scans.send(scan)
            if isinstance(scan, MultiEchoScan):
                self._echoes.send(scan)
            self._line.works()
            self._note_limits()
        self._line.pump()

    def _note_limits(self) -> None:
        geometry = self._driver.geometry
        if geometry is None:
            return
        limits = {
            "min_ang_limit": geometry.angle_of(geometry.first_step),
            "max_ang_limit": geometry.angle_of(geometry.last_step),
            "min_range": geometry.minimum_mm / 1000.0,
            "max_range": geometry.maximum_mm / 1000.0,
        }
        if limits != self._limits:
            self._limits = limits
            self._tell_limits(limits)

    def _tell_diagnoses(self) -> None:
        now = self._ports.clock.now()
        found = diagnose(self._driver, self._measuring, self._place, self._line.problem, now)
        self._diagnoses.send(Diagnoses({"laser scanner": found}, found.values["Device ID"]))
