"""Section 7: the integrals H~ and K~, shared by all maps of a class. x~ = Phi_f(x), x^ = Phi_g(x), g = B^T f."""

from __future__ import annotations

from itertools import pairwise

from kahanmaps.paper.objects import PaperObjects
from kahanmaps.paper.registry import Pairs, claim


@claim("Theorem 11", "th integrals", "B inhomogeneous", blockwise=True)
def H_tilde_is_shared(o: PaperObjects) -> Pairs:
    """H~ is an integral of all maps of the class
    H~(x~) = H~(x), H~(x^) = H~(x)"""
    yield o.H_tilde(o.x_tilde), o.H_tilde(o.x)
    for B in o.associates():
        yield o.H_tilde(o.step(o.g(B), o.x)), o.H_tilde(o.x)


@claim("Theorem 11", "th integrals", "B H", blockwise=True)
def K_tilde_is_shared(o: PaperObjects) -> Pairs:
    """Every K~ is an integral of f and of every single-index g_i: the class shares m independent ones
    K~(x~) = K~(x), K~(x^) = K~(x)"""
    images = [o.x_tilde, *(o.step(o.g_i(i), o.x) for i in o.each)]
    for B in o.associates():
        for image in images:
            yield o.integral(o.g(B), image), o.integral(o.g(B), o.x)


@claim(
    "Theorem 11",
    "th integrals",
    "H0",
    in_general=True,
    at_most="nabla K~_i = B_i nabla H~, and the B_i lie in a space of dimension m",
    distinct_roots=True,
)
def shared_integrals_are_independent(o: PaperObjects) -> Pairs:
    """Two integrals of a pair f, g are independent; the class has exactly m independent ones
    rank(nabla H~, nabla K~_1, ..., nabla K~_m) = m"""
    gradients = [o.gradient(lambda o, x: o.H_tilde(x), o.x)]
    gradients += [o.gradient(lambda o, x: o.integral(o.g_i(i), x), o.x) for i in o.each]
    if o.m > 1:
        for gradient in gradients[1:]:
            yield o.rank(o.columns([gradients[0], gradient])), 2
    yield o.rank(o.columns(gradients)), o.m


@claim("(61), (62)", "tH", "eps inhomogeneous", blockwise=True)
def two_forms_of_H_tilde(o: PaperObjects) -> Pairs:
    """H~ and K~ are given by the image and by the inverse matrix
    H~ = eps^{-1} x^T J x~ = eps^{-1} x^T J (I - eps f')^{-1} x"""
    yield o.H_tilde(o.x), o.dot(o.x, o.J * o.solve(o.minus_eps_jac(o.f, o.x), o.x)) / o.eps
    for B in o.associates():
        g = o.g(B)
        yield o.integral(g, o.x), o.dot(o.x, o.J * o.solve(o.minus_eps_jac(g, o.x), o.x)) / o.eps


@claim("Sect. 7", "", "f J")
def terms_of_the_series(o: PaperObjects) -> Pairs:
    """The matrices in the series of H~ are symmetric or skew; hence the terms with even k vanish
    J f'^k = -(nabla^2 H J ... J nabla^2 H), symmetric for odd k, skew for even k"""
    hessian = o.hess(o.x)
    word, power = hessian, o.df
    for k in range(1, 2 * o.order + 1):
        yield o.J * power, -word
        yield word.transpose(), word if k % 2 else -word
        if k % 2 == 0:
            yield o.dot(o.x, o.J * (power * o.x)), o.K.zero
        word, power = word * o.J * hessian, power * o.df


@claim("Sect. 7", "", "eps f inhomogeneous", blockwise=True)
def series_of_the_integrals(o: PaperObjects) -> Pairs:
    """H~ and K~ have these series up to the requested order, with the exact remainder
    H~ = sum_{k<N} eps^{2k} x^T J f'^{2k+1} x + O(eps^{2N})"""
    for g in [o.f, *(o.g_i(i) for i in o.each)]:
        jacobian = o.jac(g, o.x)
        square, squared_eps = jacobian * jacobian, o.eps * o.eps
        vector, eps_power, total = jacobian * o.x, o.K.one, o.K.zero
        for _ in range(o.order):
            total = total + o.dot(o.x, o.J * vector) * eps_power
            vector, eps_power = square * vector, eps_power * squared_eps
            remainder = o.dot(o.x, o.J * o.solve(o.one_minus_square(g, o.x), vector)) * eps_power
            yield o.integral(g, o.x), total + remainder


@claim("(63), (64)", "tH alt", "f eps inhomogeneous", blockwise=True)
def even_forms_of_the_integrals(o: PaperObjects) -> Pairs:
    """H~ and K~ are even functions of eps
    H~ = x^T J (I - eps^2 f'^2)^{-1} f' x = 2 x^T J (I - eps^2 f'^2)^{-1} f"""
    for g in [o.f, *(o.g(B) for B in o.associates())]:
        square = o.one_minus_square(g, o.x)
        middle_form = o.dot(o.x, o.J * o.solve(square, o.jac(g, o.x) * o.x))
        yield o.integral(g, o.x), middle_form
        yield middle_form, o.dot(o.x, o.J * o.solve(square, o.value(g, o.x))) * o.number(2)


@claim("Sect. 7", "", "f inhomogeneous", blockwise=True)
def leading_terms(o: PaperObjects) -> Pairs:
    """The leading terms of H~ and K~ are -6 H and -6 K
    2 x^T J f = -2 x^T nabla H = -6 H, the same for K"""
    yield o.dot(o.x, o.J * o.fx) * o.number(2), o.dot(o.x, o.grad(o.x)) * o.number(-2)
    yield o.dot(o.x, o.grad(o.x)) * o.number(-2), o.H(o.x) * o.number(-6)
    for B in o.associates():
        middle_form = o.dot(o.x, B * o.grad(o.x)) * o.number(-2)
        yield o.dot(o.x, o.J * o.value(o.g(B), o.x)) * o.number(2), middle_form
        yield middle_form, o.Kf(B, o.x) * o.number(-6)


@claim("(65)", "", "f eps inhomogeneous", blockwise=True)
def H_tilde_at_the_image(o: PaperObjects) -> Pairs:
    """The equalities of the computation of H~(x~) hold
    H~(x~) = eps^{-1} x^T J (I - eps f'(x~)) (I - eps f'(x~))^{-1} (I - eps f'(x))^{-1} x"""
    solution = o.solve(o.minus_eps_jac(o.f, o.x), o.x)
    second_solution = o.solve(o.minus_eps_jac(o.f, o.x_tilde), solution)
    steps = [
        o.H_tilde(o.x_tilde),
        o.dot(o.x_tilde, o.J * o.solve(o.minus_eps_jac(o.f, o.x_tilde), o.x_tilde)) / o.eps,
        o.dot(o.x, o.plus_eps_jac(o.f, o.x_tilde).transpose() * (o.J * second_solution)) / o.eps,
        o.dot(o.x, o.J * (o.minus_eps_jac(o.f, o.x_tilde) * second_solution)) / o.eps,
        o.H_tilde(o.x),
    ]
    yield from pairwise(steps)


@claim("(66)", "aux3", "B H inhomogeneous", blockwise=True)
def K_tilde_at_the_image(o: PaperObjects) -> Pairs:
    """The equalities of the computation of K~(x~) hold
    K~(x~) = x^T J g'(x~) x"""
    for B in o.associates():
        g = o.g(B)
        solution = o.solve(o.one_minus_square(g, o.x_tilde), o.jac(g, o.x_tilde) * o.x_tilde)
        steps = [
            o.integral(g, o.x_tilde),
            o.dot(o.x_tilde, o.J * solution),
            o.dot(o.x, o.plus_eps_jac(o.f, o.x_tilde).transpose() * (o.J * solution)),
            o.dot(o.x, o.J * (o.minus_eps_jac(o.f, o.x_tilde) * solution)),
            o.dot(o.x, o.J * (o.jac(g, o.x_tilde) * o.x)),
        ]
        yield from pairwise(steps)


@claim("(67)", "aux4", "eps map", blockwise=True)
def jacobian_of_g_at_the_image(o: PaperObjects) -> Pairs:
    """f at x determines g'(x~)
    g'(x~) = g'(x) + 2 eps g'' (I - eps^2 f'^2)^{-1} (I + eps f') f"""
    increment = o.solve(o.one_minus_square(o.f, o.x), o.plus_eps_jac(o.f, o.x) * o.fx) * (o.number(2) * o.eps)
    for B in o.associates():
        g = o.g(B)
        yield o.jac(g, o.x_tilde), o.jac(g, o.x) + o.second(g, o.x_tilde - o.x)
        yield o.jac(g, o.x_tilde), o.jac(g, o.x) + o.second(g, increment)


@claim("(68)", "aux5", "A f", blockwise=True)
def odd_terms_vanish(o: PaperObjects) -> Pairs:
    """The odd terms in eps vanish, since a skew-symmetric matrix stands between equal vectors
    x^T J (g'' (I - eps^2 f'^2)^{-1} f) x = 0, through -2 nabla H^T (B^T (..)^{-1} J) nabla H"""
    square = o.one_minus_square(o.f, o.x)
    solution = o.solve(square, o.fx)
    gradient = o.grad(o.x)
    for B in o.associates():
        g = o.g(B)
        skew_matrix = B.transpose() * o.solve(square, o.J)
        steps = [
            o.dot(o.x, o.J * (o.second(g, solution) * o.x)),
            o.dot(o.x, o.J * (o.jac(g, o.x) * solution)),
            -o.dot(o.x, B * o.hess(o.x) * solution),
            o.dot(B * gradient, solution) * o.number(-2),
            o.dot(gradient, skew_matrix * gradient) * o.number(-2),
            o.K.zero,
        ]
        yield from pairwise(steps)
        yield skew_matrix.transpose(), -skew_matrix


@claim("(69)", "aux7", "inhomogeneous", blockwise=True)
def second_derivative_along_x(o: PaperObjects) -> Pairs:
    """g' is homogeneous: this holds for any vector v
    (g'' v) x = g'(x) v"""
    v = o.vector("v")
    for g in [o.f, *(o.g(B) for B in o.associates())]:
        yield o.second(g, v) * o.x, o.jac(g, o.x) * v


@claim(
    "Theorem 11, proof",
    "",
    misprint="the second term is a vector, the first a number: x^T J is missing before g''. Read as a number by its "
    "first component it fails",
)
def even_terms_as_printed(o: PaperObjects) -> Pairs:
    """The even terms of K~(x~) have this form, as printed
    K~(x~) = x^T J g' x + 2 eps^2 g'' (I - eps^2 f'^2)^{-1} f' f x"""
    solution = o.solve(o.one_minus_square(o.f, o.x), o.df * o.fx)
    for B in o.associates():
        g = o.g(B)
        second_term = (o.second(g, solution) * o.x)[0, 0] * (o.number(2) * o.eps * o.eps)
        yield o.integral(g, o.x_tilde), o.dot(o.x, o.J * (o.jac(g, o.x) * o.x)) + second_term


@claim("Theorem 11, proof", "", "B H eps", blockwise=True)
def even_terms(o: PaperObjects) -> Pairs:
    """The even terms, as corrected, and the last four lines of the proof hold
    K~(x~) = x^T J g' x + 2 eps^2 x^T J g'' (I - eps^2 f'^2)^{-1} f' f x = ... = K~(x)"""
    solution = o.solve(o.one_minus_square(o.f, o.x), o.df * o.fx)
    two_eps_squared = o.number(2) * o.eps * o.eps
    for B in o.associates():
        g = o.g(B)
        gx, dg, square = o.value(g, o.x), o.jac(g, o.x), o.one_minus_square(g, o.x)
        solution_g = o.solve(square, dg * gx)
        steps = [
            o.integral(g, o.x_tilde),
            o.dot(o.x, o.J * (dg * o.x)) + o.dot(o.x, o.J * (o.second(g, solution) * o.x)) * two_eps_squared,
            o.dot(o.x, o.J * (dg * o.x)) + o.dot(o.x, o.J * (o.second(g, solution_g) * o.x)) * two_eps_squared,
            o.dot(o.x, o.J * gx) * o.number(2) + o.dot(o.x, o.J * (dg * solution_g)) * two_eps_squared,
            o.dot(o.x, o.J * o.solve(square, gx)) * o.number(2),
            o.integral(g, o.x),
        ]
        yield from pairwise(steps)


@claim("Sect. 7", "", "B H")
def sum_of_the_integrals(o: PaperObjects) -> Pairs:
    """The K~_i satisfy the sum rule; for m = 3 their sum is H~
    sum K~_i = (m-2) H~"""
    yield o.sum([o.integral(o.g_i(i), o.x) for i in o.each]), o.H_tilde(o.x) * o.number(o.m - 2)
