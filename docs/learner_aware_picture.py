"""What a transition learner is led to believe, step by step; part of `make_learner_aware.py`.

The learner, the assistants and the task are the package's own.
"""

from typing import Any, NamedTuple

import make_pictures as pictures
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from qbumpers import Assistant, Noise, Situation, Step, make_assistant, solve
from qbumpers.analysis.figures.style import figure
from qbumpers.learners import Perception, QLearner, perceive
from qbumpers.learners.interface import Rates, Table
from qbumpers.learners.perception import PROPOSED, believed
from qbumpers.learners.q_learning import learn
from qbumpers.simulation import make_condition
from qbumpers.tasks import cliff_walking

UP, RIGHT, DOWN, LEFT = range(4)
STATE, START, RATE, TIMES = 30, 36, 0.3, 3
BELIEVED = {STATE - 12: 70.0, STATE + 1: 80.0, STATE - 1: 60.0, START: 60.0}
"""What the learner believes to get from the cells around."""

HERE = {UP: 69.0, RIGHT: 79.0, DOWN: 79.0, LEFT: 59.0}
UNNOTICED: Any = Perception(notices=0.0)._replace(credits=PROPOSED)  # a transition learner's
NAMES, MOVES = ("up", "right", "down", "left"), ((0, -0.5), (0.9, 0), (0, 0.95), (-0.9, 0))
WHEN = ("Believed before", "after down once", "twice", "three times")
INK, PLAIN = "#0072b2", "#b8b8b0"


class Course(NamedTuple):
    """What is executed when down is proposed again and again, and what is then believed here.

    Attributes:
        executed: an action per time.
        beliefs: float64 [1 + times, A], before and after each.
    """

    executed: list[int]
    beliefs: np.ndarray


def table() -> np.ndarray:
    """The learner's action values before, float64 [S, A]."""
    values = np.zeros((48, 4))
    for state, value in BELIEVED.items():
        values[state] = value
    values[STATE] = [HERE[action] for action in range(4)]
    return values


def knowing(assistant: Assistant) -> Any:
    """The memory of an assistant that has seen how the learner came to its table."""
    memory = assistant.start(make_condition(cliff_walking(), assistant).model())
    mirrors = getattr(memory, "mirrors", None)
    if mirrors is not None:
        mirrors.values[:] = table()[:, :, None]
        mirrors.best[:] = table().max(axis=1)[:, None]
    return memory


def course(assistant: Assistant) -> Course:
    """Let a transition learner propose down, see what is executed, and learn."""
    task, learner = cliff_walking(), Table(table(), (0,) * 4)
    values = np.asarray(solve(task).table)
    memory, executed, beliefs = knowing(assistant), [], [learner.values[STATE].copy()]
    for time in range(TIMES):
        situation = Situation(
            state=STATE, values=values[STATE], others=np.zeros((0, 4)), proposed=DOWN, earned=0.0,
            discount=1.0, start_value=float(values[START].max()), episode=time, step=0,
        )  # fmt: skip
        decision = assistant.decide(situation, Noise(0.0, 0.0), memory)
        place = (STATE, decision.action, 0)
        reward, after = float(task.reward[place]), int(task.next_state[place])
        experience = perceive(UNNOTICED, DOWN, decision.action, False, reward, 0.0)
        learn(
            QLearner(), learner, believed(experience, STATE, after, False), Rates(0.1, RATE),
            np.zeros(4, np.uint64),
        )  # fmt: skip
        memory = assistant.observe(memory, Step(
            episode=time, state=STATE, proposed=DOWN, executed=decision.action, undone=False,
            credited=DOWN, overridden=decision.action != DOWN, probability=decision.probability,
            coin=0.0, tie=0.0, values=values[STATE], projected_return=0.0, reward=reward,
            next_state=after, events=0,
        ))  # fmt: skip
        executed.append(decision.action)
        beliefs.append(learner.values[STATE].copy())
    return Course(executed, np.array(beliefs))


def rows() -> dict[str, Assistant]:
    """The assistants whose overrides are shown, by what they execute."""
    return {
        "The best action": make_assistant("maximal"),
        "The second best": make_assistant("stochastic-q-bumpers", alpha=0.2, second=True),
        "What misleads least": make_assistant("learner-aware-bumpers", alpha=0.1),
        "A lesson first": make_assistant("learner-aware-bumpers", alpha=0.4),
    }


def belief_picture() -> Figure:
    """A row per assistant: what is executed for down, and what is believed after each time."""
    shown = {name: course(assistant) for name, assistant in rows().items()}
    with figure(11, 8.2) as drawing:
        panels = drawing.subplots(len(shown), TIMES + 2, width_ratios=(1.5, *[1] * (TIMES + 1)))
        for line, (name, found) in zip(panels, shown.items(), strict=True):
            _draw_executed(line[0], found, name)
            for time, axes in enumerate(line[1:]):
                _draw_beliefs(axes, found, time)
        for time, axes in enumerate(panels[0, 1:]):
            axes.set_title(WHEN[time])
    return drawing


def _draw_executed(axes: Axes, found: Course, name: str) -> None:
    pictures.draw_corner(axes)
    pictures.draw_arrow(axes, MOVES[DOWN], pictures.OWN, "dashed")
    for action in dict.fromkeys(found.executed):
        pictures.draw_arrow(axes, MOVES[action], INK, "solid")
    axes.set_title(name)
    axes.set_xlabel(", then ".join(dict.fromkeys(NAMES[each] for each in found.executed)))


def _draw_beliefs(axes: Axes, found: Course, time: int) -> None:
    beliefs = found.beliefs[time]
    inks = [pictures.OWN if action == DOWN else PLAIN for action in range(4)]
    axes.barh(NAMES, beliefs, color=inks)
    for action, value in enumerate(beliefs):
        weight = "bold" if action == DOWN else "normal"
        axes.annotate(f"{value:.0f}", (max(value, 0) + 3, action), va="center", weight=weight)
    axes.set(xlim=(-30, 110), xticks=[])
    axes.axvline(0, color="black", linewidth=0.8)
    axes.invert_yaxis()
    axes.grid(visible=False)
    axes.spines[["bottom", "left"]].set_visible(False)
    axes.tick_params(axis="y", length=0)
    if time:
        axes.set_xlabel(f"executed: {NAMES[found.executed[time - 1]]}")
