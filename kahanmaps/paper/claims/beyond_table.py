"""The table of the paper's statements under varied hypotheses: proved or refuted, cell by cell.

Each cell is a claim of section 10, decided for the generic member like all claims. For a statement that fails, the
table gives a smallest counterexample: all numbers are 0 or 1, as few as possible are 1, and eps = 1.
"""

from __future__ import annotations

import functools
import itertools
from collections.abc import Sequence
from typing import Any

from flint import fmpq

from kahanmaps.algebra.fields import QQ
from kahanmaps.algebra.polynomials import monomials
from kahanmaps.checks.claims import Certainty, Evidence, Finding, Report, Witness
from kahanmaps.checks.settings import Settings
from kahanmaps.paper.claims.further_claims import STATEMENTS
from kahanmaps.paper.objects import PaperObjects
from kahanmaps.paper.registry import UNDEFINED, ClaimFunction, ClaimOutcome, claims, same, witness_of
from kahanmaps.paper.variations import VARIATIONS
from kahanmaps.paper.verify import VerifyOptions, verify

_MAX_ONES = 7  # maximal number of numbers that are 1 in a counterexample
_NEGATION = "not "

Slot = tuple[str, tuple[int, ...]]  # the place of a number: "H" and exponents, "J" and an index pair, "x" and an index


def beyond_table(m: int = 3, settings: Settings | None = None) -> Report:
    """Return the verdicts on all statements for all variations in dimension 2m: proved if they hold, else refuted.

    Some cells are expected to be refuted, and count as controls. Returns a Report with one Finding for each cell.
    Raises InputError as `verify` does.

    >>> cells = {result.claim: result for result in beyond_table(1).findings}
    >>> cells["eps^{-1} x^T J^{-1} x~ is conserved by f: H inhomogeneous"].evidence.summary
    'fails for m = 1, H = u1^3 + v1'
    """
    report = verify(None, settings, VerifyOptions(beyond=True), m=m)
    claim_by_key = {claim.key: claim for claim in claims()}
    functions = {formula: function for function, formula, *_ in STATEMENTS}
    cells = []
    for finding in report.findings:
        claim = claim_by_key[finding.place["key"]]
        is_negated = finding.formula.startswith(_NEGATION)
        verdict, evidence, witness = finding.verdict, finding.evidence, finding.witness
        if is_negated and verdict is Certainty.PROVED:
            verdict = Certainty.REFUTED
            counterexample = smallest_counterexample(functions[claim.statement], claim.variation)
            if counterexample is not None:
                text, witness = counterexample
                evidence = Evidence("exact rational point", f"fails for {text}")
        title = f"{claim.statement}: {VARIATIONS[claim.variation].title}"
        place = {**finding.place, "statement": claim.statement, "variation": claim.variation}
        cells.append(Finding(title, verdict, evidence, (), witness, claim.statement, control=is_negated, place=place))
    return Report("verify", tuple(cells), {**report.context, "beyond": True}, report.notes)


def table(report: Report) -> str:
    """Return the cells as a table in Markdown, followed by the counterexamples."""
    titles = [variation.title for variation in VARIATIONS.values()]
    lines = [f"| statement | {' | '.join(titles)} |", "|---" * (len(titles) + 1) + "|"]
    cells = {(finding.place["statement"], finding.place["variation"]): finding for finding in report.findings}
    for _, formula, *_ in STATEMENTS:
        row = [str(cells[formula, name].verdict) if (formula, name) in cells else "" for name in VARIATIONS]
        lines.append(f"| `{formula}` | {' | '.join(row)} |".replace("  |", " |"))
    lines.append("")
    for finding in report.findings:
        if finding.witness is not None:
            left, right = finding.witness.left[0], finding.witness.right[0]
            point_text = ", ".join(finding.witness.point)
            summary = finding.evidence.summary.removeprefix("fails for ")
            variation = VARIATIONS[finding.place["variation"]].title
            # Formulas are code: * and _ of plain text would become emphasis in Markdown.
            data_text = f"`{summary}` at `x = ({point_text})`, `eps = 1`"
            statement = finding.place["statement"]
            lines.append(f"* `{statement}`, {variation}: fails for {data_text}; the sides are `{left}` and `{right}`")
    return "\n".join(lines)


def smallest_counterexample(function: ClaimFunction, variation: str) -> tuple[str, Witness] | None:
    """Return (text, witness) of objects that refute a statement; None if no objects with at most seven ones do."""
    m, roots, slots, further_objects = _SEARCH_SPACES[variation]
    for count in range(2, _MAX_ONES + 1):
        for ones in itertools.combinations(slots, count):
            o = _objects(m, roots, ones, **further_objects)
            try:
                failure = next((pair for pair in function(o) if not same(QQ, *pair)), None)
            except UNDEFINED:
                continue
            if failure is None:
                continue
            names = [f"{letter}{i + 1}" for letter in "uv" for i in range(m)]
            terms = [
                "*".join(names[i] + f"^{e}" * (e > 1) for i, e in enumerate(indices) if e)
                for kind, indices in ones
                if kind == "H"
            ]
            text = f"m = {m}, H = {' + '.join(terms)}"
            brackets = [f"{{{names[indices[0]]}, {names[indices[1]]}}} = " for kind, indices in ones if kind == "J"]
            text += f", {''.join(brackets)}1 the only brackets" if brackets else ""
            witness = witness_of(ClaimOutcome(o, 1, failure))
            return (text, witness) if witness is not None else None
    return None


def _objects(m: int, roots: tuple[int, ...], ones: Sequence[Slot], **further_objects: Any) -> PaperObjects:
    """Return objects in normal form: A = diag(roots, roots), H and x sums of the monomials and unit vectors in `ones`.

    If `ones` contains index pairs (i, j) of J, J has the entry 1 there, -1 at (j, i), and 0 elsewhere.
    """
    n = 2 * m
    cubic, hessian, linear, J = ([0] * n**k for k in (3, 2, 1, 2))
    vectors = {"x": [0] * n, "v": [1] * n}
    for kind, indices in ones:
        if kind == "x":
            vectors["x"][indices[0]] = 1
        elif kind == "J":
            J[indices[0] * n + indices[1]], J[indices[1] * n + indices[0]] = 1, -1
        else:
            # Add 1 to the third (second, first) derivative along the coordinates of the monomial, in each order.
            coordinates = [i for i, e in enumerate(indices) for _ in range(e)]
            entries = {3: cubic, 2: hessian, 1: linear}[len(coordinates)]
            for permutation in itertools.permutations(coordinates):
                entries[functools.reduce(lambda position, i: position * n + i, permutation)] += 1
    if any(J):
        further_objects["J"] = QQ.matrix(n, n, list(map(fmpq, J)))
    return PaperObjects(
        K=QQ,
        A=QQ.matrix(n, n, [fmpq(roots[i % m] * (i == j)) for i in range(n) for j in range(n)]),
        d3H=QQ.matrix(n * n, n, list(map(fmpq, cubic))),
        hessian_of_quadratic_part=QQ.matrix(n, n, list(map(fmpq, hessian))),
        gradient_of_linear_part=QQ.column(list(map(fmpq, linear))),
        eps=fmpq(1),
        roots=tuple(map(fmpq, roots)),
        draw=lambda name: QQ.column(list(map(fmpq, vectors[name]))),
        **further_objects,
    )


def _slots(m: int, degrees: Sequence[int], is_planar: bool = True) -> list[Slot]:
    """Return slots for the coordinates of x and the monomials of these degrees (in one plane each if `is_planar`)."""
    slots: list[Slot] = []
    for degree in degrees:
        for exponent in monomials(2 * m, degree):
            planes = {i % m for i, e in enumerate(exponent) if e}
            if not is_planar or len(planes) == 1:
                slots.append(("H", tuple(exponent)))
    return slots + [("x", (i,)) for i in range(2 * m)]


# The objects tried for each variation: m, the roots of chi, the slots that may be 1, and the matrices B.
_SEARCH_SPACES: dict[str, tuple[int, tuple[int, ...], list[Slot], dict[str, Any]]] = {
    "inhomogeneous": (1, (1,), _slots(1, (3, 2, 1)), {}),
    "steps": (1, (1,), _slots(1, (3,)), {"associate_matrices": (QQ.identity(2) * fmpq(-2),)}),
    "any-structure": (2, (1, 2), [("J", pair) for pair in itertools.combinations(range(4), 2)] + _slots(2, (3,)), {}),
    "derogatory": (2, (1, 1), _slots(2, (3,), is_planar=False), {"associate_matrices": (QQ.identity(4),)}),
}
