"""Section 2: the discretization of any quadratic system, and its integral and measure for Hamiltonian systems.

The claims are tested on the homogeneous f = J nabla H and on an inhomogeneous field. Claims about any system, or any
Hamiltonian system, are also tested on random systems without further structure.
"""

from __future__ import annotations

from kahanmaps.paper import formal_proofs
from kahanmaps.paper.objects import PaperObjects
from kahanmaps.paper.registry import Pairs, claim


@claim("(4)", "eq: diff eq gen", "f''")
def derivatives_of_the_system(o: PaperObjects) -> Pairs:
    """f', f'', nabla H and nabla^2 H are the derivatives of f and H, for any quadratic f and cubic H
    f = Q + Bx + c, f' and f'' its derivatives, nabla^2 H that of nabla H"""
    v, w = o.vector("v"), o.vector("w")
    p = o.inhomogeneous()
    for k in range(o.n):
        yield p.slope(lambda p, x: p.value(p.f, x)[k, 0], p.x, v), (p.jac(p.f, p.x) * v)[k, 0]
    yield p.jac(p.f, p.x + v), p.jac(p.f, p.x) + p.second(p.f, v)
    yield p.slope(lambda p, x: p.H(x), p.x, v), o.dot(v, p.grad(p.x))
    yield p.second_slope(lambda p, x: p.H(x), p.x, v, w), o.dot(v, p.hess(p.x) * w)


@claim("(5)-(7)", "eq: Kahan gen", "map", symplectic=False, formal=formal_proofs.map_of_any_quadratic_system)
def any_quadratic_system(o: PaperObjects) -> Pairs:
    """Every quadratic system satisfies Kahan's equation, the explicit form of the map and reversibility
    Kahan's equation, its solution and its inverse, for any quadratic f"""
    f = o.arbitrary_system()
    x_tilde = o.step(f, o.x)
    right = o.K.column(f.polarised(o.x.entries(), x_tilde.entries()))
    yield x_tilde - o.x, right * (o.eps * o.number(2))
    increment = o.solve(o.minus_eps_jac(f, o.x), o.value(f, o.x))
    yield x_tilde, o.x + increment * (o.number(2) * o.eps)
    yield o.step(f, x_tilde, times=-1), o.x


@claim("(8), (9)", "eq: Phi hom", "map eps", symplectic=False, formal=formal_proofs.map_of_any_homogeneous_system)
def any_homogeneous_system(o: PaperObjects) -> Pairs:
    """The map of every homogeneous quadratic system has both homogeneous forms
    x~ = (I - eps f'(x))^{-1} x = (I + eps f'(x~)) x, for any homogeneous f"""
    f = o.arbitrary_system(is_homogeneous=True)
    x_tilde = o.step(f, o.x)
    yield x_tilde, o.solve(o.minus_eps_jac(f, o.x), o.x)
    yield x_tilde, o.plus_eps_jac(f, x_tilde) * o.x


@claim("(10)", "Jac", "map eps", symplectic=False, formal=formal_proofs.jacobian_of_any_map)
def jacobi_matrix_of_any_map(o: PaperObjects) -> Pairs:
    """The Jacobi matrix of the map has this form for every quadratic system
    dPhi_f = (I - eps f'(x))^{-1} (I + eps f'(x~)), for any quadratic f"""
    f, v = o.arbitrary_system(), o.vector("v")
    x_tilde = o.step(f, o.x)
    dx_tilde = o.jacobian_of_step(f, o.x) * v
    yield dx_tilde, o.solve(o.minus_eps_jac(f, o.x), o.plus_eps_jac(f, x_tilde) * v)
    # The derivative of x~ along v solves the derivative of the defining equation at (x, x~) along v.
    right = (o.jac(f, x_tilde) * v + o.jac(f, o.x) * dx_tilde) * o.eps
    yield dx_tilde - v, right


@claim("(11)", "eq: CMOQ integral", "map eps", symplectic=False, formal=formal_proofs.integral_of_any_cubic)
def integral_of_any_hamiltonian_system(o: PaperObjects) -> Pairs:
    """The map of every cubic H, homogeneous or not, and every skew J conserves the modified Hamiltonian
    H + (2 eps/3) nabla H^T (I - eps f')^{-1} f is conserved, for any cubic H and any skew J"""
    p = o.arbitrary_hamiltonian()
    yield p.modified_H(p.step(p.f, p.x)), p.modified_H(p.x)


@claim("(12)", "eq: CMOQ measure", "map eps", symplectic=False, formal=formal_proofs.measure_of_any_hamiltonian_map)
def measure_of_any_hamiltonian_system(o: PaperObjects) -> Pairs:
    """The map of every cubic H and every skew J has the invariant measure
    dx/det(I - eps f') is invariant, for any cubic H and any skew J"""
    p = o.arbitrary_hamiltonian()
    x_tilde = p.step(p.f, p.x)
    det_x, det_x_tilde = p.det(p.minus_eps_jac(p.f, p.x)), p.det(p.minus_eps_jac(p.f, x_tilde))
    yield p.det(p.jacobian_of_step(p.f, p.x)) * det_x, det_x_tilde


@claim("(5)", "eq: Kahan gen", "eps map", blockwise=True)
def defining_equation(o: PaperObjects) -> Pairs:
    """The map solves Kahan's equation with step 2 eps
    (x~ - x)/(2 eps) = Q(x,x~) + B(x + x~)/2 + c"""
    for system in (o, o.inhomogeneous()):
        x_tilde = system.step(system.f, o.x)
        right = o.K.column(system.f.polarised(o.x.entries(), x_tilde.entries()))
        yield x_tilde - o.x, right * (o.eps * o.number(2))


@claim("Sect. 2", "", "inhomogeneous", blockwise=True)
def polarisation(o: PaperObjects) -> Pairs:
    """Q(x,x~) is the symmetric bilinear form of the quadratic form Q
    Q(x,x~) = (Q(x + x~) - Q(x) - Q(x~))/2"""
    y = o.vector("y")
    polar_form = o.value(o.f, o.x + y) - o.value(o.f, o.x) - o.value(o.f, y)
    yield o.K.column(o.f.polarised(o.x.entries(), y.entries())) * o.number(2), polar_form


@claim("Sect. 2", "", "eps map", blockwise=True)
def second_order(o: PaperObjects) -> Pairs:
    """The map approximates the time 2 eps shift along solutions to second order, with this remainder
    x~ = x + 2 eps f + 2 eps^2 f'f + O(eps^3)"""
    for system in (o, o.inhomogeneous()):
        f = system.f
        fx, df = o.value(f, o.x), o.jac(f, o.x)
        remainder = o.solve(o.minus_eps_jac(f, o.x), df * (df * fx))
        series = o.x + fx * (o.number(2) * o.eps) + df * fx * (o.number(2) * o.eps * o.eps)
        yield system.step(f, o.x), series + remainder * (o.number(2) * o.eps * o.eps * o.eps)


@claim("(6)", "eq: reversible", "map", blockwise=True)
def reversibility(o: PaperObjects) -> Pairs:
    """The inverse of the map with eps is the map with -eps
    Phi_f^{-1}(x, eps) = Phi_f(x, -eps)"""
    for system in (o, o.inhomogeneous()):
        yield system.step(system.f, system.step(system.f, o.x), times=-1), o.x


@claim("(7)", "eq: Phi gen", "eps map", blockwise=True)
def explicit_form(o: PaperObjects) -> Pairs:
    """The map has this explicit form
    x~ = x + 2 eps (I - eps f')^{-1} f"""
    for system in (o, o.inhomogeneous()):
        f = system.f
        increment = o.solve(o.minus_eps_jac(f, o.x), o.value(f, o.x))
        yield system.step(f, o.x), o.x + increment * (o.number(2) * o.eps)


@claim("(8)", "eq: Phi hom", "eps inhomogeneous", blockwise=True)
def homogeneous_form(o: PaperObjects) -> Pairs:
    """The map of a homogeneous f has this explicit form
    x~ = (I - eps f'(x))^{-1} x"""
    yield o.x_tilde, o.solve(o.minus_eps_jac(o.f, o.x), o.x)


@claim("(9)", "eq: Phi hom alt", "eps inhomogeneous", blockwise=True)
def homogeneous_form_backwards(o: PaperObjects) -> Pairs:
    """The inverse has this form for homogeneous f, and x~ is also expressed by f'(x~)
    x = (I + eps f'(x~))^{-1} x~,  x~ = (I + eps f'(x~)) x"""
    matrix = o.plus_eps_jac(o.f, o.x_tilde)
    yield o.x, o.solve(matrix, o.x_tilde)
    yield o.x_tilde, matrix * o.x


@claim("(10)", "Jac", "eps map", blockwise=True)
def jacobi_matrix_of_the_map(o: PaperObjects) -> Pairs:
    """The Jacobi matrix of the map has this form
    dPhi_f = (I - eps f'(x))^{-1} (I + eps f'(x~))"""
    v = o.vector("v")
    for system in (o, o.inhomogeneous()):
        x_tilde = system.step(system.f, o.x)
        right = o.solve(o.minus_eps_jac(system.f, o.x), o.plus_eps_jac(system.f, x_tilde) * v)
        for k in range(o.n):
            yield system.slope(lambda o, x: o.step(o.f, x)[k, 0], o.x, v), right[k, 0]


@claim("(11)", "eq: CMOQ integral", "f eps inhomogeneous", blockwise=True)
def two_forms_of_the_integral(o: PaperObjects) -> Pairs:
    """Both forms of the integral of a Hamiltonian system with homogeneous H agree
    x^T J^{-1} x~/(6 eps) = H + (2 eps/3) nabla H^T (I - eps f')^{-1} f"""
    yield o.dot(o.x, o.solve(o.J, o.x_tilde)) / (o.number(6) * o.eps), o.modified_H(o.x)


@claim(
    "(11)",
    "eq: CMOQ integral",
    misprint="as printed, for arbitrary cubic H, the first form is not the second: it needs H homogeneous (and J "
    "invertible)",
)
def two_forms_of_the_integral_for_any_cubic(o: PaperObjects) -> Pairs:
    """Both forms of the integral agree for an arbitrary cubic Hamilton function
    x^T J^{-1} x~/(6 eps) = H + (2 eps/3) nabla H^T (I - eps f')^{-1} f for any cubic H"""
    yield from two_forms_of_the_integral(o.inhomogeneous())


@claim("(11)", "eq: CMOQ integral", "f eps", blockwise=True)
def integral_of_any_cubic_hamiltonian(o: PaperObjects) -> Pairs:
    """The second form is an integral for every cubic H, homogeneous or not
    H + (2 eps/3) nabla H^T (I - eps f')^{-1} f is conserved"""
    for system in (o, o.inhomogeneous()):
        yield system.modified_H(system.step(system.f, o.x)), system.modified_H(o.x)


@claim("(12)", "eq: CMOQ measure", "f map", blockwise=True, certified="volume")
def invariant_measure(o: PaperObjects) -> Pairs:
    """The map of a Hamiltonian system has an invariant measure
    dx/det(I - eps f') is invariant"""
    for system in (o, o.inhomogeneous()):
        x_tilde = system.step(system.f, o.x)
        matrix_x, matrix_x_tilde = o.minus_eps_jac(system.f, o.x), o.minus_eps_jac(system.f, x_tilde)
        yield o.det(system.jacobian_of_step(system.f, o.x)) * o.det(matrix_x), o.det(matrix_x_tilde)


@claim("Sect. 2", "", "f map", only_m=1)
def measure_means_symplectic_in_the_plane(o: PaperObjects) -> Pairs:
    """In the plane an invariant measure is the same as symplecticity
    n = 2: dPhi J dPhi^T det(I - eps f'(x)) = det(I - eps f'(x~)) J"""
    jacobian = o.jacobian_of_step(o.f, o.x)
    left = jacobian * o.J * jacobian.transpose() * o.det(o.minus_eps_jac(o.f, o.x))
    yield left, o.J * o.det(o.minus_eps_jac(o.f, o.x_tilde))
