"""Inventory control with a fixed cost per order and lost sales (Szepesvári 2010, Example 1)."""

import math

import numpy as np

from qbumpers.tasks.display import made_by
from qbumpers.tasks.displays.inventory import CAPACITY, inventory_display
from qbumpers.tasks.tabular import TabularTask

MOST_DEMANDED = 8
PRICE, COST, FIXED_COST, HOLDING_COST = 4.0, 2.0, 4.0, 1.0
"""Of an item sold; of an item ordered; of an order; of an item kept for a day."""

DISCOUNT = 0.95
EPISODE_LIMIT = 50


def inventory() -> TabularTask:
    """Order items for a shop of 9 places before the day's demand is known, for 50 days.

    The state is the stock in the evening, the action how many items are ordered; those that find
    no place are not bought. Each day's demand is binomial, of 8 customers of whom each buys one
    item 1 time in 2 (so that probabilities are exact numbers); what is not there cannot be sold.
    An order costs 4, an item 2, one in the evening's stock 1; an item sold earns 4.

    Returns:
        The task, which starts with an empty stock; it ends with the limit alone, and has neither
        success nor crash.
    """
    stock = np.arange(CAPACITY + 1)
    filled = np.minimum(stock[:, None] + stock, CAPACITY)[:, :, None]
    following = np.broadcast_to(stock, (*filled.shape[:2], len(stock)))
    sold = filled - following
    bought = filled - stock[:, None, None]
    ordered = (stock > 0)[None, :, None]
    costs = FIXED_COST * ordered + COST * bought + HOLDING_COST * stock[:, None, None]
    return TabularTask(
        name="inventory",
        next_state=following,
        probability=_probability_of_sales(filled, sold),
        reward=PRICE * sold - costs,
        terminated=np.zeros(sold.shape, np.bool_),
        start=np.eye(len(stock))[0],
        discount=DISCOUNT,
        episode_limit=EPISODE_LIMIT,
        no_op=0,
        action_distance=np.abs(stock[:, None] - stock).astype(float),
        make_display=made_by(inventory_display),
    )


def _probability_of_sales(filled: np.ndarray, sold: np.ndarray) -> np.ndarray:
    """Of selling so many items; whoever finds none left buys none. Float [S, A, K]."""
    demand = np.array([math.comb(MOST_DEMANDED, n) for n in range(MOST_DEMANDED + 1)])
    demand = demand / 2**MOST_DEMANDED
    # Sales below 0 or above any demand do not happen.
    possible = (sold >= 0) & (sold <= MOST_DEMANDED)
    sales = np.where(possible, sold, 0)
    at_least = np.flip(np.cumsum(np.flip(demand)))
    exactly = np.where(sold == filled, at_least[sales], demand[sales])
    return np.where(possible, exactly, 0.0)
