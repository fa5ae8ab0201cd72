"""What each page shows, JSON-like, and whether an answer to it can be taken."""

import datetime
import re
from collections.abc import Mapping
from typing import Any

from qbumpers.errors import RequestError
from qbumpers.study.design.models import Study
from qbumpers.study.design.parts import (
    AnyPart,
    Block,
    Comprehension,
    Consent,
    DeviceCheck,
    Instructions,
    Questionnaire,
    Sitting,
)
from qbumpers.study.design.words import WORDS
from qbumpers.study.flow.standing import Standing, window

_TITLES = {
    "consent": "consent_title",
    "instructions": "instructions_title",
    "device-check": "device_title",
    "comprehension": "comprehension_title",
    "questionnaire": "questionnaire_title",
    "sitting": "sitting_title",
    "debriefing": "debriefing_title",
}

_CODES = {
    "complete": "complete",
    "screened_out": "screened_out",
    "full": "screened_out",
    "failed": "failed",
    "no_consent": "no_consent",
}
"""Which code of the recruitment goes with an outcome; the others have none."""


def facts_of(study: Study, mode: str) -> dict[str, Any]:
    """What every page needs to know, the same for all participants."""
    return {
        "title": study.title,
        "language": study.language,
        "contact": study.word("contact").format(contact=study.contact),
        "pilot": mode != "live",
        "needs_code": study.recruitment.by == "class",
        "words": {key: study.word(key) for key in WORDS},
    }


def paragraphs(text: str) -> list[dict[str, Any]]:
    """A text in its paragraphs and lists.

    Args:
        text: an empty line ends a paragraph; lines that begin with "- " are items of a list.

    Returns:
        Of each: `text`, or `items` of a list.
    """
    found: list[dict[str, Any]] = []
    for block in re.split(r"\n\s*\n", text.strip()):
        lines = [line.strip() for line in block.splitlines() if line.strip()]
        if lines and all(line.startswith("- ") for line in lines):
            found.append({"items": [line[2:] for line in lines]})
        elif lines:
            found.append({"text": " ".join(lines)})
    return found


def page_of(study: Study, now: Standing) -> dict[str, Any]:
    """The page of a participant, without what is played on it.

    Args:
        study: that they take part in.
        now: where they are.
    """
    if now.outcome:
        return end_page(study, now)
    part = now.part(study)
    return {
        "number": now.number,
        "kind": part.kind,
        "id": part.id,
        "title": part.title or study.word(_title_of(part)),
        "text": paragraphs(part.text),
        "place": now.place + 1,
        "places": len(now.parts),
        "withdraw": not isinstance(part, Consent),
        **_content(study, now, part),
    }


def _title_of(part: AnyPart) -> str:
    return f"{part.phase}_title" if isinstance(part, Block) else _TITLES[part.kind]


def _content(study: Study, now: Standing, part: AnyPart) -> dict[str, Any]:
    if isinstance(part, DeviceCheck):
        return {"keyboard": part.keyboard}
    if isinstance(part, Questionnaire):
        return {"items": [item.model_dump() for item in part.all_items()]}
    if isinstance(part, Comprehension):
        questions = [
            {"id": q.id, "text": q.text, "kind": "choice", "options": q.options, "required": True}
            for q in part.questions
        ]
        again = [
            study.part(name).text
            for name in now.parts[: now.place]
            if isinstance(study.part(name), Instructions)
        ]
        reminder = paragraphs("\n\n".join(again)) if now.wrong else []
        return {"items": questions, "wrong": now.wrong > 0, "reminder": reminder}
    if isinstance(part, Sitting):
        opens, closes = window(study, now) or (0.0, 0.0)
        words = study.word("sitting_wait").format(opens=_when(opens), closes=_when(closes))
        code = part.code or study.recruitment.codes.get("complete", "")
        return {"wait": words, **_farewell(study, code)}
    return {}


def _when(time: float) -> str:
    moment = datetime.datetime.fromtimestamp(time, datetime.UTC)
    return moment.strftime("%Y-%m-%d %H:%M UTC")


def end_page(study: Study, now: Standing) -> dict[str, Any]:
    """The last page, with the code of how the study ended."""
    key = {"late": "sitting_late"}.get(now.outcome, now.outcome)
    codes: Mapping[str, str] = {**study.recruitment.codes}
    complete = now.outcome == "complete"
    return {
        "number": now.number,
        "kind": "end",
        "id": now.outcome,
        "title": study.word("complete_title" if complete else "ended_title"),
        "text": paragraphs(study.word(key)),
        "withdraw": now.outcome in ("complete", "screened_out", "failed"),
        **_farewell(study, codes.get(_CODES.get(now.outcome, ""), "")),
    }


def _farewell(study: Study, code: str) -> dict[str, Any]:
    return {
        "code": study.word("code").format(code=code) if code else "",
        "link": study.recruitment.link(code),
    }


def checked_content(part: AnyPart, content: Mapping[str, Any]) -> dict[str, Any]:
    """The content of an answer, if it can be taken.

    Args:
        part: that is answered.
        content: as the page sent it.

    Returns:
        What is kept of it.

    Raises:
        RequestError: naming the item that is missing or wrong.
    """
    if isinstance(part, Questionnaire):
        for item in part.all_items():
            problem = item.problem_with(content.get(item.id))
            if problem:
                raise RequestError(f"{item.id}: {problem}")
        return _only(content, [item.id for item in part.all_items()])
    if isinstance(part, Comprehension):
        for question in part.questions:
            if content.get(question.id) not in question.options:
                raise RequestError(f"{question.id}: an answer is needed")
        return _only(content, [question.id for question in part.questions])
    if isinstance(part, Consent):
        if not isinstance(content.get("agree"), bool):
            raise RequestError("agree: true or false is needed")
        return {"agree": content["agree"], "version": part.version}
    if isinstance(part, DeviceCheck):
        return _measured(content)
    if isinstance(part, Block):
        return _numbers(content, ("untrusted", "blurs"))
    return {}


def _only(content: Mapping[str, Any], names: list[str]) -> dict[str, Any]:
    unknown = set(content) - set(names)
    if unknown:
        raise RequestError(f"{min(unknown)}: there is no such item")
    return {name: content.get(name) for name in names}


def _measured(content: Mapping[str, Any]) -> dict[str, Any]:
    flags = {name: bool(content.get(name)) for name in ("keyboard", "touch")}
    return {**flags, **_numbers(content, ("width", "height", "refresh", "latency"))}


def _numbers(content: Mapping[str, Any], names: tuple[str, ...]) -> dict[str, float]:
    for name in names:
        value = content.get(name)
        if not isinstance(value, int | float) or isinstance(value, bool) or not 0 <= value <= 1e7:
            raise RequestError(f"{name} = {value!r}; a number from 0 to 10000000 is needed")
    return {name: content[name] for name in names}
