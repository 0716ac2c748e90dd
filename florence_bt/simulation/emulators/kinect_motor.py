"""A Kinect's motor on an emulated USB bus: a backend for pyusb that answers as the device does.

Written from REFERENCE 5.1 and 5.5; any program that uses pyusb can be given it. The head turns at 15 degrees
a second; the accelerometer feels gravity alone, as on a base that stands level.
"""

from __future__ import annotations

import errno
import math
import struct
from array import array
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from types import SimpleNamespace

import usb.backend
import usb.core

VENDOR, MOTOR = 0x045E, 0x02B0
"""The numbers of the device on USB. Source: REFERENCE 5.1."""
SPEED = 15.0
"""Degrees a second; proposed in REFERENCE 5.5."""
LIMIT = 31.0
"""Degrees up and down. Source: REFERENCE 5.5."""
COUNTS_PER_G = 819
"""Of the accelerometer. Source: REFERENCE 5.5."""
STOPPED, AT_LIMIT, MOVING = 0, 1, 4
"""States of the motor. Source: REFERENCE 5.5."""
UNKNOWN_ANGLE = -128
"""Half degrees told while the motor moves; REFERENCE 5.5 has it unverified."""


@dataclass(slots=True)
class MotorFaults:
    """The faults; set it at any time.

    Attributes:
        unplugged: The device is not on the bus; what was open fails.
        forbidden: This user may not open it.
        short: States have only so many bytes; None for all ten.
        init_answer: What the motor answers when it is initialised, 0x22 when it is well.
        silent_while_moving: The angle reads -128 while the head moves.
        products: The products on the bus; those of another model have no motor of their own.
    """

    unplugged: bool = False
    forbidden: bool = False
    short: int | None = None
    init_answer: int = 0x22
    silent_while_moving: bool = True
    products: tuple[int, ...] = (MOTOR,)


class KinectMotorBackend(usb.backend.IBackend):
    """The USB bus of one Kinect.

    Args:
        now: Gives the time in seconds.

    Attributes:
        faults: What shall go wrong.
        led: The option of the light that was set last.
        requests: Every control transfer: request type, request, value.
    """

    def __init__(self, now: Callable[[], float]) -> None:
        self.faults = MotorFaults()
        self.led = 0
        self.requests: list[tuple[int, int, int]] = []
        self._now = now
        self._from = self._to = 0.0
        self._began = now()

    @property
    def angle(self) -> float:
        """Degrees above the horizon."""
        way = self._to - self._from
        turned = min(abs(way), SPEED * max(0.0, self._now() - self._began))
        return self._from + math.copysign(turned, way)

    @property
    def moving(self) -> bool:
        """Tell whether the head turns."""
        return abs(self.angle - self._to) > 1e-9

    def enumerate_devices(self) -> Iterator[int]:
        """Iterate over the products on the bus."""
        return iter(() if self.faults.unplugged else self.faults.products)

    def get_device_descriptor(self, dev: int) -> SimpleNamespace:
        """Return the descriptor of a product, as pyusb reads it."""
        return SimpleNamespace(
            bLength=18,
            bDescriptorType=1,
            bcdUSB=0x0200,
            bDeviceClass=0,
            bDeviceSubClass=0,
            bDeviceProtocol=0,
            bMaxPacketSize0=64,
            idVendor=VENDOR,
            idProduct=dev,
            bcdDevice=0x0105,
            iManufacturer=1,
            iProduct=2,
            iSerialNumber=0,
            bNumConfigurations=1,
            address=1 + self.faults.products.index(dev),
            bus=1,
            port_number=1,
            port_numbers=(1,),
            speed=2,
        )

    def open_device(self, dev: int) -> int:
        """Return a handle for a product."""
        self._plugged()
        if self.faults.forbidden:
            raise usb.core.USBError("Access denied (insufficient permissions)", -3, errno.EACCES)
        return dev

    def close_device(self, dev_handle: int) -> None:
        """Do nothing: nothing is kept open."""

    def ctrl_transfer(
        self,
        dev_handle: int,
        bmRequestType: int,
        bRequest: int,
        wValue: int,
        wIndex: int,
        data: array[int],
        timeout: int,
    ) -> int:
        """Answer a control transfer.

        Returns:
            How many bytes were read or written.
        """
        self._plugged()
        self.requests.append((bmRequestType, bRequest, wValue))
        answer = self._answer(bmRequestType, bRequest, wValue)[: len(data)]
        for index, byte in enumerate(answer):
            data[index] = byte
        return len(answer)

    def _answer(self, kind: int, request: int, value: int) -> bytes:
        if (kind, request) == (0xC0, 0x10):
            return bytes([self.faults.init_answer])
        if (kind, request) == (0xC0, 0x32):
            return self._state()[: self.faults.short]
        if (kind, request) == (0x40, 0x06):
            self.led = value
        elif (kind, request) == (0x40, 0x31):
            self._tilt((value - 0x10000 if value >= 0x8000 else value) / 2.0)
        else:
            raise usb.core.USBError("Pipe error", -9, errno.EPIPE)
        return b""

    def _tilt(self, degrees: float) -> None:
        self._from, self._began = self.angle, self._now()
        self._to = max(-LIMIT, min(LIMIT, degrees))

    def _state(self) -> bytes:
        angle, moving = self.angle, self.moving
        pitch = math.radians(angle)
        y, z = round(COUNTS_PER_G * math.cos(pitch)), round(COUNTS_PER_G * math.sin(pitch))
        status = MOVING if moving else AT_LIMIT if abs(angle) >= LIMIT else STOPPED
        shown = UNKNOWN_ANGLE if moving and self.faults.silent_while_moving else round(2.0 * angle)
        return struct.pack(">2xhhhbB", 0, y, z, shown, status)

    def _plugged(self) -> None:
        if self.faults.unplugged:
            raise usb.core.USBError("No such device (it may have been disconnected)", -4, errno.ENODEV)
