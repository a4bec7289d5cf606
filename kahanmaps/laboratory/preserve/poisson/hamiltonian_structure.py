"""All ways in which a quadratic system is Hamiltonian with a constant structure, f = J grad H, J skew: exactly, over Q.

With K = J^{-1} this means that K f is a gradient, so that K f'(x) is symmetric for all x: linear equations for K. A
degenerate J has a kernel, whose vectors v give affine integrals v . x: the search is linear as well if the kernel is to
be all of them. Then with (y, z) = T x, z the integrals, f_y = K^{-1} grad_y H with z as parameters.

By cmoq-2013 the Kahan map of such a system conserves modified H = H + (2 eps/3) grad H^T (I - eps f')^{-1} f and has
the invariant measure dx/det(I - eps f'), for every eps. All integrals that it has by theorems, and how many of them are
independent:

    v . x                              for every v with v . f = 0;
    H + grad H . (x~ - x)/3            for every constant skew K with K f_y = grad_y H, in coordinates (y, z) with these
                                       integrals z.

K need not be invertible: for an invertible one f = J grad H with J = K^{-1} (cmoq-2013); the proof for any K is in
docs/mathematics.md. Forms and functions are exact. The gradients are taken at a point modulo a prime: a rank that is
found there is not larger than the number of independent integrals.
"""

from __future__ import annotations

import random
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import chain, count, product
from typing import Any

from flint import fmpq, fmpq_mat, fmpq_mpoly, fmpz

from kahanmaps.algebra.chance import derive_seed
from kahanmaps.algebra.fields import GF, QQ, Field
from kahanmaps.algebra.matrices import combination_of, nullspace, primitive_integers
from kahanmaps.algebra.modular_matrices import rank
from kahanmaps.algebra.polynomials import linear_combinations, ring
from kahanmaps.algebra.printing import all_fields, format_polynomial, plain
from kahanmaps.algebra.residues import random_prime
from kahanmaps.algebra.work import count as count_work
from kahanmaps.display_protocols import PrintableResult
from kahanmaps.errors import InputError, counted
from kahanmaps.invariants.phase_functions import modified
from kahanmaps.laboratory.modular_points import ModularMap, Point
from kahanmaps.laboratory.preserve.darboux.affine_functions import QuotientForms, affine_integrals, quotient_by
from kahanmaps.maps.kahan import KahanFamily, KahanMap, SystemLike
from kahanmaps.systems.hamiltonian import CubicHamiltonian, standard_structure
from kahanmaps.systems.quadratic import QuadraticSystem, as_system

MAX_DIMENSION = 30  # n (n - 1)/2 unknowns: a few seconds for 435 of them
_GRID = 2000  # points at which a Pfaffian is shown to vanish identically


@dataclass(frozen=True, eq=False)
class ConstantStructures(PrintableResult):
    """What `constant_structures` found; every form, function and matrix is exact.

    forms: a basis of the skew K for which K f is a gradient (invertible or not), of coprime integers.
    functions: for each of them the H of degree at most 3 with grad H = K f and H(0) = 0, conserved by the flow.
    hamiltonian: H and J with f = J grad H, if there are any; `casimirs` span the kernel of J.
    reason: why there is no hamiltonian, else empty; `proved` tells whether that is proved.
    """

    system: QuadraticSystem
    forms: tuple[fmpq_mat, ...]
    functions: tuple[fmpq_mpoly, ...]
    hamiltonian: CubicHamiltonian | None
    casimirs: tuple[fmpq_mpoly, ...]
    reason: str
    proved: bool

    def rows(self) -> list[dict[str, str]]:
        """A row for each form K, with the function that the flow conserves."""
        pairs = zip(self.forms, self.functions, strict=True)
        return [{"K": str(plain(K)), "function": format_polynomial(H)} for K, H in pairs]

    def to_json(self) -> dict[str, Any]:
        """Plain data."""
        return all_fields(self)


def constant_structures(system: SystemLike, *, seed: int = 0) -> ConstantStructures:
    """All constant skew K with K f a gradient, and a Hamiltonian form f = J grad H with constant skew J.

    Args:
        system: a quadratic system over Q, of dimension at most 30.
        seed: decides which combinations of the forms are tried, where many would do.

    Returns:
        A `ConstantStructures`. J = [[0, I], [-I, 0]] is preferred, then other invertible J of few terms, then a J
        whose kernel is all affine integrals. A J with a kernel in between is not looked for.

    Raises:
        InputError: for a dimension above 30.

    >>> found = constant_structures(QuadraticSystem.from_text(["q", "p"], ["2*p", "-2*q^2"]))
    >>> found.hamiltonian.H, found.hamiltonian.is_standard
    (2/3*q^3 + p^2, True)
    >>> found = constant_structures(QuadraticSystem.from_text(["x", "y", "z"], ["y*z", "-2*z*x", "x*y"]))
    >>> found.hamiltonian is None, found.reason
    (True, 'the dimension is odd and there is no affine integral')
    """
    system = as_system(system)
    n = system.dim
    if n > MAX_DIMENSION:
        raise InputError(
            f"found a system of dimension {n}, expected at most {MAX_DIMENSION}: the structure has n (n - 1)/2 unknowns"
        )
    rng = random.Random(f"structure {derive_seed(seed, system.rhs)}")
    everything = quotient_by((), n)
    forms = closed_forms(system, everything, rng)
    functions = tuple(hamiltonian_function(system, everything, K) for K in forms)
    integrals = affine_integrals(system)
    reason, proved = "the dimension is odd", True
    if n % 2 == 0:
        K, proved = _invertible(forms, n, rng)
        if K is not None:
            return ConstantStructures(system, forms, functions, _hamiltonian(system, everything, K), (), "", True)
        reason = "no skew K with K f a gradient is invertible" if forms else "no skew K makes K f a gradient"
        if not proved:
            reason = "a random skew K with K f a gradient is singular"
    if not integrals:
        reason += " and there is no affine integral"
    elif (n - len(integrals)) % 2:
        reason += f", and the {counted(len(integrals), 'affine integral')} would give J a kernel of dimension "
        reason += f"{len(integrals)}, impossible for a skew {n} x {n} matrix"
        # For one integral the kernel is this or zero; of more integrals there are subspaces that were not tried.
        proved = proved and len(integrals) == 1
    else:
        quotient = quotient_by(integrals, n)
        K, decided = _invertible(closed_forms(system, quotient, rng), len(quotient.free), rng)
        if K is not None:
            H = _hamiltonian(system, quotient, K)
            rows = fmpq_mat([[fmpq(entry) for entry in v] for v in integrals])
            casimirs = linear_combinations(rows, ring(system.variables).gens())
            return ConstantStructures(system, forms, functions, H, casimirs, "", True)
        reason += ", and none has the affine integrals as its kernel"
        # Of two integrals in even dimension the kernel is both or none; of three there are lines, which were not tried.
        proved = proved and decided and len(integrals) <= 2
    return ConstantStructures(system, forms, functions, None, (), reason, proved)


def closed_forms(system: QuadraticSystem, quotient: QuotientForms, rng: random.Random) -> tuple[fmpq_mat, ...]:
    """A basis of the skew K for which K f_y is a gradient with respect to the coordinates y of the quotient."""
    m, n = len(quotient.free), system.dim
    count_work(n**4 + 5 * n**3)
    local = system.over(QQ)
    units = [[fmpq(int(i == k)) for i in range(n)] for k in range(n)]
    # The symmetry at one random point leaves few forms; then at the origin and in each direction.
    parts = [local.jacobian([fmpq(rng.randint(-99, 99)) for _ in range(n)]), local.B]
    parts += [local.hessian_times(unit) for unit in units]
    pairs = [(i, j) for i in range(m) for j in range(i + 1, m)]
    forms = [_skew(m, {pair: 1}) for pair in pairs]
    for part in parts:
        if not forms:
            return ()
        by_y = quotient.rows(part) * quotient.section
        products = [K * by_y for K in forms]
        conditions = fmpq_mat([[P[i, j] - P[j, i] for P in products] for i, j in pairs])
        forms = [combination_of(vector, forms) for vector in nullspace(QQ, conditions)]
    echelon, _ = fmpq_mat([[K[i, j] for i, j in pairs] for K in forms]).rref()
    rows = (primitive_integers(tuple(row)) for row in echelon.tolist())
    return tuple(_skew(m, dict(zip(pairs, row, strict=True))) for row in rows)


def _skew(m: int, above: Mapping[tuple[int, int], int | fmpz]) -> fmpq_mat:
    """The skew matrix with these entries above the diagonal, and zeros."""
    return fmpq_mat(m, m, [above.get((a, b), 0) - above.get((b, a), 0) for a in range(m) for b in range(m)])


def _hamiltonian(system: QuadraticSystem, quotient: QuotientForms, K: fmpq_mat) -> CubicHamiltonian:
    """The system as J grad H with J = S K^{-1} S^T, scaled to coprime integers, the first of them positive."""
    J = quotient.section * K.inv() * quotient.section.transpose()
    entries = tuple(J.entries())
    factor = next(
        (integer / entry for integer, entry in zip(primitive_integers(entries), entries, strict=True) if entry != 0), 1
    )
    return CubicHamiltonian(hamiltonian_function(system, quotient, K / factor), J * factor)


def hamiltonian_function(system: QuadraticSystem, quotient: QuotientForms, K: fmpq_mat) -> fmpq_mpoly:
    """The H with grad_y H = K f_y that vanishes for y = 0: the integral of y . K f_y from x - S y, where y = 0, to x.

    The integrand is a polynomial of degree 2 in the parameter, so Simpson's rule is exact.
    """
    context = ring(system.variables)
    gens = context.gens()
    y = [gens[i] for i in quotient.free]
    H = context.constant(0)
    if not y:
        return H
    shift = linear_combinations(quotient.section, tuple(y))
    h = linear_combinations(K, tuple(system.rhs[i] for i in quotient.free))
    for t, weight in ((fmpq(0), fmpq(1, 6)), (fmpq(1, 2), fmpq(2, 3)), (fmpq(1), fmpq(1, 6))):
        x = [gen - (1 - t) * s for gen, s in zip(gens, shift, strict=True)]
        for coordinate, component in zip(y, h, strict=True):
            H = H + weight * coordinate * component.compose(*x, ctx=context)
    return H


def _invertible(forms: Sequence[fmpq_mat], m: int, rng: random.Random) -> tuple[fmpq_mat | None, bool]:
    """A simple invertible combination of skew m x m matrices, m even; or None, and whether that is proved."""
    if m == 0:
        return fmpq_mat(0, 0), True
    if not forms:
        return None, True
    standard = standard_structure(m)
    vectors = [K.entries() for K in forms]
    if fmpq_mat([*vectors, standard.entries()]).rank() == len(vectors):
        return standard * -1, True
    field = GF(random_prime(rng))
    modular = [field.convert_matrix(K) for K in forms]
    for _ in range(3):
        generic = combination_of([rng.randrange(field.characteristic) for _ in modular], modular)
        if int(generic.det()):
            # Simple combinations first. Random small integers end it: the Pfaffian is a polynomial that is not zero.
            n = len(forms)
            random_ones = ([rng.randint(-(size // 10), size // 10) for _ in range(n)] for size in count(10))
            small = chain([[int(j == i) for j in range(n)] for i in range(n)], [[1] * n], random_ones)
            return next(K for K in (combination_of(c, forms) for c in small) if K.det() != 0), True
    degrees = range(m // 2 + 1)
    if len(degrees) ** len(forms) > _GRID:
        return None, False
    # A polynomial of degree at most m/2 in each variable that vanishes on this grid is zero.
    grid = (combination_of(coefficients, forms) for coefficients in product(degrees, repeat=len(forms)))
    return next((K for K in grid if K.det() != 0), None), True


@dataclass(frozen=True, eq=False)
class InheritedIntegrals:
    """What `inherited_integrals` found: the affine integrals are in `quotient`, the K with respect to y are `forms`."""

    system: QuadraticSystem
    quotient: QuotientForms
    forms: tuple[fmpq_mat, ...]

    @property
    def text(self) -> str:
        """What there is, in words; empty where there is nothing."""
        affine, modified = len(self.quotient.integrals), len(self.forms)
        parts = [counted(affine, "affine integral")] if affine else []
        return " and ".join([*parts, counted(modified, "modified Hamiltonian")] if modified else parts)

    def gradients(self, map_: ModularMap, x: Point) -> list[list[int]]:
        """Covectors that span those of all these integrals at a point; none where the map has no value there.

        `map_` is that of the system modulo a prime that divides none of its denominators.
        """
        assert isinstance(map_.map, KahanMap)
        field, n, free = GF(map_.prime), map_.dim, self.quotient.free
        rows = [[int(entry) % map_.prime for entry in vector] for vector in self.quotient.integrals]
        image = map_.step(x)
        if image is None or not self.forms:
            return rows
        here, there = ([field.convert(c) for c in point] for point in (x, image))
        S, local = field.convert_matrix(self.quotient.section), map_.map.local
        A, A_there = (
            field.matrix(len(free), len(free), [slopes[i, j] for i in free for j in range(len(free))])
            for slopes in (local.jacobian(point) * S for point in (here, there))
        )
        one, eps = field.identity(len(free)), field.convert(map_.eps)
        f = local.value(here)
        f_y = field.column([f[i] for i in free])
        u = field.column([there[i] - here[i] for i in free])
        change = (one - A * eps).inv() * (one + A_there * eps) - one  # du/dy
        third = field.convert(fmpq(1, 3))
        for form in self.forms:
            K = field.convert_matrix(form)
            slopes = K * f_y + (K * A * u + change.transpose() * K * f_y) * third
            row = [0] * n
            for i, slope in zip(free, slopes.entries(), strict=True):
                row[i] = int(slope)
            rows.append(row)
        return rows

    def count(self, map_: ModularMap) -> int:
        """How many of them are independent, at a random point: at least so many integrals the map has."""
        return rank(self.gradients(map_, map_.random_point()), map_.prime)

    def hamiltonian(self, k: int) -> fmpq_mpoly:
        """The H that belongs to the k-th form."""
        return hamiltonian_function(self.system, self.quotient, self.forms[k])

    def modified(self, k: int, field: Field, eps: Any, x: tuple[Any, ...]) -> Any:
        """The integral that belongs to the k-th form, at a point over a field."""
        H = self.hamiltonian(k)
        slopes = [H.derivative(i) for i in range(self.system.dim)]
        return modified(H, slopes, KahanFamily(self.system).at(eps, field), x)


def inherited_integrals(system: QuadraticSystem, *, seed: int = 0) -> InheritedIntegrals:
    """The integrals that a Kahan map has for every eps because the flow is what it is; all exact.

    Args:
        system: a quadratic system over Q.
        seed: decides a random point at which the linear equations for K are reduced first.

    Returns:
        The `InheritedIntegrals`: all affine ones and, up to dimension 30, a basis of the K. Source: cmoq-2013.

    >>> from kahanmaps.documents.catalog import load
    >>> found = inherited_integrals(load("volterra_periodic_3").system)
    >>> found.text, found.hamiltonian(0)
    ('1 affine integral and 1 modified Hamiltonian', x1*x2*x3)
    """
    quotient = quotient_by(affine_integrals(system), system.dim)
    forms = closed_forms(system, quotient, random.Random(seed)) if 1 < len(quotient.free) <= MAX_DIMENSION else ()
    return InheritedIntegrals(system, quotient, forms)
