"""Train the network that finds people in depth pictures, on simulated homes.

``python tools/person_network --out florence_bt/skills/people/user_tracker/person_network.onnx``

Needs PyTorch and onnx (``pip install torch onnx``), which Florence itself does not.
"""

from __future__ import annotations

import argparse
import sys
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from tools.person_network.network import Examples, train, write_onnx
from tools.person_network.pictures import FIRST_SEED, example_of, pictures_of_home


def pictures_of(seed: int, count: int, folder: Path) -> Path:
    """The file with the examples of a home; made when it is not there yet."""
    file = folder / f"{seed}.npz"
    if not file.exists():
        examples = [example_of(picture) for picture in pictures_of_home(seed, count)]
        fields = ("given", "person", "middle", "posture")
        np.savez(file, **{name: np.stack([getattr(each, name) for each in examples]) for name in fields})
    return file


def read_all(files: list[Path]) -> Examples:
    """The examples of all files together."""
    parts = [dict(np.load(file)) for file in files]
    return {name: np.concatenate([part.pop(name) for part in parts]) for name in list(parts[0])}


def main() -> int:
    """Make the pictures, train, write the network."""
    parser = argparse.ArgumentParser(prog="python tools/person_network", description=__doc__)
    parser.add_argument("--homes", type=int, default=200, help="how many homes")
    parser.add_argument("--pictures", type=int, default=64, help="pictures of each home")
    parser.add_argument("--epochs", type=int, default=12, help="how often each picture is shown")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=2, help="homes at a time, each on a core")
    parser.add_argument("--folder", type=Path, default=Path("build/person_network"), help="keeps pictures")
    parser.add_argument("--out", type=Path, required=True, help="the network, an ONNX file")
    given = parser.parse_args()
    given.folder.mkdir(parents=True, exist_ok=True)
    make = partial(pictures_of, count=given.pictures, folder=given.folder)
    with ProcessPoolExecutor(given.jobs) as pool:
        files = list(pool.map(make, range(FIRST_SEED, FIRST_SEED + given.homes)))
    write_onnx(train(read_all(files), given.epochs, given.seed), given.out)
    return 0


if __name__ == "__main__":
    sys.exit(main())
