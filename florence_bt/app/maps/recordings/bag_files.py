"""The files of a bag, opened as they are found: whole or cut off, compressed, with or without their metadata.

``rosbag2`` writes ``metadata.yaml`` when it ends, so a recorder that was killed leaves none, and the versions
that compress whole files leave the kind of storage out of it. The files alone say all that is needed.
"""

from __future__ import annotations

import gzip
import re
import shutil
import tempfile
from collections.abc import Sequence
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import Any

from florence_bt.core.errors import ConfigError, FrameError
from florence_bt.core.installation import how_to_get

BAG_SUFFIXES = (".mcap", ".db3", ".bag")
"""Files of ROS 2 (MCAP, SQLite) and of ROS 1."""
COMPRESSED = (".zst", ".zstd", ".gz")
"""Behind the suffix of a file that is compressed whole."""
METADATA = "metadata.yaml"
_PART = re.compile(r"_\d+$")
"""The difference between the names of the files of one rosbag2."""
_NAMED = re.compile(r"^\s*-\s*['\"]?([^\s'\"]+\.(?:mcap|db3)(?:\.zstd?)?)['\"]?\s*$", re.MULTILINE)
"""A file in the metadata."""
_EACH_MESSAGE = re.compile(r"^\s*compression_mode:\s*['\"]?message", re.IGNORECASE | re.MULTILINE)


def is_bag(path: Path) -> bool:
    """Tell whether a file is called as a bag is."""
    return _kind(path) in BAG_SUFFIXES


def open_bag(path: Path, stack: ExitStack) -> list[Any]:
    """Open a bag.

    Args:
        path: The file, or the folder of a rosbag2.
        stack: Closes what is opened.

    Returns:
        Readers of rosbags for its parts, in the order of recording.

    Raises:
        ConfigError: There is no bag, or more than one.
        Exception: Whatever the first wrong byte of a damaged file leads rosbags to.
    """
    if path.is_file():
        return [_open_file(path, stack)]
    files = sorted(each for each in path.iterdir() if each.is_file() and is_bag(each))
    metadata = path / METADATA
    text = metadata.read_text(encoding="utf-8", errors="replace") if metadata.is_file() else ""
    # Only the metadata says that each message is compressed by itself.
    if _EACH_MESSAGE.search(text) or (_counts(text, files) and all(_is_whole(each) for each in files)):
        return [_opened(path, stack)]
    if not files:
        raise ConfigError(
            "there is no bag in this folder", file=path, valid=["a folder with .mcap or .db3 files"]
        )
    if len({_PART.sub("", _stem(each)) for each in files}) > 1:
        problem = "there is more than one bag in this folder, and no metadata.yaml that says what is one"
        raise ConfigError(problem, file=path, valid=[str(each) for each in files])
    readers = [_open_file(each, stack) for each in files]
    return sorted((each for each in readers if each.message_count), key=lambda each: int(each.start_time))


def _counts(metadata: str, files: Sequence[Path]) -> bool:
    """Tell whether the metadata is to be read: it says how the files are stored, and names them.

    Files that were renamed or packed since say all themselves; that some are missing it alone tells.
    """
    stored = re.search(r"^\s*storage_identifier:[ '\"]*\w", metadata, re.MULTILINE) is not None
    named = set(_NAMED.findall(metadata))
    return stored and (named <= {each.name for each in files} or len(files) < len(named))


def _open_file(path: Path, stack: ExitStack) -> Any:
    """Open a file, or a copy of it that is made whole first."""
    here = path
    if path.suffix in COMPRESSED:
        here = _unpacked(path, _folder(stack))
    if _kind(path) == ".mcap" and not _is_whole(here):
        if here is path:
            here = Path(shutil.copy(path, _folder(stack)))
        here.chmod(0o600)
        try:
            _mending().mend(here)
        except FrameError as error:
            raise ConfigError(f"this is no MCAP file: {error}", file=path, valid=["another file"]) from error
    return _opened(here, stack)


def _opened(path: Path, stack: ExitStack) -> Any:
    from rosbags.rosbag1 import Reader as Reader1
    from rosbags.rosbag2 import Reader as Reader2

    reader = (Reader1 if path.suffix == ".bag" else Reader2)(path)
    reader.open()
    stack.callback(reader.close)
    return reader


def _is_whole(file: Path) -> bool:
    """Tell whether an MCAP file has its end; other files have nothing that tells."""
    return file.suffix != ".mcap" or bool(_mending().is_whole(file))


def _mending() -> Any:
    try:
        from florence_bt.app.recording import mending
    except ModuleNotFoundError as error:
        if (error.name or "").startswith("florence_bt"):
            raise
        problem = f"a recording that was cut off is mended with {error.name}, which is not installed"
        raise ConfigError(problem, valid=[how_to_get("mcap")]) from error
    return mending


def _unpacked(path: Path, folder: Path) -> Path:
    """Unpack a file, as far as it is there."""
    from rosbags.rosbag2.reader import zstd

    unpacked = folder / path.stem
    opened = gzip.open if path.suffix == ".gz" else zstd.open
    with opened(path, "rb") as packed, unpacked.open("wb") as file, suppress(EOFError):  # it was cut off
        shutil.copyfileobj(packed, file)
    return unpacked


def _folder(stack: ExitStack) -> Path:
    return Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="florence_recording_")))


def _kind(path: Path) -> str:
    return Path(path.stem).suffix if path.suffix in COMPRESSED else path.suffix


def _stem(path: Path) -> str:
    return Path(path.stem).stem if path.suffix in COMPRESSED else path.stem


def bags_in(folder: Path) -> Sequence[str]:
    """Return the bags in a folder: files, and folders of rosbag2."""
    return [str(each) for each in sorted(folder.iterdir()) if is_bag(each) or (each / METADATA).is_file()]
