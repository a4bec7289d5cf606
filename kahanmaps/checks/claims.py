"""What a check says: verdicts, evidence, witnesses, findings, and the report that holds them.

`proved`: exact, for this system and every eps (or the eps named). `refuted`: there is a witness, a point with both
sides. `supported`: held at random points over GF(p) with a stated error bound, or along an orbit; the evidence says
which. `undecided`: the reason is given. Each claim carries exactly one of these words.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from dataclasses import field as field_of
from enum import StrEnum
from typing import Any

from kahanmaps.displayed import Displayed, Printed, WithoutTruthValue


class Certainty(Displayed, WithoutTruthValue, StrEnum):
    """How much is known of a claim; its truth value is `holds`, and `bool` of it an error.

    Checks give one of the first four. DERIVED is what follows exactly from the measured singularity
    patterns; NOTE stands where certainty is not the question.
    """

    PROVED = "proved"
    REFUTED = "refuted"
    SUPPORTED = "supported"  # at random points, with a bound for the probability of an error
    UNDECIDED = "undecided"
    DERIVED = "derived"  # from the measured singularity patterns
    MEASURED = "measured"  # modulo primes, or on orbits
    ESTIMATED = "estimated"
    NOTE = "note"

    @property
    def holds(self) -> bool | None:
        """True, False, or None where nothing is known."""
        return {Certainty.REFUTED: False, Certainty.UNDECIDED: None, Certainty.NOTE: None}.get(self, True)


@dataclass(frozen=True)
class Evidence:
    """Why a verdict was given: the method, a sentence, and data (plain numbers and text) for scripts."""

    method: str
    summary: str
    data: Mapping[str, Any] = field(default_factory=dict)

    def to_json(self) -> dict[str, Any]:
        return {"method": self.method, "summary": self.summary, **self.data}


@dataclass(frozen=True)
class Witness:
    """A point at which a claim fails: x and eps, and the two sides that should be equal, all as exact text."""

    point: tuple[str, ...]
    eps: str | None  # None for a map that does not depend on it
    left: tuple[str, ...]
    right: tuple[str, ...]
    left_label: str
    right_label: str
    field: str = "QQ"
    vectors: Mapping[str, tuple[str, ...]] = field_of(default_factory=dict)  # whatever else was chosen, by name

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
class Finding(Displayed, WithoutTruthValue):
    """One claim with its verdict. A `control` is a claim that is expected to be refuted and proves the check alive."""

    claim: str
    verdict: Certainty
    evidence: Evidence
    also: tuple[Evidence, ...] = ()
    witness: Witness | None = None
    formula: str = ""
    source: str = ""
    control: bool = False
    place: Mapping[str, Any] = field(default_factory=dict)  # where the claim stands, as plain data
    applies: bool = True  # False: stated for generic input, and this is special; it does not count

    @property
    def holds(self) -> bool | None:
        """Whether the claim holds; None where that is undecided."""
        return self.verdict.holds

    @property
    def is_as_expected(self) -> bool:
        """Whether a control was refuted; true for everything that is not a control."""
        return not self.control or self.verdict is Certainty.REFUTED

    def to_json(self) -> dict[str, Any]:
        plain: dict[str, Any] = {
            **self.place,
            "claim": self.claim,
            "verdict": str(self.verdict),
            "evidence": self.evidence.to_json(),
            "witness": self.witness.to_json() if self.witness else None,
        }
        if self.also:
            plain["also"] = [evidence.to_json() for evidence in self.also]
        if self.formula:
            plain["formula"] = self.formula
        if self.source:
            plain["source"] = self.source
        if not self.applies:
            plain["applies"] = False
        if self.control:
            plain["control"] = True
            plain["expected"] = str(Certainty.REFUTED)
        return plain


@dataclass(frozen=True)
class Report(Printed):
    """The findings of one check, and what is needed to do it again (`context`)."""

    check: str
    findings: tuple[Finding, ...]
    context: Mapping[str, Any] = field(default_factory=dict)
    notes: Sequence[str] = ()
    ended_early: bool = False  # an orbit that the user asked for could not be walked to its end

    @property
    def verdict(self) -> Certainty:
        """The verdict on all claims together; controls, and claims that do not apply, do not count."""
        return combined(finding.verdict for finding in self.findings if finding.applies and not finding.control)

    @property
    def holds(self) -> bool | None:
        """Whether everything claimed holds; None where that is undecided."""
        return self.verdict.holds

    def rows(self) -> list[dict[str, str]]:
        """A row for each claim, for `pandas.DataFrame(report.rows())` and the like."""
        return [
            {"claim": one.claim, "verdict": str(one.verdict), "formula": one.formula, "evidence": one.evidence.summary}
            for one in self.findings
        ]

    def to_json(self) -> dict[str, Any]:
        """The report as plain data, the shape that scripts rely on."""
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
    """The weakest of several verdicts: refuted before undecided before supported before proved.

    Without any verdict nothing has been decided.

    >>> combined([Certainty.PROVED, Certainty.SUPPORTED])
    <Certainty.SUPPORTED: 'supported'>
    """
    found = set(verdicts)
    for verdict in (Certainty.REFUTED, Certainty.UNDECIDED, Certainty.SUPPORTED, Certainty.PROVED):
        if verdict in found:
            return verdict
    return Certainty.UNDECIDED
