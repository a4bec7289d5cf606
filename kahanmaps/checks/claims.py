"""The results of checks: verdicts, evidence, witnesses, findings and reports.

Each claim has one of four verdicts. `proved`: the claim holds exactly for this system, at every eps or the given eps.
`refuted`: the claim is false; usually a witness shows a point at which its two sides differ. `supported`: the claim
held at random points over GF(p), with a stated error bound. `undecided`: none of these; a reason is given.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from dataclasses import field as field_of
from enum import StrEnum
from typing import Any

from kahanmaps.display_protocols import HtmlDisplay, PrintableResult, ResultPart, WithoutTruthValue


class Certainty(HtmlDisplay, WithoutTruthValue, StrEnum):
    """The certainty of a claim. `holds` is its truth value; `bool` of a certainty raises TypeError.

    The verdict of a check is one of the first four members. DERIVED means that the statement follows exactly from the
    measured singularity patterns; NOTE marks a remark, which has no certainty.
    """

    PROVED = "proved"
    REFUTED = "refuted"
    SUPPORTED = "supported"  # at random points, with a bound on the probability of an error
    UNDECIDED = "undecided"
    DERIVED = "derived"  # from the measured singularity patterns
    MEASURED = "measured"  # modulo primes, or on orbits
    ESTIMATED = "estimated"
    NOTE = "note"

    @property
    def holds(self) -> bool | None:
        """Whether the claim holds; None if this is not known."""
        return {Certainty.REFUTED: False, Certainty.UNDECIDED: None, Certainty.NOTE: None}.get(self, True)


@dataclass(frozen=True)
class Evidence(ResultPart):
    """The reason for a verdict: the name of the method, a sentence (`summary`), and plain data for scripts."""

    method: str
    summary: str
    data: Mapping[str, Any] = field(default_factory=dict)

    def to_json(self) -> dict[str, Any]:
        return {"method": self.method, "summary": self.summary, **self.data}


@dataclass(frozen=True)
class Witness(ResultPart):
    """A point x, with eps, at which a claim fails, and the different values of its two sides there, as exact text."""

    point: tuple[str, ...]
    eps: str | None  # None if the map does not depend on eps
    left: tuple[str, ...]
    right: tuple[str, ...]
    left_label: str
    right_label: str
    field: str = "QQ"
    vectors: Mapping[str, tuple[str, ...]] = field_of(default_factory=dict)  # further data of the witness, by name

    @property
    def text(self) -> str:
        """The point, eps, and the values of both sides of the claimed identity, as one line of text."""
        eps_text = "" if self.eps is None else f", eps = {self.eps}"
        sides = f"{self.left_label} = {', '.join(self.left)}, {self.right_label} = {', '.join(self.right)}"
        return f"x = ({', '.join(self.point)}){eps_text}: {sides}"

    def to_json(self) -> dict[str, Any]:
        return {
            "point": list(self.point),
            "eps": self.eps,
            "field": self.field,
            "left": {"is": self.left_label, "value": list(self.left)},
            "right": {"is": self.right_label, "value": list(self.right)},
            **({"vectors": {name: list(v) for name, v in self.vectors.items()}} if self.vectors else {}),
        }


@dataclass(frozen=True)
class Finding(HtmlDisplay, WithoutTruthValue, ResultPart):
    """A claim with its verdict. If `control`, it must be refuted, which shows that the check is able to fail."""

    claim: str
    verdict: Certainty
    evidence: Evidence
    also: tuple[Evidence, ...] = ()
    witness: Witness | None = None
    formula: str = ""
    source: str = ""
    control: bool = False
    place: Mapping[str, Any] = field(default_factory=dict)  # where the paper states the claim, as plain data
    applies: bool = True  # False if the input is too special for the claim; its verdict then does not count
    # The arguments with which `certificate` proves this claim, or {"why_not": the reason why there is no certificate}.
    certified: Mapping[str, Any] = field(default_factory=dict, repr=False, compare=False)

    @property
    def holds(self) -> bool | None:
        """Whether the claim holds; None if it is undecided."""
        return self.verdict.holds

    @property
    def is_as_expected(self) -> bool:
        """Whether a control was refuted; always true for claims that are not controls."""
        return not self.control or self.verdict is Certainty.REFUTED

    def to_json(self) -> dict[str, Any]:
        data: dict[str, Any] = {
            **self.place,
            "claim": self.claim,
            "verdict": str(self.verdict),
            "evidence": self.evidence.to_json(),
            "witness": self.witness.to_json() if self.witness else None,
        }
        if self.also:
            data["further_evidence"] = [evidence.to_json() for evidence in self.also]
        if self.formula:
            data["formula"] = self.formula
        if self.source:
            data["source"] = self.source
        if not self.applies:
            data["applies"] = False
        if self.control:
            data["control"] = True
            data["expected"] = str(Certainty.REFUTED)
        return data


@dataclass(frozen=True)
class Report(PrintableResult):
    """The findings of a check; `context` contains the data needed to reproduce the check."""

    _parts, _noun = "findings", ("claim", "claims")

    check: str
    findings: tuple[Finding, ...]
    context: Mapping[str, Any] = field(default_factory=dict)
    notes: Sequence[str] = ()
    ended_early: bool = False  # whether an orbit that the user requested ended before its last step
    certified: Mapping[str, Any] = field(default_factory=dict, repr=False, compare=False)  # as in `Finding`

    @property
    def verdict(self) -> Certainty:
        """The weakest verdict of all claims; controls and claims that do not apply are ignored."""
        return combined(finding.verdict for finding in self.findings if finding.applies and not finding.control)

    @property
    def holds(self) -> bool | None:
        """Whether all claims hold; None if that is undecided."""
        return self.verdict.holds

    def rows(self) -> list[dict[str, str]]:
        """Return one row for each claim, for example for `pandas.DataFrame(report.rows())`."""
        return [
            {
                "claim": finding.claim,
                "verdict": str(finding.verdict),
                "formula": finding.formula,
                "evidence": finding.evidence.summary,
            }
            for finding in self.findings
        ]

    def to_json(self) -> dict[str, Any]:
        """Return the report as plain data, in the documented format of the JSON output."""
        return {
            "check": self.check,
            "verdict": str(self.verdict),
            "holds": self.holds,
            **self.context,
            "ended_early": self.ended_early,
            "claims": [finding.to_json() for finding in self.findings],
            "notes": list(self.notes),
        }


def combined(verdicts: Iterable[Certainty]) -> Certainty:
    """Return the weakest of several verdicts, in the order refuted, undecided, supported, proved.

    For no verdicts the result is undecided.

    >>> combined([Certainty.PROVED, Certainty.SUPPORTED])
    <Certainty.SUPPORTED: 'supported'>
    """
    distinct_verdicts = set(verdicts)
    for verdict in (Certainty.REFUTED, Certainty.UNDECIDED, Certainty.SUPPORTED, Certainty.PROVED):
        if verdict in distinct_verdicts:
            return verdict
    return Certainty.UNDECIDED
