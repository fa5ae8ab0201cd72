"""Action values of a DQN that was trained by Stable-Baselines3."""

# Stable-Baselines3 types some of what it has.
# pyright: basic

import warnings
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
from gymnasium import spaces

from qbumpers.errors import RequestError, checked
from qbumpers.experts.checking import ExpertWarning
from qbumpers.experts.episodes import play_several
from qbumpers.experts.normalisation import (
    Normalisation,
    normalisation_of,
    training_of,
)
from qbumpers.experts.unreadable import why_unreadable
from qbumpers.networks.network import Network
from qbumpers.tasks.task import Task
from qbumpers.tasks.wrapping import altering_wrappers
from qbumpers.values.network import NetworkValues

_EPISODES = 5  # by the values, and as many at random, in which they are held to the model's
_TOLERANCE = 1e-3  # of the largest value

_ACTIVATIONS = {"Tanh": "tanh", "ReLU": "relu"}


def from_stable_baselines(model: Any, task: Task, statistics: Any = None) -> NetworkValues:
    """Convert a DQN of Stable-Baselines3; its weights are copied.

    If it saw normalised observations, the statistics become part of the first layer. That is exact
    for observations that are not clipped, so episodes of the task are played to see whether any is.

    Args:
        model: a `stable_baselines3.DQN` with MlpPolicy, or the path of the zip file that its `save`
            wrote. Such files can hold code that runs when they are read: open none from strangers.
        task: that it was trained at.
        statistics: of normalised observations, a VecNormalize, the path of the file that its `save`
            wrote, or a NormalizeObservation of Gymnasium; those of the environment that the model
            was trained in if None.

    Returns:
        The values, with the discount that the model was trained with.

    Raises:
        RequestError: if Stable-Baselines3 is missing, the file is no DQN's, its network is not a
            plain one of tanh or rectified linear units, its spaces are not the task's, it was
            trained in wrappers that the task does not have, its rewards were normalised, or an
            observation of the task is clipped.

    Warns:
        ExpertWarning: if it is not known whether it saw normalised observations: a model's own file
            does not say so.
    """
    try:
        from stable_baselines3 import DQN
    except ImportError as error:
        raise RequestError(
            "models of Stable-Baselines3 need it installed: pip install 'qbumpers[sb3]'"
        ) from error
    where = "model"
    if isinstance(model, str | Path):
        where = f"model {model}"
        model = _loaded(DQN, Path(model))
    if not isinstance(model, DQN):
        raise RequestError(f"{where}: a {type(model).__name__}; a DQN is needed")
    normalisation = _normalisation(where, model, task, statistics)
    network, layers = _network(where, model.q_net)
    parameters = [
        array
        for layer in layers
        for array in (_numbers(layer.weight).T, _numbers(layer.bias))  # [inputs, outputs] here
    ]
    method = f"DQN of Stable-Baselines3, {model.num_timesteps} steps"
    if normalisation is not None:
        parameters[:2] = normalisation.folded(*parameters[:2])
        method += ", with the statistics of its observations"
    values = NetworkValues(
        network=network,
        inputs=task.observation_size,
        actions=task.actions,
        parameters=np.concatenate([array.ravel() for array in parameters]),
        discount=float(model.gamma),
        task=task.name,
        method=method,
        made_for=task.identity(),
    )
    if normalisation is not None:
        _check_folded(where, model, task, normalisation, values)
    return values


def _normalisation(where: str, model: Any, task: Task, statistics: Any) -> Normalisation | None:
    """What happened to observations before the network saw them, the spaces checked."""
    with closing(task.make_environment()) as environment:
        space = environment.observation_space
        own = [type(layer).__name__ for layer in altering_wrappers(environment)]
    _check_sizes(where, model, task)
    training = training_of(model, own, where)
    if training.statistics is None and statistics is None and not training.known:
        warnings.warn(
            f"{where}: it is not known whether it saw normalised observations or rewards: "
            "VecNormalize keeps that in a file of its own; if it did, give that file as statistics",
            ExpertWarning,
            stacklevel=3,
        )
    normalisation = None
    for each in (training.statistics, statistics):
        normalisation = normalisation if each is None else normalisation_of(each, where)
    if normalisation is not None and normalisation.mean.shape != (task.observation_size,):
        raise RequestError(
            f"{where}: its statistics are of observations {normalisation.mean.shape}; "
            f"({task.observation_size},) is needed"
        )
    if normalisation is None or np.isfinite(normalisation.clip):  # it leaves the bounds as they are
        _check_bounds(where, model, task, space)
    return normalisation


def _check_folded(
    where: str, model: Any, task: Task, normalisation: Normalisation, values: NetworkValues
) -> None:
    """Hold values to the model's in episodes of the task; RequestError if any differs."""
    import torch

    played = [
        episode
        for chance in (0.0, 1.0)
        for episode in play_several(task, values, _EPISODES, epsilon=chance)
    ]
    observations = np.concatenate([episode.observations for episode in played])
    seen = normalisation.normalised(observations)
    clipped = np.abs(seen) > normalisation.clip
    if clipped.any():
        raise RequestError(
            f"{where}: VecNormalize clipped what it saw at {normalisation.clip:g}, and "
            f"{clipped.any(axis=1).mean():.2%} of {len(seen):,} observations of task {task.name} "
            f"lie beyond, most often in number {int(clipped.sum(axis=0).argmax())}: no network of "
            "this kind clips its inputs, so values would differ there"
        )
    with torch.no_grad():
        expected = model.q_net(torch.as_tensor(seen.astype(np.float32))).cpu().numpy()
    error = float(np.abs(values(observations) - expected).max())
    if error > _TOLERANCE * max(1.0, float(np.abs(expected).max())):
        raise RequestError(
            f"{where}: with its statistics in the first layer its values differ by {error:g}: some "
            "spread is too small beside its mean for numbers of 32 bits"
        )


def _loaded(kind: Any, path: Path) -> Any:
    """A model from its file; every algorithm's looks alike until its network is put together."""
    if not path.is_file():
        raise RequestError(f"model {path}: there is no such file")
    try:
        return kind.load(path, device="cpu")
    except Exception as error:  # reading a pickle can raise anything
        raise RequestError(f"model {why_unreadable(path, error)}") from error


def _check_sizes(where: str, model: Any, task: Task) -> None:
    seen, done = model.observation_space, model.action_space
    suits = (
        isinstance(seen, spaces.Box)
        and seen.shape == (task.observation_size,)
        and isinstance(done, spaces.Discrete)
        and int(done.n) == task.actions
    )
    if not suits:
        raise RequestError(
            f"{where}: it sees {seen} and does {done}; task {task.name} shows vectors of "
            f"{task.observation_size} numbers and has {task.actions} actions"
        )


def _check_bounds(where: str, model: Any, task: Task, shown: Any) -> None:
    """RequestError if a model saw observations of other bounds than a task's environment shows."""
    seen = model.observation_space
    if not (np.allclose(seen.low, shown.low) and np.allclose(seen.high, shown.high)):
        raise RequestError(
            f"{where}: it was trained on observations in {seen}, and task {task.name} shows them "
            f"in {shown}: they were changed on the way, by a wrapper perhaps"
        )


def _network(where: str, q_net: Any) -> tuple[Network, list[Any]]:
    """Shape and linear layers of a model's network."""
    modules = list(q_net.q_net)
    kinds = [type(module).__name__ for module in modules]
    extractor = type(q_net.features_extractor).__name__
    used = set(kinds[1::2])
    plain = extractor == "FlattenExtractor" and set(kinds[::2]) == {"Linear"}
    if not plain or len(used) > 1 or not used <= set(_ACTIVATIONS):
        raise RequestError(
            f"{where}: its network is {extractor}, {', '.join(kinds)}; MlpPolicy with layers of "
            f"{' or '.join(_ACTIVATIONS)} is needed"
        )
    layers = modules[::2]
    shape = {
        "hidden": tuple(layer.out_features for layer in layers[:-1]),
        "activation": _ACTIVATIONS[used.pop()] if used else "tanh",
    }
    return checked(Network, shape, where), layers


def _numbers(parameter: Any) -> np.ndarray:
    return parameter.detach().cpu().numpy()
