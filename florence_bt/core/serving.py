"""How a shipped skill is served: over ROS by an action or a service, and in the rig by a component.

Each ``declaration.py`` has a table ``SERVED`` beside its declarations. The types of ROS are named, not
imported, and messages are read by their fields, so that the rig and ``florence check`` need no ROS.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from florence_bt.core.declaration import SkillDeclaration
from florence_bt.core.outcome import Outcome, Result
from florence_bt.core.skill import Inputs, SkillRun


@dataclass(frozen=True, slots=True, kw_only=True)
class Served:
    """What actions and services have in common.

    Attributes:
        skill: The declaration.
        interface: The ROS type, such as ``nav2_msgs/action/Spin``.
        name: The name of the action or service.
        component: The part of the rig that performs the skill.
        perform: Given the component and the inputs: the result of a skill that answers at once, else its run.
        request: The fields of the goal or request from the inputs. A :class:`Pose2` becomes a stamped pose in
            the map frame, a ``timedelta`` a duration.
    """

    skill: SkillDeclaration
    interface: str
    name: str
    component: str
    perform: Callable[[Any, Inputs], Result | SkillRun]
    request: Callable[[Inputs], Mapping[str, Any]] = lambda inputs: {}


@dataclass(frozen=True, slots=True, kw_only=True)
class ServedAction(Served):
    """A skill that is an action.

    Attributes:
        result: The skill's result from the result message and the way the goal ended.
        feedback: A text for people from a feedback message; steady while nothing new happens.
    """

    result: Callable[[Any, Outcome], Result]
    feedback: Callable[[Any], str]


@dataclass(frozen=True, slots=True, kw_only=True)
class ServedService(Served):
    """A skill that is a service.

    Attributes:
        result: The skill's result from the response.
        judge: The result from the inputs and a success of the service; the success itself when None.
    """

    result: Callable[[Any], Result]
    judge: Callable[[Inputs, Result], Result] | None = None
