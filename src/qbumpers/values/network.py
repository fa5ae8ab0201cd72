"""Action values from a network, with their provenance, in memory and in a file."""

import hashlib
import io
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

import qbumpers
from qbumpers.errors import RequestError, checked, counted
from qbumpers.files import write_atomically
from qbumpers.networks.network import Layout, Network, forward, named_parameters
from qbumpers.values.fitting import Use, check_made_for
from qbumpers.values.others import (
    arrays_of_others,
    check_others,
    digest_of_others,
    provenance_of_others,
)


@dataclass(frozen=True, eq=False)
class NetworkValues:
    """Q*(s, a) of a task whose observations are vectors, and where it comes from.

    Attributes:
        network: shape of the network.
        inputs: D, numbers of an observation.
        actions: A.
        parameters: float32 [P], laid out as `qbumpers.networks.network` says, read-only.
        discount: gamma of the values, in (0, 1].
        task: name of the task.
        method: how they were made, in words.
        version: which version of the package made them.
        others: further values by name, of networks of the same shape, for rules that ask for them.
        made_for: identity of the task that they were made for; empty if it is not known.

    Raises:
        RequestError: if the number of parameters does not suit the shape, one is not finite,
            the discount is out of range, or further values do not suit.
    """

    network: Network
    inputs: int
    actions: int
    parameters: np.ndarray
    discount: float
    task: str
    method: str
    version: str = qbumpers.__version__
    others: Mapping[str, "NetworkValues"] = field(default_factory=dict[str, "NetworkValues"])
    made_for: str = ""

    def __post_init__(self) -> None:
        """Check everything and freeze the parameters."""
        if not 0 < self.discount <= 1:
            raise RequestError(
                f"values of {self.task}: discount = {self.discount!r}; it must lie in (0, 1]"
            )
        parameters = np.array(self.parameters, np.float32)
        needed = self.layout.parameters()
        if parameters.shape != (needed,):
            raise RequestError(
                f"values of {self.task}: parameters have shape {parameters.shape}; a network of "
                f"{self.inputs} inputs, {self.network.hidden} units and {self.actions} actions "
                f"needs ({needed},)"
            )
        if not np.isfinite(parameters).all():
            raise RequestError(f"values of {self.task}: every parameter must be finite")
        parameters.flags.writeable = False
        object.__setattr__(self, "parameters", parameters)
        object.__setattr__(self, "others", dict(self.others))
        check_others(self, lambda values: values.layout)

    @cached_property
    def layout(self) -> Layout:
        """The network laid out."""
        return self.network.layout(self.inputs, self.actions)

    def __call__(self, observation: Any, /) -> np.ndarray:
        """Q*(s, .) as float64 [A] of an observation [D], or [N, A] of several [N, D]."""
        observations = np.asarray(observation, np.float32)
        if observations.shape[-1:] != (self.inputs,) or observations.ndim > 2:
            raise RequestError(
                f"values of {self.task}: an observation has shape {observations.shape}; "
                f"({self.inputs},) is needed"
            )
        states = observations.size // self.inputs
        workspace = np.zeros(self.layout.workspace(states), np.float32)
        workspace[: observations.size] = observations.ravel()
        values = forward(self.layout, self.parameters, workspace, states).astype(np.float64)
        return values[0] if observations.ndim == 1 else values

    def reordered(self, actions: Sequence[int]) -> "NetworkValues":
        """The same values with their actions in another order.

        Args:
            actions: [A], each once; action a has the values that action actions[a] has here.
        """
        parameters = self.parameters.copy()
        for name, numbers in named_parameters(self.layout, parameters).items():
            if name.startswith(("values.", "advantages.")):  # an output per action
                numbers[:] = numbers[..., list(actions)]
        others = {name: each.reordered(actions) for name, each in self.others.items()}
        return replace(self, parameters=parameters, others=others)

    def check_fit(self, use: Use) -> None:
        """Compare them with what they are put to.

        Args:
            use: what that is.

        Raises:
            RequestError: if their sizes or their kind differ, or they were made for something else.
        """
        if use.rows or (self.inputs, self.actions) != (use.inputs, use.actions):
            raise RequestError(
                f"values of {self.task}: a network of {counted(self.inputs, 'input')} and "
                f"{counted(self.actions, 'action')}; {use.name} needs {use.needs()}{use.advice}"
            )
        check_made_for(self, use)

    def digest(self) -> str:
        """A SHA-256 of shape, parameters and discount: equal for values that decide alike."""
        shape = json.dumps([*self.network, self.inputs, self.actions, self.discount])
        content = shape.encode() + self.parameters.tobytes() + digest_of_others(self.others)
        return hashlib.sha256(content).hexdigest()

    def save(self, path: str | Path) -> None:
        """Write a NumPy `.npz` file, atomically; `load_values` reads it back.

        Args:
            path: where the file goes.

        Raises:
            StoreError: if it cannot be written.
        """
        content = self.encoded()
        write_atomically(Path(path), lambda temporary: temporary.write_bytes(content))

    def encoded(self) -> bytes:
        """The values as the bytes of a NumPy `.npz` file."""
        provenance = json.dumps({**self.provenance(), "sha256": self.digest()})
        arrays: dict[str, Any] = {**self.arrays(), **arrays_of_others(self.others)}
        buffer = io.BytesIO()
        np.savez_compressed(buffer, **arrays, provenance=provenance)
        return buffer.getvalue()

    def arrays(self) -> dict[str, np.ndarray]:
        """The numbers by the names that they have in a file."""
        return named_parameters(self.layout, self.parameters)

    def provenance(self) -> dict[str, Any]:
        """Where the values come from, as JSON-like data."""
        return {
            "network": self.network._asdict(),
            "inputs": self.inputs,
            "actions": self.actions,
            "task": self.task,
            "method": self.method,
            "discount": self.discount,
            "version": self.version,
            **({"made_for": self.made_for} if self.made_for else {}),
            **provenance_of_others(self.others),
        }


def network_values(arrays: dict[str, np.ndarray], provenance: dict[str, Any]) -> NetworkValues:
    """Values from the arrays and the provenance of a file that `NetworkValues.save` wrote.

    Args:
        arrays: by name, see `qbumpers.networks.network.named_parameters`.
        provenance: without the hash; in the place of the provenance of further values, if there are
            any, those values.

    Returns:
        The values.

    Raises:
        KeyError: if the shape of the network is missing.
        RequestError: if it is no possible one, or an array is missing or does not suit it.
    """
    shape = dict(provenance)
    settings = dict(shape.pop("network"))
    network = checked(Network, {**settings, "hidden": tuple(settings["hidden"])}, "network")
    inputs = shape.pop("inputs")
    actions = shape.pop("actions")
    parts: list[np.ndarray] = []
    for name, needed in named_shapes(network.layout(inputs, actions)).items():
        found = arrays.get(name)
        if found is None or (found.shape, found.dtype) != (needed, np.float32):
            given = "is missing" if found is None else f"is {found.dtype} {list(found.shape)}"
            raise RequestError(f"array {name} {given}; float32 {list(needed)} is needed")
        parts.append(found.ravel())
    return NetworkValues(network, inputs, actions, np.concatenate(parts), **shape)


def named_shapes(layout: Layout) -> dict[str, tuple[int, ...]]:
    """Shapes of a network's arrays by name, in the order of its parameters."""
    shapes: dict[str, tuple[int, ...]] = {}
    for name, outputs, inputs in layout.layers():
        shapes[f"{name}.weight"] = (inputs, outputs)
        shapes[f"{name}.bias"] = (outputs,)
    return shapes
