"""Deleting a participant from the records and from every export that is known."""

import shutil
from collections.abc import Mapping
from pathlib import Path

import sqlalchemy as sql

from qbumpers.analysis.report import FIGURES, REPORT, SUMMARY, TRIALS
from qbumpers.errors import RequestError
from qbumpers.play.setup import Setup
from qbumpers.study.design.models import Study
from qbumpers.study.flow.forgetting import delete_participant
from qbumpers.study.flow.tables import EXPORTS, identity_of, participants_in
from qbumpers.study.outcomes.export import export_study


def forget(engine: sql.Engine, study: Study, setups: Mapping[str, Setup], who: str) -> list[Path]:
    """Delete everything of a participant, and write every export that is known anew.

    Reports in those folders are deleted: their numbers had the participant's data.

    Args:
        engine: as `open_records` gave it.
        study: whose records they are.
        setups: what is played in each block, by its id.
        who: the identifier of the participant, or their identity to the recruitment.

    Returns:
        Folders of exports that were written anew.

    Raises:
        RequestError: if there is no such participant.
    """
    participant = identity_of(engine, who) or who
    if not delete_participant(engine, participant, "forgotten"):
        raise RequestError(f"participant {who!r}: the records have none of that name")
    with engine.connect() as connection:
        folders = [Path(row.folder) for row in connection.execute(sql.select(EXPORTS))]
    reached = [folder for folder in folders if folder.is_dir()]
    for folder in reached:
        _clear(folder)
        if participants_in(engine):
            export_study(engine, study, setups, folder)
    return reached


def _clear(folder: Path) -> None:
    """What was derived from the data of all."""
    for name in (REPORT, SUMMARY, TRIALS, *(path.name for path in folder.glob("*.csv"))):
        (folder / name).unlink(missing_ok=True)
    for path in folder.glob("*.parquet"):
        path.unlink()
    shutil.rmtree(folder / FIGURES, ignore_errors=True)
    shutil.rmtree(folder / "dataset", ignore_errors=True)
