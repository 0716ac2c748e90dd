"""Where missions are read from and kept: the robot's own folder, with old versions and drafts beside them.

Names come from a browser: only names of missions are taken, never a path.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

from florence_bt.app.mission_files.output import write_outputs
from florence_bt.core.errors import ConfigError, FlorenceError
from florence_bt.core.text_files import MAX_MISSION_BYTES, decode, read_bytes
from florence_bt.trees.language.loader import BUILT_IN
from florence_bt.trees.language.third_party import ThirdParty
from florence_bt.trees.language.vocabulary import IDENTIFIER

DRAFTS, VERSIONS = ".drafts", ".versions"
"""Folders in the own folder; no robot reads missions there."""
MOST_MISSION_VERSIONS = 50
"""How many old versions of a mission are kept."""
LONGEST_NAME = 60
_DATE = "%Y%m%d-%H%M%S-%f"
_DATED = re.compile(r"\d{8}-\d{6}-\d{6}")


class ChangedMeanwhile(FlorenceError):
    """The file has another text than the writer knows: somebody else has written it."""


@dataclass(frozen=True, slots=True)
class Opened:
    """A mission as it was opened.

    Attributes:
        text: Its text.
        file: Where it stands.
        own: Whether that is the own folder.
        print: Stands for the text: equal prints are equal texts.
        draft: The text of a draft that was not taken over yet; None without one.
    """

    text: str
    file: Path
    own: bool
    print: str
    draft: str | None = None


@dataclass(frozen=True, slots=True)
class Saved:
    """A mission that was saved.

    Attributes:
        file: Where.
        before: Where the text is that stood there before; None when there was none, or the same one.
        print: As in :class:`Opened`.
    """

    file: Path
    before: Path | None
    print: str


class Shelf:
    """The missions of a robot.

    Args:
        own: The folder that is written to; made when something is saved.
        others: Further folders; a mission in a later one shadows one of the same name in an earlier one.
        date: Tells the date, for the names of old versions.
    """

    def __init__(
        self, own: Path, others: Sequence[Path] = (), *, date: Callable[[], datetime] = datetime.now
    ) -> None:
        self.own = own
        self._others = tuple(others)
        self._date = date

    @property
    def folders(self) -> tuple[Path, ...]:
        """The folders that exist, those that come with Florence left out."""
        return tuple(folder for folder in (*self._others, self.own) if folder.is_dir())

    @property
    def scenarios(self) -> Path:
        """The folder of the scenarios of own missions."""
        return self.own / "scenarios"

    def file_of(self, name: str) -> Path | None:
        """Return the file of a mission, None when there is none.

        Raises:
            ConfigError: This is no name of a mission.
        """
        checked_name(name)
        installed = [folder for _, folder in ThirdParty().mission_folders()]
        candidates = (folder / f"{name}.yaml" for folder in (self.own, *self._others[::-1], *installed[::-1]))
        return next((file for file in (*candidates, BUILT_IN / f"{name}.yaml") if file.is_file()), None)

    def open(self, name: str) -> Opened | None:
        """Read a mission, and the draft beside it; None when there is neither.

        Raises:
            ConfigError: This is no name of a mission, or the file cannot be read as text.
        """
        file = self.file_of(name)
        draft = self._draft_file(name)
        drafted = _read(draft) if draft.is_file() else None
        if file is None:
            return None if drafted is None else Opened("", draft, True, "", drafted)
        text = _read(file)
        own = file.parent == self.own
        return Opened(text, file, own, _print(text), drafted if drafted != text else None)

    def save(self, name: str, text: str, known: str) -> Saved:
        """Write a mission; what stood there before is kept, also in its draft, which is done with.

        Args:
            name: The mission.
            text: Its text.
            known: The print of what the writer knows to stand there; empty for nothing.

        Raises:
            ConfigError: This is no name of a mission, the text is too long, or it cannot be written.
            ChangedMeanwhile: Something else stands there.
        """
        file = self._own_file(name)
        text = _whole(text, file)
        before = _read(file) if file.is_file() else None
        if before is not None and before != text and _print(before) != known:
            what = "was changed since it was opened here" if known else "is there already, with another text"
            raise ChangedMeanwhile(f"{file} {what}")
        old = [*self._other_draft(name, text), *([before] if before not in (None, text) else [])]
        kept = self._write(name, {file: text}, old, done=[self._draft_file(name)])
        return Saved(file, kept[-1] if before not in (None, text) else None, _print(text))

    def save_draft(self, name: str, text: str) -> Path:
        """Keep a text that is not ready, and the draft before as an old version; no robot reads it.

        Raises:
            ConfigError: This is no name of a mission, the text is too long, or it cannot be written.
        """
        file = self._draft_file(name)
        text = _whole(text, file)
        self._write(name, {file: text}, self._other_draft(name, text))
        return file

    def versions(self, name: str) -> list[str]:
        """Return the dates of the old versions of a mission, the latest first."""
        folder = self.own / VERSIONS / checked_name(name)
        return sorted(
            (file.stem for file in folder.glob("*.yaml") if _DATED.fullmatch(file.stem)), reverse=True
        )

    def version(self, name: str, date: str) -> str:
        """Read an old version.

        Raises:
            ConfigError: There is none of this date.
        """
        if date not in self.versions(name):
            raise ConfigError(f"there is no version {date!r} of {name}", valid=self.versions(name))
        return _read(self.own / VERSIONS / name / f"{date}.yaml")

    def drafts(self) -> list[str]:
        """Return the missions that have a draft."""
        names = (file.stem for file in (self.own / DRAFTS).glob("*.yaml"))
        return sorted(name for name in names if IDENTIFIER.fullmatch(name))

    def scenarios_of(self, name: str) -> Path | None:
        """Return the file with the scenarios of a mission; None when there is none."""
        file = self.file_of(name)
        candidates = [self.scenarios] + ([file.parent / "scenarios"] if file is not None else [])
        return next((each for folder in candidates if (each := folder / f"{name}.yaml").is_file()), None)

    def save_scenario(self, name: str, kind: str, text: str) -> Path:
        """Write a scenario beside those of a mission, never over another one.

        Args:
            name: The mission.
            kind: A word for what it shows.
            text: The file.

        Raises:
            ConfigError: These are no names, the text is too long, or it cannot be written.
        """
        first = f"{checked_name(name)}_{checked_name(kind)}"
        stems = (name, first, *(f"{first}_{number}" for number in range(2, MOST_MISSION_VERSIONS)))
        files = (self.scenarios / f"{stem}.yaml" for stem in stems)
        file = next((each for each in files if not each.exists()), None)
        if file is None:
            raise ConfigError(f"{self.scenarios} has many scenarios {first} already", valid=["to mend some"])
        write_outputs({file: _whole(text, file).encode()}, no_links=[self.scenarios])
        return file

    def _own_file(self, name: str) -> Path:
        return self.own / f"{checked_name(name)}.yaml"

    def _draft_file(self, name: str) -> Path:
        return self.own / DRAFTS / f"{checked_name(name)}.yaml"

    def _other_draft(self, name: str, text: str) -> list[str]:
        """Return the draft of a mission unless it has this text: another may have written it."""
        file = self._draft_file(name)
        drafted = _read(file) if file.is_file() else text
        return [drafted] if drafted != text else []

    def _write(
        self, name: str, contents: Mapping[Path, str], old: Sequence[str], done: Sequence[Path] = ()
    ) -> list[Path]:
        """Write files and old versions, and remove what is done with, in one step; return the versions."""
        folder = self.own / VERSIONS / name
        kept = {folder / f"{self._date().strftime(_DATE)}.yaml": text for text in old}
        dates = sorted({*self.versions(name), *(file.stem for file in kept)}, reverse=True)
        gone = [folder / f"{date}.yaml" for date in dates[MOST_MISSION_VERSIONS:]]
        write_outputs(
            {file: text.encode() for file, text in {**kept, **contents}.items()},
            remove=[*(file for file in done if file.is_file()), *gone],
            no_links=[self.own / DRAFTS, self.own / VERSIONS],
        )
        return list(kept)


def checked_name(name: str) -> str:
    """Return a name if it is one that a mission may have.

    Raises:
        ConfigError: It is none.
    """
    if not IDENTIFIER.fullmatch(name) or len(name) > LONGEST_NAME:
        raise ConfigError(
            f"{name[:LONGEST_NAME]!r} is no name of a mission",
            valid=[f"up to {LONGEST_NAME} of a-z, 0-9 and _, a letter first, such as fetch_tea"],
        )
    return name


def date_text(date: str) -> str:
    """Write the date of an old version for people."""
    return f"{datetime.strptime(date, _DATE):%Y-%m-%d %H:%M:%S}"


def _read(file: Path) -> str:
    return decode(read_bytes(file, MAX_MISSION_BYTES), file, MAX_MISSION_BYTES)


def _whole(text: str, file: Path) -> str:
    """Return a text as it is written: it ends with a line break, and may be read again."""
    text = text.rstrip("\n") + "\n"
    return decode(text.encode("utf-8", errors="replace"), file, MAX_MISSION_BYTES)


def _print(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()
