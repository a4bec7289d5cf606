"""Claims beyond the paper: the structure behind its theorems, generalizations, and counterexamples."""

from __future__ import annotations

from collections.abc import Callable
from math import comb
from typing import Any

from kahanmaps.paper.claims.introduction import perturbed_hamiltonians_are_conserved
from kahanmaps.paper.claims.poisson_structure import jacobi_identity, jacobi_identity_of, poisson_map, poisson_map_of_g
from kahanmaps.paper.objects import PaperObjects
from kahanmaps.paper.registry import ClaimFunction, ClaimKind, Pairs, claim, entries
from kahanmaps.paper.variations import VARIATIONS, jordan_block, varied

_MAX_ITERATE = 4  # iterates tested: Phi^4 is the first whose degree distinguishes planar Hamiltonian maps from others


@claim("Structure", "", "H eps")
def product_of_planar_maps(o: PaperObjects) -> Pairs:
    """The map is a product of planar maps: no linear system has to be solved
    det(I - eps f') = prod (1 + eps^2 D_i),  x~ = (x + 2 eps f)/(1 + eps^2 D_i) on each block"""
    product = o.K.one
    for i in o.each:
        E = o.projector(i).transpose()
        factor = o.K.one - o.eps * o.eps * o.eigenvalue_of_square(i, o.x)
        product = product * factor
        yield E * o.x_tilde * factor, E * (o.x + o.fx * (o.number(2) * o.eps))
    yield o.det(o.minus_eps_jac(o.f, o.x)), product


@claim("Structure", "", "B H")
def associated_maps_on_the_blocks(o: PaperObjects) -> Pairs:
    """The map of an associated field is the map of f on some blocks and its inverse on the others
    Phi_{f_s} = Phi_f on blocks with s_i = 1, Phi_f^{-1} where s_i = -1"""
    preimage = o.step(o.f, o.x, times=-1)
    for signs in o.all_signs():
        x_hat = o.step(o.g(o.B_signs(signs)), o.x)
        for i in o.each:
            E = o.projector(i).transpose()
            yield E * x_hat, E * (o.x_tilde if signs[i] > 0 else preimage)


@claim("Structure", "", "map", blockwise=True)
def opposite_field(o: PaperObjects) -> Pairs:
    """The map of -f is the inverse of the map of f
    Phi_{-f} = Phi_f^{-1}"""
    opposite = o.g(-o.I)
    yield o.step(opposite, o.x_tilde), o.x


@claim(
    "Structure",
    "",
    "f",
    in_general=True,
    at_most="docs/mathematics.md proves it for all n by the content rule",
    distinct_roots=True,
)
def degrees_of_the_iterates(o: PaperObjects) -> Pairs:
    """The degrees of the first four iterates are those of the theorem for all n
    deg Phi^n = 3 m n^2/4 + 1 (n even), m (3 n^2 + 5)/4 (n odd), n = 1, ..., 4"""
    direction, form = o.vector("direction"), o.vector("form")
    degrees = [o.m * (3 * n * n + 5) // 4 if n % 2 else 3 * o.m * n * n // 4 + 1 for n in range(1, _MAX_ITERATE + 1)]
    size = degrees[-1] + 1  # one more than for the expected degree, so that a larger degree is recognized
    points = [o.x + direction * o.number(t) for t in range(2 * size)]
    for degree in degrees:
        points = [o.step(o.f, x) for x in points]
        values = [o.dot(form, x) for x in points]
        # If y is a rational function of degree d in t, the matrix of (y(s) - y(t))/(s - t) has rank d.
        quotients = [(values[s] - values[t]) * o.number(1, s - t) for s in range(size) for t in range(size, 2 * size)]
        yield o.rank(o.K.matrix(size, size, quotients)), degree


@claim("Tensor theorem", "", "A", symplectic=False, theorem="the tensor theorem (docs/mathematics.md)")
def map_over_the_algebra(o: PaperObjects) -> Pairs:
    """The Kahan map of a system over Q[A^T] is a map over Q[A^T]
    A^T dPhi = dPhi A^T, for any quadratic f over Q[A^T]"""
    jacobian = o.jacobian_of_step(o.arbitrary_system_over_the_algebra(), o.x)
    yield o.AT * jacobian, jacobian * o.AT


@claim("Tensor theorem", "", "B", symplectic=False, theorem="the splitting lemma (docs/mathematics.md)")
def commuting_systems_over_the_algebra(o: PaperObjects) -> Pairs:
    """A system over Q[A^T] need not be Hamiltonian for its sign systems to commute
    Phi_f o Phi_g = Phi_g o Phi_f, g = B^T f, for any quadratic f over Q[A^T]"""
    f = o.arbitrary_system_over_the_algebra()
    for B in o.associates():
        g = f.transformed(B.transpose())
        yield o.step(f, o.step(g, o.x)), o.step(g, o.step(f, o.x))


@claim("Tensor theorem", "", "H map", distinct_roots=True, blockwise=True)
def poisson_map_for_each_power(o: PaperObjects) -> Pairs:
    """The map has m invariant Poisson tensors, one for each element of a basis of the algebra
    dPhi (A^T)^k Pi(x) dPhi^T = (A^T)^k Pi(x~), k < m"""
    jacobian = o.jacobian_of_step(o.f, o.x)
    for k in range(o.m):
        power = o.A_to(k).transpose()
        yield jacobian * power * o.Pi(o.x) * jacobian.transpose(), power * o.Pi(o.x_tilde)


@claim("Tensor theorem", "", "H f", least_m=2, pairwise=True, distinct_roots=True)
def compatible_poisson_tensors(o: PaperObjects) -> Pairs:
    """The m invariant Poisson tensors are compatible
    sum c_k (A^T)^k Pi is a Poisson tensor for any constants c_k"""
    yield from jacobi_identity_of(o, o.polynomial_in_A([o.vector("c")[k, 0] for k in range(o.m)]).transpose())


@claim(
    "A with a Jordan block",
    "",
    "J",
    at_most="docs/mathematics.md proves it for every A that is not derogatory",
    least_m=2,
    distinct_roots=True,
)
def dimension_of_the_cubics_for_a_jordan_block(o: PaperObjects) -> Pairs:
    """The cubics also form a space of dimension 4m if A is neither diagonalisable nor derogatory
    dim of the cubics = 4m, lambda_1 double, chi the minimal polynomial"""
    yield comb(o.n + 2, 3) - jordan_block(o).rank_of_cubic_equations(), 4 * o.m


@claim("Maximality", "", "roots", least_m=2, blockwise=True)
def commutativity_for_idempotents(o: PaperObjects) -> Pairs:
    """The map of the part of f on one block commutes with that of f: B may have the eigenvalue 0 as well
    Phi_f o Phi_g = Phi_g o Phi_f for g = B^T f, B^3 = B"""
    for i in o.each:
        g = o.g(o.projector(i))
        yield o.step(o.f, o.step(g, o.x)), o.step(g, o.x_tilde)


@claim("Maximality", "", "linear", kind=ClaimKind.DIFFERENT, in_general=True)
def only_cube_roots_commute(o: PaperObjects) -> Pairs:
    """The maps of f and l f (those of f at eps and at l eps) commute only for l^3 = l; the same holds for f and B^T f
    Res(N_1, N_2) != 0, (l^3 - l) N_i(l) the components of Phi_f o Phi_{l f} - Phi_{l f} o Phi_f on a block"""
    for i in o.each:
        x = o.projector(i).transpose() * o.x
        fx, x_tilde = o.value(o.f, x), o.step(o.f, x)
        square = o.eps * o.eps
        # The numerator (l^3 - l) N has degree 5 in l, so N is a quadratic, determined by its values at 2, 3, 4.
        values = []
        for l in (2, 3, 4):
            denominator = o.K.one + square * o.number(l * l) * o.block_determinant(i, x)
            euler_image = x + fx * (o.eps * o.number(2 * l))
            factor_1 = o.K.one + square * o.number(l * l) * o.block_determinant(i, x_tilde)
            factor_2 = denominator * denominator + square * o.block_determinant(i, euler_image)
            difference = o.step(o.f, x_tilde, times=l) - o.step(o.f, o.step(o.f, x, times=l))
            values.append(difference * (factor_1 * factor_2 * o.number(1, l**3 - l)))
        N_2, N_3, N_4 = values
        slope, curvature = (N_4 - N_2) * o.number(1, 2), (N_4 + N_2) * o.number(1, 2) - N_3
        (a, b, c), (p, q, r) = ([o.dot(o.vector(form), v) for v in (curvature, slope, N_3)] for form in ("v", "w"))
        yield (a * r - c * p) * (a * r - c * p) - (a * q - b * p) * (b * r - c * q), o.K.zero


@claim("Periodic levels", "", "H f", blockwise=True)
def division_polynomials(o: PaperObjects) -> Pairs:
    """T has order 5 where g = 32/27, and 6 where g = 28/27 ([ijk] are determinants of points of a planar orbit)
    32 [015] [234] = (32 - 27 g) [024] [135],  (32 - 27 g) [016] [235] = (28 - 27 g) [025] [136]"""
    for i in o.tested_indices:
        E = o.projector(i).transpose()
        points = [E * o.x]
        for _ in range(6):
            points.append(o.step(o.f, points[-1]))

        def det(*indices: int, points: list[Any] = points) -> Any:
            index_pairs = zip(indices, indices[1:] + indices[:1], strict=True)
            return o.sum([o.dot(points[a], o.J * points[b]) for a, b in index_pairs])

        x, fx = points[0], o.value(o.f, points[0])
        D, D_f = o.block_determinant(i, x), o.block_determinant(i, fx)
        D_mixed, s = o.block_determinant(i, x + fx) - D - D_f, o.K.one + o.eps * o.eps * D
        g = s * s * o.number(27) + (D_mixed * D_mixed + D * D * D) * o.eps**6 * o.number(4)  # 27 g s^2
        factor_5, factor_6 = s * s * o.number(32) - g, s * s * o.number(28) - g
        yield s * s * o.number(32) * det(0, 1, 5) * det(2, 3, 4), factor_5 * det(0, 2, 4) * det(1, 3, 5)
        yield factor_5 * det(0, 1, 6) * det(2, 3, 5), factor_6 * det(0, 2, 5) * det(1, 3, 6)


def commuting(o: PaperObjects) -> Pairs:
    """The maps of the class commute"""
    for B in o.associates():
        yield o.step(o.f, o.step(o.g(B), o.x)), o.step(o.g(B), o.x_tilde)


def measure(o: PaperObjects) -> Pairs:
    """The map of f has its invariant measure"""
    determinant = o.det(o.jacobian_of_step(o.f, o.x))
    yield determinant * o.det(o.minus_eps_jac(o.f, o.x)), o.det(o.minus_eps_jac(o.f, o.x_tilde))


def shared_measure(o: PaperObjects) -> Pairs:
    """All maps of the class have that measure"""
    for B in o.associates():
        determinant = o.det(o.jacobian_of_step(o.g(B), o.x))
        x_hat = o.step(o.g(B), o.x)
        yield determinant * o.det(o.minus_eps_jac(o.f, o.x)), o.det(o.minus_eps_jac(o.f, x_hat))


def modified(o: PaperObjects) -> Pairs:
    """The map of f conserves modified H"""
    yield o.modified_H(o.x_tilde), o.modified_H(o.x)


def shared_modified(o: PaperObjects) -> Pairs:
    """The modified Hamiltonians are shared by all maps of the class"""
    for B in o.associates():
        yield o.modified_H(o.step(o.g(B), o.x)), o.modified_H(o.x)
        yield o.modified_K(B, o.x_tilde), o.modified_K(B, o.x)


def paper_integral(o: PaperObjects) -> Pairs:
    """The map of f conserves the paper's form eps^{-1} x^T J^{-1} x~"""
    images = [o.solve(o.J, o.step(o.f, x)) for x in (o.x_tilde, o.x)]
    yield o.dot(o.x_tilde, images[0]), o.dot(o.x, images[1])


def _modified_K_of(k: int) -> Callable[[PaperObjects, Any], Any]:
    """Return the function (objects, point) whose value is the modified Hamiltonian of the k-th associated field."""
    return lambda o, x: o.modified_K(list(o.associates())[k], x)


def gradients(o: PaperObjects) -> Pairs:
    """The modified Hamiltonians satisfy the same differential equation as H and K"""
    v = o.vector("v")
    for k, B in enumerate(o.associates()):
        left = o.slope(_modified_K_of(k), o.x, v)
        yield left, o.slope(lambda o, x: o.modified_H(x), o.x, B.transpose() * v)


def involution(o: PaperObjects) -> Pairs:
    """The modified Hamiltonians are in involution for Pi"""
    gradient = o.gradient(lambda o, x: o.modified_H(x), o.x)
    for k, _ in enumerate(o.associates()):
        modified_K_gradient = o.gradient(_modified_K_of(k), o.x)
        yield o.dot(gradient, o.Pi(o.x) * modified_K_gradient), o.K.zero


def formula(o: PaperObjects) -> Pairs:
    """The formula (106) for the integral through H and the K_i"""
    right = o.P0(o.x) * o.H(o.x)
    for i in o.each:
        right = right + o.eps * o.eps * o.Q(i, o.x) * o.Kf(o.B(i), o.x)
    yield o.modified_H(o.x), right


# The statements that are tested for the variations: formula, controls for the variations for which the statement holds,
# method of proof, and a sign for each of VARIATIONS: + holds, - fails, blank not tested, since the variation changes
# only g and the statement is about f.
_ABOUT_F, _ABOUT_F_AND_G = {"blockwise": True}, {"blockwise": True, "needs_g": True}
STATEMENTS: list[tuple[ClaimFunction, str, str, dict[str, Any], str]] = [
    (commuting, "Phi_f o Phi_g = Phi_g o Phi_f", "B map", _ABOUT_F_AND_G, "++--++"),
    (measure, "dx/det(I - eps f') is invariant for f", "map", _ABOUT_F, "+++ ++"),
    (shared_measure, "dx/det(I - eps f') is invariant for g", "B map", _ABOUT_F_AND_G, "++--++"),
    (modified, "modified H is conserved by f", "map", _ABOUT_F, "+++ ++"),
    (shared_modified, "modified H is conserved by g, modified K by f", "B map", _ABOUT_F_AND_G, "++--++"),
    (paper_integral, "eps^{-1} x^T J^{-1} x~ is conserved by f", "map", _ABOUT_F, "-++ ++"),
    (
        perturbed_hamiltonians_are_conserved,
        "eps^{-1} x^T J (A^T)^k x~ is conserved by f, k < m",
        "map",
        _ABOUT_F,
        "-   ++",
    ),
    (poisson_map, "dPhi_f Pi(x) dPhi_f^T = Pi(x~)", "map", _ABOUT_F, "++- +-"),
    (poisson_map_of_g, "dPhi_g Pi(x) dPhi_g^T = Pi(x^)", "B map", _ABOUT_F_AND_G, "++--+-"),
    (jacobi_identity, "{x_i,{x_j,x_k}} + cyclic = 0 for Pi", "f''", {"pairwise": True, "least_m": 2}, "++- +-"),
    (gradients, "nabla (modified K) = B nabla (modified H)", "B", _ABOUT_F_AND_G, "++--++"),
    (involution, "{modified H, modified K} = 0 for Pi", "B", {"pairwise": True, "needs_g": True}, "++--++"),
    (formula, "modified H = P_0 H + eps^2 sum Q_i K_i", "B", {}, "-+-   "),
]


def _cell(function: ClaimFunction, name: str, is_true: bool) -> ClaimFunction:
    """Return the claim that the statement of `function` holds, or fails, for the objects of a variation."""

    def cell(o: PaperObjects) -> Pairs:
        pairs = list(function(varied(name, o)))
        if is_true or not pairs:
            yield from pairs
        else:  # the sides of some pair have to differ
            yield tuple(o.K.column([e for pair in pairs for e in entries(pair[side])]) for side in (0, 1))

    cell.__name__ = f"{function.__name__}_{name}"
    return cell


for _function, _statement, _controls, _fields, _signs in STATEMENTS:
    for (_name, _variation), _sign in zip(VARIATIONS.items(), _signs, strict=True):
        if _sign == " ":
            continue
        _claim_function = _cell(_function, _name, _sign == "+")
        _title = f"{(_function.__doc__ or '').splitlines()[0].rstrip('.')}: {_variation.title}"
        _options: dict[str, Any] = {"distinct_roots": True, "statement": _statement, "variation": _name, **_fields}
        _needs_g = _options.pop("needs_g", False) and _variation.least_m > 1 and _name != "any-structure"
        _options["least_m"] = max(_variation.least_m, _fields.get("least_m", 1), 3 if _needs_g else 1)
        if _sign == "+":
            _claim_function.__doc__ = f"{_title}\n{_statement}"
            _options |= {"controls": _controls, "symplectic": not _variation.theorem, "theorem": _variation.theorem}
        else:
            _claim_function.__doc__ = f"{_title}\nnot {_statement}"
            _options |= {"controls": "unvaried", "kind": ClaimKind.DIFFERENT, "in_general": True}
        claim(_variation.title, "", **_options)(_claim_function)
