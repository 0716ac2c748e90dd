"""Experiments: one small YAML file says which mission runs in which homes, with whom, and what is varied."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any

from florence_bt.core.declaration import Kind
from florence_bt.core.errors import ConfigError, closest_first, raise_all
from florence_bt.core.plain_yaml import YamlMapping, YamlNode, YamlScalar, parse_yaml
from florence_bt.core.text_files import decode, read_bytes
from florence_bt.core.units import UNITS
from florence_bt.core.yaml_reader import ValueReader, YamlReader
from florence_bt.simulation.rig.wires import Link
from florence_bt.simulation.sensors.base_noise import BaseNoiseParameters
from florence_bt.simulation.sensors.kinect_sensor import KinectNoiseParameters
from florence_bt.simulation.sensors.laser_sensor import LaserParameters
from florence_sweep.outcome import CRITERIA

DRAWN_TEXT = (
    "No network has looked for people in the runs with drawn detections: what it would say was drawn from "
    "how often it was right."
)
PITCH = "pitch"
"""Parameter of the Kinect: degrees that it looks further down than the robot's description says."""
NETWORK, DRAWN = "network", "drawn"
"""Detections: by the network that the robot has; drawn from how often that was right."""
GIVEN, MADE = "given", "made"
"""Maps: the robot has one; it makes one itself."""
GENERATED, FLAT = "generated", "flat"
"""Homes: one of its own for each run; the one that comes with Florence."""


@dataclass(frozen=True, slots=True)
class SkillFault:
    """A skill that fails for a while.

    Attributes:
        skill: Its name.
        code: The code with which every start in that time fails.
        begin: Seconds after the start of the mission.
        lasts: Seconds; infinite: to the end.
    """

    skill: str
    code: str
    begin: float = 0.0
    lasts: float = math.inf


@dataclass(frozen=True, slots=True)
class Setup:
    """The setup of one run.

    Attributes:
        mission: Its name.
        inputs: Its inputs, as texts.
        missions: Folders of missions beside those of this installation.
        home: ``generated``, ``flat``, or a file of a home or map.
        people: A class of ``florence_bt.simulation.home.situations``, ``company``, ``leading``,
            ``nobody``, or a room.
        map: :data:`GIVEN`, or :data:`MADE`: the robot has none at first, and knows no places.
        limit: Simulated seconds after which the mission is stopped.
        battery: How full it is, 0 to 1.
        links: Topic -> how it is carried; ``/tf`` for the frames that move, ``*`` for all others.
        sensors: A sensor of :data:`SENSOR_PARAMETERS` -> what is unlike the usual one, by parameter.
        faults: Skills that fail for a while.
        detections: :data:`NETWORK`, or :data:`DRAWN`, which takes less time (``rig/drawn_people.py``).
        good: What a run must be to count as good, of ``florence_sweep.outcome.CRITERIA``.
    """

    mission: str
    inputs: Mapping[str, str] = field(default_factory=dict)
    missions: tuple[str, ...] = ()
    home: str = GENERATED
    people: str = "standing"
    map: str = GIVEN
    limit: float = 600.0
    battery: float = 1.0
    links: Mapping[str, Link] = field(default_factory=dict)
    sensors: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    faults: tuple[SkillFault, ...] = ()
    detections: str = NETWORK
    good: tuple[str, ...] = ("succeeded", "untouched")


SENSOR_PARAMETERS = {
    "base": [each.name for each in fields(BaseNoiseParameters)],
    "laser": [each.name for each in fields(LaserParameters)],
    "kinect": [each.name for each in fields(KinectNoiseParameters)] + [PITCH],
}
"""Sensor -> what can be unlike the usual one."""


@dataclass(frozen=True, slots=True)
class Case:
    """One run of an experiment.

    Attributes:
        number: From 0, in the order of the experiment.
        variation: What is varied, for people: ``people=lying, late=0.2``; empty without ``vary``.
        seed: Chooses the home, the people and all noise.
        setup: What it is set up with.
    """

    number: int
    variation: str
    seed: int
    setup: Setup


@dataclass(frozen=True, slots=True)
class Experiment:
    """An experiment as its file says.

    Attributes:
        file: The file.
        text: What is in it.
        name: Its name.
        runs: How many runs each variation has.
        seed: The first seed; each variation has the same seeds.
        factors: What is varied -> its values as they are told, such as ``links=late``; the first is what the
            others are compared with.
        compare: The factors whose values are compared; empty: each of them, in fewer words.
        variations: Label, a value of each factor -> what its runs are set up with.
    """

    file: Path
    text: str
    name: str
    runs: int
    seed: int
    factors: Mapping[str, tuple[str, ...]]
    compare: tuple[str, ...]
    variations: Mapping[str, Setup]

    def values(self) -> dict[str, tuple[str, ...]]:
        """Return the value of each factor, by variation."""
        return {_SEPARATOR.join(each): each for each in itertools.product(*self.factors.values())}

    def has_the_runs_of(self, other: Experiment) -> bool:
        """Tell whether the runs of another one are runs of this one: they may be judged otherwise."""
        return self.seed == other.seed and _without_good(self) == _without_good(other)

    def cases(self) -> Iterator[Case]:
        """Yield all runs: seed by seed, so that an unfinished sweep has a part of every variation."""
        numbers = itertools.count()
        for seed in range(self.seed, self.seed + self.runs):
            for variation, setup in self.variations.items():
                yield Case(next(numbers), variation, seed, setup)


def _without_good(experiment: Experiment) -> list[tuple[str, Setup]]:
    return [(name, replace(setup, good=())) for name, setup in experiment.variations.items()]


_SEPARATOR = ", "
_SETUP = tuple(each.name for each in fields(Setup))
_KEYS = ("experiment", "description", "runs", "seed", "vary", "compare", *_SETUP)


def load_experiment(file: Path) -> Experiment:
    """Read the file of an experiment; as :func:`read_experiment`."""
    return read_experiment(decode(read_bytes(file), file), file)


def read_experiment(text: str, file: Path) -> Experiment:
    """Read an experiment.

    Args:
        text: What it says.
        file: Where it stands: homes are found from there.

    Raises:
        ConfigError: All that is wrong with it, each with file, line and what would have worked.
    """
    return _Reader(file).experiment(text)


class _Reader(YamlReader):
    def __init__(self, file: Path) -> None:
        self._errors: list[ConfigError] = []
        super().__init__(file, self._errors)

    def experiment(self, text: str) -> Experiment:
        """Read the whole file."""
        entries = self.mapping(parse_yaml(text.encode(), self.file), _KEYS, ["mission"])
        setup = self._setup(entries, Setup(mission=""))
        runs = self.value(entries, "runs", self._positive, 10)
        seed = self.value(entries, "seed", self._positive, 1)
        name = self.value(entries, "experiment", self.text, self.file.stem)
        none: dict[str, list[tuple[str, Setup]]] = {}
        axes = self.value(entries, "vary", lambda node, name: self._axes(node, setup), none)
        compare = self.value(entries, "compare", lambda node, name: self._factors(node, axes), ())
        raise_all(self._errors)
        return Experiment(
            self.file,
            text,
            name,
            runs,
            seed,
            {name: tuple(label for label, _ in axis) for name, axis in axes.items()},
            compare,
            {
                _SEPARATOR.join(label for label, _ in each): _together(setup, each)
                for each in itertools.product(*axes.values())
            },
        )

    def _setup(self, entries: Mapping[str, YamlNode], base: Setup) -> Setup:
        """Return a setup with what some keys change."""
        readers: dict[str, ValueReader] = {
            "mission": self.text,
            "inputs": self._texts,
            "missions": self._folders,
            "home": self._home,
            "people": self.text,
            "map": lambda node, name: self.choice(node, name, (GIVEN, MADE)),
            "limit": self._seconds,
            "battery": self._share,
            "links": self._links,
            "sensors": self._sensors,
            "faults": self._faults,
            "detections": lambda node, name: self.choice(node, name, (NETWORK, DRAWN)),
            "good": self._criteria,
        }
        changed: dict[str, Any] = {
            name: self.value(entries, name, read, getattr(base, name))
            for name, read in readers.items()
            if name in entries
        }
        return replace(base, **changed)

    def _axes(self, node: YamlNode, base: Setup) -> dict[str, list[tuple[str, Setup]]]:
        """Read what is varied: for each factor its values with label and setup."""
        if not isinstance(node, YamlMapping):
            raise self.error("vary maps names to values", node, valid=["vary: {people: [standing, lying]}"])
        axes = {key: self._axis(key, values, base) for key, values in node.entries}
        for key, axis in axes.items():
            if not axis:
                valid = [f"{key.text}: [A, B]", "no such line"]
                raise self.error(f"{key.text} has no values", key, valid=valid)
        return {key.text: axis for key, axis in axes.items()}

    def _factors(self, node: YamlNode, axes: Iterable[str]) -> tuple[str, ...]:
        """Read which factors are compared: one, or a list."""
        each = [node] if isinstance(node, YamlScalar) else self.sequence(node, "compare")
        return tuple(self.choice(one, "factor of vary", tuple(axes)) for one in each)

    def _axis(self, key: YamlScalar, values: YamlNode, base: Setup) -> list[tuple[str, Setup]]:
        """Read one factor: a list of values of a key of the setup, or labels with some keys each."""
        if isinstance(values, YamlMapping):
            return [
                (f"{key.text}={label.text}", self._setup(self.mapping(node, _SETUP), base))
                for label, node in values.entries
            ]
        if key.text not in _SETUP:
            raise self.error(
                f"{key.text!r} has a list of values, so it must be a key of the experiment", key,
                valid=closest_first(key.text, _SETUP),
            )  # fmt: skip
        return [
            (f"{key.text}={_label(node, number)}", self._setup({key.text: node}, base))
            for number, node in enumerate(self.sequence(values, key.text), 1)
        ]

    def _positive(self, node: YamlNode, name: str) -> int:
        number = self.number(node, name, ["a whole number, 1 or more"])
        if number < 1 or number != int(number):
            raise self.error(f"{name} is {number:g}", node, valid=["a whole number, 1 or more"])
        return int(number)

    def _seconds(self, node: YamlNode, name: str) -> float:
        seconds = self.quantity(node, name, UNITS[Kind.DURATION], [f"{name}: 10 s"])
        if seconds < 0.0:
            raise self.error(f"{name} is negative", node, valid=[f"{name}: 10 s"])
        return seconds

    def _share(self, node: YamlNode, name: str) -> float:
        share = self.quantity(node, name, {"%": 0.01, "": 1.0}, [f"{name}: 20 %"])
        if not 0.0 <= share <= 1.0:
            raise self.error(f"{name} is outside of 0 % to 100 %", node, valid=[f"{name}: 20 %"])
        return share

    def _home(self, node: YamlNode, name: str) -> str:
        text = self.text(node, name)
        if text in (GENERATED, FLAT):
            return text
        file = (self.file.parent / text).resolve()
        if not file.is_file():
            valid = [GENERATED, FLAT, "the file of a home or map"]
            raise self.error(f"there is no file {file}", node, valid=valid)
        return str(file)

    def _folders(self, node: YamlNode, name: str) -> tuple[str, ...]:
        return tuple(
            str((self.file.parent / self.text(each, name)).resolve()) for each in self.sequence(node, name)
        )

    def _texts(self, node: YamlNode, name: str) -> dict[str, str]:
        entries = node.entries if isinstance(node, YamlMapping) else ()
        return {key.text: self.text(value, key.text) for key, value in entries}

    def _links(self, node: YamlNode, name: str) -> dict[str, Link]:
        if not isinstance(node, YamlMapping):
            raise self.error(
                "links maps topics to how they are carried", node, ["links: {/tf: {delay: 0.1 s}}"]
            )
        return {topic.text: self._link(value) for topic, value in node.entries}

    def _link(self, node: YamlNode) -> Link:
        entries = self.mapping(node, ("delay", "drops", "silent_from", "silent_for"))
        return Link(
            delay=self.value(entries, "delay", self._seconds, 0.0),
            drops=self.value(entries, "drops", self._share, 0.0),
            silent_from=self.value(entries, "silent_from", self._seconds, 0.0),
            silent_for=self.value(entries, "silent_for", self._seconds, 0.0),
        )

    def _sensors(self, node: YamlNode, name: str) -> dict[str, dict[str, float]]:
        entries = self.mapping(node, SENSOR_PARAMETERS)
        return {
            sensor: {
                parameter: self.number(value, parameter)
                for parameter, value in self.mapping(of_sensor, SENSOR_PARAMETERS[sensor]).items()
            }
            for sensor, of_sensor in entries.items()
        }

    def _faults(self, node: YamlNode, name: str) -> tuple[SkillFault, ...]:
        return tuple(self._fault(each) for each in self.sequence(node, name))

    def _fault(self, node: YamlNode) -> SkillFault:
        entries = self.mapping(node, ("skill", "code", "from", "for"), ["skill", "code"])
        return SkillFault(
            self.value(entries, "skill", self.text, ""),
            self.value(entries, "code", self.text, ""),
            self.value(entries, "from", self._seconds, 0.0),
            self.value(entries, "for", self._seconds, math.inf),
        )

    def _criteria(self, node: YamlNode, name: str) -> tuple[str, ...]:
        return tuple(self.choice(each, "criterion", CRITERIA) for each in self.sequence(node, name))


def _label(node: YamlNode, number: int) -> str:
    return node.text if isinstance(node, YamlScalar) else str(number)


def _together(base: Setup, chosen: Sequence[tuple[str, Setup]]) -> Setup:
    """Return a setup with what each of the chosen ones changes."""
    changed = {
        name: getattr(setup, name)
        for _, setup in chosen
        for name in _SETUP
        if getattr(setup, name) != getattr(base, name)
    }
    return replace(base, **changed)
