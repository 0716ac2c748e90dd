"""A small mission that the tests of the test tools play."""

from florence_bt.mission_testing import succeed

GREET = """
mission: greet
description: Drives somewhere and looks.
inputs:
  room: {type: text, default: kitchen}
outputs:
  user: {type: pose, description: where the person is}
tree:
  sequence:
    - get_hotspot: {label: $room}
      out: {pose: spot}
    - navigate_to: {goal: $spot}
    - name: look around
      retry: 3
      do:
        look_for_user: {window: 2 s}
        out: {user: user}
"""
SEEN = succeed(user="(3 m, 2 m, 0 deg)", distance="2 m", user_id=7, after="1 s")
