"""The simulated home: the flat, its people, the robot in it, and physics."""

import os

# Nothing here opens a window of MuJoCo. Without this its import starts a process that looks for a library of
# windows.
os.environ.setdefault("MUJOCO_GL", "disable")
