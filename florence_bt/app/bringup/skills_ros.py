"""The skills over ROS: the shipped ones from their tables, those of installed packages and those of files."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from functools import partial
from random import Random
from types import ModuleType
from typing import Any

from florence_bt.core.interfaces import fill, load_interface
from florence_bt.core.serving import (
    ActionBinding,
    AnswerBinding,
    ClockBinding,
    ConditionBinding,
    NodeBinding,
    PublicationBinding,
    QuestionBinding,
    ServiceBinding,
    SkillBinding,
    TopicBinding,
    WaitBinding,
)
from florence_bt.core.skill import Inputs, InstantSkill, MissingSkill, Skill
from florence_bt.ros.action_skill import ActionSkill, Deadlines
from florence_bt.ros.conversions import stamp_to_ros
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.qos import LATCHED, RELIABLE, STATE
from florence_bt.ros.service_skill import ServiceSkill
from florence_bt.ros.topic_skill import (
    TopicAnswerWait,
    TopicCondition,
    TopicPublication,
    TopicWait,
)
from florence_bt.skills.served import BINDINGS
from florence_bt.trees.language.declarations import own_declarations, skills_in
from florence_bt.trees.language.message_mappings import MessageMapping
from florence_bt.trees.language.third_party import ThirdParty


def make_skills(
    node: FlorenceNode, without: Collection[str] = (), mappings: Mapping[str, MessageMapping] | None = None
) -> dict[str, Skill]:
    """Make every skill of the shipped missions, those of installed packages and those of files, by name.

    Args:
        node: The node whose clients are used and whose clock times the deadlines.
        without: Skills that nobody performs in this system; they fail with ``no_skill``.
        mappings: How the skills of files beside missions are served.
    """
    declared = own_declarations()
    own: dict[str, Skill] = {
        served.skill: _over_ros(node, served, declared[served.skill].deadline_s)
        for served in BINDINGS
        if served.skill not in without
    }
    own |= {name: MissingSkill(f"nothing serves {name} with --nav nav2") for name in without}
    files = _skills_of_files(node, {name: each for name, each in (mappings or {}).items() if name not in own})
    return {**files, **_skills_of_packages(node, own), **own}


def _skills_of_files(node: FlorenceNode, mappings: Mapping[str, MessageMapping]) -> dict[str, Skill]:
    """Make the skills of files; one that cannot be made leaves the others in place."""
    skills = {
        name: _attempt(
            partial(_over_ros, node, each.binding(), each.declaration.deadline_s),
            f"{each.way} {each.name} ({each.interface})",
        )
        for name, each in mappings.items()
    }
    _log_missing(node, {name: skill for name, skill in skills.items() if not mappings[name].stock})
    return skills


def _skills_of_packages(node: FlorenceNode, own: Mapping[str, Skill]) -> dict[str, Skill]:
    """Collect what ``make_skills`` of each package gives; a skill that fails leaves the others in place."""
    log = node.get_logger()
    skills: dict[str, Skill] = {}
    packages = ThirdParty()
    for owner, module in packages.skill_modules():
        made = skills_of_module(module, node)
        _log_missing(node, made, f"{owner}: ")
        for name, skill in made.items():
            if name in own or name in skills:
                log.warning(f"{owner}: its skill {name!r} is ignored: the name is taken")
            else:
                skills[name] = skill
    for finding in packages.findings:
        log.warning(f"{finding.file}: {finding.message}")
    return skills


def skills_of_module(module: ModuleType, node: FlorenceNode) -> dict[str, Skill]:
    """Return the skills that a module makes; those that it declares and that fail are :class:`MissingSkill`.

    Args:
        module: A module with ``make_skills``, which gives skills, or functions without arguments that make
            them.
        node: The node of the skills.
    """
    declared = [declaration.name for declaration in skills_in(module)]
    make = getattr(module, "make_skills", None)
    made = _attempt(lambda: dict(make(node)) if make is not None else {}, f"make_skills of {module.__name__}")
    if isinstance(made, MissingSkill):
        return dict.fromkeys(declared, made)
    skills: dict[str, Skill] = {}
    for name, skill in made.items():
        is_made = hasattr(skill, "start") or not callable(skill)
        skills[name] = skill if is_made else _attempt(skill, f"its factory in {module.__name__}")
    nothing = MissingSkill(f"make_skills of {module.__name__} does not make it")
    return {**dict.fromkeys(declared, nothing), **skills}


def _log_missing(node: FlorenceNode, skills: Mapping[str, Skill], owner: str = "") -> None:
    """Tell of each skill that could not be made; ``owner`` goes before it."""
    for name, skill in skills.items():
        if isinstance(skill, MissingSkill):
            node.get_logger().error(f"{owner}the skill {name!r} is missing: {skill.reason}")


def _attempt(make: Callable[[], Any], what: str) -> Any:
    """Call a function of another package; return a :class:`MissingSkill` with the reason if it fails."""
    try:
        return make()
    except (Exception, SystemExit) as error:
        return MissingSkill(f"{what} failed: {type(error).__name__}: {error}")


def _over_ros(node: FlorenceNode, served: SkillBinding, deadline_s: float) -> Skill:
    """Make the client of a skill's action, service or topic.

    Raises:
        ConfigError: Its interface is not installed.
    """
    if isinstance(served, AnswerBinding):
        chance = Random()
        return InstantSkill(lambda inputs: served.answer(inputs, chance))
    if isinstance(served, ClockBinding):
        return served.make(node.timebase, lambda: node.get_clock().now().nanoseconds / 1e9)
    if isinstance(served, QuestionBinding):
        return TopicAnswerWait(node, served)
    interface = load_interface(served.interface)
    if isinstance(served, NodeBinding):
        return _of_node(node, served, interface, deadline_s)
    assert isinstance(served, TopicBinding)
    heard = LATCHED if served.latched else STATE  # which hears every publisher, reliable or not
    if isinstance(served, ConditionBinding):
        topic = (interface, served.name)
        return TopicCondition(
            node,
            topic,
            to_result=served.judge,
            max_age_s=served.max_age_s,
            qos=heard,
            limits=not served.foreign,
        )
    if isinstance(served, WaitBinding):
        return TopicWait(node, interface, served, heard, deadline_s=deadline_s)
    assert isinstance(served, PublicationBinding)
    return TopicPublication(
        node,
        (interface, served.name),
        _writer(node, interface, served.message),
        LATCHED if served.latched else RELIABLE,
        deadline_s=deadline_s,
    )


def _of_node(
    node: FlorenceNode, served: NodeBinding, interface: Any, deadline_s: float
) -> ActionSkill | ServiceSkill:
    if isinstance(served, ActionBinding):
        return ActionSkill(
            node,
            interface,
            served.name,
            to_goal=_writer(node, interface.Goal, served.request),
            to_result=served.result,
            to_feedback=served.feedback,
            deadlines=Deadlines.within(deadline_s),
        )
    assert isinstance(served, ServiceBinding)
    return ServiceSkill(
        node,
        interface,
        served.name,
        to_request=_writer(node, interface.Request, served.request),
        to_result=served.result,
        deadline_s=deadline_s,
        judge=served.judge,
    )


def _writer(
    node: FlorenceNode, message_type: Any, fields: Callable[[Inputs], Mapping[str, Any]]
) -> Callable[[Inputs], Any]:
    """Return what makes a message from inputs."""
    return lambda inputs: fill(message_type(), fields(inputs), stamp_to_ros(node.stamp()))
