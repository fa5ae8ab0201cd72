"""What a report may be given beyond what it finds in any experiment."""

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import NamedTuple

import polars as pl

from qbumpers.analysis.figures.frontier import Marks
from qbumpers.analysis.page.elements import Drawing, Section


class Additions(NamedTuple):
    """What is added to the report of an experiment, for example of a published one.

    Attributes:
        headlines: sentences that come before the others.
        cautions: sentences on what to keep in mind.
        tables: to be written beside the others, by the name of their file.
        sections: of the page; their drawings become figures of the report.
        marks: of the figure of performance and learning; None for none.
        curves: conditions whose returns and successes are drawn by episode, in place of a few that
            represent the rest; empty for those.
        command: repeats the experiment; empty for `qbumpers run` with the settings as run.
    """

    headlines: Sequence[str] = ()
    cautions: Sequence[str] = ()
    tables: Mapping[str, pl.DataFrame] = MappingProxyType({})
    sections: Sequence[Section] = ()
    marks: Marks | None = None
    curves: Sequence[str] = ()
    command: str = ""

    @property
    def drawings(self) -> list[Drawing]:
        """The drawings of all sections, in order."""
        contents = [each for section in self.sections for each in section.content]
        return [each for each in contents if isinstance(each, Drawing)]
