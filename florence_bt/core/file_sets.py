"""Writes files that belong together: all or none, whatever ends the program or fills the disk meanwhile.

What is to be in a folder is written under new names first, beside a list of what it will be called. One
rename says that all of it is there. Only then the files take their names::

    list of each folder -> new files -> .florence-written (all is there) -> names -> lists removed

Who writes into such a folder next, or reads a file in it, finishes what was written to the end, and removes
what was not (:func:`mend`). The folder is locked meanwhile. A list names nothing outside its folder.
"""

from __future__ import annotations

import errno
import fcntl
import json
import os
import re
import secrets
import stat
from collections.abc import Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import asdict, dataclass, field
from pathlib import Path

LIST = ".florence-writing"
"""In a folder that is being written to: what its files will be called."""
WRITTEN = ".florence-written"
"""In the folder of the last file: all files of the set are there, under their new names."""
_NEW = re.compile(r"\.florence-new-[0-9a-f]+-\d+")
_MOST_BYTES = 1_000_000
"""Of a list."""
_FOLDER = os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC
_WAY = os.O_PATH | os.O_DIRECTORY | os.O_CLOEXEC
"""On the way to a folder: one that may be passed through, and perhaps not be read."""
_MAKE = os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW | os.O_CLOEXEC


@dataclass(frozen=True, slots=True)
class _Part:
    """The files of a set in one folder, as its list says.

    Attributes:
        id: Of the set.
        folders: All its folders, relative to this one; that of the last file first.
        moves: Name of now and name to come, in their order; a file may come twice.
        remove: Names of files that go, when all others are there.
    """

    id: str
    folders: tuple[str, ...]
    moves: tuple[tuple[str, str], ...] = ()
    remove: tuple[str, ...] = ()


_UNFINISHED = _Part("", (".",))
"""A list that was not written to its end: none of its files was begun."""


@dataclass(slots=True)
class _Work:
    """The work to be done in one folder."""

    writes: list[tuple[str, bytes]] = field(default_factory=list)
    remove: list[str] = field(default_factory=list)


def replace_files(
    contents: Mapping[Path, bytes] | Iterable[tuple[Path, bytes]],
    *,
    remove: Iterable[Path] = (),
    make_folders: bool = False,
    no_links: Iterable[Path] = (),
) -> None:
    """Write some files whole or none of them; those that are there keep their permissions.

    Args:
        contents: File -> what it is to hold, the one that names the others last. In pairs a file may come
            twice: it holds the first content until those in between have theirs.
        remove: Files that go in the same step; one that is not there is no error.
        make_folders: Whether to make folders that are missing.
        no_links: Folders that are no links, nor is what they hold on the way to a file.

    Raises:
        OSError: One cannot be written, and nothing has changed. Its file name is that of the file.
    """
    work: dict[Path, _Work] = {}
    guarded = tuple(no_links)
    for file, data in contents.items() if isinstance(contents, Mapping) else contents:
        folder = _folder_of(file, guarded)
        work[folder] = work.pop(folder, _Work())  # that of the last file comes last
        work[folder].writes.append((file.name, data))
    for file in remove:
        folder = _folder_of(file, guarded)
        if folder not in work:
            work = {folder: _Work(), **work}
        work[folder].remove.append(file.name)
    folders = list(reversed(work))
    while work:
        with _locked(folders, make=make_folders) as opened:
            left = [folder for folder in folders if _has_list(opened[folder])]
            if not left:
                _write(work, folders, opened)
                return
        for folder in left:
            mend(folder)


def mend(folder: Path) -> None:
    """Finish what another program has written into a folder when it ended, or remove it when it was not all.

    Raises:
        OSError: It cannot be done.
    """
    if not os.path.lexists(folder / LIST):
        _remove_one_without_list(folder)
        return
    folder = _real(folder)
    with _locked([folder]) as opened:
        part = _read_part(opened[folder])
    while part is not None:
        folders = [_real(folder / each) for each in part.folders]
        with _locked([each for each in {folder, *folders} if each.is_dir()]) as opened:
            now = _read_part(opened[folder])
            if now == part:
                _settle(folder, folders, part.id, opened)
                return
            part = now


def _remove_one_without_list(folder: Path) -> None:
    """Remove what is left of a single file, which has no list, when its program was killed."""
    if not folder.is_dir() or not os.access(folder, os.R_OK | os.W_OK):
        return
    if any(map(_NEW.fullmatch, os.listdir(folder))):
        folder = _real(folder)
        with _locked([folder]) as opened:  # who still writes it is waited for
            if not _has_list(opened[folder]):
                _remove_left(opened[folder])


# Under the lock.


def _write(work: Mapping[Path, _Work], folders: list[Path], opened: Mapping[Path, int]) -> None:
    """Write a set into folders, that of the last file first; nobody else writes there."""
    name, parts = secrets.token_hex(4), {}
    for folder, todo in work.items():
        _remove_left(opened[folder])
        for file, _ in todo.writes:
            _refuse_folder(opened[folder], folder / file)
        new = [f".florence-new-{name}-{number}" for number in range(len(todo.writes))]
        moves = tuple((each, file) for each, (file, _) in zip(new, todo.writes, strict=True))
        others = tuple(os.path.relpath(other, folder) for other in folders)
        parts[folder] = _Part(name, others, moves, tuple(todo.remove))
    main = folders[0]
    single = len(folders) == 1 and len(parts[main].moves) == 1 and not parts[main].remove
    try:
        if not single:
            for folder, part in parts.items():
                text = json.dumps(asdict(part)).encode()
                _make(opened[folder], LIST, text, folder / LIST)
        for folder, part in parts.items():
            for (new_name, file), (_, data) in zip(part.moves, work[folder].writes, strict=True):
                _make(opened[folder], new_name, data, folder / file, like=file)
        if not single:
            mark = f".florence-new-{name}-{len(parts[main].moves)}"
            _make(opened[main], mark, name.encode(), main / WRITTEN)
            for folder in folders:
                _sync(opened[folder])
            os.rename(mark, WRITTEN, src_dir_fd=opened[main], dst_dir_fd=opened[main])
            _sync(opened[main])
    except BaseException:
        for folder in folders:
            _take_back(opened[folder])
        raise
    for folder in (*folders[1:], main):
        _finish(opened[folder], parts[folder])


def _settle(folder: Path, folders: list[Path], name: str, opened: Mapping[Path, int]) -> None:
    """Finish a set, or take it back."""
    parts = {each: _read_part(fd) for each, fd in opened.items()}
    mine = {each: part for each, part in parts.items() if part is not None and part.id == name}
    main = folders[0]
    if main in opened and _read(opened[main], WRITTEN) == name.encode() != b"":
        for each in (*folders[1:], main):
            if each in mine:
                _finish(opened[each], mine[each])
        return
    for each in mine:
        _take_back(opened[each])
    assert folder in mine, "its list was read under the lock"


def _finish(fd: int, part: _Part) -> None:
    """Give the new files of a folder their names, and remove its list; whatever of it was done already."""
    for new, name in part.moves:
        with suppress(FileNotFoundError):  # it has its name already
            os.rename(new, name, src_dir_fd=fd, dst_dir_fd=fd)
    for name in part.remove:
        _unlink(fd, name)
    _sync(fd)
    if _read(fd, WRITTEN) == part.id.encode():
        _unlink(fd, WRITTEN)
    _unlink(fd, LIST)


def _take_back(fd: int) -> None:
    """Remove the new files of a folder and its list; first what says that all are there."""
    _unlink(fd, WRITTEN)
    _remove_left(fd)
    _unlink(fd, LIST)


def _remove_left(fd: int) -> None:
    """Remove new files without a name, which nobody writes any more."""
    for name in os.listdir(fd):
        if _NEW.fullmatch(name):
            _unlink(fd, name)


def _make(fd: int, name: str, data: bytes, file: Path, *, like: str | None = None) -> None:
    """Make a new file in a folder, and wait until the disk has it.

    Args:
        fd: The folder.
        name: Its name there.
        data: Its content.
        file: What an error is about.
        like: The file whose permissions it gets, if that is there.
    """
    try:
        with os.fdopen(os.open(name, _MAKE, 0o666, dir_fd=fd), "wb") as out:
            out.write(data)
            out.flush()
            if like is not None and (mode := _mode(fd, like)) is not None and stat.S_ISREG(mode):
                os.fchmod(out.fileno(), stat.S_IMODE(mode))
            os.fsync(out.fileno())
    except OSError as error:
        raise OSError(error.errno, error.strerror, str(file)) from error


def _refuse_folder(fd: int, file: Path) -> None:
    mode = _mode(fd, file.name)
    if mode is not None and stat.S_ISDIR(mode):
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(file))


def _mode(fd: int, name: str) -> int | None:
    with suppress(FileNotFoundError):
        return os.stat(name, dir_fd=fd, follow_symlinks=False).st_mode
    return None


def _unlink(fd: int, name: str) -> None:
    with suppress(FileNotFoundError):
        os.unlink(name, dir_fd=fd)


def _sync(fd: int) -> None:
    """Wait until the disk has the names of a folder."""
    try:
        os.fsync(fd)
    except OSError as error:
        if error.errno != errno.EINVAL:  # a file system of the network that knows no such call for folders
            raise


# Lists.


def _has_list(fd: int) -> bool:
    return _mode(fd, LIST) is not None


def _read(fd: int, name: str) -> bytes | None:
    """Read a small file of a folder; None when there is none."""
    try:
        descriptor = os.open(name, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC, dir_fd=fd)
    except FileNotFoundError:
        return None
    with os.fdopen(descriptor, "rb") as file:
        return file.read(_MOST_BYTES)


def _read_part(fd: int) -> _Part | None:
    """Read the list of a folder; None when there is none."""
    text = _read(fd, LIST)
    if text is None:
        return None
    try:
        found = json.loads(text)
        moves = tuple((str(new), str(name)) for new, name in found["moves"])
        part = _Part(
            str(found["id"]), tuple(map(str, found["folders"])), moves, tuple(map(str, found["remove"]))
        )
    except (ValueError, KeyError, TypeError):
        return _UNFINISHED
    names = (*(name for _, name in moves), *part.remove)
    sound = part.folders and all(_NEW.fullmatch(new) for new, _ in moves) and all(map(_is_name, names))
    return part if sound else _UNFINISHED


def _is_name(name: str) -> bool:
    return os.path.basename(name) == name and name not in ("", ".", "..") and "\0" not in name


# Folders.


def _real(folder: Path) -> Path:
    return Path(os.path.realpath(folder))


def _folder_of(file: Path, no_links: Iterable[Path]) -> Path:
    """Return the folder of a file without links, but for those from one of the others on."""
    folder = Path(os.path.abspath(file.parent))
    for guarded in map(Path, map(os.path.abspath, no_links)):
        if folder.is_relative_to(guarded):
            return _real(guarded.parent) / folder.relative_to(guarded.parent)
    return _real(folder)


@contextmanager
def _locked(folders: Iterable[Path], *, make: bool = False) -> Iterator[dict[Path, int]]:
    """Open folders, and keep others from writing into them; they are locked in the order of their names."""
    with ExitStack() as stack:
        opened = {}
        for folder in sorted(set(folders)):
            opened[folder] = fd = _open_folder(folder, make=make)
            stack.callback(os.close, fd)
            fcntl.flock(fd, fcntl.LOCK_EX)
        yield opened


def _open_folder(folder: Path, *, make: bool) -> int:
    """Open a folder; no link is followed on the way to it."""
    fd, at = os.open("/", _FOLDER if folder == Path("/") else _WAY), Path("/")
    for name in folder.parts[1:]:
        at /= name
        try:
            mode = _mode(fd, name)
            if mode is None and make:
                with suppress(FileExistsError):  # another was faster
                    os.mkdir(name, dir_fd=fd)
            if mode is not None and stat.S_ISLNK(mode):
                raise OSError(errno.ELOOP, "there is a link on the way", str(at))
            kind = _FOLDER if at == folder else _WAY
            inner = os.open(name, kind | os.O_NOFOLLOW, dir_fd=fd)
        except OSError as error:
            raise OSError(error.errno, error.strerror, str(at)) from error
        finally:
            os.close(fd)
        fd = inner
    return fd
