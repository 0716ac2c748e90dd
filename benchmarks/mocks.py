"""Skills for whole missions in benchmarks: each succeeds, with an output of each kind that it declares."""

from __future__ import annotations

from typing import Any

from florence_bt.core.clock import Clock
from florence_bt.core.declaration import Kind, SkillDeclaration
from florence_bt.core.geometry import Pose2
from florence_bt.core.outcome import success
from florence_bt.mission_testing.mocks.mocks import Step
from tests.scripted_skill import ScriptedSkill

SOMEWHERE, ROBOT = Pose2(1.0, 2.0, 0.5), Pose2(1.0, 2.0)
"""The robot stands where everybody is and does not look past them, or goto_user would fail with too_far."""
_VALUES = {Kind.POSE: SOMEWHERE, Kind.TEXT: "kitchen", Kind.BOOLEAN: True, Kind.INTEGER: 1}


def value_of(kind: Kind) -> Any:
    """Return a value of a kind; a list has one item."""
    return (value_of(kind.item),) if kind.item is not None else _VALUES.get(kind, 1.0)


def succeeding(
    declaration: SkillDeclaration, clock: Clock, mock: type[ScriptedSkill] = ScriptedSkill
) -> ScriptedSkill:
    """Return a skill that succeeds, after a second when it takes time."""
    outputs = {
        name: port.choices[0] if port.choices else value_of(port.kind)
        for name, port in declaration.outputs.items()
    }
    if declaration.name == "get_robot_pose":
        outputs["pose"] = ROBOT
    after = 0.0 if declaration.instant else 1.0
    return mock(declaration, clock, [Step(success(**outputs), after=after)])
