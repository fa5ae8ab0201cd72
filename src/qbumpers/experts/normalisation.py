"""Observations that a model saw normalised: the statistics become part of its network."""

import pickle
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from gymnasium.wrappers import NormalizeObservation

from qbumpers.errors import RequestError
from qbumpers.tasks.wrapping import altering_wrappers

_FILE_ERRORS = (
    OSError, pickle.UnpicklingError, EOFError, AttributeError, ImportError, IndexError, KeyError,
    TypeError, ValueError,
)  # fmt: skip


class Normalisation(NamedTuple):
    """How observations were normalised: (observation - mean) / spread, clipped.

    Attributes:
        mean: float64 [D].
        spread: float64 [D].
        clip: the largest size of a normalised number; infinite if none is clipped.
    """

    mean: np.ndarray
    spread: np.ndarray
    clip: float

    def normalised(self, observations: np.ndarray) -> np.ndarray:
        """Observations [N, D] before they are clipped, float64."""
        return (observations - self.mean) / self.spread

    def folded(self, weight: np.ndarray, bias: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """A first layer that takes observations as they are.

        Args:
            weight: of the layer that takes normalised ones, [D, U].
            bias: of it, [U].

        Returns:
            Weight and bias; the layer gives the same for all observations that are not clipped.
        """
        scaled = np.asarray(weight, np.float64) / self.spread[:, None]
        return scaled, bias - self.mean @ scaled


def normalisation_of(statistics: Any, where: str) -> Normalisation | None:
    """What statistics of a training do to observations.

    Args:
        statistics: a VecNormalize of Stable-Baselines3, the path of the file that its `save` wrote
            (such files can hold code that runs when they are read), or a NormalizeObservation of
            Gymnasium.
        where: for messages.

    Returns:
        The normalisation; None if observations were left as they are.

    Raises:
        RequestError: if it is nothing of the kind, or rewards were normalised: values would not be
            in units of reward, and rules add them to rewards.
    """
    from stable_baselines3.common.vec_env import VecNormalize

    if isinstance(statistics, str | Path):
        where = f"{where}: statistics {statistics}"
        statistics = _loaded(Path(statistics), where)
    if isinstance(statistics, NormalizeObservation):
        return _normalisation(statistics, np.inf, where)
    if not isinstance(statistics, VecNormalize):
        raise RequestError(
            f"{where}: a {type(statistics).__name__} holds no statistics; a VecNormalize of "
            "Stable-Baselines3, its file, or a NormalizeObservation of Gymnasium is needed"
        )
    if statistics.norm_reward:
        raise RequestError(
            f"{where}: its rewards were normalised (VecNormalize with norm_reward=True), so its "
            "values are not in units of reward, as rules need them that add values to rewards; "
            "train it with norm_reward=False"
        )
    return _normalisation(statistics, statistics.clip_obs, where) if statistics.norm_obs else None


def _loaded(path: Path, where: str) -> Any:
    try:
        return pickle.loads(path.read_bytes())
    except _FILE_ERRORS as error:
        reason = str(error).partition("\n")[0]
        raise RequestError(f"{where}: not a file of VecNormalize ({reason})") from error


def _normalisation(holder: Any, clip: float, where: str) -> Normalisation:
    if isinstance(holder.obs_rms, dict):
        raise RequestError(f"{where}: it has statistics of several observations; one is needed")
    mean, variance = (np.asarray(each, np.float64) for each in (
        holder.obs_rms.mean, holder.obs_rms.var
    ))  # fmt: skip
    return Normalisation(mean, np.sqrt(variance + holder.epsilon), float(clip))


class Training(NamedTuple):
    """What is known of the environment that a model was trained in.

    Attributes:
        statistics: of normalised observations, as `normalisation_of` takes them; None if there are
            none.
        known: whether all of it could be looked at, and it is the one of the training.
    """

    statistics: Any
    known: bool


def training_of(model: Any, own: list[str], where: str) -> Training:
    """What is known of the environment that a model was trained in.

    Args:
        model: of Stable-Baselines3.
        own: names of the wrappers that the task itself has, from the outside in.
        where: for messages.

    Raises:
        RequestError: naming a wrapper whose effect cannot become part of a network.
    """
    from stable_baselines3.common import vec_env

    harmless = (vec_env.VecMonitor, vec_env.VecCheckNan, vec_env.VecVideoRecorder)
    found: list[Any] = []
    layer: Any = model.get_env()
    while isinstance(layer, vec_env.VecEnvWrapper):
        if isinstance(layer, vec_env.VecNormalize):
            found.append(layer)
        elif not isinstance(layer, harmless):
            raise _other_wrapper(type(layer).__name__, where)
        layer = layer.venv
    # Those in other processes cannot be looked at, nor those of a model from a file.
    environments = getattr(layer, "envs", [])
    for environment in environments:
        around = altering_wrappers(environment)
        if around and type(around[0]) is NormalizeObservation and len(environments) == 1:
            found.append(around.pop(0))
        names = [type(each).__name__ for each in around]
        if names != own:
            differing = sorted({*names} ^ {*own}) or names  # or only their order differs
            raise _other_wrapper(" and ".join(differing), where)
    if len(found) > 1:
        raise RequestError(f"{where}: its observations were normalised twice")
    # An environment that was given to a model from a file is not the one of its training.
    trained_there = model.num_timesteps == 0 or model.replay_buffer.size() > 0
    return Training(found[0] if found else None, bool(environments) and trained_there)


def _other_wrapper(name: str, where: str) -> RequestError:
    return RequestError(
        f"{where}: the environment that it was trained in and the task differ by wrapper {name}, "
        "which is no part of its network; make a task with the same wrappers, or train it without"
    )
