"""Hamiltonian structures f = J grad H of a quadratic system with a constant skew matrix J: exactly, over Q.

With K = J^{-1} the condition is that K f is a gradient. This means that K f'(x) is symmetric for all x: linear
equations for K. If J is degenerate, each v in the kernel gives an affine integral v . x. If all affine integrals arise
in this way, the equations are linear as well: take linear coordinates (y, z) of x, where z are these integrals, and let
y' = f_y. The condition is that K f_y = grad_y H with an invertible skew matrix K; z are parameters.

By cmoq-2013 the Kahan map of such a system conserves the modified Hamiltonian
H + (2 eps/3) grad H^T (I - eps f')^{-1} f and has the invariant measure dx/det(I - eps f'), for every eps.
`inherited_integrals` collects all integrals that a Kahan map has by theorems:

    v . x                              for every v with v . f = 0;
    H + grad H . (x~ - x)/3            for every constant skew K with K f_y = grad_y H, in coordinates (y, z) as above.

K need not be invertible. For invertible K, f = J grad H with J = K^{-1} (cmoq-2013); the proof for any K is in
docs/mathematics.md. Forms and functions are exact. The rank of the gradients is computed at a point modulo a prime: it
is a lower bound of the number of independent integrals.
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
from kahanmaps.algebra.work import count_work
from kahanmaps.display_protocols import PrintableResult
from kahanmaps.errors import InputError, counted
from kahanmaps.invariants.integrals_and_densities import modified
from kahanmaps.laboratory.modular_points import ModularMap, Point
from kahanmaps.laboratory.preserve.darboux.affine_functions import QuotientForms, affine_integrals, quotient_by
from kahanmaps.maps.kahan import KahanFamily, KahanMap, SystemLike
from kahanmaps.systems.hamiltonian import CubicHamiltonian, standard_structure
from kahanmaps.systems.quadratic import QuadraticSystem, as_system

MAX_DIMENSION = 30  # of the phase space: 435 unknowns n (n - 1)/2, which take a few seconds
_MAX_GRID = 2000  # points at which a Pfaffian must vanish to be identically 0


@dataclass(frozen=True, eq=False)
class ConstantStructures(PrintableResult):
    """The result of `constant_structures`; every form, function and matrix is exact.

    forms: a basis of the skew K (invertible or not) for which K f is a gradient, with coprime integer entries.
    functions: for each form K the H of degree at most 3 with grad H = K f and H(0) = 0; the flow conserves H.
    hamiltonian: H and J with f = J grad H, or None; the gradients of `casimirs` span the kernel of J.
    reason: why `hamiltonian` is None, else empty; `proved` says whether it is proved that no such J exists.
    """

    system: QuadraticSystem
    forms: tuple[fmpq_mat, ...]
    functions: tuple[fmpq_mpoly, ...]
    hamiltonian: CubicHamiltonian | None
    casimirs: tuple[fmpq_mpoly, ...]
    reason: str
    proved: bool

    def rows(self) -> list[dict[str, str]]:
        """Return one row for each form K, with the function that the flow conserves."""
        pairs = zip(self.forms, self.functions, strict=True)
        return [{"K": str(plain(K)), "function": format_polynomial(H)} for K, H in pairs]

    def to_json(self) -> dict[str, Any]:
        """Plain data."""
        return all_fields(self)


def constant_structures(system: SystemLike, *, seed: int = 0) -> ConstantStructures:
    """Find all constant skew K with K f a gradient, and a Hamiltonian form f = J grad H with constant skew J.

    Args:
        system: a quadratic system over Q, of dimension at most 30.
        seed: the random seed; it selects the combination of forms if several are possible.

    Returns:
        A `ConstantStructures`. J = [[0, I], [-I, 0]] is preferred, then another invertible J with few nonzero entries,
        then a J whose kernel is the space of all v with v . f = 0. Its proper subspaces are not tried as kernels.

    Raises:
        InputError: for a dimension above 30.

    >>> structures = constant_structures(QuadraticSystem.from_text(["q", "p"], ["2*p", "-2*q^2"]))
    >>> structures.hamiltonian.H, structures.hamiltonian.is_standard
    (2/3*q^3 + p^2, True)
    >>> structures = constant_structures(QuadraticSystem.from_text(["x", "y", "z"], ["y*z", "-2*z*x", "x*y"]))
    >>> structures.hamiltonian is None, structures.reason
    (True, 'the dimension is odd and there is no affine integral')
    """
    system = as_system(system)
    n = system.dim
    if n > MAX_DIMENSION:
        raise InputError(
            f"found a system of dimension {n}, expected at most {MAX_DIMENSION}: the structure has n (n - 1)/2 unknowns"
        )
    rng = random.Random(f"structure {derive_seed(seed, system.rhs)}")
    all_variables = quotient_by((), n)
    forms = closed_forms(system, all_variables, rng)
    functions = tuple(hamiltonian_function(system, all_variables, K) for K in forms)
    integrals = affine_integrals(system)
    reason, proved = "the dimension is odd", True
    if n % 2 == 0:
        K, proved = _find_invertible(forms, n, rng)
        if K is not None:
            return ConstantStructures(system, forms, functions, _hamiltonian(system, all_variables, K), (), "", True)
        reason = "no skew K with K f a gradient is invertible" if forms else "no skew K makes K f a gradient"
        if not proved:
            reason = "a random skew K with K f a gradient is singular"
    if not integrals:
        reason += " and there is no affine integral"
    elif (n - len(integrals)) % 2:
        reason += f", and the {counted(len(integrals), 'affine integral')} would give J a kernel of dimension "
        reason += f"{len(integrals)}, impossible for a skew {n} x {n} matrix"
        # With one affine integral v . x the kernel is 0 or the span of v. Several v have other subspaces, not tried.
        proved = proved and len(integrals) == 1
    else:
        quotient = quotient_by(integrals, n)
        K, is_decided = _find_invertible(closed_forms(system, quotient, rng), len(quotient.free), rng)
        if K is not None:
            H = _hamiltonian(system, quotient, K)
            rows = fmpq_mat([[fmpq(entry) for entry in v] for v in integrals])
            casimirs = linear_combinations(rows, ring(system.variables).gens())
            return ConstantStructures(system, forms, functions, H, casimirs, "", True)
        reason += ", and none has the affine integrals as its kernel"
        # With two affine integrals and even n the kernel is 0 or their span; with three it may be a plane, not tried.
        proved = proved and is_decided and len(integrals) <= 2
    return ConstantStructures(system, forms, functions, None, (), reason, proved)


def closed_forms(system: QuadraticSystem, quotient: QuotientForms, rng: random.Random) -> tuple[fmpq_mat, ...]:
    """Return a basis of the skew K for which K f_y is a gradient in y, the coordinates of the quotient; y' = f_y."""
    m, n = len(quotient.free), system.dim
    count_work(n**4 + 5 * n**3)
    over_Q = system.over(QQ)
    unit_vectors = [[fmpq(int(i == k)) for i in range(n)] for k in range(n)]
    # Impose that K f'(x) is symmetric: first at a random point, which leaves few K, then at 0 and in each direction.
    jacobians = [over_Q.jacobian([fmpq(rng.randint(-99, 99)) for _ in range(n)]), over_Q.B]
    jacobians += [over_Q.hessian_times(unit) for unit in unit_vectors]
    pairs = [(i, j) for i in range(m) for j in range(i + 1, m)]
    forms = [_skew_matrix(m, {pair: 1}) for pair in pairs]
    for jacobian in jacobians:
        if not forms:
            return ()
        jacobian_in_y = quotient.rows(jacobian) * quotient.section
        products = [K * jacobian_in_y for K in forms]
        conditions = fmpq_mat([[P[i, j] - P[j, i] for P in products] for i, j in pairs])
        forms = [combination_of(vector, forms) for vector in nullspace(QQ, conditions)]
    reduced_rows, _ = fmpq_mat([[K[i, j] for i, j in pairs] for K in forms]).rref()
    rows = (primitive_integers(tuple(row)) for row in reduced_rows.tolist())
    return tuple(_skew_matrix(m, dict(zip(pairs, row, strict=True))) for row in rows)


def _skew_matrix(m: int, entries: Mapping[tuple[int, int], int | fmpz]) -> fmpq_mat:
    """Return the skew matrix with these entries in the upper triangle, zero elsewhere."""
    return fmpq_mat(m, m, [entries.get((a, b), 0) - entries.get((b, a), 0) for a in range(m) for b in range(m)])


def _hamiltonian(system: QuadraticSystem, quotient: QuotientForms, K: fmpq_mat) -> CubicHamiltonian:
    """Write f = J grad H with J = c S K^{-1} S^T and S = dx/dy; c makes the entries of J coprime integers."""
    J = quotient.section * K.inv() * quotient.section.transpose()
    entries = tuple(J.entries())
    factor = next(
        (integer / entry for integer, entry in zip(primitive_integers(entries), entries, strict=True) if entry != 0), 1
    )
    return CubicHamiltonian(hamiltonian_function(system, quotient, K / factor), J * factor)


def hamiltonian_function(system: QuadraticSystem, quotient: QuotientForms, K: fmpq_mat) -> fmpq_mpoly:
    """Return the H with grad_y H = K f_y and H = 0 for y = 0, where y' = f_y in the coordinates y of the quotient.

    With S = `quotient.section`, H(x) is the integral of y . K f_y along the segment from x - S y, where y = 0, to x.
    The integrand is a polynomial of degree 2 in the parameter of the segment, so Simpson's rule is exact.
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


def _find_invertible(forms: Sequence[fmpq_mat], m: int, rng: random.Random) -> tuple[fmpq_mat | None, bool]:
    """Find a simple invertible combination of skew m x m matrices, m even.

    Returns the matrix, or None if there is no such matrix, and whether the answer is proved.
    """
    if m == 0:
        return fmpq_mat(0, 0), True
    if not forms:
        return None, True
    standard_form = standard_structure(m)
    vectors = [K.entries() for K in forms]
    if fmpq_mat([*vectors, standard_form.entries()]).rank() == len(vectors):
        return standard_form * -1, True
    field = GF(random_prime(rng))
    forms_p = [field.convert_matrix(K) for K in forms]
    for _ in range(3):
        random_combination = combination_of([rng.randrange(field.characteristic) for _ in forms_p], forms_p)
        if int(random_combination.det()):
            # Simple combinations come first, then random ones of growing size. The search ends, since the Pfaffian is a
            # nonzero polynomial.
            n = len(forms)
            random_weights = ([rng.randint(-(size // 10), size // 10) for _ in range(n)] for size in count(10))
            weights = chain([[int(j == i) for j in range(n)] for i in range(n)], [[1] * n], random_weights)
            return next(K for K in (combination_of(c, forms) for c in weights) if K.det() != 0), True
    degrees = range(m // 2 + 1)
    if len(degrees) ** len(forms) > _MAX_GRID:
        return None, False
    # The Pfaffian has degree at most m/2 in each coefficient: if it vanishes on this grid, it is 0.
    grid = (combination_of(coefficients, forms) for coefficients in product(degrees, repeat=len(forms)))
    return next((K for K in grid if K.det() != 0), None), True


@dataclass(frozen=True, eq=False)
class InheritedIntegrals:
    """The result of `inherited_integrals`.

    `quotient` holds the affine integrals; `forms` are the K with K f_y = grad_y H, one for each modified Hamiltonian.
    """

    system: QuadraticSystem
    quotient: QuotientForms
    forms: tuple[fmpq_mat, ...]

    @property
    def text(self) -> str:
        """The numbers of integrals as a phrase; empty if there are no integrals."""
        affine_count, modified_count = len(self.quotient.integrals), len(self.forms)
        phrases = [counted(affine_count, "affine integral")] if affine_count else []
        return " and ".join([*phrases, counted(modified_count, "modified Hamiltonian")] if modified_count else phrases)

    def gradients(self, map_: ModularMap, x: Point) -> list[list[int]]:
        """Return row vectors with the same span as the gradients of all inherited integrals at a point x.

        `map_` is the map of the system modulo a prime that divides no denominator of the system. At an indeterminacy
        point of the map only the affine integrals are included.
        """
        assert isinstance(map_.map, KahanMap)
        field, n, free = GF(map_.prime), map_.dim, self.quotient.free
        rows = [[int(entry) % map_.prime for entry in vector] for vector in self.quotient.integrals]
        image = map_.step(x)
        if image is None or not self.forms:
            return rows
        point, image_point = ([field.convert(c) for c in coordinates] for coordinates in (x, image))
        S, vector_field = field.convert_matrix(self.quotient.section), map_.map.local
        A, A_image = (
            field.matrix(len(free), len(free), [slopes[i, j] for i in free for j in range(len(free))])
            for slopes in (vector_field.jacobian(at_point) * S for at_point in (point, image_point))
        )
        identity, eps = field.identity(len(free)), field.convert(map_.eps)
        f = vector_field.value(point)
        f_y = field.column([f[i] for i in free])
        u = field.column([image_point[i] - point[i] for i in free])
        du_dy = (identity - A * eps).inv() * (identity + A_image * eps) - identity
        # The integral of the map is H + grad H . (x~ - x)/3, where grad H = K f and the Hesse matrix of H is K A.
        one_third = field.convert(fmpq(1, 3))
        for form in self.forms:
            K = field.convert_matrix(form)
            slopes = K * f_y + (K * A * u + du_dy.transpose() * K * f_y) * one_third
            row = [0] * n
            for i, slope in zip(free, slopes.entries(), strict=True):
                row[i] = int(slope)
            rows.append(row)
        return rows

    def count(self, map_: ModularMap) -> int:
        """Return the rank of the gradients at a random point: a lower bound of the number of independent integrals."""
        return rank(self.gradients(map_, map_.random_point()), map_.prime)

    def hamiltonian(self, k: int) -> fmpq_mpoly:
        """Return the function H of the k-th form."""
        return hamiltonian_function(self.system, self.quotient, self.forms[k])

    def modified(self, k: int, field: Field, eps: Any, x: tuple[Any, ...]) -> Any:
        """Evaluate the modified Hamiltonian of the k-th form at a point over a field."""
        H = self.hamiltonian(k)
        gradient = [H.derivative(i) for i in range(self.system.dim)]
        return modified(H, gradient, KahanFamily(self.system).at(eps, field), x)


def inherited_integrals(system: QuadraticSystem, *, seed: int = 0) -> InheritedIntegrals:
    """Find the integrals that a Kahan map inherits from the flow for every eps, by theorems; all exact.

    Args:
        system: a quadratic system over Q.
        seed: the random seed of a point at which the linear equations for K are solved first.

    Returns:
        The `InheritedIntegrals`: all affine integrals and, up to dimension 30, a basis of all K. Source: cmoq-2013.

    >>> from kahanmaps.documents.catalog import load
    >>> inherited = inherited_integrals(load("volterra_periodic_3").system)
    >>> inherited.text, inherited.hamiltonian(0)
    ('1 affine integral and 1 modified Hamiltonian', x1*x2*x3)
    """
    quotient = quotient_by(affine_integrals(system), system.dim)
    forms = closed_forms(system, quotient, random.Random(seed)) if 1 < len(quotient.free) <= MAX_DIMENSION else ()
    return InheritedIntegrals(system, quotient, forms)
