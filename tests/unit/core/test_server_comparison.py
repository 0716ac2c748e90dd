"""Why a server cannot be reached: its type, its kind, its spelling, or the state of its node."""

from __future__ import annotations

import pytest

from florence_bt.core.server_comparison import (
    ACTION,
    PUBLISHER,
    SERVICE,
    SUBSCRIBER,
    Offers,
    Wanted,
    compare,
)

SCAN, DOSE, TRIGGER = "cart_msgs/srv/ScanBed", "cart_msgs/srv/SetDose", "std_srvs/srv/Trigger"
GRAPH = Offers(
    {
        ACTION: {
            "/cart1/water": ["nav2_msgs/action/Spin"],
            "/cart1/drive_row": ["cart_msgs/action/DriveRow"],
        },
        SERVICE: {
            "/cart1/scan_bed": [SCAN],
            "/cart1/scan_beds": [TRIGGER],
            "/cart1/horn": [TRIGGER],
            "/cart2/rinse": [DOSE],
            "/cart1/pump/get_state": ["lifecycle_msgs/srv/GetState"],
        },
        PUBLISHER: {"/cart1/door_open": ["std_msgs/msg/String"]},
        SUBSCRIBER: {"/cart1/say": ["std_msgs/msg/String"]},
    },
    {"/cart1/pump": "unconfigured", "/cart1/arm": "active", "/cart2/pump": "inactive"},
    {SERVICE: {"/cart1/scan_bed": ["/cart1/arm"], "/cart2/rinse": ["/cart2/pump"]}},
)


@pytest.mark.parametrize(
    ("wanted", "problem", "valid"),
    [
        (Wanted(SERVICE, "/cart1/scan_bed", SCAN), "", ()),
        (
            Wanted(SERVICE, "/cart1/scan_bed", TRIGGER),
            f"/cart1/scan_bed has the type {SCAN}",
            (f"type: {SCAN}",),
        ),
        (
            Wanted(ACTION, "/cart1/water", "cart_msgs/action/Water"),
            "/cart1/water has the type nav2_msgs/action/Spin",
            ("type: nav2_msgs/action/Spin",),
        ),
        (
            Wanted(PUBLISHER, "/cart1/door_open", "std_msgs/msg/Bool"),
            "/cart1/door_open has the type std_msgs/msg/String",
            ("type: std_msgs/msg/String",),
        ),
        (
            Wanted(SUBSCRIBER, "/cart1/say", "std_msgs/msg/Bool"),
            "/cart1/say has the type std_msgs/msg/String",
            ("type: std_msgs/msg/String",),
        ),
        (
            Wanted(SERVICE, "/cart1/drive_row", TRIGGER),
            "/cart1/drive_row is an action (cart_msgs/action/DriveRow)",
            ("action: /cart1/drive_row",),
        ),
        (
            Wanted(ACTION, "/cart1/horn", "cart_msgs/action/Horn"),
            f"/cart1/horn is a service ({TRIGGER})",
            ("service: /cart1/horn",),
        ),
        (
            Wanted(SERVICE, "/cart1/scan_bde", SCAN),
            "there is no service of this name",
            ("/cart1/scan_bed", "/cart1/scan_beds"),
        ),
        (
            Wanted(SERVICE, "/scan_bed", SCAN),
            "there is no service of this name",
            ("/cart1/scan_bed", "/cart1/scan_beds"),
        ),
        (
            Wanted(PUBLISHER, "/cart1/door_opn", "std_msgs/msg/String"),
            "there is no topic of this name",
            ("/cart1/door_open",),
        ),
        (Wanted(SERVICE, "/cart1/set_dose", DOSE), "/cart1/pump is unconfigured", ()),
        (Wanted(SERVICE, "/cart1/pump/dose", DOSE), "/cart1/pump is unconfigured", ()),
        (Wanted(SERVICE, "/robot/lamp", DOSE), "", ()),
        (Wanted(SERVICE, "/cart2/rinse", DOSE), "/cart2/pump is inactive", ()),
        (
            Wanted(SERVICE, "/cart1/rinse", DOSE),
            "there is no service of this name, /cart1/pump is unconfigured",
            ("/cart2/rinse",),
        ),
    ],
)
def test_why_a_server_cannot_be_reached(wanted: Wanted, problem: str, valid: tuple[str, ...]) -> None:
    lack = compare(wanted, GRAPH)
    assert (lack.problem, lack.valid) == (problem, valid)
    assert lack.wrong_type is (" has the type " in problem or " is a" in problem)
    assert bool(str(lack)) is bool(problem)
