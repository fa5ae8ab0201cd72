"""Values files are checked against the task that they are to be of."""

import pytest

from qbumpers.errors import RequestError
from qbumpers.experts.loading import load_network, load_table
from qbumpers.tasks import make_task
from qbumpers.values import solve
from tests.values.networks import network_of

POLE, CLIFF = make_task("CartPole-v1", discount=0.9), make_task("cliff-walking")


def test_values_that_suit_the_task_are_what_was_saved(tmp_path):
    network, table = network_of(inputs=4, actions=2, task="CartPole-v1"), solve(CLIFF)
    network.save(tmp_path / "network.npz")
    table.save(tmp_path / "table.npz")
    assert load_network(POLE, tmp_path / "network.npz").digest() == network.digest()
    assert load_table(CLIFF, tmp_path / "table.npz").digest() == table.digest()


def test_values_that_do_not_suit_the_task_are_refused(tmp_path):
    for name, values in {
        "table": solve(CLIFF),
        "taxi": solve(make_task("Taxi-v4", discount=0.9)),
        "wide": network_of(inputs=5, actions=2, task="CartPole-v1"),
        "acrobot": network_of(inputs=4, actions=2, task="Acrobot-v1"),
    }.items():
        values.save(tmp_path / f"{name}.npz")
    with pytest.raises(
        RequestError, match=r"table.npz: .*\[48, 4\]; task CartPole-v1 needs a network"
    ):
        load_network(POLE, tmp_path / "table.npz")
    with pytest.raises(
        RequestError, match=r"5 inputs and 2 actions; task CartPole-v1 needs .* 4 inputs"
    ):
        load_network(POLE, tmp_path / "wide.npz")
    with pytest.raises(RequestError, match="of task Acrobot-v1"):
        load_network(POLE, tmp_path / "acrobot.npz")
    with pytest.raises(
        RequestError, match=r"wide.npz: .* a network of 5 .* needs a table \[48, 4\]"
    ):
        load_table(CLIFF, tmp_path / "wide.npz")
    with pytest.raises(RequestError, match=r"a table \[500, 6\]; task cliff-walking needs"):
        load_table(CLIFF, tmp_path / "taxi.npz")
