"""Reports of published experiments: those of any experiment, with what their paper adds."""

import importlib
from collections.abc import Callable
from pathlib import Path

from qbumpers.analysis import report
from qbumpers.analysis.additions import Additions
from qbumpers.analysis.findings import Findings
from qbumpers.experiments.store import Results
from qbumpers.reproduction.claims import CLAIMS
from qbumpers.reproduction.experiments import command, deviations, package_of
from qbumpers.reproduction.printed import PUBLISHED


def additions(results: Results, findings: Findings) -> Additions:
    """What the paper adds to a report; nothing if the experiment reproduces none.

    Args:
        results: what the run's output folder holds.
        findings: what the tables say about these results.
    """
    name = results.experiment.reproduces
    if name is None:
        return Additions()
    paper = importlib.import_module(f"{package_of(name)}.additions")
    why = unlike_the_paper(results, findings)
    added = paper.additions(results, findings, why)
    return added._replace(command=command(results.experiment))


def unlike_the_paper(results: Results, findings: Findings) -> str:
    """Why results cannot be held against the paper's, in words; empty if they can."""
    different = deviations(results.experiment)
    if different:
        return f"the experiment is not the paper's ({'; '.join(different)})"
    return "the run is not finished" if findings.missing else ""


def find(results: Results) -> Findings:
    """Every table of a report and what they say in sentences, from the results of a run."""
    return report.find(results, additions)


def write_report(
    folder: str | Path, advance: Callable[[str], None] = lambda part: None
) -> Findings:
    """Analyse a run, published or not: `qbumpers.analysis.report.write_report`.

    Args:
        folder: output folder of the run, a path or a URL.
        advance: called with the name of each part before it is made.

    Returns:
        What the tables say.

    Raises:
        RequestError: if the folder is not one of a run of which some trials are finished.
        StoreError: if a file cannot be written.
    """
    findings = report.write_report(folder, advance, additions)
    for name in {PUBLISHED, CLAIMS} - findings.additions.tables.keys():
        (Path(folder) / name).unlink(missing_ok=True)
    return findings
