"""Finished runs that the tests of the analysis share."""

import pytest

from qbumpers.analysis.report import write_report
from qbumpers.experiments.plan import make_plan
from qbumpers.experiments.run import run_experiment
from qbumpers.reproduction.experiments import reproduction


@pytest.fixture(scope="session")
def reproduced(tmp_path_factory):
    """Figure 2 with five trials a condition, and its report."""
    folder = tmp_path_factory.mktemp("reproduced")
    run_experiment(make_plan(reproduction("cliff-walking", trials=5, seed=1)), folder)
    write_report(folder)
    return folder
