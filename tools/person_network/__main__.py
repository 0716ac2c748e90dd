"""Train the network that finds people in depth pictures, on simulated homes.

``python tools/person_network --out florence_bt/skills/people/user_tracker/person_network.onnx``

``--start NETWORK --first 5000`` goes on with a trained network, on other homes.

Needs PyTorch and onnx (``pip install torch onnx``), which Florence itself does not.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from tools.person_network.network import Examples, new_network, read_onnx, train, write_onnx
from tools.person_network.pictures import FIRST_SEED, Picture, example_of, pictures_of_home
from tools.person_network.plain_rooms import plain_pictures
from tools.processes import processes

EPOCHS = (8, 6)
"""Rounds over the pictures: bent homes first, then all kinds."""
RATES = (3e-3, 2e-3)
FURTHER_EPOCHS, FURTHER_RATE = 4, 5e-4
"""As above, for a network that knows something already."""
MORE_OFTEN = (
    "easy",
    "standing",
    "standing",
    "sitting",
    "sitting",
    "sitting",
    "lying",
    "lying",
    "lying",
    "walking",
    "aided",
    "aided",
)
"""Activities of people in the homes that are not bent: more of what is hard to see."""


def saved(file: Path, pictures: Callable[[], Iterable[Picture]]) -> Path:
    """Return the file with the examples of some pictures; made when it is not there yet."""
    if not file.exists():
        examples = [example_of(picture) for picture in pictures()]
        fields = ("given", "person", "middle", "posture")
        np.savez(file, **{name: np.stack([getattr(each, name) for each in examples]) for name in fields})
    return file


def bent_home(seed: int, folder: Path) -> Path:
    """Make a home in which everything is bent a little."""
    return saved(folder / f"bent_{seed}.npz", lambda: pictures_of_home(seed, 64))


def true_home(seed: int, folder: Path) -> Path:
    """Make a home as the trials have them."""
    return saved(
        folder / f"true_{seed}.npz",
        lambda: pictures_of_home(seed, 72, scenes=8, bent=False, situations=MORE_OFTEN),
    )


def plain_room(seed: int, folder: Path) -> Path:
    """Make rooms with other bodies."""
    return saved(folder / f"plain_{seed}.npz", lambda: plain_pictures(seed, 1200))


def read_all(files: Sequence[Path]) -> Examples:
    """Read the examples of all files together."""
    parts = [dict(np.load(file)) for file in files]
    return {name: np.concatenate([part.pop(name) for part in parts]) for name in list(parts[0])}


def main() -> int:
    """Make the pictures, train, write the network."""
    parser = argparse.ArgumentParser(prog="python tools/person_network", description=__doc__)
    parser.add_argument("--homes", type=int, default=200, help="bent homes, and as many true ones")
    parser.add_argument("--first", type=int, default=0, help="number of the first home")
    parser.add_argument("--start", type=Path, help="a network to go on with")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=2, help="homes at a time, each on a core")
    parser.add_argument("--folder", type=Path, default=Path("build/person_network"), help="keeps pictures")
    parser.add_argument("--out", type=Path, required=True, help="the network, an ONNX file")
    given = parser.parse_args()
    given.folder.mkdir(parents=True, exist_ok=True)
    first, some = FIRST_SEED + given.first, 3 * given.homes // 10
    true_homes = range(first + 1000, first + 1000 + given.homes)
    with processes(given.jobs) as pool:
        true = pool.map(partial(true_home, folder=given.folder), true_homes)
        plain = pool.map(partial(plain_room, folder=given.folder), range(first, first + 2))
        count = some if given.start else given.homes
        bent = list(pool.map(partial(bent_home, folder=given.folder), range(first, first + count)))
        mixed = [*true, *plain, *bent[:some]]
    if given.start:
        network = read_onnx(given.start)
        train(network, read_all(mixed), FURTHER_EPOCHS, FURTHER_RATE, given.seed)
    else:
        network = new_network(given.seed)
        for files, epochs, rate in zip((bent, mixed), EPOCHS, RATES, strict=True):
            train(network, read_all(files), epochs, rate, given.seed)
    write_onnx(network, given.out)
    return 0


if __name__ == "__main__":
    sys.exit(main())
