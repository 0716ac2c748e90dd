"""What missions know of navigation."""

from __future__ import annotations

import math

from florence_bt.core.declaration import Kind, Port, SkillDeclaration
from florence_bt.skills.navigation.navigate.results import (
    NAVIGATE_CODES_BY_NUMBER,
    NAVIGATE_FAILURES,
    SPIN_CODES_BY_NUMBER,
    TURN_FAILURES,
)

NAVIGATE_TO = SkillDeclaration(
    name="navigate_to",
    summary="Drive to a pose in the map, around everything that is in the way.",
    inputs={"goal": Port(Kind.POSE, "Where to go, in the map frame.")},
    failures=NAVIGATE_FAILURES,
    resources=frozenset({"base"}),
    deadline_s=180.0,
    server_codes=NAVIGATE_CODES_BY_NUMBER,
)

TURN = SkillDeclaration(
    name="turn",
    summary="Turn in place by an angle.",
    inputs={
        "angle": Port(
            Kind.ANGLE,
            "How far, counter-clockwise positive.",
            minimum=-2.0 * math.pi,
            maximum=2.0 * math.pi,
        ),
        "time_allowance": Port(
            Kind.DURATION, "How long the turn may take.", default=10.0, minimum=0.1, maximum=120.0
        ),
    },
    failures=TURN_FAILURES,
    resources=frozenset({"base"}),
    deadline_s=30.0,
    server_codes=SPIN_CODES_BY_NUMBER,
)

DECLARATIONS = (NAVIGATE_TO, TURN)
