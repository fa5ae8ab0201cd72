"""What other code made is not used again, what the same code made is, and nothing is lost."""

import json
import shutil
from typing import Any

import pytest

from qbumpers.assistants import register_assistant
from qbumpers.experiments import identity, work
from qbumpers.experiments.local import ThisMachine
from qbumpers.experiments.plan import make_plan
from qbumpers.experiments.run import run_experiment
from qbumpers.experiments.sources import make_experiment
from qbumpers.experiments.store import load
from tests.assistants.own_rules import NoOptions
from tests.experiments.examples import cells_of, contents_of, rows_of, settings

BOTH = [{"name": "mine"}, {"name": "none"}]


def continued(folder, trials=2, **changes: Any):
    """Trials that were there, those of each condition that were simulated now, and what is said."""
    reports, done = [], {}
    finish = work.run_condition

    def spy(condition, *, trials, seed):
        name = f"{condition.assistant.name}@{condition.learner_type.name}"
        done.setdefault(name, []).extend(trials)
        return finish(condition, trials=trials, seed=seed)

    changes = {"assistants": BOTH, "trials": trials, **changes}
    with pytest.MonkeyPatch.context() as patch:
        plan = make_plan(make_experiment(settings(**changes)))
        patch.setattr(work, "run_condition", spy)
        run_experiment(plan, folder, backend=ThisMachine(1), report=reports.append)
    return reports[0].trials, done, reports[0].changed


CHANGED = "the code of {} changed since they were simulated; {} simulated again"


@pytest.mark.parametrize(
    ("name", "old", "new", "what"),
    [
        ("own_rule", "proposed), 1.0)", "proposed), 0.0)", "own_rule.mine"),
        ("own_helper", "+ 1", "+ 2", "own_helper.chosen"),
    ],
)
def test_a_rule_that_was_edited_is_simulated_again(own_files, tmp_path, name, old, new, what):
    own_files.register_rule()
    assert continued(tmp_path) == (0, {"mine@q-learning": [0, 1], "none@q-learning": [0, 1]}, [])
    before = contents_of(tmp_path, "cells/**/*")
    own_files.register_rule()  # the same text in another file
    assert continued(tmp_path) == (4, {}, [])
    own_files.edit(name, old, new)
    own_files.register_rule()
    said = [f"mine: {CHANGED.format(what, '2 trials are')}"]
    assert continued(tmp_path) == (2, {"mine@q-learning": [0, 1]}, said)
    assert continued(tmp_path) == (4, {}, [])
    assert before.items() < contents_of(tmp_path, "cells/**/*").items()
    continued(tmp_path / "anew")
    assert rows_of(tmp_path) == rows_of(tmp_path / "anew")


def test_more_trials_never_mix_what_different_code_made(own_files, tmp_path):
    own_files.register_rule()
    continued(tmp_path)
    own_files.edit("own_helper", "(proposed + 1)", "(0 * proposed)")
    own_files.register_rule()
    there, done, [said] = continued(tmp_path, trials=3)
    assert (there, done) == (2, {"mine@q-learning": [0, 1, 2], "none@q-learning": [2]})
    assert said.endswith("; 2 trials are simulated again")
    continued(tmp_path / "anew", trials=3)
    assert rows_of(tmp_path) == rows_of(tmp_path / "anew")


def test_code_that_is_again_what_it_was_finds_its_trials(own_files, tmp_path):
    own_files.register_rule()
    continued(tmp_path)
    first = rows_of(tmp_path)
    own_files.edit("own_helper", "+ 1", "+ 2")
    own_files.register_rule()
    continued(tmp_path, trials=1)
    assert rows_of(tmp_path) != first
    own_files.edit("own_helper", "+ 2", "+ 1")
    own_files.register_rule()
    assert continued(tmp_path) == (4, {}, [])
    assert rows_of(tmp_path) == first


def test_comments_and_docstrings_change_nothing(own_files, tmp_path):
    own_files.register_rule()
    continued(tmp_path)
    own_files.edit("own_rule", "    return", '    """Why."""\n    # and why\n\n    return')
    own_files.register_rule()
    assert continued(tmp_path) == (4, {}, [])


def test_a_learner_that_was_edited_is_simulated_again(own_files, tmp_path):
    changes: dict[str, Any] = {"learners": [{"name": "own"}], "assistants": [{"name": "none"}]}
    own_files.register_learner()
    assert continued(tmp_path, **changes)[0] == 0
    own_files.register_learner()
    assert continued(tmp_path, **changes) == (2, {}, [])
    own_files.edit(
        "own_learner", "settings.first + state) % 4\n\ndef prefer", "state) % 4\n\ndef prefer"
    )
    own_files.register_learner()
    said = [f"none: {CHANGED.format('own_learner.choose', '2 trials are')}"]
    assert continued(tmp_path, **changes) == (0, {"none@own": [0, 1]}, said)


def test_several_conditions_that_changed_alike_are_said_in_one_line(own_files, tmp_path):
    mine: dict[str, Any] = {"assistants": [{"name": "mine", "alpha": [0.1, 0.2, 0.3]}]}
    own_files.register_rule()
    continued(tmp_path, **mine)
    own_files.edit("own_helper", "+ 1", "+ 2")
    own_files.register_rule()
    _, _, said = continued(tmp_path, **mine)
    assert said == [
        f"mine/alpha=0.1 and 2 more conditions: "
        f"{CHANGED.format('own_helper.chosen', '6 trials are')}"
    ]


def test_a_revision_that_was_raised_is_named(own_files, tmp_path):
    own_files.register_rule()
    continued(tmp_path, trials=1)
    own_files.register_rule(revision=2)
    assert continued(tmp_path, trials=1)[2] == [
        "mine: the revision of assistant mine was 1 and is 2; 1 trial is simulated again"
    ]


def test_a_rule_without_source_is_never_used_again_and_the_line_says_why(own_registry, tmp_path):
    space: dict[str, Any] = {"__name__": "typed"}
    exec("def mine(s, n, o):\n    return Decision(s.proposed, 0.0)", space)
    from qbumpers import Decision

    space["Decision"] = Decision
    register_assistant("mine", NoOptions)(space["mine"])
    continued(tmp_path)
    assert continued(tmp_path) == (
        2,
        {"mine@q-learning": [0, 1]},
        [
            "mine: what decides them cannot be known (there is no source of typed.mine); 2 trials "
            "are simulated again"
        ],
    )
    [unknown] = [
        parts["unknown"]
        for parts in json.loads((tmp_path / "conditions.json").read_text())["identities"].values()
        if "unknown" in parts
    ][:1]
    assert unknown == ["there is no source of typed.mine"]


def marks_removed(folder):
    """As a version left it that noted no identities."""
    (folder / "conditions.json").unlink()
    design = folder / "experiment.toml"
    design.write_text(design.read_text().replace("format = 3", "format = 2"))
    for path in cells_of(folder):
        parts = path.name.split("-")
        path.rename(path.with_name("-".join([*parts[:-2], parts[-1]])))


def test_an_old_folder_goes_on_with_what_is_not_the_user_s_own(own_files, tmp_path):
    own_files.register_rule()
    continued(tmp_path)
    marks_removed(tmp_path)
    assert load(tmp_path).episodes.height == 4 * 4
    there, done, said = continued(tmp_path)
    assert (there, done) == (2, {"mine@q-learning": [0, 1]})
    assert said == [
        "mine: what they were simulated with was not noted; 2 trials are simulated again"
    ]
    assert continued(tmp_path) == (4, {}, [])


def test_an_old_folder_does_not_go_on_with_what_has_another_revision_by_now(
    own_files, tmp_path, monkeypatch
):
    own_files.register_rule()
    continued(tmp_path)
    marks_removed(tmp_path)
    monkeypatch.setattr("qbumpers.simulation.tabular.REVISION", 2)
    assert continued(tmp_path)[:2] == (0, {"mine@q-learning": [0, 1], "none@q-learning": [0, 1]})


def test_without_the_note_cells_are_known_by_their_names(own_files, tmp_path):
    own_files.register_rule()
    continued(tmp_path)
    shutil.copy(tmp_path / "conditions.json", tmp_path / "kept.json")
    lost = (tmp_path / "kept.json").read_bytes().replace(b'"identities"', b'"other"')
    for content in (None, b"", b"{}", b"[1]", b"nonsense", b'{"conditions": 3}', lost):
        path = tmp_path / "conditions.json"
        path.unlink() if content is None else path.write_bytes(content)
        assert continued(tmp_path) == (4, {}, [])
        assert path.read_bytes() == (tmp_path / "kept.json").read_bytes()


def test_the_code_is_looked_at_once_by_the_one_who_asks(own_files, tmp_path, monkeypatch):
    seen = []
    found = identity.meaning_of
    monkeypatch.setattr(identity, "meaning_of", lambda things: seen.append(1) or found(things))
    own_files.register_rule()
    continued(tmp_path, assistants=[{"name": "mine", "alpha": [0.1, 0.2]}], trials=3)
    assert len(seen) == 1


def test_a_stopped_run_of_other_code_does_not_pass_old_rows_off_as_its_own(own_files, tmp_path):
    own_files.register_rule()
    continued(tmp_path)
    own_files.edit("own_helper", "+ 1", "+ 2")
    own_files.register_rule()

    def stop(progress):
        raise KeyboardInterrupt

    plan = make_plan(make_experiment(settings(assistants=BOTH, trials=2)))
    with pytest.raises(KeyboardInterrupt):
        run_experiment(plan, tmp_path, backend=ThisMachine(1), report=stop)
    with pytest.raises(ValueError, match="the run is not finished"):
        load(tmp_path)
