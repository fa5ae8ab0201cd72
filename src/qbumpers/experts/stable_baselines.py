"""Action values of a DQN that was trained by Stable-Baselines3."""

from pathlib import Path
from typing import Any

import numpy as np
from gymnasium import spaces

from qbumpers.errors import RequestError, checked
from qbumpers.experts.unreadable import why_unreadable
from qbumpers.networks.network import Network
from qbumpers.tasks.task import Task
from qbumpers.values.network import NetworkValues

_ACTIVATIONS = {"Tanh": "tanh", "ReLU": "relu"}


def from_stable_baselines(model: Any, task: Task) -> NetworkValues:
    """Convert a DQN of Stable-Baselines3; its weights are copied.

    Args:
        model: a `stable_baselines3.DQN` with MlpPolicy, or the path of the zip file that its `save`
            wrote. Such files can hold code that runs when they are read: open none from strangers.
        task: that it was trained at.

    Returns:
        The values, with the discount that the model was trained with.

    Raises:
        RequestError: if Stable-Baselines3 is missing, the file is no DQN's, its network is not a
            plain one of tanh or rectified linear units, or its spaces are not the task's.
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
    _check_spaces(where, model, task)
    network, layers = _network(where, model.q_net)
    parameters = [
        array
        for layer in layers
        for array in (_numbers(layer.weight).T, _numbers(layer.bias))  # [inputs, outputs] here
    ]
    return NetworkValues(
        network=network,
        inputs=task.observation_size,
        actions=task.actions,
        parameters=np.concatenate([array.ravel() for array in parameters]),
        discount=float(model.gamma),
        task=task.name,
        method=f"DQN of Stable-Baselines3, {model.num_timesteps} steps",
    )


def _loaded(kind: Any, path: Path) -> Any:
    """A model from its file; every algorithm's looks alike until its network is put together."""
    if not path.is_file():
        raise RequestError(f"model {path}: there is no such file")
    try:
        return kind.load(path, device="cpu")
    except Exception as error:  # reading a pickle can raise anything
        raise RequestError(f"model {why_unreadable(path, error)}") from error


def _check_spaces(where: str, model: Any, task: Task) -> None:
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
