"""The servers of the skills: which are missing, in the log and on ``diagnostics``."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from pathlib import Path

from florence_bt.core.clock import call_every
from florence_bt.core.diagnosis import Diagnosis, Severity
from florence_bt.core.skill import Skill
from florence_bt.core.topic_names import SERVERS_STATUS
from florence_bt.ros.action_skill import ActionSkill
from florence_bt.ros.diagnostics import diagnostics_publisher, diagnostics_to_ros
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.robot_state import SERVERS_PERIOD_S
from florence_bt.ros.served_skill import ServedSkill, server_text
from florence_bt.ros.service_skill import ServiceSkill
from florence_bt.runtime.executor import Executor


class SkillServers:
    """Knows which servers are there, and tells every :data:`SERVERS_PERIOD_S` of those that are missing.

    Args:
        node: Sees the graph.
        missions: Say which skills are used.
        skills: All skills by name.
        own: Skills whose servers come up together with the node; whoever started those looks after them.
        folders: Folders of missions; what those use, and all that they call, is needed.
        only_used: Whether a server that those do not use is not missed. Otherwise every action and service
            is; a topic, which anybody may serve or not, only when it is used.
    """

    def __init__(
        self,
        node: FlorenceNode,
        missions: Executor,
        skills: Mapping[str, Skill],
        *,
        own: Collection[str],
        folders: Iterable[Path],
        only_used: bool,
    ) -> None:
        self._node = node
        self._missions = missions
        self._served = {name: skill for name, skill in skills.items() if isinstance(skill, ServedSkill)}
        self._own = own
        self._folders = tuple(folders)
        self._only_used = only_used
        self._told: Mapping[str, str] = {}
        self._publisher = diagnostics_publisher(node)
        timer = call_every(node.steady, SERVERS_PERIOD_S, self._look)
        node.on_close(timer.cancel)

    def missing_own(self) -> list[str]:
        """Name those that come up together with the node and are not there yet."""
        return list(self._missing(self._own).values())

    def missing_for(self, missions: Iterable[str]) -> list[str]:
        """Name those that some missions need and that are not there."""
        return list(self._missing([*self._own, *self._used_by(missions)]).values())

    def missing(self) -> Mapping[str, str]:
        """Return skill -> server of those that are needed and not there, of other people's."""
        needed = self._used_by(
            mission.name for mission in self._missions.library if mission.file.parent in self._folders
        )
        if not self._only_used:
            needed |= {
                name for name, skill in self._served.items() if isinstance(skill, ActionSkill | ServiceSkill)
            }
        return self._missing(sorted(needed.difference(self._own)))

    def _used_by(self, missions: Iterable[str]) -> set[str]:
        return {skill for name in missions for skill, _ in self._missions.library.skills_below(name)}

    def _missing(self, names: Iterable[str]) -> dict[str, str]:
        return {
            name: server_text(self._served[name])
            for name in names
            if name in self._served and not self._served[name].server_is_there()
        }

    def _look(self) -> None:
        missing = self.missing()
        if not missing and not self._told:
            return
        news, self._told = missing != self._told, missing
        log = self._node.get_logger()
        if missing:
            diagnosis = Diagnosis(Severity.WARN, "missions that need one fail with server_lost", missing)
            if news:
                lines = [f"{name}: {label}" for name, label in missing.items()]
                log.warning("\n  ".join([f"nobody serves, and {diagnosis.message}:", *lines]))
        else:
            diagnosis = Diagnosis(Severity.OK, "every server that missions need is there")
            log.info(diagnosis.message)
        name = self._node.get_name()
        self._publisher.publish(
            diagnostics_to_ros({SERVERS_STATUS: diagnosis}, name, name, self._node.stamp())
        )
