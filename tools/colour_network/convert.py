"""Turns a network of TensorFlow.js (a graph model: JSON and one file of weights) into an ONNX file.

Only what CenterNet with a MobileNet needs: convolutions, sums, products, and enlarging. TensorFlow keeps
pictures as rows, columns, channels; ONNX puts the channels first.

Source:
    TensorFlow.js, graph model format (weights manifest, quantization as float16); TensorFlow's definitions of
    the operations; ONNX operators, opset 11.
"""

from __future__ import annotations

import base64
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import onnx_file

Array = NDArray[Any]

_SAME_NAME = {"Relu": "Relu", "Sigmoid": "Sigmoid", "Identity": "Identity", "Add": "Add", "Mul": "Mul"}
_DTYPES = {"float16": "<f2", "float32": "<f4", "int32": "<i4"}


class CannotConvert(ValueError):
    """The network has something in it that is not known here."""


def convert(topology: str | bytes, weights: bytes, outputs: Sequence[str], size: tuple[int, int]) -> bytes:
    """Convert a graph model.

    Args:
        topology: The JSON file.
        weights: The file of weights.
        outputs: Names of the nodes that are wanted; what only others need is left out.
        size: Rows and columns of the pictures that the network will be given.

    Returns:
        An ONNX file with an input of shape (1, 3, rows, columns), and outputs with the channels first.

    Raises:
        CannotConvert: With what is not known, or is missing.
    """
    try:
        described = json.loads(topology)
        nodes = {node["name"]: node for node in described["modelTopology"]["node"]}
        manifest = [each for group in described["weightsManifest"] for each in group["weights"]]
    except (ValueError, KeyError, TypeError) as error:
        raise CannotConvert(f"this is not the JSON file of a graph model: {error!r}") from error
    graph = _Graph(_constants(manifest, weights), size)
    for name in _needed(nodes, outputs):
        graph.add(nodes[name])
    return onnx_file.model(graph.nodes, graph.initializers.values(), graph.input, outputs)


def _constants(manifest: Sequence[Mapping[str, Any]], weights: bytes) -> dict[str, Array]:
    """Read the weights by name; those that are kept as float16 become float32."""
    constants, start = {}, 0
    for each in manifest:
        dtype = np.dtype(_DTYPES[each.get("quantization", each)["dtype"]])
        count = int(np.prod(each["shape"], dtype=np.int64))
        end = start + count * dtype.itemsize
        if end > len(weights):
            break
        values = np.frombuffer(weights, dtype, count, start).reshape(each["shape"])
        constants[each["name"]] = values.astype(np.float32) if dtype.kind == "f" else values
        start = end
    if len(constants) != len(manifest) or start != len(weights):
        raise CannotConvert(
            f"the file of weights has {len(weights)} bytes, which are not those of the JSON file"
        )
    return constants


def _needed(nodes: Mapping[str, Mapping[str, Any]], outputs: Sequence[str]) -> list[str]:
    """Return the names of the nodes that the outputs depend on, each after what it takes."""
    order: dict[str, None] = {}
    ahead = [(name, False) for name in reversed(outputs)]
    while ahead:
        name, inputs_are_there = ahead.pop()
        if name not in nodes:
            raise CannotConvert(f"the network has no node {name}")
        if inputs_are_there:
            order[name] = None
        elif name not in order:
            ahead += [(name, True), *((each, False) for each in nodes[name].get("input", ()))]
    return list(order)


@dataclass
class _Graph:
    """The part of a network that was converted so far."""

    constants: Mapping[str, Array]
    size: tuple[int, int]
    nodes: list[bytes] = field(default_factory=list)
    initializers: dict[str, bytes] = field(default_factory=dict)
    input: bytes = b""

    def add(self, node: Mapping[str, Any]) -> None:
        """Convert a node; what it takes was added before."""
        kind, name, inputs = node["op"], node["name"], node.get("input", [])
        if kind in _SAME_NAME:
            self._put(_SAME_NAME[kind], [self._operand(each) for each in inputs], name)
        elif kind in _CONVERSIONS:
            _CONVERSIONS[kind](self, name, inputs, node.get("attr", {}))
        else:
            raise CannotConvert(f"{name}: the operation {kind} is not known")

    def placeholder(self, name: str, inputs: Sequence[str], attributes: Mapping[str, Any]) -> None:
        self.input = onnx_file.value(name, (1, 3, *self.size))

    def constant(self, name: str, inputs: Sequence[str], attributes: Mapping[str, Any]) -> None:
        """Do nothing: constants are written where they are used, in the form that is wanted there."""

    def relu6(self, name: str, inputs: Sequence[str], attributes: Mapping[str, Any]) -> None:
        limits = [self._tensor(f"{name}/{limit:g}", np.float32(limit)) for limit in (0.0, 6.0)]
        self._put("Clip", [*inputs, *limits], name)

    def mean(self, name: str, inputs: Sequence[str], attributes: Mapping[str, Any]) -> None:
        if self.constants[inputs[1]].tolist() != [1, 2] or not attributes["keep_dims"]["b"]:
            raise CannotConvert(f"{name}: only the mean of a whole picture is known")
        self._put("GlobalAveragePool", inputs[:1], name)

    def concatenate(self, name: str, inputs: Sequence[str], attributes: Mapping[str, Any]) -> None:
        if int(self.constants[inputs[-1]]) not in (3, -1):
            raise CannotConvert(f"{name}: only channels can be put together")
        self._put("Concat", inputs[:-1], name, {"axis": 1})

    def resize(self, name: str, inputs: Sequence[str], attributes: Mapping[str, Any]) -> None:
        if attributes["align_corners"]["b"] or attributes["half_pixel_centers"]["b"]:
            raise CannotConvert(f"{name}: only pixels that begin where they did can be enlarged")
        # The size is that of the network as it came; it was always twice as large as before.
        scales = self._tensor(f"{name}/scales", np.array([1, 1, 2, 2], np.float32))
        how = {"mode": "linear", "coordinate_transformation_mode": "asymmetric"}
        self._put("Resize", [inputs[0], "", scales], name, how)

    def convolution(self, name: str, inputs: Sequence[str], attributes: Mapping[str, Any]) -> None:
        self._convolve(name, inputs, attributes, self.constants[inputs[1]].transpose(3, 2, 0, 1), 1)

    def depthwise(self, name: str, inputs: Sequence[str], attributes: Mapping[str, Any]) -> None:
        kernel = self.constants[inputs[1]]
        rows, columns, channels, times = kernel.shape
        apart = kernel.reshape(rows, columns, 1, channels * times).transpose(3, 2, 0, 1)
        self._convolve(name, inputs, attributes, apart, channels)

    def _convolve(
        self, name: str, inputs: Sequence[str], attributes: Mapping[str, Any], kernel: Array, groups: int
    ) -> None:
        fused = list(_words(attributes.get("fused_ops", {}).get("list", {}).get("s", [])))
        if fused not in ([], ["BiasAdd"], ["BiasAdd", "Relu"]):
            raise CannotConvert(f"{name}: a convolution with {', '.join(fused)} is not known")
        (padding,) = _words([attributes["padding"]["s"]])
        bias = [self._tensor(f"{name}/bias", self.constants[each]) for each in inputs[2:]]
        how: dict[str, onnx_file.Attribute] = {
            "auto_pad": {"SAME": "SAME_UPPER", "VALID": "VALID"}[padding],
            "group": groups,
            "kernel_shape": kernel.shape[2:],
            "strides": [int(each) for each in attributes["strides"]["list"]["i"][1:3]],
        }
        output = f"{name}/sum" if "Relu" in fused else name
        self._put("Conv", [inputs[0], self._tensor(f"{name}/kernel", kernel), *bias], output, how)
        if "Relu" in fused:
            self._put("Relu", [output], name)

    def _operand(self, name: str) -> str:
        """Return the name of what an element-wise operation takes, written first when it is a constant."""
        if name not in self.constants:
            return name
        if self.constants[name].size != 1:
            raise CannotConvert(f"{name}: only single numbers can be added and multiplied")
        return self._tensor(name, self.constants[name].reshape(1))

    def _tensor(self, name: str, values: Array) -> str:
        self.initializers[name] = onnx_file.tensor(name, values)
        return name

    def _put(
        self,
        kind: str,
        inputs: Sequence[str],
        output: str,
        attributes: Mapping[str, onnx_file.Attribute] | None = None,
    ) -> None:
        self.nodes.append(onnx_file.node(kind, inputs, output, attributes))


_CONVERSIONS: dict[str, Callable[[_Graph, str, Sequence[str], Mapping[str, Any]], None]] = {
    "Placeholder": _Graph.placeholder,
    "Const": _Graph.constant,
    "Relu6": _Graph.relu6,
    "Mean": _Graph.mean,
    "ConcatV2": _Graph.concatenate,
    "ResizeBilinear": _Graph.resize,
    "Conv2D": _Graph.convolution,
    "_FusedConv2D": _Graph.convolution,
    "DepthwiseConv2dNative": _Graph.depthwise,
    "FusedDepthwiseConv2dNative": _Graph.depthwise,
}


def _words(encoded: Sequence[str]) -> Iterator[str]:
    """Decode strings of TensorFlow, which JSON has as base64."""
    return (base64.b64decode(each).decode() for each in encoded)
