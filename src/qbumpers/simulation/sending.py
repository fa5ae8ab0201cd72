"""What is registered beside rules and learners, on its way to other processes.

Environments of Gymnasium and tasks from outside this package are sent whole, so that code there
finds them under their names. Installed modules that were imported for them are imported there too.
"""

import contextlib
import dataclasses
import pickle
import uuid
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import gymnasium
from gymnasium.envs.registration import EnvSpec, load_env_creator

from qbumpers.errors import RequestError
from qbumpers.imports import import_modules, imported
from qbumpers.simulation.by_value import dumped
from qbumpers.source import home_of, meaning_of
from qbumpers.tasks.registry import own_tasks, register_task

_PROCESS = uuid.uuid4().hex  # a process leaves its own registrations as they are


class Registered:
    """What is registered in this process; unpickling it registers it in another one.

    What cannot be pickled is refused there only if something asks for it.
    """

    def __reduce__(self) -> Any:
        modules = [name for name in imported() if home_of(name).kind == "installed"]
        environments = {
            name: _packed(f"environment {name!r}", _with_creator(spec))
            for name, spec in gymnasium.registry.items()
            if not _is_everywhere(spec.entry_point)
        }
        tasks = {name: _packed(f"task {name!r}", make) for name, make in own_tasks().items()}
        return _register, (_PROCESS, modules, environments, tasks)


def cannot_be_sent(what: str, error: Exception) -> RequestError:
    """An error for what cannot be pickled, to be raised by the caller."""
    reason = " ".join(str(error).split())
    return RequestError(
        f"{what} cannot be sent to other processes: {reason}; what it needs of such things, its "
        "functions must make themselves"
    )


def _is_everywhere(entry_point: Any) -> bool:
    """Whether importing this package registers an environment with this entry point."""
    module = entry_point if isinstance(entry_point, str) else entry_point.__module__
    return module.partition(":")[0].partition(".")[0] in ("gymnasium", "qbumpers")


def _with_creator(spec: EnvSpec) -> EnvSpec:
    """A specification with the class itself if that is of a module of the user's own."""
    entry_point = spec.entry_point
    if isinstance(entry_point, str) and home_of(entry_point.partition(":")[0]).kind == "own":
        with contextlib.suppress(ImportError, AttributeError):  # the error comes where it is made
            return dataclasses.replace(spec, entry_point=load_env_creator(entry_point))
    return spec


def _packed(what: str, thing: Any) -> bytes | str:
    """A specification or factory, pickled; what is to be said if it cannot be."""
    code = thing.entry_point if isinstance(thing, EnvSpec) else thing
    try:
        return dumped(thing, () if isinstance(code, str) else meaning_of({what: code}).modules)
    except Exception as error:  # each type has reasons of its own
        return str(cannot_be_sent(what, error))


def _register(
    process: str,
    modules: Sequence[str],
    environments: Mapping[str, bytes | str],
    tasks: Mapping[str, bytes | str],
) -> None:
    """Register what came from another process."""
    if process == _PROCESS:
        return
    import_modules(modules, "imports")
    for name, packed in environments.items():
        found = EnvSpec(name, _refusal(packed)) if isinstance(packed, str) else pickle.loads(packed)
        gymnasium.registry[name] = found
    for name, packed in tasks.items():
        register_task(name, _refusal(packed) if isinstance(packed, str) else pickle.loads(packed))


def _refusal(message: str) -> Callable[..., Any]:
    def refuse(**arguments: Any) -> Any:
        raise RequestError(message)

    return refuse
