"""Freezing a study for a preregistration: what it is, by which code and values, with a hash."""

import datetime
import hashlib
import html
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import qbumpers
from qbumpers.errors import RequestError, in_short
from qbumpers.files import write_atomically
from qbumpers.play.setup import Setup
from qbumpers.study.design.models import Study
from qbumpers.study.design.parts import Block

_SOURCES = {".py", ".js", ".css", ".html"}


def frozen_path(file: Path) -> Path:
    """Of the frozen study of a study file; the readable page lies beside it, as .html."""
    return file.with_suffix(".frozen.json")


def code_digest() -> str:
    """SHA-256 of every source of the package, in hexadecimal."""
    root, found = Path(qbumpers.__file__).parent, hashlib.sha256()
    for path in sorted(root.rglob("*")):
        if path.suffix in _SOURCES:
            found.update(str(path.relative_to(root)).encode())
            found.update(path.read_bytes())
    return found.hexdigest()


def content_of(study: Study, setups: Mapping[str, Setup]) -> dict[str, Any]:
    """Everything that decides what participants go through, JSON-like.

    Args:
        study: as in its file, every field spelt out.
        setups: what is played in each block, by its id.
    """
    return {
        "study": study.model_dump(mode="json"),
        "tasks": {name: setup.description for name, setup in setups.items()},
        "version": qbumpers.__version__,
        "code": code_digest(),
    }


def hash_of(content: Mapping[str, Any]) -> str:
    """SHA-256 of the content as canonical JSON, in hexadecimal."""
    text = json.dumps(content, sort_keys=True, separators=(",", ":"), ensure_ascii=False)
    return hashlib.sha256(text.encode()).hexdigest()


def freeze(file: Path, study: Study, setups: Mapping[str, Setup]) -> str:
    """Write the frozen study and its readable page beside the study file.

    Args:
        file: path of the study file.
        study: in it.
        setups: what is played in each block, by its id.

    Returns:
        The hash.

    Raises:
        RequestError: if there is a frozen one that differs; it would have been registered.
        StoreError: if it cannot be written.
    """
    content, path = content_of(study, setups), frozen_path(file)
    digest = hash_of(content)
    if path.exists():
        before = read_frozen(path)
        if before["hash"] == digest:
            return digest
        raise RequestError(
            f"{path}: it was frozen before, and {_difference(before['content'], content)}; delete "
            "it if nothing was registered yet"
        )
    moment = datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds")
    frozen = {"hash": digest, "frozen": moment, "content": content}
    text = json.dumps(frozen, indent=1, sort_keys=True, ensure_ascii=False) + "\n"
    write_atomically(path, lambda temporary: temporary.write_text(text, encoding="utf-8"))
    page = readable(study, digest, moment, frozen)
    write_atomically(
        path.with_suffix(".html"), lambda temporary: temporary.write_text(page, encoding="utf-8")
    )
    return digest


def read_frozen(path: Path) -> dict[str, Any]:
    """A frozen study.

    Raises:
        RequestError: if there is none, or its hash is not that of its content.
    """
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
        whole = found["hash"] == hash_of(found["content"])
    except OSError as error:
        raise RequestError(f"{path}: {error.strerror}; freeze the study first") from error
    except (ValueError, KeyError, TypeError) as error:
        raise RequestError(f"{path}: it is no frozen study") from error
    if not whole:
        raise RequestError(f"{path}: its hash is not that of its content; it was changed")
    return found


def check_frozen(file: Path, study: Study, setups: Mapping[str, Setup]) -> str:
    """The hash of a study that is served live, if it is as it was frozen.

    Raises:
        RequestError: if it was not frozen, or naming what differs.
    """
    frozen, content = read_frozen(frozen_path(file)), content_of(study, setups)
    if frozen["hash"] != hash_of(content):
        raise RequestError(
            f"study file {file}: {_difference(frozen['content'], content)}; a study is served live "
            "only as it was frozen"
        )
    return frozen["hash"]


def _difference(before: Mapping[str, Any], now: Mapping[str, Any]) -> str:
    """The first thing that differs, in words."""
    for key in ("version", "code"):
        if before[key] != now[key]:
            return f"{key} was {in_short(before[key])}, now {in_short(now[key])}"
    for key in ("study", "tasks"):
        for field in {**before[key], **now[key]}:
            was, is_now = before[key].get(field), now[key].get(field)
            if was != is_now:
                return f"{field} was {in_short(was)}, now {in_short(is_now)}"
    return "it is the same"


def readable(study: Study, digest: str, moment: str, frozen: Mapping[str, Any]) -> str:
    """The frozen study as a page to be read.

    Args:
        study: that was frozen.
        digest: its hash.
        moment: when, ISO 8601.
        frozen: all of it, JSON-like.
    """
    analysis = study.analysis
    planned = [
        f"Welch's t test, two-sided at {analysis.level}, of {analysis.measure}: {analysis.first} "
        f"against {analysis.second}; power aimed at {analysis.power}.",
        analysis.plan,
    ] if analysis else ["No test is planned."]  # fmt: skip
    bonus = study.bonus
    paid = (
        f"{bonus.per_point} {bonus.currency} per point of the mean score of {bonus.phase} above "
        f"{bonus.above}, at most {bonus.most} {bonus.currency}."
        if bonus
        else "None."
    )
    conditions = [
        f"{each.name}: {f'yoked to {each.yoked_to}' if each.yoked_to else each.assistant} "
        f"{each.options or ''}, overrides {each.overrides}"
        for each in study.all_conditions()
    ]
    parts = [_described(part) for part in study.parts]
    sections = [
        ("Planned analysis", planned),
        ("Conditions", conditions),
        ("What a participant goes through", parts),
        ("Bonus", [paid]),
    ]
    body = "".join(f"<h2>{title}</h2><ul>{_items(lines)}</ul>" for title, lines in sections)
    whole = html.escape(json.dumps(frozen, indent=1, sort_keys=True, ensure_ascii=False))
    return (
        f'<!doctype html><html lang="en"><meta charset="utf-8"><title>{html.escape(study.title)}'
        "</title><style>body{max-width:50em;margin:2em auto;padding:0 1em;font:16px/1.5 sans-serif}"
        "pre{overflow:auto;font-size:.8em}</style>"
        f"<h1>{html.escape(study.title)}</h1><p>Study {study.name}, frozen at {moment} with "
        f"qbumpers {qbumpers.__version__}.</p><p>SHA-256 <code>{digest}</code></p>{body}"
        f"<h2>All of it</h2><pre>{whole}</pre></html>\n"
    )


def _items(lines: list[str]) -> str:
    return "".join(f"<li>{html.escape(line)}</li>" for line in lines if line)


def _described(part: Any) -> str:
    if isinstance(part, Block):
        plan = part.plan()
        return (
            f"{part.id}: {part.phase}, {len(plan)} episodes, {plan.count(True)} of them assisted. "
            f"{part.text}"
        )
    return f"{part.id} ({part.kind}): {part.text}"
