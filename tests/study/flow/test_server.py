"""A study over the real WebSocket: what a participant sees, and what is kept of them."""

import sqlite3

import pytest

from qbumpers.study.flow.standing import standing
from qbumpers.study.flow.tables import events_of, open_study, participants_in
from tests.play.serving import RIGHT, UP
from tests.study.flow.studies import CHECK, Participant, block, served_study, study_of

WHOLE = [
    {"kind": "instructions", "text": "Read this.\n\n- one\n- two"},
    {"kind": "device-check", "most_latency": 300},
    CHECK,
    block("pretest"),
    block("training", 2, probe_every=1),
    {"kind": "questionnaire", "instrument": "trust"},
]
DEVICE = {"keyboard": True, "touch": False, "width": 800, "height": 600, "refresh": 60}
TRUST = {"reliable": 4, "trust": 1, "understood": 7, "wanted": 2}


@pytest.fixture
def path(tmp_path):
    return tmp_path / "pilot.sqlite"


def events_in(study, path):
    engine = open_study(path, study.name, "pilot", "digest")
    found = events_of(engine)
    engine.dispose()
    return found


def contents(path):
    """Everything that is in a file, whatever table it is in."""
    with sqlite3.connect(path) as connection:
        return "\n".join(connection.iterdump())


def up_to_training(page):
    page.enter()
    page.go(agree=True)
    page.go()
    page.go(**DEVICE, latency=30)
    page.go(q="2")
    return page.rest()


def test_the_whole_way_from_consent_to_completion(path):
    link = "https://example.org/done?cc={code}"
    study = study_of(*WHOLE, recruitment={"codes": {"complete": "C-1"}, "return_link": link})
    with served_study(study, path) as (address, _), Participant(address) as page:
        consent = page.enter()
        assert (consent["kind"], consent["withdraw"], consent["places"]) == ("consent", False, 8)
        assert page.go(agree=True)["text"] == [{"text": "Read this."}, {"items": ["one", "two"]}]
        assert page.go()["kind"] == "device-check"
        check = page.go(**DEVICE, latency=30)
        assert "answer" not in check["items"][0]
        again = page.go(q="3")
        assert (again["wrong"], again["reminder"][0]) == (True, {"text": "Read this."})
        assert page.go(q="2")["id"] == "pretest"
        training = page.rest()
        assert (training["id"], training["episodes"], training["played"]) == ("training", 4, 0)
        assert page.rest()["items"][0]["id"] == "reliable"
        assert "code" not in page.go(**TRUST)
        end = page.go()
        assert (end["kind"], end["id"], end["code"]) == ("end", "complete", "Your code: C-1")
        assert end["link"] == "https://example.org/done?cc=C-1"
    [events] = events_in(study, path).values()
    found = standing(study, events)
    assert (found.outcome, found.place) == ("complete", 7)
    answers = {e.content["part"]: e.content for e in events if e.kind == "answered"}
    assert answers["consent"]["content"] == {"agree": True, "version": "2"}
    assert answers["trust"]["content"] == TRUST
    assert answers["trust"]["shown"] < answers["trust"]["at"]


@pytest.mark.parametrize(
    ("answers", "outcome", "code"),
    [
        ([{"agree": True}, {}, {**DEVICE, "latency": 301}], "screened_out", "S"),
        ([{"agree": True}, {}, {**DEVICE, "latency": 3}, {"q": "3"}, {"q": "3"}], "failed", "F"),
        ([{"agree": False}], "no_consent", "N"),
    ],
)
def test_each_outcome_has_its_code(path, answers, outcome, code):
    codes = {"complete": "C", "screened_out": "S", "failed": "F", "no_consent": "N"}
    study = study_of(*WHOLE, recruitment={"by": "prolific", "codes": codes})
    arrival = {"PROLIFIC_PID": "worker-9", "STUDY_ID": "st", "SESSION_ID": "se"}
    with served_study(study, path) as (address, _), Participant(address, arrival=arrival) as page:
        page.enter()
        for answer in answers:
            page.go(**answer)
        end = page.page
        assert (end["id"], end["code"]) == (outcome, f"Your code: {code}")
        assert end["link"] == f"https://app.prolific.com/submissions/complete?cc={code}"
    assert ("worker-9" in contents(path)) is (outcome != "no_consent")


def test_a_wrong_answer_is_named_and_loses_nothing(path):
    study = study_of(block("training"), {"kind": "questionnaire", "instrument": "trust"})
    with served_study(study, path) as (address, _), Participant(address) as page:
        page.enter()
        page.answer()
        assert page.next("problem")["message"] == "agree: true or false is needed"
        page.go(agree=True)
        page.answer(untrusted=0, blurs=0)
        assert page.next("problem")["message"] == "training: its episodes are not over"
        page.rest()
        for wrong, message in [
            ({**TRUST, "trust": 9}, "trust: a number from 1 to 7 is needed"),
            ({**TRUST, "trust": 1.5}, "trust: a step of 1 from 1 is needed"),
            ({"trust": 1}, "reliable: an answer is needed"),
            ({**TRUST, "more": 1}, "more: there is no such item"),
        ]:
            page.answer(**wrong)
            assert page.next("problem")["message"] == message
        assert page.go(**TRUST)["kind"] == "debriefing"


def test_late_answers_change_nothing(path):
    study = study_of(block("training"))
    with served_study(study, path) as (address, _), Participant(address) as page:
        page.enter()
        page.go(agree=True)
        page.answer(number=0, agree=False)
        page.answer(number=7)
        page.send(type="begin", episode=3, assistant="maximal")
        assert page.rest()["kind"] == "debriefing"


def test_a_reload_goes_on_in_mid_episode_and_a_second_page_takes_over(path):
    study = study_of(block("training"))
    with served_study(study, path) as (address, _), Participant(address) as first:
        first.enter()
        first.go(agree=True)
        first.begin()
        first.act(first.next("state")["number"], UP)
        with Participant(address, first.token) as second:
            assert second.enter()["id"] == "training"
            assert second.next("state")["episode"]["length"] == 1
            assert first.next("closing")["code"] == 4001
            assert [second.act(number, UP)["over"] for number in range(1, 4)] == [
                False,
                False,
                True,
            ]
            assert second.go(untrusted=0, blurs=0)["kind"] == "debriefing"


def test_who_comes_by_the_same_link_is_the_same_participant(path):
    study = study_of(block("training"), recruitment={"by": "class", "class_list": ["ab12", "cd34"]})
    with served_study(study, path) as (address, host):
        for code, kind in [("ab12", "consent"), ("ab12", "block"), ("cd34", "consent")]:
            with Participant(address, arrival={"code": code}) as page:
                assert page.enter()["kind"] == kind
                if kind == "consent":
                    page.go(agree=True)
        with Participant(address, arrival={"code": "zz99"}) as page:
            closing = page.next("closing")
            assert "This link is not one of the study" in closing["reason"]
        with Participant(address) as page:
            assert "This link is not one" in page.next("closing")["reason"]
        assert len(participants_in(host.engine)) == 2


def test_hidden_overrides_are_not_sent_and_shown_ones_are(path):
    levels = [{"name": seen, "overrides": seen} for seen in ("hidden", "shown", "explained")]
    study = study_of(
        block("training", attribution=20),
        conditions=[{"name": "helped", "assistant": "maximal"}],
        factors=[{"name": "seen", "levels": levels}],
    )
    said = {}
    with served_study(study, path) as (address, host):
        for _ in levels:
            with Participant(address) as page:
                page.enter()
                page.go(agree=True)
                states = page.episode(0, RIGHT)
                assert all("view" not in state and "last" not in state for state in states)
                assert "maximal" not in str(states)
                said[states[1]["assisted"], states[1]["override"]] = len(states)
        assert said.keys() == {
            (None, ""),
            (True, "Assistant: up instead of your right"),
            (True, "Assistant: up instead of your right, from which it expected a score of -13"),
        }
        seats = {seat.condition: seat.progress for seat in host.seats()}
    assert seats == dict.fromkeys(["helped/hidden", "helped/shown", "helped/explained"], "ongoing")


def test_was_that_you_is_asked_and_kept(path):
    study = study_of(
        block("training", 30, attribution=3), conditions=[{"name": "h", "assistant": "maximal"}]
    )
    with served_study(study, path) as (address, _), Participant(address) as page:
        page.enter()
        page.go(agree=True)
        asked = []
        for episode in range(30):
            page.begin(episode)
            state = page.next("state")
            while not state["episode"]["over"]:
                page.press(state["number"], RIGHT)
                message = page.next()
                state = message if message["type"] == "state" else page.next("state")
                if message["type"] == "ask":
                    asked.append(message)
                    page.send(
                        type="attribute", number=message["number"], answer="me", shown=1, at=2
                    )
        assert {message["text"] for message in asked} <= {
            "The last move was up. Was that you?",
            "The last move was right. Was that you?",
        }
        page.go(untrusted=0, blurs=0)
    [events] = events_in(study, path).values()
    kept = [event.content["number"] for event in events if event.kind == "attributed"]
    assert kept == [message["number"] for message in asked]
    assert 5 < len(kept) <= 90


def test_a_yoked_participant_has_as_many_overrides(path):
    study = study_of(
        block("training", 3),
        conditions=[{"name": "helped", "assistant": "maximal", "cap": 1},
                    {"name": "yoked", "yoked_to": "helped", "cap": 1}],
    )  # fmt: skip
    with served_study(study, path) as (address, host):
        with Participant(address) as page:
            page.enter()
            page.go(agree=True)
            with Participant(address) as other:  # nobody to be yoked to, and the other is full
                other.enter()
                assert other.go(agree=True)["id"] == "full"
            helped = [page.episode(number, RIGHT) for number in range(3)]
            page.go(untrusted=0, blurs=0)
        with Participant(address) as page:
            page.enter()
            page.go(agree=True)
            yoked = [page.episode(number, RIGHT) for number in range(3)]
        counts = [
            sum(bool(state["override"]) for states in episodes for state in states)
            for episodes in (helped, yoked)
        ]
        assert counts[0] == counts[1] > 0
        assert {seat.condition: bool(seat.partner) for seat in host.seats()} == {
            "helped": False,
            "yoked": True,
        }


def test_who_withdraws_leaves_nothing_but_a_tombstone(path):
    study = study_of(block("pretest"), block("training"),
                     recruitment={"by": "class", "class_list": ["secret-code"]})  # fmt: skip
    with served_study(study, path) as (address, host):
        with Participant(address, arrival={"code": "secret-code"}) as page:
            page.enter()
            page.go(agree=True)
            page.rest()
            page.begin()
            page.next("state")
            [participant] = participants_in(host.engine)
            assert participant in contents(path)
            page.send(type="withdraw")
            assert page.turn()["id"] == "withdrawn"
        assert participants_in(host.engine) == {}
    found = contents(path)
    assert "withdrawn" in found
    for bytes_ in (path.read_bytes(), *(p.read_bytes() for p in path.parent.glob("*-wal"))):
        assert participant.encode() not in bytes_
        assert b"secret-code" not in bytes_
    assert participant not in found


def test_no_address_of_a_participant_is_kept(path):
    study = study_of(block("training"))
    with served_study(study, path) as (address, _), Participant(address) as page:
        page.enter()
        page.go(agree=True)
        page.rest()
    assert "127.0.0.1" not in contents(path)


def test_later_sittings_are_refused_before_their_window(path):
    study = study_of(
        block("training"),
        {"kind": "sitting", "after_days": 1, "within_days": 1},
        block("retention"),
        recruitment={"codes": {"complete": "DAY-1"}},
    )
    with served_study(study, path) as (address, _), Participant(address) as page:
        page.enter()
        page.go(agree=True)
        wait = page.rest()
        assert (wait["kind"], wait["code"]) == ("sitting", "Your code: DAY-1")
        assert wait["wait"].startswith("Come back between ")
        page.answer()
        assert "has not begun" in page.next("problem")["message"]
        with Participant(address, page.token) as again:
            assert again.enter()["kind"] == "sitting"
