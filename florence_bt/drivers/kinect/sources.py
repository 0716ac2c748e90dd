"""Chooses the source of frames that the parameters name."""

from __future__ import annotations

from florence_bt.drivers.kinect.driver import KinectParameters
from florence_bt.drivers.kinect.freenect_source import FreenectSource
from florence_bt.drivers.kinect.transport import FrameSource, SocketFrameSource

USB, RECORDING = "usb", "recording"


def open_source(parameters: KinectParameters) -> FrameSource:
    """Open what ``source`` names.

    Raises:
        DeviceLost: It cannot be opened; the message says what to do.
    """
    kind, _, rest = parameters.source.partition(":")
    if kind == USB:
        return FreenectSource(
            rest or "0", registered=parameters.depth_registration, library=parameters.library
        )
    if kind == RECORDING:
        return FreenectSource(library=parameters.library, folder=rest)
    return SocketFrameSource(parameters.source)
