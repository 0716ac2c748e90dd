"""ROS parameters to dataclasses, without ROS."""

from __future__ import annotations

import enum
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import pytest

from florence_bt.core.errors import ConfigError
from florence_bt.ros.parameters import fill_dataclass, to_parameter


class Model(enum.Enum):
    CREATE = "create"
    ROOMBA = "roomba"


@dataclass(frozen=True, slots=True)
class Noise:
    sigma: float = 0.1


@dataclass(frozen=True, slots=True)
class Settings:
    port: str
    rate: float = 30.0
    count: int = 3
    on: bool = True
    limit: float | None = None
    window: tuple[float, float] = (-1.0, 1.0)
    names: tuple[str, ...] = ("a",)
    model: Model = Model.CREATE
    map: Path = Path("flat.yaml")
    mode: Literal["own", "nav2"] = "own"
    noise: Noise = field(default_factory=Noise)

    def __post_init__(self) -> None:
        if self.rate <= 0.0:
            raise ConfigError(f"rate must be above zero, not {self.rate}")


def fill(**values: Any) -> Settings:
    given = {"port": "/dev/ttyUSB0", **values}
    return fill_dataclass(Settings, lambda name, default: given.get(name, default))


def test_defaults() -> None:
    assert fill() == Settings("/dev/ttyUSB0")


def test_what_is_asked_for() -> None:
    asked: dict[str, Any] = {}

    def read(name: str, default: Any) -> Any:
        asked[name] = default
        return "/dev/ttyUSB0" if name == "port" else default

    fill_dataclass(Settings, read)
    assert asked["port"] is None
    assert asked["window"] == [-1.0, 1.0]
    assert asked["model"] == "create"
    assert asked["noise.sigma"] == 0.1


def test_values_of_every_kind() -> None:
    settings = fill(
        rate=10,
        count=4,
        on=False,
        limit=2,
        window=[0.0, 2],
        names=[],
        model="roomba",
        map="home.yaml",
        mode="nav2",
        **{"noise.sigma": 0.5},
    )
    assert settings == Settings(
        "/dev/ttyUSB0",
        10.0,
        4,
        False,
        2.0,
        (0.0, 2.0),
        (),
        Model.ROOMBA,
        Path("home.yaml"),
        "nav2",
        Noise(0.5),
    )
    assert isinstance(settings.rate, float)


@pytest.mark.parametrize(
    ("name", "value", "hint"),
    [
        ("rate", "fast", "a number"),
        ("rate", True, "a number"),
        ("count", 1.5, "a whole number"),
        ("count", True, "a whole number"),
        ("on", 1, "true or false"),
        ("limit", "none", "a number"),
        ("window", [1.0], "a list of 2 values"),
        ("window", "ab", "a list"),
        ("names", [1], "a text"),
        ("model", "rumba", "roomba"),
        ("mode", "nav", "'own', 'nav2'"),
        ("map", 1, "a path"),
        ("noise.sigma", "loud", "a number"),
    ],
)
def test_a_wrong_value_is_named(name: str, value: Any, hint: str) -> None:
    with pytest.raises(ConfigError) as caught:
        fill(**{name: value})
    assert repr(name) in str(caught.value)
    assert hint in str(caught.value)


def test_what_the_dataclass_refuses() -> None:
    with pytest.raises(ConfigError, match="above zero"):
        fill(rate=-1.0)


def test_a_missing_value() -> None:
    with pytest.raises(ConfigError, match="'port' is not set"):
        fill_dataclass(Settings, lambda name, default: default)


def test_round_trip() -> None:
    settings = fill()
    names = ("port", "rate", "window", "names", "model", "map")
    stored = {name: to_parameter(getattr(settings, name)) for name in names}
    assert fill(**stored) == settings
