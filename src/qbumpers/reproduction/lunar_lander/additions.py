"""What the paper adds to a report of Lunar Lander: its claims in words."""

from qbumpers.analysis.additions import Additions
from qbumpers.analysis.findings import Findings
from qbumpers.experiments.store import Results
from qbumpers.reproduction.claims import CLAIMS, claim_sentence, claims_frame, claims_section
from qbumpers.reproduction.lunar_lander.claims import decisive_conditions, experiment_claims


def additions(results: Results, findings: Findings, why: str) -> Additions:
    """The claims with their evidence, and the learning curves that say most about them.

    Args:
        results: what the run's output folder holds.
        findings: what the tables say about these results.
        why: the results cannot be held against the paper's; empty if they can.
    """
    claims = experiment_claims(findings.trials, results.experiment)
    if not claims:
        return Additions()
    note = "The paper prints no numbers for it, so there are none to compare."
    return Additions(
        cautions=[f"Claims are judged from these results alone: {why}."] if why else [],
        headlines=[f"The paper's claim that {claim_sentence(claim)}" for claim in claims],
        tables={CLAIMS: claims_frame(claims)},
        sections=[claims_section(claims, note)],
        curves=decisive_conditions(findings.trials),
    )
