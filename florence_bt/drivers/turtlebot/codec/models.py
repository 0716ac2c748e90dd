"""The bases that speak the Open Interface, and in what they differ (REFERENCE 1.1, 1.3, 1.5, 1.6)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from florence_bt.core.errors import ConfigError, closest_first


@dataclass(frozen=True, slots=True)
class Model:
    """One kind of base.

    Attributes:
        name: What people call it.
        baud_rate: Bits per second after power-on.
        wheel_separation_m: Metres between the wheels.
        stream_budget_bytes: The longest frame that the line carries in the stream's 15 ms.
        packets: The numbers of its sensor packets.
        groups: Packets that one number asks for together.
        songs: How many songs it stores.
        metres_per_tick: Travel per count of a wheel encoder; None when its encoders cannot be read.
        cargo_bay: Has the connector with the digital outputs and the analog input that the gyro is wired to.
    """

    name: str
    baud_rate: int
    wheel_separation_m: float
    stream_budget_bytes: int
    packets: range
    groups: Mapping[int, range]
    songs: int
    metres_per_tick: float | None
    cargo_bay: bool


_COMMON_GROUPS: dict[int, range] = {
    0: range(7, 27),
    1: range(7, 17),
    2: range(17, 21),
    3: range(21, 27),
    4: range(27, 35),
    5: range(35, 43),
    6: range(7, 43),
}
"""Number of a group -> its packets, of every base. Source: REFERENCE 1.5."""
_CREATE_2_GROUPS = _COMMON_GROUPS | {
    100: range(7, 59),
    101: range(43, 59),
    106: range(46, 52),
    107: range(54, 59),
}
"""Those of a Create 2. Source: REFERENCE 1.5, which has 106 and 107 unverified."""

CREATE = Model(
    name="iRobot Create",
    baud_rate=57600,
    wheel_separation_m=0.260,
    stream_budget_bytes=86,
    packets=range(7, 43),
    groups=_COMMON_GROUPS,
    songs=16,
    metres_per_tick=None,
    cargo_bay=True,
)
CREATE_2 = Model(
    name="iRobot Create 2",
    baud_rate=115200,
    wheel_separation_m=0.235,
    stream_budget_bytes=172,
    packets=range(7, 59),
    groups=_CREATE_2_GROUPS,
    songs=5,
    metres_per_tick=0.000444565,
    cargo_bay=False,
)
MODELS: dict[str, Model] = {"create": CREATE, "create2": CREATE_2, "roomba": CREATE_2}
"""By the values of the parameter ``robot_type``; the Roomba 500 and later speak like the Create 2."""


def model_named(name: str) -> Model:
    """Return the model of a ``robot_type``.

    Raises:
        ConfigError: There is no such model.
    """
    if name not in MODELS:
        raise ConfigError(f"there is no robot_type {name!r}", valid=closest_first(name, MODELS))
    return MODELS[name]
