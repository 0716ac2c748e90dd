"""The network and its training, with PyTorch."""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import onnx
import torch
from numpy.typing import NDArray
from torch import Tensor, nn
from torch.nn import functional

from florence_bt.skills.people.user_tracker.person_network import INPUT_SIZE, POSTURES

_BATCH = 32
_MIDDLE_WEIGHT, _POSTURE_WEIGHT = 2.0, 0.3
_EDGE_SHARE = 0.15
"""Most pixels of a picture are easy: the loss of the hardest ones alone counts as much as that of all."""


def _block(inputs: int, outputs: int, stride: int = 1) -> nn.Sequential:
    return nn.Sequential(
        nn.Conv2d(inputs, outputs, 3, stride, 1, bias=False), nn.BatchNorm2d(outputs), nn.ReLU(inplace=True)
    )


class PersonNet(nn.Module):
    """A small U-Net that answers for every second pixel: person, the way to their middle, posture."""

    def __init__(self) -> None:
        super().__init__()
        self.down_2 = nn.Sequential(_block(3, 16, 2), _block(16, 16))
        self.down_4 = nn.Sequential(_block(16, 32, 2), _block(32, 32))
        self.down_8 = nn.Sequential(_block(32, 64, 2), _block(64, 64))
        self.down_16 = nn.Sequential(_block(64, 96, 2), _block(96, 96), _block(96, 96))
        self.up_8 = _block(96 + 64, 64)
        self.up_4 = _block(64 + 32, 32)
        self.up_2 = _block(32 + 16, 24)
        self.answer = nn.Conv2d(24, 3 + len(POSTURES), 1)

    def forward(self, picture: Tensor) -> Tensor:
        """Compute from (n, 3, 120, 160) to (n, 6, 60, 80): log odds of a person, the way, posture scores."""
        half = self.down_2(picture)
        quarter = self.down_4(half)
        eighth = self.down_8(quarter)
        sixteenth = self.down_16(eighth)
        up = self.up_8(torch.cat([_grow(sixteenth, (15, 20)), eighth], 1))
        up = self.up_4(torch.cat([_grow(up, (30, 40)), quarter], 1))
        up = self.up_2(torch.cat([_grow(up, (60, 80)), half], 1))
        return self.answer(up)


def _grow(picture: Tensor, size: tuple[int, int]) -> Tensor:
    return functional.interpolate(picture, size=size, mode="nearest")


Examples = dict[str, NDArray[np.generic]]
"""``given``, ``person``, ``middle`` and ``posture`` of many examples, one after the other."""


def new_network(seed: int) -> PersonNet:
    """Make a network that knows nothing."""
    torch.manual_seed(seed)
    return PersonNet()


def read_onnx(file: Path) -> PersonNet:
    """Read a file of :func:`write_onnx`; its normalisation is in its weights, and stays 1."""
    model = onnx.load(file).graph
    arrays = {each.name: onnx.numpy_helper.to_array(each) for each in model.initializer}
    weights = {name: torch.from_numpy(array.copy()) for name, array in arrays.items()}
    given = iter([node.input[1:] for node in model.node if node.op_type == "Conv"])
    network = PersonNet()
    with torch.no_grad():
        for module in network.modules():
            if isinstance(module, nn.Conv2d):
                weight, bias = next(given)
                module.weight.copy_(weights[weight])
                if module.bias is not None:
                    module.bias.copy_(weights[bias])
            elif isinstance(module, nn.BatchNorm2d):
                module.bias.copy_(weights[bias])
    return network.eval()


def train(network: PersonNet, examples: Examples, epochs: int, rate: float, seed: int) -> None:
    """Train a network; one in evaluation mode keeps the statistics of its normalisation.

    Args:
        network: Its weights are changed.
        examples: What to learn from.
        epochs: How many times each example is shown; about every second time mirrored.
        rate: Highest learning rate.
        seed: Chooses the order.
    """
    rng = np.random.default_rng(seed)
    count = len(examples["given"])
    optimizer = torch.optim.AdamW(network.parameters(), rate, weight_decay=1e-3)
    steps = epochs * (count // _BATCH)
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimizer, rate, total_steps=steps, pct_start=0.1)
    began = time.monotonic()
    for epoch in range(epochs):
        order, total = rng.permutation(count), 0.0
        for first in range(0, count - _BATCH + 1, _BATCH):
            chosen = np.sort(order[first : first + _BATCH])
            loss = _loss(network, _batch(examples, chosen, mirrored=bool(rng.random() < 0.5)))
            optimizer.zero_grad()
            loss.backward()
            optimizer.step()
            schedule.step()
            total += loss.item()
        mean = total / (count // _BATCH)
        print(f"epoch {epoch + 1}: loss {mean:.4f}, {time.monotonic() - began:.0f} s", flush=True)
    network.eval()


def _batch(examples: Examples, chosen: NDArray[np.int64], *, mirrored: bool) -> Sequence[Tensor]:
    given = torch.from_numpy(examples["given"][chosen].astype(np.float32))
    person = torch.from_numpy(examples["person"][chosen].astype(np.int64))
    middle = torch.from_numpy(np.moveaxis(examples["middle"][chosen].astype(np.float32), -1, 1).copy())
    posture = torch.from_numpy(examples["posture"][chosen].astype(np.int64))
    if mirrored:
        given, person, posture = given.flip(-1), person.flip(-1), posture.flip(-1)
        middle = middle.flip(-1) * torch.tensor([1.0, -1.0])[None, :, None, None]
    return given, person, middle, posture


def _loss(network: PersonNet, batch: Sequence[Tensor]) -> Tensor:
    given, person, middle, posture = batch
    answer = network(given)
    measured = person >= 0
    each = functional.binary_cross_entropy_with_logits(
        answer[:, 0], person.clamp(min=0).float(), reduction="none"
    )
    each = each[measured]
    hardest = each.topk(int(_EDGE_SHARE * len(each))).values
    loss = each.mean() + hardest.mean()
    mine = person == 1
    if mine.any():
        ways = answer[:, 1:3].permute(0, 2, 3, 1)[mine] - middle.permute(0, 2, 3, 1)[mine]
        loss = loss + _MIDDLE_WEIGHT * functional.smooth_l1_loss(ways, torch.zeros_like(ways), beta=0.05)
        scores = answer[:, 3:].permute(0, 2, 3, 1)[mine]
        loss = loss + _POSTURE_WEIGHT * functional.cross_entropy(scores, posture[mine])
    return loss


def write_onnx(network: PersonNet, file: Path) -> None:
    """Write the network as it is loaded by OpenCV."""
    given = torch.zeros(1, 3, INPUT_SIZE[1], INPUT_SIZE[0])
    torch.onnx.export(network, (given,), str(file), opset_version=13, dynamo=False)
