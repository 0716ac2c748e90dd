"""The line to a device, as what stands above its driver knows it."""

from __future__ import annotations

from typing import Protocol


class DeviceLine(Protocol):
    """A port with bytes on a robot (``DriverPort``), the simulated device itself in the rig."""

    @property
    def device(self) -> object | None:
        """Name the device at its other end, None while it is not open."""

    @property
    def problem(self) -> str:
        """Say why there is none; empty once it works."""

    def pump(self) -> None:
        """Have the driver say what it wants to say now."""

    def works(self) -> None:
        """Note that the device has answered."""
