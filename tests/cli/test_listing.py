"""`qbumpers list` names what deep learners need."""

from qbumpers.learners import PERCEPTIONS, learners
from tests.texts import words


def test_tasks_observed_as_vectors_are_listed(call):
    status, output, _ = call("list", "tasks")
    assert status == 0
    for name in ("lunar-lander", "CartPole-v1", "LunarLander-v3"):
        assert any(line.startswith(f"{name} ") for line in output.splitlines())


def test_every_learner_is_listed_with_what_it_learns_from(call):
    status, output, _ = call("list", "learners")
    assert status == 0
    for name, learner in learners().items():
        assert name in words(output)
        assert all(field in output for field in learner.settings_type._fields)
    assert "numbered states" in words(output)
    assert "vectors" in words(output)
    assert "qbumpers list perceptions" in words(output)


def test_every_perception_is_listed_with_what_it_credits(call):
    status, output, _ = call("list", "perceptions")
    assert status == 0
    rows = [line.split()[:4] for line in output.splitlines()]
    for name, perception in PERCEPTIONS.items():
        shown = [name, f"{perception.notices:.0%}", perception.credits, f"{perception.penalty:g}"]
        assert shown in rows
