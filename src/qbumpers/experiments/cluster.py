"""Cells on the machines of a Ray cluster, or on this one through a Ray of its own."""

import functools
import hashlib
import importlib.metadata
import os
import pickle
import platform
from collections.abc import Callable, Generator, Iterator
from pathlib import Path
from typing import Any

import qbumpers
from qbumpers.compilation import source_stamp
from qbumpers.cores import usable_cores
from qbumpers.errors import RequestError
from qbumpers.experiments import work
from qbumpers.experiments.addresses import (
    LOCAL,
    check_address,
    check_connecting,
    host_and_port,
    listens,
    unusable,
)
from qbumpers.experiments.cells import Cell
from qbumpers.experiments.plan import Plan
from qbumpers.experiments.work import Finished, finish
from qbumpers.simulation import Condition
from qbumpers.simulation.packing import packed

BATCH_SECONDS = 2.0
"""Work handed over at once, at most: long beside Ray's milliseconds, short for a progress bar."""

_SHORTEST_BATCH = 0.05  # seconds; some ten times what handing it over takes
_SHARES_A_CORE = 4  # of what remains is a batch: cores end together although estimates err
_RETRIES = 4  # of a batch whose worker was lost
_ANSWERING, _WAITING = 60.0, 2.0  # seconds for nodes to say their versions; between checks

_SETTINGS = {"RAY_USAGE_STATS_ENABLED": "0", "RAY_ENABLE_UV_RUN_RUNTIME_ENV": "0"}
_LOOPBACK = {"RAY_ENABLE_WINDOWS_OR_OSX_CLUSTER": "0"}  # on Linux too: 127.0.0.1 and no cluster
_QUIET = {"log_to_driver": False, "logging_level": "CRITICAL"}


class RayCluster:
    """Ray's machines; a context, connected from its beginning to its end.

    Tables of finished cells travel back through Ray: the machines share no folder.

    Args:
        address: `LOCAL`, or HOST:PORT of the cluster's head node. This machine must be a node too.

    Attributes:
        cores: how many cells are worked on at once; known from the beginning of the context.

    Raises:
        RequestError: at the beginning of the context, if Ray is not installed, nothing answers
            at the address, or a node has other versions than this machine.
    """

    def __init__(self, address: str) -> None:
        self.address = address
        self.cores = 0
        self._ray: Any = None

    def __enter__(self) -> "RayCluster":
        """Connect, or start an own Ray."""
        if self.address != LOCAL:
            check_address(self.address)
        self._ray = _imported(_SETTINGS | (_LOOPBACK if self.address == LOCAL else {}))
        if self._ray.is_initialized():
            raise RequestError(
                f"on = {self.address!r}: this process uses Ray already; call ray.shutdown() before"
            )
        if self.address != LOCAL:
            check_connecting(self.address)
        try:
            self._connect()
            _check_versions(self._ray, self.address)
        except BaseException:
            self._ray.shutdown()
            raise
        return self

    def _connect(self) -> None:
        settings: dict[str, Any] = dict(_QUIET)
        if self.address == LOCAL:
            settings |= {"include_dashboard": False, "num_cpus": usable_cores()}
        try:
            self._ray.init(self.address, **settings)
        except Exception as error:
            raise unusable(self.address, str(error)) from error
        self.cores = int(self._ray.cluster_resources().get("CPU", 0))
        if self.cores < 1:
            raise RequestError(f"on = {self.address!r}: the Ray cluster there has no cores to use")

    def __exit__(self, *_: object) -> None:
        """Disconnect; an own Ray ends."""
        self._ray.shutdown()

    def __call__(self, plan: Plan, seconds: dict[Cell, float]) -> Generator[Finished]:
        """Do the work of cells and yield each as it comes back, in any order.

        Args:
            plan: the experiment whose conditions the cells belong to.
            seconds: the cells to be done, with the seconds that each is expected to take.

        Yields:
            Finished cells; a closed generator leaves what has begun unfinished.

        Raises:
            ConnectionError: if the cluster is gone, or lost a batch of cells too often.
        """
        ray = self._ray
        submit = ray.remote(num_cpus=1, max_retries=_RETRIES)(_finish_batch).remote
        # In a list: Ray would otherwise unpack it again for every batch.
        shared = [ray.put((packed(plan.conditions), plan.experiment.seed))]
        remaining = batches(seconds, self.cores)
        waiting: list[Any] = []
        try:
            while True:
                while len(waiting) < 2 * self.cores and (batch := next(remaining, None)):
                    waiting.append(submit(shared, batch, versions()))
                if not waiting:
                    return
                done, waiting = ray.wait(waiting, timeout=_WAITING)
                if not done:
                    _check_alive(ray, self.address)
                for reference in done:
                    yield from _received(ray, reference)
        finally:
            for reference in waiting:
                ray.cancel(reference, force=True)


def batches(seconds: dict[Cell, float], cores: int) -> Iterator[list[Cell]]:
    """Cells in batches that are worth handing over: large at first, small towards the end.

    Args:
        seconds: the cells to be done, with the seconds that each is expected to take.
        cores: how many batches are worked on at once.

    Yields:
        Each batch in the order of `seconds`; at least one cell, otherwise a share of what remains
        of no more than about `BATCH_SECONDS`.
    """
    remaining = sum(seconds.values())
    batch, length = [], 0.0
    for cell, alone in seconds.items():
        batch.append(cell)
        length += alone
        share = max(remaining / (_SHARES_A_CORE * cores), _SHORTEST_BATCH)
        if length >= min(share, BATCH_SECONDS):
            yield batch
            remaining -= length
            batch, length = [], 0.0
    if batch:
        yield batch


@functools.cache
def versions() -> dict[str, str]:
    """What decides the bytes of a cell, but for the experiment: code and processor, by name."""
    sources = source_stamp().encode() + Path(work.__file__).read_bytes()
    return {
        "qbumpers": qbumpers.__version__,
        "sources of qbumpers": hashlib.sha256(sources).hexdigest()[:12],
        **{name: importlib.metadata.version(name) for name in ("numba", "numpy", "polars")},
        "processor": platform.machine(),
    }


def _finish_batch(shared: list[Any], cells: list[Cell], expected: dict[str, str]) -> list[Finished]:
    """Do the work of cells, in a worker process of Ray."""
    if differences := _differences(versions(), expected):  # a node that joined later
        raise RequestError(f"a Ray node: {differences}")
    conditions, seed = _unpacked(*shared)
    return [finish(conditions[cell.content], cell, seed) for cell in cells]


@functools.lru_cache(maxsize=1)
def _unpacked(reference: Any) -> tuple[dict[str, Condition], int]:
    """Conditions by content, and the seed, once per process."""
    import ray

    conditions, seed = ray.get(reference)
    return pickle.loads(conditions), seed


def _received(ray: Any, reference: Any) -> Any:
    """The answer of a task, or the error in it."""
    try:
        return ray.get(reference)
    except ray.exceptions.RayTaskError as error:
        raise error.cause from None  # as it would have been raised here
    except ray.exceptions.RayError as error:
        reason = str(error).splitlines()[0]
        raise ConnectionError(
            f"Ray lost a batch of cells {_RETRIES + 1} times, at last so: {reason}"
        ) from error


def _check_alive(ray: Any, address: str) -> None:
    """Raise if Ray would wait for ever."""
    if not listens(*host_and_port(ray.get_runtime_context().gcs_address)):
        raise ConnectionError(f"the Ray cluster at {address} does not answer any more")
    if ray.cluster_resources().get("CPU", 0) < 1:
        raise ConnectionError(f"the Ray cluster at {address} has lost all nodes with cores")


def _imported(settings: dict[str, str]) -> Any:
    for name, value in settings.items():
        os.environ.setdefault(name, value)
    try:
        import ray
    except ImportError as error:
        raise RequestError("on: Ray is not installed; pip install 'qbumpers[ray]'") from error
    return ray


def _check_versions(ray: Any, address: str) -> None:
    """Raise if a node would compute other numbers, or other bytes of them."""
    from ray.util.scheduling_strategies import NodeAffinitySchedulingStrategy

    submit = ray.remote(num_cpus=0, max_retries=0)(_asked_for_versions())
    nodes = [node for node in ray.nodes() if node["Alive"] and node["Resources"].get("CPU")]
    asked = {
        submit.options(
            scheduling_strategy=NodeAffinitySchedulingStrategy(node["NodeID"], soft=False)
        ).remote(): node["NodeManagerAddress"]
        for node in nodes
    }
    answered, silent = ray.wait(list(asked), num_returns=len(asked), timeout=_ANSWERING)
    problems: dict[str, list[str]] = {"no answer": [asked[reference] for reference in silent]}
    for reference in answered:
        found = _differences(_received(ray, reference), versions())
        problems.setdefault(found, []).append(asked[reference])
    found_wrong = [f"{', '.join(who)}: {what}" for what, who in problems.items() if what and who]
    if found_wrong:
        raise RequestError(f"on = {address!r}: of its nodes, {'; '.join(found_wrong)}")


def _asked_for_versions() -> Callable[[], dict[str, str]]:
    def found() -> dict[str, str]:  # a nested function travels whole: the package may lack there
        """Versions on the node that this runs on."""
        try:
            from qbumpers.experiments.cluster import versions
        except ImportError as error:
            return {"qbumpers": f"none that fits ({error})"}
        return versions()

    return found


def _differences(found: dict[str, str], expected: dict[str, str]) -> str:
    """In what a node differs; empty if in nothing."""
    different = [
        f"{name} {found[name]}, not {expected[name]}"
        for name in expected
        if name in found and found[name] != expected[name]
    ]
    return ", ".join(different) + " as here" if different else ""
