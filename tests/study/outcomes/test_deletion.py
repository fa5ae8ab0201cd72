"""Forgetting: from the records, their bytes and every export; and the recruitment's side."""

import pytest

from qbumpers.errors import RequestError
from qbumpers.study.flow.forgetting import delete_identities
from qbumpers.study.flow.running import back_up, restore
from qbumpers.study.flow.tables import participants_in, read_records
from qbumpers.study.outcomes.deletion import forget
from qbumpers.study.outcomes.export import export_study
from qbumpers.study.outcomes.reading import read_participants
from qbumpers.study.outcomes.recruitment import (
    bonus_of,
    bonus_table,
    identities_in,
    reconcile,
)


def bytes_under(folder):
    return b"".join(path.read_bytes() for path in folder.rglob("*") if path.is_file())


@pytest.mark.parametrize("by", ["identifier", "identity"])
def test_one_participant_is_forgotten_everywhere(engine, study, setups, tmp_path, by):
    folder = tmp_path / "exported"
    export_study(engine, study, setups, folder)
    (folder / "report.html").write_text("numbers of all", encoding="utf-8")
    identities = identities_in(engine)
    identity, participant = next(iter(identities.items()))
    assert participant.encode() in bytes_under(tmp_path)
    before = len(participants_in(engine))
    reached = forget(engine, study, setups, participant if by == "identifier" else identity)
    assert reached == [folder]
    engine.dispose()
    assert participant.encode() not in bytes_under(tmp_path)
    assert f"{identity}\x00".encode() not in bytes_under(tmp_path)
    assert not (folder / "report.html").exists()
    assert len(participants_in(engine)) == before - 1
    with pytest.raises(RequestError, match="the records have none of that name"):
        forget(engine, study, setups, participant)


def test_identities_go_and_data_stay(engine, study):
    people = len(participants_in(engine))
    assert delete_identities(engine) == people
    assert identities_in(engine) == {}
    assert len(read_participants(engine, study)) == people


def test_a_backup_can_be_restored(engine, study, tmp_path):
    records, copy = tmp_path / "simulated.sqlite", tmp_path / "copy.sqlite"
    with engine.connect():  # in use
        back_up(records, copy)
    expected = participants_in(engine)
    with pytest.raises(RequestError, match="something is there already"):
        restore(copy, records)
    engine.dispose()
    records.unlink()
    for more in tmp_path.glob("simulated.sqlite-*"):
        more.unlink()
    restore(copy, records)
    again = read_records(records)
    assert participants_in(again) == expected
    again.dispose()
    (tmp_path / "bad.sqlite").write_bytes(copy.read_bytes()[:5000])
    with pytest.raises(RequestError, match="backup"):
        restore(tmp_path / "bad.sqlite", tmp_path / "other.sqlite")


def test_the_recruitment_is_compared(study, participants, engine, tmp_path):
    identities = identities_in(engine)
    outcomes = {p.name: p.now.outcome for p in participants}
    complete = [i for i, name in identities.items() if outcomes[name] == "complete"]
    dropped = [i for i, name in identities.items() if outcomes[name] != "complete"]
    assert dropped
    rows = dict.fromkeys(complete, ("APPROVED", "C")) | dict.fromkeys(dropped, ("RETURNED", ""))
    table = tmp_path / "prolific.csv"

    def write(rows):
        lines = [f"sub,{i},{status},{code}" for i, (status, code) in rows.items()]
        head = "Submission id,Participant id,Status,Completion code"
        table.write_text("\n".join([head, *lines]) + "\n", encoding="utf-8")
        return reconcile(study, participants, identities, table)

    assert write(rows) == []
    wrong = {**rows, dropped[0]: ("AWAITING REVIEW", "C"), complete[0]: ("RETURNED", ""),
             complete[1]: ("APPROVED", "S"), "stranger": ("APPROVED", "C")}  # fmt: skip
    del wrong[complete[2]]
    assert {each.identity for each in write(wrong)} == {
        dropped[0], complete[0], complete[1], complete[2], "stranger",
    }  # fmt: skip
    table.write_text("id\n1\n", encoding="utf-8")
    with pytest.raises(RequestError, match="it has no column 'Completion code'"):
        reconcile(study, participants, identities, table)


def test_bonuses_follow_the_rule(study, participants, engine):
    identities = identities_in(engine)
    lines = bonus_table(study, participants, identities).splitlines()
    owed = dict(line.split(",") for line in lines)
    for identity, name in identities.items():
        [each] = [p for p in participants if p.name == name]
        mean = each.measure("posttest")
        expected = min(0.5, max(0.0, 0.1 * (mean + 10))) if each.now.outcome == "complete" else 0.0
        assert bonus_of(study.bonus, each) == round(expected, 2)
        assert float(owed.get(identity, 0)) == round(expected, 2)
    assert owed
