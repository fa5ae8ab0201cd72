"""What a simulated learner does as a person does: answers, habits, and playing."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from qbumpers.experiments.learner_designs import LearnerDesign
from qbumpers.play.setup import Setup
from qbumpers.study.bots.mind import Mind
from qbumpers.study.design.models import Rehearsal, Study
from qbumpers.study.design.parts import Block, Comprehension
from qbumpers.study.flow.standing import training_of


class Habits(NamedTuple):
    """How somebody takes part.

    Attributes:
        drops_at: number of the page at which they leave for good; -1 if they stay.
        reloads: probability of reloading the page at each message.
        pause: seconds before each page.
    """

    drops_at: int = -1
    reloads: float = 0.0
    pause: float = 0.0


def habits_of(rehearsal: Rehearsal, pages: int, chance: np.random.Generator) -> Habits:
    """The habits of one participant.

    Args:
        rehearsal: how many do what.
        pages: of the study.
        chance: decides.
    """
    drops, reloads, slow = chance.random(3)
    return Habits(
        drops_at=int(chance.integers(1, pages)) if drops < rehearsal.drop_out else -1,
        reloads=0.01 if reloads < rehearsal.reload else 0.0,
        pause=0.2 if slow < rehearsal.slow else 0.0,
    )


class Person:
    """A simulated learner who takes part in a study.

    Args:
        study: that they take part in; they know its right answers.
        setups: what is played in each block, by its id.
        design: kind of learner.
        number: of the participant, from 0.
    """

    def __init__(
        self, study: Study, setups: Mapping[str, Setup], design: LearnerDesign, number: int
    ) -> None:
        self._study, self._setups, self._design, self._number = study, setups, design, number
        self.chance = np.random.default_rng([study.seed, number, *b"Person"])
        self.habits = habits_of(study.rehearsal, len(study.parts), self.chance)
        self._episodes = max(1, sum(block.plan().count(True) for block in training_of(study)))
        self._minds: dict[tuple[int, int], Mind] = {}
        self._mind: Mind | None = None
        self._phase = ""
        self._begun = ("", -1)
        self._seen = -1

    def answer(self, page: Mapping[str, Any]) -> dict[str, Any]:
        """The content of an answer to a page."""
        kind = page["kind"]
        if kind == "consent":
            return {"agree": True}
        if kind == "device-check":
            latency = float(self.chance.gamma(4, 10))
            return {
                "keyboard": True, "touch": False, "width": 1280, "height": 800, "refresh": 60,
                "latency": round(latency, 1),
            }  # fmt: skip
        if kind == "comprehension":
            part = self._study.part(page["id"])
            assert isinstance(part, Comprehension)
            return {question.id: question.answer for question in part.questions}
        if kind == "questionnaire":
            return {item["id"]: self._answer_to(item) for item in page["items"]}
        return {"untrusted": 0, "blurs": 0} if kind == "block" else {}

    def attribution(self) -> str:
        """An answer to "was that you?"."""
        return str(self.chance.choice(["me", "assistant", "unsure"]))

    def play(self, block: str, state: Mapping[str, Any]) -> int | None:
        """The action that is proposed in a state; None if the episode is over.

        Args:
            block: id.
            state: as a page of a rehearsal is sent it.
        """
        exposed, episode = state["exposed"], state["episode"]
        if self._begun != (block, episode["episode"]):
            self._begin(block, episode["episode"], exposed)
        elif exposed["last"] is not None and state["number"] == self._seen + 1 and self._mind:
            self._mind.observe(exposed["last"])
        self._seen = state["number"]
        if episode["over"] or self._mind is None:
            return None
        return self._mind.propose(exposed["state"])

    def _begin(self, block: str, episode: int, exposed: Mapping[str, Any]) -> None:
        self._begun = (block, episode)
        task = self._setups[block].task
        size = (task.states or -task.observation_size, task.actions)
        if size not in self._minds:
            made = (self._setups[block], self._episodes, self._study.seed, self._number)
            self._minds[size] = Mind(self._design, *made)
        self._mind = self._minds[size]
        part = self._study.part(block)
        practises = isinstance(part, Block) and part.phase == "practice"
        self._mind.begin(learns=practises or (exposed["training"] and exposed["assisted"]))

    def _answer_to(self, item: Mapping[str, Any]) -> Any:
        if item["kind"] == "choice":
            return str(item["options"][int(self.chance.integers(len(item["options"])))])
        if item["kind"] == "text":
            return "by trying"
        steps = int((item["most"] - item["least"]) // item["step"])
        return item["least"] + item["step"] * int(self.chance.integers(0, steps + 1))
