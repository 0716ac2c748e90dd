"""A small world of skills and missions, independent of the real ones."""

from pathlib import Path

import pytest

from florence_bt.core.declaration import CodeGroup, Kind, Port, SkillDeclaration
from florence_bt.trees.checks.lint import check
from florence_bt.trees.language.loader import MissionLibrary

UNREACHABLE = CodeGroup("unreachable", frozenset({"no_path", "blocked"}), "not there")
NOT_FOUND = CodeGroup("not_found", frozenset({"no_user_seen"}), "nobody")
SKILLS = (
    SkillDeclaration(
        "navigate_to",
        "Drive",
        inputs={
            "goal": Port(Kind.POSE, "where to"),
            "speed": Port(Kind.SPEED, "how fast", default=0.3, minimum=0.0, maximum=0.5),
        },
        failures={"no_path": "no way", "blocked": "something is in the way"},
        resources=frozenset({"base"}),
    ),
    SkillDeclaration(
        "turn",
        "Turn",
        inputs={"angle": Port(Kind.ANGLE, "how far")},
        failures={"blocked": "something is in the way"},
        groups=(UNREACHABLE,),
        resources=frozenset({"base"}),
    ),
    SkillDeclaration(
        "look_for_user",
        "Look",
        inputs={"window": Port(Kind.DURATION, "how long", default=5.0, minimum=0.5, maximum=15.0)},
        outputs={"user": Port(Kind.POSE, "where"), "distance": Port(Kind.LENGTH, "how far")},
        failures={"no_user_seen": "nobody"},
        groups=(NOT_FOUND,),
    ),
    SkillDeclaration(
        "get_hotspot",
        "Hotspot",
        inputs={"label": Port(Kind.TEXT, "which", names="hotspot")},
        outputs={"pose": Port(Kind.POSE, "where")},
        failures={"unknown_hotspot": "none"},
        instant=True,
    ),
    SkillDeclaration("stop_tracker", "Stop"),
    SkillDeclaration("is_charged", "Ask", failures={"low": "no"}, instant=True, reports_changes=True),
)
DECLARATIONS = {skill.name: skill for skill in SKILLS}
HEAD = "mission: {name}\n"


class Workshop:
    """Writes mission files and checks them."""

    def __init__(self, folder: Path):
        self.folder = folder
        self.declarations = DECLARATIONS

    def write(self, text: str, name: str = "m") -> Path:
        path = self.folder / f"{name}.yaml"
        path.write_text(text if text.startswith("mission:") else HEAD.format(name=name) + text)
        return path

    def library(self) -> MissionLibrary:
        return MissionLibrary.load([self.folder], built_in=False)

    def findings(self, text: str, name: str = "m", hotspots=None):
        """The findings of one mission; the first line of ``text`` is line 2 of the file."""
        self.write(text, name)
        library = self.library()
        return check(library.get(name), library, self.declarations, hotspots)

    def lines(self, text: str, name: str = "m", hotspots=None):
        return [
            f"{f.line}:{f.column} {f.severity} {f.message} | {', '.join(f.valid)}"
            for f in self.findings(text, name, hotspots)
        ]


@pytest.fixture
def workshop(tmp_path):
    return Workshop(tmp_path)
