"""The evidence for claims, as tables of the page."""

from markupsafe import Markup

from qbumpers.analysis.claims import Claim, Evidence
from qbumpers.analysis.numerals import written
from qbumpers.analysis.page.cells import Column, Table, interval, named


def claim_table(claim: Claim) -> Table:
    """The evidence for a claim and against it, a row a setting where it is about settings."""
    kinds = list(dict.fromkeys(row.what for row in claim.evidence))
    if not claim.about_settings:
        columns = [Column("what", text=True), Column("estimate"), Column("claimed"), _SPEAKS]
        rows = [
            [row.what, _estimate(row), _claimed(row), _speaks(row.speaks_for)]
            for row in claim.evidence
        ]
        return Table(columns, rows, cards=True)
    first = {row.what: row for row in claim.evidence}
    columns = [
        Column("setting", text=True),
        *(Column(f"{kind} (claimed: {_claimed(first[kind])})") for kind in kinds),
        _SPEAKS,
    ]
    rows = [
        [
            named(condition),
            *(_estimate(row) for row in claim.evidence if row.condition == condition),
            _speaks(verdict),
        ]
        for condition, verdict in claim.settings.items()
    ]
    return Table(columns, rows, cards=True)


_SPEAKS = Column("speaks for it", text=True)


def _estimate(row: Evidence) -> Markup:
    return interval(*row.estimate, 2 if abs(row.estimate.mean) < 1 else 1)


def _claimed(row: Evidence) -> str:
    sign = {"above": ">", "below": "<"}[row.wanted]
    return f"{sign}\N{NO-BREAK SPACE}{written(row.limit, 1 if row.limit % 1 else 0)}"


def _speaks(verdict: bool | None) -> str:
    words = {True: ("yes", "yes"), False: ("no", "no")}
    if verdict is None:
        return "not sure"
    return Markup('<span class="{}">{}</span>').format(*words[verdict])
