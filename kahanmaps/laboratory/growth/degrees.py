"""Degrees of the iterates of a map Phi: d_n is the degree of Phi^n as a map of projective space to itself.

d_n is measured as the degree of the rational curve t -> Phi^n(a + b t) (module `curves`), for a random line a + b t
over GF(p), a random prime p and, if eps is not given, a random residue eps. A line in special position, or a bad prime,
can only make the degree too small. So d_n is the maximum of the degrees for two lines, each with its own prime and eps.

A recurrence that fits the first degrees may fail later: an exceptional hypersurface (contracted by the map) lowers no
degree before one of its images lies in the indeterminacy locus, perhaps a hundred steps later. So the singularity
patterns of these hypersurfaces are computed (`singularities`). If all patterns are known, the degrees of all iterates
are derived from them (`renewal`), and the measured degrees have to agree. Otherwise a recurrence of measured degrees is
accepted only with enough terms beyond the last step at which a known pattern lowers the degree.

The dynamical degree lim d_n^(1/n) measures complexity; it is 1 for all known integrable maps. The logarithm of the
dynamical degree is the algebraic entropy (bellon-viallet-1999).
"""

from __future__ import annotations

import random
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import log
from typing import Any

from flint import fmpq

from kahanmaps.algebra.chance import derive_seed
from kahanmaps.algebra.fields import integer, rational
from kahanmaps.algebra.printing import attributes, format_number
from kahanmaps.algebra.work import Budget
from kahanmaps.checks.claims import Certainty
from kahanmaps.display_protocols import PrintableResult
from kahanmaps.errors import BadPrime, InputError, counted
from kahanmaps.hard_stop import TimeLimit
from kahanmaps.invariants.growth import Growth
from kahanmaps.laboratory.defaults import ITERATE_DEGREE, budget_for
from kahanmaps.laboratory.growth.curves import Ended, Line, Stopped, reduce_map
from kahanmaps.laboratory.growth.degree_bounds import DynamicalDegreeBounds, bound_dynamical_degree
from kahanmaps.laboratory.growth.proofs import (
    GrowthProof,
    exponent_matrix,
    linear_iterate,
    monomial_degree,
    monomial_growth,
    monomial_period,
)
from kahanmaps.laboratory.growth.recurrences import GrowthRate, Recurrence, find_recurrence
from kahanmaps.laboratory.growth.renewal import coefficients, recurrence_of
from kahanmaps.laboratory.singular.singularities import MAX_STEPS, WRITTEN_DIMENSION, Patterns
from kahanmaps.laboratory.singular.singularities import patterns as patterns_of_map
from kahanmaps.laboratory.singular.written import with_eps
from kahanmaps.maps.convention import resolve_eps
from kahanmaps.maps.implicit import MapFamily
from kahanmaps.maps.kahan import SystemLike, as_map

MAX_TERMS = 10_000  # maximal number of measured iterates
_LINES = 2  # number of random lines; the degree of an iterate is measured for each
_DENSE_TERMS, _SEARCH_INTERVAL = 64, 8  # a recurrence is searched for at each of the first 64 terms, then at every 8th
_MIN_QUOTIENTS = 6  # minimal number of quotients d_n/d_{n-1} to estimate whether the growth is exponential
_AGREEING_TERMS = 12  # derived degrees must agree with this many measured ones, beyond twice the longest pattern
_LARGE_DEGREE = 2000  # above this degree, the terms measured so far suffice
_MATRIX_TERMS = 60  # number of degrees of a monomial map that are computed
_MAX_REPLACEMENTS = 6  # maximal number of replaced lines; about one line in 2^40 is in special position


@dataclass(frozen=True)
class DegreeGrowth(PrintableResult):
    """The degrees d_0 = 1, d_1, d_2, ... of the iterates of a map, and their growth.

    `eps` is None for generic eps (a random residue for each line). `patterns` are the singularity patterns; None if
    they were not computed. Degrees and patterns are measured modulo primes, which is evidence but no proof.
    `dynamical_degree_bounds` are proved for planar maps, or None without a proved lower bound above 1. `proof` is a
    proof of the growth, or None. The degrees of monomial maps are exact; `primes` is then empty.
    """

    _parts = "degrees"

    degrees: tuple[int, ...]
    eps: fmpq | None
    ended: str  # a member of `Ended`, or the text in a stored record
    message: str
    seed: int
    primes: tuple[int, ...]
    residues: tuple[int, ...]
    notes: tuple[str, ...] = ()
    patterns: Patterns | None = None
    dynamical_degree_bounds: DynamicalDegreeBounds | None = None
    proof: GrowthProof | None = None

    @cached_property
    def fitted(self) -> Recurrence | None:
        """The shortest recurrence that `find_recurrence` accepts for the degrees, or None. It may be `unconfirmed`."""
        return find_recurrence(self.degrees)

    @cached_property
    def derived(self) -> Recurrence | None:
        """The recurrence derived from the singularity patterns; None if these are unknown or contradict a degree."""
        if self.patterns is None or not self.patterns.series or self.disagreement is not None:
            return None
        return recurrence_of(self.patterns.fraction, self.degrees)

    @cached_property
    def disagreement(self) -> int | None:
        """The first n for which the measured d_n differs from that of the singularity patterns; None if all agree."""
        if self.patterns is None or not self.patterns.series:
            return None
        expected = coefficients(self.patterns.fraction, len(self.degrees))
        return next((n for n, (d, e) in enumerate(zip(self.degrees, expected, strict=True)) if d != e), None)

    @cached_property
    def unconfirmed(self) -> str:
        """The reason why the fitted recurrence may fail later; empty if it is confirmed, or if there is none."""
        if self.disagreement is not None:
            return (
                f"the measured degree of iterate {self.disagreement} contradicts the singularity patterns; "
                "try another --seed or --eps"
            )
        if self.fitted is None or self.patterns is None or self.derived is not None:
            return ""
        if self.patterns.running:
            return self.patterns.running
        if not self.patterns.lengths and any(d != self.degrees[1] ** n for n, d in enumerate(self.degrees)):
            return (
                "degrees drop although no exceptional hypersurface is mapped into the indeterminacy locus; "
                "try another --seed"
            )
        if len(self.degrees) < (needed_terms := self.patterns.terms_needed(self.fitted.order)):
            longest_pattern = max(self.patterns.lengths)
            pattern_text = f"a singularity pattern of {longest_pattern} steps"
            return f"{pattern_text} calls for {needed_terms - 1} iterates; raise --effort or --max-degree"
        return ""

    @property
    def recurrence(self) -> Recurrence | None:
        """The linear recurrence of the degrees: the derived one, or else the fitted one if it is confirmed, or None.

        With a proof of the growth, a fitted recurrence needs no confirmation, but must have the proved growth.
        """
        if self.proof is None or self.derived is not None:
            return self.derived or (None if self.unconfirmed else self.fitted)
        recurrence = self.fitted
        if (
            recurrence is None
            or recurrence.rate is None
            or (recurrence.growth, recurrence.power) != (self.proof.growth, self.proof.power)
        ):
            return None
        return recurrence if recurrence.rate.minimal_polynomial == self.proof.rate.minimal_polynomial else None

    @property
    def growth(self) -> Growth:
        """The kind of growth, from a proof, the recurrence, or bounds of the dynamical degree; or UNKNOWN."""
        if self.proof is not None:
            return self.proof.growth
        if self.ended == Ended.CONSTANT:
            return Growth.ZERO
        if self.recurrence is None:
            return Growth.UNKNOWN if self.dynamical_degree_bounds is None else Growth.EXPONENTIAL
        return self.recurrence.growth

    @property
    def dynamical_degree(self) -> GrowthRate | None:
        """The limit of d_n^(1/n), an algebraic number, from a proof or the recurrence; None if neither is known."""
        if self.proof is not None:
            return self.proof.rate
        return None if self.recurrence is None else self.recurrence.rate

    @property
    def estimate(self) -> str | None:
        """A rounded estimate of the dynamical degree: d_n/d_{n-1} if `looks_exponential`, else d_n^(1/n)."""
        if len(self.degrees) < 3 or self.degrees[-1] == 0:
            return None
        n = len(self.degrees) - 1
        return f"{self.degrees[-1] / self.degrees[-2] if self.looks_exponential else self.degrees[-1] ** (1 / n):.6g}"

    @property
    def looks_exponential(self) -> bool:
        """Whether the last quotients d_n/d_{n-1} change by far less than those of a sequence of polynomial growth.

        For polynomial growth a quotient 1 + r decreases by about r/n in the next step. The answer is True if the last
        two changes are less than r/(4 n), and r > 0.2. It is an estimate, for sequences too short for a recurrence.
        """
        d = self.degrees
        n = len(d) - 1
        if n < _MIN_QUOTIENTS or d[n - 3] == 0:
            return False
        a, b, c = (d[k] / d[k - 1] for k in (n - 2, n - 1, n))
        return c > 1.2 and all(abs(later / earlier - 1) < (c - 1) / (4 * n) for earlier, later in ((a, b), (b, c)))

    @property
    def kind_text(self) -> str:
        """The kind of growth, with its power or dynamical degree; an estimate if no recurrence is confirmed."""
        if self.growth is Growth.ZERO:
            return "zero from some iterate on: that iterate is a constant map"
        if (source := self.proof or self.recurrence) is not None:
            if source.growth is Growth.EXPONENTIAL:
                return "exponential growth" + (
                    f", dynamical degree {source.rate.text}" if source.rate is not None else ""
                )
            power_text = f" of degree {source.power}" if source.growth is Growth.POLYNOMIAL else ""
            return f"{source.growth} growth{power_text}, dynamical degree 1"
        terms_text = counted(len(self.degrees), "term")
        if self.looks_exponential:
            reason = self.unconfirmed or f"no recurrence in {terms_text}"
            quotients = sorted(d / c for c, d in zip(self.degrees[-4:], self.degrees[-3:], strict=False))
            quotients_text = f"the last quotients are {quotients[0]:.6g} to {quotients[-1]:.6g}; {reason}"
            proved_text = "" if self.dynamical_degree_bounds is None else " (proved),"
            return f"exponential growth{proved_text} by a factor of about {self.estimate} (estimated: {quotients_text})"
        if self.dynamical_degree_bounds is not None:
            return f"exponential growth; {self.unconfirmed or f'no recurrence found in {terms_text}'}"
        if self.fitted is not None:
            return f"{terms_text} fit {self.fitted.growth} growth, an estimate only: {self.unconfirmed}"
        n = len(self.degrees) - 1
        estimate_text = f"; d_n^(1/n) is {self.estimate} for n = {n}, an estimate only" if self.estimate else ""
        return f"no recurrence found in {terms_text}{estimate_text}"

    @property
    def basis(self) -> str:
        """The certainty of the growth, with the proof or the number of steps searched for confinement, as a phrase."""
        if self.proof is not None:
            return f"{self.known}: {self.proof.reason}"
        return f"{self.known}: {self.patterns.limit}" if self.patterns and self.patterns.limit else str(self.known)

    @property
    def known(self) -> Certainty:
        """The certainty of the kind of growth; `dynamical_degree_bounds` are always proved."""
        if self.proof is not None:
            return Certainty.PROVED
        if self.derived is not None:
            return Certainty.DERIVED
        if self.recurrence is not None or self.ended == Ended.CONSTANT:
            return Certainty.MEASURED
        if self.looks_exponential:
            return Certainty.ESTIMATED  # `kind_text` states a factor
        return Certainty.UNDECIDED if self.dynamical_degree_bounds is None else Certainty.PROVED

    @property
    def growth_text(self) -> str:
        """The phrase `kind_text`, with `basis` in parentheses if there is a proof or a limited number of steps."""
        is_limited = self.recurrence is not None and self.patterns is not None and self.patterns.limit
        return self.kind_text + (f" ({self.basis})" if self.proof is not None or is_limited else "")

    def rows(self) -> list[dict[str, int]]:
        """Return a row for each iterate, for example for `pandas.DataFrame(growth.rows())`."""
        return [{"n": n, "degree": degree} for n, degree in enumerate(self.degrees)]

    @property
    def text(self) -> str:
        """The lines of the report; each line has a label, a tab and a value."""
        lines = [("degrees", ", ".join(map(str, self.degrees))), ("growth", self.growth_text)]
        if self.recurrence is not None:
            lines.append(("recurrence", self.recurrence.text))
            lines.append(("characteristic polynomial", self.recurrence.characteristic_text))
            if self.recurrence.closed_form_text:
                lines.append(("closed form", self.recurrence.closed_form_text))
        if self.patterns is not None:
            if self.derived is not None:
                lines.append(("generating function", self.patterns.series_text))
            lines.append(("singularities", self.patterns.text))
            lines += [("exceptional hypersurface", text) for text in self.patterns.sentences]
            lines += [("note", self.patterns.word_text)] if self.patterns.word_text else []
        if self.dynamical_degree_bounds is not None:
            lines.append(("proved", self.dynamical_degree_bounds.text))
        lines += [("ended", self.message), *(("note", note) for note in self.notes)]
        return "\n".join(f"{label}\t{value}" for label, value in lines)

    def to_json(self) -> dict[str, Any]:
        """Return plain data; primes and residues are text: many JSON readers do not read such integers exactly."""
        lines = zip(self.primes, self.residues, strict=True)
        names = ("growth", "growth_text", "basis", "dynamical_degree", "estimate", "looks_exponential", "recurrence")
        return {
            **attributes(self, "degrees"),
            "eps": "generic" if self.eps is None else format_number(self.eps),
            **attributes(self, "ended", "message", "seed"),
            "lines": [{"prime": str(p), "eps_residue": str(e)} for p, e in lines],
            **attributes(self, *names, singularities="patterns", enclosure="dynamical_degree_bounds"),
            **attributes(self, "proof", "unconfirmed", "notes"),
        }


def degree_growth(
    system: SystemLike,
    eps: Any = None,
    *,
    time_step: Any = None,
    h: Any = None,
    effort: int | Budget = 1,
    max_terms: int | None = None,
    max_degree: int = ITERATE_DEGREE,
    seed: int = 0,
    steps: int | None = None,
    patterns: Patterns | None = None,
    enclosed: bool = True,
    progress: Callable[[str], None] = lambda _: None,
) -> DegreeGrowth:
    """Measure the degrees of the iterates of a map, for one exact eps or for generic eps.

    The search stops when a recurrence is confirmed: at least 6 further terms, and as many as its order, satisfy it, and
    the singularity patterns give the same recurrence or enough terms lie beyond the last confinement.

    Args:
        system: a map, or a system, which stands for its Kahan map.
        eps: half the time step, an exact number; None for generic eps.
        time_step, h: the time step 2 eps, instead of eps.
        effort: each increase by 1 doubles the work limit; or the Budget of a computation that contains this search.
        max_terms: if given, all of d_1, ..., d_max_terms are measured, even if a recurrence is confirmed earlier.
        max_degree: the search stops before the first iterate of higher degree.
        seed: the random seed.
        steps: the number of steps for which the images of exceptional hypersurfaces are computed.
        patterns: the singularity patterns, if they are known; by default they are computed.
        enclosed: whether to search for bounds of the dynamical degree if the degrees of a planar map look exponential.
        progress: called with a message at each stage.

    Returns:
        A `DegreeGrowth`. Degrees are measured modulo random primes of 61 bits; only bounds and `proof` are proved.
        A TimeLimit ends the search with the degrees so far; if `effort` is a Budget, it is raised again.

    Raises:
        InputError: for eps = 0, and for other values out of range.

    Source: bellon-viallet-1999.

    >>> from kahanmaps.documents.catalog import load
    >>> growth = degree_growth(load("euler_top").system)
    >>> growth.degrees[:6], str(growth.growth), growth.recurrence.closed_form
    ((1, 3, 9, 19, 33, 51), 'quadratic', '2*n^2 + 1')
    """
    eps = resolve_eps(eps, time_step, h)
    exact_eps = None if eps is None else rational(eps)
    if exact_eps == 0:
        raise InputError("found eps = 0, expected another number: at eps = 0 the Kahan map is the identity")
    if max_terms is not None and not 0 <= integer(max_terms, "max_terms") <= MAX_TERMS:
        raise InputError(f"found {max_terms} terms, expected 0 to {MAX_TERMS}")
    if steps is not None and not 1 <= steps <= MAX_STEPS:
        raise InputError(f"found {steps} steps, expected 1 to {MAX_STEPS}")
    if max_degree < 1:
        raise InputError(f"found the largest degree {max_degree}, expected at least 1")
    search = _Search(as_map(system), exact_eps, budget_for("degrees", effort), max_degree, seed, steps, patterns)
    try:
        return search.run(max_terms, enclosed, progress)
    except TimeLimit as stop:
        if isinstance(effort, Budget):
            raise
        if search.measured is not None:  # the time limit ended the search for bounds
            return replace(search.measured, message=f"{search.measured.message}; {stop}")
        return search.result(Ended.STOPPED, f"{stop} at iterate {len(search.degrees)}")


def dynamical_degree(
    system: SystemLike, eps: Any = None, *, time_step: Any = None, h: Any = None, effort: int = 1, seed: int = 0
) -> GrowthRate | DynamicalDegreeBounds | None:
    """Return the dynamical degree lim d_n^(1/n) of a map; the arguments are those of `degree_growth`.

    Returns an algebraic number (its certainty is `degree_growth(system).known`), proved bounds, or None if undecided.

    >>> dynamical_degree("euler_top")
    <GrowthRate: 1>
    """
    growth = degree_growth(system, eps, time_step=time_step, h=h, effort=effort, seed=seed)
    return growth.dynamical_degree or growth.dynamical_degree_bounds


def algebraic_entropy(
    system: SystemLike, eps: Any = None, *, time_step: Any = None, h: Any = None, effort: int = 1, seed: int = 0
) -> float | None:
    """Return the logarithm of the dynamical degree of a map, rounded; None if no algebraic number is known for it.

    >>> algebraic_entropy("euler_top")
    0.0
    """
    rate = dynamical_degree(system, eps, time_step=time_step, h=h, effort=effort, seed=seed)
    return log(float(rate)) if isinstance(rate, GrowthRate) else None


@dataclass
class _Search:
    """The state of a search: random lines, and the degrees of their images measured so far."""

    map: MapFamily
    eps: fmpq | None
    budget: Budget
    max_degree: int
    seed: int
    steps: int | None
    patterns: Patterns | None
    degrees: list[int] = field(default_factory=lambda: [1])
    notes: list[str] = field(default_factory=list)
    lines: list[Line] = field(default_factory=list)
    replaced: int = 0
    measured: DegreeGrowth | None = None  # the result before the search for bounds of the dynamical degree

    def run(self, max_terms: int | None, enclosed: bool, progress: Callable[[str], None]) -> DegreeGrowth:
        """Measure the degrees of successive iterates until a member of `Ended` applies; return the result."""
        matrix = exponent_matrix(self.map, self.eps)
        if matrix is not None and (proof := monomial_growth(matrix)) is not None:
            period_proof = monomial_period(self.map, self.eps, matrix) if proof.growth is Growth.BOUNDED else None
            # The degrees of a monomial map follow exactly from the powers of its exponent matrix.
            power, ending, message = matrix, Ended.PROVED if max_terms is None else Ended.TERMS, ""
            while len(self.degrees) <= (_MATRIX_TERMS if max_terms is None else max_terms):
                recurrence = find_recurrence(self.degrees) if max_terms is None else None
                if recurrence is not None and recurrence.checked >= max(6, recurrence.order):
                    break
                degree = monomial_degree(power)
                if degree > self.max_degree:
                    ending = Ended.DEGREE
                    message = f"the degree of iterate {len(self.degrees)} is above {self.max_degree}"
                    break
                self.degrees.append(degree)
                power = power * matrix
            iterates = counted(len(self.degrees) - 1, "iterate")
            message = message or f"degrees of {iterates} by powers of the exponent matrix"
            return self.result(ending, message, proof=period_proof or proof)

        rng = random.Random(f"degrees {derive_seed(self.seed, self.map.seed_data, self.eps)}")

        def new_line() -> Line:
            while True:
                try:
                    return Line(reduce_map(self.map, self.eps, rng), rng, self.budget, self.max_degree)
                except BadPrime:
                    continue

        self.lines = [new_line() for _ in range(_LINES)]
        try:
            while True:
                self._check_recurrence(max_terms is None)
                if max_terms is not None and len(self.degrees) > max_terms:
                    raise Stopped(Ended.TERMS, f"{counted(max_terms, 'iterate')} measured, as requested")
                if len(self.degrees) > MAX_TERMS:
                    raise Stopped(Ended.TERMS, f"{MAX_TERMS} iterates measured, the largest number that is allowed")
                progress(f"degrees: iterate {len(self.degrees)}, degree {self.degrees[-1]} before it")
                self._step(new_line)
                if self.degrees[-1] == 0 and max_terms is None:
                    raise Stopped(Ended.CONSTANT, f"iterate {len(self.degrees) - 1} is a constant map")
        except Stopped as stop:
            ending, message = stop.ended, stop.message
        if ending is Ended.DEGREE:  # at high degrees, there may be too few terms for a recurrence; patterns may suffice
            self._compute_patterns()
        result = self.result(ending, message)
        patterns = self.patterns
        if patterns is not None and patterns.at and self.eps is None and not self.budget.is_spent:
            exceptional = with_eps(self.map, rational(patterns.at), patterns.exceptional)  # polynomials over Q[eps]
            result = replace(result, patterns=replace(patterns, exceptional=exceptional))
        period = next((n for n, degree in enumerate(self.degrees) if n and degree == 1), None)
        if period is not None:
            result = replace(result, proof=linear_iterate(self.map, self.eps, period))
        if not enclosed or (result.growth is not Growth.EXPONENTIAL and not result.looks_exponential):
            return result
        self.measured = result
        bounds = bound_dynamical_degree(self.map, self.eps, seed=self.seed, effort=self.budget, progress=progress)
        if bounds is None and self.map.dim == 2 and self.budget.is_spent:
            note = "work limit reached before bounds of the dynamical degree were proved; raise --effort"
            return replace(result, notes=(*result.notes, note))
        return replace(result, dynamical_degree_bounds=bounds)

    def result(self, ending: str, message: str, **proofs: Any) -> DegreeGrowth:
        primes, residues = tuple(line.prime for line in self.lines), tuple(line.eps for line in self.lines)
        fields: dict[str, Any] = {"patterns": self.patterns, "notes": tuple(self.notes), **proofs}
        return DegreeGrowth(tuple(self.degrees), self.eps, ending, message, self.seed, primes, residues, **fields)

    def _check_recurrence(self, may_stop: bool) -> None:
        """Search for a recurrence; compute patterns when useful. If `may_stop`, raise Stopped if it is confirmed."""
        term_count = len(self.degrees)
        if term_count < 2 or (term_count > _DENSE_TERMS and term_count % _SEARCH_INTERVAL):
            return
        recurrence = find_recurrence(self.degrees)
        # Above dimension 4, patterns of maps without explicit formulas are slow, and a recurrence is awaited first.
        if self.map.dim <= WRITTEN_DIMENSION or recurrence is not None or self.lines[0].is_explicit:
            self._compute_patterns()
        if not may_stop:
            return
        patterns = self.patterns
        is_confirmed = recurrence is not None and recurrence.checked >= max(6, recurrence.order)
        derived_recurrence = self.result(Ended.TERMS, "").derived
        if derived_recurrence is not None:
            longest_pattern = max(patterns.lengths, default=0) if patterns is not None else 0
            is_equal = recurrence is not None and recurrence.characteristic == derived_recurrence.characteristic
            is_long = term_count > 2 * longest_pattern + _AGREEING_TERMS or self.degrees[-1] > _LARGE_DEGREE
            if (is_confirmed and is_equal) or is_long:
                raise Stopped(
                    Ended.DERIVED, "the degrees are derived from the singularity patterns, and the measured ones agree"
                )
            return
        if recurrence is None or not is_confirmed:
            return
        if patterns is not None and patterns.running:
            raise Stopped(Ended.UNCONFIRMED, f"a recurrence of order {recurrence.order} fits, but {patterns.running}")
        if patterns is None or term_count >= patterns.terms_needed(recurrence.order):
            raise Stopped(
                Ended.RECURRENCE,
                f"a recurrence of order {recurrence.order} holds for {recurrence.checked} further terms",
            )

    def _compute_patterns(self) -> None:
        """Compute the singularity patterns, if unknown, of a map of degree above 1 with rational coefficients."""
        if self.map.root is None and self.patterns is None and len(self.degrees) > 1 and self.degrees[1] > 1:
            options: dict[str, Any] = {"steps": self.steps, "seed": self.seed, "effort": self.budget.part(0.7)}
            self.patterns = patterns_of_map(self.map, self.eps, **options)

    def _step(self, new_line: Callable[[], Line]) -> None:
        """Append the degree of the next iterate: map all curves; replace lines in special position by new lines."""
        n, degrees = len(self.degrees), self.degrees

        def degree_on(curve: Line) -> int:
            """Return the degree of iterate n on a line; -1 if the line is in special position."""
            try:
                while curve.steps < n:
                    k = curve.steps + 1
                    guess = degrees[k] if k < n else self.map.dim if k == 1 else degrees[1] * degrees[-1]
                    if k == n > 1 and degrees[-2]:
                        # Degrees are almost log-concave: the last quotient of degrees is nearly a bound of the next
                        # one. A guess that is too low only costs a second attempt.
                        guess = min(guess, degrees[-1] * degrees[-1] // degrees[-2] + 4)
                    curve.step(guess)
                    if k < n and curve.degree != degrees[k]:
                        return -1
            except ZeroDivisionError:
                return -1
            return curve.degree

        while True:
            degrees_on_lines = [degree_on(curve) for curve in self.lines]
            max_line_degree = max(degrees_on_lines)
            if max_line_degree >= 0 and min(degrees_on_lines) == max_line_degree:
                self.degrees.append(max_line_degree)
                return
            self.replaced += 1
            if max_line_degree < 0 and self.replaced > _LINES:
                raise Stopped(
                    Ended.SINGULAR, f"iterate {n} exists nowhere: {self.map.denominator_name} = 0 on the image"
                )
            if self.replaced > _MAX_REPLACEMENTS:
                raise Stopped(Ended.LINES, f"random lines disagree on the degree of iterate {n}: {degrees_on_lines}")
            if max_line_degree >= 0:
                self.notes.append(
                    f"a line gave a smaller degree of iterate {n} and was replaced by another: {degrees_on_lines}"
                )
            for k, line_degree in enumerate(degrees_on_lines):
                if line_degree < max_line_degree or max_line_degree < 0:
                    self.lines[k] = new_line()
