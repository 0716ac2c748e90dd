"""What the bring-up tells on ``diagnostics`` about its processes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("rclpy")

from florence_bt.app.bringup import process_report
from florence_bt.app.bringup.process_report import ProcessReport


class Node:
    """Keeps what is published."""

    def __init__(self) -> None:
        self.told: dict[str, tuple[int, str]] = {}

    def create_publisher(self, kind: Any, topic: str, qos: Any) -> Node:
        return self

    def publish(self, message: Any) -> None:
        self.told = {each.name: (each.level[0], each.message) for each in message.status}

    def stamp(self) -> float:
        return 7.0


class Supervisor:
    """Four processes: one hangs, one was killed because it hung, one has died too often."""

    def pids(self) -> dict[str, int]:
        return {"hardware": 1, "navigation": 2, "people": 3, "missions": 4}

    def silences(self) -> dict[str, float]:
        return {"hardware": 3.4, "navigation": 0.4, "missions": 0.1}

    def restarts(self, name: str) -> int:
        return int(name == "navigation")

    def given_up(self) -> set[str]:
        return {"people"}

    def waiting(self) -> set[str]:
        return set()


def test_a_process_that_hangs_does_not_run(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(process_report.time, "monotonic", lambda: 50.0)
    node = Node()
    ProcessReport(node, Supervisor(), tmp_path).publish()  # type: ignore[arg-type]
    assert node.told == {
        "florence_up: process hardware": (2, "has not answered for 3 s"),
        "florence_up: process navigation": (1, "was started again once in the last 10 min"),
        "florence_up: process people": (2, "has died too often and is not started again"),
        "florence_up: process missions": (0, "runs"),
    }
