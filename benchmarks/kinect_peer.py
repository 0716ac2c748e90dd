"""The other end of the Kinect's node, in a process of its own: sends it frames and listens to its pictures.

``python kinect_peer.py SOCKET SECONDS colour|depth`` prints the latencies in seconds from the last byte of a
depth frame to the picture's arrival here. With SOCKET ``-`` it only listens, and prints how many came.
"""

from __future__ import annotations

import json
import sys
import time
from typing import Any

import numpy as np
import rclpy
from sensor_msgs.msg import Image

from florence_bt.drivers.kinect.codec import METRES_OF_RAW
from florence_bt.ros.executor import SpinLoop
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.qos import SENSOR
from florence_bt.simulation.emulators.kinect_frames import KinectFrameServer

RATE = 30.0
FIRST_RAW, NUMBERS = 500, 500


def main(path: str, seconds: float, colour: bool) -> None:
    rclpy.init()
    loop = SpinLoop()
    node = FlorenceNode("kinect_peer")
    loop.add(node)
    sent: dict[int, float] = {}
    latencies: list[float] = []

    def on_depth(message: Any) -> None:
        # The frame's number is its first raw value.
        metres = np.frombuffer(message.data, np.float32, 1)[0]
        number = int(np.searchsorted(METRES_OF_RAW[FIRST_RAW : FIRST_RAW + NUMBERS], metres))
        latencies.append(time.perf_counter() - sent.pop(number, float("nan")))

    node.create_subscription(Image, "camera/depth/image", on_depth, SENSOR)
    if colour:
        node.create_subscription(Image, "camera/rgb/image_color", lambda _message: None, SENSOR)
    server = KinectFrameServer(path) if path != "-" else None
    raw = np.random.default_rng(1).integers(400, 1000, (240, 320)).astype(np.uint16)
    pixels = np.random.default_rng(2).integers(0, 256, (240, 320, 3)).astype(np.uint8)
    print("ready", flush=True)
    begin = time.monotonic()
    number = 0
    while time.monotonic() < begin + seconds:
        if server is not None:
            number += 1
            raw[0, 0] = FIRST_RAW + number % NUMBERS
            server.send_raw_depth(raw, 0.0)
            sent[number % NUMBERS] = time.perf_counter()
            if colour:
                server.send_colour(pixels, 0.0)
        due = begin + (number if server is not None else (time.monotonic() - begin) * RATE + 1) / RATE
        while (rest := due - time.monotonic()) > 0.0:
            loop.spin_once(min(rest, 0.002))
    loop.close()
    if server is not None:
        server.close()
    print(json.dumps(latencies if server is not None else len(latencies)))


if __name__ == "__main__":
    main(sys.argv[1], float(sys.argv[2]), sys.argv[3] == "colour")
