"""The check that all parameter classes of the drivers share: numbers within their limits."""

from __future__ import annotations

from florence_bt.core.errors import ConfigError


def check_limits(parameters: object, **limits: tuple[float, float]) -> None:
    """Check numbers of a parameter class; one that is None is not set and passes.

    Args:
        parameters: The values, as attributes.
        limits: The smallest and the largest value by the name of the parameter.

    Raises:
        ConfigError: A value is outside of its limits, or not a number.
    """
    for name, (lowest, highest) in limits.items():
        value = getattr(parameters, name)
        if value is not None and not lowest <= value <= highest:
            raise ConfigError(f"{name} {value!r} is out of range", valid=[f"{lowest:g} to {highest:g}"])
