"""Abstract and Section 1: the results that the paper announces, each in a form that can be tested."""

from __future__ import annotations

from kahanmaps.paper.objects import PaperObjects
from kahanmaps.paper.registry import ClaimKind, Pairs, claim


@claim("(1)", "skew", "J", at_most="the block form (17) has m(2m-1) parameters", symplectic=False)
def dimension_of_skew_hamiltonian_matrices(o: PaperObjects) -> Pairs:
    """Skew-Hamiltonian matrices form a space of dimension m(2m-1)
    dim { A : A^T J = J A } = m(2m-1)"""
    n = o.n
    columns = []
    for k in range(n * n):
        E = o.K.matrix(n, n, [o.K.one if k == j else o.K.zero for j in range(n * n)])
        columns.append((E.transpose() * o.J - o.J * E).entries())
    rank = o.rank(o.K.matrix(n * n, n * n, [entry for column in columns for entry in column]))
    yield n * n - rank, o.m * (2 * o.m - 1)
    yield o.is_standard(o.J), True


@claim("(2)", "harm", "H A", symplectic=False)
def matrix_differential_equation(o: PaperObjects) -> Pairs:
    """H satisfies the system of second order linear PDEs of A
    A nabla^2 H = nabla^2 H A^T"""
    yield o.A * o.hess(o.x), o.hess(o.x) * o.AT


@claim("(3)", "CR", "H", least_m=2, pairwise=True)
def chain_of_gradients(o: PaperObjects) -> Pairs:
    """H_0, ..., H_{m-1} form a chain of gradients
    nabla H_i = A nabla H_{i-1}, i = 1..m-1"""
    for i in range(1, o.m):
        yield o.gradient_of_chain(i, o.x), o.A * o.gradient_of_chain(i - 1, o.x)


@claim("Sect. 1", "", "repeated H0", in_general=True, at_most="there are m of them", distinct_roots=True)
def hamiltonians_are_independent(o: PaperObjects) -> Pairs:
    """H_0, ..., H_{m-1} are functionally independent
    rank(nabla H_0, ..., nabla H_{m-1}) = m"""
    yield o.rank(o.columns([o.grad(o.x, i) for i in range(o.m)])), o.m


@claim("Sect. 1", "", "H f inhomogeneous", blockwise=True, certified="H{}")
def perturbed_hamiltonians_are_conserved(o: PaperObjects) -> Pairs:
    """The map of f_0 has integrals H~_0, ..., H~_{m-1}, perturbations of the H_i
    H~_i = eps^{-1} x^T J (A^T)^i x~ is conserved"""
    for i in range(o.m):
        yield o.H_tilde_(i, o.x_tilde), o.H_tilde_(i, o.x)


@claim("Sect. 1", "", "eps inhomogeneous", blockwise=True)
def perturbed_hamiltonians_tend_to_the_hamiltonians(o: PaperObjects) -> Pairs:
    """H~_i is a perturbation of -6 H_i: their difference is eps^2 times a function regular at eps = 0
    H~_i = -6 H_i + O(eps^2)"""
    for i in range(o.m):
        correction = o.solve(o.one_minus_square(o.f, o.x), o.df * (o.df * o.fx))
        remainder = o.dot(o.x, o.J * (o.power(o.AT, i) * correction)) * o.number(2)
        yield o.H_tilde_(i, o.x), o.H(o.x, i) * o.number(-6) + remainder * (o.eps * o.eps)


@claim("Sect. 1", "", "H A", least_m=2, pairwise=True)
def chain_of_perturbed_gradients(o: PaperObjects) -> Pairs:
    """The integrals H~_i are related by the same equation as the H_i
    nabla H~_i = A nabla H~_{i-1}"""
    v = o.vector("v")
    for i in range(1, o.m):
        left = o.slope(lambda o, x: o.H_tilde_(i, x), o.x, v)
        yield left, o.slope(lambda o, x: o.H_tilde_(i - 1, x), o.x, o.AT * v)


@claim("Sect. 1", "", "H A", pairwise=True)
def matrix_differential_equation_of_perturbed_hamiltonians(o: PaperObjects) -> Pairs:
    """The integrals H~_i satisfy the same second order differential equations as the H_i
    A nabla^2 H~_i = nabla^2 H~_i A^T"""
    v, w = o.vector("v"), o.vector("w")
    for i in range(o.m):
        left = o.second_slope(lambda o, x: o.H_tilde_(i, x), o.x, o.AT * v, w)
        yield left, o.second_slope(lambda o, x: o.H_tilde_(i, x), o.x, v, o.AT * w)


@claim("Sect. 1", "", "repeated H0", in_general=True, at_most="there are m of them", distinct_roots=True)
def perturbed_hamiltonians_are_independent(o: PaperObjects) -> Pairs:
    """The map possesses m functionally independent integrals
    rank(nabla H~_0, ..., nabla H~_{m-1}) = m"""
    yield o.rank(o.columns([o.gradient(lambda o, x: o.H_tilde_(i, x), o.x) for i in range(o.m)])), o.m


@claim("Sect. 1", "", "A=B", kind=ClaimKind.DIFFERENT, least_m=2, in_general=True, distinct_roots=True)
def maps_of_the_chain_do_not_commute(o: PaperObjects) -> Pairs:
    """In general the maps of J nabla H_0 and J nabla H_1 do not commute
    Phi_{f_0} o Phi_{f_1} != Phi_{f_1} o Phi_{f_0}"""
    f, g = o.f, o.f_i(1)
    yield o.step(g, o.step(f, o.x)), o.step(f, o.step(g, o.x))


@claim("Sect. 1", "", "J A", least_m=2, blockwise=True)
def combination_of_the_vector_fields(o: PaperObjects) -> Pairs:
    """A linear combination of the J nabla H_i is J B nabla H_0 = B^T J nabla H_0 with B a polynomial in A
    JB nabla H_0 = B^T J nabla H_0"""
    for B in o.associates():
        yield o.J * (B * o.grad(o.x)), B.transpose() * (o.J * o.grad(o.x))


@claim("Sect. 1", "", "B")
def signs_at_the_eigenvalues(o: PaperObjects) -> Pairs:
    """B^2 = I says that B(lambda) sends each eigenvalue of A to 1 or -1
    B(lambda_i)^2 = 1 for all i  <=>  B^2 = I

    Any polynomial b has b(A) E_i = b(lambda_i) E_i with the projectors E_i, which are not 0 and add up to I; so
    b(A)^2 = I if and only if b(lambda_i)^2 = 1 for all i.
    """
    coefficients = [o.vector("b")[k, 0] for k in range(o.m)]
    polynomial = o.polynomial_in_A(coefficients)
    for i in o.each:
        value = o.K.zero
        for coefficient in reversed(coefficients):
            value = value * o.lam[i] + coefficient
        yield polynomial * o.projector(i), o.projector(i) * value
    yield o.sum([o.projector(i) for i in o.each]), o.I
    for signs in o.all_signs():
        B = o.B_signs(signs)
        yield B * B, o.I
        for i in o.each:
            # B(A) = B(lambda_i) on the eigenspace of lambda_i, which is the image of prod_{j != i} (A - lambda_j).
            projector_multiple = o.I
            for j in o.each:
                if j != i:
                    projector_multiple = projector_multiple * (o.A - o.I * o.lam[j])
            yield B * projector_multiple, projector_multiple * o.number(signs[i])


@claim("Sect. 1", "", "B=I", kind=ClaimKind.DIFFERENT, in_general=True, least_m=2)
def associated_fields_are_pairwise_different(o: PaperObjects) -> Pairs:
    """The class of J nabla H_0 consists of 2^{m-1} vector fields, up to sign
    #{ J B_s nabla H_0 } = 2^{m-1} up to sign

    g_s - g_t and g_s + g_t are sums, with signs and a factor 2, of the parts of f in those eigenspaces where s and t
    differ, or agree; so all are different, up to sign, if no part of f vanishes, that is, if g_i != f for all i.
    """
    for i in o.each:
        yield o.value(o.g_i(i), o.x), o.fx


@claim(
    "Sect. 1",
    "",
    "B=I",
    in_general=True,
    at_most="B_s is a combination of I, A, ..., A^(m-1)",
    least_m=3,
    distinct_roots=True,
)
def independent_associated_fields(o: PaperObjects) -> Pairs:
    """If m > 2, the class contains m linearly independent vector fields
    rank { J B_s nabla H_0 } = m"""
    yield o.rank(o.columns([o.fx, *(o.value(o.g(B), o.x) for B in o.associates())])), o.m


@claim("Sect. 1", "", "B=I", at_most="it is counted up to m only", in_general=True, least_m=3, distinct_roots=True)
def independent_maps(o: PaperObjects) -> Pairs:
    """If m > 2, the class contains m independent maps
    rank { Phi_{f_s}(x) - x } >= m"""
    displacements = [o.x_tilde - o.x, *(o.step(o.g(B), o.x) - o.x for B in o.associates())]
    rank = o.rank(o.columns(displacements))
    yield min(rank, o.m), o.m


@claim("Abstract", "", "H J", pairwise=True)
def integrals_are_in_involution(o: PaperObjects) -> Pairs:
    """The integrals are in involution with respect to the invariant symplectic structure
    {K~_i, K~_j} = 0 for the bracket of Pi"""
    gradients = [o.gradient(lambda o, x: o.H_tilde(x), o.x)]
    gradients += [o.gradient(lambda o, x: o.integral(o.g_i(i), x), o.x) for i in o.each]
    for k, gradient_1 in enumerate(gradients):
        for gradient_2 in gradients[:k]:
            yield o.dot(gradient_1, o.Pi(o.x) * gradient_2), o.K.zero
