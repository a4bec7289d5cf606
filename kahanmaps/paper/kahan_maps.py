"""Section 2: the discretization of any quadratic system; of Hamiltonian ones, an integral and a measure.

The properties of any quadratic system are tried on the homogeneous f = J nabla H and on an inhomogeneous one.
"""

from __future__ import annotations

from kahanmaps.paper.objects import PaperObjects
from kahanmaps.paper.registry import Pairs, claim


@claim("(5)", "eq: Kahan gen", "(x~ - x)/(2 eps) = Q(x,x~) + B(x + x~)/2 + c", breaks=("eps", "map"), blockwise=True)
def defining_equation(o: PaperObjects) -> Pairs:
    """The map solves Kahan's equation with step 2 eps"""
    for system in (o, o.inhomogeneous()):
        x_tilde = system.step(system.f, o.x)
        right = o.K.column(system.f.polarised(o.x.entries(), x_tilde.entries()))
        yield x_tilde - o.x, right * (o.eps * o.number(2))


@claim("Sect. 2", "", "Q(x,x~) = (Q(x + x~) - Q(x) - Q(x~))/2", breaks=("inhomogeneous",), blockwise=True)
def polarisation(o: PaperObjects) -> Pairs:
    """Q(x,x~) is the symmetric bilinear form of the quadratic form Q"""
    y = o.vector("y")
    whole = o.value(o.f, o.x + y) - o.value(o.f, o.x) - o.value(o.f, y)
    yield o.K.column(o.f.polarised(o.x.entries(), y.entries())) * o.number(2), whole


@claim("Sect. 2", "", "x~ = x + 2 eps f + 2 eps^2 f'f + O(eps^3)", breaks=("eps", "map"), blockwise=True)
def second_order(o: PaperObjects) -> Pairs:
    """The map approximates the time 2 eps shift along solutions, to second order, with this remainder"""
    for system in (o, o.inhomogeneous()):
        f = system.f
        fx, df = o.value(f, o.x), o.jac(f, o.x)
        rest = o.solve(o.minus_eps_jac(f, o.x), df * (df * fx))
        series = o.x + fx * (o.number(2) * o.eps) + df * fx * (o.number(2) * o.eps * o.eps)
        yield system.step(f, o.x), series + rest * (o.number(2) * o.eps * o.eps * o.eps)


@claim("(6)", "eq: reversible", "Phi_f^{-1}(x, eps) = Phi_f(x, -eps)", breaks=("map",), blockwise=True)
def reversibility(o: PaperObjects) -> Pairs:
    """The map with -eps undoes the map with eps"""
    for system in (o, o.inhomogeneous()):
        yield system.step(system.f, system.step(system.f, o.x), times=-1), o.x


@claim("(7)", "eq: Phi gen", "x~ = x + 2 eps (I - eps f')^{-1} f", breaks=("eps", "map"), blockwise=True)
def explicit_form(o: PaperObjects) -> Pairs:
    """The explicit form of the map"""
    for system in (o, o.inhomogeneous()):
        f = system.f
        increment = o.solve(o.minus_eps_jac(f, o.x), o.value(f, o.x))
        yield system.step(f, o.x), o.x + increment * (o.number(2) * o.eps)


@claim("(8)", "eq: Phi hom", "x~ = (I - eps f'(x))^{-1} x", breaks=("eps", "inhomogeneous"), blockwise=True)
def homogeneous_form(o: PaperObjects) -> Pairs:
    """The explicit form for homogeneous f"""
    yield o.x_tilde, o.solve(o.minus_eps_jac(o.f, o.x), o.x)


@claim(
    "(9)",
    "eq: Phi hom alt",
    "x = (I + eps f'(x~))^{-1} x~,  x~ = (I + eps f'(x~)) x",
    breaks=("eps", "inhomogeneous"),
    blockwise=True,
)
def homogeneous_form_backwards(o: PaperObjects) -> Pairs:
    """The form of the inverse for homogeneous f, and x~ through f'(x~)"""
    matrix = o.plus_eps_jac(o.f, o.x_tilde)
    yield o.x, o.solve(matrix, o.x_tilde)
    yield o.x_tilde, matrix * o.x


@claim("(10)", "Jac", "dPhi_f = (I - eps f'(x))^{-1} (I + eps f'(x~))", breaks=("eps", "map"), blockwise=True)
def jacobi_matrix_of_the_map(o: PaperObjects) -> Pairs:
    """The Jacobi matrix of the map"""
    v = o.vector("v")
    for system in (o, o.inhomogeneous()):
        x_tilde = system.step(system.f, o.x)
        right = o.solve(o.minus_eps_jac(system.f, o.x), o.plus_eps_jac(system.f, x_tilde) * v)
        for k in range(o.n):
            yield system.slope(lambda o, x: o.step(o.f, x)[k, 0], o.x, v), right[k, 0]


@claim(
    "(11)",
    "eq: CMOQ integral",
    "x^T J^{-1} x~/(6 eps) = H + (2 eps/3) nabla H^T (I - eps f')^{-1} f",
    breaks=("f", "eps", "inhomogeneous"),
    blockwise=True,
)
def two_forms_of_the_integral(o: PaperObjects) -> Pairs:
    """Both forms of the integral of a Hamiltonian system agree (homogeneous H)"""
    yield o.dot(o.x, o.solve(o.J, o.x_tilde)) / (o.number(6) * o.eps), o.modified_H(o.x)


@claim(
    "(11)",
    "eq: CMOQ integral",
    "x^T J^{-1} x~/(6 eps) = H + (2 eps/3) nabla H^T (I - eps f')^{-1} f for any cubic H",
    breaks=(),
    misprint="as printed, for arbitrary cubic H, the first form is not the second: it needs H homogeneous (and J "
    "invertible)",
)
def two_forms_of_the_integral_for_any_cubic(o: PaperObjects) -> Pairs:
    """Both forms of the integral agree for an arbitrary cubic Hamilton function"""
    yield from two_forms_of_the_integral(o.inhomogeneous())


@claim(
    "(11)",
    "eq: CMOQ integral",
    "H + (2 eps/3) nabla H^T (I - eps f')^{-1} f is conserved",
    breaks=("f", "eps"),
    blockwise=True,
)
def integral_of_any_cubic_hamiltonian(o: PaperObjects) -> Pairs:
    """The second form is an integral for every cubic H, homogeneous or not"""
    for system in (o, o.inhomogeneous()):
        yield system.modified_H(system.step(system.f, o.x)), system.modified_H(o.x)


@claim("(12)", "eq: CMOQ measure", "dx/det(I - eps f') is invariant", breaks=("f", "map"), blockwise=True)
def invariant_measure(o: PaperObjects) -> Pairs:
    """The map of a Hamiltonian system has an invariant measure"""
    for system in (o, o.inhomogeneous()):
        x_tilde = system.step(system.f, o.x)
        before, after = o.minus_eps_jac(system.f, o.x), o.minus_eps_jac(system.f, x_tilde)
        yield o.det(system.jacobian_of_step(system.f, o.x)) * o.det(before), o.det(after)


@claim(
    "Sect. 2",
    "",
    "n = 2: dPhi J dPhi^T det(I - eps f'(x)) = det(I - eps f'(x~)) J",
    only_m=1,
    breaks=("f", "map"),
)
def measure_means_symplectic_in_the_plane(o: PaperObjects) -> Pairs:
    """In the plane an invariant measure is the same as symplecticity"""
    jacobian = o.jacobian_of_step(o.f, o.x)
    left = jacobian * o.J * jacobian.transpose() * o.det(o.minus_eps_jac(o.f, o.x))
    yield left, o.J * o.det(o.minus_eps_jac(o.f, o.x_tilde))
