"""Section 6: the maps of associated vector fields commute. x~ = Phi_f(x), x^ = Phi_g(x), g = B^T f."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import Any

from kahanmaps.paper.objects import PaperObjects
from kahanmaps.paper.registry import Pairs, claim
from kahanmaps.systems.quadratic import SystemOver


def associated_pairs(o: PaperObjects) -> Iterator[tuple[Any, SystemOver, Any]]:
    """Yield B, g and x^ for every associated system that is tested."""
    for B in o.associates():
        yield B, o.g(B), o.step(o.g(B), o.x)


@claim("Theorem 9 (51), (52)", "eq: Phi1", "eps inhomogeneous", blockwise=True)
def both_maps(o: PaperObjects) -> Pairs:
    """Both maps have the forms of Section 2
    x~ = (I - eps f'(x))^{-1} x = (I + eps f'(x~)) x, the same for g"""
    yield o.x_tilde, o.solve(o.minus_eps_jac(o.f, o.x), o.x)
    yield o.x_tilde, o.plus_eps_jac(o.f, o.x_tilde) * o.x
    for _, g, x_hat in associated_pairs(o):
        yield x_hat, o.solve(o.minus_eps_jac(g, o.x), o.x)
        yield x_hat, o.plus_eps_jac(g, x_hat) * o.x


@claim("Theorem 9", "th commute", "B H map", blockwise=True, certified="associates")
def commutativity(o: PaperObjects) -> Pairs:
    """The Kahan maps of any two associated vector fields commute
    Phi_f o Phi_g = Phi_g o Phi_f"""
    fields = [(o.f, o.x_tilde), *((g, x_hat) for _, g, x_hat in associated_pairs(o))]
    if len(fields) > 8:  # (f_s, f_t) is (f, f_{st}) of another member: test f with all fields, and neighbors
        index_pairs = [(0, k) for k in range(1, len(fields))] + [(k, k + 1) for k in range(1, len(fields) - 1)]
    else:
        index_pairs = [(j, k) for k in range(len(fields)) for j in range(k)]
    for j, k in index_pairs:
        (f, x_tilde), (g, x_hat) = fields[j], fields[k]
        yield o.step(f, x_hat), o.step(g, x_tilde)


@claim("(53), (54)", "eq: hat tilde", "map eps inhomogeneous", blockwise=True)
def compositions(o: PaperObjects) -> Pairs:
    """The two compositions are products of these matrices
    Phi_g(Phi_f(x)) = (I - eps g'(x~))^{-1} (I + eps f'(x~)) x"""
    for _, g, x_hat in associated_pairs(o):
        tilde_hat = o.solve(o.minus_eps_jac(g, o.x_tilde), o.plus_eps_jac(o.f, o.x_tilde) * o.x)
        hat_tilde = o.solve(o.minus_eps_jac(o.f, x_hat), o.plus_eps_jac(g, x_hat) * o.x)
        yield o.step(g, o.x_tilde), tilde_hat
        yield o.step(o.f, x_hat), hat_tilde


@claim("(55)", "det", "B H", blockwise=True)
def matrix_equation(o: PaperObjects) -> Pairs:
    """Commutativity holds as an identity of matrices, which is stronger than that of vectors
    (I - eps g'(x~))^{-1} (I + eps f'(x~)) = (I - eps f'(x^))^{-1} (I + eps g'(x^))"""
    for _, g, x_hat in associated_pairs(o):
        left = o.solve(o.minus_eps_jac(g, o.x_tilde), o.plus_eps_jac(o.f, o.x_tilde))
        yield left, o.solve(o.minus_eps_jac(o.f, x_hat), o.plus_eps_jac(g, x_hat))


@claim("(56)", "det 1", "B H", blockwise=True)
def matrix_equation_sorted(o: PaperObjects) -> Pairs:
    """The matrix equation holds with the points sorted
    (I - eps f'(x^)) (I - eps g'(x~))^{-1} = (I + eps g'(x^)) (I + eps f'(x~))^{-1}"""
    for _, g, x_hat in associated_pairs(o):
        left = o.minus_eps_jac(o.f, x_hat) * o.inverse(o.minus_eps_jac(g, o.x_tilde))
        yield left, o.plus_eps_jac(g, x_hat) * o.inverse(o.plus_eps_jac(o.f, o.x_tilde))


@claim("Theorem 9, proof", "", "B H", blockwise=True)
def inverses(o: PaperObjects) -> Pairs:
    """(I - eps^2 f'^2)^{-1} gives the inverses for g' and for f'
    (I - eps g'(x~))^{-1} = (I + eps g'(x~)) (I - eps^2 f'(x~)^2)^{-1}"""
    square_inverse = o.inverse(o.one_minus_square(o.f, o.x_tilde))
    yield o.inverse(o.plus_eps_jac(o.f, o.x_tilde)), o.minus_eps_jac(o.f, o.x_tilde) * square_inverse
    for _, g, _ in associated_pairs(o):
        yield o.inverse(o.minus_eps_jac(g, o.x_tilde)), o.plus_eps_jac(g, o.x_tilde) * square_inverse


@claim("Theorem 9, proof", "", "B H", blockwise=True)
def matrix_equation_without_inverses(o: PaperObjects) -> Pairs:
    """The matrix equation holds without inverses
    (I - eps f'(x^)) (I + eps g'(x~)) = (I + eps g'(x^)) (I - eps f'(x~))"""
    for _, g, x_hat in associated_pairs(o):
        left = o.minus_eps_jac(o.f, x_hat) * o.plus_eps_jac(g, o.x_tilde)
        yield left, o.plus_eps_jac(g, x_hat) * o.minus_eps_jac(o.f, o.x_tilde)


@claim("Theorem 9, proof", "", "H A", blockwise=True)
def quadratic_terms_cancel(o: PaperObjects) -> Pairs:
    """The terms quadratic in eps cancel
    f'(x^) g'(x~) = f'(x^) B^T f'(x~) = B^T f'(x^) f'(x~) = g'(x^) f'(x~)"""
    for B, g, x_hat in associated_pairs(o):
        df_hat, df_tilde, BT = o.jac(o.f, x_hat), o.jac(o.f, o.x_tilde), B.transpose()
        steps = [
            df_hat * o.jac(g, o.x_tilde),
            df_hat * BT * df_tilde,
            BT * df_hat * df_tilde,
            o.jac(g, x_hat) * df_tilde,
        ]
        yield from pairwise(steps)


@claim("(57)", "aux", "B H", blockwise=True)
def linear_terms(o: PaperObjects) -> Pairs:
    """The terms linear in eps agree
    -f'(x^) + g'(x~) = g'(x^) - f'(x~)"""
    for _, g, x_hat in associated_pairs(o):
        left = o.jac(g, o.x_tilde) - o.jac(o.f, x_hat)
        yield left, o.jac(g, x_hat) - o.jac(o.f, o.x_tilde)


@claim("Theorem 9, proof", "", "eps", blockwise=True)
def jacobians_at_the_images(o: PaperObjects) -> Pairs:
    """The constant tensors f'' and g'' determine f' and g' at x^ and at x~
    f'(x^) = f'(x) + f''(x^ - x) = f'(x) + 2 eps f''(I - eps g')^{-1} g, ..."""
    two_eps = o.number(2) * o.eps
    for _, g, x_hat in associated_pairs(o):
        for field, image in ((g, x_hat), (o.f, o.x_tilde)):
            increment = o.solve(o.minus_eps_jac(field, o.x), o.value(field, o.x))
            for h in (o.f, g):
                yield o.jac(h, image), o.jac(h, o.x) + o.second(h, image - o.x)
                yield o.jac(h, image), o.jac(h, o.x) + o.second(h, increment) * two_eps


@claim("(58)", "aux2", "B H", blockwise=True)
def equation_for_the_second_derivatives(o: PaperObjects) -> Pairs:
    """f'' and g'' determine the linear terms
    f''(I - eps g')^{-1} g + g''(I - eps g')^{-1} g = f''(I - eps f')^{-1} f + g''(I - eps f')^{-1} f"""
    for B in o.associates():
        g = o.g(B)
        step_g = o.solve(o.minus_eps_jac(g, o.x), o.value(g, o.x))
        step_f = o.solve(o.minus_eps_jac(o.f, o.x), o.fx)
        yield o.second(o.f, step_g) + o.second(g, step_g), o.second(o.f, step_f) + o.second(g, step_f)


@claim("Lemma 10 (59)", "g''", "H B", blockwise=True)
def second_derivatives_agree(o: PaperObjects) -> Pairs:
    """The second derivatives of associated fields satisfy this relation
    g'' v = f'' (B^T v), f'' v = g'' (B^T v)"""
    v = o.vector("v")
    for B in o.associates():
        yield o.second(o.g(B), v), o.second(o.f, B.transpose() * v)
        yield o.second(o.f, v), o.second(o.g(B), B.transpose() * v)


@claim("Lemma 10 (60)", "Af''", "H A", least_m=2, blockwise=True)
def second_derivatives_commute_with_B(o: PaperObjects) -> Pairs:
    """The equivalent form of Lemma 10 and its proof in components hold (the print has d f_i for d^2 f_i)
    B^T (f'' v) = f'' (B^T v), B^T (g'' v) = g'' (B^T v)"""
    v = o.vector("v")
    for B in o.associates():
        for h in (o.f, o.g(B)):
            yield B.transpose() * o.second(h, v), o.second(h, B.transpose() * v)


@claim("Theorem 9, proof", "", "B H", blockwise=True)
def terms_of_equation_58(o: PaperObjects) -> Pairs:
    """By Lemma 10 the four terms of (58) are f''(I - eps^2 f'^2)^{-1} times a vector
    f''(I - eps g')^{-1} g = f''(I - eps^2 f'^2)^{-1} (g + eps g'g), and five more"""
    square = o.one_minus_square(o.f, o.x)
    f, fx, df = o.f, o.fx, o.df
    for B in o.associates():
        g, BT = o.g(B), B.transpose()
        gx, dg = o.value(g, o.x), o.jac(g, o.x)
        step_g, step_f = o.solve(o.minus_eps_jac(g, o.x), gx), o.solve(o.minus_eps_jac(f, o.x), fx)
        yield o.second(f, step_g), o.second(f, o.solve(square, gx + dg * gx * o.eps))
        yield o.second(g, step_g), o.second(f, o.solve(square, BT * (gx + dg * gx * o.eps)))
        yield o.second(g, step_g), o.second(f, o.solve(square, fx + df * gx * o.eps))
        yield o.second(f, step_f), o.second(f, o.solve(square, fx + df * fx * o.eps))
        yield o.second(g, step_f), o.second(f, o.solve(square, BT * (fx + df * fx * o.eps)))
        yield o.second(g, step_f), o.second(f, o.solve(square, gx + dg * fx * o.eps))
