"""The command ``florence``. Every verb loads only what it needs: ``check`` and ``draw`` work without ROS.

``override`` and ``release`` load nothing else before they publish, not even the other verbs.
"""

from __future__ import annotations

import os
import sys

from florence_bt.cli.exit_codes import INTERRUPTED, NOT_THERE, OK, USAGE
from florence_bt.ros.arguments import (
    NAMESPACE_VARIABLE,
    split_ros_arguments,
    use_arguments,
    use_namespace,
)


def main() -> None:
    """Run the command."""
    words, of_ros = split_ros_arguments(sys.argv[1:])
    match words:
        case ["override" | "release" as verb] | ["override" | "release" as verb, "--namespace", _]:
            use_arguments(of_ros)
            sys.exit(_switch_override(verb == "override", words[2:]))
    from florence_bt.cli.application import app

    app(prog_name="florence", standalone_mode=True)


def _switch_override(on: bool, given: list[str]) -> int:
    try:
        from florence_bt.app.runs.switch_override import switch_override
        from florence_bt.core.errors import ConfigError, FlorenceError

        try:
            robot = given[-1] if given else os.environ.get(NAMESPACE_VARIABLE, "")
            use_namespace(robot, chosen=bool(given))
            print(switch_override(on, f"florence {'override' if on else 'release'}"))
        except ConfigError as error:
            print(f"florence: {error}", file=sys.stderr)
            return USAGE
        except FlorenceError as error:
            print(f"florence: {error}", file=sys.stderr)
            return NOT_THERE
    except KeyboardInterrupt:
        return INTERRUPTED
    return OK
