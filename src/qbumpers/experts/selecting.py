"""Training several experts alike, and storing the best of them in a file."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

from qbumpers.errors import checked
from qbumpers.experts.choosing import Judgement, best, judge, train_several, with_provenance
from qbumpers.experts.training import GENERAL, Recipe
from qbumpers.tasks.task import Task
from qbumpers.values.network import NetworkValues

_PAPERS = "lunar-lander"


class Selection(NamedTuple):
    """Experts trained alike, and the best of them.

    Attributes:
        seeds: N of them, one per expert.
        judgements: N of them.
        best: place of the expert that is kept, from 0.
        values: of that expert, with how it was chosen in their provenance.
        folder: where all of them are.
    """

    seeds: Sequence[int]
    judgements: Sequence[Judgement]
    best: int
    values: NetworkValues
    folder: Path


def usual_recipe(task: Task) -> Recipe:
    """The paper's recipe for its task, a general one for any other."""
    recipe = Recipe() if task.name == _PAPERS else GENERAL
    return recipe._replace(learner=recipe.learner._replace(discount=task.discount))


def make_recipe(
    task: Task,
    *,
    steps: int | None = None,
    hidden: Sequence[int] | None = None,
    activation: str | None = None,
    learning_rate: float | None = None,
    random_start: int | None = None,
) -> Recipe:
    """The usual recipe of a task, with some of its settings changed; None leaves one.

    Args:
        task: to be learned, at its discount.
        steps: environment steps of training, of each expert.
        hidden: units of each hidden layer.
        activation: what hidden units do, "tanh" or "relu".
        learning_rate: step size of Adam.
        random_start: random actions before each episode of training.

    Raises:
        RequestError: naming each setting that is out of range.
    """
    usual = usual_recipe(task)
    network = usual.learner.network
    learner = {
        **usual.learner._asdict(),
        "network": {
            "hidden": network.hidden if hidden is None else tuple(hidden),
            "activation": network.activation if activation is None else activation,
        },
        "learning_rate": usual.learner.learning_rate if learning_rate is None else learning_rate,
    }
    return usual._replace(
        learner=checked(type(usual.learner), learner, "expert"),
        steps=usual.steps if steps is None else steps,
        random_start=usual.random_start if random_start is None else random_start,
    )


def train_best(
    task: Task,
    recipe: Recipe,
    seeds: Sequence[int],
    path: Path,
    report: Callable[[int, int], None] = lambda seed, steps: None,
) -> Selection:
    """Train an expert with each seed, and keep the best in a file.

    Finished experts are in a folder beside the file, and are not trained again.

    Args:
        task: what they are to be good at.
        recipe: how each of them is trained.
        seeds: one per expert; each decides all chance of its training; not negative.
        path: where the best goes; "PATH.work" is the folder of all.
        report: called with a seed and its steps done.

    Raises:
        RequestError: if training fails or a finished expert is damaged.
        StoreError: if a file cannot be written.
    """
    folder = path.with_name(f"{path.name}.work")
    trained = train_several(task, recipe, seeds, folder, report)
    judgements = [judge(task, values) for values in trained]
    chosen = best(judgements)
    values = with_provenance(task, trained[chosen], judgements[chosen], seeds)
    values.save(path)
    return Selection(seeds, judgements, chosen, values, folder)
