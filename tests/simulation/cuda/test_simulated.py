"""Threads of a simulated card do what the processor does: `make test-gpu-compile` runs these.

They need a process of their own, with NUMBA_ENABLE_CUDASIM=1 and NUMBA_DISABLE_JIT=1.
"""

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("numba_cuda", reason="the extra gpu is not installed")
if os.environ.get("NUMBA_ENABLE_CUDASIM") != "1":
    pytest.skip("NUMBA_ENABLE_CUDASIM is not 1", allow_module_level=True)
pytestmark = pytest.mark.gpu_compile

import qbumpers  # noqa: E402
from qbumpers.conformance import check_conformance, small_tasks, small_values  # noqa: E402
from qbumpers.errors import RequestError  # noqa: E402
from qbumpers.experiments.cells import Cell  # noqa: E402
from qbumpers.experiments.on_card import GraphicsCard  # noqa: E402
from qbumpers.experiments.plan import make_plan  # noqa: E402
from qbumpers.experiments.work import finish  # noqa: E402
from qbumpers.reproduction.experiments import reproduction  # noqa: E402
from qbumpers.simulation import Card, make_condition, run, simulate_means, tabular  # noqa: E402
from qbumpers.simulation.cuda import agreement as agreement_module  # noqa: E402
from qbumpers.simulation.cuda import engine  # noqa: E402
from qbumpers.simulation.cuda.agreement import agreement  # noqa: E402
from qbumpers.tasks.corridors import vector_corridor  # noqa: E402
from tests.assistants.examples import EXAMPLES  # noqa: E402
from tests.narrowing import present  # noqa: E402
from tests.simulation.cuda import cases  # noqa: E402
from tests.simulation.cuda.cases import LAYERS, OF_STATES, SEED  # noqa: E402

CARD = Card()


def check_steps(condition, trials=range(1, 3)):
    found = list(engine.records(condition, trials, SEED, CARD))
    for trial, steps in zip(trials, found, strict=True):
        alone = tabular.record(condition, range(trial, trial + 1), SEED, None)
        cases.assert_same_steps(steps, alone)


@pytest.mark.parametrize("name", EXAMPLES)
def test_a_rule_does_the_same_on_a_card(name):
    assistant = qbumpers.make_assistant(name, **EXAMPLES[name])
    tables = [task for task in small_tasks(assistant) if task.states]
    assert check_conformance(assistant, tasks=tables)
    for task in tables:
        check_steps(make_condition(
            task, assistant, values=small_values(task, assistant), episodes=3, retention=1
        ))  # fmt: skip


@pytest.mark.parametrize("name", OF_STATES)
def test_a_learner_does_the_same_on_a_card(name):
    check_steps(cases.with_learner(name))


@pytest.mark.parametrize("layers", LAYERS)
def test_layers_around_a_learner_are_the_same_on_a_card(layers):
    check_steps(cases.with_learner("q-learning", **LAYERS[layers]))


@pytest.mark.parametrize("most", [1, 3, 100])
def test_groups_of_trials_are_those_of_the_processor_however_they_share_blocks(monkeypatch, most):
    monkeypatch.setattr(engine, "_MOST_TRIALS", most)
    condition = cases.with_learner("sarsa")
    groups = [range(2), range(2, 6), range(9, 10)]
    found = list(engine.run_groups(condition, groups, SEED, CARD))
    for group, simulation in zip(groups, found, strict=True):
        expected = run(condition, trials=group, seed=SEED)
        for one, other in zip(simulation.outcomes, expected.outcomes, strict=True):
            np.testing.assert_array_equal(one, other)
        for one, other in zip(present(simulation.counts), present(expected.counts), strict=True):
            np.testing.assert_array_equal(one, other)


def test_simulate_on_a_card_is_simulate_on_the_processor():
    on_card, on_processor = (
        qbumpers.simulate("cliff-walking", "maximal", device=device, trials=2, episodes=3, seed=1)
        for device in ("gpu", "processor")
    )
    for one, other in zip(on_card.outcomes, on_processor.outcomes, strict=True):
        np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize("most", [2, 100])
def test_means_found_on_a_card_are_those_of_its_episodes(monkeypatch, most):
    monkeypatch.setattr(engine, "_MOST_TRIALS", most)
    setup: dict[str, Any] = {"trials": 5, "episodes": 3, "retention": 2, "seed": 1}
    means = simulate_means("frozen-lake", "none", device="gpu", **setup)
    outcomes = qbumpers.simulate("frozen-lake", "none", **setup).outcomes
    for name, found in means._asdict().items():
        expected = getattr(outcomes, name)[:, :3].mean(axis=1)
        np.testing.assert_allclose(found, expected, rtol=1e-15)


@pytest.mark.parametrize(
    ("register", "message"),
    [
        (cases.register_wrong_action, "the rule's action is not a whole number in"),
        (cases.register_wrong_probability, "the rule's probability of an override does not lie in"),
        (cases.register_raising, "this rule has had enough"),
    ],
)
@pytest.mark.filterwarnings("ignore:.*cannot be compiled")
def test_what_a_rule_does_wrong_is_said_as_on_the_processor(register, message):
    check_message(make_condition("cliff-walking", register(), episodes=3), message)


def test_what_a_learner_does_wrong_is_said_as_on_the_processor():
    learner = cases.register_wrong_learner()
    condition = make_condition("cliff-walking", "none", learner=learner, episodes=3)
    check_message(condition, "the learner's action is not a whole number in")


def check_message(condition, message):
    messages = []
    for card in (None, CARD):
        with pytest.raises((RequestError, ValueError), match=message) as raised:
            run(condition, trials=3, seed=SEED, card=card)
        messages.append(str(raised.value))
    assert messages[0] == messages[1]


def test_a_trial_that_comes_to_no_end_is_done_by_the_processor(monkeypatch):
    condition = cases.with_learner("q-learning")
    launch = engine.cards.launch

    def without_the_second(space, arguments, trials):
        launch(space, arguments, trials)
        *_, sinks, found = arguments
        assert found.finished.all()
        lost = range(1, 2)
        counts = present(run(condition, trials=lost).counts)
        for array, counted in zip(found.totals, counts, strict=True):
            array[0] -= counted  # a thread that ends early counts nothing
        found.finished[1] = 0
        for array in sinks.outcomes:
            array[1] = 0

    monkeypatch.setattr(engine.cards, "launch", without_the_second)
    found, expected = (run(condition, trials=3, card=card) for card in (CARD, None))
    parts = [(*each.outcomes, *present(each.counts)) for each in (found, expected)]
    for one, other in zip(*parts, strict=True):
        np.testing.assert_array_equal(one, other)
    means = engine.run_means(condition, range(3), 0, CARD)
    np.testing.assert_allclose(means.overrides, expected.outcomes.overrides.mean(axis=1))


def test_a_learner_that_draws_what_it_begins_with_is_refused():
    learner = cases.register_drawing_learner()
    condition = make_condition("cliff-walking", "none", learner=learner, episodes=1)
    with pytest.raises(RequestError, match="learner drawing: its start draws what it begins with"):
        run(condition, trials=1, card=CARD)


def test_only_tasks_with_a_table_are_simulated_on_a_card():
    task, assistant = vector_corridor(), qbumpers.make_assistant("none")
    condition = make_condition(task, assistant, values=small_values(task, assistant))
    with pytest.raises(RequestError, match="on a GPU only tasks with a table are simulated"):
        run(condition, trials=1, card=CARD)


def test_cells_of_a_card_are_those_of_the_processor():
    design = reproduction("cliff-walking", trials=4, episodes=2, alphas=[0.7])
    plan = make_plan(design, card=CARD)
    contents = list(plan.conditions)[-2:]
    cells = [Cell(content, first, 2) for content in contents for first in (0, 2)]
    found = {each.cell: each for each in GraphicsCard(CARD)(plan, dict.fromkeys(cells, 0.0))}
    assert list(found) == cells
    for cell in cells:
        assert found[cell] == finish(plan.conditions[cell.content], cell, design.seed)


def test_results_of_a_card_are_used_again_by_a_card_alone(call, tmp_path):
    command = ("reproduce", "cliff-walking", "--trials", 2, "--episodes", 2, "--alphas", 0.7)
    command += ("--out", tmp_path)
    status, output, _ = call(*command, "--on", "gpu")
    assert status == 0
    assert "8 to run" in output
    _, output, _ = call(*command, "--on", "gpu")
    assert "All trials are there already" in output
    for other in (("--on", "gpu", "--precision", "float32"), ()):
        _, output, errors = call(*command, *other)
        assert "8 to run" in output
        assert "the precision was" in output + errors or "the processor was gpu" in output + errors


def test_an_agreement_tells_where_trials_part(monkeypatch):
    condition = cases.with_learner("q-learning")
    assert agreement(condition, 3, SEED, CARD)[1] == 0
    taken = list(engine.records(condition, range(3), SEED, CARD))
    executed, probability = taken[1].executed.copy(), taken[2].probability.copy()
    executed[4] += 1
    probability[2] += 0.25
    taken[1], taken[2] = (
        taken[1]._replace(executed=executed), taken[2]._replace(probability=probability)
    )  # fmt: skip
    monkeypatch.setattr(agreement_module, "records", lambda *arguments: iter(taken))
    found = agreement(condition, 3, SEED, CARD)
    steps = len(taken[0].state) + 4 + len(taken[2].state)
    assert found == (3, 1, steps, 1, 0.25)


def test_the_script_that_measures_a_card_runs():
    root = Path(__file__).parents[3]
    command = [sys.executable, "docs/run_gpu.py", "--quick"]
    finished = subprocess.run(command, cwd=root, capture_output=True, text=True, check=True)
    assert "two-rate: 0 of 2 trials part" in finished.stdout
    assert "plain kernel: " in finished.stdout
    assert "cliff-walking, persistent" in finished.stdout
    assert "4 points of 4 learners" in finished.stdout


def test_numbers_are_kept_in_half_the_memory_if_that_is_asked_for():
    condition = cases.with_learner("q-learning")
    half = run(condition, trials=2, card=Card(precision="float32"))
    assert half.outcomes.assisted_return.shape == (2, 3)
