"""A finished run that the tests of reproductions share."""

import pytest

from qbumpers.experiments.plan import make_plan
from qbumpers.experiments.run import run_experiment
from qbumpers.reproduction.experiments import reproduction
from qbumpers.reproduction.report import write_report


@pytest.fixture(scope="session")
def reproduced(tmp_path_factory):
    """Figure 2 with five trials per condition, and its report."""
    folder = tmp_path_factory.mktemp("reproduced")
    run_experiment(make_plan(reproduction("cliff-walking", trials=5, seed=1)), folder)
    write_report(folder)
    return folder
