"""Verbs about skills: ``skills`` lists them, ``skills add`` drafts one without code."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from florence_bt.cli.common import EXIT_CODES, FolderOption, RosGroup, RosVerb, VerbList, app, tell
from florence_bt.cli.output_paths import OUTPUT_FILE

skills = VerbList(cls=RosGroup, help="List the skills that missions can use, or draft one without code.")
app.add_typer(skills, name="skills", rich_help_panel="Mission files")

_WAYS = ("action", "service", "condition", "wait-for", "publish")


@skills.callback(
    invoke_without_command=True,
    epilog=f"Example: florence skills --show turn --show say\n\n{EXIT_CODES}",
)
def list_all(
    context: typer.Context,
    show: Annotated[
        list[str] | None, typer.Option(help="A skill to tell everything about; can be repeated.")
    ] = None,
    folders: FolderOption = None,
    live: Annotated[
        bool, typer.Option("--live", help="Tell whether the server of each skill is there now.")
    ] = False,
) -> None:
    """List the skills that missions can use, or draft one without code."""
    if context.invoked_subcommand is not None:
        return
    from florence_bt.app.mission_files.skill_list import list_skills

    ask = None
    if live:
        from florence_bt.app.mission_files.live_skills import servers_now

        ask = servers_now
    known, wrong = list_skills(show or (), folders or [], ask)
    tell(known)
    if wrong:
        typer.echo(wrong, err=True)


@skills.command(
    cls=RosVerb,
    epilog="Example: florence skills add action tb4/drive_to nav2_msgs/action/NavigateToPose "
    f"--file missions/robot.skills.yaml\n\n{EXIT_CODES}",
)
def add(
    way: Annotated[
        str | None, typer.Argument(metavar="[WAY]", help=f"How it is served: {', '.join(_WAYS)}.")
    ] = None,
    name: Annotated[
        str | None, typer.Argument(metavar="[NAME]", help="The name of the action, service or topic.")
    ] = None,
    interface: Annotated[
        str | None,
        typer.Argument(metavar="[TYPE]", help="Its type; that of the running system when not given."),
    ] = None,
    skill: Annotated[str, typer.Option(help="The name of the skill.", show_default="made of NAME")] = "",
    file: Annotated[
        Path | None,
        typer.Option(
            click_type=OUTPUT_FILE, help="The file of skills it is added to.", show_default="the terminal"
        ),
    ] = None,
    all_below: Annotated[
        str | None,
        typer.Option("--all", metavar="NAMESPACE", help="Draft all that the running robot offers there."),
    ] = None,
) -> None:
    """Draft a skill without code from the type of its action, service or topic; then edit it.

    Without WAY and NAME it lists what the running system has to offer, each line ready to follow "add".
    """
    if all_below is not None:
        if way is not None or skill:
            raise typer.BadParameter("--all drafts every skill of a robot: without WAY, NAME and --skill")
        _add_all(all_below, file)
        return
    from florence_bt.app.mission_files.skill_draft import add_to_file, draft_skill
    from florence_bt.core.errors import ConfigError, closest_first

    if way is None or name is None:
        from florence_bt.app.mission_files.live_skills import offered

        lines = [str(offer) for offer in offered() if way in (None, offer.way)]
        typer.echo("\n".join(lines) or "nothing was found: no other node runs in this ROS domain")
        return
    if way.replace("_", "-") not in _WAYS:
        raise ConfigError(f"a skill is not served by {way!r}", valid=closest_first(way, _WAYS))
    way = way.replace("-", "_")
    latched = False
    if interface is None:
        from florence_bt.app.mission_files.live_skills import type_in_graph

        interface, latched = type_in_graph(way, name)
    draft = draft_skill(way, name, interface, skill, latched=latched)
    if file is None:
        typer.echo(f"skills:\n{draft.entry}", nl=False)
        return
    add_to_file(file, draft)
    typer.echo("".join(f"  {each}\n" for each in draft.left_out), nl=False)
    typer.echo(f"{file}: the skill {draft.skill} was added; edit it, then: florence check {file}")


def _add_all(below: str, file: Path | None) -> None:
    from florence_bt.app.mission_files.live_skills import offered
    from florence_bt.app.mission_files.skill_draft import add_to_file, draft_all, skills_of

    there = skills_of(file) if file is not None else {}
    served = {(mapping.way, mapping.name) for mapping in there.values() if mapping is not None}
    offers = [offer for offer in offered() if (offer.way, offer.name) not in served]
    drafts, without = draft_all(offers, below, there)
    if file is None:
        typer.echo("skills:\n" + "\n".join(draft.entry for draft in drafts), nl=False)
    else:
        for draft in drafts:
            add_to_file(file, draft)
        typer.echo(f"{file}: {len(drafts)} skills were added; edit them, then: florence check {file}")
    for line in without:
        typer.echo(f"# no skill: {line}", err=file is None)
