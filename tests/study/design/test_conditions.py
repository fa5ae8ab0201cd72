"""Crossing of levels, and orders of what is counterbalanced."""

from collections import Counter
from itertools import pairwise

import pytest

from qbumpers.study.design.conditions import Factor, crossed, orders_of


def test_levels_are_crossed():
    conditions = crossed([
        Factor.model_validate({"name": "help", "levels": [
            {"name": "some", "assistant": {"name": "stochastic-q-bumpers", "alpha": 0.2}},
            {"name": "yoked", "yoked_to": "some", "cap": 4},
        ]}),
        Factor.model_validate({"name": "seen", "levels": [
            {"name": "no", "overrides": "hidden"}, {"name": "why", "overrides": "explained"},
        ]}),
    ])  # fmt: skip
    assert [condition.name for condition in conditions] == [
        "some/no", "some/why", "yoked/no", "yoked/why",
    ]  # fmt: skip
    assert (conditions[0].assistant, conditions[0].options["alpha"]) == (
        "stochastic-q-bumpers",
        0.2,
    )
    assert conditions[3].yoked_to == "some/why"
    assert conditions[3].overrides == "explained"
    assert conditions[3].caps == (("help", "yoked", 4),)
    assert conditions[2].levels == {"help": "yoked", "seen": "no"}


@pytest.mark.parametrize("size", range(2, 10))
def test_orders_are_balanced(size):
    orders = orders_of(size)
    assert len(set(orders)) == len(orders)
    for order in orders:
        assert sorted(order) == list(range(size))
    for place in range(size):
        assert len(set(Counter(order[place] for order in orders).values())) == 1
    followed = Counter(pair for order in orders for pair in pairwise(order))
    assert len(followed) == size * (size - 1)
    assert len(set(followed.values())) == 1
