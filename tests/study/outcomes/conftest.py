"""One rehearsal that all tests of what comes of a study look at."""

import datetime
import shutil

import pytest

from tests.play.conftest import MISSING

if MISSING:
    collect_ignore_glob = ["test_*.py"]

CODES = {"complete": "C", "screened_out": "S", "failed": "F", "no_consent": "N"}


@pytest.fixture(scope="session")
def study():
    from qbumpers.study.design.sources import make_study

    consent = {"kind": "consent", "version": "2", "text": "Do you agree?"}
    return make_study({
        "name": "small-study",
        "title": "A small study",
        "contact": "me@example.org",
        "keep_identities_until": datetime.date(2030, 1, 1),
        "seed": 7,
        "task": "cliff-walking",
        "step_limit": 6,
        "recruitment": {"by": "prolific", "codes": CODES},
        "conditions": [
            {"name": "alone", "assistant": "none"},
            {"name": "helped", "assistant": {"name": "random-override", "probability": 0.5}},
        ],
        "factors": [{"name": "seen", "levels": [{"name": "no", "overrides": "hidden"},
                                                {"name": "yes", "overrides": "shown"}]}],
        "parts": [
            consent,
            {"kind": "block", "phase": "pretest", "episodes": 1},
            {"kind": "block", "phase": "training", "episodes": 3, "probe_every": 1,
             "attribution": 3},
            {"kind": "block", "phase": "posttest", "episodes": 2},
            {"kind": "questionnaire", "instrument": "nasa-tlx"},
            {"kind": "questionnaire", "id": "own", "items": [
                {"id": "why", "text": "Why, \"how\",\nand when?", "kind": "text"}]},
            {"kind": "debriefing", "text": "Thanks."},
        ],
        "analysis": {"measure": "posttest", "first": "helped", "second": "alone"},
        "bonus": {"per_point": 0.1, "above": -10.0, "most": 0.5},
        "rehearsal": {"drop_out": 0.15, "reload": 0.3, "slow": 0.0},
    })  # fmt: skip


@pytest.fixture(scope="session")
def setups(study):
    from qbumpers.study.design.sources import setups_of

    return setups_of(study)


@pytest.fixture(scope="session")
def rehearsed(study, setups, tmp_path_factory):
    """The records of 26 simulated learners, and how many ended how."""
    from qbumpers.study.bots.rehearsing import rehearse
    from qbumpers.study.flow.tables import open_study

    path = tmp_path_factory.mktemp("rehearsal") / "simulated.sqlite"
    engine = open_study(path, study.name, "simulated", "digest")
    return path, rehearse(study, setups, engine, 26)


@pytest.fixture
def engine(rehearsed, tmp_path):
    """A copy of the records, which a test may change."""
    from qbumpers.study.flow.tables import read_records

    path = tmp_path / "simulated.sqlite"
    shutil.copy(rehearsed[0], path)
    engine = read_records(path)
    yield engine
    engine.dispose()


@pytest.fixture(scope="session")
def participants(rehearsed, study):
    from qbumpers.study.flow.tables import read_records
    from qbumpers.study.outcomes.reading import read_participants

    engine = read_records(rehearsed[0])
    found = read_participants(engine, study)
    engine.dispose()
    return found
