"""Section 9: differential equations for H~ and K~_i, and the inverse of the Poisson tensor.

For every m: s_i = 1 - eps^2 (p_0 + sum q_j - 2 q_i), P_0 = ((m-2)^2 + (4-m) sum 1/s_j)/4 and eps^2 Q_i = (2 - m + sum
1/s_j - 2/s_i)/4. For m = 3 these are the paper's formulas with s_0 = 1.
"""

from __future__ import annotations

from typing import Any

from kahanmaps.paper.objects import PaperObjects
from kahanmaps.paper.registry import Pairs, claim


@claim("Theorem 15 (94)", "grad tK", "H B", pairwise=True)
def gradients_of_the_integrals(o: PaperObjects) -> Pairs:
    """The integrals are related by the same differential equation as H and K_i
    nabla K~_i = B_i nabla H~"""
    v = o.vector("v")
    for signs in o.all_signs():
        left = o.slope(lambda o, x: o.integral(o.g(o.B_signs(signs)), x), o.x, v)
        yield left, o.slope(lambda o, x: o.H_tilde(x), o.x, o.B_signs(signs).transpose() * v)


@claim("Theorem 15", "th diff eqs", "H A", pairwise=True)
def second_order_equations_of_the_integrals(o: PaperObjects) -> Pairs:
    """The integrals satisfy the same second order differential equations as H and K_i
    A nabla^2 H~ = nabla^2 H~ A^T, A nabla^2 K~_i = nabla^2 K~_i A^T"""
    v, w = o.vector("v"), o.vector("w")
    left = o.second_slope(lambda o, x: o.H_tilde(x), o.x, o.AT * v, w)
    yield left, o.second_slope(lambda o, x: o.H_tilde(x), o.x, v, o.AT * w)
    for signs in o.all_signs():
        left = o.second_slope(lambda o, x: o.integral(o.g(o.B_signs(signs)), x), o.x, o.AT * v, w)
        yield left, o.second_slope(lambda o, x: o.integral(o.g(o.B_signs(signs)), x), o.x, v, o.AT * w)


@claim("(95), (96)", "tH", "eps f", blockwise=True)
def integrals_by_the_inverse_tensor(o: PaperObjects) -> Pairs:
    """The inverse of the Poisson tensor gives the integrals
    H~ = -2 x^T Pi^{-1} f, K~_i = -2 x^T Pi^{-1} g_i"""
    Pi = o.Pi(o.x)
    for g in [o.f, *(o.g(B) for B in o.associates())]:
        yield o.integral(g, o.x), o.dot(o.x, o.solve(Pi, o.value(g, o.x))) * o.number(-2)


@claim("Lemma 16 (97)", "Pi inv", "H B")
def inverse_tensor(o: PaperObjects) -> Pairs:
    """The inverse of the Poisson tensor has this form
    Pi^{-1} = -P_0 J - eps^2 sum Q_i B_i J"""
    right = -(o.J * o.P0(o.x))
    for i in o.each:
        right = right - o.B(i) * o.J * (o.eps * o.eps * o.Q(i, o.x))
    yield o.Pi(o.x) * right, o.I
    yield o.inverse(o.Pi(o.x)), right


@claim("Lemma 16 (98)-(101)", "P0", "B", only_m=3)
def functions_P_and_Q(o: PaperObjects) -> Pairs:
    """P_0 and Q_i are as printed for m = 3, with s_0 = 1 and the s_i the eigenvalues of I - eps^2 f'^2
    P_0 = (1/s_0 + 1/s_1 + 1/s_2 + 1/s_3)/4, Q_1 = (-1/s_0 - 1/s_1 + 1/s_2 + 1/s_3)/(4 eps^2), ..."""
    one, eps_squared = o.K.one, o.eps * o.eps
    reciprocals = [one / (one - eps_squared * o.eigenvalue_of_square(i, o.x)) for i in o.each]
    yield o.P0(o.x) * o.number(4), one + o.sum(reciprocals)
    for i in o.each:
        right = o.sum(reciprocals) - reciprocals[i] - reciprocals[i] - one
        yield o.Q(i, o.x) * (o.number(4) * eps_squared), right


@claim("(102)", "s0", "B", only_m=3)
def function_s0(o: PaperObjects) -> Pairs:
    """s_0 is 1, that is p_0 = q_1 + q_2 + q_3
    s_0 = 1 - eps^2 (p_0 - q_1 - q_2 - q_3) = 1"""
    eps_squared = o.eps * o.eps
    yield o.K.one - eps_squared * o.p0(o.x) + eps_squared * o.sum([o.q(i, o.x) for i in o.each]), o.K.one


@claim("(102)", "s0", "B")
def sum_of_the_q(o: PaperObjects) -> Pairs:
    """p_0 and the q_i satisfy this linear relation for every m
    p_0 = (4-m) tr f'^2/8, sum q_i = (m-2) tr f'^2/8"""
    yield o.sum([o.q(i, o.x) for i in o.each]), o.eighth_of_trace(o.x) * o.number(o.m - 2)


@claim("(103)-(105)", "s1", "B", only_m=3)
def functions_s(o: PaperObjects) -> Pairs:
    """The two forms of s_1, s_2, s_3 agree
    s_1 = 1 - eps^2 (p_0 - q_1 + q_2 + q_3) = 1 - 2 eps^2 (q_2 + q_3), ..."""
    eps_squared = o.eps * o.eps
    q = [o.q(i, o.x) for i in o.each]
    for i in o.tested_indices:
        j, k = (other for other in o.each if other != i)
        yield (
            o.s(i, o.x),
            o.K.one - eps_squared * o.p0(o.x) + eps_squared * q[i] - eps_squared * q[j] - eps_squared * q[k],
        )
        yield o.s(i, o.x), o.K.one - (eps_squared + eps_squared) * q[j] - (eps_squared + eps_squared) * q[k]


@claim("(103)-(105)", "s1", "B")
def functions_s_are_eigenvalues(o: PaperObjects) -> Pairs:
    """The s_i are the eigenvalues of I - eps^2 f'^2
    s_i = 1 - eps^2 (eigenvalue of f'^2 on the eigenspace of lambda_i)"""
    for i in o.tested_indices:
        yield o.s(i, o.x), o.K.one - o.eps * o.eps * o.eigenvalue_of_square(i, o.x)


@claim("(106)", "tH thru H K", "H B inhomogeneous")
def H_tilde_through_H_and_K(o: PaperObjects) -> Pairs:
    """H and the K_i give H~; all three lines hold
    H~ = 2 P_0 x^T J f + 2 eps^2 sum Q_i x^T B_i J f = ... = -6 P_0 H - 6 eps^2 sum Q_i K_i"""
    eps_squared = o.eps * o.eps
    P0, Q = o.P0(o.x), [o.Q(i, o.x) for i in o.each]
    form_1 = P0 * o.dot(o.x, o.J * o.fx) * o.number(2)
    form_2 = P0 * o.dot(o.x, o.grad(o.x)) * o.number(-2)
    form_3 = P0 * o.H(o.x) * o.number(-6)
    for i in o.each:
        form_1 = form_1 + eps_squared * Q[i] * o.dot(o.x, o.B(i) * (o.J * o.fx)) * o.number(2)
        form_2 = form_2 - eps_squared * Q[i] * o.dot(o.x, o.B(i) * o.grad(o.x)) * o.number(2)
        form_3 = form_3 - eps_squared * Q[i] * o.Kf(o.B(i), o.x) * o.number(6)
    for form in (form_1, form_2, form_3):
        yield o.H_tilde(o.x), form


@claim("(107)", "tK thru H K", "B", only_m=3)
def K_tilde_through_H_and_K(o: PaperObjects) -> Pairs:
    """H and the K_i give K~_i for m = 3
    K~_1 = -6 P_0 K_1 - 6 eps^2 Q_1 H + 6 eps^2 Q_2 K_3 + 6 eps^2 Q_3 K_2"""
    factor = o.number(6) * o.eps * o.eps
    K = [o.Kf(o.B(i), o.x) for i in o.each]
    Q = [o.Q(i, o.x) for i in o.each]
    for i in o.tested_indices:
        j, k = (other for other in o.each if other != i)
        right = P_times(o, K[i]) - factor * Q[i] * o.H(o.x) + factor * Q[j] * K[k] + factor * Q[k] * K[j]
        yield o.integral(o.g_i(i), o.x), right


@claim("(107)", "tK thru H K", "H B")
def K_tilde_through_H_and_K_for_every_m(o: PaperObjects) -> Pairs:
    """K~_i has this form for every m
    K~_i = -6 P_0 K_i - 6 eps^2 sum_j Q_j K_ij, nabla K_ij = B_i B_j nabla H"""
    factor = o.number(6) * o.eps * o.eps
    for i in o.tested_indices:
        right = P_times(o, o.Kf(o.B(i), o.x))
        for j in o.each:
            right = right - factor * o.Q(j, o.x) * o.Kf(o.B(i) * o.B(j), o.x)
        yield o.integral(o.g_i(i), o.x), right


@claim("Lemma 17 (108)", "grads PQ", "H B")
def gradients_of_P_and_Q(o: PaperObjects) -> Pairs:
    """The gradients of P_0 and Q_i are proportional; for m = 3 the factor is eps^2
    nabla P_0 = (4-m) eps^2 B_i nabla Q_i"""
    v = o.vector("v")
    left = o.slope(lambda o, x: o.P0(x), o.x, v)
    reciprocals = o.slope(lambda o, x: o.reciprocals(x), o.x, v) * o.number(1, 4)
    for i in o.tested_indices:
        right = o.slope(lambda o, x: o.Q(i, x), o.x, o.B(i).transpose() * v) * o.eps * o.eps
        yield left, right * o.number(4 - o.m)
        yield reciprocals, right  # for m = 4 the previous pair is 0 = 0


@claim("Theorem 15, proof", "", "H B")
def gradient_of_H_tilde(o: PaperObjects) -> Pairs:
    """The gradient of H~ is that of (106)
    -nabla H~/6 = P_0 nabla H + H nabla P_0 + eps^2 sum (Q_i nabla K_i + K_i nabla Q_i)"""
    v = o.vector("v")
    left = o.slope(lambda o, x: o.H_tilde(x), o.x, v) * o.number(-1, 6)
    yield left, _product_rule(o, v)


@claim("Theorem 15, proof", "", "B H", only_m=3)
def B_times_gradient_of_H_tilde(o: PaperObjects) -> Pairs:
    """The five lines of the proof of (94) hold for each i
    -B_1 nabla H~/6 = P_0 nabla K_1 + eps^2 H nabla Q_1 + eps^2 Q_1 nabla H + K_1 nabla P_0 - ... = -nabla K~_1/6"""
    v = o.vector("v")
    eps_squared = o.eps * o.eps
    Q = [o.Q(i, o.x) for i in o.each]
    K = [o.Kf(o.B(i), o.x) for i in o.each]
    dK = [o.dot(v, o.B(i) * o.grad(o.x)) for i in o.each]
    dQ = [o.slope(lambda o, x: o.Q(i, x), o.x, v) for i in o.each]
    dP = o.slope(lambda o, x: o.P0(x), o.x, v)
    dH = o.dot(v, o.grad(o.x))
    for i in o.tested_indices:
        j, k = (other for other in o.each if other != i)
        direction = o.B(i).transpose() * v
        left = o.slope(lambda o, x: o.H_tilde(x), o.x, direction) * o.number(-1, 6)
        yield left, _product_rule(o, direction)
        right = o.P0(o.x) * dK[i] + eps_squared * o.H(o.x) * dQ[i]
        right = right + eps_squared * Q[i] * dH + K[i] * dP
        right = right - eps_squared * (Q[j] * dK[k] + K[j] * dQ[k])
        right = right - eps_squared * (Q[k] * dK[j] + K[k] * dQ[j])
        yield left, right
        yield right, o.slope(lambda o, x: o.integral(o.g_i(i), x), o.x, v) * o.number(-1, 6)


@claim("Theorem 15, proof", "", "B", only_m=3)
def relations_of_gradients(o: PaperObjects) -> Pairs:
    """The relations used in the proof hold
    B_1 nabla K_2 = B_1 B_2 nabla H = -B_3 nabla H = -nabla K_3"""
    gradient = o.grad(o.x)
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        yield o.B(i) * (o.B(j) * gradient), -(o.B(k) * gradient)


@claim("Lemma 16, proof", "", "B J", only_m=3)
def products_with_J(o: PaperObjects) -> Pairs:
    """The matrices of the ansatz have these products
    B_i^T J B_i J = B_i^T B_i^T J^2 = -I, B_i^T J B_j J = B_i^T B_j^T J^2 = B_k^T"""
    for i in o.tested_indices:
        B = o.B(i).transpose()
        yield B * o.J * o.B(i) * o.J, B * B * o.J * o.J
        yield B * B * o.J * o.J, -o.I
        j, k = (other for other in o.each if other != i)
        C = o.B(j).transpose()
        yield B * o.J * o.B(j) * o.J, B * C * o.J * o.J
        yield B * C * o.J * o.J, o.B(k).transpose()


@claim(
    "Lemma 16, proof",
    "",
    only_m=3,
    misprint="the entry (2,3) is eps^2 q_3: the matrix is symmetric and its entries have the same order in eps",
)
def linear_system_as_printed(o: PaperObjects) -> Pairs:
    """P_0 and Q_i solve the linear system as printed
    4 x 4 system with entry (2,3) = eps^3 q_3"""
    yield from _linear_system(o, o.eps * o.eps * o.eps)


@claim("Lemma 16, proof", "", "B", only_m=3)
def linear_system(o: PaperObjects) -> Pairs:
    """P_0 and Q_i are the unique solution of the linear system as corrected
    4 x 4 system with entry (2,3) = eps^2 q_3"""
    yield from _linear_system(o, o.eps * o.eps)
    matrix, unknowns, right = _system_matrix(o, o.eps * o.eps)
    yield o.K.column(o.solve(matrix, right).entries()), unknowns


@claim("Lemma 16, proof", "", "B H", only_m=3)
def ansatz_for_the_inverse(o: PaperObjects) -> Pairs:
    """Pi times the ansatz is a combination of I and the B_i^T, with the coefficients of the linear system
    Pi (u_0 J - sum u_i B_i J) = -(M u)_0 I + sum (M u)_i B_i^T, M the matrix of the system, u any vector"""
    matrix, _, _ = _system_matrix(o, o.eps * o.eps)
    u = o.K.column([o.vector("u")[k, 0] for k in range(4)])
    coefficients = matrix * u
    ansatz = o.J * u[0, 0]
    right = -(o.I * coefficients[0, 0])
    for i in o.each:
        ansatz = ansatz - o.B(i) * o.J * u[i + 1, 0]
        right = right + o.B(i).transpose() * coefficients[i + 1, 0]
    yield o.Pi(o.x) * ansatz, right


@claim("Theorem 12", "", "H B")
def non_degenerate_tensor(o: PaperObjects) -> Pairs:
    """Pi is non-degenerate where the map is defined: the structure is symplectic
    det Pi = (s_1 ... s_m)^2"""
    product = o.K.one
    for i in o.each:
        product = product * o.s(i, o.x)
    yield o.det(o.Pi(o.x)), product * product


@claim("Lemma 16, proof", "", "B", only_m=3)
def determinant_of_the_linear_system(o: PaperObjects) -> Pairs:
    """The determinant of the linear system factors, with s_0 = 1
    determinant of the 4 x 4 system = s_0 s_1 s_2 s_3"""
    matrix, _, _ = _system_matrix(o, o.eps * o.eps)
    yield o.det(matrix), o.s(0, o.x) * o.s(1, o.x) * o.s(2, o.x)


@claim("(109)", "", "H B")
def factorization_of_the_determinant(o: PaperObjects) -> Pairs:
    """The determinant has m factors, for every m
    det(I - eps f') = s_1 s_2 s_3"""
    product = o.K.one
    for i in o.each:
        product = product * o.s(i, o.x)
    yield o.det(o.minus_eps_jac(o.f, o.x)), product


@claim("Lemma 17, proof", "", "B")
def gradients_through_s(o: PaperObjects) -> Pairs:
    """The gradients of the eigenvalues s_i determine those of P_0 and Q_i
    nabla P_0 = -(4-m)/4 sum nabla s_i/s_i^2, nabla Q_1 = (nabla s_1/s_1^2 - nabla s_2/s_2^2 - ...)/(4 eps^2)"""
    v = o.vector("v")
    scaled_slopes = []
    for i in o.each:
        slope = o.slope(lambda o, x: o.K.one - o.eps * o.eps * o.eigenvalue_of_square(i, x), o.x, v)
        scaled_slopes.append(slope / (o.s(i, o.x) * o.s(i, o.x)))
    total = o.sum(scaled_slopes)
    yield o.slope(lambda o, x: o.P0(x), o.x, v), total * o.number(o.m - 4, 4)
    for i in o.tested_indices:
        right = (scaled_slopes[i] + scaled_slopes[i] - total) / (o.number(4) * o.eps * o.eps)
        yield o.slope(lambda o, x: o.Q(i, x), o.x, v), right


@claim("Lemma 17, proof", "", "H B")
def signs_of_the_gradients_of_s(o: PaperObjects) -> Pairs:
    """B_i changes the sign of nabla s_i and fixes the other nabla s_j
    B_1 nabla s_1 = -nabla s_1, B_1 nabla s_2 = nabla s_2, ..."""
    v = o.vector("v")
    for i in o.tested_indices:
        direction = o.B(i).transpose() * v
        for j in o.each:
            left = o.slope(lambda o, x: o.s(j, x), o.x, direction)
            right = o.slope(lambda o, x: o.s(j, x), o.x, v)
            yield left, right * o.number(-1 if i == j else 1)


def P_times(o: PaperObjects, value: Any) -> Any:
    """Return -6 P_0 `value`."""
    return o.P0(o.x) * value * o.number(-6)


def _product_rule(o: PaperObjects, v: Any) -> Any:
    """Return the derivative of P_0 H + eps^2 sum Q_i K_i along v, by the product rule."""
    value = o.P0(o.x) * o.dot(v, o.grad(o.x)) + o.H(o.x) * o.slope(lambda o, x: o.P0(x), o.x, v)
    for i in o.each:
        term = o.Q(i, o.x) * o.dot(v, o.B(i) * o.grad(o.x))
        term = term + o.Kf(o.B(i), o.x) * o.slope(lambda o, x: o.Q(i, x), o.x, v)
        value = value + o.eps * o.eps * term
    return value


def _system_matrix(o: PaperObjects, factor_23: Any) -> tuple[Any, Any, Any]:
    """Return (M, u, b) of the paper's 4 x 4 linear system M u = b, with entry (2,3) of M = `factor_23` q_3."""
    eps_squared = o.eps * o.eps
    q1, q2, q3 = (o.q(i, o.x) for i in o.each)
    d = o.K.one - eps_squared * o.p0(o.x)
    rows = [
        [d, eps_squared * q1, eps_squared * q2, eps_squared * q3],
        [eps_squared * q1, d, factor_23 * q3, eps_squared * q2],
        [eps_squared * q2, eps_squared * q3, d, eps_squared * q1],
        [eps_squared * q3, eps_squared * q2, eps_squared * q1, d],
    ]
    unknowns = o.K.column([-o.P0(o.x), *(eps_squared * o.Q(i, o.x) for i in o.each)])
    right = o.K.column([-o.K.one, o.K.zero, o.K.zero, o.K.zero])
    return o.K.matrix(4, 4, [value for row in rows for value in row]), unknowns, right


def _linear_system(o: PaperObjects, factor_23: Any) -> Pairs:
    matrix, unknowns, right = _system_matrix(o, factor_23)
    yield matrix * unknowns, right
