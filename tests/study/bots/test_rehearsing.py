"""Simulated learners take part as people do, and learn as in a simulation."""

from collections import Counter

import pytest

from qbumpers.errors import RequestError
from qbumpers.learners import learners
from qbumpers.study.bots.rehearsing import rehearse, without_waiting
from qbumpers.study.design.sources import setups_of
from qbumpers.study.flow.standing import standing
from qbumpers.study.flow.tables import events_of, open_study
from qbumpers.study.outcomes.reading import read_participants
from tests.study.flow.studies import CHECK, block, study_of

TABULAR = [name for name, kind in learners().items() if kind.observes == "states"]


def rehearsed(study, path, participants):
    engine = open_study(path / "simulated.sqlite", study.name, "simulated", "digest")
    found = rehearse(without_waiting(study), setups_of(study), engine, participants)
    return found, open_study(path / "simulated.sqlite", study.name, "simulated", "digest")


def test_everybody_goes_all_the_way_with_drop_outs_reloads_and_later_sittings(tmp_path):
    study = study_of(
        {"kind": "device-check"}, CHECK, block("training", 2, probe_every=1, attribution=1),
        {"kind": "sitting", "after_days": 3, "within_days": 1}, block("retention"),
        {"kind": "questionnaire", "instrument": "background"},
        rehearsal={"drop_out": 0.3, "reload": 0.6, "slow": 0.2},
    )  # fmt: skip
    found, engine = rehearsed(study, tmp_path, 12)
    assert found.outcomes.keys() == {"complete", "dropped out"}
    assert found.reloads >= found.outcomes["complete"]  # a sitting is begun by a reload
    events = events_of(engine)
    outcomes = Counter(standing(study, each).outcome or "dropped out" for each in events.values())
    assert outcomes == found.outcomes
    for participant in read_participants(engine, study):
        if participant.now.outcome:
            assert [len(each.episodes) for each in participant.blocks] == [4, 1]
    engine.dispose()


def test_a_learner_that_learns_gets_better(tmp_path):
    study = study_of(
        block("pretest", 2), block("training", 40), block("posttest", 2), step_limit=30,
        conditions=[{"name": "alone", "assistant": "none"}],
        rehearsal={"learners": [{"name": "model-based"}], "drop_out": 0.0, "reload": 0.0,
                   "slow": 0.0},
    )  # fmt: skip
    _, engine = rehearsed(study, tmp_path, 2)
    for participant in read_participants(engine, study):
        assert participant.measure("gain") > 50
        assert participant.measure("posttest") > 50  # the goal gives 100
    engine.dispose()


@pytest.mark.slow
@pytest.mark.parametrize("name", TABULAR)
def test_any_learner_of_tables_takes_part(tmp_path, name):
    study = study_of(
        block("training", 2, probe_every=1),
        rehearsal={"drop_out": 0.0, "learners": [
            {"name": name},
            {"name": name, "motor": {"slip": 0.2, "lag": 0.1}, "forgetting": {"decay": 0.5}},
        ]},
    )  # fmt: skip
    found, engine = rehearsed(study, tmp_path, 4)
    assert found.outcomes == {"complete": 4}
    engine.dispose()


def test_a_class_list_that_is_too_short_is_refused(tmp_path):
    study = study_of(block("training"), recruitment={"by": "class", "class_list": ["ab12"]})
    with pytest.raises(RequestError, match="class_list has 1 codes; simulate at most as many"):
        rehearsed(study, tmp_path, 2)


@pytest.mark.slow
def test_a_task_in_real_time_is_flown_by_a_learner_of_vectors(tmp_path):
    study = study_of(
        block("pretest"), block("training", 2, probe_every=1, attribution=2),
        task="lunar-lander", step_limit=40,
        conditions=[
            {"name": "b", "assistant": {"name": "stochastic-q-bumpers", "alpha": 0.5}}
        ],
        rehearsal={"learners": [{"name": "double-dqn"}], "drop_out": 0.0, "reload": 1.0},
    )  # fmt: skip
    found, engine = rehearsed(study, tmp_path, 2)
    assert found.outcomes == {"complete": 2}
    for participant in read_participants(engine, study):
        lengths = [[episode.length for episode in each.episodes] for each in participant.blocks]
        assert lengths == [[40], [40] * 4]
    engine.dispose()
