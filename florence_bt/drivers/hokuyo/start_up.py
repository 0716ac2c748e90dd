"""From an open port to the moment before the first scan. Source: REFERENCE 4.2, 4.6, 4.9."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass

from florence_bt.core.errors import DeviceError, DeviceTimeout, FrameError
from florence_bt.drivers.hokuyo.conversation import Ask, Script
from florence_bt.drivers.hokuyo.geometry import SensorGeometry
from florence_bt.drivers.hokuyo.status import ACCEPTED

HEALTHY = "Sensor works well."
"""The text of STAT that hokuyo_node insists on (REFERENCE 4.5)."""

ANY = tuple(f"0{letter}" for letter in "0123456789ABCDEFGHI")
LASER_ON = Ask("BM", (ACCEPTED, "02"), 10)


@dataclass(frozen=True, slots=True)
class Sensor:
    """Who the sensor is and what it can do.

    Attributes:
        version: What VV told: VEND, PROD, FIRM, PROT, SERI.
        parameters: What PP told, MODL among it.
        geometry: The numbers of PP.
        state: What II told, STAT among it.
    """

    version: Mapping[str, str]
    parameters: Mapping[str, str]
    geometry: SensorGeometry
    state: Mapping[str, str]

    @property
    def stat(self) -> str:
        """The sensor's own word on its health."""
        return self.state.get("STAT", "unknown")

    @property
    def device_id(self) -> str:
        """Its serial number."""
        return self.version.get("SERI", "unknown")


def start_up() -> Script:
    """Wake the sensor, end what it is about, and ask who it is; the laser is on at the end.

    Returns:
        The :class:`Sensor`, healthy or not.
    """
    with suppress(DeviceTimeout):
        # Old firmware wakes up in SCIP 1.1; a sensor that speaks 2.0 already answers 0E, or nothing.
        yield Ask("SCIP2.0", ANY, 1)
    yield Ask("TM2", (ACCEPTED, "03"))  # in time mode everything else is refused
    yield Ask("QT")
    yield Ask("RS")
    shape = yield Ask("PP")
    identity = yield Ask("VV")
    health = yield Ask("II")
    try:
        parameters = shape.reply.information()
        geometry = SensorGeometry.from_information(parameters)
        sensor = Sensor(identity.reply.information(), parameters, geometry, health.reply.information())
    except FrameError as error:
        raise DeviceError(str(error)) from error
    if sensor.stat == HEALTHY:
        yield LASER_ON
    return sensor
