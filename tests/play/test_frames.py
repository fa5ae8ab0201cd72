"""A replay shows what the player saw, state by state, from the records alone."""

import json
import sqlite3

import numpy as np
import pytest

from qbumpers.play.frames import episodes_of, frames_of
from qbumpers.play.game import Choice, Game
from qbumpers.play.setup import Setup
from qbumpers.play.tables import open_records, read_moments, read_session
from qbumpers.play.views import state_view
from tests.narrowing import present
from tests.play.recording import record
from tests.play.serving import AROUND, DOWN, RIGHT, UP

BUMPERS = Choice("stochastic-q-bumpers", {"alpha": 0.5})
ADAPTING = Choice("expert-mixing", {"decay": 0.5})


def frames(setup, path, number):
    engine = open_records(path)
    recorded = present(read_session(engine, "one"))
    moments = read_moments(engine, "one")
    engine.dispose()
    return frames_of(setup, recorded, number, moments)


def changed(path, statement):
    raw = sqlite3.connect(path)
    assert raw.execute(statement).rowcount
    raw.commit()
    raw.close()


@pytest.mark.parametrize("task", ["cliff-walking", "lunar-lander", "hidden-goal"])
@pytest.mark.parametrize("choice", [BUMPERS, ADAPTING, Choice("undo", {})])
def test_a_replay_shows_what_the_player_saw(task, choice, tmp_path):
    setup = Setup(task)
    actions = [k * k % setup.task.actions for k in range(25)]
    if choice.name == "expert-mixing" and task == "lunar-lander":
        actions = actions[:10]
    path = tmp_path / "play.sqlite"
    ends = [*actions, *[1] * 1000] if task == "lunar-lander" else [*actions, *[UP] * 1000]
    record(setup, path, [(choice, ends), (choice, actions)])
    game = Game(setup, 11)
    shown = []
    for steps in (ends, actions):
        game.begin(choice)
        shown.append([state_view(game)])
        for action in steps:
            if game.playing:
                game.propose(action)
                shown[-1].append(state_view(game))
    for number, expected in enumerate(shown):
        found = frames(setup, path, number)
        assert len(found) == len(expected)
        for frame, state in zip(found, expected, strict=True):
            for what in ("scene", "words", "last", "view"):
                assert frame[what] == state[what]
            assert frame["step"] == state["episode"]["length"]
            assert frame["total"] == state["episode"]["total"]
            assert frame["overrides"] == state["episode"]["overrides"]


def test_a_frame_says_how_its_step_came_about(cliff, tmp_path):
    path = tmp_path / "play.sqlite"
    record(cliff, path, [(BUMPERS, AROUND), (BUMPERS, [UP, RIGHT])])
    first, second, third = frames(cliff, path, 1)
    assert (first["device"], first["reaction"], first["seconds"]) == ("", None, None)
    assert (second["device"], second["reaction"], second["seconds"]) == ("keyboard", 400, None)
    assert (third["reaction"], third["seconds"]) == (400, 0.5)
    assert 0 <= third["coin"] < 1


def test_what_comes_out_differently_is_shown_as_it_was_recorded(cliff, tmp_path):
    path = tmp_path / "play.sqlite"
    record(cliff, path, [(BUMPERS, [UP, RIGHT, RIGHT, RIGHT])])
    honest = frames(cliff, path, 0)
    changed(path, "update steps set reward = -7 where number = 1")
    found = frames(cliff, path, 0)
    assert found[:2] == honest[:2]
    assert [frame["words"] for frame in found] == [frame["words"] for frame in honest]
    assert [frame["total"] for frame in found] == [0, -1, -8, -9, -10]
    chances = found[2]["view"]["probabilities"]
    assert [chance is None for chance in chances] == [True, False, True, True]
    np.testing.assert_allclose(found[3]["view"]["projected"], -9 + np.array(
        honest[3]["view"]["values"]
    ))  # fmt: skip
    assert found[3]["view"]["floor"] == honest[3]["view"]["floor"] == 87 - 0.5 * 87


def test_a_session_of_another_revision_is_shown_as_it_was_recorded(cliff, tmp_path):
    path = tmp_path / "play.sqlite"
    record(cliff, path, [(BUMPERS, [UP, RIGHT, DOWN])])
    honest = frames(cliff, path, 0)
    changed(
        path, "update sessions set setup = replace(setup, '\"revision\": 1', '\"revision\": 0')"
    )
    found = frames(cliff, path, 0)
    assert [frame["scene"] for frame in found] == [frame["scene"] for frame in honest]
    for frame, before in zip(found[:-1], honest[:-1], strict=True):
        assert frame["view"]["values"] == before["view"]["values"]
        np.testing.assert_allclose(frame["view"]["projected"], before["view"]["projected"])
    assert found[-1]["view"] is None  # of a step that was not recorded nothing is known


def test_what_the_assistant_could_not_see_is_not_made_up(tmp_path):
    setup = Setup("hidden-goal")
    path = tmp_path / "play.sqlite"
    record(setup, path, [(BUMPERS, [UP, RIGHT, DOWN])])
    changed(path, "update steps set reward = -7 where number = 1")
    assert len(frames(setup, path, 0)) == 2


def test_every_frame_is_json(lander, tmp_path):
    path = tmp_path / "play.sqlite"
    record(lander, path, [(BUMPERS, [2, 1, 0])])
    found = frames(lander, path, 0)
    assert json.loads(json.dumps(found)) == found


def test_episodes_say_what_they_came_to(cliff, tmp_path):
    path = tmp_path / "play.sqlite"
    record(cliff, path, [(BUMPERS, AROUND), (BUMPERS, [])])
    engine = open_records(path)
    won, begun = episodes_of(present(read_session(engine, "one")))
    engine.dispose()
    assert (won["total"], won["length"], won["success"], won["over"]) == (87, 13, True, True)
    assert (begun["episode"], begun["length"], begun["over"]) == (1, 0, False)
    assert [frame["step"] for frame in frames(cliff, path, 1)] == [0]
