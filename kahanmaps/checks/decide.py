"""Deciding an identity of rational functions at random points, with a bound on the probability of error.

The identity is a polynomial equation P(x, eps) = 0 over the integers once denominators are cleared. For each trial
a prime p is drawn from [2^62, 2^63) and then a point over GF(p), by a hash of the identity and a seed, so that nobody
can write an identity for given points (algebra/chance.py). If P is not the zero polynomial, the
trial passes only if p divides all its coefficients (at most bits/62 of more than 2^55 primes do) or the point is a
root (probability at most degree/(p - 1), and p - 1 >= 2^62). Points where a denominator vanishes are drawn again;
since that happens less than half of the time, the sum of both is doubled. Trials are independent, so the bounds
multiply. Sources:
schwartz-1980; rosser-schoenfeld-1962 (more than 3N/(5 ln N) primes from N to 2N).

A trial that fails refutes the identity; a small rational point is then found at which both sides differ.
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
# Rosser and Schoenfeld: at least 3 N / (5 ln N) primes in (N, 2N] for N >= 21; here N = 2^62.
_PRIMES_LOG2 = math.log2(0.6) + PRIME_BITS - math.log2(PRIME_BITS * math.log(2))
_MAX_POLES = 200
_WITNESS_TRIES = 400
_HIGH_TRIES = 20  # beyond them: a function that is not 0 is hardly ever 0 at points of this many bits
_HIGH_BITS = 62

Sides = tuple[Sequence[Any], Sequence[Any]]


@dataclass(frozen=True)
class Identity:
    """Two sides to be equal at every point of a space of dimension `dim`.

    `sides(field, x, eps)` gives both as lists of field elements; it returns None, or raises SingularStep, where
    they are not defined. `eps` is the step the identity is stated for, None for every eps. `subject` is all that
    determines the two sides, as `derive_seed` takes it: points are drawn by its hash.
    """

    dim: int
    sides: Callable[[Field, tuple[Any, ...], Any], Sides | None]
    eps: fmpq | None
    left_label: str = "left side"
    right_label: str = "right side"
    entries: tuple[str, ...] = ()  # names of the entries, where a witness should show only one that differs
    scope: str = ""  # for what it is stated, in words, where there is more to say than eps
    has_eps: bool = True  # whether the sides depend on it
    no_value: str = "a denominator seems to vanish identically"  # where it is defined nowhere
    root: Root | None = None  # the algebraic number in the coefficients, where there is one
    subject: tuple[Any, ...] = dataclass_field(kw_only=True)

    def seed(self, seed: int) -> int:
        """What everything drawn for this identity is drawn from."""
        return derive_seed(seed, self.dim, self.eps, self.left_label, self.right_label, self.subject)

    @cached_property
    def bound(self) -> tuple[CoefficientSize, int]:
        """Bounds for the polynomials that vanish where the sides are equal, and the degree of what must not be zero.

        They come from the two sides themselves, computed with bounds in the place of numbers.
        """
        field, before = BoundField(), work.counted()
        eps = field.variable() if self.eps is None else field.convert(self.eps)
        sides = self.at(field, tuple(field.variable() for _ in range(self.dim)), eps)
        work.count(7 * (work.counted() - before))  # bounds are slower than numbers, of which values count themselves
        # Without values no bound: such an identity is never supported, whatever it does over GF(p).
        return (CoefficientSize(0, math.inf), 0) if sides is None else bound_of(field, zip(*sides, strict=True))

    def at(self, field: Field, point: tuple[Any, ...], eps: Any) -> Sides | None:
        """Both sides, None where they are not defined."""
        try:
            return self.sides(field, point, eps)
        except (SingularStep, SingularMatrix):
            return None

    # What `decide` asks of a statement.

    name = "identity"
    max_failures = _MAX_POLES

    @property
    def conjugates(self) -> int:
        """The degree of the number field that the coefficients lie in."""
        return 1 if self.root is None else self.root.degree

    @property
    def ground(self) -> Field:
        """The field of the coefficients."""
        return QQ if self.root is None else self.root.number_field

    @property
    def where(self) -> str:
        """For what it is stated, as a part of a sentence."""
        scope = self.scope
        if not scope and self.has_eps:
            scope = "for every eps" if self.eps is None else f"for eps = {self.eps}"
        return f", {scope}" if scope else ""

    def trials(self, seed: int) -> Iterator[Trial]:
        """The identity at random points, each over GF(p) for another random p."""
        rng = random.Random(f"identity {self.seed(seed)}")
        while True:
            field = random_prime_field(rng)
            sides = None
            if self.root is not None:
                try:
                    self.root.over(field)
                except BadPrime:  # it has no root there: the primes that count are the others
                    continue
            with suppress(BadPrime):
                point = tuple(field.random(rng) for _ in range(self.dim))
                eps = field.zero if self.eps is None else field.convert(self.eps)
                while self.eps is None and eps == 0:
                    eps = field.random(rng)
                sides = None if eps == 0 else self.at(field, point, eps)  # 0: the prime divides eps
            if sides is None or _equal(field, sides):
                yield Trial(None if sides is None else field.prime)
                continue
            decision = fails_over_Q(self, seed)
            if decision is None:  # the modular witness is as good
                summary = (
                    f"fails at a point over GF({field.prime}), where all denominators are units, so it fails over Q; "
                    f"none of {_WITNESS_TRIES + _HIGH_TRIES} rational points shows it"
                )
                proof = Evidence("point over GF(p)", summary, {"prime": str(field.prime)})
                decision = Decision(Certainty.REFUTED, proof, witness_of(self, field, point, eps, sides))
            yield Trial(field.prime, decision)

    def data(self, undefined: int) -> dict[str, Any]:
        """What evidence from random points says beside the bounds."""
        return {"poles_met": undefined, "eps": "every" if self.eps is None else str(self.eps)}


@dataclass(frozen=True)
class Decision:
    """The outcome: a verdict (supported, refuted or undecided), its evidence, and for refuted ones a witness."""

    verdict: Certainty
    evidence: Evidence
    witness: Witness | None = None


@dataclass(frozen=True)
class Trial:
    """A statement at one random point modulo `prime`; None: it has no value there. `decision` is there if it is one."""

    prime: int | None = None
    decision: Decision | None = None


class Decidable(Protocol):
    """What can be decided at random points: identities, and the claims of the paper on objects of their own.

    `bound` is as that of an identity, `conjugates` as for `log2_error`; `patience` is the number of points without a
    value after which there is no hope, and `trials` ends where no further point is to be had.
    """

    @property
    def name(self) -> str: ...

    @property
    def where(self) -> str: ...

    @property
    def no_value(self) -> str: ...

    @property
    def bound(self) -> tuple[CoefficientSize, int]: ...

    @property
    def conjugates(self) -> int: ...

    @property
    def max_failures(self) -> int: ...

    def trials(self, seed: int) -> Iterator[Trial]: ...

    def data(self, undefined: int) -> dict[str, Any]: ...


def decide(statement: Decidable, seed: int, error_bits: int = DEFAULT_ERROR_BITS) -> Decision:
    """Decide a statement at random points over GF(p): supported with error below 2^-error_bits, or refuted."""
    equation, pole_degree = statement.bound
    per_trial = log2_error(equation, pole_degree, statement.conjugates)
    is_bounded = not math.isinf(equation.bits)
    if is_bounded and per_trial >= -1:
        text = f"the degree bound {equation.degree} is too large for primes of 63 bits to decide anything"
        return _undecided(text, points=0, degree_bound=equation.degree)
    needed = max(1, math.ceil(error_bits / -per_trial)) if is_bounded else 1
    undefined = 0
    primes: list[int] = []
    for trial in statement.trials(seed):
        if trial.decision is not None:
            return trial.decision
        if trial.prime is not None:
            primes.append(trial.prime)
            if len(primes) == needed:
                break
            continue
        undefined += 1
        if undefined > statement.max_failures:
            text = f"the {statement.name} is not defined at any of {undefined} random points over GF(p)"
            return _undecided(f"{text}: {statement.no_value}", poles_met=undefined)
    else:
        return _undecided("no prime was found at which chi splits into distinct factors", points=0)
    if not is_bounded:
        return _undecided("held at a random point, which says nothing: the two sides have no values over bounds")
    bound = math.floor(-per_trial * needed)
    return Decision(
        Certainty.SUPPORTED,
        Evidence(
            METHOD,
            f"held at {counted(needed, 'random point')} over GF(p), p random of 63 bits{statement.where}; "
            f"false with probability below 2^-{bound}",
            {
                "points": needed,
                "error_bound": f"2^-{bound}",
                "degree_bound": equation.degree,
                "coefficient_bits_bound": math.ceil(equation.bits),
                "pole_degree_bound": pole_degree,
                "primes": [str(prime) for prime in primes],
                **statement.data(undefined),
            },
        ),
    )


def _undecided(text: str, **data: Any) -> Decision:
    return Decision(Certainty.UNDECIDED, Evidence(METHOD, text, data))


def log2_error(equation: CoefficientSize, poles: int, conjugates: int = 1) -> float:
    """log2 of the probability that a random point over GF(p) passes although the polynomial equation is false.

    `poles` is the degree of the product of all denominators. Coefficients may lie in a number field of degree at most
    `conjugates`, and p be random among the primes that split there: of those there are at least half as many as
    Chebotarev's density gives, is assumed, and a nonzero coefficient is divided by one only if its norm is.
    """
    if max(equation.degree, poles) >= 1 << (PRIME_BITS - 2):
        return 0.0  # no bound: too many points may be roots, or have no value
    primes_log2 = _PRIMES_LOG2 - (math.log2(2 * conjugates) if conjugates > 1 else 0.0)
    bad_primes = 2 ** (math.log2(max(1.0, conjugates * equation.bits / PRIME_BITS)) - primes_log2)
    scale = 2.0**PRIME_BITS
    # The factor 2 is for the condition that all denominators are defined and not zero at the point: that holds with
    # probability at least 1/2, since their degree is below 2^60 and their coefficients fit into a computer's memory.
    return math.log2(2 * (bad_primes + equation.degree / scale))


def small_points(dim: int, rng: random.Random, count: int) -> list[tuple[fmpq, ...]]:
    """Rational points of slowly growing height: integers first, then small fractions."""
    points = []
    for k in range(count):
        height = 1 + k // 10
        denominator = 1 if k < count // 2 else 1 + k % 7
        points.append(tuple(fmpq(rng.randint(-height, height), rng.randint(1, denominator)) for _ in range(dim)))
    return points


def fails_over_Q(identity: Identity, seed: int) -> Decision | None:
    """The refutation by a rational point at which the sides differ: a small one if possible; None where none shows."""
    rng = random.Random(f"witness {identity.seed(seed)}")
    points = small_points(identity.dim, rng, _WITNESS_TRIES)
    points += [tuple(fmpq(rng.getrandbits(_HIGH_BITS)) for _ in range(identity.dim)) for _ in range(_HIGH_TRIES)]
    ground = identity.ground
    for k, candidate in enumerate(points):
        at_eps = ground.convert(identity.eps if identity.eps is not None else fmpq(1, 1 + k % 5))
        point = tuple(ground.convert(entry) for entry in candidate)
        sides = identity.at(ground, point, at_eps)
        witness = witness_of(identity, ground, point, at_eps, sides) if sides is not None else None
        if witness is not None:
            height = max(max(abs(int(entry.p)), int(entry.q)) for entry in candidate)
            where = f"fails at a rational point of height at most {height}, exactly"
            return Decision(Certainty.REFUTED, Evidence("exact rational point", where, {}), witness)
    return None


def witness_of(identity: Identity, field: Field, point: tuple[Any, ...], eps: Any, sides: Sides) -> Witness | None:
    """The two sides at a point as a witness; None where they are equal."""
    left, right = sides
    if _equal(field, sides):
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


def _equal(field: Field, sides: Sides) -> bool:
    left, right = sides
    return len(left) == len(right) and all(field.equal(a, b) for a, b in zip(left, right, strict=True))
