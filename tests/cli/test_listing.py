"""`qbumpers list` names what deep learners need."""

from qbumpers.learners import PERCEPTIONS
from tests.texts import words


def test_tasks_observed_as_vectors_are_listed(call):
    status, output, _ = call("list", "tasks")
    assert status == 0
    for name in ("lunar-lander", "CartPole-v1", "LunarLander-v3"):
        assert any(line.startswith(f"{name} ") for line in output.splitlines())


def test_both_ways_of_learning_are_listed_with_every_perception(call):
    status, output, _ = call("list", "learners")
    assert status == 0
    rows = [line.split()[:2] for line in output.splitlines()]
    for name in PERCEPTIONS:
        assert ["q-learning", name] in rows
        assert ["double-dqn", name] in rows
    assert "tasks observed as vectors by double-dqn" in words(output)
