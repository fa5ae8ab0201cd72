"""Commands of `qbumpers study` for studies with participants."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.markup import escape

from qbumpers.cli.console import OUTPUT
from qbumpers.cli.study import check_installed, study
from qbumpers.errors import counted

if TYPE_CHECKING:
    from qbumpers.study.design.models import Study

File = Annotated[Path, typer.Argument(help="The study file.", metavar="STUDY.toml")]


def _say(text: str) -> None:
    OUTPUT.print(escape(text), soft_wrap=True)


@study.command("new")
def new_study(file: File) -> None:
    """Write a study file to begin with, with comments.

    Example: qbumpers study new my-study.toml
    """
    check_installed()
    from qbumpers.study.design.sources import write_new

    write_new(file)
    _say(f"{file} is written: change it, then: qbumpers study check {file}")


@study.command("check")
def check_study(file: File) -> None:
    """Check a study file, and say what it comes to.

    Example: qbumpers study check my-study.toml
    """
    check_installed()
    from qbumpers.study.design.sources import check_playable, load_study

    design = load_study(file)
    check_playable(design)
    for line in _described(design):
        _say(line)
    _say("OK")


def _described(design: "Study") -> list[str]:
    """What a study comes to, a line each."""
    from qbumpers.study.design.parts import Block, Sitting

    conditions = [condition.name for condition in design.all_conditions()]
    blocks = [
        f"{part.id} ({counted(len(part.plan()), 'episode')})"
        for part in design.parts
        if isinstance(part, Block)
    ]
    sittings = 1 + sum(isinstance(part, Sitting) for part in design.parts)
    return [
        f"{design.name}: {design.title}",
        f"parts: {', '.join(part.id for part in design.parts)}",
        f"sittings: {sittings}; blocks: {', '.join(blocks)}",
        f"{counted(len(conditions), 'condition')}: {', '.join(conditions)}",
        f"{counted(len(design.orders()), 'order')} of parts",
    ]
