"""`qbumpers list`."""

import functools
from typing import Annotated, Any, cast

import gymnasium
import typer
from rich.table import Table

from qbumpers.cli.application import application
from qbumpers.cli.console import OUTPUT, table
from qbumpers.cli.working import Imports
from qbumpers.errors import unknown_name
from qbumpers.imports import import_modules


@application.command("list")
def list_names(
    what: Annotated[
        str, typer.Argument(help="What to list.", metavar="assistants|tasks|learners|perceptions")
    ] = "assistants",
    imports: Imports = None,
) -> None:
    """List what experiments can name."""
    listings = {
        "assistants": _list_assistants,
        "tasks": functools.partial(_list_tasks, set(gymnasium.registry)),
        "learners": _list_learners,
        "perceptions": _list_perceptions,
    }
    if what not in listings:
        raise unknown_name("list", what, listings)
    import_modules(imports or (), "--import")
    OUTPUT.print(listings[what]())


def _list_assistants() -> Table:
    from qbumpers.assistants import assistants

    listing = table("assistant", "options (with defaults)", "what it does")
    for name, rule in assistants().items():
        kind: Any = rule.options_type
        defaults: dict[str, Any] = kind._field_defaults
        fields: tuple[str, ...] = kind._fields
        options = [f"{f} = {str(defaults[f]).lower()}" if f in defaults else f for f in fields]
        listing.add_row(name, ", ".join(options), _first_line(rule.decide))
    return listing


def _list_tasks(before: set[str]) -> Table:
    from qbumpers.tasks.registry import (
        explanations,
        own_tasks,
        tabular_environments,
        vector_environments,
    )

    own = own_tasks()

    listing = table("task", "what it is")
    for name, explanation in explanations().items():
        listing.add_row(name, "a task of your own" if name in own else explanation)
    for name in tabular_environments():
        listing.add_row(name, "a Gymnasium environment with a transition table; give a discount")
    for name in vector_environments():
        listing.add_row(name, "a Gymnasium environment observed as a vector; give a discount")
    for name in sorted(set(gymnasium.registry) - before):
        listing.add_row(name, "an environment of an imported module; give a discount")
    return listing


def _list_learners() -> Table:
    from qbumpers.learners import learners

    listing = table("learner", "settings (with defaults)", "learns from", "what it does")
    for name, learner in sorted(learners().items()):
        kind: Any = learner.settings_type
        defaults: dict[str, Any] = kind._field_defaults
        settings = [f"{field} = {_short(value)}" for field, value in defaults.items()]
        observed = "numbered states" if learner.observes == "states" else "vectors"
        listing.add_row(name, ", ".join(settings), observed, _first_line(learner.settings_type))
    listing.caption = "What they believe about overrides: qbumpers list perceptions."
    return listing


def _list_perceptions() -> Table:
    from qbumpers.learners import PERCEPTIONS

    listing = table("perception", "notices overrides", "credits if it notices", "penalty")
    for name, perception in PERCEPTIONS.items():
        row = (f"{perception.notices:.0%}", perception.credits, f"{perception.penalty:g}")
        listing.add_row(name, *row)
    listing.caption = (
        "An override that is not noticed is taken for one's own doing: the proposed action is "
        "credited."
    )
    return listing


def _short(value: Any) -> str:
    if isinstance(value, tuple):
        return "(" + ", ".join(map(_short, cast("tuple[Any, ...]", value))) + ")"
    return str(value).lower()


def _first_line(function: Any) -> str:
    return (function.__doc__ or "").strip().split("\n")[0]
