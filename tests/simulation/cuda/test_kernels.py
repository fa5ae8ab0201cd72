"""Every kernel compiles to PTX; and what it is compiled from does what plain Python does."""

import contextlib
import importlib
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("numba_cuda", reason="the extra gpu is not installed")
pytestmark = pytest.mark.gpu_compile

from qbumpers import make_assistant  # noqa: E402
from qbumpers.assistants import register_assistant  # noqa: E402
from qbumpers.borrowing import scratch  # noqa: E402
from qbumpers.compilation import compiles  # noqa: E402
from qbumpers.decisions import Decision  # noqa: E402
from qbumpers.errors import RequestError  # noqa: E402
from qbumpers.learners import QLearner  # noqa: E402
from qbumpers.learners.schedules import Schedule  # noqa: E402
from qbumpers.simulation import Card, make_condition, run, tabular  # noqa: E402
from tests.assistants.examples import EXAMPLES  # noqa: E402
from tests.narrowing import present  # noqa: E402
from tests.simulation.cuda import cases  # noqa: E402
from tests.simulation.cuda.cases import LAYERS, OF_STATES, SEED  # noqa: E402

if not compiles():
    pytest.skip("in the simulator nothing is compiled", allow_module_level=True)

from qbumpers.simulation.cuda import engine  # noqa: E402
from tests.simulation.cuda.compiled import (  # noqa: E402
    compile_kernel,
    compile_plain,
    empty_array,
    own_arrays,
)
from tests.simulation.cuda.executed import run_on_processor  # noqa: E402

TRIALS = range(2)


def check_steps(condition):
    kernel = compile_kernel(condition, TRIALS, recorded=True, seed=SEED)
    assert kernel.ptx.count(".visible .entry") == 1
    assert ".extern .func" not in kernel.ptx  # nothing is left to be found when it is loaded
    _, found, steps = run_on_processor(kernel)
    assert found.finished.tolist() == [1] * len(TRIALS)
    for trial, taken in zip(TRIALS, steps, strict=True):
        alone = range(trial, trial + 1)
        expected = tabular.record(condition, alone, SEED, None, interpreted=True)
        cases.assert_same_steps(taken, expected)


@pytest.mark.parametrize("name", EXAMPLES)
def test_a_kernel_with_a_rule_takes_the_steps_of_plain_python(name):
    check_steps(cases.with_rule(name))


@pytest.mark.parametrize("name", OF_STATES)
def test_a_kernel_with_a_learner_takes_the_steps_of_plain_python(name):
    check_steps(cases.with_learner(name))


@pytest.mark.parametrize("layers", LAYERS)
def test_a_kernel_with_layers_takes_the_steps_of_plain_python(layers):
    check_steps(cases.with_learner("q-learning", **LAYERS[layers]))


def test_outcomes_and_counts_are_those_of_the_processor():
    condition = cases.with_learner("q-learning", retention=1)
    outcomes, found, _ = run_on_processor(compile_kernel(condition, range(3, 6), seed=SEED))
    expected = run(condition, trials=range(3, 6), seed=SEED)
    for one, other in zip(outcomes, expected.outcomes, strict=True):
        np.testing.assert_array_equal(one, other)
    for one, other in zip(found.totals, present(expected.counts), strict=True):
        np.testing.assert_array_equal(one[0], other)


def test_half_the_precision_is_enough_for_whole_numbers():
    learner = QLearner(learning_rate=Schedule(1.0, 1.0))  # values are sums of rewards
    condition = make_condition(
        "cliff-walking", make_assistant("stochastic-q-bumpers", alpha=0.7), learner=learner,
        episodes=4,
    )  # fmt: skip
    kernel = compile_kernel(condition, TRIALS, "float32", seed=SEED)
    assert kernel.begun.minds.learner.values.first.dtype == np.float32
    outcomes, found, _ = run_on_processor(kernel)
    assert found.finished.all()
    expected = run(condition, trials=TRIALS, seed=SEED).outcomes
    np.testing.assert_array_equal(outcomes.assisted_return, expected.assisted_return)
    np.testing.assert_array_equal(outcomes.unassisted_return, expected.unassisted_return)


@pytest.mark.parametrize(
    "register",
    [cases.register_wrong_action, cases.register_wrong_probability, cases.register_raising],
)
def test_a_trial_in_which_something_is_raised_comes_to_no_end(register):
    condition = make_condition("cliff-walking", register(), episodes=3)
    _, found, _ = run_on_processor(compile_kernel(condition, TRIALS, seed=SEED))
    assert not found.finished.any()


def test_a_trial_whose_learner_chooses_no_action_comes_to_no_end():
    learner = cases.register_wrong_learner()
    condition = make_condition("cliff-walking", "none", learner=learner, episodes=3)
    _, found, _ = run_on_processor(compile_kernel(condition, TRIALS, seed=SEED))
    assert not found.finished.any()


@pytest.mark.parametrize("kind", ["float32", "float64"])
@pytest.mark.parametrize("bits", ["32 bits", "64 bits"])
def test_the_kernel_that_benchmarks_compare_with_compiles(kind, bits, monkeypatch):
    monkeypatch.syspath_prepend(Path(__file__).parents[3] / "benchmarks")
    plain = importlib.import_module("plain_gpu")
    assert ".visible .entry" in compile_plain(plain, kind, bits)


@pytest.mark.parametrize(
    ("register", "message"),
    [
        (cases.register_allocating, "assistant allocating, .* on a GPU: .* decide makes an array"),
        (cases.register_sorting, "assistant sorting, .* on a GPU: .* sort makes an array"),
    ],
)
def test_a_rule_of_ones_own_that_makes_arrays_is_refused_in_words(register, message, monkeypatch):
    condition = make_condition("cliff-walking", register(), episodes=1)

    def compiled(space, arguments, trials):
        compile_kernel(condition)

    monkeypatch.setattr(engine.cards, "sent", lambda arguments: arguments)
    monkeypatch.setattr(engine.cards, "launch", compiled)
    monkeypatch.setattr(engine.cards, "chosen", lambda card: contextlib.nullcontext())
    monkeypatch.setattr(engine.cards, "free_bytes", lambda card: 1 << 30)
    monkeypatch.setattr(engine.cards, "own_arrays", own_arrays)
    monkeypatch.setattr(engine.cards, "empty_array", empty_array)
    with pytest.raises(RequestError, match=message):
        run(condition, trials=1, card=Card())


def test_a_trial_without_space_for_intermediate_results_comes_to_no_end():
    def greedy_for_space(situation, noise, options):
        much = scratch((100, 100), 1.0)
        return Decision(situation.proposed, 0.0 * much[99, 99])

    register_assistant("greedy for space", cases.NoOptions)(greedy_for_space)
    condition = make_condition("cliff-walking", "greedy for space", episodes=1)
    _, found, _ = run_on_processor(compile_kernel(condition, TRIALS, seed=SEED))
    assert not found.finished.any()
    assert run(condition, trials=1, seed=SEED).steps > 0
