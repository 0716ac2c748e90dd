"""The command ``florence``. Every verb loads only what it needs: ``check`` and ``draw`` work without ROS.

A command of one verb loads the module of that verb alone; the list of verbs, a word that is none of them and
what calls the application itself load :mod:`florence_bt.cli.application`. ``override`` and ``release`` load
nothing else before they publish, not even that.
"""

from __future__ import annotations

import os
import sys
from importlib import import_module

from florence_bt.cli.exit_codes import INTERRUPTED, NOT_THERE, OK, USAGE
from florence_bt.ros.arguments import (
    NAMESPACE_VARIABLE,
    split_ros_arguments,
    use_arguments,
    use_namespace,
)

VERBS = {
    "exploring": ("map",),  # with the rest of the group, which is in the module maps
    "interfaces": ("interfaces",),
    "missions": ("missions", "check", "draw", "schema"),
    "places": ("hotspot", "where"),
    "recording": ("record",),
    "replaying": ("replay", "diff"),
    "robot": ("init", "doctor", "calibrate", "teleop", "kinect"),
    "runs": (
        "run",
        "status",
        "stop",
        "pause",
        "resume",
        "break",
        "step",
        "continue",
        "override",
        "release",
        "answer",
        "reload",
        "runs",
        "report",
    ),
    "skills": ("skills",),
    "system": ("demo", "up", "logs"),
    "testing": ("test",),
    "verifying": ("verify", "mutate"),
}
"""Module -> the verbs that it adds to the application."""


def main() -> None:
    """Run the command."""
    words, of_ros = split_ros_arguments(sys.argv[1:])
    match words:
        case ["override" | "release" as verb] | ["override" | "release" as verb, "--namespace", _]:
            use_arguments(of_ros)
            sys.exit(_switch_override(verb == "override", words[2:]))
    import_module(f"florence_bt.cli.{_module_for(words)}")
    from florence_bt.cli.common import app

    app(prog_name="florence", standalone_mode=True)


def _module_for(words: list[str]) -> str:
    """Name the module that has the verb of a command line; that of all verbs when it begins with none."""
    return next((module for module, verbs in VERBS.items() if words and words[0] in verbs), "application")


def _switch_override(on: bool, given: list[str]) -> int:
    try:
        from florence_bt.app.runs.switch_override import release_the_robot, stop_the_robot
        from florence_bt.core.errors import ConfigError, FlorenceError

        try:
            robot = given[-1] if given else os.environ.get(NAMESPACE_VARIABLE, "")
            use_namespace(robot, chosen=bool(given))
            print(stop_the_robot("florence override").word if on else release_the_robot("florence release"))
        except ConfigError as error:
            print(f"florence: {error}", file=sys.stderr)
            return USAGE
        except FlorenceError as error:
            print(f"florence: {error}", file=sys.stderr)
            return NOT_THERE
    except KeyboardInterrupt:
        return INTERRUPTED
    return OK
