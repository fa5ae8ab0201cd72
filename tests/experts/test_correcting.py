"""Values corrected by what their policy achieves, at a task whose values are known by hand."""

import numpy as np
import pytest

from qbumpers.errors import RequestError
from qbumpers.experts import correcting, visiting
from qbumpers.experts.correcting import (
    Samples,
    correct_values,
    fit_correction,
    fit_of,
    sample_returns,
)
from qbumpers.experts.visiting import visited_episodes
from qbumpers.networks import Network
from qbumpers.values import NetworkValues
from tests.values.walking import DISCOUNT, GOAL, exact, line, worth

PLACES = np.array([[place, 1] for place in range(1, GOAL)], np.float32)


def righteous(network=Network((16, 16)), claim=30.0):  # noqa: B008
    """A network that prefers to go right everywhere and claims far too much."""
    layout = network.layout(2, 2)
    parameters = np.random.default_rng(0).normal(0, 0.1, layout.parameters())
    parameters[-2:] = claim, claim + 10
    return NetworkValues(network, 2, 2, parameters, DISCOUNT, "line", "by hand")


@pytest.fixture
def quick(monkeypatch):
    monkeypatch.setattr(visiting, "_EPISODES", 20)
    monkeypatch.setattr(correcting, "_UPDATES", 4_000)


def test_corrected_values_claim_what_is_achieved_and_keep_the_policy(quick):
    values = righteous()
    done = []
    found = correct_values(line(), values, branches=300, learners=2, report=done.append)
    assert done == list(range(1, 301))
    truth = np.array([worth(place) for place in range(1, GOAL)])
    assert np.abs(values(PLACES)[:, 1] - truth).min() > 20
    assert found.values(PLACES)[3:, 1] == pytest.approx(truth[3:], abs=4)
    assert found.before.bias.mean > 20
    assert abs(found.after.bias.mean) < 2
    assert found.after.absolute.mean < 0.2 * found.before.absolute.mean
    assert found.values.method.startswith("by hand; each state corrected by")
    assert (found.values.task, found.values.discount) == ("line", DISCOUNT)


def test_samples_are_what_the_greedy_policy_achieves(quick):
    task, values = line(), righteous()
    visited = visited_episodes(task, values, 1, 0)
    assert len(visited) == 40
    samples = sample_returns(task, values, visited, 50, 0, lambda _: None)
    assert samples.tried.sum() == 50
    claimed = [exact(o)[a] for o, a in zip(samples.observations, samples.actions, strict=True)]
    assert samples.returns == pytest.approx(np.array(claimed))
    assert set(samples.actions[samples.tried]) == {0, 1}
    assert set(samples.actions[~samples.tried]) == {1}


@pytest.mark.parametrize(
    "network",
    [
        Network((8, 6), "relu"),
        *(pytest.param(each, marks=pytest.mark.slow) for each in (Network((8, 6, 5)), Network(()))),
    ],
    ids=str,
)
def test_a_correction_is_the_same_for_every_action(monkeypatch, network):
    monkeypatch.setattr(correcting, "_UPDATES", 200)
    values = righteous(network)
    returns = np.linspace(-100, 10, 9)
    samples = Samples(PLACES, np.ones(9, int), returns, np.arange(9), np.ones(9, bool))
    corrected = fit_correction(values, samples, 0)
    added = corrected(PLACES) - values(PLACES)
    assert added[:, 0] == pytest.approx(added[:, 1], rel=1e-5)
    assert np.ptp(added[:, 0]) > 1
    assert corrected.network.hidden == tuple(2 * units for units in network.hidden)


def test_a_fit_is_by_means_not_by_medians(monkeypatch):
    """Three landings and a crash in one state are worth their mean."""
    monkeypatch.setattr(correcting, "_UPDATES", 2_000)
    state = np.tile(np.array([[5, 1]], np.float32), (4, 1))
    returns = np.array([100.0, 100.0, 100.0, -100.0])
    samples = Samples(state, np.ones(4, int), returns, np.arange(4), np.ones(4, bool))
    assert fit_correction(righteous(), samples, 0)(state[0])[1] == pytest.approx(50, abs=5)


def test_errors_are_over_visited_episodes():
    values = righteous()
    claimed = values(PLACES[:3])[:, 1]
    samples = Samples(
        PLACES[:3], np.ones(3, int), claimed - [1, 3, 6], np.array([0, 0, 1]), np.ones(3, bool)
    )
    found = fit_of(values, samples)
    assert found.bias == pytest.approx((4.0, 2.0), abs=1e-5)
    assert found.absolute == pytest.approx((4.0, 2.0), abs=1e-5)


def test_a_dueling_network_is_refused():
    with pytest.raises(RequestError, match="a dueling network; only plain ones"):
        correct_values(line(), righteous(Network((4,), dueling=3)))


@pytest.mark.parametrize(("field", "value"), [("branches", 9), ("learners", 0), ("seed", -1)])
def test_numbers_out_of_range_are_named(field, value):
    with pytest.raises(RequestError, match=rf"{field} = {value}.*needed"):
        correct_values(line(), righteous(), **{field: value})
