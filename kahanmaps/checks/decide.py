"""The Schwartz-Zippel test of identities of rational functions at random points, with a bound on the error.

With denominators cleared, the identity is a polynomial equation P(x, eps) = 0 over the integers. Each trial draws a
prime p from [2^62, 2^63) and a point over GF(p). The random seed is a hash of the identity, so that no identity can be
constructed for given points (algebra/chance.py). Let P have degree d and a nonzero coefficient of b bits. A trial
succeeds only if p divides all coefficients of P (at most b/62 of more than 2^55 primes do) or the point is a root of P
(probability at most d/(p - 1), and p - 1 >= 2^62). A point at which a denominator vanishes is replaced by another one;
such points have probability below 1/2, so the sum of the two probabilities is at most doubled. Trials are
independent, so their bounds multiply. Sources: schwartz-1980; rosser-schoenfeld-1962 (more than 3N/(5 ln N) primes from
N to 2N).

A failed trial refutes the identity. Then rational points are tried, to find one at which the two sides differ.
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from dataclasses import field as dataclass_field
from functools import cached_property
from typing import Any, Protocol

from flint import fmpq

from kahanmaps.algebra import work
from kahanmaps.algebra.bounds import BoundField, CoefficientSize, bound_of
from kahanmaps.algebra.chance import PRIME_BITS, derive_seed, random_prime_field
from kahanmaps.algebra.fields import QQ, Field
from kahanmaps.algebra.roots import Root
from kahanmaps.checks.claims import Certainty, Evidence, Witness
from kahanmaps.errors import BadPrime, SingularMatrix, SingularStep, counted

METHOD = "random points over GF(p)"
DEFAULT_ERROR_BITS = 100
# log2 of 3 N / (5 ln N), a lower bound of Rosser and Schoenfeld for the primes in (N, 2N] for N >= 21; here N = 2^62.
_PRIMES_LOG2 = math.log2(0.6) + PRIME_BITS - math.log2(PRIME_BITS * math.log(2))
_MAX_UNDEFINED_POINTS = 200  # the test ends after more points at which the two sides are undefined
_SMALL_POINT_COUNT = 400  # the number of rational points of small height tried as witnesses
_HIGH_POINT_COUNT = 20  # the number of points with long coordinates, which are tried last
_HIGH_BITS = 62  # the length of these coordinates

Sides = tuple[Sequence[Any], Sequence[Any]]


@dataclass(frozen=True)
class Identity:
    """An identity: two lists of rational functions of a point of dimension `dim` are equal.

    `sides(field, x, eps)` returns both lists of field elements; at a point where they are not defined, it returns None
    or raises SingularStep. `eps` is the value for which the identity is stated; None means every eps. `seed_data`
    contains the data that determine the two sides; random points are drawn by a hash of these data (`derive_seed`).
    """

    dim: int
    sides: Callable[[Field, tuple[Any, ...], Any], Sides | None]
    eps: fmpq | None
    left_label: str = "left side"
    right_label: str = "right side"
    entries: tuple[str, ...] = ()  # names of the entries, if a witness is to show only one entry that differs
    scope: str = ""  # the scope of the identity as text, if `eps` does not describe it
    has_eps: bool = True  # whether the sides depend on eps
    # Whether both sides depend on eps x only, up to powers of eps. Then the identity at eps = 1 implies it at any eps.
    scales_with_eps: bool = False
    undefined_reason: str = "a denominator seems to vanish identically"  # if the sides are undefined at all points
    root: Root | None = None  # the algebraic number in the coefficients; None if they are rational
    seed_data: tuple[Any, ...] = dataclass_field(kw_only=True)

    def seed(self, seed: int) -> int:
        """Return the random seed for this identity."""
        return derive_seed(seed, self.dim, self.eps, self.left_label, self.right_label, self.seed_data)

    @cached_property
    def bound(self) -> tuple[CoefficientSize, int]:
        """Bounds of degree and coefficients of the difference of both sides, and of the degree of their denominators.

        The two sides are evaluated with bounds in place of numbers.
        """
        field, units_before = BoundField(), work.counted()
        eps = field.variable() if self.eps is None else field.convert(self.eps)
        sides = self.at(field, tuple(field.variable() for _ in range(self.dim)), eps)
        work.count_work(7 * (work.counted() - units_before))  # bounds take about 8 times as long as numbers
        # If the evaluation with bounds fails, there is no error bound, and the identity cannot be supported.
        return (CoefficientSize(0, math.inf), 0) if sides is None else bound_of(field, zip(*sides, strict=True))

    def at(self, field: Field, point: tuple[Any, ...], eps: Any) -> Sides | None:
        """Return both sides of the identity at a point; None if they are not defined there."""
        try:
            return self.sides(field, point, eps)
        except (SingularStep, SingularMatrix):
            return None

    # The following members implement the protocol Decidable.

    name = "identity"
    max_failures = _MAX_UNDEFINED_POINTS

    @property
    def conjugates(self) -> int:
        """The degree of the number field of the coefficients."""
        return 1 if self.root is None else self.root.degree

    @property
    def ground(self) -> Field:
        """The field of the coefficients."""
        return QQ if self.root is None else self.root.number_field

    @property
    def where(self) -> str:
        """The scope of the identity, as a part of a sentence."""
        scope = self.scope
        if not scope and self.has_eps:
            scope = "for every eps" if self.eps is None else f"for eps = {self.eps}"
        return f", {scope}" if scope else ""

    def trials(self, seed: int) -> Iterator[Trial]:
        """Yield trials at random points, each over GF(p) for another random prime p."""
        rng = random.Random(f"identity {self.seed(seed)}")
        while True:
            field = random_prime_field(rng)
            sides = None
            if self.root is not None:
                try:
                    self.root.over(field)
                except BadPrime:  # modulo this prime the minimal polynomial has no root
                    continue
            with suppress(BadPrime):
                point = tuple(field.random(rng) for _ in range(self.dim))
                eps = field.zero if self.eps is None else field.convert(self.eps)
                while self.eps is None and eps == 0:
                    eps = field.random(rng)
                sides = None if eps == 0 else self.at(field, point, eps)  # eps = 0 if the prime divides the given eps
            if sides is None or _sides_agree(field, sides):
                yield Trial(None if sides is None else field.prime)
                continue
            decision = fails_over_Q(self, seed)
            if decision is None:  # without a rational witness, the witness modulo p refutes the identity
                summary = (
                    f"fails at a point over GF({field.prime}), where all denominators are units, so it fails over Q; "
                    f"none of {_SMALL_POINT_COUNT + _HIGH_POINT_COUNT} rational points shows it"
                )
                proof = Evidence("point over GF(p)", summary, {"prime": str(field.prime)})
                decision = Decision(Certainty.REFUTED, proof, witness_of(self, field, point, eps, sides))
            yield Trial(field.prime, decision)

    def data(self, undefined: int) -> dict[str, Any]:
        """Return the data of the evidence except bounds; at `undefined` points the sides were not defined."""
        return {"poles_met": undefined, "eps": "every" if self.eps is None else str(self.eps)}


@dataclass(frozen=True)
class Decision:
    """A verdict with its evidence and, if it is `refuted`, a witness."""

    verdict: Certainty
    evidence: Evidence
    witness: Witness | None = None


@dataclass(frozen=True)
class Trial:
    """The result at a random point. `prime` is None if the statement is undefined there; a `decision` ends the test."""

    prime: int | None = None
    decision: Decision | None = None


class Decidable(Protocol):
    """A statement that can be tested at random points: an identity, or a claim of the paper about its own objects.

    `bound` and `conjugates` are defined as in `Identity`. The test ends undecided after more than `max_failures` points
    at which the statement is not defined, or when `trials` ends.
    """

    @property
    def name(self) -> str: ...

    @property
    def where(self) -> str: ...

    @property
    def undefined_reason(self) -> str: ...

    @property
    def bound(self) -> tuple[CoefficientSize, int]: ...

    @property
    def conjugates(self) -> int: ...

    @property
    def max_failures(self) -> int: ...

    def trials(self, seed: int) -> Iterator[Trial]: ...

    def data(self, undefined: int) -> dict[str, Any]: ...


def decide(statement: Decidable, seed: int, error_bits: int = DEFAULT_ERROR_BITS) -> Decision:
    """Test a statement at random points over GF(p); a verdict `supported` is wrong with probability < 2^-error_bits."""
    size, pole_degree = statement.bound
    log2_trial_error = log2_error(size, pole_degree, statement.conjugates)
    is_bounded = not math.isinf(size.bits)
    if is_bounded and log2_trial_error >= -1:
        text = f"the degree bound {size.degree} is too large for primes of 63 bits to decide anything"
        return _undecided(text, points=0, degree_bound=size.degree)
    point_count = max(1, math.ceil(error_bits / -log2_trial_error)) if is_bounded else 1
    undefined_count = 0
    primes: list[int] = []
    for trial in statement.trials(seed):
        if trial.decision is not None:
            return trial.decision
        if trial.prime is not None:
            primes.append(trial.prime)
            if len(primes) == point_count:
                break
            continue
        undefined_count += 1
        if undefined_count > statement.max_failures:
            text = f"the {statement.name} is not defined at any of {undefined_count} random points over GF(p)"
            return _undecided(f"{text}: {statement.undefined_reason}", poles_met=undefined_count)
    else:
        return _undecided("no prime was found at which chi splits into distinct factors", points=0)
    if not is_bounded:
        return _undecided("held at a random point, which says nothing: the two sides have no values over bounds")
    error_bits_bound = math.floor(-log2_trial_error * point_count)
    return Decision(
        Certainty.SUPPORTED,
        Evidence(
            METHOD,
            f"held at {counted(point_count, 'random point')} over GF(p), p random of 63 bits{statement.where}; "
            f"false with probability below 2^-{error_bits_bound}",
            {
                "points": point_count,
                "error_bound": f"2^-{error_bits_bound}",
                "degree_bound": size.degree,
                "coefficient_bits_bound": math.ceil(size.bits),
                "pole_degree_bound": pole_degree,
                "primes": [str(prime) for prime in primes],
                **statement.data(undefined_count),
            },
        ),
    )


def _undecided(text: str, **data: Any) -> Decision:
    return Decision(Certainty.UNDECIDED, Evidence(METHOD, text, data))


def log2_error(size: CoefficientSize, pole_degree: int, conjugates: int = 1) -> float:
    """Return log2 of the probability that a false polynomial equation holds at a random point over GF(p).

    `pole_degree` is the degree of the product of all denominators. If the coefficients lie in a number field of degree
    at most `conjugates`, p is drawn from the primes modulo which the polynomial of the field has a root. At least half
    as many of them as Chebotarev predicts are assumed. A prime over p divides a number only if p divides its norm.
    """
    if max(size.degree, pole_degree) >= 1 << (PRIME_BITS - 2):
        return 0.0  # no bound: most points may be zeros or poles
    primes_log2 = _PRIMES_LOG2 - (math.log2(2 * conjugates) if conjugates > 1 else 0.0)
    bad_prime_probability = 2 ** (math.log2(max(1.0, conjugates * size.bits / PRIME_BITS)) - primes_log2)
    min_prime = 2.0**PRIME_BITS
    # The factor 2 accounts for the condition that no denominator vanishes at the point. The condition holds with
    # probability at least 1/2: the degree of the denominators is below 2^60, and their coefficients fit into memory.
    return math.log2(2 * (bad_prime_probability + size.degree / min_prime))


def small_points(dim: int, rng: random.Random, count: int) -> list[tuple[fmpq, ...]]:
    """Return `count` random rational points of slowly growing height: first integers, then small fractions."""
    points = []
    for k in range(count):
        height = 1 + k // 10
        denominator = 1 if k < count // 2 else 1 + k % 7
        points.append(tuple(fmpq(rng.randint(-height, height), rng.randint(1, denominator)) for _ in range(dim)))
    return points


def fails_over_Q(identity: Identity, seed: int) -> Decision | None:
    """Refute an identity by a rational point, a small one if possible; return None if no point is found."""
    rng = random.Random(f"witness {identity.seed(seed)}")
    points = small_points(identity.dim, rng, _SMALL_POINT_COUNT)
    points += [tuple(fmpq(rng.getrandbits(_HIGH_BITS)) for _ in range(identity.dim)) for _ in range(_HIGH_POINT_COUNT)]
    ground_field = identity.ground
    for k, rational_point in enumerate(points):
        eps = ground_field.convert(identity.eps if identity.eps is not None else fmpq(1, 1 + k % 5))
        point = tuple(ground_field.convert(entry) for entry in rational_point)
        sides = identity.at(ground_field, point, eps)
        witness = witness_of(identity, ground_field, point, eps, sides) if sides is not None else None
        if witness is not None:
            height = max(max(abs(int(entry.p)), int(entry.q)) for entry in rational_point)
            summary = f"fails at a rational point of height at most {height}, exactly"
            return Decision(Certainty.REFUTED, Evidence("exact rational point", summary, {}), witness)
    return None


def witness_of(identity: Identity, field: Field, point: tuple[Any, ...], eps: Any, sides: Sides) -> Witness | None:
    """Return a witness with the point and its two `sides`; None if the sides are equal."""
    left, right = sides
    if _sides_agree(field, sides):
        return None
    labels = (identity.left_label, identity.right_label)
    if identity.entries:
        k = next(k for k, (a, b) in enumerate(zip(left, right, strict=True)) if not field.equal(a, b))
        left, right = [left[k]], [right[k]]
        labels = (f"{identity.entries[k]} of {labels[0]}", f"{identity.entries[k]} of {labels[1]}")
    return Witness(
        tuple(field.format(entry) for entry in point),
        field.format(eps) if identity.has_eps else None,
        tuple(field.format(entry) for entry in left),
        tuple(field.format(entry) for entry in right),
        *labels,
        field.name,
    )


def _sides_agree(field: Field, sides: Sides) -> bool:
    left, right = sides
    return len(left) == len(right) and all(field.equal(a, b) for a, b in zip(left, right, strict=True))
