"""Writes ONNX files: the few messages of its protobuf schema that a plain network needs.

Source:
    ONNX, onnx.proto3 (field numbers); Protocol Buffers, Encoding.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

IR_VERSION, OPSET = 6, 11
FLOAT, INT, STRING, INTS = 1, 2, 3, 7
"""Types of attributes; FLOAT is the type of an element of a tensor as well."""

Attribute = float | int | str | Sequence[int]


def model(
    nodes: Iterable[bytes], initializers: Iterable[bytes], inputs: bytes, outputs: Sequence[str]
) -> bytes:
    """Write a whole file.

    Args:
        nodes: Made by :func:`node`, each after those that it takes from.
        initializers: Made by :func:`tensor`.
        inputs: Made by :func:`value`.
        outputs: Names.
    """
    graph = b"".join(
        (
            *(_field(1, each) for each in nodes),
            _field(2, "graph"),
            *(_field(5, each) for each in initializers),
            _field(11, inputs),
            *(_field(12, value(name)) for name in outputs),
        )
    )
    return _field(1, IR_VERSION) + _field(7, graph) + _field(8, _field(2, OPSET))


def node(
    kind: str, inputs: Iterable[str], output: str, attributes: Mapping[str, Attribute] | None = None
) -> bytes:
    """Write one operation; it has the name of its output."""
    return b"".join(
        (
            *(_field(1, name) for name in inputs),
            _field(2, output) + _field(3, output) + _field(4, kind),
            *(_field(5, _attribute(*each)) for each in (attributes or {}).items()),
        )
    )


def tensor(name: str, values: NDArray[np.float32]) -> bytes:
    """Write a constant."""
    dimensions = b"".join(_field(1, size) for size in values.shape)
    raw = np.ascontiguousarray(values, "<f4").tobytes()
    return dimensions + _field(2, FLOAT) + _field(8, name) + _field(9, raw)


def value(name: str, shape: Sequence[int] = ()) -> bytes:
    """Describe what the network is given, or gives; its shape may be left out."""
    dimensions = b"".join(_field(1, _field(1, size)) for size in shape)
    return _field(1, name) + _field(2, _field(1, _field(1, FLOAT) + _field(2, dimensions)))


def _attribute(name: str, given: Attribute) -> bytes:
    if isinstance(given, str):
        number, kind, values = 4, STRING, [given]
    elif isinstance(given, int):
        number, kind, values = 3, INT, [given]
    elif isinstance(given, float):
        number, kind, values = 2, FLOAT, [given]
    else:
        number, kind, values = 8, INTS, list(given)
    return _field(1, name) + b"".join(_field(number, each) for each in values) + _field(20, kind)


def _field(number: int, given: int | float | str | bytes) -> bytes:
    """Write a field: its number with its wire type, and its value."""
    if isinstance(given, int):
        return _varint(number << 3) + _varint(given)
    if isinstance(given, float):
        return _varint(number << 3 | 5) + struct.pack("<f", given)
    data = given.encode() if isinstance(given, str) else given
    return _varint(number << 3 | 2) + _varint(len(data)) + data


def _varint(number: int) -> bytes:
    parts = bytearray()
    while number > 0x7F:
        parts.append(number & 0x7F | 0x80)
        number >>= 7
    return bytes([*parts, number])
