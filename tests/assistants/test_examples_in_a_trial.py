"""Trials of every rule against plain ones: what rules remember, and what they are told."""

import numpy as np
import pytest

from qbumpers.assistants import make_assistant
from qbumpers.conformance import small_tasks, small_values
from qbumpers.decisions import Step
from qbumpers.simulation import make_condition
from qbumpers.simulation.trials import engine_of
from tests.assistants.examples import BUMPERS, EXAMPLES
from tests.reference_rules import plain_rule
from tests.reference_simulation import ReferenceTrial

SEED, TRIAL = 7, 1
PROBABILITY_TOLERANCE = {False: 1e-12, True: 1e-6}
"""Whether two beliefs of an unlikely mirror are equal can hang on the order of sums."""

ADVICE = {"budget": 30, "every": 3, "threshold": 0.5, "sure": 0.6}
EVERY_CORRECTION = {"name": "correct", "tolerance": 0.25}
FURTHER = [
    *[("advice-on-a-budget", {**ADVICE, "when": when}) for when in (
        "early", "alternating", "importance", "predictive", "jointly"
    )],
    ("budget", {"in_all": 7, "of": EVERY_CORRECTION}),
    ("budget", {"share": 0.25, "of": {"name": "undo"}}),
    ("fading", {"half_life": 2.0, "of": {"name": "undo"}}),
    ("hysteresis", {"calm": 3, "of": {"name": "budget", "per_episode": 2, "of": BUMPERS}}),
]  # fmt: skip


@pytest.mark.parametrize(("name", "options"), [*EXAMPLES.items(), *FURTHER], ids=str)
def test_every_step_is_that_of_the_plain_rule_in_a_plain_trial(name, options):
    assistant = make_assistant(name, **options)
    task = small_tasks(assistant)[0]
    condition = make_condition(
        task, assistant, values=small_values(task, assistant), episodes=12, retention=1
    )
    plain = plain_rule(name, task=task, **assistant.described())
    trial = ReferenceTrial(condition, plain.decide, seed=SEED, trial=TRIAL, observe=plain.observe)
    trial.run()
    engine, trials = engine_of(task), range(TRIAL, TRIAL + 1)
    found = engine.record(condition, trials, SEED, None, interpreted=True)
    aware = "learner-aware" in name
    for field in Step._fields:
        expected = np.array([getattr(step, field) for step in trial.steps])
        tolerance = PROBABILITY_TOLERANCE[aware] if field == "probability" else 0.0
        np.testing.assert_allclose(
            getattr(found, field), expected, rtol=0, atol=tolerance, err_msg=field
        )
    if name != "none":
        assert 0 < found.overridden.sum() < len(found.overridden) / 1.2
