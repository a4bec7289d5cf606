"""Section 8: the Poisson tensor Pi = J - eps^2 f'^2 J, invariant under all maps of a class.

For every m: f'^2 = sum_k pi_k (A^T)^k with pi_k = delta_k0 p_0 + sum_i (coefficient k of B_i) q_i; for m = 3 these are
the paper's p, q, r. Horner's polynomials C_k of chi generalize the paper's matrices C_1 and C_2.
"""

from __future__ import annotations

from itertools import combinations
from math import comb
from typing import Any

from kahanmaps.paper.objects import PaperObjects
from kahanmaps.paper.registry import Pairs, claim


@claim("Theorem 12 (70)", "Pi short", "f", blockwise=True)
def tensor(o: PaperObjects) -> Pairs:
    """The tensor is skew-symmetric
    Pi = J - eps^2 f'^2 J, skew"""
    Pi = o.Pi(o.x)
    yield Pi, o.one_minus_square(o.f, o.x) * o.J
    yield Pi.transpose(), -Pi


@claim("Theorem 12 (71)", "Pi long", "H B")
def tensor_by_B(o: PaperObjects) -> Pairs:
    """The tensor is a combination of the B_i^T J
    Pi = (1 - eps^2 p_0) J - eps^2 sum q_i B_i^T J"""
    yield o.Pi(o.x), _long_form(o, o.x)


@claim("Theorem 12 (72)", "Pi medium", "H B")
def tensor_by_A(o: PaperObjects) -> Pairs:
    """The tensor is a combination of the (A^T)^k J; for m = 3 with p, q, r
    Pi = (1 - eps^2 p) J - eps^2 q A^T J - eps^2 r (A^T)^2 J"""
    right = o.J
    for k in range(o.m):
        right = right - o.A_to(k).transpose() * o.J * (o.eps * o.eps * o.coefficient_of_power(k, o.x))
    yield o.Pi(o.x), right


@claim("(73)-(75)", "p", "H B")
def coefficients_of_the_powers(o: PaperObjects) -> Pairs:
    """p, q, r (for every m) are the coefficients of f'^2 in powers of A^T
    p = p_0 + sum alpha_i q_i, q = sum beta_i q_i, r = sum gamma_i q_i"""
    total = o.zeros(o.n, o.n)
    for k in range(o.m):
        total = total + o.A_to(k).transpose() * o.coefficient_of_power(k, o.x)
    yield o.df * o.df, total


@claim("Theorem 12 (76)", "Pois prop", "H map", distinct_roots=True, blockwise=True, certified="poisson")
def poisson_map(o: PaperObjects) -> Pairs:
    """The map of f is Poisson
    dPhi Pi(x) dPhi^T = Pi(x~)"""
    jacobian = o.jacobian_of_step(o.f, o.x)
    yield jacobian * o.Pi(o.x) * jacobian.transpose(), o.Pi(o.x_tilde)


@claim("Theorem 12", "th Poisson", "B H", distinct_roots=True, blockwise=True)
def poisson_map_of_g(o: PaperObjects) -> Pairs:
    """The maps of all associated fields are Poisson with respect to the same bracket
    dPhi_g Pi(x) dPhi_g^T = Pi(x^)"""
    for B in o.associates():
        jacobian = o.jacobian_of_step(o.g(B), o.x)
        yield jacobian * o.Pi(o.x) * jacobian.transpose(), o.Pi(o.step(o.g(B), o.x))


@claim("Theorem 12, proof", "", "H f", distinct_roots=True, blockwise=True)
def poisson_property_without_inverses(o: PaperObjects) -> Pairs:
    """(76) holds without inverses and after multiplication by J, for any two points, not only for x and x~
    (I + eps f'(x~)) Pi(x) (I + eps f'(x~))^T = (I - eps f'(x)) Pi(x~) (I - eps f'(x))^T"""
    plus, minus = o.plus_eps_jac(o.f, o.x_tilde), o.minus_eps_jac(o.f, o.x)
    Pi_x, Pi_x_tilde = o.Pi(o.x), o.Pi(o.x_tilde)
    yield plus * Pi_x * plus.transpose(), minus * Pi_x_tilde * minus.transpose()
    left = plus * Pi_x * o.J * o.minus_eps_jac(o.f, o.x_tilde)
    yield left, minus * Pi_x_tilde * o.J * o.plus_eps_jac(o.f, o.x)


@claim("Theorem 12, proof", "", "H f", distinct_roots=True, blockwise=True)
def tensor_commutes_with_jacobians(o: PaperObjects) -> Pairs:
    """Pi J is a polynomial in A^T and so commutes with f' at any point
    Pi(x) J commutes with f'(y) at any point y"""
    left, right = o.Pi(o.x) * o.J, o.jac(o.f, o.vector("y"))
    yield left * right, right * left


@claim("Theorem 12, proof", "", misprint="the factor of both squares is eps^2, not eps")
def last_display_as_printed(o: PaperObjects) -> Pairs:
    """The last display of the proof of (76) holds as printed
    (I - eps f'(x~)^2) Pi(x) J = Pi(x~) J (I - eps f'(x)^2)"""
    df_x_tilde, df_x = o.jac(o.f, o.x_tilde), o.df
    left = (o.I - df_x_tilde * df_x_tilde * o.eps) * _long_form(o, o.x) * o.J
    yield left, _long_form(o, o.x_tilde) * o.J * (o.I - df_x * df_x * o.eps)


@claim("Theorem 12, proof", "", "H B")
def last_display(o: PaperObjects) -> Pairs:
    """The last display of the proof of (76) holds as corrected, with Pi in the form (71)
    (I - eps^2 f'(x~)^2) Pi(x) J = Pi(x~) J (I - eps^2 f'(x)^2)"""
    left = o.one_minus_square(o.f, o.x_tilde) * _long_form(o, o.x) * o.J
    yield left, _long_form(o, o.x_tilde) * o.J * o.one_minus_square(o.f, o.x)


@claim("Lemma 13 (77), (78)", "grad qr", "H", least_m=2)
def gradient_conditions(o: PaperObjects) -> Pairs:
    """The gradients of the coefficients satisfy nabla pi_k = C_k(A) nabla pi_{m-1}
    nabla q = C_1 nabla r, nabla p = C_2 nabla r"""
    v = o.vector("v")
    for k in range(o.m - 1):
        left = o.slope(lambda o, x: o.coefficient_of_power(k, x), o.x, v)
        # v . C_k(A) nabla r is the derivative of r along C_k(A)^T v.
        direction = o.horner(k).transpose() * v
        yield left, o.slope(lambda o, x: o.coefficient_of_power(o.m - 1, x), o.x, direction)


@claim("(79)-(81)", "C1", "A", only_m=3)
def matrices_C(o: PaperObjects) -> Pairs:
    """Traces of A and A^2 determine C_1, C_2 and a, b
    C_1 = A - aI, C_2 = A^2 - aA + bI"""
    a = o.trace(o.A) * o.number(1, 2)
    b = o.trace(o.A) * o.trace(o.A) * o.number(1, 8) - o.trace(o.A * o.A) * o.number(1, 4)
    yield o.horner(1), o.A - o.I * a
    yield o.horner(0), o.A * o.A - o.A * a + o.I * b


@claim("Lemma 13 (82)", "Jacobi id", "H f", least_m=2, pairwise=True, distinct_roots=True)
def jacobi_identity(o: PaperObjects) -> Pairs:
    """Pi satisfies the Jacobi identity for all triples of coordinates
    {x_i,{x_j,x_k}} + cyclic = 0"""
    yield from jacobi_identity_of(o, o.I)


def jacobi_identity_of(o: PaperObjects, factor: Any) -> Pairs:
    """Yield the Jacobi identity of `factor` Pi, where `factor` is a constant matrix."""
    Pi = factor * o.Pi(o.x)
    rows = [o.K.column([Pi[i, k] for k in range(o.n)]) for i in range(o.n)]
    hessians = [o.second(o.f, row) for row in rows]
    # Pi = J - eps^2 f'^2 J, so that its derivative along v is - eps^2 (f''v f' + f' f''v) J.
    derivatives = [factor * ((f2 * o.df + o.df * f2) * o.J * -(o.eps * o.eps)) for f2 in hessians]
    for i, j, k in combinations(range(o.n), 3):
        yield derivatives[i][j, k] + derivatives[j][k, i] + derivatives[k][i, j], o.K.zero


@claim("Lemma 13, proof", "", "J A", least_m=2)
def jacobi_identity_to_first_order(o: PaperObjects) -> Pairs:
    """The gradient conditions solve the equations of first order in eps^2
    coefficient of eps^2 in the Jacobi identities vanishes for nabla pi_k = C_k w, w any vector"""
    equations, solutions = _first_order_equations(o)
    yield equations * solutions, o.zeros(equations.nrows(), o.n)


@claim(
    "Lemma 13, proof",
    "",
    "repeated",
    least_m=3,
    at_most="the gradients (C_0 w, ..., C_(m-1) w) solve them",
    distinct_roots=True,
)
def rank_of_the_first_order(o: PaperObjects) -> Pairs:
    """Pi is Poisson only if the gradient conditions hold: 20 equations of rank 12 in 18 unknowns for m = 3
    these C(2m,3) equations for the gradients have rank 2m(m-1), so there are no other solutions"""
    equations, solutions = _first_order_equations(o)
    yield equations.nrows(), comb(2 * o.m, 3)
    yield o.rank(equations), 2 * o.m * (o.m - 1)
    yield o.rank(solutions), equations.ncols() - 2 * o.m * (o.m - 1)


@claim("Lemma 13, proof", "", "J A", least_m=2, distinct_roots=True)
def jacobi_identity_to_second_order(o: PaperObjects) -> Pairs:
    """The coefficients of eps^4 in the Jacobi identity vanish, whatever p, q, r are, if the gradient conditions hold
    coefficient of eps^4 vanishes by virtue of nabla pi_k = C_k w, for any values pi_k and any vector w"""
    values, w = o.vector("values"), o.vector("w")
    powers = [o.A_to(k).transpose() * o.J for k in range(o.m)]
    P = o.sum([power * values[k, 0] for k, power in enumerate(powers)])
    gradients = [o.horner(k) * w for k in range(o.m)]
    # The derivative of P along row i of P is the sum over k of (P nabla pi_k)_i times the k-th power of A^T (times J).
    slopes = [P * gradient for gradient in gradients]
    slopes_of_P = [
        o.sum([power * slope[i, 0] for power, slope in zip(powers, slopes, strict=True)]) for i in range(o.n)
    ]
    for i, j, k in combinations(range(o.n), 3):
        yield slopes_of_P[i][j, k] + slopes_of_P[j][k, i] + slopes_of_P[k][i, j], o.K.zero


@claim("Lemma 14 (83)", "grads pq", "H B")
def gradients_of_the_coefficients(o: PaperObjects) -> Pairs:
    """The gradients of p_0 and q_i are proportional; for m = 3 the factor is 1
    nabla p_0 = (4-m) B_i nabla q_i"""
    v = o.vector("v")
    left = o.slope(lambda o, x: o.p0(x), o.x, v)
    trace = o.slope(lambda o, x: o.eighth_of_trace(x), o.x, v)
    for i in o.tested_indices:
        right = o.slope(lambda o, x: o.q(i, x), o.x, o.B(i).transpose() * v)
        yield left, right * o.number(4 - o.m)
        yield trace, right  # for m = 4 the previous pair is 0 = 0


@claim("Theorem 12, proof", "", "H", least_m=2)
def gradients_through_p0(o: PaperObjects) -> Pairs:
    """nabla tr f'^2/8, which is nabla p_0 for m = 3, determines the gradients of p, q, r
    nabla p = (I + sum alpha_i B_i) nabla p_0, nabla q = sum beta_i B_i nabla p_0, ..."""
    v = o.vector("v")
    for k in range(o.m):
        matrix = o.sum([o.B(i) * o.lagrange(i)[k] for i in o.each])
        if k == 0:
            matrix = matrix + o.I * o.number(4 - o.m)
        left = o.slope(lambda o, x: o.coefficient_of_power(k, x), o.x, v)
        terms = [o.lagrange(i)[k] * o.slope(lambda o, x: o.q(i, x), o.x, v) for i in o.each]
        if k == 0:
            terms.append(o.slope(lambda o, x: o.p0(x), o.x, v))
        yield left, o.sum(terms)
        yield left, o.slope(lambda o, x: o.eighth_of_trace(x), o.x, matrix.transpose() * v)


@claim("(84), (85)", "", "B", least_m=2)
def sums_with_coefficients(o: PaperObjects) -> Pairs:
    """The matrix identities for the gradient conditions hold
    sum beta_i B_i = (A - aI) sum gamma_i B_i, I + sum alpha_i B_i = (A^2 - aA + bI) sum gamma_i B_i"""
    top_sum = o.sum([o.B(i) * o.lagrange(i)[o.m - 1] for i in o.each])
    for k in range(o.m - 1):
        left = o.sum([o.B(i) * o.lagrange(i)[k] for i in o.each])
        if k == 0:
            left = left + o.I * o.number(4 - o.m)
        yield left, o.horner(k) * top_sum


@claim("(86), (87)", "pois lemma cond 1", "B", only_m=3)
def conditions_at_the_eigenvalues(o: PaperObjects) -> Pairs:
    """The same at the eigenvalues, and the equivalent forms beta_i = (lambda_i - a) gamma_i, alpha_i - 1 = ...
    beta_j + beta_k - beta_i = (lambda_i - a)(gamma_j + gamma_k - gamma_i), 1 + alpha_j + alpha_k - alpha_i = ..."""
    a, b = -o.chi[2], o.chi[1]
    for i in o.tested_indices:
        j, k = (other for other in o.each if other != i)
        (ai, bi, ci), (aj, bj, cj), (ak, bk, ck) = o.lagrange(i), o.lagrange(j), o.lagrange(k)
        root = o.lam[i]
        C_2 = root * root - a * root + b
        sums = []
        for c in range(3):  # sum over j of (alpha, beta or gamma)_j B_j(lambda_i)
            values = [o.lagrange(l)[0] + root * (o.lagrange(l)[1] + root * o.lagrange(l)[2]) for l in o.each]
            sums.append(o.sum([o.lagrange(l)[c] * values[l] for l in o.each]))
        yield sums[1], (root - a) * sums[2]
        yield o.K.one + sums[0], C_2 * sums[2]
        yield bj + bk - bi, (root - a) * (cj + ck - ci)
        yield bi, (root - a) * ci
        yield o.K.one + aj + ak - ai, C_2 * (cj + ck - ci)
        yield ai - o.K.one, C_2 * ci


@claim("(88), (89)", "Af' comp", "H A", least_m=2)
def components(o: PaperObjects) -> Pairs:
    """B^T f' = f' B^T and its derivative by x_l hold in components
    sum_k B_kj d_m f_k = sum_k d_k f_j B_mk, and its derivative"""
    for i in o.tested_indices:
        B = o.B(i)
        yield B.transpose() * o.df, o.df * B.transpose()
        for l in range(o.n):
            derivative = o.second(o.f, o.unit(l))
            yield B.transpose() * derivative, derivative * B.transpose()


@claim("(90)", "grad q comp", "f''")
def gradient_of_q(o: PaperObjects) -> Pairs:
    """The gradient of q_i has these two terms in components
    dq/dx_l = tr(B^T f''_l f')/8 + tr(B^T f' f''_l)/8"""
    for i in o.tested_indices:
        gradient = o.gradient(lambda o, x: o.q(i, x), o.x)
        for l in range(o.n):
            trace_1, trace_2 = _two_traces(o, o.B(i), l)
            yield gradient[l, 0], trace_1 + trace_2


@claim("(91)-(93)", "A grad q comp", "H B")
def gradient_of_q_times_B(o: PaperObjects) -> Pairs:
    """Both contributions to B nabla q have this form, and their sum is nabla tr f'^2/8
    (B nabla q)_n = sum_l (B^T)_ln dq/dx_l = sum d_n d_m f_j d_j f_m/8 + sum d_j f_k d_j d_n f_k/8"""
    trace = o.gradient(lambda o, x: o.eighth_of_trace(x), o.x)
    for i in o.tested_indices:
        B = o.B(i)
        sums = [_two_traces(o, B, l) for l in range(o.n)]
        for k in range(o.n):
            derivative = o.second(o.f, o.unit(k))
            expected = o.trace(derivative * o.df) * o.number(1, 8)
            for index in range(2):
                yield o.sum([B[k, l] * sums[l][index] for l in range(o.n)]), expected
            # The intermediate lines: (88) and (89) move B^T to the index of the derivative.
            BT = B.transpose()
            second_along_BT = [o.second(o.f, BT * o.unit(l)) for l in range(o.n)]
            for l in range(o.n):
                yield sums[l][0], o.trace(second_along_BT[l] * o.df) * o.number(1, 8)
                yield sums[l][1], o.trace(o.df * BT * o.second(o.f, o.unit(l))) * o.number(1, 8)
                yield sums[l][1], o.trace(o.df * second_along_BT[l]) * o.number(1, 8)
            yield expected * o.number(2), trace[k, 0]


def _long_form(o: PaperObjects, x: Any) -> Any:
    right = o.J * (o.K.one - o.eps * o.eps * o.p0(x))
    for i in o.each:
        right = right - o.B(i).transpose() * o.J * (o.eps * o.eps * o.q(i, x))
    return right


def _first_order_equations(o: PaperObjects) -> tuple[Any, Any]:
    """Return the equations of order eps^2 for the d_l pi_k, and their solutions nabla pi_k = C_k w."""
    n, m = o.n, o.m
    powers = [o.A_to(k).transpose() * o.J for k in range(m)]
    rows = []
    for triple in combinations(range(n), 3):
        row = [o.K.zero] * (n * m)
        for a in range(3):
            i, j, k = triple[a], triple[(a + 1) % 3], triple[(a + 2) % 3]
            for exponent in range(m):
                for l in range(n):  # to this order the bracket of x_i with a function u is sum_l J_il d_l u
                    row[exponent * n + l] = row[exponent * n + l] + o.J[i, l] * powers[exponent][j, k]
        rows.append(row)
    equations = o.K.matrix(len(rows), n * m, [entry for row in rows for entry in row])
    entries = [o.horner(k)[i, j] for k in range(m) for i in range(n) for j in range(n)]
    return equations, o.K.matrix(n * m, n, entries)


def _two_traces(o: PaperObjects, B: Any, l: int) -> tuple[Any, Any]:
    derivative = o.second(o.f, o.unit(l))
    eighth = o.number(1, 8)
    return (o.trace(B.transpose() * derivative * o.df) * eighth, o.trace(B.transpose() * o.df * derivative) * eighth)
