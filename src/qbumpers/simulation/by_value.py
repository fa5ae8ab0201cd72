"""Pickling what comes from modules of a user's own whole, and not by its name."""

import pickle
import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import Any


def dumped(things: Any, modules: Iterable[str], alone: Iterable[str] = ()) -> bytes:
    """Things pickled with the modules that they come from and refer to.

    So they run elsewhere as they do here, whatever is there under the names of these modules. What
    comes from the script or notebook that was started is always pickled whole.

    Args:
        things: any.
        modules: names of those modules.
        alone: which of them must be pickled whole even if others cannot be: those go by their
            names then.
    """
    import cloudpickle

    whole = set(modules)
    try:
        with _by_value(whole):
            return cloudpickle.dumps(things)
    except (TypeError, AttributeError, pickle.PicklingError):
        with _by_value(set(alone) & whole):
            return cloudpickle.dumps(things)


@contextmanager
def _by_value(names: Iterable[str]) -> Iterator[None]:
    """Within the block, what comes from these modules, and no others, is pickled whole."""
    import cloudpickle

    before = cloudpickle.list_registry_pickle_by_value()
    wanted = set(names) & sys.modules.keys() - {"__main__"}
    _pickle_by_value(before, wanted)
    try:
        yield
    finally:
        _pickle_by_value(wanted, before)


def _pickle_by_value(now: Iterable[str], wanted: Iterable[str]) -> None:
    import cloudpickle

    for name in set(now) - set(wanted):
        cloudpickle.unregister_pickle_by_value(sys.modules[name])
    for name in set(wanted) - set(now):
        cloudpickle.register_pickle_by_value(sys.modules[name])
