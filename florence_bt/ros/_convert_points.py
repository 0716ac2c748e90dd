"""Point clouds, and depth in whole millimetres, as messages; no array is copied element by element."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from sensor_msgs.msg import Image, PointCloud2, PointField

from florence_bt.ros._convert_geometry import header_to_ros
from florence_bt.ros._convert_sensors import _to_array

NAMES = ("x", "y", "z", "rgb")


def points_to_ros(points: NDArray[np.float32], frame_id: str, stamp: float) -> PointCloud2:
    """Points of a picture, which may hold NaN.

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
    """A depth picture in the encoding 16UC1: whole millimetres, 0 where nothing was measured."""
    rows, columns = millimetres.shape
    return Image(
        header=header_to_ros(frame_id, stamp),
        height=rows,
        width=columns,
        encoding="16UC1",
        is_bigendian=0,
        step=2 * columns,
        data=_to_array("B", millimetres, np.uint16),
    )
