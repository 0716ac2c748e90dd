"""The Kinect's motor over USB (pyusb)."""

from __future__ import annotations

import errno
import queue
from typing import Any

from florence_bt.core.errors import DeviceLost, FrameError
from florence_bt.drivers.kinect.motor import codec

VENDOR = 0x045E
MOTOR = 0x02B0
CAMERAS = (0x02AE, 0x02BF)
"""Ids on USB: of Microsoft, the motor, and the cameras of Kinect and Kinect for Windows (REFERENCE 5.1)."""
TIMEOUT_MS = 500
"""Of a transfer. Chosen."""
UDEV = "copy config/udev/99-florence.rules to /etc/udev/rules.d/ and plug the Kinect in again"
PYUSB = "tilt, light and accelerometer need pyusb: pip install pyusb, or sudo apt install python3-usb"
OTHER_MODEL = (
    "this Kinect (model 1473 or Kinect for Windows) has its motor behind its audio device (045e:02ad), which "
    "needs firmware: tilt, light and accelerometer do not work, images do"
)
LIBUSB = "pyusb finds no libusb: sudo apt install libusb-1.0-0"


class UsbMotor:
    """Motor, light and accelerometer of one Kinect.

    Requests are sent by :meth:`read`, so that all transfers come from the reader's thread.

    Args:
        index: Which Kinect, from 0.
        backend: A backend of pyusb; libusb when not given.

    Raises:
        DeviceLost: There is no such device, it may not be opened, or it is a model whose motor cannot be
            reached; the message says what to do.
    """

    def __init__(self, index: int = 0, backend: Any = None) -> None:
        self._requests: queue.SimpleQueue[codec.MotorRequest] = queue.SimpleQueue()
        self._usb = _pyusb()
        self._device: Any = _find(self._usb, index, backend)
        answer = self._transfer(codec.READ, codec.INITIALISE, 0, 1)
        if bytes(answer) != bytes([codec.READY]):
            raise DeviceLost(
                f"the Kinect's motor is not ready: it answered {bytes(answer).hex() or 'nothing'}"
            )

    def send(self, request: codec.MotorRequest) -> None:
        """Have a request sent soon."""
        self._requests.put(request)

    def read(self, timeout_s: float) -> codec.MotorState:
        """Wait for requests for some time, send one if there is one, and read the state.

        Raises:
            DeviceLost: The device went away, or does not answer as it should.
        """
        try:
            request = self._requests.get(timeout=timeout_s)
        except queue.Empty:
            request = None
        if request is not None:
            self._transfer(codec.WRITE, request.request, request.value, None)
        try:
            return codec.decode_state(
                bytes(self._transfer(codec.READ, codec.READ_STATE, 0, codec.STATE_SIZE))
            )
        except FrameError as error:
            raise DeviceLost(str(error)) from error

    def close(self) -> None:
        """Give the device back; harmless when called twice."""
        device, self._device = self._device, None
        if device is not None:
            device.finalize()

    def _transfer(self, kind: int, request: int, value: int, size: int | None) -> Any:
        if self._device is None:
            raise DeviceLost("the Kinect's motor was closed")
        try:
            return self._device.ctrl_transfer(kind, request, value, 0, size, TIMEOUT_MS)
        except self._usb.USBError as error:
            if error.errno in (errno.EACCES, errno.EPERM):
                raise DeviceLost(f"this user may not open the Kinect's motor: {UDEV}") from error
            raise DeviceLost(f"the Kinect's motor went away: {error}") from error


def _pyusb() -> Any:
    try:
        import usb.core
    except ModuleNotFoundError as error:
        raise DeviceLost(PYUSB) from error
    return usb.core


def _find(usb: Any, index: int, backend: Any) -> Any:
    try:
        devices = list(usb.find(True, backend, idVendor=VENDOR))
    except usb.NoBackendError as error:
        raise DeviceLost(LIBUSB) from error
    except usb.USBError as error:
        raise DeviceLost(f"USB cannot be searched for the Kinect's motor: {error}") from error
    motors = [device for device in devices if device.idProduct == MOTOR]
    if index < len(motors):
        return motors[index]
    if not motors and any(device.idProduct in CAMERAS for device in devices):
        raise DeviceLost(OTHER_MODEL)
    raise DeviceLost(
        f"no motor of Kinect {index} on USB (045e:02b0; found {len(motors)}): check the USB plug and the "
        "12 V supply, without which only the hub answers"
    )
