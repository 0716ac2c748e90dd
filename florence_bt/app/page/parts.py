"""What viewers are sent, in parts that change at different times: each is written once for all viewers."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any


class LiveParts:
    """The newest value of each part as JSON, with a number that grows when it changes.

    One thread puts, others read: what they get is always whole.
    """

    def __init__(self) -> None:
        self._parts: dict[str, tuple[int, str]] = {}

    def put(self, name: str, value: Any) -> None:
        """Set a part; nothing is sent when it says the same as before."""
        text = json.dumps(value, separators=(",", ":"), ensure_ascii=False, allow_nan=False)
        number, before = self._parts.get(name, (0, ""))
        if text != before:
            self._parts[name] = (number + 1, text)

    def since(self, seen: Mapping[str, int]) -> tuple[str, dict[str, int]]:
        """Return what a viewer has not got.

        Args:
            seen: The numbers of the parts that it has, by name.

        Returns:
            A JSON object of the parts that changed, empty text when none did; and the numbers it has then.
        """
        parts = dict(self._parts)
        new = {name: text for name, (number, text) in parts.items() if seen.get(name) != number}
        frame = "{" + ",".join(f'"{name}":{text}' for name, text in new.items()) + "}" if new else ""
        return frame, {name: number for name, (number, _) in parts.items()}
