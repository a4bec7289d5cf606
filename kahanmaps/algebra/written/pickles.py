"""Matrices and polynomials as pickles, which python-flint has for numbers only; importing this is enough.

>>> import pickle
>>> from kahanmaps.algebra.polynomials import ring
>>> x, y = ring(["x", "y"]).gens()
>>> pickle.loads(pickle.dumps(x + 2 * y)) == x + 2 * y
True
"""

from __future__ import annotations

import copyreg
from typing import Any

from flint import Ordering, fmpq, fmpq_mat, fmpq_mpoly, fmpq_mpoly_ctx, fmpq_poly, fmpz_poly


def _of_matrix(A: fmpq_mat) -> tuple[Any, ...]:
    return fmpq_mat, (A.nrows(), A.ncols(), A.entries())


def _of_polynomial(P: fmpq_poly | fmpz_poly) -> tuple[Any, ...]:
    return type(P), (P.coeffs(),)


def _of_polynomial_in_names(P: fmpq_mpoly) -> tuple[Any, ...]:
    context = P.context()
    return _polynomial, (context.names(), context.ordering().name, P.to_dict())


def _polynomial(names: tuple[str, ...], ordering: str, terms: dict[tuple[int, ...], fmpq]) -> fmpq_mpoly:
    return fmpq_mpoly_ctx.get(names, Ordering[ordering]).from_dict(terms)


copyreg.pickle(fmpq_mat, _of_matrix)
copyreg.pickle(fmpq_poly, _of_polynomial)
copyreg.pickle(fmpz_poly, _of_polynomial)
copyreg.pickle(fmpq_mpoly, _of_polynomial_in_names)
