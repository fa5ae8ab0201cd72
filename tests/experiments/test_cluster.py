"""Runs through Ray: the same bytes as local ones, whatever dies on the way, and readable errors."""

import contextlib
import os
import signal
import sys
import time
from pathlib import Path

import pytest

from qbumpers.assistants import register_assistant
from qbumpers.cores import usable_cores
from qbumpers.errors import RequestError
from qbumpers.experiments import cells, cluster
from qbumpers.experiments.cluster import LOCAL, RayCluster, versions
from qbumpers.experiments.plan import make_plan
from qbumpers.experiments.run import run_experiment
from qbumpers.experiments.sources import make_experiment
from tests.assistants import own_rules
from tests.experiments.examples import cart, contents_of, settings
from tests.experiments.with_ray import MARKS
from tests.learners.own_learners import register_averaging
from tests.narrowing import present

pytestmark = [
    *MARKS,
    pytest.mark.filterwarnings("ignore::qbumpers.experts.ExpertWarning"),  # a random network
]

MEMORY = 100_000_000
TABLES = ("*.parquet", "cells/**/*")


@pytest.fixture
def small_cells(monkeypatch):
    """Cells of two trials, each in a batch of its own."""
    monkeypatch.setattr(cells, "EPISODES_A_CELL", 8)
    monkeypatch.setattr(cluster, "_SHORTEST_BATCH", 0.0)
    monkeypatch.setattr(cluster, "_SHARES_A_CORE", 1e9)


def plan_of(**changes):
    return make_plan(make_experiment(settings(**{"trials": 40, **changes})))


def local_run(plan, folder):
    run_experiment(plan, folder)
    return contents_of(folder, *TABLES)


def two_nodes(cores):
    """A real cluster: a head with a core or none, and another node with cores."""
    from ray.cluster_utils import Cluster

    head = {"num_cpus": cores, "object_store_memory": MEMORY, "include_dashboard": False}
    made = Cluster(initialize_head=True, head_node_args=head)
    other = made.add_node(num_cpus=1, object_store_memory=MEMORY)
    return made, other


@contextlib.contextmanager
def running(cores=1):
    made, other = two_nodes(cores)
    try:
        yield made, other
    finally:
        made.shutdown()


def recorded(log, act=lambda first: None):
    """The work of a batch that writes down where it begins and where it ends.

    Nested, so that it travels to the workers whole, which do not have this module.
    """
    work = cluster._finish_batch

    def finish_batch(shared, batch, expected):
        import ray

        node = ray.get_runtime_context().get_node_id()
        cell = f"{batch[0].content[:8]}-{batch[0].first}"
        with open(log, "a") as file:
            print(node, "begins", cell, file=file, flush=True)
        act(batch[0])
        done = work(shared, batch, expected)
        with open(log, "a") as file:
            print(node, "ends", cell, file=file, flush=True)
        return done

    return finish_batch


def lines_of(log):
    return [line.split() for line in Path(log).read_text().splitlines()]


def test_a_run_through_an_own_ray_equals_a_local_one_though_a_worker_is_killed(
    tmp_path, monkeypatch, small_cells
):
    plan = plan_of(trials=6)
    killed, log = tmp_path / "killed", tmp_path / "log"

    def kill_once(cell):
        if cell.first == 4 and not killed.exists():
            killed.touch()
            os.kill(os.getpid(), signal.SIGKILL)

    monkeypatch.setattr(cluster, "_finish_batch", recorded(str(log), kill_once))
    reports = []
    with RayCluster(LOCAL) as ray_cluster:
        assert ray_cluster.cores == usable_cores()
        run_experiment(plan, tmp_path / "ray", backend=ray_cluster, report=reports.append)
        with pytest.raises(RequestError, match=r"'local': this process uses Ray already"):
            RayCluster(LOCAL).__enter__()
    events = lines_of(log)
    assert killed.exists()
    assert len([e for e in events if e[1] == "begins"]) == 9 + 1
    assert len([e for e in events if e[1] == "ends"]) == 9
    assert [r.trials for r in reports] == list(range(0, 19, 2))
    assert contents_of(tmp_path / "ray", *TABLES) == local_run(plan, tmp_path / "local")


@pytest.mark.slow
def test_a_run_on_two_nodes_equals_a_local_one_though_a_node_is_killed_half_way(
    tmp_path, monkeypatch, small_cells
):
    plan = plan_of()
    log, half_way, stuck = (tmp_path / name for name in ("log", "half-way", "stuck"))
    with running() as (made, other):
        doomed = other.node_id

        def work_slowly(_):
            import ray

            time.sleep(0.05)
            if half_way.exists() and ray.get_runtime_context().get_node_id() == doomed:
                stuck.touch()
                time.sleep(600)  # the node dies in the midst of this batch

        def report(progress):
            if progress.trials >= progress.of // 2:
                half_way.touch()
            if made.worker_nodes and stuck.exists():
                made.remove_node(other, allow_graceful=False)

        monkeypatch.setattr(cluster, "_finish_batch", recorded(str(log), work_slowly))
        with RayCluster(present(made.address)) as ray_cluster:
            assert ray_cluster.cores == 2
            run_experiment(plan, tmp_path / "ray", backend=ray_cluster, report=report)
        assert not made.worker_nodes
    events = lines_of(log)
    begun, ended = (
        {cell for node, what, cell in events if node == doomed and what == kind}
        for kind in ("begins", "ends")
    )
    finished_elsewhere = {c for node, what, c in events if node != doomed and what == "ends"}
    assert ended
    assert begun - ended
    assert begun - ended <= finished_elsewhere
    assert contents_of(tmp_path / "ray", *TABLES) == local_run(plan, tmp_path / "local")


@pytest.mark.slow
def test_a_cluster_without_cores_left_ends_the_run_and_the_next_goes_on(
    tmp_path, monkeypatch, small_cells
):
    plan = plan_of()
    monkeypatch.setattr(
        cluster, "_finish_batch", recorded(str(tmp_path / "log"), lambda cell: time.sleep(0.1))
    )
    with running(cores=0) as (made, other):

        def report(progress):
            if progress.trials == 20:
                made.remove_node(other, allow_graceful=False)

        with (
            pytest.raises(ConnectionError, match=r"lost all nodes with cores|lost a batch"),
            RayCluster(present(made.address)) as ray_cluster,
        ):
            run_experiment(plan, tmp_path / "ray", backend=ray_cluster, report=report)
    assert contents_of(tmp_path / "ray", "cells/**/*")
    assert local_run(plan, tmp_path / "ray") == local_run(plan, tmp_path / "local")


@pytest.mark.slow
def test_own_rules_and_learners_travel_errors_come_back_as_themselves_and_what_is_finished_stays(
    tmp_path, monkeypatch, own_registry, small_cells
):
    with pytest.warns(UserWarning, match="cannot be compiled"):
        register_assistant("own", own_rules.NoOptions)(own_rules.guide_with_a_dictionary)
    register_averaging()
    learners = [{"name": "averaging", "hopes": 1.0}]
    plan = plan_of(trials=4, assistants=[{"name": "own"}, {"name": "none"}], learners=learners)
    expected = local_run(plan, tmp_path / "local")
    work = cluster._finish_batch

    def unwilling(shared, batch, expected):
        if batch[0].first == 2:
            raise RequestError("alpha = 7: too much")
        return work(shared, batch, expected)

    def deadly(shared, batch, expected):
        if batch[0].first == 2:
            os.kill(os.getpid(), signal.SIGKILL)
        return work(shared, batch, expected)

    monkeypatch.setattr(cluster, "_RETRIES", 1)
    with RayCluster(LOCAL) as ray_cluster:
        monkeypatch.setattr(cluster, "_finish_batch", unwilling)
        with pytest.raises(RequestError) as raised:
            run_experiment(plan, tmp_path / "ray", backend=ray_cluster)
        assert type(raised.value) is RequestError
        assert str(raised.value) == "alpha = 7: too much"
        monkeypatch.setattr(cluster, "_finish_batch", deadly)
        with pytest.raises(ConnectionError, match="Ray lost a batch of cells 2 times, at last so"):
            run_experiment(plan, tmp_path / "ray", backend=ray_cluster)
        assert list((tmp_path / "ray" / "cells").rglob("000000-2-*.parquet"))
        assert not list((tmp_path / "ray" / "cells").rglob("000002-2-*.parquet"))
        monkeypatch.setattr(cluster, "_finish_batch", work)
        run_experiment(plan, tmp_path / "ray", backend=ray_cluster)
    assert contents_of(tmp_path / "ray", *TABLES) == expected


@pytest.mark.slow
def test_nodes_with_another_version_or_none_that_fits_are_refused_before_any_work(
    tmp_path, monkeypatch
):
    (tmp_path / "qbumpers").mkdir()
    (tmp_path / "qbumpers" / "__init__.py").write_text("__version__ = '0.0.1'", encoding="utf-8")
    here = versions()
    with running() as (made, _):
        monkeypatch.setattr(cluster, "versions", lambda: {**here, "polars": "0.0.1"})
        message = rf"^on = '{made.address}': of its nodes, .*polars [\d.]+, not 0\.0\.1 as here$"
        with pytest.raises(RequestError, match=message):
            RayCluster(present(made.address)).__enter__()
        monkeypatch.undo()
        made.add_node(num_cpus=1, object_store_memory=MEMORY, env_vars={"PYTHONPATH": tmp_path})
        with pytest.raises(RequestError, match=r"qbumpers none that fits \(No module named"):
            RayCluster(present(made.address)).__enter__()


def test_a_node_with_another_version_that_joins_later_refuses_its_work():
    with pytest.raises(RequestError, match=r"a Ray node: qbumpers [\d.a-z]+, not 9\.9 as here"):
        cluster._finish_batch([], [], {**versions(), "qbumpers": "9.9"})


def test_a_missing_ray_is_said_with_how_to_install_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "ray", None)
    with pytest.raises(RequestError, match=r"Ray is not installed; pip install 'qbumpers\[ray\]'"):
        RayCluster(LOCAL).__enter__()


@pytest.mark.slow
def test_deep_learners_through_an_own_ray_are_those_of_processes(tmp_path):
    plan = make_plan(make_experiment(cart(tmp_path)))
    with RayCluster(LOCAL) as ray_cluster:
        run_experiment(plan, tmp_path / "ray", backend=ray_cluster)
    assert contents_of(tmp_path / "ray", *TABLES) == local_run(plan, tmp_path / "local")
