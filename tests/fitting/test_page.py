"""The page on fitting shows what its script printed."""

from pathlib import Path

DOCS = Path(__file__).parents[2] / "docs"


def test_the_page_shows_what_was_kept_of_the_recovery():
    kept = (DOCS / "data" / "fitting.txt").read_text(encoding="utf-8")
    assert f"```\n{kept}```\n" in (DOCS / "fitting.md").read_text(encoding="utf-8")
