"""The registry of the paper's claims, each a short function with its place in the paper, and their evaluation.

A claim is a function that takes the paper's objects (`PaperObjects`: A, J, H, f, B_i, x, eps, ...) and yields pairs
(left, right) which the paper says are equal. It does not depend on the kind of numbers: it is evaluated at random
points over GF(p), at exact points over Q, over rational functions (a proof), over an algebra Q[t]/chi, over complex
balls, and over bounds for degrees and coefficients. To add a claim, write one such function in the file of its section,
with a title and a formula as its docstring.

The formulas hold for general m. If the paper states a formula for m = 3 only, the general formula reduces to it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from enum import StrEnum
from functools import cache
from importlib import import_module
from typing import Any

from kahanmaps.algebra.fields import Field
from kahanmaps.checks.claims import Witness
from kahanmaps.errors import SingularMatrix, SingularStep
from kahanmaps.paper.objects import PaperObjects

Pairs = Iterable[tuple[Any, Any]]
ClaimFunction = Callable[[PaperObjects], Pairs]

SECTIONS: dict[int, tuple[str, str]] = {
    1: ("Introduction", "introduction"),
    2: ("General properties of the discretization", "kahan_maps"),
    3: ("A family of integrable Hamiltonian systems", "hamiltonian_family"),
    4: ("General algebraic properties of the vector fields", "vector_fields"),
    5: ("Associated vector fields", "associated_fields"),
    6: ("Commutativity of maps", "commutativity"),
    7: ("Integrals of motion", "integrals_of_motion"),
    8: ("Invariant Poisson structure", "poisson_structure"),
    9: ("Differential equations for the conserved quantities", "differential_equations"),
    10: ("Beyond the paper", "further_claims"),
    11: ("The question of the conclusions", "conclusions"),
}
SECTION_NAMES = {"beyond": 10, "conclusions": 11}  # numbers of sections that are not numbered in the paper


class ClaimKind(StrEnum):
    """The assertion of a claim about the two sides of its pairs."""

    EQUAL = "equal"  # both sides are equal at all points
    DIFFERENT = "different"  # each pair differs at some point: one point for all pairs is a proof
    # The maximum of the left side, a rank, is the right side. One point over Q or GF(p) proves that it is not smaller,
    # since ranks do not grow modulo p; that it is not larger needs a reason (`at_most`).
    ATTAINED = "attained"
    EXISTS = "exists"  # both sides are equal for some choice of the free vectors: one point over Q is a proof


@dataclass(frozen=True)
class Claim:
    """A statement or display of the paper.

    `place` is the number of the statement in the paper ("Lemma 3", "(28)"), `label` its label in the LaTeX source.
    `controls` are names of inputs that violate one hypothesis, for which the claim must be refuted.
    """

    key: str
    section: int
    place: str
    label: str
    formula: str
    function: ClaimFunction
    controls: tuple[str, ...]
    kind: ClaimKind = ClaimKind.EQUAL
    at_most: str = ""  # for a claim that a rank is attained: why the rank cannot be larger
    least_m: int = 1
    only_m: int | None = None
    in_general: bool = False  # stated for generic A and H: a special member for which it fails does not refute it
    distinct_roots: bool = False  # needs distinct roots, as do all claims that contain the roots
    # A claim about a product of planar systems follows from the same claim about one block (blockwise) or about any
    # two blocks (pairwise); docs/mathematics.md gives the reason, and lists these claims.
    blockwise: bool = False
    pairwise: bool = False
    symplectic: bool = True  # invariant under symplectic changes of coordinates and extensions of the field
    theorem: str = ""  # a theorem that proves the claim without expansion, with hypotheses that hold by construction
    formal: Callable[[], Pairs] | None = None  # identities of formal_proofs.py that prove it in every dimension
    certified: str = ""  # the claims of `certificate` that prove it, by name; {} stands for 0, ..., m - 1
    statement: str = ""  # for a claim tested for several variations: the statement, and the variation
    variation: str = ""
    misprint: str = ""  # if not empty: why the formula, quoted as printed, is wrong

    def makes_sense(self, m: int) -> bool:
        """Whether the statement makes sense for this m."""
        return m >= self.least_m and (self.only_m is None or m == self.only_m)

    def blocks_for_proof(self, m: int) -> int:
        """The number of planar blocks of the normal form that a proof for this m needs."""
        return 1 if self.blockwise else min(m, 2) if self.pairwise else m

    @property
    def range_of_m(self) -> str:
        """The values of m for which the statement makes sense, as text."""
        return f"m = {self.only_m}" if self.only_m is not None else f"m >= {self.least_m}"

    @property
    def title(self) -> str:
        """The statement of the claim, from the first line of its docstring."""
        lines = (self.function.__doc__ or self.key).strip().splitlines()
        return lines[0].rstrip(".")


_claims: dict[str, Claim] = {}


def claim(place: str, label: str, controls: str = "", **options: Any) -> Callable[[ClaimFunction], ClaimFunction]:
    """Register a function as a claim; its file determines the section.

    The first line of the docstring is the title, the second line the formula. `controls` are keys of CONTROLS separated
    by blanks. A claim with a reason `at_most` asserts that a rank is attained. Other keywords are fields of `Claim`.
    """

    def register(function: ClaimFunction) -> ClaimFunction:
        file = function.__module__.rsplit(".", 1)[-1]
        section = next(number for number, (_, name) in SECTIONS.items() if name == file)
        key = function.__name__.strip("_").replace("_", "-")
        if key in _claims:
            raise ValueError(f"two claims have the name {key}")
        formula = (function.__doc__ or "").splitlines()[1].strip()
        kind = options.pop("kind", ClaimKind.ATTAINED if options.get("at_most") else ClaimKind.EQUAL)
        _claims[key] = Claim(key, section, place, label, formula, function, tuple(controls.split()), kind, **options)
        return function

    return register


@cache
def claims() -> tuple[Claim, ...]:
    """Return all claims, in the order of the paper."""
    for _, name in SECTIONS.values():
        import_module(f"kahanmaps.paper.claims.{name}")
    return tuple(sorted(_claims.values(), key=lambda claim: claim.section))


# ---- evaluating a claim ----------------------------------------------------------------------------------------

# The exceptions that a claim raises at points at which it is undefined.
UNDEFINED = (SingularStep, SingularMatrix, ZeroDivisionError)


def entries(value: Any) -> list[Any]:
    """Return the entries of a matrix, or [value] for a number."""
    return list(value.entries()) if hasattr(value, "entries") else [value]


def same(K: Field, left: Any, right: Any) -> bool:
    """Whether both sides are equal: matrices, numbers of K, or plain integers."""
    if isinstance(left, int):
        return bool(left == right)
    a, b = entries(left), entries(right)
    return len(a) == len(b) and all(K.equal(x, y) for x, y in zip(a, b, strict=True))


@dataclass(frozen=True)
class ClaimOutcome:
    """The outcome of a claim for `objects`: the number of pairs compared, and the first pair that refutes the claim."""

    objects: PaperObjects
    pairs: int
    failure: tuple[Any, Any] | None

    @property
    def holds(self) -> bool:
        return self.failure is None


def evaluate(claim: Claim, objects: PaperObjects) -> ClaimOutcome:
    """Evaluate a claim. Raises one of `UNDEFINED` (SingularStep, ...) if the claim is undefined for the objects."""
    pairs = 0
    with objects.K.working():
        for left, right in claim.function(objects):
            pairs += 1
            if same(objects.K, left, right) != (claim.kind is not ClaimKind.DIFFERENT):
                return ClaimOutcome(objects, pairs, (left, right))
    return ClaimOutcome(objects, pairs, None)


def outcomes(
    claim: Claim,
    points: Iterable[PaperObjects | None],
    change: Callable[[PaperObjects], PaperObjects] = lambda objects: objects,
) -> Iterator[ClaimOutcome]:
    """Yield the outcomes of a claim for `change` of each point, except those for which the claim is undefined."""
    for objects in points:
        if objects is not None:
            with suppress(*UNDEFINED, LookupError):  # LookupError: the claim needs the roots of chi, which are not in K
                yield evaluate(claim, change(objects))


def witness_of(outcome: ClaimOutcome) -> Witness | None:
    """Return the point at which a claim failed, with its two sides; for matrices only the first entry that differs."""
    if outcome.failure is None:
        return None
    objects = outcome.objects
    left, right = outcome.failure
    labels = ("left side", "right side")
    if isinstance(left, int):
        sides = (str(left), str(right))
    else:
        a, b = entries(left), entries(right)
        k = next((k for k, (x, y) in enumerate(zip(a, b, strict=True)) if not objects.K.equal(x, y)), 0)
        if len(a) > 1:
            columns = left.ncols()
            labels = tuple(f"{side}, entry ({k // columns + 1},{k % columns + 1})" for side in labels)  # type: ignore[assignment]
        sides = (objects.K.format(a[k]), objects.K.format(b[k]))
    vectors = {name: objects.vector(name) for name in sorted(objects.used - {"roots"}) if not name.startswith("break")}
    coordinates = {
        name: tuple(objects.K.format(entry) for entry in vector.entries()) for name, vector in vectors.items()
    }
    point = coordinates.pop("x", ())
    return Witness(point, objects.K.format(objects.eps), (sides[0],), (sides[1],), *labels, objects.K.name, coordinates)
