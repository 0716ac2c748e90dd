"""What several tests of one process share: the declared skills and the maps of missions."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache

from florence_bt.core.declaration import SkillDeclaration
from florence_bt.mission_testing.paths import MissionMap, map_mission
from florence_bt.trees.language.declarations import collect_declarations
from florence_bt.trees.language.loader import MissionLibrary
from florence_bt.trees.language.model import Mission


@cache
def all_declarations() -> Mapping[str, SkillDeclaration]:
    """Every declared skill; read once."""
    return collect_declarations()


class MissionMaps:
    """The maps of missions, made once for each."""

    def __init__(self) -> None:
        self._maps: dict[int, tuple[Mission, MissionMap]] = {}

    def of(
        self, mission: Mission, library: MissionLibrary, declarations: Mapping[str, SkillDeclaration]
    ) -> MissionMap:
        """The map of a mission.

        Raises:
            ConfigError: The mission has errors.
        """
        known = self._maps.get(id(mission))
        if known is None or known[0] is not mission:
            known = self._maps[id(mission)] = (mission, map_mission(mission, library, declarations))
        return known[1]
