"""The keys of a running mission under one name each: where they are, who reads and who writes them."""

from florence_bt.core.clock import ManualClock
from florence_bt.core.geometry import Pose2
from florence_bt.runtime.viewers.variables import READ, WRITE, variables_of
from florence_bt.trees.language.compile import compile_mission
from florence_bt.trees.language.declarations import collect_declarations
from florence_bt.trees.language.loader import MissionLibrary
from tests.ticking import make_context

OUTER = """\
mission: outer
inputs: {room: {type: text}}
outputs: {place: {type: pose}}
tree:
  sequence:
    - run: inner
      with: {label: $room}
      out: {found: place}
    - condition: $room == "hall"
"""
INNER = """\
mission: inner
inputs: {label: {type: text}}
outputs: {found: {type: pose}}
tree:
  get_hotspot: {label: $label}
  out: {pose: found}
"""


def test_each_key_has_one_name_and_each_node_its_uses(tmp_path):
    for name, text in (("outer", OUTER), ("inner", INNER)):
        (tmp_path / f"{name}.yaml").write_text(text)
    library = MissionLibrary.load([tmp_path])
    context = make_context(ManualClock(), {}, collect_declarations())
    tree = compile_mission(library.get("outer"), library, {"room": "hall"}, context)
    variables = variables_of(tree)
    call, condition = tree.root.children
    (look_up,) = call.children
    assert sorted(variables.stores) == ["/", "/inner/"]
    assert variables.accesses == {
        call.id: (("/room", READ), ("/place", WRITE)),
        look_up.id: (("/inner/label", READ), ("/inner/found", WRITE)),
        condition.id: (("/room", READ),),
    }
    assert variables.used_by([condition.id, call.id]) == ["/place", "/room"]
    tree.keys.write("place", Pose2(1.0, 2.0, 0.5))
    values = variables.values_of(["/place", "/room", "/inner/found"])
    assert "x 1.00 m" in values["/place"] and (values["/room"], values["/inner/found"]) == ("hall", "-")


WRITERS = """\
mission: writers
keys: {seen: {type: list of text, default: []}, n: {type: integer, default: 0}}
tree:
  sequence:
    - append: {seen: kitchen}
    - add: {n: 1}
    - for_each: $seen
      as: room
      do: {condition: $room == "kitchen"}
"""


def test_every_kind_that_writes_a_key_is_told(tmp_path):
    """The item of a loop is a key of what is below it, and none of the mission."""
    (tmp_path / "writers.yaml").write_text(WRITERS)
    library = MissionLibrary.load([tmp_path])
    context = make_context(ManualClock(), {}, collect_declarations())
    tree = compile_mission(library.get("writers"), library, {}, context)
    added, counted, loop = tree.root.children
    accesses = variables_of(tree).accesses
    assert accesses[added.id] == (("/seen", READ), ("/seen", WRITE))
    assert accesses[counted.id] == (("/n", READ), ("/n", WRITE))
    assert accesses[loop.id] == (("/seen", READ),)
