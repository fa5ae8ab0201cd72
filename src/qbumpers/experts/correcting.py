"""A remedy for action values that claim too much: keep the policy, measure what it is worth.

Q-learning takes maxima of noisy values and sees few states off the expert's path, so its values are
too high before crashes and other states that it seldom saw. Here states are gathered from learners
and from the expert with random actions, an action is tried in each, the expert's greedy policy
plays on to the end, and a correction of each state is fitted to the discounted returns (fitted
evaluation by Monte Carlo).
"""

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from qbumpers.compilation import compiled_apart
from qbumpers.errors import RequestError
from qbumpers.experts.checking import MeanWithError, mean_with_error
from qbumpers.experts.episodes import Episode, greedy, play, replay_then
from qbumpers.experts.quality import returns_to_go
from qbumpers.experts.visiting import visited_episodes
from qbumpers.learners.double_dqn import DoubleDQN, DQNMemory, make_memory, remember, replay
from qbumpers.learners.interface import Transition
from qbumpers.networks.network import Layout, named_parameters
from qbumpers.random_streams import LEARNER, trial_streams
from qbumpers.registration import as_numbers
from qbumpers.tasks.task import Task
from qbumpers.values.fitting import check_fit, use_at
from qbumpers.values.network import NetworkValues

BRANCHES = 6_000
"""States in which an action is tried, unless another number is asked for."""

_KEPT = 8  # greedy steps of a branch that are fitted too
_HELD_OUT = 5  # every fifth episode
_RATES = (1e-3, 3e-4, 1e-4)  # of learning, one after another
_UPDATES = 20_000  # at each
_BATCH = 64


class Samples(NamedTuple):
    """States, actions and what doing the one in the other is worth.

    Attributes:
        observations: float32 [N, D].
        actions: int64 [N].
        returns: float64 [N], discounted.
        episodes: int64 [N], the visited episode that each comes from.
        tried: bool [N], whether the action was tried, rather than the policy's own later on.
    """

    observations: np.ndarray
    actions: np.ndarray
    returns: np.ndarray
    episodes: np.ndarray
    tried: np.ndarray


class Fit(NamedTuple):
    """How values compare to returns in states held out; errors are over visited episodes.

    Attributes:
        bias: mean of the value minus the return.
        absolute: mean size of that.
    """

    bias: MeanWithError
    absolute: MeanWithError


class Correction(NamedTuple):
    """Corrected values, and how they compare to those they were made from.

    Attributes:
        values: corrected.
        before: how the given values fit in states held out.
        after: how the corrected values fit there.
    """

    values: NetworkValues
    before: Fit
    after: Fit


def correct_values(
    task: Task,
    values: NetworkValues,
    *,
    branches: int = BRANCHES,
    learners: int = 4,
    seed: int = 0,
    report: Callable[[int], None] = lambda branches: None,
) -> Correction:
    """Correct action values by what their own greedy policy achieves where learners go.

    Args:
        task: what the values are of.
        values: to be corrected.
        branches: states in which an action is tried, at least 10.
        learners: that are simulated unassisted to visit states, at least 1.
        seed: decides learners, tried actions and the fit; not negative.
        report: called with the branches done.

    Returns:
        Corrected values, and how good both are on every fifth visited episode, held out.

    Raises:
        RequestError: if a number is out of range, or the network is a dueling one.
    """
    if task.states:
        raise RequestError(f"task {task.name}: only networks are corrected, not tables of states")
    check_fit(values, use_at(task))
    if values.network.dueling:
        raise RequestError(
            f"values of {values.task}: a dueling network; only plain ones can be corrected"
        )
    if branches < 10 or learners < 1 or seed < 0:
        raise RequestError(
            f"branches = {branches}, learners = {learners}, seed = {seed}; at least 10, 1 and 0 "
            "are needed"
        )
    visited = visited_episodes(task, values, learners, seed)
    samples = sample_returns(task, values, visited, branches, seed, report)
    held_out = samples.episodes % _HELD_OUT == 0
    corrected = fit_correction(values, _chosen(samples, ~held_out), seed)
    test = _chosen(samples, held_out & samples.tried)
    return Correction(corrected, fit_of(values, test), fit_of(corrected, test))


def _chosen(samples: Samples, which: np.ndarray) -> Samples:
    return Samples(*(array[which] for array in samples))


def sample_returns(
    task: Task,
    values: NetworkValues,
    visited: list[Episode],
    branches: int,
    seed: int,
    report: Callable[[int], None],
) -> Samples:
    """Try actions in visited states; half of them the action chosen there, half a random one.

    Args:
        task: what the values are of.
        values: whose greedy policy plays on.
        visited: episodes.
        branches: how many.
        seed: decides which states and actions are tried.
        report: called with the branches done.

    Returns:
        Samples of the tried actions and of some greedy ones later on, if their return is known.
    """
    generator = np.random.default_rng([seed, 1])
    stepper, best = task.make_stepper(), greedy(values, task.actions, generator)
    rows: list[tuple[np.ndarray, int, float, int, bool]] = []
    for number in range(branches):
        which = int(generator.integers(len(visited)))
        place = int(generator.integers(len(visited[which].actions)))
        prefix = visited[which].actions[: place + 1].copy()
        if number % 2:
            prefix[place] = generator.integers(task.actions)
        played = play(task, stepper, replay_then(prefix, best), visited[which].chance)
        returns = returns_to_go(played.rewards, values.discount, played.terminated)
        later = generator.integers(place, len(returns), size=_KEPT).tolist()
        for step in {place, *later}:
            if np.isfinite(returns[step]):
                state, action = played.observations[step], int(played.actions[step])
                rows.append((state, action, float(returns[step]), which, step == place))
        report(number + 1)
    return Samples(*(np.array(column) for column in zip(*rows, strict=True)))


def fit_correction(values: NetworkValues, samples: Samples, seed: int) -> NetworkValues:
    """The same values plus a correction of each state, fitted by least squares to returns.

    A correction of single actions would lose the policy: what is lost by one worse action is far
    smaller than the error of any fit. One for all actions of a state leaves their order as it was.

    Args:
        values: to be corrected.
        samples: what they are fitted to.
        seed: decides first weights and batches of the fit.

    Returns:
        The corrected values: one network that holds the given one and the correction side by side,
        without further values, which would need its shape.
    """
    claimed = values(samples.observations)[np.arange(len(samples.actions)), samples.actions]
    missing = samples.returns - claimed
    middle = float(missing.mean())
    # Numbers so small that the learner's Huber loss is a squared one throughout.
    scale = 2 * max(float(np.abs(missing - middle).max()), 1e-6)
    layout = values.network.layout(values.inputs, 1)
    parameters = _regress(values, layout, samples.observations, (missing - middle) / scale, seed)
    correction = named_parameters(layout, parameters)
    correction["values.weight"][...] *= scale
    correction["values.bias"][...] = correction["values.bias"] * scale + middle
    hidden = tuple(2 * units for units in values.network.hidden)
    network = values.network._replace(hidden=hidden)
    merged = np.zeros(network.layout(values.inputs, values.actions).parameters(), np.float32)
    own = named_parameters(values.layout, values.parameters)
    _merge(own, correction, named_parameters(network.layout(values.inputs, values.actions), merged))
    words = f"{values.method}; each state corrected by {len(samples.actions)} returns, seed {seed}"
    return replace(values, network=network, parameters=merged, method=words, others={})


def _regress(
    values: NetworkValues, layout: Layout, observations: np.ndarray, targets: np.ndarray, seed: int
) -> np.ndarray:
    """Parameters of a network with one output, fitted to numbers by the compiled learner."""
    learner = DoubleDQN(
        network=values.network, batch_size=_BATCH, clip="none", replay_size=len(targets),
        learning_starts=1,
    )  # fmt: skip
    stream = trial_streams(seed, ["fitted", values.digest()], range(1))[0, LEARNER]
    memory = make_memory(learner, layout, stream)
    _remember_all(memory, observations, targets)
    for rate in _RATES:
        _replay_often(as_numbers(learner._replace(learning_rate=rate)), memory, stream, _UPDATES)
    return memory.parameters


@compiled_apart
def _remember_all(memory: DQNMemory, observations: np.ndarray, targets: np.ndarray) -> None:
    for n in range(len(targets)):
        state = observations[n]  # nothing follows it, so the reward is the target
        remember(memory, Transition(state, 0, targets[n], state, True, -1))


@compiled_apart
def _replay_often(settings: DoubleDQN, memory: DQNMemory, stream: np.ndarray, updates: int) -> None:
    for _ in range(updates):
        replay(settings, memory, stream)


def _merge(
    own: dict[str, np.ndarray], correction: dict[str, np.ndarray], merged: dict[str, np.ndarray]
) -> None:
    """Two networks side by side, the second one's output added to each of the first one's."""
    for name, place in merged.items():
        first, second = own[name], correction[name]
        if name == "values.bias":
            place[...] = first + second
        elif name == "values.weight":
            joined = (first, np.broadcast_to(second, (len(second), first.shape[1])))
            place[...] = np.concatenate(joined) if len(place) > len(first) else first + second
        elif name.endswith(".bias"):
            place[...] = np.concatenate([first, second])
        elif name == "hidden_1.weight":
            place[...] = np.concatenate([first, second], axis=1)
        else:
            place[: first.shape[0], : first.shape[1]] = first
            place[first.shape[0] :, first.shape[1] :] = second


def fit_of(values: NetworkValues, samples: Samples) -> Fit:
    """How values compare to returns.

    Args:
        values: in question.
        samples: to compare to.

    Returns:
        Bias and absolute error, each a mean over episodes of their means.
    """
    claimed = values(samples.observations)[np.arange(len(samples.actions)), samples.actions]
    errors = claimed - samples.returns
    _, group = np.unique(samples.episodes, return_inverse=True)
    counts = np.bincount(group)
    return Fit(
        *(
            mean_with_error(np.bincount(group, weights) / counts)
            for weights in (errors, np.abs(errors))
        )
    )
