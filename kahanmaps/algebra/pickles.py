"""Pickles of what python-flint can pickle only as integers and rationals; importing this is enough.

>>> import pickle
>>> from kahanmaps.algebra.polynomials import ring
>>> x, y = ring(["x", "y"]).gens()
>>> pickle.loads(pickle.dumps(x + 2 * y)) == x + 2 * y
True
"""

from __future__ import annotations

import copyreg
from typing import Any

from flint import (
    Ordering,
    acb,
    arb,
    fmpq,
    fmpq_mat,
    fmpq_mpoly,
    fmpq_mpoly_ctx,
    fmpq_poly,
    fmpz_mat,
    fmpz_mod,
    fmpz_mod_ctx,
    fmpz_poly,
    nmod,
)


def _of_matrix(A: fmpq_mat | fmpz_mat) -> tuple[Any, ...]:
    return type(A), (A.nrows(), A.ncols(), A.entries())


def _polynomial(names: tuple[str, ...], ordering: str, terms: dict[tuple[int, ...], fmpq]) -> fmpq_mpoly:
    return fmpq_mpoly_ctx.get(names, Ordering[ordering]).from_dict(terms)


def _of_ball(x: arb) -> tuple[Any, ...]:
    """Midpoint and radius are integers times powers of 2, exactly, whatever the precision in force."""
    ends = (x.mid(), x.rad())
    return arb, tuple(end.man_exp() if end.is_finite() else float(end) for end in ends)


def _residue(value: int, modulus: int) -> fmpz_mod:
    return fmpz_mod_ctx(modulus)(value)


copyreg.pickle(fmpq_mat, _of_matrix)
copyreg.pickle(fmpz_mat, _of_matrix)
copyreg.pickle(fmpq_poly, lambda P: (fmpq_poly, (P.coeffs(),)))
copyreg.pickle(fmpz_poly, lambda P: (fmpz_poly, (P.coeffs(),)))
copyreg.pickle(fmpq_mpoly, lambda P: (_polynomial, (P.context().names(), P.context().ordering().name, P.to_dict())))
copyreg.pickle(arb, _of_ball)
copyreg.pickle(acb, lambda x: (acb, (x.real, x.imag)))
copyreg.pickle(nmod, lambda x: (nmod, (int(x), x.modulus())))
# The modulus of a residue: it does not say it itself.
copyreg.pickle(fmpz_mod, lambda x: (_residue, (int(x), int(0 * x - 1) + 1)))
