"""Rules, learners and environments of a user's own in files that tests edit."""

import importlib
import sys
import warnings

import gymnasium

from qbumpers.assistants import register_assistant
from qbumpers.learners import register_learner

RULE = """
from typing import NamedTuple

from own_helper import chosen
from qbumpers import Decision

class Options(NamedTuple):
    alpha: float = 0.5

def mine(situation, noise, options):
    return Decision(chosen(situation.proposed), 1.0)
"""

HELPER = """
def chosen(proposed):
    return (proposed + 1) % 4
"""

LEARNER = """
from typing import NamedTuple

import numpy as np

class Settings(NamedTuple):
    discount: float = 1.0
    first: int = 0

class Values(NamedTuple):
    values: np.ndarray

def start(settings, shape, stream):
    return Values(np.zeros((shape.states, len(shape.width))))

def choose(settings, memory, state, rates, stream):
    return (settings.first + state) % 4

def prefer(settings, memory, state, tie):
    return (settings.first + state) % 4

def policy(settings, memory, state, rates, out):
    out[:] = 0.25

def learn(settings, memory, transition, rates, stream):
    memory.values[transition.state, transition.action] += 1.0
"""

ENVIRONMENT = """
import gymnasium
import numpy as np

GROUND = 3.0

class Walk(gymnasium.Env):
    observation_space = gymnasium.spaces.Box(-9, 9, (1,), np.float32)
    action_space = gymnasium.spaces.Discrete(2)

    def __init__(self, step=1.0):
        self.step_size = step

    def reset(self, *, seed=None, options=None):
        self.place = 0.0
        return np.zeros(1, np.float32), {}

    def step(self, action):
        self.place += self.step_size * (2 * action - 1)
        ended = abs(self.place) > GROUND
        return np.array([self.place], np.float32), -1.0, ended, False, {}
"""


class OwnFiles:
    """Modules of a user's own in a folder, imported anew each time, as new processes would."""

    NAMES = ("own_rule", "own_helper", "own_learner", "own_environment")

    def __init__(self, place, patch):
        self._place, self._patch = place, patch
        self.texts: dict[str, str] = dict(
            zip(self.NAMES, (RULE, HELPER, LEARNER, ENVIRONMENT), strict=True)
        )
        self._number = 0

    def edit(self, name, old, new):
        """Edit a file; everything must be registered again."""
        assert old in self.texts[name]
        self.texts[name] = self.texts[name].replace(old, new)

    def imported(self, name):
        """A module of the files as they are now."""
        self._number += 1
        place = self._place / str(self._number)
        place.mkdir()
        for each in self.NAMES:
            (place / f"{each}.py").write_text(self.texts[each], encoding="utf-8")
            self._patch.delitem(sys.modules, each, raising=False)
        self._patch.syspath_prepend(place)
        importlib.invalidate_caches()
        return importlib.import_module(name)

    def register_rule(self, name="mine", **changes):
        module = self.imported("own_rule")
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # not compiled: that would take longer
            register_assistant(name, module.Options, **changes)(module.mine)

    def register_learner(self, **changes):
        module = self.imported("own_learner")
        parts = {p: getattr(module, p) for p in ("start", "choose", "prefer", "policy", "learn")}
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # an edited one may not be compiled
            register_learner("own", module.Settings, **parts, **changes)

    def register_environment(self, **given):
        module = self.imported("own_environment")
        gymnasium.registry.pop("own/Walk-v0", None)
        gymnasium.register(
            "own/Walk-v0", entry_point=module.Walk, max_episode_steps=9, kwargs=given
        )
