"""Runs through Ray: the same bytes as local ones, whatever dies on the way, and readable errors."""

import contextlib
import os
import signal
import subprocess
import sys
import time
import uuid
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from qbumpers.assistants import register_assistant
from qbumpers.errors import RequestError
from qbumpers.experiments import cells, cluster
from qbumpers.experiments.cells import Cell
from qbumpers.experiments.cluster import BATCH_SECONDS, LOCAL, RayCluster, batches, versions
from qbumpers.experiments.plan import make_plan
from qbumpers.experiments.run import run_experiment
from qbumpers.experiments.sources import make_experiment
from qbumpers.simulation.cores import usable_cores
from tests.assistants import own_rules
from tests.experiments.examples import cart, contents_of, settings
from tests.learners.own_learners import register_averaging

# Ray leaves sockets and files to the garbage collector, and starts threads before it forks.
pytestmark = [
    pytest.mark.filterwarnings("ignore::ResourceWarning"),
    pytest.mark.filterwarnings("ignore::DeprecationWarning"),
    pytest.mark.filterwarnings("ignore::FutureWarning"),
    pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning"),
    pytest.mark.filterwarnings("ignore::qbumpers.experts.ExpertWarning"),  # a random network
]

# Loopback only, and nothing written to the home folder. A cluster that is not started by RayCluster
# asks clouds whether it is one of theirs, and reports that it reports nothing: to a closed port.
NOWHERE = "http://127.0.0.1:9"
ALONE = {
    "RAY_ENABLE_WINDOWS_OR_OSX_CLUSTER": "0",
    "RAY_AUTH_MODE": "disabled",
    "RAY_USAGE_STATS_ENABLED": "0",
    "RAY_USAGE_STATS_REPORT_URL": NOWHERE,
    "http_proxy": NOWHERE,
    "https_proxy": NOWHERE,
}
MEMORY = 100_000_000
TABLES = ("*.parquet", "cells/**/*")


@pytest.fixture(scope="module", autouse=True)
def environment():
    with pytest.MonkeyPatch.context() as patch:
        for name, value in ALONE.items():
            patch.setenv(name, value)
        yield


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
        with RayCluster(made.address) as ray_cluster:
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
            RayCluster(made.address) as ray_cluster,
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
            RayCluster(made.address).__enter__()
        monkeypatch.undo()
        made.add_node(num_cpus=1, object_store_memory=MEMORY, env_vars={"PYTHONPATH": tmp_path})
        with pytest.raises(RequestError, match=r"qbumpers none that fits \(No module named"):
            RayCluster(made.address).__enter__()


def test_a_node_with_another_version_that_joins_later_refuses_its_work():
    with pytest.raises(RequestError, match=r"a Ray node: qbumpers [\d.a-z]+, not 9\.9 as here"):
        cluster._finish_batch([], [], {**versions(), "qbumpers": "9.9"})


SCRIPT = """
import sys
from qbumpers.experiments.cluster import RayCluster
from qbumpers.experiments.plan import make_plan
from qbumpers.experiments.run import run_experiment
from qbumpers.reproduction.experiments import reproduction

def report(progress):
    if progress.trials > 0 and trials > 1000:
        print("begun", flush=True)

trials = int(sys.argv[2])
plan = make_plan(reproduction("cliff-walking", trials=trials))
with RayCluster("local") as cluster:
    import ray
    assert [node["NodeManagerAddress"] for node in ray.nodes()] == ["127.0.0.1"]
    run_experiment(plan, sys.argv[1], backend=cluster, report=report)
"""


def start_script(folder, trials):
    """A run through an own Ray in a process of its own, with a mark that its children inherit."""
    mark = str(uuid.uuid4())
    environment = {**os.environ, "HOME": str(folder.parent), "MARK": mark}
    for name in ("RAY_ENABLE_WINDOWS_OR_OSX_CLUSTER", "RAY_USAGE_STATS_ENABLED"):
        del environment[name]  # what RayCluster must see to by itself
    process = subprocess.Popen(
        [sys.executable, "-c", SCRIPT, str(folder), str(trials)],
        env=environment, text=True, start_new_session=True,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE,
    )  # fmt: skip
    return process, f"MARK={mark}".encode()


def processes_with(mark):
    found = []
    for path in Path("/proc").glob("[0-9]*/environ"):
        with contextlib.suppress(OSError):
            if mark in path.read_bytes():
                found.append(path.parent.name)
    return found


def wait_until_gone(mark, seconds):
    end = time.monotonic() + seconds
    while processes_with(mark) and time.monotonic() < end:
        time.sleep(0.1)
    return not processes_with(mark)


@pytest.mark.slow
def test_an_own_ray_prints_nothing_and_leaves_no_process_behind(tmp_path):
    process, mark = start_script(tmp_path / "ray", 20)
    time.sleep(2)
    assert processes_with(mark)
    assert process.communicate(timeout=200) == ("", "")
    assert process.returncode == 0
    assert wait_until_gone(mark, 5)


@pytest.mark.slow
@pytest.mark.parametrize("ending", [signal.SIGINT, signal.SIGKILL])
def test_a_stopped_run_ends_at_once_with_all_its_processes_and_can_go_on(tmp_path, ending):
    folder = tmp_path / "ray"
    process, mark = start_script(folder, 5000)
    assert process.stdout.readline() == "begun\n"
    begun = time.monotonic()
    os.killpg(process.pid, ending) if ending == signal.SIGINT else process.kill()
    process.wait(timeout=60)
    assert time.monotonic() - begun < 10
    # Helpers of a Ray whose driver was killed first try to tell it for a minute.
    assert wait_until_gone(mark, 15 if ending == signal.SIGINT else 150)
    errors = process.stderr.read()
    if ending == signal.SIGINT:
        assert errors.rstrip().endswith("KeyboardInterrupt")
        assert "ray" not in errors.splitlines()[0].lower()
    finished = contents_of(folder, "cells/**/*.parquet")
    assert finished
    process.stdout.close()
    process.stderr.close()


def test_a_missing_ray_is_said_with_how_to_install_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "ray", None)
    with pytest.raises(RequestError, match=r"Ray is not installed; pip install 'qbumpers\[ray\]'"):
        RayCluster(LOCAL).__enter__()


durations = st.lists(st.floats(1e-4, 5.0), max_size=200)


@given(durations=durations, cores=st.integers(1, 64))
def test_batches_are_worth_handing_over_and_cores_end_together(durations, cores):
    seconds = {Cell("c", i, 1): s for i, s in enumerate(sorted(durations, reverse=True))}
    made = list(batches(seconds, cores))
    assert [cell for batch in made for cell in batch] == list(seconds)
    lengths = [sum(seconds[cell] for cell in batch) for batch in made]
    longest = max(durations, default=0.0)
    total = sum(durations)
    for length, batch in zip(lengths, made, strict=True):
        assert length < BATCH_SECONDS + seconds[batch[-1]]
    for length in lengths[:-1]:
        assert length >= min(cluster._SHORTEST_BATCH, BATCH_SECONDS)
    loads = [0.0] * cores
    for length in lengths:
        loads[loads.index(min(loads))] += length
    assert max(loads) <= total / cores * 1.25 + longest + cluster._SHORTEST_BATCH + 1e-9


def test_long_work_is_cut_into_few_batches():
    seconds = {Cell("c", i, 1): 0.1 for i in range(10_000)}
    assert 500 <= len(list(batches(seconds, 2))) <= 530


def test_batches_are_large_at_first_and_small_towards_the_end():
    seconds = {Cell("c", i, 1): 0.01 for i in range(1_000)}
    lengths = [len(batch) * 0.01 for batch in batches(seconds, 8)]
    # Were the first to take twice as long as estimated, the others would still have work.
    assert lengths[0] == pytest.approx(10 / 8 / 4, abs=0.02)
    assert lengths == sorted(lengths, reverse=True)
    assert max(lengths[-8:]) <= cluster._SHORTEST_BATCH + 0.011


@pytest.mark.slow
def test_deep_learners_through_an_own_ray_are_those_of_processes(tmp_path):
    plan = make_plan(make_experiment(cart(tmp_path)))
    with RayCluster(LOCAL) as ray_cluster:
        run_experiment(plan, tmp_path / "ray", backend=ray_cluster)
    assert contents_of(tmp_path / "ray", *TABLES) == local_run(plan, tmp_path / "local")
