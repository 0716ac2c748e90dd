"""What all who edit share: where missions are, what looks at texts, the rig, and how the robot is told."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from florence_interfaces.srv import ReloadMissions
from rcl_interfaces.msg import ParameterType
from rcl_interfaces.srv import GetParameters

from florence_bt.app.runs.client import LOCATOR
from florence_bt.core.errors import FlorenceError
from florence_bt.core.topic_names import RUN_STATE
from florence_page.editor.helpers import ScenarioRuns, Trials, Verifications, Worker
from florence_page.editor.shelf import Shelf
from florence_page.ros_thread import RosThread

FOLDER = Path("missions")
"""Where missions are kept when neither the command nor the robot names a folder."""

TELL_S = 5.0
"""Longest that somebody who opens the editor waits for a robot to tell where its missions are."""


@dataclass(frozen=True, slots=True)
class Home:
    """The missions and places of the home, as they are now.

    Attributes:
        shelf: The missions.
        hotspots: The places of the robot's home; None when no robot tells them.
        there: Whether a mission server runs.
        told: Whether it has told its folders.
        reads_own: Whether it reads the folder that missions are saved in.
    """

    shelf: Shelf
    hotspots: Path | None
    there: bool
    told: bool
    reads_own: bool

    @property
    def note(self) -> str:
        """Say what whoever edits should know about the robot."""
        if not self.there:
            return "no robot is running: missions can be written, tried and saved"
        if not self.told:
            return "a robot is running, but does not say where its missions are"
        if not self.reads_own:
            return f"the robot does not read {self.shelf.own}: start it with --missions {self.shelf.own}"
        return "the robot is running"


class Desk:
    """The shared part of the editor.

    Args:
        ros: Talks to the robot.
        folders: Folders of missions, the last one to be written to; empty takes those of the robot.
    """

    def __init__(self, ros: RosThread, folders: Sequence[Path]) -> None:
        self._ros = ros
        self._folders = [folder.absolute() for folder in folders]
        self.worker = Worker()
        self.trials = Trials()
        self.scenarios = ScenarioRuns()
        self.verifications = Verifications()
        self.words: dict[str, Any] = {}

    async def learn(self, home: Home) -> dict[str, Any]:
        """Find out what can be written now (:func:`~florence_page.editor.words.words_of`).

        Raises:
            FlorenceError: A folder or the places cannot be read.
        """
        self.words = await self.worker.ask("words", home.shelf.folders, home.hotspots)
        return self.words

    @property
    def robot_there(self) -> bool:
        """Tell whether a mission server runs now."""
        return bool(self._ros.node.count_publishers(RUN_STATE) > 0)

    async def home(self) -> Home:
        """Ask where missions are."""
        there = self.robot_there
        folders: list[str] | None = None
        hotspots = None
        if there:
            asked = asyncio.create_task(self._parameter(LOCATOR, "hotspots_file"))
            folders = await self._parameter("florence_bt", "mission_folders")
            file = await asked
            hotspots = Path(file) if file and Path(file).is_file() else None
        robots = [Path(each) for each in folders or ()]
        *others, own = self._folders or robots or [FOLDER.absolute()]
        reads = any(each.absolute() == own.absolute() for each in robots)
        return Home(
            Shelf(own, [each for each in others if each.is_dir()]),
            hotspots,
            there,
            folders is not None,
            reads,
        )

    async def _parameter(self, node: str, name: str) -> Any:
        """Return a parameter; None when nobody tells it."""
        try:
            question = GetParameters.Request(names=[name])
            answer = await asyncio.wait_for(
                self._ros.ask(GetParameters, f"{node}/get_parameters", question), TELL_S
            )
        except (FlorenceError, TimeoutError):
            return None
        if not answer.values:  # so rclpy answers for an undeclared one
            return None
        value = answer.values[0]
        if value.type == ParameterType.PARAMETER_STRING:
            return value.string_value
        return list(value.string_array_value)

    async def reload(self) -> str:
        """Let the robot read its missions again; return what it says.

        Raises:
            FlorenceError: Nobody answers.
        """
        answer = await self._ros.ask(ReloadMissions, "florence_bt/reload_missions", ReloadMissions.Request())
        return str(answer.report)

    async def close(self) -> None:
        """End what works for it."""
        await self.worker.close()
        await self.trials.close()
        await self.scenarios.close()
        await self.verifications.close()
