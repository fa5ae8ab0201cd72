"""Study files: the example, and what is wrong with others in one readable line."""

import copy
import datetime
import re
import tomllib
from pathlib import Path
from typing import Any

import pytest

from qbumpers.errors import RequestError
from qbumpers.study.design.parts import Block
from qbumpers.study.design.sources import (
    EXAMPLE,
    check_playable,
    load_study,
    make_study,
    write_new,
)

PLAIN = {
    "name": "plain",
    "title": "A study",
    "contact": "me@example.org",
    "keep_identities_until": datetime.date(2030, 1, 1),
    "task": "cliff-walking",
    "conditions": [
        {"name": "alone", "assistant": "none"},
        {"name": "helped", "assistant": "maximal"},
    ],
    "parts": [
        {"kind": "consent", "version": "1", "text": "Do you agree?"},
        {"kind": "block", "phase": "pretest", "episodes": 1},
        {"kind": "block", "phase": "training", "episodes": 2, "probe_every": 1},
        {"kind": "block", "phase": "posttest", "episodes": 1},
        {"kind": "questionnaire", "instrument": "trust"},
        {"kind": "debriefing", "text": "Thanks."},
    ],
}


def changed(path, value):
    """The plain study with something else at a path such as "parts.1.episodes"."""
    settings = copy.deepcopy(PLAIN)
    steps: list[Any] = [int(step) if step.isdigit() else step for step in path.split(".")]
    *above, last = steps
    place: Any = settings
    for step in above:
        place = place.setdefault(step, {}) if isinstance(place, dict) else place[step]
    if isinstance(place, list) and last == len(place):
        place.append(value)
    elif isinstance(place, list) and isinstance(value, list):
        place[last:last] = value
    else:
        place[last] = value
    return settings


def test_the_example_is_a_study_that_can_be_played(tmp_path):
    write_new(tmp_path / "new.toml")
    study = load_study(tmp_path / "new.toml")
    assert set(check_playable(study)) == {"practice", "pretest", "training", "posttest"}
    assert [condition.name for condition in study.all_conditions()] == [
        "alone",
        "bumpers",
        "maximal",
    ]
    with pytest.raises(RequestError, match="it is there already"):
        write_new(tmp_path / "new.toml")


COMMENTED = re.compile(r"^# (?=\[|\w+ = )(?!values)", re.MULTILINE)


def test_what_the_example_only_mentions_can_be_said():
    text = EXAMPLE.read_text(encoding="utf-8")
    # The factor "overrides" says it for all conditions.
    text = re.sub(r'^overrides = "shown".*$', "", text, flags=re.MULTILINE)
    study = make_study(tomllib.loads(COMMENTED.sub("", text)))
    assert study.word("next") == "Weiter"
    assert study.bonus is not None
    names = [condition.name for condition in study.all_conditions()]
    assert len(names) == 8
    assert "yoked/hidden" in names
    assert study.conditions_of("bumpers") == ["bumpers/hidden", "bumpers/shown"]
    assert study.conditions_of("bumpers/shown") == ["bumpers/shown"]
    assert {part.kind for part in study.parts} == {
        "consent", "instructions", "device-check", "comprehension", "block", "questionnaire",
        "sitting", "debriefing",
    }  # fmt: skip


def test_parts_are_named_by_what_they_are():
    settings = changed("parts.5", [{"kind": "questionnaire", "instrument": "trust"}])
    study = make_study(settings)
    assert [part.id for part in study.parts] == [
        "consent", "pretest", "training", "posttest", "trust-1", "trust-2", "debriefing",
    ]  # fmt: skip
    training = study.parts[2]
    assert isinstance(training, Block)
    assert training.plan() == [True, False, True, False]


def test_orders_of_counterbalanced_parts_keep_the_others_in_place():
    settings = changed("counterbalance", [["pretest", "trust"]])
    orders = make_study(settings).orders()
    assert orders == [
        ["consent", "pretest", "training", "posttest", "trust", "debriefing"],
        ["consent", "trust", "training", "posttest", "pretest", "debriefing"],
    ]


@pytest.mark.parametrize(
    ("path", "value", "message"),
    [
        ("titel", "x", r"titel = 'x': unknown field \(did you mean 'title'\?\)"),
        ("name", "My study", "name = 'My study'"),
        ("parts.1.episodes", 0, "episodes = 0: input should be greater than or equal to 1"),
        ("parts.1.phase", "exam", "phase = 'exam': input should be 'practice', 'pretest'"),
        ("parts.1.probe_every", 1, "probe_every is for phase = 'training', and this is 'pretest'"),
        ("parts.2.probe_every", 4, "episodes = 2 must be a multiple of probe_every = 4"),
        ("parts.1.kind", "blok", "does not match any of the expected tags: 'consent'"),
        ("parts.0.text", " ", "part consent: text is missing"),
        ("parts.0", [{"kind": "instructions", "text": "x"}], "the first is instructions"),
        ("parts.4.instrument", None, "it asks nothing"),
        ("parts.4.items", [{"id": "trust", "text": "Why?", "kind": "text"}],
         "item trust occurs twice"),
        ("parts.4.items", [{"id": "a", "text": "Why?", "kind": "choice", "options": ["x"]}],
         r"item a: options = \['x'\]"),
        ("parts.4.items", [{"id": "a", "text": "Why?", "least": 3, "most": 2}],
         "least = 3.0 must be below most = 2.0"),
        ("conditions.0.assistant", {"name": "stochastic-q-bumpers", "alpha": [0.1, 0.2]},
         "is 2 assistants; make each a level"),
        ("conditions.0.yoked_to", "helped", "yoked_to = 'helped' and an assistant; give one"),
        ("conditions.2", {"name": "y", "yoked_to": "nobody"}, "yoked_to = 'nobody'; one of alone"),
        ("conditions.2", {"name": "y"}, "0 of its levels say who assists"),
        ("conditions.2", {"name": "alone", "assistant": "none"}, "level alone occurs twice"),
        ("factors", [{"name": "f", "levels": [{"name": "x", "assistant": "none"},
                                              {"name": "y", "assistant": "none"}]}],
         "2 of its levels say who assists"),
        ("counterbalance", [["pretest", "exam"]], "unknown part of counterbalance 'exam'"),
        ("counterbalance", [["pretest", "debriefing"]], "must lie in one sitting"),
        ("words.nxt", "x", r"unknown key of words 'nxt' \(did you mean 'next'\?\)"),
        ("words.code", "Code: {cod}", r"\{cod\} is not filled in; allowed: \{code\}"),
        ("words.code", "Code: {code", "words.code = 'Code: {code'"),
        ("recruitment.by", "class", "with 0 codes in class_list"),
        ("recruitment.by", "prolific", "complete, screened_out, failed, no_consent missing"),
        ("recruitment.codes", {"complete": "X", "failed": "X"}, "each outcome needs another code"),
        ("analysis", {"measure": "retention", "first": "alone", "second": "helped"},
         "needs blocks of phase retention"),
        ("analysis", {"measure": "posttest", "first": "alone", "second": "help"},
         r"unknown condition of analysis 'help' \(did you mean 'helped'\?\)"),
        ("analysis", {"measure": "posttest", "first": "alone", "second": "alone"},
         "first = 'alone' and second = 'alone' have conditions in common"),
        ("bonus", {"phase": "transfer", "per_point": 1.0, "above": 0.0, "most": 1.0},
         "unknown phase of bonus 'transfer'"),
        ("rehearsal.learners", [{"name": "sarsa", "lambda": 2}], "lambda = 2: unknown field"),
        ("parts.5", [{"kind": "sitting", "after_days": 1, "within_days": 1}],
         "nothing happens after sitting"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_named_in_one_line(path, value, message):
    with pytest.raises(RequestError, match=message) as error:
        make_study(changed(path, value))
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("path", "value", "message"),
    [
        ("conditions.1.assistant", "angel", "unknown assistant 'angel'"),
        ("conditions.1.assistant", {"name": "stochastic-q-bumpers", "alpha": 1, "v_min": 500},
         "condition helped: assistant stochastic-q-bumpers: v_min = 500 must be below"),
        ("parts.1.task", "clif-walking", "block pretest: unknown task 'clif-walking'"),
        ("rehearsal.learners", [{"name": "double-dqn"}], "learner 'double-dqn' observes vectors"),
    ],
)  # fmt: skip
def test_what_cannot_be_played_is_named(path, value, message):
    with pytest.raises(RequestError, match=message):
        check_playable(make_study(changed(path, value)))


def test_files_that_cannot_be_read_are_named(tmp_path):
    with pytest.raises(RequestError, match="No such file"):
        load_study(tmp_path / "none.toml")
    (tmp_path / "bad.toml").write_text("name = ", encoding="utf-8")
    with pytest.raises(RequestError, match="not valid TOML"):
        load_study(tmp_path / "bad.toml")


def test_the_example_that_ships_is_the_one_that_a_new_file_begins_as():
    shipped = Path(__file__).parents[3] / "examples" / "study.toml"
    assert shipped.read_text(encoding="utf-8") == EXAMPLE.read_text(encoding="utf-8")
