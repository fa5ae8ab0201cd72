"""The experts that ship, and a warning if values are no better than none."""

import warnings

import numpy as np
import pytest

from qbumpers.errors import RequestError
from qbumpers.experts import ExpertWarning, check_expert, train_expert
from qbumpers.experts.checking import check_threshold, mean_with_error
from qbumpers.tasks import make_task
from qbumpers.values import shipped, shipped_expert
from tests.values.networks import constant, network_of


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setattr(shipped, "_FOLDER", tmp_path)
    return tmp_path


def test_the_expert_of_a_task_is_the_file_of_its_name(folder):
    values = network_of(task="corridor")
    values.save(folder / "corridor.npz")
    assert shipped_expert("corridor").digest() == values.digest()


@pytest.mark.parametrize("name", ["CartPole-v1", "", "../built_in/corridor", "x/corridor"])
def test_a_task_without_expert_is_told_how_to_get_one(folder, name):
    network_of().save(folder / "corridor.npz")
    with pytest.raises(RequestError, match=rf"'{name}'; .* for: corridor\. .*expert {name}'"):
        shipped_expert(name)


def test_where_none_ships_it_says_so(folder):
    with pytest.raises(RequestError, match="they do for: no task"):
        shipped_expert("corridor")


def test_a_damaged_file_is_no_expert(folder):
    (folder / "corridor.npz").write_bytes(b"garbage")
    with pytest.raises(RequestError, match=r"corridor\.npz of the package: not a file of Q values"):
        shipped_expert("corridor")


def test_means_come_with_their_standard_errors():
    numbers = np.array([1.0, 2.0, 6.0])
    assert mean_with_error(numbers) == pytest.approx((3.0, np.sqrt(7 / 3)))
    assert mean_with_error(numbers[:1]) == (1.0, np.inf)


def upright(observation):
    """Balances a pole for a good while: push to where it falls."""
    return [0.0, 1.0] if observation[2] + observation[3] > 0 else [1.0, 0.0]


def test_an_expert_that_beats_random_play_is_accepted_quietly():
    task = make_task("CartPole-v1", discount=0.99)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = check_expert(task, upright)
    assert found.better
    assert found.expert.mean > 100
    assert found.random.mean == pytest.approx(22, abs=4 * found.random.error)


def test_an_expert_no_better_than_random_play_is_warned_of_with_what_follows():
    task = make_task("CartPole-v1", discount=0.99)
    with pytest.warns(ExpertWarning, match=r"CartPole-v1.*steers towards worse.*say nothing"):
        found = check_expert(task, constant(0, 4, 2))
    assert not found.better
    assert found.expert.mean == pytest.approx(9.4, abs=0.5)  # it falls over as fast as it can


@pytest.mark.parametrize("use", [train_expert, lambda task: check_expert(task, upright)])
def test_a_task_with_numbered_states_is_refused(use):
    message = "task cliff-walking has numbered states and a table .* solved exactly, see solve"
    with pytest.raises(RequestError, match=message):
        use(make_task("cliff-walking"))


class Balancing:
    """Pushes the cart under the pole."""

    def __call__(self, observation):
        place, speed, angle, turning = observation
        return np.array([0.0, angle + 0.3 * turning + 0.02 * place + 0.05 * speed])


def test_a_policy_that_balances_the_pole_reaches_the_threshold():
    found = check_threshold(make_task("CartPole-v1", discount=0.99), Balancing(), episodes=10)
    assert found is not None
    assert (found.returned.mean, found.threshold, found.reached) == (500.0, 475.0, True)


def test_the_threshold_of_a_registered_task_is_that_of_its_environment():
    found = check_threshold(make_task("mountain-car"), shipped_expert("mountain-car"), episodes=10)
    assert found is not None
    assert (found.threshold, found.reached) == (-110.0, True)


def test_one_that_does_not_is_warned_of_with_what_to_try():
    task = make_task("CartPole-v1", discount=0.99)
    with pytest.warns(ExpertWarning, match="solved from 475 on; try more steps"):
        found = check_threshold(task, lambda observation: np.array([1.0, 0.0]), episodes=5)
    assert found is not None
    assert not found.reached


def test_there_is_no_threshold_of_shorter_episodes():
    short = make_task("CartPole-v1", discount=0.99, episode_limit=100)
    assert check_threshold(short, Balancing()) is None
