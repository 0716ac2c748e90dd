"""Scans, pictures and maps to and from their messages. No array is copied element by element."""

from __future__ import annotations

import array
from typing import Any

import numpy as np
from nav_msgs.msg import OccupancyGrid as OccupancyGridMsg
from numpy.typing import NDArray
from sensor_msgs.msg import CameraInfo, Image, LaserEcho, MultiEchoLaserScan
from sensor_msgs.msg import LaserScan as LaserScanMsg

from florence_bt.core.errors import FrameError
from florence_bt.core.sensing import (
    CameraModel,
    ColourImage,
    DepthImage,
    FloatArray,
    LaserScan,
    OccupancyGrid,
)
from florence_bt.ros._convert_geometry import (
    frame_from_ros,
    header_to_ros,
    pose_from_ros,
    pose_to_ros,
    stamp_from_ros,
    stamp_to_ros,
)


def scan_to_ros(scan: LaserScan) -> LaserScanMsg:
    """A laser scan."""
    return LaserScanMsg(
        header=header_to_ros(scan.frame_id, scan.stamp),
        angle_min=float(scan.angle_min),
        angle_max=float(scan.angle_max),
        angle_increment=float(scan.angle_increment),
        time_increment=float(scan.time_increment),
        scan_time=float(scan.scan_time),
        range_min=float(scan.range_min),
        range_max=float(scan.range_max),
        ranges=_to_array("f", scan.ranges, np.float32),
        intensities=_to_array("f", scan.intensities, np.float32),
    )


def scan_from_ros(message: LaserScanMsg) -> LaserScan:
    """A laser scan; its arrays share the message's memory."""
    return LaserScan(
        stamp=stamp_from_ros(message.header.stamp),
        frame_id=frame_from_ros(message.header.frame_id),
        angle_min=message.angle_min,
        angle_increment=message.angle_increment,
        range_min=message.range_min,
        range_max=message.range_max,
        ranges=np.frombuffer(message.ranges, np.float32),
        time_increment=message.time_increment,
        scan_time=message.scan_time,
        intensities=np.frombuffer(message.intensities, np.float32),
    )


def echoes_to_ros(scan: LaserScan, echoes: FloatArray, intensities: FloatArray) -> MultiEchoLaserScan:
    """A laser scan with every echo of each beam.

    Args:
        scan: The scan that the echoes belong to, n beams.
        echoes: Shape (n, k), metres, NaN from a beam's last echo on.
        intensities: Shape (n, k) likewise, or (n, 0) without intensities.
    """
    return MultiEchoLaserScan(
        header=header_to_ros(scan.frame_id, scan.stamp),
        angle_min=float(scan.angle_min),
        angle_max=float(scan.angle_max),
        angle_increment=float(scan.angle_increment),
        time_increment=float(scan.time_increment),
        scan_time=float(scan.scan_time),
        range_min=float(scan.range_min),
        range_max=float(scan.range_max),
        ranges=_to_echoes(echoes),
        intensities=_to_echoes(intensities) if intensities.size else [],
    )


def _to_echoes(beams: FloatArray) -> list[LaserEcho]:
    return [LaserEcho(echoes=_to_array("f", beam[~np.isnan(beam)], np.float32)) for beam in beams]


def depth_to_ros(image: DepthImage) -> Image:
    """A depth picture in the encoding 32FC1, metres."""
    rows, columns = image.depth.shape
    return Image(
        header=header_to_ros(image.frame_id, image.stamp),
        height=rows,
        width=columns,
        encoding="32FC1",
        is_bigendian=0,
        step=4 * columns,
        data=_to_array("B", image.depth, np.float32),
    )


def depth_from_ros(message: Image, camera: CameraModel) -> DepthImage:
    """A depth picture from 32FC1 (metres) or 16UC1 (millimetres, 0 = nothing measured).

    Raises:
        FrameError: Another encoding, or not as many bytes as the size says.
    """
    depth: NDArray[np.float32]
    if message.encoding == "32FC1":
        depth = _pixels(message, np.dtype(np.float32), 1).astype(np.float32, copy=False)
    elif message.encoding in ("16UC1", "mono16"):
        millimetres = _pixels(message, np.dtype(np.uint16), 1)
        depth = np.where(millimetres > 0, millimetres * np.float32(1e-3), np.float32(np.nan)).astype(
            np.float32
        )
    else:
        raise FrameError(f"a depth picture cannot be {message.encoding!r} (would have worked: 32FC1, 16UC1)")
    return DepthImage(
        stamp_from_ros(message.header.stamp), frame_from_ros(message.header.frame_id), camera, depth
    )


def colour_to_ros(image: ColourImage) -> Image:
    """A colour picture in the encoding rgb8."""
    rows, columns, _ = image.pixels.shape
    return Image(
        header=header_to_ros(image.frame_id, image.stamp),
        height=rows,
        width=columns,
        encoding="rgb8",
        is_bigendian=0,
        step=3 * columns,
        data=_to_array("B", image.pixels, np.uint8),
    )


_CHANNELS: dict[str, tuple[int, ...]] = {
    "rgb8": (0, 1, 2),
    "rgba8": (0, 1, 2, 3),
    "bgr8": (2, 1, 0),
    "bgra8": (2, 1, 0, 3),
    "mono8": (0,),
}


def colour_from_ros(message: Image, camera: CameraModel) -> ColourImage:
    """A colour picture from rgb8, rgba8, bgr8, bgra8 or mono8.

    Raises:
        FrameError: Another encoding, or not as many bytes as the size says.
    """
    order = _CHANNELS.get(message.encoding)
    if order is None:
        valid = ", ".join(_CHANNELS)
        raise FrameError(f"a colour picture cannot be {message.encoding!r} (would have worked: {valid})")
    raw = _pixels(message, np.dtype(np.uint8), len(order))
    if message.encoding == "mono8":
        pixels = np.repeat(raw[..., None], 3, axis=2)
    elif message.encoding == "rgb8":
        pixels = raw
    else:
        pixels = np.ascontiguousarray(raw[..., list(order[:3])])
    return ColourImage(
        stamp_from_ros(message.header.stamp), frame_from_ros(message.header.frame_id), camera, pixels
    )


def camera_info_to_ros(camera: CameraModel, frame_id: str, stamp: float) -> CameraInfo:
    """A camera model without distortion."""
    return CameraInfo(
        header=header_to_ros(frame_id, stamp),
        height=camera.height,
        width=camera.width,
        distortion_model="plumb_bob",
        d=[0.0] * 5,
        k=[camera.fx, 0.0, camera.cx, 0.0, camera.fy, camera.cy, 0.0, 0.0, 1.0],
        r=[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        p=[camera.fx, 0.0, camera.cx, 0.0, 0.0, camera.fy, camera.cy, 0.0, 0.0, 0.0, 1.0, 0.0],
    )


def camera_model_from_ros(message: CameraInfo) -> CameraModel:
    """A camera model; the distortion is left out.

    Raises:
        FrameError: The camera is not calibrated.
    """
    fx, cx, fy, cy = (float(message.k[index]) for index in (0, 2, 4, 5))
    if not (fx > 0.0 and fy > 0.0):
        raise FrameError(f"the camera {message.header.frame_id!r} is not calibrated: fx = {fx}, fy = {fy}")
    return CameraModel(message.width, message.height, fx, fy, cx, cy)


def grid_to_ros(grid: OccupancyGrid, frame_id: str, stamp: float) -> OccupancyGridMsg:
    """A grid map."""
    message = OccupancyGridMsg(header=header_to_ros(frame_id, stamp))
    message.info.map_load_time = stamp_to_ros(stamp)
    message.info.resolution = float(grid.resolution)
    message.info.height, message.info.width = grid.cells.shape
    message.info.origin = pose_to_ros(grid.origin)
    message.data = _to_array("b", grid.cells, np.int8)
    return message


def grid_from_ros(message: OccupancyGridMsg) -> OccupancyGrid:
    """A grid map; its cells share the message's memory.

    Raises:
        FrameError: The size does not fit the number of cells, or the resolution is not above zero.
    """
    rows, columns, resolution = message.info.height, message.info.width, message.info.resolution
    if len(message.data) != rows * columns or not resolution > 0.0:
        raise FrameError(
            f"a map of {rows} x {columns} cells of {resolution} m cannot have {len(message.data)} values"
        )
    cells = np.frombuffer(message.data, np.int8).reshape(rows, columns)
    return OccupancyGrid(float(resolution), pose_from_ros(message.info.origin), cells)


def _to_array(code: str, values: NDArray[Any], kind: type[np.generic]) -> array.array[Any]:
    """The values as the kind of array that messages take without looking at each element."""
    result = array.array(code)
    result.frombytes(np.ascontiguousarray(values, kind).tobytes())
    return result


def _pixels(message: Image, kind: np.dtype[Any], channels: int) -> NDArray[Any]:
    """The pixels of a picture, shape (height, width) or (height, width, channels); without padding."""
    row_bytes = message.width * channels * kind.itemsize
    if message.step < row_bytes or len(message.data) != message.step * message.height:
        raise FrameError(
            f"a picture of {message.width} x {message.height} pixels ({message.encoding}) with "
            f"{message.step} bytes a row cannot have {len(message.data)} bytes"
        )
    stored = kind.newbyteorder(">" if message.is_bigendian else "<")
    rows = np.frombuffer(message.data, np.uint8).reshape(message.height, message.step)[:, :row_bytes]
    pixels = np.ascontiguousarray(rows).view(stored)
    return pixels if channels == 1 else pixels.reshape(message.height, message.width, channels)
