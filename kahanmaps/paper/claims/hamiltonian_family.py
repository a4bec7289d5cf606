"""Section 3: skew-Hamiltonian A, the cubics that belong to it, and their involution."""

from __future__ import annotations

from math import comb

from kahanmaps.paper.objects import PaperObjects
from kahanmaps.paper.registry import ClaimKind, Pairs, claim


@claim(
    "Sect. 3",
    "",
    only_m=3,
    symplectic=False,
    misprint="the indices belong to different dimensions; with J of (13) it is {x1,x4} = {x2,x5} = {x3,x6} = 1",
)
def brackets_as_printed(o: PaperObjects) -> Pairs:
    """The coordinate functions have these brackets, as printed
    {x1,x3} = {x2,x4} = {x3,x6} = 1"""
    for i, j in ((0, 2), (1, 3), (2, 5)):
        yield o.dot(o.unit(i), o.J * o.unit(j)), o.K.one


@claim("Sect. 3", "", "J", symplectic=False)
def brackets(o: PaperObjects) -> Pairs:
    """The coordinate functions have these brackets, as corrected: {x1,x4} = {x2,x5} = {x3,x6} = 1 for m = 3
    {x_i, x_{m+i}} = 1, all others 0"""
    for i in range(o.n):
        for j in range(o.n):
            expected = 1 if j == i + o.m else -1 if i == j + o.m else 0
            yield o.dot(o.unit(i), o.J * o.unit(j)), o.number(expected)


@claim("(13)", "Ham", "f J")
def equations_of_motion(o: PaperObjects) -> Pairs:
    """The Hamiltonian system is x' = J nabla H_0
    x_i' = dH/dx_{m+i}, x_{m+i}' = -dH/dx_i"""
    gradient = o.gradient(lambda o, x: o.H(x), o.x)
    for i in range(o.m):
        yield o.fx[i, 0], gradient[o.m + i, 0]
        yield o.fx[o.m + i, 0], -gradient[i, 0]


@claim("(14), (15)", "grad K", "H", least_m=2, pairwise=True)
def gradients_of_the_chain(o: PaperObjects) -> Pairs:
    """The gradients of H_1 and, for m > 2, H_2 follow from that of H_0
    nabla H_1 = A nabla H_0, nabla H_2 = A nabla H_1"""
    for i in range(1, min(o.m, 3)):
        yield o.gradient_of_chain(i, o.x), o.A * o.gradient_of_chain(i - 1, o.x)


@claim("Prop. 1 (16)", "cond A", "A J", symplectic=False)
def skew_hamiltonian(o: PaperObjects) -> Pairs:
    """A is skew-Hamiltonian
    A^T J = J A"""
    yield o.AT * o.J, o.J * o.A


@claim("Prop. 1", "", "A J", least_m=2)
def involution(o: PaperObjects) -> Pairs:
    """H_0, ..., H_{m-1} are pairwise in involution
    {H_i, H_j} = 0"""
    gradient_0, gradient_1 = o.gradient_of_chain(0, o.x), o.gradient_of_chain(1, o.x)
    yield o.dot(gradient_0, o.J * gradient_1), o.dot(gradient_0, o.J * (o.A * gradient_0))
    for i in range(o.m):
        for j in range(i):
            yield o.dot(o.gradient_of_chain(i, o.x), o.J * o.gradient_of_chain(j, o.x)), o.K.zero


@claim("Prop. 1, proof", "", "A J", blockwise=True)
def reasons_for_involution(o: PaperObjects) -> Pairs:
    """J A is skew-symmetric, and A^2 satisfies the condition on A as well
    JA skew;  (A^T)^2 J = A^T J A = J A^2"""
    JA = o.J * o.A
    yield JA.transpose(), -JA
    w = o.vector("w")  # an arbitrary vector in place of nabla H_0
    yield o.dot(w, JA * w), o.K.zero
    yield o.dot(o.A * w, o.J * (o.A * (o.A * w))), o.K.zero
    yield o.AT * o.AT * o.J, o.AT * o.J * o.A
    yield o.AT * o.J * o.A, o.J * o.A * o.A


@claim(
    "Prop. 1, proof",
    "",
    only_m=3,
    kind=ClaimKind.ATTAINED,
    distinct_roots=True,
    misprint="a non-scalar A may have a minimal polynomial of degree 2 (here A := B_1), and then H_2 is a combination "
    "of H_0 and H_1; what is needed is a minimal polynomial of degree 3",
)
def independence_for_non_scalar_A(o: PaperObjects) -> Pairs:
    """A non-scalar A ensures that the gradients are independent, generically
    A non-scalar => nabla H_0, nabla H_1, nabla H_2 independent"""
    B = o.B(0)
    yield o.rank(o.columns([o.grad(o.x), B * o.grad(o.x), B * (B * o.grad(o.x))])), 3


@claim("Prop. 1, proof", "", "repeated H0", in_general=True, at_most="there are m of them", distinct_roots=True)
def independence_for_cyclic_A(o: PaperObjects) -> Pairs:
    """The gradients are independent, generically, if the minimal polynomial of A has degree m
    minimal polynomial of degree m => nabla H_i independent"""
    powers = [o.A_to(i).entries() for i in range(o.m)]
    yield o.rank(o.K.matrix(o.m, o.n * o.n, [entry for power in powers for entry in power])), o.m
    yield o.rank(o.columns([o.grad(o.x, i) for i in range(o.m)])), o.m


@claim("(17)", "cond2", "A", symplectic=False)
def blocks(o: PaperObjects) -> Pairs:
    """The blocks of a skew-Hamiltonian matrix satisfy these relations
    A_1^T = A_4, A_2^T = -A_2, A_3^T = -A_3"""
    m = o.m
    for i in range(m):
        for j in range(m):
            yield o.A[j, i], o.A[m + i, m + j]
            yield o.A[j, m + i], -o.A[i, m + j]
            yield o.A[m + j, i], -o.A[m + i, j]


@claim("(18)", "A elem", "A", only_m=3, symplectic=False)
def matrix_written_out(o: PaperObjects) -> Pairs:
    """The 15 parameters of A are the entries where the paper writes them
    A with entries a_1, ..., a_15"""
    A, zero = o.A, o.K.zero
    a = [zero, *(A[i, j] for i in range(3) for j in range(3))]
    a += [-A[0, 4], -A[0, 5], -A[1, 5], A[3, 1], A[3, 2], A[4, 2]]
    rows = [
        [a[1], a[2], a[3], zero, -a[10], -a[11]],
        [a[4], a[5], a[6], a[10], zero, -a[12]],
        [a[7], a[8], a[9], a[11], a[12], zero],
        [zero, a[13], a[14], a[1], a[4], a[7]],
        [-a[13], zero, a[15], a[2], a[5], a[8]],
        [-a[14], -a[15], zero, a[3], a[6], a[9]],
    ]
    yield A, o.K.matrix(6, 6, [entry for row in rows for entry in row])


@claim("(19)", "d2H", "H A", symplectic=False)
def solvability(o: PaperObjects) -> Pairs:
    """The condition for solvability holds for H_0 and is passed on to every H_i
    A nabla^2 H_i = nabla^2 H_i A^T, i = 0..m-1

    It is necessary and sufficient: the curl of A nabla H is A nabla^2 H - nabla^2 H A^T for the cube H of any linear
    form, and so for any cubic H.
    """
    for i in range(o.m):
        yield o.A * o.hess(o.x, i), o.hess(o.x, i) * o.AT
    u, v, w = o.vector("u"), o.vector("v"), o.vector("w")
    hessian = u * u.transpose() * (o.number(6) * o.dot(u, o.x))
    # The gradient 3 (u x)^2 u has the derivative 6 (u x)(u v) u along v.
    curl = o.number(6) * o.dot(u, o.x) * (o.dot(u, v) * o.dot(w, o.A * u) - o.dot(u, w) * o.dot(v, o.A * u))
    yield curl, o.dot(w, (o.A * hessian - hessian * o.AT) * v)


@claim("Sect. 3", "", "H", least_m=2)
def solvability_backwards(o: PaperObjects) -> Pairs:
    """H_1 satisfies the condition with the inverse of A (for a singular A: of A + c I, which has the same space)
    A^{-1} nabla^2 H_1 = nabla^2 H_1 (A^{-1})^T"""
    A, shift = o.A, 0
    while o.K.is_zero(o.det(A)):
        shift += 1
        A = o.A + o.I * o.number(shift)
    inverse, hessian = o.inverse(A), A * o.hess(o.x)
    yield inverse * hessian, hessian * inverse.transpose()
    yield A * hessian, hessian * A.transpose()


@claim(
    "Prop. 2, proof",
    "",
    "repeated A",
    at_most="the 3m quadratic forms on the eigenspaces solve them",
    distinct_roots=True,
)
def independent_equations(o: PaperObjects) -> Pairs:
    """Of the m(2m-1) scalar equations C_i = 0 only 2m(m-1) are independent: 12 of 15 for m = 3
    A X = X A^T: 2m(m-1) independent equations of m(2m-1)"""
    n = o.n
    columns = []
    for a in range(n):
        for b in range(a, n):
            X = o.K.matrix(
                n, n, [o.K.one if (i, j) in ((a, b), (b, a)) else o.K.zero for i in range(n) for j in range(n)]
            )
            C = o.A * X - X * o.AT
            columns.append([C[i, j] for i in range(n) for j in range(i + 1, n)])
    rank = o.rank(o.K.matrix(len(columns), len(columns[0]), [entry for column in columns for entry in column]))
    yield len(columns[0]), o.m * (2 * o.m - 1)
    yield rank, 2 * o.m * (o.m - 1)


@claim(
    "Prop. 2",
    "",
    only_m=3,
    kind=ClaimKind.ATTAINED,
    distinct_roots=True,
    misprint="stated for any A of the kind; its minimal polynomial has to have degree 3. With lambda_1 := lambda_2 (A "
    "diagonalisable) the dimension is 24",
)
def dimension_of_the_cubics_for_any_A(o: PaperObjects) -> Pairs:
    """The cubics of A form a space of dimension 12, without a condition on the roots
    dim of the cubics = 4m for any skew-Hamiltonian A"""
    derogatory_objects = o.replace(A=o.A + o.projector(0) * (o.lam[1] - o.lam[0]))
    yield comb(o.n + 2, 3) - derogatory_objects.rank_of_cubic_equations(), 4 * o.m


@claim("Prop. 2", "", "repeated A", at_most="the 4m cubics on the eigenspaces solve them", distinct_roots=True)
def dimension_of_the_cubics(o: PaperObjects) -> Pairs:
    """The cubics of A form a space of dimension 4m: 12 = 56 - 44 for m = 3
    dim of the cubics = 4m, rank of the system C(2m+2,3) - 4m"""
    unknowns = comb(o.n + 2, 3)
    rank = o.rank_of_cubic_equations()
    yield unknowns - rank, 4 * o.m
    yield rank, unknowns - 4 * o.m
