"""Writes a way through a mission as a scenario, which ``florence test`` plays and which fails there."""

from __future__ import annotations

import tempfile
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from florence_bt.assurance.problems import Problem
from florence_bt.assurance.replay import A_MOMENT_S, Call, Replayed, replay
from florence_bt.assurance.skills import witness_result
from florence_bt.assurance.values import Values, find_values, known
from florence_bt.assurance.verifier import Explored
from florence_bt.core.declaration import Kind, Port, SkillDeclaration
from florence_bt.core.errors import ConfigError
from florence_bt.core.file_sets import replace_files
from florence_bt.core.geometry import Pose2
from florence_bt.mission_testing.scenarios.scenario import run_scenario
from florence_bt.mission_testing.scenarios.scenario_file import Libraries, read_scenarios
from florence_bt.trees.language.analysis import skills_used_by
from florence_bt.trees.language.model import Mission
from florence_bt.trees.language.quantities import format_value


def write_scenario(explored: Explored, problem: Problem, file: Path) -> bool:
    """Write the way to a problem as a scenario, if one shows it.

    Args:
        explored: The mission.
        problem: What does not hold.
        file: The file that is written.

    Returns:
        Whether the file was written: a scenario goes the same way and fails there.
    """
    text = scenario_text(explored, problem, file)
    if text is None:
        return False
    with tempfile.TemporaryDirectory(prefix="florence_verify_") as scratch:
        tried = Path(scratch) / file.name
        tried.write_text(text, encoding="utf-8")
        if not _fails_there(tried, replay(explored, problem.path)):
            return False
    replace_files({file: text.encode()}, make_folders=True)
    return True


def scenario_text(explored: Explored, problem: Problem, file: Path) -> str | None:
    """Return the scenario, None when nothing can be expected of it or no values are found."""
    played = replay(explored, problem.path)
    expected = _expected(explored, problem, played)
    values = find_values(played.decided, values_of(played)) if expected is not None else None
    if expected is None or values is None:
        return None
    declarations = explored.world.declarations
    own = scripts_of(played.calls, declarations, values)
    rest = scripts_of_others(explored.mission, played, declarations)
    lines = [
        f"# Written by florence verify: {problem.text}.",
        f"mission: {explored.mission.name}",
        f"missions: [{quoted(str(explored.mission.file.resolve().parent))}]",
        "given:",
        *_inputs(explored, played, values),
        "  skills:",
        *(f"    {name}: {quoted(script)}" for name, script in {**rest, **own}.items()),
        "scenarios:",
        f"  - name: {quoted(problem.text)}",
        *_when(played),
        f"    then: {expected}",
    ]
    return "\n".join(lines) + "\n"


def _fails_there(file: Path, played: Replayed) -> bool:
    """Tell whether the scenarios of a file can be read, go the way of a replay, and fail."""
    try:
        read = read_scenarios(file, Libraries())
    except ConfigError:
        return False
    if read.findings or not read.scenarios:
        return False
    result = run_scenario(read.scenarios[0])
    if result.passed or not result.runs:
        return False
    wanted = [call.skill for call in played.calls if call.skill != "finally"]
    return result.runs[0].order[: len(wanted)] == wanted and not any(
        "mock" in text for _, text in result.problems
    )


def values_of(played: Replayed) -> Iterator[Any]:
    """Yield the values that came up on a way: inputs, and what skills gave."""
    yield from played.inputs.values()
    for call in played.calls:
        if call.result is not None:
            yield from call.result.outputs.values()


# ---- given ------------------------------------------------------------------------------------------------


def _inputs(explored: Explored, played: Replayed, values: Values) -> list[str]:
    given = inputs_of(explored.mission, played, values)
    pairs = ", ".join(f"{name}: {quoted(text)}" for name, text in given.items())
    return [f"  inputs: {{{pairs}}}"] if given else []


def inputs_of(mission: Mission, played: Replayed, values: Values) -> dict[str, str]:
    """Return the inputs of a way as a scenario has them, without those that are as the mission has them."""
    given = {name: (known(value, values), mission.inputs[name]) for name, value in played.inputs.items()}
    return {
        name: written(value, port)
        for name, (value, port) in given.items()
        if port.required or value != port.default
    }


def written(value: Any, port: Port) -> str:
    """Write a value as it stands in a scenario."""
    if isinstance(value, Pose2):
        return _pose(value)
    if isinstance(value, tuple):
        item = Port(port.kind.item or Kind.TEXT, "")
        return f"[{', '.join(written(each, item) for each in value)}]"
    if port.kind is Kind.TEXT:
        return str(value)
    return format_value(value, port.kind)


def _pose(value: Pose2) -> str:
    text = format_value(value, Kind.POSE)
    x, y, yaw = (part.split(": ")[1] for part in text.strip("{}").split(", "))
    return f"({x}, {y}, {yaw})"


def scripts_of(
    calls: Iterable[Call], declarations: Mapping[str, SkillDeclaration], values: Values
) -> dict[str, str]:
    """Return the scripts of the skills, whose calls answer one after the other."""
    steps: dict[str, list[str]] = {}
    for call in calls:
        if call.skill != "finally":
            step = _step(call, declarations[call.skill], values)
            steps.setdefault(call.skill, []).append(step)
    return {skill: ", then ".join(_shortened(each)) for skill, each in steps.items()}


def _shortened(steps: list[str]) -> list[str]:
    """Write each step for one call, and the last one for all that follow, which are like it."""
    while len(steps) > 1 and steps[-1] == steps[-2]:
        steps = steps[:-1]
    return [f"{step} once" for step in steps[:-1]] + steps[-1:]


def _step(call: Call, declaration: SkillDeclaration, values: Values) -> str:
    if (
        call.ended is None
        or call.result is None
        or (call.result.code == "timed_out" and _is_late(call, declaration))
    ):
        return "never ends"
    takes = f"running {max(A_MOMENT_S / 10.0, call.ended - call.began):g} s, then "
    return ("" if declaration.instant else takes) + _ending(call.result, declaration, values)


def _is_late(call: Call, declaration: SkillDeclaration) -> bool:
    return call.ended is not None and call.ended - call.began >= declaration.deadline_s - 1e-3


def _ending(result: Any, declaration: SkillDeclaration, values: Values) -> str:
    if not result.succeeded:
        return f"FAILURE {result.code}"
    given = [
        f"{name}={written(known(value, values), declaration.outputs[name])}"
        for name, value in result.outputs.items()
    ]
    return f"SUCCESS ({', '.join(given)})" if given else "SUCCESS"


def scripts_of_others(
    mission: Mission, played: Replayed, declarations: Mapping[str, SkillDeclaration]
) -> dict[str, str]:
    """Return scripts for the skills that the way does not use, and the mission may use afterwards."""
    used = {call.skill for call in played.calls}
    skills = skills_used_by(mission) - used
    return {
        skill: _ending(witness_result(declarations[skill]), declarations[skill], {})
        for skill in sorted(skills)
        if skill in declarations
    }


# ---- when, then -------------------------------------------------------------------------------------------


def _when(played: Replayed) -> list[str]:
    if not played.stops:
        return []
    when, how = played.stops[0]
    return ["    when:", f"      - at: {when:g} s", f"        {how}: requested by florence verify"]


def _expected(explored: Explored, problem: Problem, played: Replayed) -> str | None:
    """Return what the scenario expects, and does not find; None: there is no way to say it."""
    match problem.kind:
        case "left_on":
            return _switched_off(problem.about, played, skills_used_by(explored.mission))
        case "endless" | "endless_retry" | "stuck":
            return "{status: SUCCEEDED}"
        case "no_output":
            port = explored.mission.outputs[problem.about]
            result = witness_result(SkillDeclaration("", "", outputs={"it": port})).outputs["it"]
            return f"{{outputs: {{{problem.about}: {quoted(written(result, port))}}}}}"
        case "never":
            return "{status: SUCCEEDED}" if problem.about == "it" else f"{{not_called: {problem.about}}}"
        case "at_most":
            skill, most = problem.about.split()
            return f"{{called: {{{skill}: {most}}}}}"
        case "after" | "always_before":
            first, then = problem.about.split()
            return f"{{calls: [{first}, {then}]}}" if "it" not in (first, then) else None
        case "unforeseen_code":
            return "{status: SUCCEEDED}"
        case "missing_key" | "bad_expression" | "bad_input" | "bad_output":
            return f"{{nodes: {{{quoted('/' + problem.about)}: SUCCESS}}}}"
    return None


def _switched_off(thing: str, played: Replayed, used: set[str]) -> str | None:
    if thing == "speed_limit":
        calls = [call for call in played.calls if call.skill == "set_speed_limit"]
        return "{calls: [" + "set_speed_limit, " * len(calls) + "set_speed_limit]}" if calls else None
    own = [call.skill for call in played.calls if call.skill in (f"start_{thing}", f"stop_{thing}")]
    if not own or own[-1] != f"start_{thing}":
        return None  # a mission that is called has switched it on
    if f"stop_{thing}" not in used:
        return f"{{not_called: start_{thing}}}"  # nothing of the mission could end it
    return f"{{calls: [{', '.join([*own, f'stop_{thing}'])}]}}"


def quoted(text: str) -> str:
    """Put a text in quotes of YAML."""
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'
