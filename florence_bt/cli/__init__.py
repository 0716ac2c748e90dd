"""The command ``florence``. Every verb loads only what it needs: ``check`` and ``draw`` work without ROS.

``override`` and ``release`` load nothing else before they publish, not even the other verbs.
"""

from __future__ import annotations

import sys

from florence_bt.cli.exit_codes import INTERRUPTED, NOT_THERE, OK

_SWITCHES = {"override": True, "release": False}


def main() -> None:
    """Run the command."""
    words = sys.argv[1:]
    if len(words) == 1 and words[0] in _SWITCHES:
        sys.exit(_switch_override(_SWITCHES[words[0]]))
    from florence_bt.cli.application import app

    app(prog_name="florence", standalone_mode=True)


def _switch_override(on: bool) -> int:
    try:
        from florence_bt.app.runs.switch_override import switch_override
        from florence_bt.core.errors import FlorenceError

        try:
            print(switch_override(on))
        except FlorenceError as error:
            print(f"florence: {error}", file=sys.stderr)
            return NOT_THERE
    except KeyboardInterrupt:
        return INTERRUPTED
    return OK
