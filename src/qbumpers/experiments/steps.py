"""Tables of recorded steps as files: Parquet that this package writes, and Minari datasets."""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from qbumpers.decisions import Step
from qbumpers.errors import RequestError, in_short
from qbumpers.experiments.design import PARTICIPANT
from qbumpers.experiments.recordings import INFOS
from qbumpers.tasks.dynamics import TERMINATED, TRUNCATED


def save_steps(path: str | Path, participants: Mapping[str, Step]) -> None:
    """Write the steps of participants or simulated learners to a Parquet file.

    A row per step: the participant, and the fields of `qbumpers.Step`. States and actions are
    counted from 0.

    Args:
        path: of the file, which is overwritten.
        participants: a table of steps of numbered states for each name.

    Raises:
        RequestError: if there is nobody, or states are vectors.
    """
    if not participants:
        raise RequestError("participants = {}; at least one is needed")
    for name, steps in participants.items():
        _check_numbered(steps.state, f"participant {name}")
    step_table(participants).write_parquet(path)


def steps_of(log: Iterable[Step]) -> Step:
    """The steps of a session as a table, for `save_steps` and `qbumpers.fitting.fit`.

    Args:
        log: what `Session.record` returned, step by step.

    Returns:
        A table of steps: arrays in the place of each field.

    Raises:
        RequestError: if there is no step.
    """
    steps = list(log)
    if not steps:
        raise RequestError("log = []; at least one step is needed")
    return Step(*(np.array(column) for column in zip(*steps, strict=True)))


def step_table(participants: Mapping[str, Step]) -> pl.DataFrame:
    """A row per step: the participant, and the fields of `qbumpers.Step`.

    Args:
        participants: a table of steps for each name, at least one; states may be vectors.
    """
    return pl.concat(
        pl.DataFrame({PARTICIPANT: [str(name)] * len(steps.episode), **_columns(steps)})
        for name, steps in participants.items()
    )


def _columns(steps: Step) -> dict[str, np.ndarray]:
    return {name: np.asarray(column) for name, column in steps._asdict().items()}


def load_steps(source: str | Path) -> dict[str, Step]:
    """Recorded steps of numbered states, by participant.

    Args:
        source: a Parquet file of `save_steps`; or a Minari dataset of `export_recording`, its name
            or its folder. A dataset does not say where undone steps had led: `next_state` is then
            the state before them.

    Returns:
        A table of steps for each participant, states and actions counted from 0.

    Raises:
        RequestError: if there is no such file or dataset, it lacks a column, or states are vectors.
    """
    if Path(source).suffix == ".parquet":
        return _from_parquet(Path(source))
    return _from_minari(source)


def _from_parquet(path: Path) -> dict[str, Step]:
    if not path.is_file():
        raise RequestError(f"steps = {str(path)!r}: there is no such file")
    try:
        table = pl.read_parquet(path)
    except (OSError, pl.exceptions.PolarsError) as error:
        raise RequestError(f"steps = {str(path)!r}: not a readable Parquet file") from error
    missing = [name for name in (PARTICIPANT, *Step._fields) if name not in table.columns]
    if missing:
        raise RequestError(f"steps = {str(path)!r}: it has no column {', '.join(missing)}")
    _check_numbered(table["state"], f"steps = {str(path)!r}")
    return {
        str(part[PARTICIPANT][0]): Step(*(part[field].to_numpy() for field in Step._fields))
        for part in table.partition_by(PARTICIPANT, maintain_order=True)
    }


def _check_numbered(states: Any, where: str) -> None:
    found = states if isinstance(states, pl.Series) else np.asarray(states)
    whole = found.dtype.is_integer() if isinstance(found, pl.Series) else found.dtype.kind in "iu"
    if not (whole and found.shape == found.shape[:1]):
        raise RequestError(f"{where}: states are not numbered; vectors cannot be fitted")


def _from_minari(source: str | Path) -> dict[str, Step]:
    dataset = _dataset(source)
    states, actions = dataset.observation_space, dataset.action_space
    if not {"n", "start"} <= {*vars(states)}:
        raise RequestError(
            f"steps = {str(source)!r}: states are not numbered; vectors cannot be fitted"
        )
    parts: dict[str, list[Step]] = {}
    for episode in dataset.iterate_episodes():
        missing = {*INFOS, "trial", "episode"} - {*(episode.infos or {})}
        if missing:
            raise RequestError(
                f"steps = {str(source)!r}: its infos have no {', '.join(sorted(missing))}; a "
                "dataset of export_recording is needed"
            )
        name = str(int(episode.infos["trial"][0]))
        parts.setdefault(name, []).append(
            _episode_of(episode, int(states.start), int(actions.start))
        )
    return {name: _joined(episodes) for name, episodes in parts.items()}


def _dataset(source: str | Path) -> Any:
    try:
        import minari
    except ImportError as error:
        raise RequestError("Minari is not installed: pip install 'qbumpers[minari]'") from error
    try:
        if Path(source).is_dir():
            return minari.MinariDataset(Path(source) / "data")
        return minari.load_dataset(str(source))
    except (OSError, ValueError, KeyError) as error:
        raise RequestError(
            f"steps = {in_short(str(source))}: neither a Parquet file nor a Minari dataset that is "
            "here"
        ) from error


def _episode_of(episode: Any, first_state: int, first_action: int) -> Step:
    infos = {name: np.asarray(episode.infos[name])[1:] for name in INFOS}
    observations = np.asarray(episode.observations) - first_state
    events = TERMINATED * np.asarray(episode.terminations) + TRUNCATED * np.asarray(
        episode.truncations
    )
    credited = infos.pop("credited")
    return Step(
        **{
            **infos,
            "episode": np.asarray(episode.infos["episode"])[1:],
            "state": observations[:-1],
            "next_state": observations[1:],
            "proposed": infos["proposed"] - first_action,
            "executed": np.asarray(episode.actions) - first_action,
            "credited": np.where(credited < 0, -1, credited - first_action),
            "reward": np.asarray(episode.rewards),
            "events": events.astype(np.uint8),
        }
    )


def _joined(episodes: Iterable[Step]) -> Step:
    return Step(*(np.concatenate(columns) for columns in zip(*episodes, strict=True)))
