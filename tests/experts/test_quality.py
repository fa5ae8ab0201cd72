"""Claims of values against what is achieved, at a task whose values are known by hand."""

import numpy as np
import polars as pl
import pytest

from qbumpers.errors import RequestError
from qbumpers.experts.quality import (
    BEFORE_CRASH,
    bias_by,
    check_table,
    check_values,
    returns_to_go,
    summarise,
)
from qbumpers.tasks import cliff_walking
from qbumpers.values import solve
from tests.narrowing import present
from tests.values.walking import DISCOUNT, GOAL, exact, flattering, line, random_policy, worth


def checked(values, **changes):
    fields = {"discount": DISCOUNT, "policies": {"random": random_policy()}, "episodes": 30}
    return check_values(line(), values, **{**fields, **changes})


def test_returns_are_discounted_sums_to_the_end():
    assert returns_to_go(np.array([1.0, 2.0, 4.0]), 0.5, True) == pytest.approx([3.0, 4.0, 4.0])


def test_returns_that_hang_on_what_was_cut_off_are_unknown():
    found = returns_to_go(np.ones(100), 0.9, False)
    # 0.9 ** 43 is above 0.01 and 0.9 ** 44 below it.
    assert np.isnan(found[-43:]).all()
    assert np.isfinite(found[:-43]).all()
    assert found[0] == pytest.approx(10, rel=0.01)
    assert np.isnan(returns_to_go(np.ones(100), 1.0, False)).all()


def test_exact_values_claim_what_is_achieved_wherever_a_policy_goes():
    claims = checked(exact)
    assert claims["achieved"].null_count() == 0
    assert claims["value"].to_numpy() == pytest.approx(claims["achieved"].to_numpy(), abs=1e-5)
    found = summarise(claims)
    assert found.bias == pytest.approx((0, 0), abs=1e-5)
    assert found.start_value.mean == pytest.approx(worth(5))
    assert found.start_return.mean == pytest.approx(worth(5))
    assert found.crash_value == found.crash_return == (-100, 0)


def test_flattery_is_found_where_it_is():
    claims = checked(flattering)
    found = summarise(claims)
    assert found.start_value.mean - found.start_return.mean == pytest.approx(10)
    assert present(found.crash_value).mean == pytest.approx(-100 + 2 * (GOAL - 1))
    assert found.crash_return == (-100, 0)
    assert found.overestimated == 1
    near = bias_by(claims.filter(policy="random"), "before_crash", [1, 2, 3])
    # Place 1 before the crash, 2 a step earlier.
    assert near["bias"].to_list() == pytest.approx([2 * (GOAL - 1), 2 * (GOAL - 2)])
    greedy = bias_by(claims.filter(policy="greedy"), "time", range(6))
    assert greedy["bias"].to_list() == pytest.approx([10, 8, 6, 4, 2])


def test_distance_is_from_the_greedy_episodes():
    claims = checked(exact)
    assert (claims.filter(policy="greedy")["distance"] == 0).all()
    away = claims.filter(policy="random", before_crash=1)["distance"].to_numpy()
    assert (away == away[0]).all()
    nearer = claims.filter(policy="random", before_crash=2)["distance"].to_numpy()
    assert nearer == pytest.approx(away * 3 / 4)  # places 2 and 1, the path begins at 5


def test_crashes_are_gone_back_to_and_other_states_at_random():
    claims = checked(exact).filter(policy="random")
    for _, episode in claims.group_by("episode"):
        late = episode["before_crash"].drop_nulls()
        assert episode["at_random"].sum() <= 4
        if len(late):
            assert {b for b in BEFORE_CRASH if b <= max(episode["time"]) + 1} <= set(late)
    assert claims["before_crash"].null_count() > 0


def test_errors_are_over_episodes_not_over_steps():
    rows = pl.DataFrame(
        {
            "policy": ["a"] * 4, "episode": [0, 0, 0, 1], "time": [0, 1, 2, 0],
            "value": [3.0, 3.0, 3.0, 1.0], "achieved": [0.0] * 4,
        }
    )  # fmt: skip
    [row] = bias_by(rows, "time", [0, 9]).to_dicts()
    assert (row["bias"], row["error"], row["episodes"]) == (2.0, pytest.approx(1.0), 2)


def test_a_value_on_an_edge_belongs_to_the_bin_above_it():
    claims = checked(exact).filter(policy="greedy")
    table = bias_by(claims, "time", [0, 2, 4, 90, 100])
    assert table["low"].to_list() == [0, 2, 4]
    assert table["value"][1] == pytest.approx((worth(7) + worth(8)) / 2, abs=1e-5)


def test_equal_seeds_give_equal_claims():
    again = [checked(exact, policies=None, episodes=3, seed=5) for _ in range(2)]
    assert again[0].equals(again[1])
    assert set(again[0]["policy"]) == {"greedy", "10% random", "30% random", "100% random"}


def test_claims_that_truncation_hides_are_left_out_of_the_summary():
    claims = check_values(
        line(episode_limit=3), exact, discount=DISCOUNT, policies={"random": random_policy()}
    )
    assert claims.filter(policy="greedy")["achieved"].null_count() == 60
    assert np.isnan(summarise(claims).start_return.mean)


@pytest.mark.parametrize("change", [{"episodes": 1}, {"seed": -1}, {"discount": 0.0}])
def test_numbers_out_of_range_are_named(change):
    [(field, value)] = change.items()
    with pytest.raises(RequestError, match=rf"{field} = {value}.*needed"):
        checked(exact, **change)


def test_a_table_is_held_against_the_exact_solution():
    task = cliff_walking()
    values = solve(task)
    found = check_table(task, lambda state: values(state) + (state == 36), discount=1.0)
    wrong = found.filter(pl.col("value") != pl.col("exact"))
    assert wrong["state"].to_list() == [36] * 4
    assert wrong["exact"].to_list() == values(36).tolist()
    assert 37 not in found["state"]  # the cliff: nobody acts there
