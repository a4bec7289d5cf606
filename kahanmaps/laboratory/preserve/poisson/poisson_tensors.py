"""The search for Poisson tensors that a map preserves: skew P(x), polynomial in x, with dPhi P(x) dPhi^T = P(x~).

At a random point modulo a prime this equation gives n (n - 1)/2 linear equations for the coefficients of P, so all P up
to a degree form one null space. A tensor is represented by the bivector sum P_ij d_i d_j, a polynomial in x and new
variables d_i. So its coefficients are interpolated, as functions of eps and the symbols, like those of any polynomial.
With a common denominator psi the unknown is B = psi P, with the equation psi(x~) dPhi B(x) dPhi^T = psi(x) B(x~).

The Jacobi identity is not linear in P. If several tensors satisfy it, one identity for their sum, in which each tensor
is multiplied by a symbol, decides whether all combinations are Poisson tensors.
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
from kahanmaps.algebra.work import SPENT, UNFINISHED, Budget, count_work
from kahanmaps.checks.certify import MAX_DIMENSION
from kahanmaps.checks.claims import Certainty, Evidence
from kahanmaps.checks.decide import Identity, Sides
from kahanmaps.checks.preserve import jacobi_identity, transformation_identity
from kahanmaps.display_protocols import LatexDisplay, ResultPart, latex
from kahanmaps.documents.inline import as_file
from kahanmaps.errors import InputError, KahanmapsError, counted, quoted
from kahanmaps.invariants.integrals_and_densities import at_eps
from kahanmaps.invariants.poisson import MatrixPoissonTensor
from kahanmaps.laboratory.defaults import budget_for, tensor_degree
from kahanmaps.laboratory.laboratory import Laboratory, certified
from kahanmaps.laboratory.modular_points import (
    IndependentGradients,
    ModularMap,
    NoPoint,
    Point,
    exponents_up_to,
    monomial_index,
    product_of,
    scaled_gradient,
)
from kahanmaps.laboratory.preserve.darboux.cofactors import CofactorProduct, Sample, cofactor_space, points_needed
from kahanmaps.laboratory.preserve.darboux.darboux_spaces import DarbouxSpace
from kahanmaps.laboratory.preserve.integrals import FoundIntegral, find_integrals
from kahanmaps.laboratory.preserve.poisson.casimirs import casimir_candidates
from kahanmaps.laboratory.preserve.products import candidates, products_of
from kahanmaps.laboratory.preserve.results import Search
from kahanmaps.maps.convention import resolve_eps
from kahanmaps.maps.kahan import SystemLike

_MAX_UNKNOWNS = 2000  # coefficients of all entries of a tensor
_MAX_LOG_CANONICAL_DIM = 16  # the largest dimension in which all monomials of degree 4 in x and d are listed
_SPARE_POINTS = 8  # points beyond those that determine the unknowns
_SHOWN_CHARACTERS = 2000  # the largest length of the brackets of one tensor that are printed
_MAX_INTEGRALS = 12  # the largest number of integrals for which all subsets are tested for involution
_MAX_PENCIL = 8  # tensors whose combinations are tested for the Jacobi identity

Exponents = tuple[int, ...]


@dataclass(frozen=True)
class FoundTensor(LatexDisplay, ResultPart):
    """A tensor that the map preserves: `verdict` on the invariance, `jacobi` on the Jacobi identity.

    `rank` is the rank at random points. `casimirs` has the names of the known integrals that are Casimirs, and formulas
    such as I1/I2 for further Casimirs among functions of the integrals. `in_involution` has the names of a largest set
    of integrals in involution; `involution` is the verdict that their brackets vanish (None without such integrals).
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
        """The brackets, or their number if they have more than 2000 characters."""
        if len(self.text) <= _SHOWN_CHARACTERS:
            return self.text
        return f"{counted(len(self.tensor.brackets), 'bracket')} that find-poisson writes out"

    @property
    def is_liouville_integrable(self) -> bool:
        """Whether enough integrals are known to be in involution for the theorem of Liouville."""
        has_enough = len(self.in_involution) >= self.tensor.dim - self.rank // 2
        return has_enough and self.involution is not None and bool(self.involution.holds) and bool(self.jacobi.holds)

    @property
    def statement(self) -> str:
        """A phrase on the rank, the Jacobi identity, the Casimirs and the integrals in involution."""
        phrases = [f"rank {self.rank}"]
        if self.jacobi.holds:
            phrases.append(f"a Poisson tensor ({self.jacobi})")
        else:
            phrases.append("no Poisson tensor: the Jacobi identity fails")
        if self.casimirs:
            phrases.append(f"{'a Casimir' if len(self.casimirs) == 1 else 'Casimirs'}: {', '.join(self.casimirs)}")
        if self.involution is not None and self.involution.holds and len(self.in_involution) > 1:
            phrases.append(f"{', '.join(self.in_involution)} in involution ({self.involution})")
        if self.is_liouville_integrable:
            phrases.append("Liouville integrable")
        return "; ".join(phrases)

    def latex(self) -> str:
        """Return the matrix in LaTeX."""
        rows = [" & ".join(latex(entry) for entry in row) for row in self.tensor.rows]
        return "\\begin{pmatrix} " + " \\\\ ".join(rows) + " \\end{pmatrix}"

    def to_json(self) -> dict[str, Any]:
        """Plain data."""
        brackets = [{"of": list(pair), "is": format_factored(entry)} for pair, entry in self.tensor.brackets.items()]
        return {
            **attributes(self, "name"),
            "brackets": brackets,
            "latex": self.latex(),
            **attributes(self, "rank", "verdict", "evidence"),
            "jacobi": {"verdict": str(self.jacobi), "evidence": self.jacobi_evidence.to_json()},
            **attributes(self, "casimirs", "in_involution", "involution"),
            "liouville_integrable": self.is_liouville_integrable,
        }


@dataclass(frozen=True)
class PoissonSearch(Search):
    """The result of `find_poisson`: tensors up to `degree`, and the reason if there are none.

    All tensors up to the degree are combinations of the listed ones and of products of polynomial integrals with
    tensors of lower degree. `pencil` says whether all combinations of listed tensors are Poisson (None: not tested).
    """

    _parts, _noun = "tensors", ("tensor", "tensors")

    tensors: tuple[FoundTensor, ...]
    integrals: tuple[FoundIntegral, ...]
    degree: int
    denominator: RationalFunction | None
    pencil: Certainty | None
    reason: str

    @property
    def note(self) -> str:
        """A sentence on the compatibility of the tensors; empty if it was not tested."""
        if self.pencil is None:
            return ""
        if self.pencil.holds:
            return f"they are compatible: every combination of them is a Poisson tensor ({self.pencil})"
        return "not every combination of them is a Poisson tensor"

    def rows(self) -> list[dict[str, str]]:
        """Return one row for each tensor, e.g. for `pandas.DataFrame(result.rows())`."""
        return [{"name": P.name, "brackets": P.text, "verdict": str(P.verdict)} for P in self.tensors]

    def to_json(self) -> dict[str, Any]:
        """Plain data."""
        return {
            **attributes(self, "tensors"),
            "integrals": {integral.name: integral.text for integral in self.integrals},
            "degree_tried": self.degree,
            "denominator": None if self.denominator is None else format_rational_function(self.denominator),
            **attributes(self, "pencil", "note", "reason", "primes"),
        }

    def toml_section(self) -> str:
        """Return the first tensor as a section [poisson], for `check-poisson --tensor`; empty without tensors."""
        if not self.tensors:
            return ""
        return "\n".join([*self.toml_comments, self.tensors[0].tensor.toml_section()])


def find_poisson(
    system: SystemLike,
    max_degree: int | None = None,
    *,
    symbols: Sequence[str] = (),
    eps: Any = None,
    time_step: Any = None,
    h: Any = None,
    denominator: RationalFunction | None = None,
    integrals: Sequence[FoundIntegral] | None = None,
    effort: int | Budget = 1,
    seed: int = 0,
    progress: Callable[[str], None] = lambda _: None,
    on_result: Callable[[PoissonSearch], None] = lambda _: None,
) -> PoissonSearch:
    """Search for the skew tensors P that a map preserves; their entries are polynomials up to a degree.

    Args:
        system: the map; a differential equation stands for its Kahan map.
        max_degree: the largest degree of the entries, or of their numerators; by default 3 in dimension 3, otherwise 2.
        symbols: names of parameters that stay symbols in the formulas; the others have the values of the file.
        eps: half the time step, an exact number: formulas then hold at this eps only. None: formulas contain eps.
        time_step, h: the time step 2 eps, instead of eps.
        denominator: a function of the variables and eps by which the entries are divided. None: entries are
            polynomials; if there is no such P, the factors of a known density are tried, if this is little work.
        integrals: the integrals whose brackets are computed; None: if there is a tensor, integrals are searched for.
        effort: the work that the search may take: each step above 1 doubles it, each step below halves it.
        seed: the random seed.
        progress: called with a sentence at each stage of the search.
        on_result: called with the tensors so far after each new tensor, for searches that may be interrupted.

    Returns:
        A `PoissonSearch`; formulas are exact, proved or supported. Combinations of listed tensors with polynomial
        integrals as coefficients are left out. That there are no further tensors up to the degree is measured.

    Raises:
        InputError: for unknown symbols, eps = 0, a negative degree, or a denominator that vanishes at this eps.

    >>> from kahanmaps.documents.catalog import load
    >>> result = find_poisson(load("lotka_volterra"))
    >>> [(P.text, str(P.verdict), P.rank) for P in result.tensors]
    [('{x,y} = x*y', 'proved', 2)]
    """
    file, eps = as_file(system), resolve_eps(eps, time_step, h)
    degree = tensor_degree(file.dim) if max_degree is None else integer(max_degree, "max_degree")
    if degree < 0:
        raise InputError(f"found the degree {degree}, expected at least 0")
    laboratory = Laboratory(file, symbols, eps, seed)
    budget = budget_for("Poisson tensors", effort)
    dim, top_degree = file.dim, degree
    pair_count = dim * (dim - 1) // 2
    if denominator is not None:
        context = ring(laboratory.map.names)  # with the symbols
        gens = (*context.gens()[:dim], context.gens()[-1])
        polynomials = (denominator.numerator, denominator.denominator)
        denominator = RationalFunction(*(polynomial.compose(*gens, ctx=context) for polynomial in polynomials))
        if any(polynomial.is_zero() for polynomial in at_eps(denominator, laboratory.eps)):
            eps_text = "" if laboratory.eps is None else f" at eps = {laboratory.eps}"
            raise InputError(
                f"found the denominator {quoted(format_rational_function(denominator))}, which is identically 0 or "
                f"undefined{eps_text}, expected a function that is not zero"
            )
    while degree > 0 and pair_count * comb(dim + degree, dim) > _MAX_UNKNOWNS:
        degree -= 1
    tensors: list[FoundTensor] = []
    reason = laboratory.defect
    limit_text = f"degrees above {degree} were not tried" if degree < top_degree else ""
    if pair_count * comb(dim + degree, dim) > _MAX_UNKNOWNS:
        degree, reason = -1, f"a tensor in dimension {dim} has too many entries"
    if not reason:
        progress(f"tensors of degree up to {degree}")
        # The stages: all tensors; log-canonical tensors; density as denominator; verification; brackets.
        budgets = budget.share([3, 1, 2, 2, 3])
        candidate_tensors, reason = _find_tensors(laboratory, degree, denominator, next(budgets))
        log_canonical_budget, density_budget = next(budgets), next(budgets)
        if not candidate_tensors and degree < 2 <= top_degree and dim <= _MAX_LOG_CANONICAL_DIM and denominator is None:
            limit_text = f"degrees above {degree} were tried for brackets c_ij x_i x_j only"
            candidate_tensors, _ = _find_tensors(laboratory, 2, None, log_canonical_budget, log_canonical(dim))
        if not candidate_tensors and denominator is None:
            # Try the product of the factors of a known density as denominator; its degree is added to the numerators'.
            density = None
            with suppress(NoPoint):
                density = products_of(
                    laboratory, candidates(laboratory, laboratory.cofactors(), density_budget)
                ).density
            factors = [g for g, _ in density.factors] if density is not None else []
            higher_degree = degree + sum(degree_in(g, dim) for g in factors)
            if factors and pair_count * comb(dim + higher_degree, dim) <= _MAX_UNKNOWNS // 2:
                psi = reduce(lambda a, b: a * b, factors)
                density_denominator = RationalFunction(psi, psi.context().constant(1))
                candidate_tensors, _ = _find_tensors(laboratory, higher_degree, density_denominator, density_budget)
                denominator = density_denominator if candidate_tensors else None
                reason_with_density = (
                    f", and none of degree at most {higher_degree} over {format_rational_function(density_denominator)}"
                )
                reason = "" if candidate_tensors else reason + reason_with_density
        for k, tensor in enumerate(candidate_tensors, 1):
            progress(f"verifying tensor {k} of {len(candidate_tensors)}")
            identity = transformation_identity(laboratory.map, tensor, laboratory.eps)
            # In high dimension the identity is too long to expand, so its budget is 0.
            verdict, evidence = _certify(laboratory, identity, budget if dim <= MAX_DIMENSION else Budget(0))
            if not verdict.holds:
                continue
            jacobi, jacobi_evidence = _certify(laboratory, jacobi_identity(tensor, laboratory.eps), budget)
            P = _evaluate(tensor, laboratory.maps[0], laboratory.maps[0].random_point())
            rank_of_P = rank([[int(entry) for entry in row] for row in P.tolist()], laboratory.maps[0].prime)
            tensors.append(FoundTensor("P", tensor, verdict, evidence, jacobi, jacobi_evidence, rank_of_P))
            on_result(PoissonSearch(*laboratory.request, tuple(tensors), (), degree, denominator, None, UNFINISHED))
        if len(tensors) < len(candidate_tensors):
            reason = "a tensor that was found modulo primes did not pass as an identity"
        # Poisson tensors first, then by descending rank.
        tensors.sort(key=lambda P: (not P.jacobi.holds, -P.rank))
        tensors = [replace(P, name=f"P{k}" if len(tensors) > 1 else "P") for k, P in enumerate(tensors, 1)]
    if limit_text:
        limit_text = f"{limit_text}: such tensors have too many coefficients"
        reason = f"{reason}; {limit_text}" if reason and not tensors else limit_text
    pencil = None
    if 1 < len(tensors) <= _MAX_PENCIL and all(P.jacobi.holds for P in tensors):
        jacobi_of_pencil = jacobi_identity(_generic_combination([P.tensor for P in tensors]), laboratory.eps)
        pencil, _ = _certify(laboratory, jacobi_of_pencil, budget)
    search = PoissonSearch(*laboratory.request, tuple(tensors), (), degree, denominator, pencil, reason)
    if tensors and integrals is None:
        progress("integrals, for their brackets")
        share = budget.part(0.5)
        with suppress(KahanmapsError):  # some maps do not support the search for integrals
            integrals = find_integrals(file, symbols=symbols, eps=laboratory.eps, effort=share, seed=seed).integrals
    return with_brackets(search, integrals or (), budget)


def with_brackets(result: PoissonSearch, integrals: Sequence[FoundIntegral], budget: Budget) -> PoissonSearch:
    """Add to each tensor of `result` the Casimirs and a set of integrals in involution, from the known `integrals`."""
    tensors = result.tensors
    if tensors and integrals:
        laboratory = Laboratory(result.file, result.symbols, result.eps, result.seed)
        tensors = tuple(_add_brackets(laboratory, tensor, integrals, budget) for tensor in tensors)
    if tensors and budget.is_spent:
        limit_text = f"some identities were not expanded, or some Casimirs not searched for: {SPENT}"
        result = replace(result, reason="; ".join(filter(None, [result.reason, limit_text])))
    return replace(result, tensors=tensors, integrals=tuple(integrals))


def _find_tensors(
    laboratory: Laboratory,
    degree: int,
    denominator: RationalFunction | None,
    budget: Budget,
    monomials: frozenset[Exponents] | None = None,
) -> tuple[list[MatrixPoissonTensor], str]:
    """Compute formulas for a basis of the tensors with this denominator; `monomials` restricts those of the bivector.

    Returns the tensors and an empty text, or no tensors and the reason.
    """
    try:
        model, other_space = (tensor_space(map_, degree, denominator, monomials) for map_ in laboratory.maps)
    except NoPoint as error:
        return [], str(error)
    if not model.basis:
        return [], f"no tensor of degree at most {degree} is preserved (measured modulo a prime)"
    if len(other_space.basis) != len(model.basis):
        return [], "the tensors found at one eps do not exist at another"
    support = frozenset(model.support)
    variables = laboratory.map.variables
    prefix = "d_"
    while any(name.startswith(prefix) for name in variables):
        prefix += "_"
    names = (*variables, *(prefix + name for name in variables))  # x and the d_i
    closed_forms = laboratory.formulas(
        [model], lambda map_: [tensor_space(map_, degree, denominator, support)], budget, names
    )
    if closed_forms.bases is None:
        return [], f"there is a tensor of degree {degree} modulo primes, but no closed form: {closed_forms.reason}"
    # Leave out tensors in the span of earlier tensors and of products of polynomial integrals with tensors.
    map_, n = laboratory.maps[0], len(variables)
    integrals = cofactor_space(Sample.of(map_, [], points_needed(n, degree)), CofactorProduct((), 0), degree)
    indices, rows = monomial_index(2 * n, degree), list[list[int]]()
    for integral in integrals.basis:
        if any(integral[1:]):
            integral_in_x_and_d = [0] * len(indices)
            for exponent, c in zip(exponents_up_to(n, degree), integral, strict=True):
                integral_in_x_and_d[indices[(*exponent, *[0] * n)]] = c
            products = (product_of(integral_in_x_and_d, v, 2 * n, degree + 2, map_.prime) for v in model.basis)
            rows += [P for P in products if P is not None]
    context, spanned_rank, tensors = ring(laboratory.map.names), rank(rows, map_.prime), list[MatrixPoissonTensor]()
    divisor, multiplier = context.constant(1), context.constant(1)
    if denominator is not None:
        divisor, multiplier = denominator.numerator, denominator.denominator
    for vector, bivector in zip(model.basis, closed_forms.bases[0], strict=True):
        rows.append(vector)
        if rank(rows, map_.prime) == spanned_rank:
            continue
        spanned_rank += 1
        entries: dict[tuple[int, ...], dict[tuple[int, ...], Any]] = {}  # of P_ij, by the pair (i, j)
        for monomial, coefficient in bivector.terms():
            pair = tuple(k for k in range(n) if monomial[n + k])
            entries.setdefault(pair, {})[(*monomial[:n], *monomial[2 * n :])] = coefficient
        upper = {pair: context.from_dict(terms) * multiplier for pair, terms in entries.items()}
        zero = context.constant(0)
        matrix = [[upper.get((i, j), zero) - upper.get((j, i), zero) for j in range(n)] for i in range(n)]
        tensors.append(MatrixPoissonTensor([[RationalFunction.reduced(P, divisor) for P in row] for row in matrix]))
    return tensors, ""


def log_canonical(dim: int) -> frozenset[Exponents]:
    """Return the monomials x_i x_j d_i d_j of log-canonical brackets {x_i, x_j} = c_ij x_i x_j."""
    pairs = (tuple(int(k in pair) for k in range(dim)) for pair in combinations(range(dim), 2))
    return frozenset((*pair, *pair) for pair in pairs)


def tensor_space(
    map_: ModularMap,
    degree: int,
    denominator: RationalFunction | None = None,
    support: frozenset[Exponents] | None = None,
) -> DarbouxSpace:
    """Compute all bivectors sum P_ij d_i d_j, P_ij of degree at most `degree`, that a map modulo a prime preserves.

    Bivectors are polynomials in x and d_i; the basis may be empty. A `support` restricts the monomials. Raises NoPoint.
    """
    n, prime = map_.dim, map_.prime
    indices, pairs = monomial_index(2 * n, degree + 2), list(combinations(range(n), 2))
    unknowns = []  # for each monomial x^a d_i d_j the indices of the monomial, of the pair (i, j) and of x^a
    for p, pair in enumerate(pairs):
        directions = tuple(int(k in pair) for k in range(n))
        for m, exponent in enumerate(exponents_up_to(n, degree)):
            if support is None or (*exponent, *directions) in support:
                unknowns.append((indices[(*exponent, *directions)], p, m))

    def divisor_at(x: Point) -> int:
        """Return the value of `denominator` at a point (None: 1). Raises NoPoint at a pole of this function."""
        if denominator is None:
            return 1
        field = GF(prime)
        value = denominator.value(field, [field.convert(c) for c in (*x, *map_.values, map_.eps)])
        if value is None:
            raise NoPoint("the denominator of the tensor is infinite at a random point modulo a prime")
        return int(value)

    unknowns_by_pair = [sum(p == q for _, q, _ in unknowns) for p in range(len(pairs))]
    rows = []
    for x, image in map_.pairs(max(unknowns_by_pair, default=0) + _SPARE_POINTS):
        J = [[nmod(int(entry), prime) for entry in row] for row in map_.map.jacobian(x).tolist()]
        monomials, image_monomials = map_.monomials_at_both(x, image, degree, (divisor_at(image), divisor_at(x)))
        count_work(30 + 10 * n + len(pairs) * (len(pairs) + len(unknowns) / 5))
        for row, (i, j) in enumerate(pairs):
            minors = [J[i][a] * J[j][b] - J[i][b] * J[j][a] for a, b in pairs]
            rows.append(
                [
                    minors[p] * monomials[m] - image_monomials[m] if p == row else minors[p] * monomials[m]
                    for _, p, m in unknowns
                ]
            )
    vectors = null_space(rows, len(unknowns), prime)
    return DarbouxSpace.spanned_by(2 * n, degree + 2, vectors, prime, [index for index, _, _ in unknowns])


def _evaluate(tensor: MatrixPoissonTensor, map_: ModularMap, x: Sequence[int]) -> Any:
    """Return the matrix of a tensor at a point modulo a prime."""
    field = GF(map_.prime)
    return tensor.value(field, field.convert(map_.eps), tuple(field.convert(c) for c in (*x, *map_.values)))


def _add_brackets(
    laboratory: Laboratory, found_tensor: FoundTensor, integrals: Sequence[FoundIntegral], budget: Budget
) -> FoundTensor:
    """Add to a tensor the names of its Casimirs and of a largest set of integrals in involution."""
    tensor, map_ = found_tensor.tensor, laboratory.maps[0]
    field, casimir_gradients = GF(map_.prime), IndependentGradients(map_)
    P = _evaluate(tensor, map_, casimir_gradients.point)
    rows = [casimir_gradients.gradient(integral.function) for integral in integrals]
    casimirs: list[str] = []

    def add_casimir(name: str, function: RationalFunction, row: list[int]) -> None:
        is_in_kernel = all(entry == 0 for entry in (P * field.column(row)).entries())
        if is_in_kernel and _certify(laboratory, _involution(laboratory, tensor, [function], True), budget)[0].holds:
            casimirs.append(name)
            casimir_gradients.add(row)

    for integral, row in zip(integrals, rows, strict=True):
        add_casimir(integral.name, integral.function, row)
    max_casimirs = min(tensor.dim - found_tensor.rank, rank(rows, map_.prime))
    if len(casimir_gradients.rows) < max_casimirs and len(integrals) <= _MAX_INTEGRALS and not budget.is_spent:
        for name, function in casimir_candidates(laboratory, tensor, integrals, budget):
            row = casimir_gradients.gradient(function)
            if len(casimir_gradients.rows) < max_casimirs and casimir_gradients.adds(row):
                add_casimir(name, function, row)
    # The first of the largest sets of integrals whose brackets with each other vanish at the random point.
    hamiltonian_fields = [(P * field.column(row)).entries() for row in rows]
    is_zero = [
        [sum((a * b for a, b in zip(row, v, strict=True)), field.zero) == 0 for v in hamiltonian_fields] for row in rows
    ]
    indices = range(min(len(rows), _MAX_INTEGRALS))
    subsets = (subset for size in range(len(indices), 0, -1) for subset in combinations(indices, size))
    largest_subset = next((subset for subset in subsets if all(is_zero[i][j] for i, j in combinations(subset, 2))), ())
    integrals_in_involution = [integrals[k] for k in largest_subset]
    involution = None
    if integrals_in_involution:
        functions = [integral.function for integral in integrals_in_involution]
        involution, _ = _certify(laboratory, _involution(laboratory, tensor, functions, False), budget)
    names = tuple(integral.name for integral in integrals_in_involution)
    return replace(found_tensor, casimirs=tuple(casimirs), in_involution=names, involution=involution)


def _certify(laboratory: Laboratory, identity: Identity, budget: Budget) -> tuple[Certainty, Evidence]:
    """Certify an identity; if the budget is spent, do not expand it."""
    return certified(identity, laboratory.seed, expands=not budget.is_spent)


def _involution(
    laboratory: Laboratory, tensor: MatrixPoissonTensor, functions: Sequence[RationalFunction], of_variables: bool
) -> Identity:
    """Return the identity {F, G} = 0 for all functions F, G or, if `of_variables`, {F, x_i} = 0 for all variables."""
    n = tensor.dim

    def sides(field: Field, point: tuple[Any, ...], eps: Any) -> Sides | None:
        P = tensor.value(field, eps, point)
        if P is None:
            return None
        with field.working():
            gradients = [field.column(scaled_gradient(function, field, (*point, eps), n)) for function in functions]
            brackets: list[Any] = []
            for k, gradient in enumerate(gradients):
                hamiltonian_field = P * gradient
                if of_variables:
                    brackets += hamiltonian_field.entries()
                else:
                    brackets += [(gradients[j].transpose() * hamiltonian_field)[0, 0] for j in range(k)]
        return brackets, [field.zero] * len(brackets)

    identity_key = ("brackets", tensor.seed_data, list(functions), of_variables)
    has_eps = laboratory.map.has_eps or tensor.has_eps
    return Identity(n + len(laboratory.symbols), sides, laboratory.eps, has_eps=has_eps, seed_data=identity_key)


def _generic_combination(tensors: Sequence[MatrixPoissonTensor]) -> MatrixPoissonTensor:
    """Return the sum of the tensors, each multiplied by a different symbol."""
    names = tensors[0].rows[0][0].names
    prefix = "c"
    while any(name.startswith(prefix) for name in names):
        prefix += "_"
    context = ring((*names[:-1], *(f"{prefix}{k}" for k in range(len(tensors))), names[-1]))
    gens = context.gens()
    old_gens, symbols = (*gens[: len(names) - 1], gens[-1]), gens[len(names) - 1 : -1]

    def combine(entries: Iterable[RationalFunction]) -> RationalFunction:
        numerator, denominator = context.constant(0), context.constant(1)
        for symbol, entry in zip(symbols, entries, strict=True):
            N, D = (F.compose(*old_gens, ctx=context) for F in (entry.numerator, entry.denominator))
            numerator, denominator = numerator * D + symbol * N * denominator, denominator * D
        return RationalFunction.reduced(numerator, denominator)

    n = tensors[0].dim
    return MatrixPoissonTensor([[combine(P.rows[i][j] for P in tensors) for j in range(n)] for i in range(n)])
