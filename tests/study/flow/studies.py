"""Small studies, and pages of participants, for tests."""

import contextlib
import datetime
import secrets
from typing import Any

from qbumpers.study.bots.rehearsing import serving
from qbumpers.study.design.sources import make_study, setups_of
from qbumpers.study.flow.researcher import researcher_routes
from qbumpers.study.flow.server import StudyHost
from qbumpers.study.flow.tables import open_study
from tests.play.serving import Page

CONSENT = {"kind": "consent", "version": "2", "text": "Do you agree?"}
DEBRIEFING = {"kind": "debriefing", "text": "Thanks."}
CHECK = {
    "kind": "comprehension",
    "questions": [{"id": "q", "text": "1 + 1?", "options": ["2", "3"], "answer": "2"}],
}


def block(phase, episodes=1, **more):
    return {"kind": "block", "phase": phase, "episodes": episodes, **more}


def study_of(*parts, **more):
    return make_study({
        "name": "small",
        "title": "A small study",
        "contact": "me@example.org",
        "keep_identities_until": datetime.date(2030, 1, 1),
        "task": "cliff-walking",
        "step_limit": 4,
        "conditions": [
            {"name": "alone", "assistant": "none"},
            {"name": "helped", "assistant": "maximal", "overrides": "shown"},
        ],
        "parts": [CONSENT, *parts, DEBRIEFING],
        **more,
    })  # fmt: skip


@contextlib.contextmanager
def served_study(study, path, mode="pilot", **options):
    """The address of a study that is served from a thread, and its host."""
    engine = open_study(path, study.name, mode, "digest")
    setups = setups_of(study)

    def make():
        return StudyHost(study, setups, engine, mode, second=0.01, **options)

    with serving(make, lambda host: researcher_routes(host, setups)) as served:
        yield served


class Participant(Page):
    """A page of a participant, turned by hand."""

    def __init__(self, address, token="", page=None, arrival=None):
        self.page: dict[str, Any] = {}
        self.page_id = page or secrets.token_hex(4)
        super().__init__(address, token, {"page": self.page_id, "arrival": arrival or {}})

    def __enter__(self):
        super().__enter__()
        self.page = {}
        return self

    def enter(self):
        """Read up to the first page."""
        self.token = self.next("welcome")["token"]
        return self.turn()

    def turn(self):
        self.page = self.next("page")["page"]
        return self.page

    def answer(self, number=None, **content):
        number = self.page["number"] if number is None else number
        self.send(type="answer", number=number, content=content, shown=1.0, at=2.0)

    def go(self, **content):
        """Answer, and read the next page."""
        self.answer(**content)
        return self.turn()

    def episode(self, number, action=0):
        """Play an episode with one action all the time; every state."""
        self.begin(number)
        states = [self.next("state")]
        while not states[-1]["episode"]["over"]:
            states.append(self.act(states[-1]["number"], action))
        return states

    def rest(self):
        """Play what is left of a block, and go on."""
        for number in range(self.page["played"], self.page["episodes"]):
            self.episode(number)
        return self.go(untrusted=0, blurs=0)
