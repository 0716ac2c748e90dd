"""The skills of the shipped missions over ROS: which action or service each one is, and how to talk to it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import ModuleType
from typing import Any

from builtin_interfaces.msg import Duration
from florence_interfaces.action import LookForUser
from florence_interfaces.srv import GetHotspot, GetRoom, GetXYPhi, ProposeApproach, SetXYPhi
from nav2_msgs.action import NavigateToPose, Spin
from std_srvs.srv import Trigger

from florence_bt.core.geometry import Pose2
from florence_bt.core.outcome import Outcome, Result, cancelled, failure, success
from florence_bt.core.skill import Inputs, MissingSkill, Skill, SkillRun
from florence_bt.ros.action_skill import ActionSkill, Deadlines
from florence_bt.ros.conversions import pose_stamped_to_ros
from florence_bt.ros.node import FlorenceNode
from florence_bt.ros.service_skill import ServiceSkill
from florence_bt.skills.locator import declaration as locate
from florence_bt.skills.locator.locator import NO_POSE, USER_UNKNOWN
from florence_bt.skills.navigation.navigate.declaration import NAVIGATE_TO, TURN
from florence_bt.skills.navigation.navigate.results import result_from_navigate, result_from_spin
from florence_bt.skills.people.approach_user.declaration import PROPOSE_APPROACH_POSE
from florence_bt.skills.people.user_tracker.declaration import LOOK_FOR_USER, START_TRACKER, STOP_TRACKER
from florence_bt.trees.language.declarations import skills_in
from florence_bt.trees.language.third_party import ThirdParty

TURN_ALLOWANCE_S = 10
"""Time for one turn (REFERENCE 12.2, step 4)."""
SERVICE_DEADLINE_S = 5.0


def make_skills(node: FlorenceNode) -> dict[str, Skill]:
    """Every skill of the shipped missions by name, and those of installed packages.

    Args:
        node: The node whose clients are used and whose clock times the deadlines.
    """
    own = {**_base_skills(node), **_people_skills(node), **_locator_skills(node)}
    return {**_skills_of_packages(node, own), **own}


def _skills_of_packages(node: FlorenceNode, own: Mapping[str, Skill]) -> dict[str, Skill]:
    """What ``make_skills`` of each package gives; a skill that breaks takes nothing else away."""
    log = node.get_logger()
    skills: dict[str, Skill] = {}
    packages = ThirdParty()
    for owner, module in packages.skill_modules():
        for name, skill in skills_of_module(module, node).items():
            if isinstance(skill, MissingSkill):
                log.error(f"{owner}: the skill {name!r} is missing: {skill.reason}")
            if name in own or name in skills:
                log.warning(f"{owner}: its skill {name!r} does not count: there is one of that name")
            else:
                skills[name] = skill
    for finding in packages.findings:
        log.warning(f"{finding.file}: {finding.message}")
    return skills


def skills_of_module(module: ModuleType, node: FlorenceNode) -> dict[str, Skill]:
    """The skills that a module makes; those that it declares and that break are :class:`MissingSkill`.

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


def _attempt(make: Callable[[], Any], what: str) -> Any:
    """What a stranger's function gives; a :class:`MissingSkill` with the reason when it fails."""
    try:
        return make()
    except (Exception, SystemExit) as error:
        return MissingSkill(f"{what} failed: {type(error).__name__}: {error}")


def _base_skills(node: FlorenceNode) -> dict[str, Skill]:
    def navigate_goal(inputs: Inputs) -> Any:
        return NavigateToPose.Goal(pose=pose_stamped_to_ros(inputs["goal"], "map", node.timebase.now()))

    def spin_goal(inputs: Inputs) -> Any:
        return Spin.Goal(target_yaw=float(inputs["angle"]), time_allowance=Duration(sec=TURN_ALLOWANCE_S))

    return {
        NAVIGATE_TO.name: ActionSkill(
            node,
            NavigateToPose,
            "navigate_to_pose",
            to_goal=navigate_goal,
            to_result=_navigate_result,
            to_feedback=_navigation_feedback,
            deadlines=Deadlines(result_s=NAVIGATE_TO.deadline_s),
        ),
        TURN.name: ActionSkill(
            node,
            Spin,
            "spin",
            to_goal=spin_goal,
            to_result=_spin_result,
            to_feedback=lambda message: "turning",
            deadlines=Deadlines(result_s=TURN.deadline_s),
        ),
    }


def _navigate_result(message: Any, outcome: Outcome) -> Result:
    return result_from_navigate(outcome, message.error_code, message.error_msg)


def _spin_result(message: Any, outcome: Outcome) -> Result:
    return result_from_spin(outcome, message.error_code, message.error_msg)


def _navigation_feedback(message: Any) -> str:
    """Where to, not how far: a countdown would make every feedback look like a change."""
    recoveries = message.number_of_recoveries
    return "driving" if recoveries == 0 else f"driving, {recoveries} recoveries so far"


def _people_skills(node: FlorenceNode) -> dict[str, Skill]:
    def look_result(message: Any, outcome: Outcome) -> Result:
        if outcome is Outcome.CANCELLED:
            return cancelled()
        if not message.found:
            code = LOOK_FOR_USER.server_codes.get(message.error_code, "no_user_seen")
            return failure(code, message.error_msg or "no user seen", server_code=message.error_code)
        return success(
            user=Pose2(message.x, message.y, message.phi), distance=message.distance, user_id=message.user_id
        )

    def propose_request(inputs: Inputs) -> Any:
        user, robot = inputs["user"], inputs["robot"]
        return ProposeApproach.Request(
            user_x=user.x,
            user_y=user.y,
            robot_x=robot.x,
            robot_y=robot.y,
            safe_distance=float(inputs["safe_distance"]),
            trial=inputs["trial"],
        )

    def propose_result(message: Any) -> Result:
        if not message.valid:
            return failure("pose_occupied", message.message or "the proposed pose is not free")
        return success(pose=Pose2(message.x, message.y, message.phi))

    return {
        START_TRACKER.name: _trigger_skill(node, "user_tracker_ni_node/Start", "tracker_failed"),
        STOP_TRACKER.name: _trigger_skill(node, "user_tracker_ni_node/Stop", "tracker_failed"),
        LOOK_FOR_USER.name: ActionSkill(
            node,
            LookForUser,
            "look_for_user",
            to_goal=lambda inputs: LookForUser.Goal(window=float(inputs["window"])),
            to_result=look_result,
            to_feedback=lambda message: f"looking, {message.users_seen} people seen so far",
            deadlines=Deadlines(result_s=LOOK_FOR_USER.deadline_s),
        ),
        PROPOSE_APPROACH_POSE.name: ServiceSkill(
            node,
            ProposeApproach,
            "approach_user/propose",
            to_request=propose_request,
            to_result=propose_result,
            deadline_s=SERVICE_DEADLINE_S,
        ),
    }


def _trigger_skill(node: FlorenceNode, service: str, code: str) -> Skill:
    def to_result(message: Any) -> Result:
        return success() if message.success else failure(code, message.message or f"{service} answered no")

    return ServiceSkill(
        node,
        Trigger,
        service,
        to_request=lambda inputs: Trigger.Request(),
        to_result=to_result,
        deadline_s=SERVICE_DEADLINE_S,
    )


def _locator_skills(node: FlorenceNode) -> dict[str, Skill]:
    def service(service_type: Any, name: str, to_request: Any, to_result: Any) -> ServiceSkill:
        return ServiceSkill(
            node,
            service_type,
            f"florenceLocator/{name}",
            to_request=to_request,
            to_result=to_result,
            deadline_s=SERVICE_DEADLINE_S,
        )

    def hotspot_result(message: Any) -> Result:
        if not message.valid:
            return failure("unknown_hotspot", message.message)
        return success(pose=Pose2(message.x, message.y, message.phi))

    def pose_result(message: Any) -> Result:
        if not message.valid:
            return failure("no_pose", NO_POSE)
        return success(pose=Pose2(message.x, message.y, message.phi))

    def robot_room_result(message: Any) -> Result:
        return success(room=message.room) if message.valid else failure("no_pose", NO_POSE)

    def user_room_result(message: Any) -> Result:
        if not message.valid:
            return failure("user_unknown", USER_UNKNOWN)
        return success(room=message.room)

    def user_position_result(message: Any) -> Result:
        return success() if message.success else failure("bad_input", message.message)

    return {
        locate.GET_USER_ROOM.name: service(
            GetRoom, "getUserPosRoom", lambda inputs: GetRoom.Request(), user_room_result
        ),
        locate.GET_HOTSPOT.name: service(
            GetHotspot, "getHotspot", lambda inputs: GetHotspot.Request(label=inputs["label"]), hotspot_result
        ),
        locate.GET_ROBOT_POSE.name: service(
            GetXYPhi, "getRobotPosXYPhi", lambda inputs: GetXYPhi.Request(), pose_result
        ),
        locate.ROBOT_IN_ROOM.name: _Judged(
            service(GetRoom, "getRobotPosRoom", lambda inputs: GetRoom.Request(), robot_room_result), _in_room
        ),
        locate.SET_USER_POSITION.name: service(
            SetXYPhi,
            "setUserPosXYPhi",
            lambda inputs: SetXYPhi.Request(x=inputs["user"].x, y=inputs["user"].y, phi=inputs["user"].yaw),
            user_position_result,
        ),
    }


def _in_room(inputs: Inputs, result: Result) -> Result:
    room = result.outputs["room"]
    if room != inputs["room"]:
        return failure("elsewhere", f"the robot is in {room!r}, not in {inputs['room']!r}")
    return success()


class _Judged:
    """A skill whose success is judged by the inputs it was given."""

    def __init__(self, skill: ServiceSkill, judge: Callable[[Inputs, Result], Result]) -> None:
        self._skill = skill
        self._judge = judge

    @property
    def label(self) -> str:
        return self._skill.label

    def server_is_there(self) -> bool:
        return self._skill.server_is_there()

    def start(self, inputs: Inputs) -> SkillRun:
        return _JudgedRun(self._skill.start(inputs), inputs, self._judge)


class _JudgedRun:
    def __init__(self, run: SkillRun, inputs: Inputs, judge: Callable[[Inputs, Result], Result]) -> None:
        self._run = run
        self._inputs = inputs
        self._judge = judge

    @property
    def feedback(self) -> str:
        return self._run.feedback

    def poll(self) -> Result | None:
        result = self._run.poll()
        return self._judge(self._inputs, result) if result is not None and result.succeeded else result

    def cancel(self) -> None:
        self._run.cancel()

    def on_change(self, callback: Callable[[], None]) -> None:
        self._run.on_change(callback)
