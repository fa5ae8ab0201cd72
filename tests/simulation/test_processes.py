"""What a script registers reaches processes, however the script is started."""

import subprocess
import sys

import pytest

SCRIPT = """
from __future__ import annotations

import warnings
from typing import Annotated, NamedTuple

import gymnasium
import numpy as np
from pydantic import Field

import qbumpers
from qbumpers import Network, NetworkValues

PUSH = 0.5


class Line(gymnasium.Env):
    observation_space = gymnasium.spaces.Box(-10, 10, (1,), np.float32)
    action_space = gymnasium.spaces.Discrete(2)

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.place = self.np_random.uniform(-1, 1)
        return np.array([self.place], np.float32), {}

    def step(self, action):
        self.place += PUSH * (2 * action - 1)
        ended = abs(self.place) > 3
        return np.array([self.place], np.float32), float(self.place), ended, False, {}


class Options(NamedTuple):
    often: Annotated[float, Field(ge=0, le=1)] = 0.5


def guide(situation, noise, options):
    best = max(range(2), key=lambda action: situation.values.tolist()[action])
    action = best if noise.coin < options.often else situation.proposed
    return qbumpers.Decision(action, options.often)


def main():
    gymnasium.register("own/Line-v0", entry_point=Line, max_episode_steps=9)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        qbumpers.register_assistant("guide", Options)(guide)
    task = qbumpers.make_task("own/Line-v0", discount=0.9)
    network = Network((3,))
    numbers = np.random.default_rng(0).normal(0, 1, network.layout(1, 2).parameters())
    values = NetworkValues(network, 1, 2, numbers, discount=0.9, task=task.name, method="chance")
    print("begun")
    for workers in (1, 2):
        found = qbumpers.simulate(
            task, "guide", values=values, trials=2, episodes=3, workers=workers
        )
        print([part.tolist() for part in found.outcomes])

GUARD
    main()
"""
GUARDED = SCRIPT.replace("GUARD", 'if __name__ == "__main__":')
UNGUARDED = SCRIPT.replace("GUARD", "if True:")
STARTS = {
    "a script with a guard": (["script.py"], GUARDED, ""),
    "a script without one": (["script.py"], UNGUARDED, ""),
    "a command": (["-c", UNGUARDED], "", ""),
    "standard input": (["-"], "", UNGUARDED),
}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("arguments", "script", "standard_input"),
    [pytest.param(*start, id=name) for name, start in STARTS.items()],
)
def test_two_processes_give_the_numbers_of_one(tmp_path, arguments, script, standard_input):
    (tmp_path / "script.py").write_text(script, encoding="utf-8")
    finished = subprocess.run(
        [sys.executable, *arguments],
        input=standard_input, cwd=tmp_path, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert (finished.returncode, finished.stderr) == (0, "")
    begun, alone, together = finished.stdout.splitlines()
    assert begun == "begun"  # once: no process ran the script again
    assert alone == together
    assert len(set(alone)) > 10


LOCKED = UNGUARDED.replace("PUSH = 0.5", "import threading\nLOCK = threading.Lock()\nPUSH = 0.5")


@pytest.mark.parametrize(
    ("old", "new", "what"),
    [
        pytest.param(
            "self.place +=",
            "LOCK.locked(); self.place +=",
            "environment 'own/Line-v0'",
            marks=pytest.mark.slow,
        ),
        ("best = max(", "LOCK.locked(); best = max(", "assistant 'guide'"),
    ],
)
def test_what_cannot_be_sent_is_named(tmp_path, old, new, what):
    script = LOCKED.replace(old, new)
    finished = subprocess.run(
        [sys.executable, "-"],
        input=script, cwd=tmp_path, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert finished.returncode == 1
    message = finished.stderr.splitlines()[-1]
    assert f"{what} cannot be sent to other processes: cannot pickle" in message
    assert "lock" in message
