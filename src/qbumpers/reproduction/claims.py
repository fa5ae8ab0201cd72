"""What a paper claims in words, judged by rules that do not depend on the trials.

Each piece of evidence is an estimate with its interval beside a limit. It speaks for a claim if the
whole interval lies on the claimed side of the limit, against it if the whole interval lies on the
other side, and else for neither.
"""

from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import polars as pl
from markupsafe import Markup

from qbumpers.analysis.formatting import format_number
from qbumpers.analysis.page.elements import Column, Section, Table, interval, unbroken
from qbumpers.analysis.statistics import IntervalEstimate

HOLDS, FAILS, OPEN = "holds", "does not hold", "cannot be decided from these trials"
"""Verdicts."""

CLAIMS = "claims.csv"
"""A row per piece of evidence."""


class Evidence(NamedTuple):
    """An estimate beside a limit.

    Attributes:
        condition: the setting that it is about; empty if it is about whole methods.
        what: names what is estimated.
        estimate: with its interval.
        limit: between speaking for the claim and against it.
        wanted: "above" or "below" the limit, the side on which it speaks for the claim.
    """

    condition: str
    what: str
    estimate: IntervalEstimate
    limit: float
    wanted: str

    @property
    def speaks_for(self) -> bool | None:
        """Whether it speaks for the claim (True), against it (False) or neither (None)."""
        above, below = self.estimate.low > self.limit, self.estimate.high < self.limit
        if not (above or below):
            return None
        return above == (self.wanted == "above")


class Claim(NamedTuple):
    """A claim, and what the trials say about it.

    Attributes:
        title: the claim in a few words.
        rule: when it holds.
        every: whether it is about every setting (True) or about some setting (False).
        evidence: a row per setting and estimate.
    """

    title: str
    rule: str
    every: bool
    evidence: Sequence[Evidence]

    @property
    def settings(self) -> dict[str, bool | None]:
        """Whether each setting speaks for the claim; all of its evidence must."""
        found: dict[str, list[bool | None]] = {}
        for one in self.evidence:
            found.setdefault(one.condition, []).append(one.speaks_for)
        return {name: _all(verdicts) for name, verdicts in found.items()}

    @property
    def about_settings(self) -> bool:
        """Whether it is about single settings, not whole methods."""
        return "" not in self.settings

    @property
    def verdict(self) -> str:
        """One of `HOLDS`, `FAILS` and `OPEN`."""
        settings = list(self.settings.values())
        holds = _all(settings) if self.every else _not(_all(map(_not, settings)))
        return {True: HOLDS, False: FAILS, None: OPEN}[holds]


def _all(verdicts: Iterable[bool | None]) -> bool | None:
    """Whether all are true; None if that is not known."""
    found = list(verdicts)
    if False in found:
        return False
    return None if None in found or not found else True


def _not(verdict: bool | None) -> bool | None:
    return None if verdict is None else not verdict


def claim_sentence(claim: Claim) -> str:
    """A claim and its verdict; of one about settings, how many speak for it and against it."""
    verdicts = list(claim.settings.values())
    if not claim.about_settings:
        return f"{claim.title}: {claim.verdict}."
    counts = (
        f"of {len(verdicts)} setting{'s' * (len(verdicts) != 1)} tried, "
        f"{verdicts.count(True)} for it, "
        f"{verdicts.count(False)} against it"
    )
    return f"{claim.title}: {claim.verdict} ({counts})."


def claims_frame(claims: Sequence[Claim]) -> pl.DataFrame:
    """The content of `claims.csv`: every piece of evidence with its claim and verdict."""
    return pl.DataFrame([row for claim in claims for row in _evidence_rows(claim)]).fill_nan(None)


def _evidence_rows(claim: Claim) -> list[dict[str, Any]]:
    return [
        {
            "claim": claim.title,
            "verdict": claim.verdict,
            "condition": row.condition,
            "what": row.what,
            **{f"estimate_{part}": number for part, number in row.estimate._asdict().items()},
            "wanted": row.wanted,
            "limit": float(row.limit),
            "speaks_for": row.speaks_for,
        }
        for row in claim.evidence
    ]


def claims_section(claims: Sequence[Claim], note: str = "") -> Section:
    """The section of a report that shows every claim, its verdict and the evidence.

    Args:
        claims: at least one.
        note: a sentence on the paper, after the one that introduces the section.
    """
    introduction = Markup(
        "<p>What the paper says of this experiment, each judged by the rule that stands with it."
        "{} Evidence speaks for a claim if its whole 95% interval lies on the claimed side of a "
        "limit, against it if the whole interval lies on the other side, and else for neither.</p>"
    ).format(f" {note}" if note else "")
    content: list[Any] = [introduction]
    for claim in claims:
        content += [
            Markup("<h3>{}</h3>\n<p><strong>{}.</strong> {}</p>").format(
                claim.title, claim.verdict.capitalize(), claim.rule
            ),
            claim_table(claim),
        ]
    return Section("claims", "The paper's claims", "methods", content, CLAIMS)


def claim_table(claim: Claim) -> Table:
    """The evidence for a claim and against it; a row per setting if it is about settings."""
    if not claim.about_settings:
        columns = [Column("what", text=True), Column("estimate"), Column("claimed"), _SPEAKS]
        rows = [
            [row.what, _estimate(row), _claimed(row), _speaks(row.speaks_for)]
            for row in claim.evidence
        ]
        return Table(columns, rows, cards=True)
    limits = {row.what: _claimed(row) for row in claim.evidence}
    columns = [
        Column("setting", text=True),
        *(Column(f"{what} (claimed: {limit})") for what, limit in limits.items()),
        _SPEAKS,
    ]
    rows = [
        [
            unbroken(condition),
            *(_estimate(row) for row in claim.evidence if row.condition == condition),
            _speaks(verdict),
        ]
        for condition, verdict in claim.settings.items()
    ]
    return Table(columns, rows, cards=True, folded="The evidence, setting by setting")


_SPEAKS = Column("speaks for it", text=True)


def _estimate(row: Evidence) -> Markup:
    return interval(*row.estimate, 2 if abs(row.estimate.mean) < 1 else 1)


def _claimed(row: Evidence) -> str:
    sign = {"above": ">", "below": "<"}[row.wanted]
    return f"{sign}\N{NO-BREAK SPACE}{format_number(row.limit, 1 if row.limit % 1 else 0)}"


def _speaks(verdict: bool | None) -> str:
    if verdict is None:
        return "not sure"
    word = "yes" if verdict else "no"
    return Markup('<span class="{}">{}</span>').format(word, word)
