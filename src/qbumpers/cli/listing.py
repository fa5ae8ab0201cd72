"""`qbumpers list`."""

from typing import Annotated, Any

import typer
from rich.table import Table

from qbumpers.cli.application import application
from qbumpers.cli.console import OUTPUT, table
from qbumpers.errors import unknown_name


@application.command("list")
def list_names(
    what: Annotated[
        str, typer.Argument(help="What to list.", metavar="assistants|tasks|learners")
    ] = "assistants",
) -> None:
    """List what experiments can name."""
    listings = {"assistants": _list_assistants, "tasks": _list_tasks, "learners": _list_learners}
    if what not in listings:
        raise unknown_name("list", what, listings)
    OUTPUT.print(listings[what]())


def _list_assistants() -> Table:
    from qbumpers.assistants import assistants

    listing = table("assistant", "options (with defaults)", "what it does")
    for name, rule in assistants().items():
        defaults: dict[str, Any] = rule.options_type._field_defaults  # type: ignore[attr-defined]
        fields: tuple[str, ...] = rule.options_type._fields  # type: ignore[attr-defined]
        options = [f"{f} = {str(defaults[f]).lower()}" if f in defaults else f for f in fields]
        listing.add_row(name, ", ".join(options), _first_line(rule.decide))
    return listing


def _list_tasks() -> Table:
    from qbumpers.tasks.registry import tabular_environments, task_names, vector_environments

    listing = table("task", "what it is")
    for name in task_names():
        listing.add_row(name, "a task of this package")
    for name in tabular_environments():
        listing.add_row(name, "a Gymnasium environment with a transition table; give a discount")
    for name in vector_environments():
        listing.add_row(name, "a Gymnasium environment observed as a vector; give a discount")
    return listing


def _list_learners() -> Table:
    from qbumpers.experiments.learner_designs import LEARNERS
    from qbumpers.learners import PERCEPTIONS

    listing = table("learner", "perception", "credits when overridden", "penalised")
    for learner in LEARNERS:
        for name, perception in PERCEPTIONS.items():
            credited = "its own action" if perception.credits_proposed else "the executed action"
            if not perception.learns_when_overridden:
                credited = "nothing"
            listing.add_row(learner, name, credited, "yes" if perception.penalised else "no")
    listing.caption = (
        "Tasks with a transition table are learned by q-learning, tasks observed as vectors by "
        "double-dqn."
    )
    return listing


def _first_line(function: Any) -> str:
    return (function.__doc__ or "").strip().split("\n")[0]
