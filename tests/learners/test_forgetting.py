"""What is forgotten of a memory's tables: a share, or by a power law since the last practice."""

from typing import NamedTuple

import numpy as np
import pytest

from qbumpers import RequestError, simulate
from qbumpers.learners import PowerLaw, dispatch, learners
from qbumpers.learners.forgetting import begin_practice, grow_older, practice_for, practise
from qbumpers.learners.interface import Shape
from qbumpers.random_streams import trial_streams
from qbumpers.simulation import make_condition
from qbumpers.tasks import cliff_walking
from qbumpers.tasks.corridors import vector_corridor

STATES, ACTIONS = 4, 3
TABULAR = [kind for kind in learners().values() if kind.built_in and kind.observes == "states"]


def memory_of(kind):
    stream = trial_streams(5, {"test": "forgetting"}, range(1))[0, 0]
    return dispatch.start(kind.settings_type(), Shape(STATES, 0, (0,) * ACTIONS), stream)


def tables_of(memory):
    return [f for f in memory if isinstance(f, np.ndarray) and f.shape[0] == STATES and f.ndim == 2]


@pytest.mark.parametrize("kind", TABULAR, ids=lambda kind: kind.name)
def test_a_share_of_the_way_back_is_forgotten_of_everything_that_was_learned(kind):
    memory, fresh, generator = memory_of(kind), memory_of(kind), np.random.default_rng(0)
    origins = [table.copy() for table in tables_of(fresh)]
    for table in tables_of(memory):
        table[:] = generator.normal(0, 9, table.shape)
    before = [table.copy() for table in tables_of(memory)]
    dispatch.forget(memory, fresh, 0.25)
    for table, once, origin in zip(tables_of(memory), before, origins, strict=True):
        kept = once if table.dtype != np.float64 else 0.75 * once + 0.25 * origin
        np.testing.assert_allclose(table, kept, atol=1e-12)
    for table, origin in zip(tables_of(fresh), origins, strict=True):
        assert np.array_equal(table, origin)


class Tables(NamedTuple):
    actions: np.ndarray
    outcomes: np.ndarray
    critic: np.ndarray
    others: np.ndarray
    counts: np.ndarray


def filled(value):
    return Tables(
        np.full((STATES, ACTIONS), value), np.full((STATES, 2 * ACTIONS), value),
        np.full((STATES, 1), value), np.full((STATES + 1, ACTIONS), value),
        np.full((STATES, ACTIONS), int(value)),
    )  # fmt: skip


@pytest.mark.parametrize("decay", [0.5, 2.0])
def test_what_was_practised_t_episodes_ago_keeps_its_power(decay):
    """With the first value 2 and 10 learned, 2 + 8 (1 + t)^-d is left."""
    memory, fresh = filled(10.0), filled(2.0)
    practice = practice_for(PowerLaw(decay), STATES, ACTIONS, 8)
    begin_practice(practice)
    for episode in range(7):  # action 0 of state 1 in every one, action 2 of state 1 in two
        practise(practice, 1, 0)
        memory.actions[1, 0] = memory.critic[1, 0] = 10.0
        memory.outcomes[1, :2] = 10.0
        if episode in (2, 4):
            practise(practice, 1, 2)
            memory.actions[1, 2] = 10.0
            memory.outcomes[1, 4:] = 10.0
        dispatch.forget_by_age(memory, fresh, practice)
        grow_older(practice)

    def left(t):
        return pytest.approx(2 + 8 * (1 + t) ** -decay, abs=1e-12)

    assert memory.actions[1].tolist() == [left(1), left(7), left(3)]
    assert memory.outcomes[1].tolist() == [left(1)] * 2 + [left(7)] * 2 + [left(3)] * 2
    assert memory.outcomes[0].tolist() == [left(7)] * 6
    assert memory.critic[:, 0].tolist() == [left(7), left(1), left(7), left(7)]
    assert (memory.others == 10).all()  # no table of this many states
    assert (memory.counts == 10).all()


def test_a_trial_begins_without_practice():
    practice = practice_for(PowerLaw(), STATES, ACTIONS, 3)
    grow_older(practice)
    begin_practice(practice)
    assert (practice.age == 0).all()


def test_the_first_trial_of_several_tells_nothing_of_the_next():
    found = simulate(cliff_walking(), "none", forgetting=PowerLaw(), trials=3, episodes=5)
    alone = simulate(cliff_walking(), "none", forgetting=PowerLaw(), trials=range(2, 3), episodes=5)
    assert found.outcomes.assisted_return[2].tolist() == alone.outcomes.assisted_return[0].tolist()


def test_who_forgets_by_a_power_law_is_another_condition():
    contents = [
        make_condition(cliff_walking(), "none", forgetting=forgetting).learning()
        for forgetting in (0.0, 0.5, PowerLaw(0.5), PowerLaw(0.4))
    ]
    assert [content.get("forgetting") for content in contents] == [
        None, 0.5, {"decay": 0.5}, {"decay": 0.4},
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("task", "forgetting", "message"),
    [
        (cliff_walking(), PowerLaw(0.0), r"forgetting: decay = 0\.0: .*greater than 0"),
        (cliff_walking(), PowerLaw(float("inf")), r"forgetting: decay = inf: .*finite"),
        (cliff_walking(), "all", r"forgetting = 'all'; a number in \[0, 1\] or a PowerLaw"),
        (cliff_walking(), 1.5, r"forgetting = 1\.5; it must lie in \[0, 1\]"),
        (vector_corridor(), PowerLaw(), r"PowerLaw\(decay=0\.5\); at task .*only tables"),
    ],
)
def test_what_cannot_be_forgotten_so_is_refused(task, forgetting, message):
    with pytest.raises(RequestError, match=message):
        make_condition(task, "none", values=values_for(task), forgetting=forgetting)


def values_for(task):
    from qbumpers import make_assistant
    from qbumpers.conformance import small_values

    return None if task.states else small_values(task, make_assistant("none"))
