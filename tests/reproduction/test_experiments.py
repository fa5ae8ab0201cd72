"""The built-in experiments hold what Figure 2 of the paper compares."""

from pathlib import Path

import pytest

import qbumpers.reproduction as reproduction_package
from qbumpers.errors import RequestError
from qbumpers.experiments.design import REPRODUCTIONS
from qbumpers.experiments.plan import make_plan
from qbumpers.reproduction.experiments import (
    command,
    deviations,
    overlaid,
    profiles,
    reproduction,
)
from qbumpers.values import TabularValues
from tests.narrowing import of_kind

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

PROFILES = ("figures", "text")
SENSITIVITY = {
    "dueling": {".learners.0.network.dueling": (0, 256)},
    "learning-rate-5e-4": {".learners.0.learning_rate": (1e-3, 5e-4)},
    "long-exploration": {".learners.0.epsilon.fraction": (0.1, 1.0)},
    "relu": {".learners.0.network.activation": ("tanh", "relu")},
}
TENTHS = [n / 10 for n in range(11)]
EXTRA = [*(n / 100 for n in range(91, 100)), *(n / 1000 for n in range(991, 1000))]


def leaves(data, path=""):
    """Every number and word of nested settings, by its path."""
    if not isinstance(data, dict | list):
        return {path: data}
    parts = data.items() if isinstance(data, dict) else enumerate(data)
    return {k: v for key, part in parts for k, v in leaves(part, f"{path}.{key}").items()}


def test_there_are_two_published_experiments_with_their_profiles():
    folder = Path(reproduction_package.__file__).parent
    folders = {path.parent.name for path in folder.glob("*/profiles")}
    assert {name.replace("-", "_") for name in REPRODUCTIONS} == folders
    assert folders == {"cliff_walking", "lunar_lander"}
    assert profiles("cliff-walking") == list(PROFILES)
    assert profiles("lunar-lander") == ["figures", *SENSITIVITY]


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
    assert of_kind(TabularValues, plan.values).table[36].max() == 87  # V*(s_0) of the paper
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


def alphas_of(experiment, name):
    return [
        named.assistant.options.alpha
        for named in experiment.conditions()
        if named.assistant.name == name
    ]


def differences(first, second):
    """What differs between two experiments, by its path."""
    before, after = (leaves(each.model_dump()) for each in (first, second))
    assert before.keys() == after.keys()
    return {path: (before[path], after[path]) for path in before if before[path] != after[path]}


def test_figure_4_has_both_methods_by_tenths_and_18_more_thresholds():
    experiment = reproduction("lunar-lander")
    assert len(EXTRA) == 18
    assert alphas_of(experiment, "stochastic-q-bumpers") == TENTHS
    assert alphas_of(experiment, "local-q-thresholding") == sorted(TENTHS + EXTRA)
    conditions = [named.condition for named in experiment.conditions()]
    assert conditions[:2] == ["none", "maximal"]
    assert len(set(conditions)) == len(conditions) == 2 + 11 + 29
    assert (experiment.trials, experiment.episodes) == (10, 2000)
    assert (experiment.task.name, experiment.values) == ("lunar-lander", "expert")
    for named in experiment.conditions():
        options = named.assistant.options._asdict()
        assert options.get("second", False) is False
        if named.assistant.name == "stochastic-q-bumpers":
            assert (options["v_min"], options["p_max"]) == (0.0, 0.999)


def test_the_learners_of_figure_4_are_the_papers():
    [design] = reproduction("lunar-lander").learners
    learner = design.learner(task_discount=0.99)
    assert (design.name, design.perception) == ("double-dqn", "transition")
    assert tuple(learner.network) == ((64, 64), "tanh", 0)
    assert (learner.discount, learner.learning_rate) == (0.99, 1e-3)
    assert tuple(learner.epsilon) == (1.0, 0.02, 0.1)
    assert (learner.batch_size, learner.replay_size, learner.learning_starts) == (32, 50_000, 1000)
    assert (learner.target_every, learner.gradient_limit) == (1500, 10.0)


@pytest.mark.parametrize("profile", SENSITIVITY)
def test_a_sensitivity_profile_differs_in_one_thing_and_its_name(profile):
    found = differences(reproduction("lunar-lander"), reproduction("lunar-lander", profile))
    assert found.pop(".name") == ("lunar-lander", f"lunar-lander-{profile}")
    assert found == SENSITIVITY[profile]


@pytest.mark.parametrize("name", ["cliff-walking", "lunar-lander"])
def test_given_alphas_replace_those_of_both_methods_and_nothing_else(name):
    whole, fewer = (reproduction(name, alphas=alphas) for alphas in (None, [0.5, 1.0]))
    for method in ("local-q-thresholding", "stochastic-q-bumpers"):
        assert alphas_of(fewer, method) == [0.5, 1.0]
    assert [named.condition for named in fewer.conditions()][:2] == ["none", "maximal"]
    assert len(fewer.conditions()) == 2 + 2 * 2
    same = {"name": whole.name, "assistants": whole.assistants}
    assert fewer.model_copy(update=same) == whole


def same_learner(learner):
    return learner.model_copy(update={"epsilon": None})


def decays(experiment):
    return [int(each.epsilon.fraction * experiment.episodes) for each in experiment.learners]


@pytest.mark.parametrize("profile", ["figures", *SENSITIVITY])
def test_the_quick_version_has_both_methods_and_a_folder_of_its_own(profile):
    quick = reproduction("lunar-lander", profile, quick=True)
    assert quick.name == reproduction("lunar-lander", profile).name + "-quick"
    assert {named.assistant.name for named in quick.conditions()} == {
        "none", "maximal", "local-q-thresholding", "stochastic-q-bumpers",
    }  # fmt: skip
    whole = reproduction("lunar-lander", profile)
    assert [same_learner(each) for each in quick.learners] == [
        same_learner(each) for each in whole.learners
    ]
    if profile != "long-exploration":  # whose exploration cannot end later than the episodes do
        assert decays(quick) == decays(whole) == [200]
    pairs = (
        len(quick.conditions()) * quick.trials * quick.episodes * 250
    )  # an assisted step and an unassisted one
    assert pairs * 51e-6 / 2 < 200  # seconds on two cores, of the five minutes that it may take


@pytest.mark.parametrize(
    ("changes", "name"),
    [
        ({"trials": 2}, "lunar-lander"),  # as many more can be added to them later
        ({"episodes": 2000}, "lunar-lander"),
        ({"episodes": 50}, "lunar-lander-episodes-50"),
        ({"alphas": [0.5, 1.0]}, "lunar-lander-alphas-0.5-1"),
        ({"values": "my experts/best one.npz"}, "lunar-lander-values-best-one"),
        ({"quick": True, "trials": 9}, "lunar-lander-quick"),
        ({"quick": True, "episodes": 50, "alphas": [0]}, "lunar-lander-quick-episodes-50-alphas-0"),
    ],
)
def test_what_cannot_go_on_where_the_published_one_was_has_another_name(changes, name):
    made = reproduction("lunar-lander", **changes)
    assert made.name == name
    for field in changes.keys() & {"trials", "episodes", "values"}:
        assert getattr(made, field) == changes[field]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"alphas": [0.5, 1.5]}, r"alpha = 1\.5: .*less than or equal to 1"),
        ({"alphas": []}, r"alpha = \[\]; at least one value"),
        ({"alphas": [0.5, 0.5]}, r"alpha=0\.5 occurs 2 times"),
        ({"profile": "text"}, r"unknown profile 'text'.* Known: figures, dueling, learning-rate"),
        ({"episodes": 0}, r"lunar-lander, profile figures: episodes = 0: "),
    ],
)
def test_a_wrong_version_is_refused(changes, message):
    with pytest.raises(RequestError, match=message):
        reproduction("lunar-lander", **changes)


def test_there_is_no_quick_version_of_what_takes_seconds():
    with pytest.raises(RequestError, match=r"quick: cliff-walking has no quick version; --trials"):
        reproduction("cliff-walking", quick=True)


def test_settings_are_overlaid_table_by_table():
    base = {"a": 1, "t": {"x": 1, "y": {"z": 2}}, "l": [{"p": 1, "q": 2}], "n": [1, 2]}
    changes = {"b": 3, "t": {"y": {"z": 4}}, "l": [{"q": 5}], "n": [9]}
    assert overlaid(base, changes) == {
        "a": 1, "b": 3, "t": {"x": 1, "y": {"z": 4}}, "l": [{"p": 1, "q": 5}], "n": [9],
    }  # fmt: skip
    longer = {"l": [{"q": 5}, {"q": 6}]}
    assert overlaid(base, longer)["l"] == longer["l"]


@pytest.mark.parametrize("name", REPRODUCTIONS)
def test_every_profile_is_the_papers_experiment_whatever_its_size(name):
    for profile in profiles(name):
        whole = reproduction(name, profile)
        assert deviations(whole) == []
        changes = {"trials": 3, "seed": 5, "criterion": 1.0, "common_random_numbers": True}
        assert deviations(reproduction(name, profile, **changes)) == []


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"episodes": 20}, ["episodes = 20, not 100"]),
        ({"alphas": [0.5]}, ["other assistants"]),
        ({"values": "q-learning"}, ["values = 'q-learning', not 'exact'"]),
        ({"episodes": 20, "alphas": [1.0]}, ["other assistants", "episodes = 20, not 100"]),
    ],
)
def test_what_makes_it_another_experiment_is_named(changes, words):
    assert deviations(reproduction("cliff-walking", **changes)) == words


def test_the_command_of_a_profile_repeats_it_and_other_experiments_have_none():
    made = reproduction("lunar-lander", "relu", trials=3, seed=5)
    assert command(made) == "qbumpers reproduce lunar-lander --profile relu --trials 3 --seed 5"
    assert command(made.model_copy(update={"episodes": 9})) == ""
    assert command(made.model_copy(update={"reproduces": None})) == ""
