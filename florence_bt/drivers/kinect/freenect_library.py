"""The C library libfreenect by ctypes: its functions with Python's types, its error codes as DeviceLost.

Nothing is loaded before a :class:`FreenectLibrary` is made.
"""

from __future__ import annotations

import ctypes
import enum
from collections import deque
from collections.abc import Callable
from ctypes import POINTER, byref, c_char_p, c_int, c_int8, c_int16, c_int32, c_long, c_uint32, c_void_p
from typing import Any

from numpy.typing import NDArray

from florence_bt.core.errors import DeviceLost

NAMES = ("libfreenect.so.0.5", "libfreenect.so.0", "libfreenect.so")
INSTALL = "sudo apt install libfreenect0.5"

MEDIUM = 1
"""The resolution of 640 x 480."""
CAMERA_ONLY = 2
"""The motor stays free for others (:mod:`florence_bt.drivers.kinect.motor`)."""
LOG_WARNING = 2
"""FREENECT_LOG_WARNING of libfreenect.h: fatal, errors and warnings are written, notices are not."""
LIBUSB_INTERRUPTED = -10
"""LIBUSB_ERROR_INTERRUPTED of libusb.h: a signal came while waiting."""


class DepthFormat(enum.IntEnum):
    """Formats of depth images that are used here."""

    RAW_11_BIT = 0
    REGISTERED = 4


class VideoFormat(enum.IntEnum):
    """Formats of colour images that are used here."""

    RGB = 0


class FrameMode(ctypes.Structure):
    """The mode of a stream of images; laid out as in libfreenect 0.5."""

    _fields_ = (
        ("reserved", c_uint32),
        ("resolution", c_int32),
        ("format", c_int32),
        ("bytes", c_int32),
        ("width", c_int16),
        ("height", c_int16),
        ("data_bits_per_pixel", c_int8),
        ("padding_bits_per_pixel", c_int8),
        ("framerate", c_int8),
        ("is_valid", c_int8),
    )


class _TimeValue(ctypes.Structure):
    _fields_ = (("seconds", c_long), ("microseconds", c_long))


_OnFrame = ctypes.CFUNCTYPE(None, c_void_p, c_void_p, c_uint32)
_OnLog = ctypes.CFUNCTYPE(None, c_void_p, c_int, c_char_p)

_SIGNATURES: dict[str, tuple[Any, tuple[Any, ...]]] = {
    "init": (c_int, (POINTER(c_void_p), c_void_p)),
    "shutdown": (c_int, (c_void_p,)),
    "set_log_level": (None, (c_void_p, c_int)),
    "set_log_callback": (None, (c_void_p, _OnLog)),
    "select_subdevices": (None, (c_void_p, c_int)),
    "num_devices": (c_int, (c_void_p,)),
    "open_device": (c_int, (c_void_p, POINTER(c_void_p), c_int)),
    "open_device_by_camera_serial": (c_int, (c_void_p, POINTER(c_void_p), c_char_p)),
    "close_device": (c_int, (c_void_p,)),
    "process_events_timeout": (c_int, (c_void_p, POINTER(_TimeValue))),
} | {
    name.format(stream): signature
    for stream in ("depth", "video")
    for name, signature in {
        "get_{}_mode_count": (c_int, ()),
        "get_{}_mode": (FrameMode, (c_int,)),
        "set_{}_mode": (c_int, (c_void_p, FrameMode)),
        "set_{}_buffer": (c_int, (c_void_p, c_void_p)),
        "set_{}_callback": (None, (c_void_p, _OnFrame)),
        "start_{}": (c_int, (c_void_p,)),
        "stop_{}": (c_int, (c_void_p,)),
    }.items()
}
"""Functions that are called, without ``freenect_``: the kind of the result and those of the arguments."""


class FreenectLibrary:
    """The library, and the one device of it that is open.

    All methods are called on one thread at a time; the callbacks come from within :meth:`process_events`.

    Args:
        file: The file of the library, or its name for the loader; the usual names when empty.

    Attributes:
        file: What was loaded.
        plays_recordings: Whether this is fakenect, which plays a recorded folder instead of a camera.
        complaints: The latest warnings and errors of the library.

    Raises:
        DeviceLost: There is no such library; the message says how to get it.
    """

    def __init__(self, file: str = "") -> None:
        self.file, self._library = _load(file)
        self.plays_recordings = not hasattr(self._library, "freenect_list_device_attributes")
        self.complaints: deque[str] = deque(maxlen=5)
        self._calls = {name: self._function(name) for name in _SIGNATURES}
        self._context = c_void_p()
        self._device = c_void_p()
        self._on_log = _OnLog(self._complain)
        self._callbacks: dict[str, Any] = {}
        if self._calls["init"](byref(self._context), None) < 0:
            raise DeviceLost(f"{self.file} finds no USB on this machine")
        self._calls["set_log_callback"](self._context, self._on_log)
        self._calls["set_log_level"](self._context, LOG_WARNING)
        self._calls["select_subdevices"](self._context, CAMERA_ONLY)

    def device_count(self) -> int:
        """Count the cameras that are plugged in."""
        return int(self._calls["num_devices"](self._context))

    def open_device(self, device: str) -> None:
        """Open a camera.

        Args:
            device: Its number from 0, or its serial number.

        Raises:
            DeviceLost: It cannot be opened.
        """
        handle = c_void_p()
        if device.isdecimal() and len(device) <= 2:
            code = self._calls["open_device"](self._context, byref(handle), int(device))
        else:
            serial = device.encode()
            code = self._calls["open_device_by_camera_serial"](self._context, byref(handle), serial)
        self._check(code, f"Kinect {device!r} cannot be opened")
        self._device = handle

    def find_mode(self, stream: str, format_: int) -> FrameMode | None:
        """Return the mode of 640 x 480 in a format, None when the library has none.

        fakenect ends the process when it is asked for a format that it does not know, so its list is read.

        Args:
            stream: ``depth`` or ``video``.
            format_: A :class:`DepthFormat` or :class:`VideoFormat`.
        """
        for number in range(self._calls[f"get_{stream}_mode_count"]()):
            mode = self._calls[f"get_{stream}_mode"](number)
            if mode.is_valid and (mode.resolution, mode.format) == (MEDIUM, format_):
                return mode
        return None

    def start(
        self, stream: str, mode: FrameMode, buffer: NDArray[Any], on_frame: Callable[[int], None]
    ) -> None:
        """Start a stream.

        Args:
            stream: ``depth`` or ``video``.
            mode: Of :meth:`find_mode`.
            buffer: Where the first image goes; must live until it is replaced or the stream is stopped.
            on_frame: Called with the device's time (60 million a second, 32 bits) when the image is whole.

        Raises:
            DeviceLost: The device refuses.
        """
        self._check(self._calls[f"set_{stream}_mode"](self._device, mode), f"no {stream} mode")
        self.set_buffer(stream, buffer)
        self._callbacks[stream] = _OnFrame(lambda _device, _data, ticks: on_frame(ticks))
        self._calls[f"set_{stream}_callback"](self._device, self._callbacks[stream])
        self._check(self._calls[f"start_{stream}"](self._device), f"the {stream} stream does not start")

    def set_buffer(self, stream: str, buffer: NDArray[Any]) -> None:
        """Have the next image put elsewhere; may be called by ``on_frame``."""
        self._calls[f"set_{stream}_buffer"](self._device, buffer.ctypes.data_as(c_void_p))

    def stop(self, stream: str) -> None:
        """Stop a stream; harmless when it is stopped, or the device is gone or was never open."""
        if self._device:
            self._calls[f"stop_{stream}"](self._device)

    def process_events(self, timeout_s: float) -> None:
        """Let the library work, which calls back with images.

        Raises:
            DeviceLost: The device went away, or the recording is over.
        """
        seconds = int(timeout_s)
        timeout = _TimeValue(seconds, round((timeout_s - seconds) * 1e6))
        code = self._calls["process_events_timeout"](self._context, byref(timeout))
        if code != LIBUSB_INTERRUPTED:
            self._check(code, "the Kinect went away")

    def close(self) -> None:
        """Close the device and release the library; nothing may be called afterwards."""
        if self._device:
            self._calls["close_device"](self._device)
        self._calls["shutdown"](self._context)
        if self.plays_recordings:
            # Its place in the recording is a static variable: only unloading sets it back to the start.
            _unload(self._library)

    def _complain(self, _context: int, _level: int, text: bytes) -> None:
        self.complaints.append(text.decode(errors="replace").strip())

    def _check(self, code: int, problem: str) -> None:
        if code < 0:
            reasons = "; ".join(self.complaints)
            self.complaints.clear()
            raise DeviceLost(f"{problem} ({reasons or f'libfreenect says {code}'})")

    def _function(self, name: str) -> Any:
        try:
            function = getattr(self._library, f"freenect_{name}")
        except AttributeError as error:
            raise DeviceLost(
                f"{self.file} has no freenect_{name}: it is not libfreenect 0.5 ({INSTALL})"
            ) from error
        function.restype, function.argtypes = _SIGNATURES[name]
        return function


def _load(file: str) -> tuple[str, ctypes.CDLL]:
    reasons = []
    for name in (file,) if file else NAMES:
        try:
            return name, ctypes.CDLL(name)
        except OSError as error:
            reasons.append(str(error))
    raise DeviceLost(
        f"libfreenect cannot be loaded: {reasons[0]}; install it ({INSTALL}), or name its file with 'library'"
    )


def _unload(library: ctypes.CDLL) -> None:
    close = ctypes.CDLL(None).dlclose
    close.argtypes, close.restype = (c_void_p,), c_int
    close(library._handle)
