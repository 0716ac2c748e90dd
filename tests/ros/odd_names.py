"""A DDS participant with a topic whose name ROS does not allow, as other people's programs have them.

rcl refuses such names, rmw does not where it is told to leave the conventions of ROS aside: it is asked here.
"""

from __future__ import annotations

import ctypes
import sys
from typing import Any

from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.utilities import get_rmw_implementation_identifier
from std_msgs.msg import Float64


class _Time(ctypes.Structure):
    _fields_ = [("sec", ctypes.c_uint64), ("nsec", ctypes.c_uint64)]


class _Qos(ctypes.Structure):
    """``rmw_qos_profile_t`` (rmw/types.h)."""

    _fields_ = [
        ("history", ctypes.c_int),
        ("depth", ctypes.c_size_t),
        ("reliability", ctypes.c_int),
        ("durability", ctypes.c_int),
        ("deadline", _Time),
        ("lifespan", _Time),
        ("liveliness", ctypes.c_int),
        ("liveliness_lease_duration", _Time),
        ("avoid_ros_namespace_conventions", ctypes.c_bool),
    ]


class _Options(ctypes.Structure):
    """``rmw_publisher_options_t`` (rmw/types.h)."""

    _fields_ = [("payload", ctypes.c_void_p), ("unique_flows", ctypes.c_int)]


def publish_by_dds_name(node: Node, dds_name: str, message_type: Any = Float64) -> None:
    """Make a publisher of a DDS topic; it lives as long as the process.

    Args:
        node: The node whose participant has it.
        dds_name: As DDS has it, e.g. ``rt//double``.
        message_type: Its type.
    """
    message_type.__class__.__import_type_support__()
    rcl, rmw = ctypes.CDLL("librcl.so"), ctypes.CDLL(f"lib{get_rmw_implementation_identifier()}.so")
    rcl.rcl_node_get_rmw_handle.restype = ctypes.c_void_p
    rcl.rcl_node_get_rmw_handle.argtypes = [ctypes.c_void_p]
    rmw.rmw_create_publisher.restype = ctypes.c_void_p
    rmw.rmw_create_publisher.argtypes = [
        *(ctypes.c_void_p, ctypes.c_void_p, ctypes.c_char_p),
        *(ctypes.POINTER(_Qos), ctypes.POINTER(_Options)),
    ]
    python = ctypes.pythonapi
    python.PyCapsule_GetName.restype, python.PyCapsule_GetName.argtypes = ctypes.c_char_p, [ctypes.py_object]
    python.PyCapsule_GetPointer.restype = ctypes.c_void_p
    python.PyCapsule_GetPointer.argtypes = [ctypes.py_object, ctypes.c_char_p]
    capsule = message_type.__class__._TYPE_SUPPORT
    support = python.PyCapsule_GetPointer(capsule, python.PyCapsule_GetName(capsule))
    default = QoSProfile(depth=1)
    qos = _Qos(default.history, 1, 1, 2, _Time(), _Time(), 1, _Time(), True)
    with node.handle:
        made = rmw.rmw_create_publisher(
            rcl.rcl_node_get_rmw_handle(node.handle.pointer),
            support,
            dds_name.encode(),
            ctypes.byref(qos),
            ctypes.byref(_Options(None, 0)),
        )
    assert made, f"rmw made no publisher of {dds_name!r}"


def main(names: list[str]) -> None:
    """Be a program that publishes topics of such names, until it is ended."""
    import rclpy

    rclpy.init()
    node = rclpy.create_node("other_peoples_program")
    for name in names:
        publish_by_dds_name(node, name)
    print("the names are there", flush=True)
    rclpy.spin(node)


if __name__ == "__main__":
    main(sys.argv[1:])
