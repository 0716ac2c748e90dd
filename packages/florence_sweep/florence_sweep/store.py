"""The results of a sweep: one SQLite file, to which each run is written when it is over."""

from __future__ import annotations

import hashlib
import json
import sqlite3
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from dataclasses import asdict, fields
from functools import cache
from pathlib import Path
from typing import Any

import florence_bt
from florence_bt.core.errors import ConfigError
from florence_bt.core.paths import PACKAGE
from florence_sweep.experiment import Experiment, read_experiment
from florence_sweep.outcome import Outcome, judged

_COLUMNS = [each.name for each in fields(Outcome)]
_READ: dict[str, Callable[[str], Any]] = {
    "contacts": lambda text: tuple(json.loads(text)),
    "measures": json.loads,
}
_BOOLEANS = ("false_find", "polite", "visible", "good")
_FORM = "florence sweep 1"
_CODE_FILES = (".py", ".yaml", ".onnx", ".xacro", ".xml")


@cache
def code_version() -> str:
    """Return a fingerprint of the code and data of Florence that a run depends on."""
    found = hashlib.sha256()
    own = Path(__file__).parent
    for root in (PACKAGE, own):
        for file in sorted(path for path in root.rglob("*") if path.suffix in _CODE_FILES):
            found.update(str(file.relative_to(root)).encode() + b"\0" + file.read_bytes())
    return f"{florence_bt.__version__} {found.hexdigest()[:12]}"


class Results:
    """The results in one file.

    Args:
        file: The file; it must be there.

    Raises:
        ConfigError: It is no file of results.

    Attributes:
        experiment: The text of the experiment.
        place: The file in which that stood.
        name: Its name.
        code: :func:`code_version` of the code that made it.
    """

    def __init__(self, file: Path) -> None:
        self.file = file
        about = self._about()
        if about.get("form") != _FORM:
            raise ConfigError("is no file of results of florence sweep", file=file)
        self.experiment, self.place = about["experiment"], Path(about["place"])
        self.name, self.code = about["name"], about["code"]

    def _about(self) -> dict[str, str]:
        if not self.file.is_file():
            raise ConfigError("there is no such file", file=self.file)
        try:
            with self._open() as database:
                return dict(database.execute("SELECT name, value FROM about"))
        except sqlite3.DatabaseError:
            return {}

    @contextmanager
    def _open(self) -> Iterator[sqlite3.Connection]:
        with closing(sqlite3.connect(self.file)) as database, database:
            yield database

    @classmethod
    def of(cls, experiment: Experiment, file: Path) -> Results:
        """Return the results of an experiment: those that are there go on, else they begin.

        What is judged or compared otherwise than before is judged anew.

        Raises:
            ConfigError: The file is of another experiment.
        """
        if not file.exists():
            cls._begin(experiment, file)
        results = cls(file)
        if results.experiment != experiment.text:
            results._take(experiment)
        return results

    def _take(self, experiment: Experiment) -> None:
        """Be of an experiment whose text has changed, when its runs have not."""
        before = read_experiment(self.experiment, self.place)
        if not experiment.has_the_runs_of(before):
            problem = "has results of another experiment, or the experiment has changed since"
            raise ConfigError(problem, file=self.file, valid=_another(self.file))
        good = [
            (judged(each, experiment.variations[each.variation].good).good, each.number)
            for each in self.outcomes()
        ]
        self.experiment = experiment.text
        with self._open() as database:
            database.execute("UPDATE about SET value = ? WHERE name = 'experiment'", (experiment.text,))
            database.executemany("UPDATE runs SET good = ? WHERE number = ?", good)

    def refuse_other_code(self) -> None:
        """Refuse to go on with runs of other code than this.

        Raises:
            ConfigError: They are.
        """
        if self.code != code_version():
            problem = "was made with other code: its runs and new ones do not belong together"
            raise ConfigError(problem, file=self.file, valid=_another(self.file))

    @classmethod
    def _begin(cls, experiment: Experiment, file: Path) -> None:
        file.parent.mkdir(parents=True, exist_ok=True)
        about = {
            "form": _FORM,
            "name": experiment.name,
            "experiment": experiment.text,
            "place": str(experiment.file.resolve()),
            "code": code_version(),
        }
        with closing(sqlite3.connect(file)) as database, database:
            database.execute("CREATE TABLE about (name TEXT PRIMARY KEY, value TEXT)")
            database.executemany("INSERT INTO about VALUES (?, ?)", about.items())
            columns = ", ".join(_COLUMNS[1:])
            database.execute(f"CREATE TABLE runs (number INTEGER PRIMARY KEY, {columns})")

    def add(self, outcome: Outcome) -> None:
        """Write one run; once, however often it was run."""
        values = [_stored(value) for value in asdict(outcome).values()]
        marks = ", ".join("?" * len(values))
        with self._open() as database:
            database.execute(f"INSERT OR IGNORE INTO runs VALUES ({marks})", values)

    def outcomes(self) -> list[Outcome]:
        """Return all runs, in the order of the experiment."""
        with self._open() as database:
            found = database.execute("SELECT * FROM runs ORDER BY number")
            names = [column[0] for column in found.description]
            return [
                Outcome(**{name: _read(name, value) for name, value in zip(names, row, strict=True)})
                for row in found
            ]


def _another(file: Path) -> list[str]:
    return ["--out ANOTHER", f"remove {file}"]


def _stored(value: Any) -> Any:
    return json.dumps(value) if isinstance(value, tuple | list | dict) else value


def _read(name: str, value: Any) -> Any:
    if name in _READ:
        return _READ[name](value)
    return bool(value) if name in _BOOLEANS and value is not None else value
