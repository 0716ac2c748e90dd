"""A network that tells of each part of a depth picture whether it shows a person.

It also tells where the middle of that person is, and whether they stand, sit or lie. It was trained on
simulated pictures only (``tools/person_network``), as the body parts of the first Kinect were.

Source:
    Shotton et al., Real-Time Human Pose Recognition in Parts from Single Depth Images, CVPR 2011.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from florence_bt.core.sensing import CameraModel, DepthImage, Posture
from florence_bt.core.transforms import Transform3

FILE = Path(__file__).parent / "person_network.onnx"
POSTURES: tuple[Posture, ...] = ("standing", "sitting", "lying")
INPUT_SIZE = (160, 120)
"""Columns and rows that the network is given."""
STRIDE = 2
"""The network answers for every second column and row of its input."""

Floats = NDArray[np.float32]


@dataclass(frozen=True, slots=True)
class Pixels:
    """The pixels of a depth picture that the network is given.

    Attributes:
        depth: Shape (120, 160), metres along the optical axis, NaN where nothing was measured.
        points: Shape (120, 160, 3), metres, in the robot frame; NaN as above.
        along: Shape (3, 120, 160), what each pixel looks along for one metre of depth, robot frame.
        rays: Shape (120, 160, 2), the horizontal direction of each pixel in the robot frame, unit vectors.
        area: Shape (120, 160), what a pixel covers of a surface that faces the camera, square metres.
    """

    depth: Floats
    points: Floats
    along: Floats
    rays: Floats
    area: Floats

    @staticmethod
    def of(picture: DepthImage, optical_in_base: Transform3) -> Pixels:
        """Take every so many pixels of a picture of any size.

        Args:
            picture: The picture.
            optical_in_base: Takes points of the optical frame to the robot frame.
        """
        camera = picture.camera
        rows, columns = _sampled(camera)
        depth = np.asarray(picture.depth, np.float32).take(rows, axis=0).take(columns, axis=1)
        along, rays = _directions(camera, optical_in_base.rotation.tobytes())
        points = depth * along + optical_in_base.translation.astype(np.float32)[:, None, None]
        side = camera.width / (INPUT_SIZE[0] * camera.fx) * camera.height / (INPUT_SIZE[1] * camera.fy)
        return Pixels(depth, np.moveaxis(points, 0, -1), along, rays, depth**2 * np.float32(side))

    def as_input(self) -> Floats:
        """Return the network's input: inverse depth, height above the floor and whether there is a value."""
        seen = np.isfinite(self.depth)
        inverse = np.where(seen, 1.0 / np.where(seen, np.maximum(self.depth, 0.3), 1.0), 0.0)
        height = np.where(seen, np.clip(self.points[..., 2], -0.5, 3.0), 0.0)
        return np.stack([inverse, height, seen.astype(np.float32)])


def _sampled(camera: CameraModel) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the rows and columns of a picture that are given to the network."""
    columns = np.arange(INPUT_SIZE[0]) * camera.width // INPUT_SIZE[0]
    return np.arange(INPUT_SIZE[1]) * camera.height // INPUT_SIZE[1], columns


@lru_cache(maxsize=4)
def _directions(camera: CameraModel, rotation: bytes) -> tuple[Floats, Floats]:
    """Return what each pixel looks along for one metre of depth, and its horizontal direction; robot frame.

    The first has shape (3, 120, 160): products with one plane after the other are several times as fast.

    Args:
        camera: The camera.
        rotation: That of ``optical_in_base``, shape (3, 3), float64; cameras seldom move on their robot.
    """
    rows, columns = _sampled(camera)
    across = ((columns - camera.cx) / camera.fx).astype(np.float32)[None, :]
    down = ((rows - camera.cy) / camera.fy).astype(np.float32)[:, None]
    turn = np.frombuffer(rotation).reshape(3, 3).astype(np.float32)
    along = across[..., None] * turn[:, 0] + down[..., None] * turn[:, 1] + turn[:, 2]
    flat = np.linalg.norm(along[..., :2], axis=-1, keepdims=True)
    rays = along[..., :2] / np.maximum(flat, np.float32(1e-6))  # a camera may look straight down
    along = np.ascontiguousarray(np.moveaxis(along, -1, 0))
    along.setflags(write=False)
    rays.setflags(write=False)
    return along, rays


@dataclass(frozen=True, slots=True)
class NetworkOutput:
    """The output of the network for every second pixel.

    Attributes:
        person: Shape (60, 80), probability that it shows a person.
        middle: Shape (60, 80, 2), metres from the point seen to the middle of the person: along the
            horizontal direction of the pixel, and to the left of it.
        posture: Shape (60, 80, 3), probabilities in the order of ``POSTURES``.
    """

    person: Floats
    middle: Floats
    posture: Floats


@cache
def _network() -> Any:
    import onnxruntime  # here: it is slow to load, and a process may never need the network

    options = onnxruntime.SessionOptions()
    # One thread adds in one order: the same picture gives the same answer, bit for bit. A second one would
    # take a core from the rest of the robot.
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    options.execution_mode = onnxruntime.ExecutionMode.ORT_SEQUENTIAL
    return onnxruntime.InferenceSession(str(FILE), options, providers=["CPUExecutionProvider"])


def infer(pixels: Pixels) -> NetworkOutput:
    """Run the network; takes some milliseconds on one core."""
    network = _network()
    output = network.run(None, {network.get_inputs()[0].name: pixels.as_input()[None]})[0][0]
    odds = np.exp(output[3:] - output[3:].max(axis=0))
    return NetworkOutput(
        person=1.0 / (1.0 + np.exp(-output[0])),
        middle=np.moveaxis(output[1:3], 0, -1),
        posture=np.moveaxis(odds / odds.sum(axis=0), 0, -1),
    )
