import pytest

from florence_bt.behaviours.keys import (
    KeyReference,
    KeyStore,
    MissingKey,
    PoseFromParts,
    TextTemplate,
    WrongValue,
    readable,
    resolve,
)
from florence_bt.behaviours.leaves import Fail, SetKey
from florence_bt.core.clock import ManualClock
from florence_bt.core.declaration import Kind, Port
from florence_bt.core.geometry import Pose2
from tests.ticking import make_context


def test_read_write_reset():
    keys = KeyStore({"a": 1})
    keys.write("b", Pose2(1, 2, 3))
    assert (keys.read("a"), keys.read("b"), "b" in keys, list(keys)) == (1, Pose2(1, 2, 3), True, ["a", "b"])
    copy = keys.as_dict()
    keys.reset({"c": "x"})
    assert (keys.as_dict(), copy["a"]) == ({"c": "x"}, 1)


def test_a_key_that_was_never_written():
    with pytest.raises(MissingKey, match=r"'gaol' has no value yet .*goal"):
        KeyStore({"goal": 1.0}).read("gaol")
    with pytest.raises(MissingKey, match="none at all"):
        KeyStore().read("goal")


def test_a_value_of_a_strange_type():
    with pytest.raises(TypeError, match="cannot hold"):
        KeyStore().write("a", [1])


def test_a_declared_key_holds_its_kind_and_begins_with_its_default():
    keys = KeyStore()
    keys.declare({"n": Port(Kind.INTEGER, "how many", 7), "to": Port(Kind.POSE, "where")})
    keys.reset({"free": "x"})
    assert keys.as_dict() == {"free": "x", "n": 7}
    for key, value in (("n", "many"), ("to", 3.0)):
        with pytest.raises(WrongValue, match=f"the key '{key}' cannot hold this: a value of type"):
            keys.write(key, value)
    assert keys.as_dict() == {"free": "x", "n": 7}
    keys.write("n", 8)
    keys.write("free", 1.5)
    assert keys.as_dict() == {"free": 1.5, "n": 8}


def test_sources():
    keys = KeyStore({"x": 1, "name": "Ada", "ok": True})
    assert resolve(5, keys) == 5
    assert resolve(KeyReference("x"), keys) == 1
    assert resolve(TextTemplate(("hello ", KeyReference("name"))), keys) == "hello Ada"
    assert resolve(PoseFromParts(KeyReference("x"), 2.0, 0.5), keys) == Pose2(1.0, 2.0, 0.5)


def test_readable():
    assert [readable(v) for v in (True, 3, 0.123456, "t")] == ["true", "3", "0.1235", "t"]
    assert readable(Pose2(1, 2, 3)) == "(x 1.00 m, y 2.00 m, yaw 171.9 deg)"


def test_a_text_has_values_as_people_write_them():
    values = {"speed": 0.3, "turn": 1.5707963, "pause": 5.0, "part": 0.25, "room": "hall"}
    kinds = {"speed": Kind.SPEED, "turn": Kind.ANGLE, "pause": Kind.DURATION, "part": Kind.NUMBER}
    keys = KeyStore(values)
    keys.declare({}, lambda: kinds)
    parts = (KeyReference("turn"), " in the ", KeyReference("room"), ", ", KeyReference("pause"), "; ")
    assert resolve(TextTemplate((*parts, KeyReference("part"))), keys) == "90 deg in the hall, 5 s; 0.25"
    written = (KeyReference("pause"), " s at ", KeyReference("speed"), " m/s, not 5 smiles: ")
    assert resolve(TextTemplate(written), keys) == "5 s at 0.3 m/s, not 5 smiles: "
    turns = TextTemplate((KeyReference("turn"), " deg, ", KeyReference("turn"), " rad"))
    assert resolve(turns, keys) == "90 deg, 1.571 rad"
    smiles = TextTemplate((KeyReference("pause"), " smiles"))
    assert resolve(smiles, keys) == "5 s smiles"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (("wait ", KeyReference("long"), ", then ", KeyReference("pause")), "wait 90 min, then 30 min 10 s"),
        ((KeyReference("long"), " min"), "90 min"),
        ((KeyReference("long"), " minutes"), "90 minutes"),
        ((KeyReference("long"), " s"), "5400 s"),
        ((KeyReference("long"), " hours"), "1.5 hours"),
        ((KeyReference("far"), "; ", KeyReference("far"), " m"), "1.5 km; 1500 m"),
        ((KeyReference("far"), " km"), "1.5 km"),
        ((KeyReference("near"), ", ", KeyReference("near"), " m"), "5 cm, 0.05 m"),
        ((KeyReference("turn"), " rad"), "3.142 rad"),
        ((KeyReference("far"), " s away"), "1500 s away"),
        ((KeyReference("far"), " in front"), "1.5 km in front"),
    ],
)
def test_a_text_has_values_in_the_unit_that_people_take_or_that_is_written(text, said):
    keys = KeyStore({"long": 5400.0, "pause": 1810.0, "far": 1500.0, "near": 0.05, "turn": 3.1415926})
    lengths, durations = (
        dict.fromkeys(("far", "near"), Kind.LENGTH),
        dict.fromkeys(("long", "pause"), Kind.DURATION),
    )
    keys.declare({}, lambda: {**lengths, **durations, "turn": Kind.ANGLE})
    assert resolve(TextTemplate(text), keys) == said


def test_a_list_in_a_text_has_no_brackets():
    keys = KeyStore({"rooms": ("kitchen", "hall"), "none": (), "far": (0.5, 2.0)})
    keys.declare({}, lambda: {"rooms": Kind.LIST_OF_TEXT, "far": Kind.LIST_OF_LENGTH})
    said = [resolve(TextTemplate(("in: ", KeyReference(name))), keys) for name in ("rooms", "none", "far")]
    assert said == ["in: kitchen, hall", "in: ", "in: 0.5 m, 2 m"]


def test_set_key_writes_all_or_nothing():
    context = make_context(ManualClock(), keys={"a": 1})
    node = SetKey("set", context, {"b": KeyReference("a"), "c": KeyReference("gone")})
    node.tick_once()
    assert (node.result.code, context.keys.as_dict()) == ("missing_key", {"a": 1})
    SetKey("set", context, {"b": KeyReference("a")}).tick_once()
    assert context.keys.read("b") == 1


def test_fail_with_a_key_in_its_reason():
    context = make_context(ManualClock(), keys={"room": "kitchen"})
    node = Fail("fail", context, TextTemplate(("nobody in the ", KeyReference("room"))), "nobody")
    node.tick_once()
    assert (node.result.code, node.result.reason) == ("nobody", "nobody in the kitchen")
