"""The inventory against Monte Carlo of its description, and against what is known of such tasks."""

import numpy as np
import pytest

from qbumpers.tasks import make_task
from qbumpers.tasks.display import unassisted_step
from qbumpers.tasks.inventory import inventory
from qbumpers.values import solve
from tests.tasks.examples import outcomes


def day(stock: int, order: int, demand: int) -> tuple[int, float]:
    """Next stock and earnings of a day, as the description goes."""
    bought = min(order, 9 - stock)
    sold = min(stock + bought, demand)
    earned = 4 * sold - 2 * bought - 1 * stock - (4 if order else 0)
    return stock + bought - sold, earned


@pytest.mark.parametrize("stock", range(10))
@pytest.mark.parametrize("order", [0, 1, 4, 9])
def test_a_day_brings_what_each_number_of_customers_would(stock, order):
    """All 256 equally likely patterns of 8 customers who buy or do not."""
    expected: dict = {}
    for pattern in range(2**8):
        following, earned = day(stock, order, pattern.bit_count())
        outcome = (following, float(earned), False)
        expected[outcome] = expected.get(outcome, 0) + 1 / 256
    assert outcomes(inventory(), stock, order) == expected


def test_the_best_policy_orders_up_to_a_level_once_the_stock_is_low():
    """An (s, S) policy is optimal if orders have a fixed cost (Scarf 1960)."""
    best = solve(inventory()).table.argmax(axis=1)
    ordering = np.flatnonzero(best)
    assert ordering.tolist() == list(range(len(ordering)))
    assert 0 < len(ordering) < 10
    levels = ordering + best[ordering]
    assert len(set(levels.tolist())) == 1
    assert levels[0] < 9  # the shop's size does not decide


def test_its_values_are_those_of_value_iteration():
    values = np.zeros(10)
    for _ in range(1000):
        values = np.array([max(expected(s, a, values) for a in range(10)) for s in range(10)])
    assert solve(inventory()).table.max(axis=1) == pytest.approx(values, abs=1e-6)


def expected(stock: int, order: int, values: np.ndarray) -> float:
    mean = 0.0
    for demand, weight in enumerate((1, 8, 28, 56, 70, 56, 28, 8, 1)):
        following, earned = day(stock, order, demand)
        mean += weight / 256 * (earned + 0.95 * values[following])
    return mean


def test_episodes_end_by_their_limit_alone_and_ordering_nothing_does_nothing():
    task = make_task("inventory")
    assert (task.episode_limit, task.events, task.no_op) == (50, frozenset(), 0)
    environment = task.make_environment()
    environment.reset(seed=0)
    ends = [environment.step(5)[2:4] for _ in range(50)]
    assert ends == [(False, False)] * 49 + [(False, True)]


def test_the_display_has_a_digit_per_order_and_tells_what_was_sold():
    display = inventory().display
    assert display.keys == {f"Digit{items}": items for items in range(10)}
    shapes = display.scene(4, unassisted_step(2, 6, 4.0, 4))
    texts = [shape["text"] for shape in shapes if "text" in shape]
    assert texts == ["in stock: 4", "ordered 6, sold 4, earned 4"]
    assert sum(shape["kind"] == "polygon" for shape in shapes) == 4
