"""Coordinates of a plane in which its cubic is as symmetric as it can be, with areas kept.

A real binary cubic without repeated factor is, after a linear change of determinant 1, kappa (u^3 - 3 u v^2), which has
three real lines at angles of 60 degrees, or kappa (u^3 + 3 u v^2), with one; kappa > 0. Its Hessian determinant is then
-36 kappa^2 (u^2 + v^2) or 36 kappa^2 (u^2 - v^2). So the Kahan maps of all such planes are, up to scale, just two.
"""

from __future__ import annotations

from flint import acb_mat, arb, arb_mat

from kahanmaps.maps.normal_form.planar_block import PlanarBlock

Matrix = arb_mat | acb_mat  # complex in a complex plane

COMPLEX = "complex"
THREE_LINES, ONE_LINE, REPEATED, ZERO = "kappa (u^3 - 3 u v^2)", "kappa (u^3 + 3 u v^2)", "a repeated factor", "0"


def symmetric_coordinates(block: PlanarBlock) -> tuple[str, Matrix]:
    """The shape of the cubic, and the matrix of determinant 1 that takes (u, v) to the symmetric coordinates.

    The coefficients of the block are real balls; a discriminant that may be 0 counts as 0, where the matrix is I.

    >>> block = PlanarBlock(arb(0), arb(1), arb(1), arb(0))
    >>> shape, matrix = symmetric_coordinates(block)
    >>> shape, [round(float(entry), 3) + 0 for entry in transformed(block, matrix)]
    ('kappa (u^3 - 3 u v^2)', [0.31, 0.0, -0.931, 0.0])
    """
    one = arb_mat([[1, 0], [0, 1]])
    if all(coefficient.contains(arb(0)) for coefficient in (block.a, block.b, block.c, block.d)):
        return ZERO, one
    if block.discriminant.contains(arb(0)):
        return REPEATED, one
    if block.discriminant > 0:
        # D is negative definite: it is made -(u^2 + v^2) times a number, and the plane is turned.
        p, q, r = (-entry for entry in block.D)
        size = (p * r - q * q / 4).sqrt()
        stretch = (p / size).sqrt()
        upright = arb_mat([[stretch, stretch * q / (2 * p)], [0, 1 / stretch]])
        # Now h is the real part of (a - i b/3) (u + i v)^3.
        a, b, _, _ = transformed(block, upright)
        # atan2 of a ball across its cut would be all of -pi ... pi, so it is turned away from there.
        angle = (arb.atan2(-b / 3, -a) + arb.pi() if a < 0 else arb.atan2(b / 3, a)) / 3
        return THREE_LINES, arb_mat([[angle.cos(), angle.sin()], [-angle.sin(), angle.cos()]]) * upright
    # D is a product of two real forms L and M, and h = s L^3 + t M^3, which are scaled alike and turned.
    p, q, r = block.D
    root = (q * q - 4 * p * r).sqrt()
    slope = -(q + root) / 2 if not q < 0 else -(q - root) / 2
    L, M = (p, -slope), (slope, -r)
    det = L[0] * M[1] - L[1] * M[0]
    s, t = block.h(M[1] / det, -M[0] / det), block.h(-L[1] / det, L[0] / det)
    ratio = abs(t / s).root(3) if t / s > 0 else -abs(t / s).root(3)
    if det * ratio < 0:
        L, M, s, det, ratio = M, L, t, -det, 1 / ratio
    scale = 1 / (det * ratio).sqrt()
    if s < 0:
        scale = -scale
    half = arb(1) / arb(2).sqrt()
    forms = arb_mat([[entry * scale for entry in L], [entry * scale * ratio for entry in M]])
    return ONE_LINE, arb_mat([[half, half], [-half, half]]) * forms


def transformed(block: PlanarBlock, matrix: Matrix) -> tuple[arb, arb, arb, arb]:
    """The coefficients of the cubic in new coordinates, the matrix (of determinant 1) times the old ones."""
    f, g, k, l = matrix.entries()
    # u = l u' - g v', v = -k u' + f v'
    a, b, c, d = block.a, block.b, block.c, block.d
    slope_u, slope_v = 3 * a * l * l - 2 * b * l * k + c * k * k, b * l * l - 2 * c * l * k + 3 * d * k * k
    other_u, other_v = 3 * a * g * g - 2 * b * g * f + c * f * f, b * g * g - 2 * c * g * f + 3 * d * f * f
    return block.h(l, -k), -g * slope_u + f * slope_v, l * other_u - k * other_v, block.h(-g, f)
