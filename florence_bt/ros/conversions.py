"""Between the core's values and ROS messages: the one place where they meet.

Stamps are seconds as a float. Names are ``<value>_to_ros`` and ``<value>_from_ros``; what a message must not
be raises :class:`~florence_bt.core.errors.FrameError`. No array is copied element by element.
"""

from __future__ import annotations

import array
import math
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from builtin_interfaces.msg import Duration as DurationMsg
from builtin_interfaces.msg import Time as TimeMsg
from geometry_msgs.msg import (
    Pose,
    PoseArray,
    PoseStamped,
    PoseWithCovarianceStamped,
    Quaternion,
    TransformStamped,
    Twist,
)
from nav_msgs.msg import OccupancyGrid as OccupancyGridMsg
from nav_msgs.msg import Odometry as OdometryMsg
from nav_msgs.msg import Path as PathMsg
from numpy.typing import NDArray
from sensor_msgs.msg import CameraInfo, Image, LaserEcho, MultiEchoLaserScan, PointCloud2, PointField
from sensor_msgs.msg import LaserScan as LaserScanMsg
from std_msgs.msg import Header

from florence_bt.core.errors import FrameError
from florence_bt.core.geometry import Pose2, Twist2, yaw_of_quaternion
from florence_bt.core.sensing import (
    CameraModel,
    ColourImage,
    DepthImage,
    FloatArray,
    LaserScan,
    OccupancyGrid,
    Odometry,
    PoseEstimate,
)
from florence_bt.core.transforms import Transform3

NANO = 1_000_000_000
"""Nanoseconds of a second."""
NO_COVARIANCE = (0.0,) * 36
_PLANE = np.ix_([0, 1, 5], [0, 1, 5])
"""Of the 6 x 6 numbers of a covariance, those of x, y and yaw."""


def _split(seconds: float) -> tuple[int, int]:
    if not math.isfinite(seconds):
        raise FrameError(f"{seconds} is not a time")
    whole, nanoseconds = divmod(round(seconds * NANO), NANO)
    if not -(2**31) <= whole < 2**31:
        raise FrameError(f"{seconds} s does not fit the 32 bits of a ROS time")
    return whole, nanoseconds


def stamp_to_ros(seconds: float) -> TimeMsg:
    """Convert a moment, rounded to nanoseconds."""
    whole, nanoseconds = _split(seconds)
    return TimeMsg(sec=whole, nanosec=nanoseconds)


def stamp_from_ros(message: TimeMsg) -> float:
    """Convert a moment to seconds."""
    return float(message.sec) + float(message.nanosec) / NANO


def duration_to_ros(seconds: float) -> DurationMsg:
    """Convert a length of time, rounded to nanoseconds."""
    whole, nanoseconds = _split(seconds)
    return DurationMsg(sec=whole, nanosec=nanoseconds)


def duration_from_ros(message: DurationMsg) -> float:
    """Convert a length of time to seconds."""
    return float(message.sec) + float(message.nanosec) / NANO


def header_to_ros(frame_id: str, stamp: float) -> Header:
    """Make a header."""
    return Header(stamp=stamp_to_ros(stamp), frame_id=frame_id)


def frame_from_ros(frame_id: str) -> str:
    """Return a frame's name without the leading slash of old software."""
    return frame_id.lstrip("/")


def quaternion_from_yaw(yaw: float) -> Quaternion:
    """Convert a heading to a quaternion."""
    return Quaternion(z=math.sin(yaw / 2.0), w=math.cos(yaw / 2.0))


def yaw_from_quaternion(q: Quaternion) -> float:
    """Return the heading of the rotated x axis in (-pi, pi]; zero for the invalid all-zero quaternion."""
    return yaw_of_quaternion(q.x, q.y, q.z, q.w)


def pose_to_ros(pose: Pose2) -> Pose:
    """Convert a pose in the plane z = 0."""
    message = Pose(orientation=quaternion_from_yaw(pose.yaw))
    message.position.x, message.position.y = float(pose.x), float(pose.y)
    return message


def pose_from_ros(message: Pose) -> Pose2:
    """Return the part of a pose that lies in the plane."""
    return Pose2(message.position.x, message.position.y, yaw_from_quaternion(message.orientation))


def pose_stamped_to_ros(pose: Pose2, frame_id: str, stamp: float) -> PoseStamped:
    """Convert a pose with its frame and moment."""
    return PoseStamped(header=header_to_ros(frame_id, stamp), pose=pose_to_ros(pose))


def pose_with_covariance_to_ros(
    pose: Pose2, covariance: Sequence[float], frame_id: str, stamp: float
) -> PoseWithCovarianceStamped:
    """Convert a pose with its uncertainty.

    Args:
        pose: The pose.
        covariance: Shape (36,): 6 x 6 row-major over x, y, z, roll, pitch, yaw.
        frame_id: The frame of the pose.
        stamp: Seconds.
    """
    message = PoseWithCovarianceStamped(header=header_to_ros(frame_id, stamp))
    message.pose.pose = pose_to_ros(pose)
    message.pose.covariance = _covariance(covariance)
    return message


def estimate_to_ros(estimate: PoseEstimate) -> PoseWithCovarianceStamped:
    """Convert a pose in the plane with how sure it is."""
    whole = np.zeros((6, 6))
    whole[_PLANE] = estimate.covariance
    return pose_with_covariance_to_ros(estimate.pose, whole.ravel().tolist(), estimate.frame, estimate.stamp)


def estimate_from_ros(message: PoseWithCovarianceStamped) -> PoseEstimate:
    """Return the part of a pose and its covariance that lies in the plane."""
    return PoseEstimate(
        stamp_from_ros(message.header.stamp),
        frame_from_ros(message.header.frame_id),
        pose_from_ros(message.pose.pose),
        np.reshape(message.pose.covariance, (6, 6))[_PLANE],
    )


def pose_array_to_ros(poses: Iterable[Pose2], frame_id: str, stamp: float) -> PoseArray:
    """Convert many poses in one frame."""
    return PoseArray(header=header_to_ros(frame_id, stamp), poses=[pose_to_ros(pose) for pose in poses])


def path_to_ros(poses: Iterable[Pose2], frame_id: str, stamp: float) -> PathMsg:
    """Convert a path."""
    stamped = [pose_stamped_to_ros(pose, frame_id, stamp) for pose in poses]
    return PathMsg(header=header_to_ros(frame_id, stamp), poses=stamped)


def twist_to_ros(twist: Twist2) -> Twist:
    """Convert a velocity in the plane."""
    message = Twist()
    message.linear.x, message.angular.z = float(twist.linear), float(twist.angular)
    return message


def twist_from_ros(message: Twist) -> Twist2:
    """Return the part of a velocity that a differential drive can follow."""
    return Twist2(message.linear.x, message.angular.z)


def odometry_to_ros(
    odometry: Odometry,
    frame_id: str,
    child_frame_id: str,
    pose_covariance: Sequence[float] = NO_COVARIANCE,
    twist_covariance: Sequence[float] = NO_COVARIANCE,
) -> OdometryMsg:
    """Convert the odometry of a base.

    Args:
        odometry: Pose and velocity.
        frame_id: The frame of the pose.
        child_frame_id: The frame that moves, and the frame of the velocity.
        pose_covariance: Shape (36,): 6 x 6 row-major over x, y, z, roll, pitch, yaw.
        twist_covariance: Likewise.
    """
    message = OdometryMsg(header=header_to_ros(frame_id, odometry.stamp), child_frame_id=child_frame_id)
    message.pose.pose = pose_to_ros(odometry.pose)
    message.pose.covariance = _covariance(pose_covariance)
    message.twist.twist = twist_to_ros(odometry.twist)
    message.twist.covariance = _covariance(twist_covariance)
    return message


def odometry_from_ros(message: OdometryMsg) -> Odometry:
    """Convert the pose and velocity of a base."""
    return Odometry(
        stamp_from_ros(message.header.stamp),
        pose_from_ros(message.pose.pose),
        twist_from_ros(message.twist.twist),
    )


def transform_to_ros(
    parent: str, child: str, stamp: float, transform: Transform3 | Pose2
) -> TransformStamped:
    """Convert a transform from a child to its parent frame."""
    message = TransformStamped(header=header_to_ros(parent, stamp), child_frame_id=child)
    target = message.transform
    if isinstance(transform, Pose2):
        target.translation.x, target.translation.y = float(transform.x), float(transform.y)
        target.rotation = quaternion_from_yaw(transform.yaw)
    else:
        target.translation.x, target.translation.y, target.translation.z = map(float, transform.translation)
        x, y, z, w = transform.quaternion()
        target.rotation = Quaternion(x=x, y=y, z=z, w=w)
    return message


def transform_from_ros(message: TransformStamped) -> tuple[str, str, float, Transform3]:
    """Return parent, child, moment and transform.

    Raises:
        FrameError: The rotation is not a quaternion, or a number is not finite.
    """
    t, q = message.transform.translation, message.transform.rotation
    numbers = (t.x, t.y, t.z, q.x, q.y, q.z, q.w)
    if not all(map(math.isfinite, numbers)) or not any(numbers[3:]):
        raise FrameError(
            f"the transform of frame {message.child_frame_id!r} is not a rigid motion: {numbers}"
        )
    transform = Transform3.from_quaternion(numbers[:3], (q.x, q.y, q.z, q.w))
    header = message.header
    return (
        frame_from_ros(header.frame_id),
        frame_from_ros(message.child_frame_id),
        stamp_from_ros(header.stamp),
        transform,
    )


def planar_transform_from_ros(message: TransformStamped) -> tuple[str, str, float, Pose2]:
    """Return parent, child, moment and the part in the plane of a transform that was checked: much faster."""
    t, header = message.transform.translation, message.header
    return (
        frame_from_ros(header.frame_id),
        frame_from_ros(message.child_frame_id),
        stamp_from_ros(header.stamp),
        Pose2(t.x, t.y, yaw_from_quaternion(message.transform.rotation)),
    )


def _covariance(values: Sequence[float]) -> list[float]:
    if len(values) != 36:
        raise FrameError(f"a covariance has 36 numbers, not {len(values)}")
    return [float(value) for value in values]


# ---- sensors ------------------------------------------------------------------------------------------


def scan_to_ros(scan: LaserScan) -> LaserScanMsg:
    """Convert a laser scan."""
    return LaserScanMsg(
        **_geometry_to_ros(scan),
        ranges=_to_array("f", scan.ranges, np.float32),
        intensities=_to_array("f", scan.intensities, np.float32),
    )


def _geometry_to_ros(scan: LaserScan) -> dict[str, Any]:
    """Return the fields that the messages of a scan have in common."""
    names = (
        "angle_min",
        "angle_max",
        "angle_increment",
        "time_increment",
        "scan_time",
        "range_min",
        "range_max",
    )
    numbers = {name: float(getattr(scan, name)) for name in names}
    return {"header": header_to_ros(scan.frame_id, scan.stamp), **numbers}


def scan_from_ros(message: LaserScanMsg) -> LaserScan:
    """Convert a laser scan; its arrays share the message's memory."""
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
    """Convert a laser scan with every echo of each beam.

    Args:
        scan: The scan that the echoes belong to, n beams.
        echoes: Shape (n, k), metres, NaN from a beam's last echo on.
        intensities: Shape (n, k) likewise, or (n, 0) without intensities.
    """
    return MultiEchoLaserScan(
        **_geometry_to_ros(scan),
        ranges=_to_echoes(echoes),
        intensities=_to_echoes(intensities) if intensities.size else [],
    )


def _to_echoes(beams: FloatArray) -> list[LaserEcho]:
    return [LaserEcho(echoes=_to_array("f", beam[~np.isnan(beam)], np.float32)) for beam in beams]


def depth_to_ros(image: DepthImage) -> Image:
    """Convert a depth image to the encoding 32FC1, metres."""
    return _image_to_ros("32FC1", image.depth, np.float32, image.frame_id, image.stamp)


def depth_from_ros(message: Image, camera: CameraModel) -> DepthImage:
    """Convert a depth image from 32FC1 (metres) or 16UC1 (millimetres, 0 = nothing measured).

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
        raise FrameError(f"a depth image cannot be {message.encoding!r} (would have worked: 32FC1, 16UC1)")
    return DepthImage(
        stamp_from_ros(message.header.stamp), frame_from_ros(message.header.frame_id), camera, depth
    )


def colour_to_ros(image: ColourImage) -> Image:
    """Convert a colour image to the encoding rgb8."""
    return _image_to_ros("rgb8", image.pixels, np.uint8, image.frame_id, image.stamp)


_CHANNELS: dict[str, tuple[int, ...]] = {
    "rgb8": (0, 1, 2),
    "rgba8": (0, 1, 2, 3),
    "bgr8": (2, 1, 0),
    "bgra8": (2, 1, 0, 3),
    "mono8": (0,),
}


def colour_from_ros(message: Image, camera: CameraModel) -> ColourImage:
    """Convert a colour image from rgb8, rgba8, bgr8, bgra8 or mono8.

    Raises:
        FrameError: Another encoding, or not as many bytes as the size says.
    """
    pixels = colours_from_ros(message)
    return ColourImage(
        stamp_from_ros(message.header.stamp), frame_from_ros(message.header.frame_id), camera, pixels
    )


def colours_from_ros(message: Image) -> NDArray[np.uint8]:
    """Return the pixels of a colour image as :func:`colour_from_ros` has them: shape (rows, columns, 3), RGB.

    Raises:
        FrameError: Another encoding, or not as many bytes as the size says.
    """
    order = _CHANNELS.get(message.encoding)
    if order is None:
        valid = ", ".join(_CHANNELS)
        raise FrameError(f"a colour image cannot be {message.encoding!r} (would have worked: {valid})")
    raw = _pixels(message, np.dtype(np.uint8), len(order))
    if message.encoding == "mono8":
        return np.repeat(raw[..., None], 3, axis=2)
    return raw if message.encoding == "rgb8" else np.ascontiguousarray(raw[..., list(order[:3])])


def camera_info_to_ros(camera: CameraModel, frame_id: str, stamp: float) -> CameraInfo:
    """Convert a camera model without distortion."""
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
    """Convert a camera model; the distortion is left out.

    Raises:
        FrameError: The camera is not calibrated.
    """
    fx, cx, fy, cy = (float(message.k[index]) for index in (0, 2, 4, 5))
    if not (fx > 0.0 and fy > 0.0):
        raise FrameError(f"the camera {message.header.frame_id!r} is not calibrated: fx = {fx}, fy = {fy}")
    return CameraModel(message.width, message.height, fx, fy, cx, cy)


def grid_to_ros(grid: OccupancyGrid, frame_id: str, stamp: float) -> OccupancyGridMsg:
    """Convert a grid map."""
    message = OccupancyGridMsg(header=header_to_ros(frame_id, stamp))
    message.info.map_load_time = stamp_to_ros(stamp)
    message.info.resolution = float(grid.resolution)
    message.info.height, message.info.width = grid.cells.shape
    message.info.origin = pose_to_ros(grid.origin)
    message.data = _to_array("b", grid.cells, np.int8)
    return message


def grid_from_ros(message: OccupancyGridMsg) -> OccupancyGrid:
    """Convert a grid map, turned to the axes of its frame; if not turned, it shares the message's memory.

    Raises:
        FrameError: The size does not fit the number of cells, or the resolution is not above zero.
    """
    rows, columns, resolution = message.info.height, message.info.width, message.info.resolution
    if len(message.data) != rows * columns or not resolution > 0.0:
        raise FrameError(
            f"a map of {rows} x {columns} cells of {resolution} m cannot have {len(message.data)} values"
        )
    cells = np.frombuffer(message.data, np.int8).reshape(rows, columns)
    return OccupancyGrid(float(resolution), pose_from_ros(message.info.origin), cells).upright()


def _to_array(code: str, values: NDArray[Any], kind: type[np.generic]) -> array.array[Any]:
    """Convert the values to the kind of array that messages take without looking at each element."""
    result = array.array(code)
    result.frombytes(np.ascontiguousarray(values, kind).tobytes())
    return result


def _pixels(message: Image, kind: np.dtype[Any], channels: int) -> NDArray[Any]:
    """Return the pixels of an image, shape (height, width) or (height, width, channels); without padding."""
    row_bytes = message.width * channels * kind.itemsize
    if message.step < row_bytes or len(message.data) != message.step * message.height:
        raise FrameError(
            f"an image of {message.width} x {message.height} pixels ({message.encoding}) with "
            f"{message.step} bytes a row cannot have {len(message.data)} bytes"
        )
    stored = kind.newbyteorder(">" if message.is_bigendian else "<")
    rows = np.frombuffer(message.data, np.uint8).reshape(message.height, message.step)[:, :row_bytes]
    pixels = np.ascontiguousarray(rows).view(stored)
    return pixels if channels == 1 else pixels.reshape(message.height, message.width, channels)


NAMES = ("x", "y", "z", "rgb")


def points_to_ros(points: NDArray[np.float32], frame_id: str, stamp: float) -> PointCloud2:
    """Convert points of an image, which may hold NaN.

    Args:
        points: Shape (height, width, 3) of x, y, z in metres, or (height, width, 4) with the bits of
            0x00RRGGBB as a float.
        frame_id: Frame of the points.
        stamp: Seconds.
    """
    rows, columns, count = points.shape
    fields = [
        PointField(name=name, offset=4 * index, datatype=PointField.FLOAT32, count=1)
        for index, name in enumerate(NAMES[:count])
    ]
    return PointCloud2(
        header=header_to_ros(frame_id, stamp),
        height=rows,
        width=columns,
        fields=fields,
        is_bigendian=False,
        point_step=4 * count,
        row_step=4 * count * columns,
        data=_to_array("B", points, np.float32),
        is_dense=False,
    )


def millimetres_to_ros(millimetres: NDArray[np.uint16], frame_id: str, stamp: float) -> Image:
    """Convert a depth image to the encoding 16UC1: whole millimetres, 0 where nothing was measured."""
    return _image_to_ros("16UC1", millimetres, np.uint16, frame_id, stamp)


def _image_to_ros(
    encoding: str, pixels: NDArray[Any], kind: type[np.generic], frame_id: str, stamp: float
) -> Image:
    data = _to_array("B", pixels, kind)
    rows, columns = pixels.shape[:2]
    return Image(
        header=header_to_ros(frame_id, stamp),
        height=rows,
        width=columns,
        encoding=encoding,
        is_bigendian=0,
        step=len(data) // max(rows, 1),
        data=data,
    )
