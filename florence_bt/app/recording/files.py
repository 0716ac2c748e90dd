"""The files of a recording: MCAP, one after the other, bounded by size and age."""

from __future__ import annotations

import fcntl
import os
import shutil
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

import foxglove
from foxglove.mcap import MCAPWriteOptions, MCAPWriter

from florence_bt.app.recording.mending import is_whole, mend
from florence_bt.core.errors import ConfigError, FrameError
from florence_bt.core.limits import CheckedParameters, Positive

PATTERN = "recording_*.mcap"
"""The names of the files that count towards the bounds, and are removed for them."""
FREE_MB = 300.0
"""Chosen: a recording ends when less than this is free on its disk, before anything else fails there."""
FLUSH_S = 2.0
"""Time between two writes to the disk: a power cut may cost so much."""
_MB = 1e6
DAY_S = 86_400.0
"""Seconds of a day."""
CLOCK_WAS_SET_S = 1_577_836_800.0
"""2020-01-01: a file of before then has no known age. The clock of its robot had not been set."""


@dataclass(frozen=True, slots=True)
class RecordingLimits(CheckedParameters):
    """The limits of what recordings may take.

    Attributes:
        file_size: Megabytes of one file; then the next one begins.
        total_size: Megabytes of all recordings in the folder; the oldest are removed.
        max_age: Days after which a recording in the folder is removed.
    """

    file_size: Positive = 256.0
    total_size: Positive = 4096.0
    max_age: Positive = 30.0

    def _check(self) -> None:
        if self.file_size > self.total_size:
            raise ConfigError(
                f"file_size is {self.file_size:g} MB, more than all files may have",
                valid=[f"at most {self.total_size:g} MB, or a larger total_size"],
            )


class RecordingFiles:
    """Writes what is logged in a context of the SDK into files of a folder.

    Files there that were cut off, as their recorder was killed or the power went, are mended first.

    Attributes:
        written: The files of this recording.
        mended: What was done about files that were cut off, a sentence each.

    Args:
        folder: Is made when needed.
        limits: How much it may take.
        context: Where the messages are logged.
        is_wanted: Tells from a topic and its type whether it belongs into the files; everything does without.
        now: Seconds since 1970.
        steady: Steady seconds.
        free_mb: The megabytes that are free on the disk of a folder.

    Raises:
        ConfigError: The folder cannot be written to, or its disk is nearly full.
    """

    def __init__(
        self,
        folder: Path,
        limits: RecordingLimits,
        context: foxglove.Context,
        is_wanted: Callable[[str, str], bool] = lambda topic, type_name: True,
        now: Callable[[], float] = time.time,
        steady: Callable[[], float] = time.monotonic,
        free_mb: Callable[[Path], float] = lambda folder: shutil.disk_usage(folder).free / _MB,
    ) -> None:
        self._folder = folder
        self._limits = limits
        self._context = context
        self._is_wanted = is_wanted
        self._now = now
        self._steady = steady
        self._begun: list[float] = []
        self._free_mb = free_mb
        self._flushed = steady()
        self._writer: MCAPWriter | None = None
        self._lock = -1
        self.written: list[Path] = []
        make_folder(folder)
        self._keep_free()
        self.mended = mend_left(folder)
        self._writer = self._open()

    @property
    def size_mb(self) -> float:
        """Megabytes in the files of this recording that are still there."""
        return _size_mb(self.written)

    def look(self) -> bool:
        """Keep the bounds; call it about every second.

        Returns:
            Whether a new file was begun.

        Raises:
            ConfigError: The disk is nearly full. The recording is closed, and what it has is whole.
        """
        if self._writer is None:
            return False
        if self._steady() - self._flushed >= FLUSH_S:
            self._writer.flush()
            self._flushed = self._steady()
        self._keep_free()
        full = _size_mb(self.written[-1:]) >= self._limits.file_size
        if full:
            self.close()
            self._writer = self._open()
        self._remove_old()
        return full

    def close(self) -> None:
        """End the file; harmless when that was done already."""
        if self._writer is not None:
            self._writer.close()
            self._writer = None
            os.close(self._lock)

    def _keep_free(self) -> None:
        free = self._free_mb(self._folder)
        if free < FREE_MB:
            self.close()
            raise ConfigError(
                f"nothing is recorded: {free:.0f} MB are free on the disk of {str(self._folder)!r}",
                valid=[f"{FREE_MB:g} MB free", "another folder"],
            )

    def _open(self) -> MCAPWriter:
        begun = time.strftime("%Y-%m-%d_%H-%M-%S", time.localtime(self._now()))
        names = (f"recording_{begun}{suffix}.mcap" for suffix in ("", *(f"_{i}" for i in range(2, 1000))))
        # The fastest level: a third of the work of the default one, for a tenth more bytes.
        options = MCAPWriteOptions(profile="ros2", compression_level=1, compression_threads=0)
        for file in map(self._folder.joinpath, names):
            with suppress(FileExistsError):
                writer = foxglove.open_mcap(
                    file,
                    context=self._context,
                    channel_filter=self._takes,
                    writer_options=options,
                )
                break
        else:
            raise ConfigError(f"{str(self._folder)!r} has too many recordings", valid=["another folder"])
        # Tells those who record into the same folder that this one is being written.
        self._lock = os.open(file, os.O_RDWR | os.O_CLOEXEC)
        fcntl.flock(self._lock, fcntl.LOCK_EX)
        self.written.append(file)
        self._begun.append(self._steady())
        return writer

    def _takes(self, channel: foxglove.ChannelDescriptor) -> bool:
        return self._is_wanted(channel.topic, channel.schema.name if channel.schema else "")

    def _remove_old(self) -> None:
        """Remove the oldest files beyond the bounds; never one that is being written, here or elsewhere.

        The clock of a robot without a battery for it leaps by years when it finds a network. So the files of
        this recording are as old as the steady clock says, and newer than all others.
        """
        others = {file: _stat(file) for file in set(self._folder.glob(PATTERN)).difference(self.written)}
        before = sorted((known.st_mtime, file) for file, known in others.items() if known)
        ages = {file: self._now() - made if made > CLOCK_WAS_SET_S else 0.0 for made, file in before}
        ages |= {file: self._steady() - begun for file, begun in zip(self.written, self._begun, strict=True)}
        too_much = _size_mb(ages) - self._limits.total_size
        for file in list(ages)[:-1]:
            if too_much > 0.0 or ages[file] > self._limits.max_age * DAY_S:
                size = _size_mb([file])
                too_much -= size if _remove(file) else 0.0


def make_folder(folder: Path) -> None:
    """Make a folder for recordings, unless it is there.

    Raises:
        ConfigError: It cannot be written to.
    """
    problem = ""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        problem = error.strerror or str(error)
    if problem or not os.access(folder, os.W_OK | os.X_OK):
        raise ConfigError(
            f"the folder {str(folder)!r} cannot be written to{problem and f': {problem}'}",
            valid=["another folder"],
        )


def mend_left(folder: Path) -> list[str]:
    """Mend the recordings of a folder that were cut off; none that is being written.

    Returns:
        What was done about each of them, for people.
    """
    told = []
    for file in sorted(folder.glob(PATTERN)):
        with suppress(FileNotFoundError), _unused(file) as ours:
            if not ours:
                continue
            try:
                if is_whole(file):
                    continue
                before = file.stat()
                messages = mend(file)
                os.utime(file, ns=(before.st_atime_ns, before.st_mtime_ns))  # it is as old as before
            except (FrameError, OSError) as error:
                told.append(f"{file} was cut off and cannot be mended: {error}")
            else:
                told.append(f"{file} was cut off and is mended: it holds {messages} messages")
    return told


@contextmanager
def _unused(file: Path) -> Iterator[bool]:
    """Keep others from writing a file meanwhile; gives whether it is ours to change.

    Raises:
        FileNotFoundError: It is gone.
    """
    try:
        descriptor = os.open(file, os.O_RDWR | os.O_CLOEXEC | os.O_NOFOLLOW)
    except FileNotFoundError:
        raise
    except OSError:
        yield False  # it is somebody else's
        return
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        yield True
    except BlockingIOError:
        yield False
    finally:
        os.close(descriptor)


def _remove(file: Path) -> bool:
    """Remove a file unless it is being written; whether it is gone."""
    try:
        with _unused(file) as ours:
            if ours:
                file.unlink(missing_ok=True)
            return ours
    except FileNotFoundError:
        return True


def _stat(file: Path) -> os.stat_result | None:
    """Return what is known of a file; None when it is gone."""
    with suppress(FileNotFoundError):
        return file.stat()
    return None


def _size_mb(files: Iterable[Path]) -> float:
    return sum(known.st_size for file in files if (known := _stat(file))) / _MB
