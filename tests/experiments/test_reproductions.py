"""The built-in experiments hold what Figure 2 of the paper compares."""

import pytest

from qbumpers.experiments.design import reproductions
from qbumpers.experiments.plan import make_plan
from qbumpers.experiments.sources import PROFILES, reproduction

# Figure 2: the settings of both methods, as the paper lists them.
THRESHOLDS = [
    "1", "0.5", "0.1", "0.0197", "0.0195", "0.0193", "0.0191", "0.0189", "0.0187", "0.0186",
    "0.0184", "0.0182", "0.0181", "0",
]  # fmt: skip
BUMPERS = ["0.1", "0.2", "0.3", "0.4", "0.5", "0.6", "0.7", "0.8", "0.9", "1"]
FIGURE_2 = [
    "none",
    "maximal",
    *(f"local-q-thresholding/alpha={alpha}" for alpha in THRESHOLDS),
    *(f"stochastic-q-bumpers/alpha={alpha}" for alpha in BUMPERS),
]


def leaves(data, path=""):
    """Every number and word of nested settings, by its path."""
    if not isinstance(data, dict | list):
        return {path: data}
    parts = data.items() if isinstance(data, dict) else enumerate(data)
    return {k: v for key, part in parts for k, v in leaves(part, f"{path}.{key}").items()}


def test_there_is_one_published_experiment():
    assert reproductions() == ["cliff-walking"]


@pytest.mark.parametrize("profile", PROFILES)
def test_a_profile_holds_the_26_conditions_of_figure_2(profile):
    experiment = reproduction("cliff-walking", profile)
    assert len(FIGURE_2) == 26
    assert [named.condition for named in experiment.conditions()] == FIGURE_2
    for condition, assistant, _, learner_id in experiment.conditions():
        options = assistant.options._asdict()
        assert learner_id == "q-learning"
        assert condition.partition("=")[2] in ("", f"{options.get('alpha', 0):g}")
        if assistant.name == "local-q-thresholding":
            assert options["second"] is True
        if assistant.name == "stochastic-q-bumpers":
            settings = (options["v_min"], options["p_max"], options["second"])
            assert settings == (0.0, 0.999, True)


@pytest.mark.parametrize("profile", PROFILES)
def test_a_profile_is_the_papers_experiment(profile):
    experiment = reproduction("cliff-walking", profile)
    assert (experiment.trials, experiment.episodes) == (100, 100)
    assert experiment.reproduces == experiment.task.name == "cliff-walking"
    plan = make_plan(experiment)
    assert plan.values.table[36].max() == 87  # V*(s_0) of the paper
    for condition in plan.conditions.values():
        assert condition.perception == "transition"
        assert (condition.learner.discount, condition.learner.initial_value) == (1.0, 0.0)
        assert condition.learner.epsilon == condition.learner.learning_rate


def test_the_profiles_differ_in_the_decay_escalation_and_clipping_alone():
    figures, text = (
        leaves(reproduction("cliff-walking", profile).model_dump()) for profile in PROFILES
    )
    assert figures.keys() == text.keys()
    differing = {
        path: (figures[path], text[path]) for path in figures if figures[path] != text[path]
    }
    assert differing == {
        ".name": ("cliff-walking", "cliff-walking-text"),
        ".learners.0.epsilon.fraction": (0.9, 0.1),
        ".learners.0.learning_rate.fraction": (0.9, 0.1),
        ".assistants.3.escalate": (True, False),
        ".assistants.3.clip": (True, False),
    }


def test_changes_replace_fields_and_none_leaves_them():
    plain = reproduction("cliff-walking")
    changed = reproduction("cliff-walking", trials=7, seed=None)
    assert changed.trials == 7
    assert changed.model_copy(update={"trials": 100}) == plain
