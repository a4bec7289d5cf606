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


def _of_polynomial(P: fmpq_poly | fmpz_poly) -> tuple[Any, ...]:
    return type(P), (P.coeffs(),)


def _of_polynomial_in_names(P: fmpq_mpoly) -> tuple[Any, ...]:
    context = P.context()
    return _polynomial, (context.names(), context.ordering().name, P.to_dict())


def _polynomial(names: tuple[str, ...], ordering: str, terms: dict[tuple[int, ...], fmpq]) -> fmpq_mpoly:
    return fmpq_mpoly_ctx.get(names, Ordering[ordering]).from_dict(terms)


def _of_ball(x: arb) -> tuple[Any, ...]:
    """Midpoint and radius are integers times powers of 2, exactly, whatever the precision in force."""
    ends = (x.mid(), x.rad())
    return arb, tuple(end.man_exp() if end.is_finite() else float(end) for end in ends)


def _of_residue(x: fmpz_mod) -> tuple[Any, ...]:
    return _residue, (int(x), int(0 * x - 1) + 1)  # which is the modulus: it does not say it itself


def _residue(value: int, modulus: int) -> fmpz_mod:
    return fmpz_mod_ctx(modulus)(value)


copyreg.pickle(fmpq_mat, _of_matrix)
copyreg.pickle(fmpz_mat, _of_matrix)
copyreg.pickle(fmpq_poly, _of_polynomial)
copyreg.pickle(fmpz_poly, _of_polynomial)
copyreg.pickle(fmpq_mpoly, _of_polynomial_in_names)
copyreg.pickle(arb, _of_ball)
copyreg.pickle(acb, lambda x: (acb, (x.real, x.imag)))
copyreg.pickle(nmod, lambda x: (nmod, (int(x), x.modulus())))
copyreg.pickle(fmpz_mod, _of_residue)
