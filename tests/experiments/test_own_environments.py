"""Rules and environments of a script reach a Ray cluster and processes, with the same numbers."""

import subprocess
import sys

import pytest

from tests.experiments.with_ray import MARKS
from tests.simulation.test_processes import SCRIPT

pytestmark = MARKS

BEFORE = SCRIPT.partition("    print(")[0]
RUNS = (
    BEFORE
    + """
    import sys
    from pathlib import Path
    from qbumpers.experiments.cluster import LOCAL, RayCluster
    from qbumpers.experiments.local import ThisMachine
    from qbumpers.experiments.plan import make_plan
    from qbumpers.experiments.run import run_experiment
    from qbumpers.experiments.sources import make_experiment

    values.save("values.npz")
    warnings.simplefilter("ignore")
    plan = make_plan(make_experiment({
        "name": "line", "task": {"name": "own/Line-v0", "discount": 0.9}, "values": "values.npz",
        "assistants": [{"name": "guide"}], "trials": 2, "episodes": 2,
    }))
    run_experiment(plan, "one", backend=ThisMachine(1))
    run_experiment(plan, "two", backend=ThisMachine(2))
    with RayCluster(LOCAL) as cluster:
        run_experiment(plan, "ray", backend=cluster)

main()
"""
)


@pytest.mark.slow
def test_a_cluster_and_processes_give_the_same_bytes(tmp_path):
    finished = subprocess.run(
        [sys.executable, "-c", RUNS],
        cwd=tmp_path, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert (finished.returncode, finished.stderr) == (0, "")
    one, two, ray = (
        (tmp_path / name / "episodes.parquet").read_bytes() for name in ("one", "two", "ray")
    )
    assert one == two == ray
