"""Poisson tensors that a map preserves, found: skew P(x) with polynomial entries and dPhi P(x) dPhi^T = P(x~).

At a random point modulo a prime the law is n (n - 1)/2 linear equations for the coefficients of P, so that all P up to
a degree are one null space. A tensor is written as the polynomial sum P_ij d_i d_j, as bivectors are, with names d_i of
their own: so its coefficients are lifted to functions of eps and the symbols as those of any polynomial. With a
function psi for a common denominator it is B = psi P that is found: psi(x~) dPhi B(x) dPhi^T = psi(x) B(x~).

The Jacobi identity is not linear in P. Where several tensors are found that satisfy it, one identity with a symbol for
each of them decides whether all their combinations do.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import reduce
from itertools import combinations
from math import comb
from typing import Any

from flint import nmod

from kahanmaps.algebra.fields import GF, Field, integer
from kahanmaps.algebra.modular_matrices import null_space, rank
from kahanmaps.algebra.polynomials import RationalFunction, degree_in, ring
from kahanmaps.algebra.printing import attributes, format_factored, format_rational_function
from kahanmaps.algebra.work import SPENT, Budget, count
from kahanmaps.checks.certify import MAX_DIMENSION
from kahanmaps.checks.claims import Certainty, Evidence
from kahanmaps.checks.decide import Identity, Sides
from kahanmaps.checks.preserve import jacobi_identity, transformation_identity
from kahanmaps.displayed import latex
from kahanmaps.documents.inline import as_file
from kahanmaps.errors import InputError, KahanmapsError, counted, quoted
from kahanmaps.invariants.phase_functions import at_eps
from kahanmaps.invariants.poisson import MatrixPoissonTensor
from kahanmaps.laboratory.defaults import budget_for, tensor_degree
from kahanmaps.laboratory.laboratory import Laboratory, certified
from kahanmaps.laboratory.modular_points import (
    Independent,
    ModularMap,
    NoPoint,
    Point,
    exponents_up_to,
    places_of,
    product_of,
    slopes,
)
from kahanmaps.laboratory.preserve.darboux.cofactors import CofactorProduct, Sample, cofactor_space, points_needed
from kahanmaps.laboratory.preserve.darboux.darboux_spaces import DarbouxSpace
from kahanmaps.laboratory.preserve.integrals import FoundIntegral, find_integrals
from kahanmaps.laboratory.preserve.poisson.casimirs import casimir_candidates
from kahanmaps.laboratory.preserve.products import candidates, products_of
from kahanmaps.laboratory.preserve.results import Search
from kahanmaps.maps.convention import resolve_eps
from kahanmaps.maps.kahan import SystemLike

_MAX_UNKNOWNS = 2000
_MOST_LOGARITHMIC = 16  # the largest dimension in which all monomials of degree 4 in x and d are listed
_SPARE = 8
_SHOWN = 2000  # characters of the brackets of one tensor
_MOST_INTEGRALS = 12  # of these all subsets are tried
_LARGEST_PENCIL = 8  # so many tensors whose combinations are put to the Jacobi identity

Exponents = tuple[int, ...]


@dataclass(frozen=True)
class FoundTensor:
    """A tensor that the map preserves, with the verdict on that, and on the Jacobi identity (`jacobi`).

    `rank` is that at random points. Of the integrals that are known, `casimirs` names those whose gradient the tensor
    kills and, where there are more Casimirs among functions of the integrals, products and polynomials of them, as
    I1/I2; `in_involution` names as many integrals as there are in involution with each other, `involution` being the
    verdict on that, None without any.
    """

    name: str
    tensor: MatrixPoissonTensor
    verdict: Certainty
    evidence: Evidence
    jacobi: Certainty
    jacobi_evidence: Evidence
    rank: int
    casimirs: tuple[str, ...] = ()
    in_involution: tuple[str, ...] = ()
    involution: Certainty | None = None

    @property
    def text(self) -> str:
        """The brackets that are not 0."""
        return self.tensor.formula

    @property
    def short_text(self) -> str:
        """The brackets, or how many there are where they would fill pages."""
        if len(self.text) <= _SHOWN:
            return self.text
        return f"{counted(len(self.tensor.brackets), 'bracket')} that find-poisson writes out"

    @property
    def is_liouville_integrable(self) -> bool:
        """Whether as many integrals are known to be in involution as the theorem of Liouville asks for."""
        enough = len(self.in_involution) >= self.tensor.dim - self.rank // 2
        return enough and self.involution is not None and bool(self.involution.holds) and bool(self.jacobi.holds)

    @property
    def statement(self) -> str:
        """What is known of it beside the law, in words."""
        parts = [f"rank {self.rank}"]
        if self.jacobi.holds:
            parts.append(f"a Poisson tensor ({self.jacobi})")
        else:
            parts.append("no Poisson tensor: the Jacobi identity fails")
        if self.casimirs:
            parts.append(f"{'a Casimir' if len(self.casimirs) == 1 else 'Casimirs'}: {', '.join(self.casimirs)}")
        if self.involution is not None and self.involution.holds and len(self.in_involution) > 1:
            parts.append(f"{', '.join(self.in_involution)} in involution ({self.involution})")
        if self.is_liouville_integrable:
            parts.append("Liouville integrable")
        return "; ".join(parts)

    @property
    def latex(self) -> str:
        """The matrix in LaTeX."""
        rows = [" & ".join(latex(entry) for entry in row) for row in self.tensor.rows]
        return "\\begin{pmatrix} " + " \\\\ ".join(rows) + " \\end{pmatrix}"

    def to_json(self) -> dict[str, Any]:
        """Plain data."""
        brackets = [{"of": list(pair), "is": format_factored(entry)} for pair, entry in self.tensor.brackets.items()]
        return {
            **attributes(self, "name"),
            "brackets": brackets,
            "latex": self.latex,
            **attributes(self, "rank", "verdict", "evidence"),
            "jacobi": {"verdict": str(self.jacobi), "evidence": self.jacobi_evidence.to_json()},
            **attributes(self, "casimirs", "in_involution", "involution"),
            "liouville_integrable": self.is_liouville_integrable,
        }


@dataclass(frozen=True)
class PoissonSearch(Search):
    """What `find_poisson` found: tensors up to `degree`, and why the search ended where it found none.

    They span all of these, together with products of polynomial integrals and tensors of lower degrees.

    `pencil` is the verdict on all combinations of several tensors being Poisson tensors, None where that was not asked.
    """

    tensors: tuple[FoundTensor, ...]
    integrals: tuple[FoundIntegral, ...]
    degree: int
    denominator: RationalFunction | None
    pencil: Certainty | None
    reason: str

    @property
    def note(self) -> str:
        """What is to be said of all tensors together; empty where there is nothing."""
        if self.pencil is None:
            return ""
        if self.pencil.holds:
            return f"they are compatible: every combination of them is a Poisson tensor ({self.pencil})"
        return "not every combination of them is a Poisson tensor"

    def rows(self) -> list[dict[str, str]]:
        """A row for each tensor, for `pandas.DataFrame(found.rows())` and the like."""
        return [{"name": one.name, "brackets": one.text, "verdict": str(one.verdict)} for one in self.tensors]

    def to_json(self) -> dict[str, Any]:
        """Plain data."""
        return {
            **attributes(self, "tensors"),
            "integrals": {one.name: one.text for one in self.integrals},
            "degree_tried": self.degree,
            "denominator": None if self.denominator is None else format_rational_function(self.denominator),
            **attributes(self, "pencil", "note", "reason", "primes"),
        }

    def toml_section(self) -> str:
        """The first tensor as a section [poisson], which `check-poisson --tensor` reads; empty where there is none."""
        if not self.tensors:
            return ""
        return "\n".join([*self.toml_comments, self.tensors[0].tensor.toml_section()])


def find_poisson(
    system: SystemLike,
    degree: int | None = None,
    *,
    symbols: Sequence[str] = (),
    eps: Any = None,
    time_step: Any = None,
    denominator: RationalFunction | None = None,
    integrals: Sequence[FoundIntegral] | None = None,
    effort: int | Budget = 1,
    seed: int = 0,
    progress: Callable[[str], None] = lambda _: None,
) -> PoissonSearch:
    """All tensors P with polynomial entries of at most a degree that the map of a file preserves.

    Args:
        system: the map; a system stands for its Kahan map.
        degree: of the entries in the variables, or of their numerators; by default 3 in dimension 3, and else 2.
        symbols: names of parameters that formulas are to contain; the others have the values of the file.
        eps: an exact number, or None for formulas that contain eps.
        time_step: 2 eps, in its place.
        denominator: a function of the variables and eps by which the entries are divided; None: where there are no
            tensors without one, the factors of a density that is a product are tried, if that is little work.
        integrals: those whose brackets are asked for; None: they are searched, if there is a tensor.
        effort: 1, or more: each more doubles the work that the search may take, each less halves it.
        seed: of everything random.
        progress: is told what is being tried.

    Returns:
        A `PoissonSearch`; formulas are exact, proved or supported. What products of polynomial integrals and other
        tensors span is left out. Finding none up to a degree is measured.

    Raises:
        InputError: for unknown symbols, eps = 0, a negative degree, and a denominator that is identically 0 at this
            eps.

    >>> from kahanmaps.documents.catalog import load
    >>> found = find_poisson(load("lotka_volterra"))
    >>> [(one.text, str(one.verdict), one.rank) for one in found.tensors]
    [('{x,y} = x*y', 'proved', 2)]
    """
    file, eps = as_file(system), resolve_eps(eps, time_step)
    degree = tensor_degree(file.dim) if degree is None else integer(degree, "degree")
    if degree < 0:
        raise InputError(f"found the degree {degree}, expected at least 0")
    laboratory = Laboratory(file, symbols, eps, seed)
    budget = budget_for("Poisson tensors", effort)
    dim, asked = file.dim, degree
    pairs = dim * (dim - 1) // 2
    if denominator is not None:
        context = ring(laboratory.map.names)  # with the symbols
        gens = (*context.gens()[:dim], context.gens()[-1])
        parts = (denominator.numerator, denominator.denominator)
        denominator = RationalFunction(*(part.compose(*gens, ctx=context) for part in parts))
        if any(part.is_zero() for part in at_eps(denominator, laboratory.eps)):
            at = "" if laboratory.eps is None else f" at eps = {laboratory.eps}"
            raise InputError(
                f"found the denominator {quoted(format_rational_function(denominator))}, which is identically 0 or has "
                f"no values{at}, expected a function that is not zero"
            )
    while degree > 0 and pairs * comb(dim + degree, dim) > _MAX_UNKNOWNS:
        degree -= 1
    found: list[FoundTensor] = []
    reason = laboratory.defect
    cut = f"degrees above {degree} were not tried" if degree < asked else ""
    if pairs * comb(dim + degree, dim) > _MAX_UNKNOWNS:
        degree, reason = -1, f"a tensor in dimension {dim} has too many entries"
    if not reason:
        progress(f"tensors of degree up to {degree}")
        # Tensors, those of one kind, those over a density, verification, and brackets.
        stages = budget.share([3, 1, 2, 2, 3])
        forms, reason = _tensors(laboratory, degree, denominator, next(stages))
        logarithmic, over_density = next(stages), next(stages)
        if not forms and degree < 2 <= asked and dim <= _MOST_LOGARITHMIC and denominator is None:
            cut = f"degrees above {degree} were tried for brackets c_ij x_i x_j only"
            forms, _ = _tensors(laboratory, 2, None, logarithmic, log_canonical(dim))
        if not forms and denominator is None:
            # Over the factors of a known density, each once, with numerators as much higher in degree.
            density = None
            with suppress(NoPoint):
                density = products_of(laboratory, candidates(laboratory, laboratory.cofactors(), over_density)).density
            factors = [g for g, _ in density.factors] if density is not None else []
            higher = degree + sum(degree_in(g, dim) for g in factors)
            if factors and pairs * comb(dim + higher, dim) <= _MAX_UNKNOWNS // 2:
                psi = reduce(lambda a, b: a * b, factors)
                over = RationalFunction(psi, psi.context().constant(1))
                forms, _ = _tensors(laboratory, higher, over, over_density)
                denominator = over if forms else None
                more = f", and none of degree at most {higher} over {format_rational_function(over)}"
                reason = "" if forms else reason + more
        for k, tensor in enumerate(forms, 1):
            progress(f"verifying tensor {k} of {len(forms)}")
            law = transformation_identity(laboratory.map, tensor, laboratory.eps)
            # In many dimensions the law is too long to be multiplied out: nothing is spent on it.
            verdict, evidence = _verdict(laboratory, law, budget if dim <= MAX_DIMENSION else Budget(0))
            if not verdict.holds:
                continue
            jacobi, jacobi_evidence = _verdict(laboratory, jacobi_identity(tensor, laboratory.eps), budget)
            P = _at(tensor, laboratory.maps[0], laboratory.maps[0].random_point())
            rank_of_P = rank([[int(entry) for entry in row] for row in P.tolist()], laboratory.maps[0].prime)
            found.append(FoundTensor("P", tensor, verdict, evidence, jacobi, jacobi_evidence, rank_of_P))
        if len(found) < len(forms):
            reason = "a tensor that was found modulo primes did not pass as an identity"
        # Poisson tensors first, those of a high rank before others.
        found.sort(key=lambda one: (not one.jacobi.holds, -one.rank))
        found = [replace(one, name=f"P{k}" if len(found) > 1 else "P") for k, one in enumerate(found, 1)]
    if cut:
        cut = f"{cut}: such tensors have too many coefficients"
        reason = f"{reason}; {cut}" if reason and not found else cut
    pencil = None
    if 1 < len(found) <= _LARGEST_PENCIL and all(one.jacobi.holds for one in found):
        identity = jacobi_identity(_pencil([one.tensor for one in found]), laboratory.eps)
        pencil, _ = _verdict(laboratory, identity, budget)
    search = PoissonSearch(*laboratory.asked, tuple(found), (), degree, denominator, pencil, reason)
    if found and integrals is None:
        progress("integrals, for their brackets")
        half = budget.part(0.5)
        with suppress(KahanmapsError):  # of maps without a search
            integrals = find_integrals(file, symbols=symbols, eps=laboratory.eps, effort=half, seed=seed).integrals
    return with_brackets(search, integrals or (), budget)


def with_brackets(found: PoissonSearch, integrals: Sequence[FoundIntegral], budget: Budget) -> PoissonSearch:
    """The tensors with what is known of their brackets with integrals: Casimirs, and integrals in involution."""
    tensors = found.tensors
    if tensors and integrals:
        laboratory = Laboratory(found.file, found.symbols, found.eps, found.seed)
        tensors = tuple(_with_brackets(laboratory, one, integrals, budget) for one in tensors)
    if tensors and budget.is_spent:
        cut = f"not all identities were multiplied out, or all Casimirs sought: {SPENT}"
        found = replace(found, reason="; ".join(filter(None, [found.reason, cut])))
    return replace(found, tensors=tensors, integrals=tuple(integrals))


def _tensors(
    laboratory: Laboratory,
    degree: int,
    denominator: RationalFunction | None,
    budget: Budget,
    monomials: frozenset[Exponents] | None = None,
) -> tuple[list[MatrixPoissonTensor], str]:
    """A basis of the tensors over the denominator in closed form, of these monomials, or a reason why there is none."""
    try:
        model, other = (tensor_space(map_, degree, denominator, monomials) for map_ in laboratory.maps)
    except NoPoint as error:
        return [], str(error)
    if not model.basis:
        return [], f"no tensor of degree at most {degree} is preserved (measured modulo a prime)"
    if len(other.basis) != len(model.basis):
        return [], "the tensors found at one eps do not exist at another"
    support = frozenset(model.support)
    variables = laboratory.map.variables
    prefix = "d_"
    while any(name.startswith(prefix) for name in variables):
        prefix += "_"
    names = (*variables, *(prefix + name for name in variables))  # the latter for the directions
    forms = laboratory.formulas([model], lambda map_: [tensor_space(map_, degree, denominator, support)], budget, names)
    if forms.bases is None:
        return [], f"there is a tensor of degree {degree} modulo primes, but no closed form: {forms.reason}"
    # Left out is what products of an integral and a tensor span together with the elements before.
    map_, n = laboratory.maps[0], len(variables)
    integrals = cofactor_space(Sample.of(map_, [], points_needed(n, degree)), CofactorProduct((), 0), degree)
    places, rows = places_of(2 * n, degree), list[list[int]]()
    for integral in integrals.basis:
        if any(integral[1:]):
            wide = [0] * len(places)
            for exponent, c in zip(exponents_up_to(n, degree), integral, strict=True):
                wide[places[(*exponent, *[0] * n)]] = c
            products = (product_of(wide, v, 2 * n, degree + 2, map_.prime) for v in model.basis)
            rows += [P for P in products if P is not None]
    context, spanned, found = ring(laboratory.map.names), rank(rows, map_.prime), list[MatrixPoissonTensor]()
    over, times = context.constant(1), context.constant(1)
    if denominator is not None:
        over, times = denominator.numerator, denominator.denominator
    for vector, bivector in zip(model.basis, forms.bases[0], strict=True):
        rows.append(vector)
        if rank(rows, map_.prime) == spanned:
            continue
        spanned += 1
        entries: dict[tuple[int, ...], dict[tuple[int, ...], Any]] = {}  # of sum P_ij d_i d_j
        for monomial, coefficient in bivector.terms():
            pair = tuple(k for k in range(n) if monomial[n + k])
            entries.setdefault(pair, {})[(*monomial[:n], *monomial[2 * n :])] = coefficient
        upper = {pair: context.from_dict(terms) * times for pair, terms in entries.items()}
        zero = context.constant(0)
        matrix = [[upper.get((i, j), zero) - upper.get((j, i), zero) for j in range(n)] for i in range(n)]
        found.append(MatrixPoissonTensor([[RationalFunction.reduced(P, over) for P in row] for row in matrix]))
    return found, ""


def log_canonical(dim: int) -> frozenset[Exponents]:
    """The monomials x_i x_j d_i d_j, of which brackets {x_i, x_j} = c_ij x_i x_j consist."""
    pairs = (tuple(int(k in pair) for k in range(dim)) for pair in combinations(range(dim), 2))
    return frozenset((*pair, *pair) for pair in pairs)


def tensor_space(
    map_: ModularMap,
    degree: int,
    denominator: RationalFunction | None = None,
    support: frozenset[Exponents] | None = None,
) -> DarbouxSpace:
    """All bivectors sum P_ij d_i d_j of degree at most `degree` that the map preserves, modulo its prime.

    They are polynomials in x and the directions; the basis may be empty. With a `support` only those of its monomials.
    Raises NoPoint.
    """
    n, prime = map_.dim, map_.prime
    number, pairs = places_of(2 * n, degree + 2), list(combinations(range(n), 2))
    unknowns = []  # for each monomial x^a d_i d_j its number among all monomials, that of d_i d_j and of x^a
    for p, pair in enumerate(pairs):
        directions = tuple(int(k in pair) for k in range(n))
        for m, exponent in enumerate(exponents_up_to(n, degree)):
            if support is None or (*exponent, *directions) in support:
                unknowns.append((number[(*exponent, *directions)], p, m))

    def factor(x: Point) -> int:
        """The value of the denominator at a point, 1 without one. Raises NoPoint at its poles, which are everywhere."""
        if denominator is None:
            return 1
        field = GF(prime)
        value = denominator.value(field, [field.convert(c) for c in (*x, *map_.values, map_.eps)])
        if value is None:
            raise NoPoint("the denominator has no value at a random point modulo a prime")
        return int(value)

    by_pair = [sum(p == q for _, q, _ in unknowns) for p in range(len(pairs))]
    rows = []
    for x, image in map_.pairs(max(by_pair, default=0) + _SPARE):
        J = [[nmod(int(entry), prime) for entry in row] for row in map_.map.jacobian(x).tolist()]
        here, there = map_.moved(x, image, degree, (factor(image), factor(x)))
        count(30 + 10 * n + len(pairs) * (len(pairs) + len(unknowns) / 5))
        for row, (i, j) in enumerate(pairs):
            minors = [J[i][a] * J[j][b] - J[i][b] * J[j][a] for a, b in pairs]
            rows.append([minors[p] * here[m] - there[m] if p == row else minors[p] * here[m] for _, p, m in unknowns])
    vectors = null_space(rows, len(unknowns), prime)
    return DarbouxSpace.spanned_by(2 * n, degree + 2, vectors, prime, [place for place, _, _ in unknowns])


def _at(tensor: MatrixPoissonTensor, map_: ModularMap, x: Sequence[int]) -> Any:
    """The matrix of a tensor at a point modulo a prime."""
    field = GF(map_.prime)
    return tensor.value(field, field.convert(map_.eps), tuple(field.convert(c) for c in (*x, *map_.values)))


def _with_brackets(
    laboratory: Laboratory, found: FoundTensor, integrals: Sequence[FoundIntegral], budget: Budget
) -> FoundTensor:
    """The tensor with its Casimirs, and with the integrals that are in involution."""
    tensor, map_ = found.tensor, laboratory.maps[0]
    field, there = GF(map_.prime), Independent(map_)  # the gradients of Casimirs
    P = _at(tensor, map_, there.point)
    rows = [there.gradient(one.function) for one in integrals]
    casimirs: list[str] = []

    def add_casimir(name: str, function: RationalFunction, row: list[int]) -> None:
        is_killed = all(entry == 0 for entry in (P * field.column(row)).entries())
        if is_killed and _verdict(laboratory, _brackets(laboratory, tensor, [function], True), budget)[0].holds:
            casimirs.append(name)
            there.add(row)

    for one, row in zip(integrals, rows, strict=True):
        add_casimir(one.name, one.function, row)
    most = min(tensor.dim - found.rank, rank(rows, map_.prime))
    if len(there.rows) < most and len(integrals) <= _MOST_INTEGRALS and not budget.is_spent:
        for name, function in casimir_candidates(laboratory, tensor, integrals, budget):
            row = there.gradient(function)
            if len(there.rows) < most and there.adds(row):
                add_casimir(name, function, row)
    # The most of the gradients whose brackets with each other are 0 at the point, the first such choice.
    moved = [(P * field.column(row)).entries() for row in rows]
    vanish = [[sum((a * b for a, b in zip(row, v, strict=True)), field.zero) == 0 for v in moved] for row in rows]
    some = range(min(len(rows), _MOST_INTEGRALS))
    choices = (choice for size in range(len(some), 0, -1) for choice in combinations(some, size))
    best = next((choice for choice in choices if all(vanish[i][j] for i, j in combinations(choice, 2))), ())
    chosen = [integrals[k] for k in best]
    involution = None
    if chosen:
        functions = [one.function for one in chosen]
        involution, _ = _verdict(laboratory, _brackets(laboratory, tensor, functions, False), budget)
    names = tuple(one.name for one in chosen)
    return replace(found, casimirs=tuple(casimirs), in_involution=names, involution=involution)


def _verdict(laboratory: Laboratory, identity: Identity, budget: Budget) -> tuple[Certainty, Evidence]:
    """The verdict on an identity, which is not multiplied out when the budget is spent."""
    return certified(identity, laboratory.seed, expands=not budget.is_spent)


def _brackets(
    laboratory: Laboratory, tensor: MatrixPoissonTensor, functions: Sequence[RationalFunction], of_variables: bool
) -> Identity:
    """That all brackets of two functions vanish or, `of_variables`, those of a function and a variable."""
    n = tensor.dim

    def sides(field: Field, place: tuple[Any, ...], eps: Any) -> Sides | None:
        P = tensor.value(field, eps, place)
        if P is None:
            return None
        with field.working():
            columns = [field.column(slopes(one, field, (*place, eps), n)) for one in functions]
            found: list[Any] = []
            for k, column in enumerate(columns):
                moved = P * column
                if of_variables:
                    found += moved.entries()
                else:
                    found += [(columns[j].transpose() * moved)[0, 0] for j in range(k)]
        return found, [field.zero] * len(found)

    subject = ("brackets", tensor.subject, list(functions), of_variables)
    has_eps = laboratory.map.has_eps or tensor.has_eps
    return Identity(n + len(laboratory.symbols), sides, laboratory.eps, has_eps=has_eps, subject=subject)


def _pencil(tensors: Sequence[MatrixPoissonTensor]) -> MatrixPoissonTensor:
    """The sum of the tensors, each times a symbol of its own."""
    names = tensors[0].rows[0][0].names
    letter = "c"
    while any(name.startswith(letter) for name in names):
        letter += "_"
    context = ring((*names[:-1], *(f"{letter}{k}" for k in range(len(tensors))), names[-1]))
    gens = context.gens()
    old, symbols = (*gens[: len(names) - 1], gens[-1]), gens[len(names) - 1 : -1]

    def total(entries: Iterable[RationalFunction]) -> RationalFunction:
        numerator, denominator = context.constant(0), context.constant(1)
        for symbol, entry in zip(symbols, entries, strict=True):
            N, D = (part.compose(*old, ctx=context) for part in (entry.numerator, entry.denominator))
            numerator, denominator = numerator * D + symbol * N * denominator, denominator * D
        return RationalFunction.reduced(numerator, denominator)

    n = tensors[0].dim
    return MatrixPoissonTensor([[total(one.rows[i][j] for one in tensors) for j in range(n)] for i in range(n)])
