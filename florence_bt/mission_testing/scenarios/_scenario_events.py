"""The part of a scenario under ``when``: what happens while the mission runs."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

from florence_bt.core.errors import ConfigError, FlorenceError, closest_first
from florence_bt.core.plain_yaml import Position, YamlMapping, YamlNode, YamlScalar
from florence_bt.mission_testing.paths import MissionMap
from florence_bt.mission_testing.play import Unmet
from florence_bt.mission_testing.record import RUNNING, STATUSES
from florence_bt.mission_testing.scenarios._reading import Reading, input_text
from florence_bt.mission_testing.scenarios._scenario_checks import read_expectation
from florence_bt.mission_testing.scenarios.scenario import Check, Happening, Scene, Trigger
from florence_bt.mission_testing.stage import Stage
from florence_bt.runtime.run import TriggerPolicy

KINDS: dict[str, tuple[str, ...]] = {
    "advance": (),
    "until": ("is",),
    "stop": (),
    "pause": (),
    "resume": (),
    "override": (),
    "release": (),
    "start": ("inputs", "policy", "priority", "caller", "refused", "as"),
    "expect": (),
}
"""What can happen -> the further keys of that table. ``at`` may stand with each, and alone."""
TRIGGER_KEYS = ("policy", "priority", "caller", "refused")
REASON = "the scenario said so"

Act = Callable[[Scene], None]


def read_happenings(
    reading: Reading, source: YamlNode | None, places: MissionMap | None
) -> tuple[tuple[Happening, ...], dict[str, MissionMap]]:
    """Read the list under ``when``.

    Args:
        reading: Notes what is wrong.
        source: The list.
        places: The nodes of the scenario's mission; None when it is not known.

    Returns:
        What happens, and the nodes of the missions that it starts, by the names that ``as`` gives them.
    """
    happenings: list[Happening] = []
    others: dict[str, MissionMap] = {}
    for item in reading.items(source):
        table = item
        if isinstance(item, YamlScalar):
            word, _, rest = item.text.strip().partition(" ")
            value = YamlScalar(rest.strip(), False, _position_of(item, rest.strip()))
            table = YamlMapping(((YamlScalar(word, False, item.position), value),), item.position)
        if not isinstance(table, YamlMapping):
            reading.problem(
                item.position, "something that happens is a word or a table", ["advance: 3 s", "stop"]
            )
            continue
        act = _happening(reading, table, places, others)
        if act is not None:
            word = next((key.text for key, _ in table.entries if key.text in KINDS), "at")
            happenings.append(Happening(word, act, table.position))
    return tuple(happenings), others


def _position_of(item: YamlScalar, rest: str) -> Position:
    """Where the text behind the first word begins."""
    if item.first_column is None or not rest:
        return item.position
    return replace(item.position, column=item.first_column + item.text.rindex(rest))


def _happening(
    reading: Reading, table: YamlMapping, places: MissionMap | None, others: dict[str, MissionMap]
) -> Act | None:
    kinds = [key for key, _ in table.entries if key.text in KINDS]
    if len(kinds) > 1:
        message = f"{kinds[1].text!r} cannot stand beside {kinds[0].text!r}"
        reading.problem(kinds[1].position, message, [f"an entry of its own: - {kinds[1].text}: ..."])
        return None
    if not kinds and not (table.key("at") and len(table.entries) == 1):
        unknown = next((key for key, _ in table.entries if key.text != "at"), None)
        if unknown is None:
            reading.problem(table.position, "nothing happens here", list(KINDS))
        else:
            message = f"nothing that happens is called {unknown.text!r}"
            reading.problem(unknown.position, message, _meant(unknown.text))
        return None
    kind = kinds[0].text if kinds else ""
    allowed = (kind, *KINDS.get(kind, ()), "at")
    entries = {name: value for name, (_, value) in reading.entries(table, kind or "at", allowed).items()}
    act = _READERS[kind](reading, entries, places, others) if kind else _nothing
    at = reading.duration(entries["at"], "at") if "at" in entries else None
    if at is None or act is None:
        return act

    def act_then(scene: Scene) -> None:
        wait = at + scene.play.started - scene.stage.now
        if wait < -1e-6:
            raise AssertionError(f"at {at:g} s has passed already")
        scene.stage.advance(max(0.0, wait))
        act(scene)

    return act_then


def _meant(written: str) -> tuple[str, ...]:
    """What would have worked where nothing that can happen is called so, such as ``at 3 s: stop``."""
    word, _, rest = written.partition(" ")
    if word in (*KINDS, "at") and rest:
        return (f"{word}: {rest}",)
    return closest_first(written, (*KINDS, "at"))


def _nothing(scene: Scene) -> None:
    """Only the time passes."""


Entries = Mapping[str, YamlNode]
Others = dict[str, MissionMap]


def _advance(reading: Reading, entries: Entries, places: MissionMap | None, others: Others) -> Act | None:
    seconds = reading.duration(entries["advance"], "advance")
    return (lambda scene: scene.stage.advance(seconds)) if seconds is not None else None


def _until(reading: Reading, entries: Entries, places: MissionMap | None, others: Others) -> Act | None:
    pattern = entries["until"]
    name = reading.text(pattern, "until")
    status = (reading.text(entries["is"], "is") or "").upper() if "is" in entries else RUNNING
    if status not in STATUSES:
        reading.problem(entries["is"].position, f"a node has no status {status!r}", STATUSES)
        return None
    if name is None or not isinstance(pattern, YamlScalar) or reading.pattern(pattern, places) is None:
        return None

    def act(scene: Scene) -> None:
        scene.stage.run_until(name, status, play=scene.play)

    return act


def _stop(reading: Reading, entries: Entries, places: MissionMap | None, others: Others) -> Act | None:
    reason = _reason(reading, entries["stop"])
    return lambda scene: scene.stage.stop(reason)


def _pause(reading: Reading, entries: Entries, places: MissionMap | None, others: Others) -> Act | None:
    reason = _reason(reading, entries["pause"])
    return lambda scene: scene.stage.pause(reason)


def _override(reading: Reading, entries: Entries, places: MissionMap | None, others: Others) -> Act | None:
    reason = _reason(reading, entries["override"])
    return lambda scene: scene.stage.override(reason)


def _resume(reading: Reading, entries: Entries, places: MissionMap | None, others: Others) -> Act | None:
    return lambda scene: scene.stage.resume()


def _release(reading: Reading, entries: Entries, places: MissionMap | None, others: Others) -> Act | None:
    return lambda scene: scene.stage.release()


def _expect(reading: Reading, entries: Entries, places: MissionMap | None, others: Others) -> Act | None:
    source = entries["expect"]
    expectation = read_expectation(reading, source, places, "expect")
    if (isinstance(source, YamlScalar) and source.empty) or (
        isinstance(source, YamlMapping) and not source.entries
    ):
        reading.problem(source.position, "nothing is expected here", ["expect: {status: RUNNING}"])

    def act(scene: Scene) -> None:
        for check in expectation.checks:
            hold(scene, check, "")

    return act


def _start(reading: Reading, entries: Entries, places: MissionMap | None, others: Others) -> Act | None:
    trigger = read_trigger(reading, entries["start"], entries, "start")
    if trigger is None:
        return None
    name = trigger.mission
    if "as" in entries:
        name = reading.text(entries["as"], "as") or name
    if name in others or not name:
        reading.problem(
            entries.get("as", entries["start"]).position,
            f"something else is called {name!r} here already",
            [f"as: second_{trigger.mission}"],
        )
    others[name] = reading.maps.of(
        reading.library.get(trigger.mission), reading.library, reading.declarations
    )
    return lambda scene: start(scene, trigger, name)


def read_trigger(reading: Reading, mission: YamlNode, entries: Entries, what: str) -> Trigger | None:
    """Read how a mission is started.

    Args:
        reading: Notes what is wrong.
        mission: Its name or file.
        entries: ``inputs`` and the keys of :data:`TRIGGER_KEYS`.
        what: What the name is called, for messages.
    """
    name = reading.mission(mission, what)
    # An input that stands there with nothing behind it is not given, also when the file gives it to all.
    inputs = {
        key.text: input_text(value)
        for key, value in reading.table(entries.get("inputs"), "inputs")
        if not (isinstance(value, YamlScalar) and value.empty)
    }
    options: dict[str, Any] = {}
    if "policy" in entries:
        policies = [policy.value for policy in TriggerPolicy]
        options["policy"] = reading.text(entries["policy"], "policy")
        if options["policy"] not in policies:
            reading.problem(entries["policy"].position, f"there is no policy {options['policy']!r}", policies)
    if "priority" in entries:
        options["priority"] = reading.whole(entries["priority"], "priority", 0) or 0
    if "caller" in entries:
        options["caller"] = reading.text(entries["caller"], "caller")
    refused = reading.text(entries["refused"], "refused") if "refused" in entries else None
    if name is None:
        return None
    if refused is None:
        _check_inputs(reading, name, entries.get("inputs"), mission, inputs)
    position = entries["refused"].position if "refused" in entries else mission.position
    return Trigger(name, inputs, options, refused, position)


def _check_inputs(
    reading: Reading, name: str, source: YamlNode | None, mission: YamlNode, inputs: Mapping[str, str]
) -> None:
    ports = reading.library.get(name).inputs
    for key, value in reading.table(source, "inputs"):
        try:
            reading.check_input(name, key.text, inputs.get(key.text))
        except ConfigError as error:
            reading.wrong(value.position if key.text in ports else key.position, error)
    missing = [port for port in ports if ports[port].required and port not in inputs]
    if missing:
        place = source.position if source is not None else mission.position
        reading.problem(place, f"{name} needs the input {' and '.join(missing)}", [f"{missing[0]}: ..."])


def _reason(reading: Reading, source: YamlNode) -> str:
    if isinstance(source, YamlScalar) and source.empty:
        return REASON
    return reading.text(source, "a reason") or REASON


def start(scene: Scene, trigger: Trigger, name: str) -> None:
    """Start a mission of a scenario and keep its run under a name.

    Raises:
        AssertionError: It was accepted although it should have been refused, or the other way round.
    """
    stage: Stage = scene.stage
    try:
        play = stage.start(trigger.mission, trigger.inputs, **trigger.options)
    except FlorenceError as error:
        if trigger.refused is None:
            raise AssertionError(f"{trigger.mission} was refused: {error}") from error
        if trigger.refused not in str(error):
            raise AssertionError(
                f"the refusal does not contain {trigger.refused!r}; it is: {str(error)!r}"
            ) from error
        return
    scene.plays[name] = play
    if trigger.refused is not None:
        raise AssertionError(f"{trigger.mission} was accepted, but should have been refused")


def hold(scene: Scene, check: Check, name: str) -> None:
    """Look whether something holds, and note it when not."""
    play = scene.plays.get(name)
    if play is None:
        scene.problems.append((check.position, f"there is no run {name!r}: it was refused or never started"))
        return
    try:
        check.assertion(play)
    except Unmet as error:
        scene.problems.append((check.position, error.problem))
    except ConfigError as error:
        scene.problems.append((check.position, str(error)))


_READERS: dict[str, Callable[[Reading, Entries, MissionMap | None, Others], Act | None]] = {
    "advance": _advance,
    "until": _until,
    "stop": _stop,
    "pause": _pause,
    "resume": _resume,
    "override": _override,
    "release": _release,
    "start": _start,
    "expect": _expect,
}
