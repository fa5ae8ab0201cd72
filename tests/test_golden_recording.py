"""One recorded session, replayed through every host to the same decisions."""

import gymnasium
import numpy as np
import pytest

from qbumpers import SharedControl
from qbumpers.assistants import make_assistant
from qbumpers.decisions import Noise, Situation
from qbumpers.simulation import Script, make_condition, record
from qbumpers.tasks import cliff_walking
from qbumpers.values import solve
from tests.golden.recording import COLUMNS, read_recording
from tests.reference_simulation import stochastic_q_bumpers


def through_simulator(recording):
    """The compiled loop, given the proposals and the noise."""
    assistant = make_assistant(recording["assistant"]["name"], **recording["assistant"]["options"])
    episodes = recording["episodes"]
    condition = make_condition(cliff_walking(), assistant, episodes=len(episodes))
    script = Script(
        *(np.concatenate([e[column] for e in episodes]) for column in ("proposed", "coin", "tie"))
    )
    steps = record(condition, script=script)
    return [
        {column: getattr(steps, column)[steps.episode == episode] for column in COLUMNS}
        for episode in range(len(episodes))
    ]


def through_wrapper(recording):
    """The Gymnasium wrapper: proposals as actions, the noise given at reset."""
    environment = SharedControl(
        gymnasium.make("qbumpers/CliffWalking-v0"),
        recording["assistant"]["name"],
        solve(cliff_walking()),
        **recording["assistant"]["options"],
    )
    with environment:
        return [_wrapped_episode(environment, episode) for episode in recording["episodes"]]


def _wrapped_episode(environment, episode):
    noise = list(zip(episode["coin"].tolist(), episode["tie"].tolist(), strict=True))
    state, _ = environment.reset(options={"noise": noise})
    rows, ended = [], False
    for proposed in episode["proposed"].tolist():
        assert not ended, "the episode ended before its recording"
        next_state, _, terminated, truncated, info = environment.step(proposed)
        rows.append({"state": state, **info["assistance"]})
        state, ended = next_state, terminated or truncated
    assert ended, "the recording ended before its episode"
    return {column: np.array([row[column] for row in rows]) for column in COLUMNS}


ROWS, COLUMNS_OF_GRID = 4, 12
START, GOAL = (3, 0), (3, 11)
MOVES = [(-1, 0), (0, 1), (1, 0), (0, -1)]


def moved(cell, action):
    """Where a move leads, what it pays and whether it ends the episode."""
    row = min(max(cell[0] + MOVES[action][0], 0), ROWS - 1)
    column = min(max(cell[1] + MOVES[action][1], 0), COLUMNS_OF_GRID - 1)
    if row == 3 and 0 < column < 11:
        return START, -100.0, False
    arrived = (row, column) == GOAL
    return (row, column), 99.0 if arrived else -1.0, arrived


def value(cell):
    """100 less the steps of the shortest way: right above the cliff, down in the last column."""
    up = 1 if cell == START else 0
    row, column = cell[0] - up, cell[1]
    return 100.0 - (up + GOAL[1] - column + GOAL[0] - row)


def action_values(cell):
    found = []
    for action in range(4):
        after, reward, ends = moved(cell, action)
        found.append(reward if ends else reward + value(after))
    return found


def through_plain_python(recording):
    """Algorithm 1 on a closed form of Q*, without the package."""
    replayed = []
    for episode in recording["episodes"]:
        cell, earned, rows = START, 0.0, []
        steps = zip(*(episode[name].tolist() for name in ("proposed", "coin", "tie")), strict=True)
        for proposed, coin, tie in steps:
            values = action_values(cell)
            state = cell[0] * COLUMNS_OF_GRID + cell[1]
            situation = Situation(
                state, np.array(values), np.zeros((0, 4)), proposed, earned, 1.0, value(START),
                len(replayed), len(rows),
            )  # fmt: skip
            executed, probability = stochastic_q_bumpers(
                situation, Noise(coin, tie), **recording["assistant"]["options"]
            )
            after, reward, _ = moved(cell, executed)
            projected = earned + values[proposed]
            rows.append((state, proposed, coin, tie, executed, probability, projected, reward))
            cell, earned = after, earned + reward
        columns = map(np.array, zip(*rows, strict=True))
        replayed.append(dict(zip(COLUMNS, columns, strict=True)))
    return replayed


HOSTS = [through_simulator, through_wrapper, through_plain_python]


@pytest.fixture(scope="module")
def recording():
    return read_recording()


@pytest.mark.parametrize("host", HOSTS)
def test_a_host_repeats_the_recorded_session(host, recording):
    replayed = host(recording)
    for expected, found in zip(recording["episodes"], replayed, strict=True):
        for column in COLUMNS:
            # Two ways to write the logistic differ by a few units in the last place.
            tolerance = 1e-12 if column == "probability" else 0.0
            np.testing.assert_allclose(
                found[column], expected[column], rtol=0, atol=tolerance, err_msg=column
            )


def test_the_recording_holds_every_kind_of_decision(recording):
    columns = {
        name: np.concatenate([episode[name] for episode in recording["episodes"]])
        for name in COLUMNS
    }
    overridden = columns["executed"] != columns["proposed"]
    uncertain = (columns["probability"] > 0) & (columns["probability"] < 1)
    assert (overridden & uncertain).any()
    assert (~overridden & uncertain).any()
    assert (overridden & (columns["probability"] == 1)).any()
    assert (columns["probability"] == 0).any()
    ends = [episode["reward"][-1] for episode in recording["episodes"]]
    assert 99.0 in ends


@pytest.mark.parametrize(
    ("cell", "expected"), [((2, 6), [92, 94, -13, 92]), ((1, 6), [91, 93, 93, 91])]
)
def test_the_closed_form_is_the_papers_example(cell, expected):
    assert action_values(cell) == expected
    assert value(START) == 87
