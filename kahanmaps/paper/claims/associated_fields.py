"""Section 5: the matrices B with B^2 = I, the associated vector fields, and f'^2 as a combination of I and the B_i."""

from __future__ import annotations

from itertools import pairwise

from kahanmaps.paper.objects import PaperObjects
from kahanmaps.paper.registry import ClaimKind, Pairs, claim


@claim("Def. 4", "def assoc", "J B", blockwise=True)
def matrices_of_associated_fields(o: PaperObjects) -> Pairs:
    """B is skew-Hamiltonian and B^2 = I
    B^T J = J B, B^2 = I"""
    for B in o.associates():
        yield B.transpose() * o.J, o.J * B
        yield B * B, o.I


@claim("Def. 4", "def assoc", "J A f", blockwise=True)
def associated_field(o: PaperObjects) -> Pairs:
    """The three forms of the associated vector field agree
    g = J B nabla H_0 = B^T J nabla H_0 = B^T f_0"""
    for B in o.associates():
        g = o.value(o.g(B), o.x)
        yield g, o.J * (B * o.grad(o.x))
        yield g, B.transpose() * (o.J * o.grad(o.x))
        yield g, B.transpose() * o.fx


@claim("Def. 4", "def assoc", "H A", least_m=2)
def hamilton_function_of_the_associated_field(o: PaperObjects) -> Pairs:
    """The associated field is Hamiltonian with a linear combination K of the H_i
    g = J nabla K, K = alpha H_0 + beta H_1 + gamma H_2"""
    v = o.vector("v")
    for signs in o.all_signs():
        # J^T = J^{-1}, so v . g = v . J nabla K is the derivative of K along J^T v.
        B = o.B_signs(signs)
        slope = o.slope(lambda o, x: o.Kf(o.B_signs(signs), x), o.x, o.J.transpose() * v)
        yield o.dot(v, o.value(o.g(B), o.x)), slope
        # B_s = I + the sum of B_i - I over the i with s_i = -1, as a polynomial in A.
        lagrange_polynomials = [o.lagrange(i) for i in o.each if signs[i] < 0]
        coefficients = [o.sum([c[k] for c in lagrange_polynomials]) for k in range(o.m)]
        coefficients[0] = coefficients[0] + o.number(1 - len(lagrange_polynomials))
        yield B, o.polynomial_in_A(coefficients)
        combination = o.sum([coefficient * o.H(o.x, k) for k, coefficient in enumerate(coefficients)])
        yield o.Kf(B, o.x), combination


@claim("Def. 4", "", "B", blockwise=True)
def equivalence_relation(o: PaperObjects) -> Pairs:
    """Being associated is symmetric and transitive
    B_s^T g_s = f_0;  (B_s B_t)^2 = I"""
    matrices = list(o.associates())
    for k, B in enumerate(matrices):
        yield B.transpose() * o.value(o.g(B), o.x), o.fx
        for C in matrices[: k + 1]:
            yield B * C * (B * C), o.I


@claim("Lemma 5 (31)", "f'f=g'g", "B H", blockwise=True)
def accelerations_agree(o: PaperObjects) -> Pairs:
    """Associated fields have the same second derivative along the flow
    g' g = f_0' f_0"""
    for B in o.associates():
        yield o.jac(o.g(B), o.x) * o.value(o.g(B), o.x), o.df * o.fx


@claim("Lemma 5 (32)", "f'f'=g'g'", "B H", blockwise=True)
def squares_of_jacobians_agree(o: PaperObjects) -> Pairs:
    """Associated fields have Jacobi matrices with the same square
    (g')^2 = (f_0')^2"""
    for B in o.associates():
        jacobian = o.jac(o.g(B), o.x)
        yield jacobian * jacobian, o.df * o.df


@claim("Lemma 5, proof", "", "B H", blockwise=True)
def squares_step_by_step(o: PaperObjects) -> Pairs:
    """The equalities of the proofs of (31) and (32) hold
    g'g = g'B^T f_0 = B^T g' f_0 = (B^T)^2 f_0' f_0 = f_0' f_0, the same for (g')^2"""
    for B in o.associates():
        BT, gx, dg = B.transpose(), o.value(o.g(B), o.x), o.jac(o.g(B), o.x)
        yield from pairwise([dg * gx, dg * (BT * o.fx), BT * (dg * o.fx), BT * (BT * (o.df * o.fx)), o.df * o.fx])
        yield from pairwise([dg * dg, dg * BT * o.df, BT * dg * o.df, BT * BT * o.df * o.df, o.df * o.df])


@claim("Cor. 6 (33)", "condet", "B f", blockwise=True)
def determinants_agree(o: PaperObjects) -> Pairs:
    """Maps of associated fields share the invariant measure
    det(I - eps g') = det(I - eps f_0')"""
    for B in o.associates():
        yield o.det(o.minus_eps_jac(o.g(B), o.x)), o.det(o.minus_eps_jac(o.f, o.x))


@claim("Cor. 6, proof", "", "B f")
def traces_agree(o: PaperObjects) -> Pairs:
    """Traces of powers of the Jacobi matrices agree, up to k = 2m, and those of odd powers vanish
    tr f'^k = tr g'^k, both 0 for odd k"""
    powers = [o.df]
    for _ in range(2 * o.m - 1):
        powers.append(powers[-1] * o.df)
    for B in o.associates():
        dg = o.jac(o.g(B), o.x)
        power = dg
        for k in range(1, 2 * o.m + 1):
            yield o.trace(powers[k - 1]), o.trace(power)
            if k % 2:
                yield o.trace(power), o.K.zero
            power = power * dg


@claim("Lemma 7, proof", "", "roots A")
def characteristic_polynomial_of_A(o: PaperObjects) -> Pairs:
    """The characteristic polynomial of A is a square
    det(A - t I) = chi(t)^2, chi = prod (t - lambda_i)"""
    t = o.scalar("t")
    chi = o.K.one
    for root in o.lam:
        chi = chi * (t - root)
    yield o.det(o.A - o.I * t), chi * chi


@claim("Lemma 7, proof", "", "roots A")
def A_is_diagonalisable(o: PaperObjects) -> Pairs:
    """For distinct roots A is diagonalisable: chi is its minimal polynomial
    prod (A - lambda_i I) = 0"""
    product = o.I
    for root in o.lam:
        product = product * (o.A - o.I * root)
    yield product, o.zeros(o.n, o.n)


@claim("Lemma 7, proof", "", "A", kind=ClaimKind.EXISTS, distinct_roots=True, symplectic=False)
def symplectic_normal_form_of_A(o: PaperObjects) -> Pairs:
    """A is symplectically similar to diag(W, W^T), over the same field with W a companion matrix
    A = S diag(W, W^T) S^{-1}, S^T J S = J"""
    S, W = o.symplectic_normal_form()
    yield o.A * S, S * o.block_diagonal(W)
    yield S.transpose() * o.J * S, o.J


@claim(
    "Lemma 7, proof",
    "",
    "roots",
    at_most="the rank of a projector is its trace, and the eigenvalue lambda_i is double",
    distinct_roots=True,
)
def two_eigenvectors(o: PaperObjects) -> Pairs:
    """Each eigenvalue has two linearly independent eigenvectors
    rank E_i = 2 for the projector E_i onto the eigenspace of lambda_i"""
    for i in o.each:
        E = o.projector(i)
        yield o.rank(E), 2
        yield o.is_zero(o.A * E - E * o.lam[i]), True


@claim("Lemma 7 (34)", "", "roots")
def matrices_as_polynomials_in_A(o: PaperObjects) -> Pairs:
    """B_i is a polynomial in A of degree < m, with the coefficients of Lagrange interpolation
    B_i = alpha_i I + beta_i A + gamma_i A^2"""
    for i in o.tested_indices:
        # The right side I - 2 E_i does not use Lagrange's formula; E_i projects onto the eigenspace of lambda_i.
        E = o.projector(i)
        yield o.B(i), o.I - E * o.number(2)
        yield o.A * E, E * o.lam[i]


@claim("Lemma 7", "", "B=I", least_m=3, at_most="there are m of them", distinct_roots=True)
def independent_matrices(o: PaperObjects) -> Pairs:
    """The matrices B_i are linearly independent
    B_1, ..., B_m linearly independent (m > 2; for m = 2 B_2 = -B_1)"""
    rows = [o.B(i).entries() for i in o.each]
    yield o.rank(o.K.matrix(o.m, o.n * o.n, [entry for row in rows for entry in row])), o.m


@claim("Lemma 7 (35)", "B^2", "B roots")
def involutions(o: PaperObjects) -> Pairs:
    """The matrices B_i are involutions
    B_i^2 = I"""
    for i in o.tested_indices:
        yield o.B(i) * o.B(i), o.I


@claim("Lemma 7 (36)", "B char pol", "B roots")
def characteristic_polynomial_of_B(o: PaperObjects) -> Pairs:
    """B_i has the eigenvalue -1 twice and 1 otherwise
    det(B_i - t I) = (t - 1)^{2m-2} (t + 1)^2"""
    t = o.scalar("t")
    right = (t + o.K.one) * (t + o.K.one)
    for _ in range(2 * o.m - 2):
        right = right * (t - o.K.one)
    for i in o.tested_indices:
        yield o.det(o.B(i) - o.I * t), right


@claim("Lemma 7 (37)", "B sum", "B")
def sum_of_matrices(o: PaperObjects) -> Pairs:
    """The sum of the B_i is (m-2) I, that is I for m = 3
    sum B_i = (m-2) I"""
    yield o.sum([o.B(i) for i in o.each]), o.I * o.number(o.m - 2)


@claim("Lemma 7 (38)", "", "B")
def sums_of_coefficients(o: PaperObjects) -> Pairs:
    """The sums of the coefficients of the B_i are those of (m-2) I
    sum alpha_i = m-2, sum beta_i = sum gamma_i = 0"""
    for k in range(o.m):
        yield o.sum([o.lagrange(i)[k] for i in o.each]), o.number(o.m - 2 if k == 0 else 0)


@claim("(39)", "abc", "A roots")
def symmetric_functions_of_the_roots(o: PaperObjects) -> Pairs:
    """The coefficients of chi follow from traces of powers of A (Newton's identities with half the traces)
    a, b, c elementary symmetric: chi = t^3 - a t^2 + b t - c"""
    one_half = o.number(1, 2)
    sums = [o.trace(o.A_to(k)) * one_half for k in range(1, o.m + 1)]
    symmetric_functions = [o.K.one]
    for k in range(1, o.m + 1):
        total = o.K.zero
        for j in range(1, k + 1):
            total = total + symmetric_functions[k - j] * sums[j - 1] * o.number(1 if j % 2 else -1)
        symmetric_functions.append(total * o.number(1, k))
    for k in range(o.m + 1):
        yield o.chi_of_roots[o.m - k], symmetric_functions[k] * o.number(1 if k % 2 == 0 else -1)


@claim("(40)", "B constr", "B")
def interpolation(o: PaperObjects) -> Pairs:
    """The interpolation polynomials have these values
    B_i(lambda_i) = -1, B_i(lambda_j) = 1"""
    for i in o.tested_indices:
        for j in o.each:
            value = o.K.zero
            for coefficient in reversed(o.lagrange(i)):
                value = value * o.lam[j] + coefficient
            yield value, o.number(-1 if i == j else 1)


@claim("(41)-(43)", "alpha", "B", only_m=3)
def lagrange_coefficients(o: PaperObjects) -> Pairs:
    """The eigenvalues determine the coefficients alpha, beta, gamma
    alpha_i = (lambda_i^2 - b)/((l_i - l_j)(l_i - l_k)), ..."""
    b = o.chi[1]
    for i in o.tested_indices:
        j, k = (other for other in o.each if other != i)
        li, lj, lk = o.lam[i], o.lam[j], o.lam[k]
        denominator = (li - lj) * (li - lk)
        alpha, beta, gamma = o.lagrange(i)
        yield alpha, (li * li - b) / denominator
        yield beta, o.number(2) * (lj + lk) / denominator
        yield gamma, o.number(-2) / denominator


@claim("(41)-(43)", "alpha", "B")
def lagrange_coefficients_for_every_m(o: PaperObjects) -> Pairs:
    """For every m the coefficients are given by Horner's polynomials C_k of chi
    coefficient k of B_i = delta_k0 - 2 C_k(lambda_i)/chi'(lambda_i)"""
    for i in o.tested_indices:
        slope, C = o.K.zero, [o.K.zero] * o.m
        for k in range(o.m - 1, -1, -1):  # C_{m-1} = 1, C_{k-1} = t C_k + c_k
            C[k] = o.K.one if k == o.m - 1 else o.lam[i] * C[k + 1] + o.chi[k + 1]
        for k in range(o.m, 0, -1):
            slope = slope * o.lam[i] + o.chi[k] * o.number(k)
        for k in range(o.m):
            yield o.lagrange(i)[k], o.number(1 if k == 0 else 0) - o.number(2) * C[k] / slope


@claim("(44)", "", "B", only_m=3)
def products_of_matrices(o: PaperObjects) -> Pairs:
    """The B_i have these products for m = 3
    B_1 B_2 = B_2 B_1 = -B_3, and cyclic"""
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        yield o.B(i) * o.B(j), -o.B(k)
        yield o.B(j) * o.B(i), -o.B(k)


@claim("(44)", "", "roots A", least_m=2)
def products_of_matrices_for_every_m(o: PaperObjects) -> Pairs:
    """The B_i have these products for every m; for m = 3 the right-hand side is -B_k by (37)
    B_i B_j = B_i + B_j - I (i != j)"""
    for i in o.tested_indices:
        for j in o.each:
            if i != j:
                yield o.B(i) * o.B(j), o.B(i) + o.B(j) - o.I


@claim("(45)", "assoc triple", "B", only_m=3)
def fields_associated_to_an_associated_one(o: PaperObjects) -> Pairs:
    """These three fields are associated to g_i for m = 3
    B_1^T g_1 = f_0, B_2^T g_1 = -g_3, B_3^T g_1 = -g_2"""
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        g = o.value(o.g_i(i), o.x)
        yield o.B(i).transpose() * g, o.fx
        yield o.B(j).transpose() * g, -o.value(o.g_i(k), o.x)
        yield o.B(k).transpose() * g, -o.value(o.g_i(j), o.x)


@claim("Lemma 8 (46)", "f'f' thru B", "H B")
def square_of_the_jacobian(o: PaperObjects) -> Pairs:
    """The square of the Jacobi matrix is a combination of I and the B_i^T
    f_0'^2 = p_0 I + sum q_i B_i^T"""
    right = o.I * o.p0(o.x)
    for i in o.each:
        right = right + o.B(i).transpose() * o.q(i, o.x)
    yield o.df * o.df, right


@claim("(47)", "p0", "H f")
def trace_part(o: PaperObjects) -> Pairs:
    """f_0'^2 is a multiple of the identity on each eigenspace of A^T; p_0 is (4-m)/4 times the sum of the factors
    p_0 = (4-m)/8 tr f_0'^2"""
    for i in o.tested_indices:
        E = o.projector(i).transpose()
        yield o.df * o.df * E, E * o.eigenvalue_of_square(i, o.x)
    yield o.p0(o.x), o.sum([o.eigenvalue_of_square(i, o.x) for i in o.each]) * o.number(4 - o.m, 4)


@claim("(48)", "qi", "f")
def mixed_traces(o: PaperObjects) -> Pairs:
    """The two forms of q_i agree
    q_i = 1/8 tr (B_i^T f_0'^2) = 1/8 tr (f_0' g_i')"""
    for i in o.tested_indices:
        yield o.q(i, o.x), o.trace(o.df * o.jac(o.g_i(i), o.x)) * o.number(1, 8)


@claim("Lemma 8 (49)", "char pol f'-g'", "f roots")
def characteristic_polynomial_of_the_difference(o: PaperObjects) -> Pairs:
    """f_0' - g_i' has rank 2
    det(t I - (f_0'-g_i')) = t^{2m} - 1/2 t^{2m-2} tr (f_0'-g_i')^2"""
    t = o.scalar("t")
    for i in o.tested_indices:
        difference = o.df - o.jac(o.g_i(i), o.x)
        t_power = o.K.one
        for _ in range(2 * o.m - 2):
            t_power = t_power * t
        right = t_power * (t * t - o.trace(difference * difference) * o.number(1, 2))
        yield o.det(o.I * t - difference), right
        yield difference, (o.I - o.B(i).transpose()) * o.df


@claim("Lemma 8 (50)", "pol f'-g'", "f roots")
def cayley_hamilton(o: PaperObjects) -> Pairs:
    """f_0' - g_i' satisfies its characteristic equation (Cayley-Hamilton)
    (f_0'-g_i')^{2m} - 1/2 (f_0'-g_i')^{2m-2} tr (f_0'-g_i')^2 = 0"""
    for i in o.tested_indices:
        difference = o.df - o.jac(o.g_i(i), o.x)
        square = difference * difference
        power = o.power(square, o.m - 1)
        yield power * square, power * (o.trace(square) * o.number(1, 2))


@claim("Lemma 8, proof", "", "H B", only_m=3)
def sixth_powers(o: PaperObjects) -> Pairs:
    """(50) implies this equation and, after division by f'^4, the next one
    32 f'^6 - 32 B_i^T f'^6 - (8 f'^4 - 8 B_i^T f'^4)(tr f'^2 - tr B_i^T f'^2) = 0"""
    square = o.df * o.df
    fourth_power = square * square
    for i in o.tested_indices:
        difference = o.I - o.B(i).transpose()
        traces = o.trace(square) - o.trace(o.B(i).transpose() * square)
        yield difference * (fourth_power * square) * o.number(32), difference * fourth_power * (o.number(8) * traces)
        yield difference * square * o.number(32), difference * (o.number(8) * traces)


@claim("Lemma 8, proof", "", "H B")
def sum_of_the_squares(o: PaperObjects) -> Pairs:
    """The sum over i is equivalent to (46); for m = 3 it is as printed
    64 f'^2 - 8(4-m) tr(f'^2) I - 8 sum tr(B_i^T f'^2) B_i^T = 0"""
    square = o.df * o.df
    right = o.I * (o.number(8 * (4 - o.m)) * o.trace(square))
    for i in o.each:
        B = o.B(i).transpose()
        right = right + B * (o.number(8) * o.trace(B * square))
    yield square * o.number(64), right
