"""Coordinates in which the planes of a normal form separate: identities that are too long to expand are short there."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import chain

from flint import fmpq, fmpq_mat, fmpq_mpoly

from kahanmaps.algebra.fields import QQ
from kahanmaps.algebra.polynomials import RationalFunction, linear_combinations
from kahanmaps.family.system_normal_form import SystemNormalForm, system_normal_form
from kahanmaps.maps.normal_form.splitting import Splitting
from kahanmaps.systems.quadratic import QuadraticSystem


@dataclass(frozen=True)
class Separated:
    """The `system` that another one is in z, where x = T z. A Kahan map is the same in all linear coordinates."""

    system: QuadraticSystem
    T: fmpq_mat

    def function(self, given: RationalFunction) -> RationalFunction:
        """A function of (x, ...) as one of (z, ...)."""

        def there(polynomial: fmpq_mpoly) -> fmpq_mpoly:
            context, n = polynomial.context(), self.system.dim
            x = linear_combinations(self.T, context.gens()[:n])
            return polynomial.compose(*x, *context.gens()[n:], ctx=context)

        return RationalFunction(there(given.numerator), there(given.denominator))


def separated(system: QuadraticSystem) -> Separated | None:
    """The system where its planes over Q separate; None for one without such planes, and where it is not shorter.

    >>> from kahanmaps.documents.catalog import load
    >>> system = load("paper_m2").system
    >>> [len(f) for f in system.rhs], [len(f) for f in separated(system).system.rhs]
    ([8, 8, 9, 9], [2, 3, 3, 2])
    """
    known = system_normal_form(system)
    if not isinstance(known, SystemNormalForm):
        return None
    splitting = Splitting(known.form, QQ, 1, known.T)
    matrices = [splitting.matrix(plane) for plane in range(len(splitting.planes))]
    T = fmpq_mat([list(chain(*rows)) for rows in zip(*matrices, strict=True)])
    there = system.composed(T, [fmpq(0)] * system.dim).transformed(T.inv())
    return Separated(there, T) if sum(map(len, there.rhs)) < sum(map(len, system.rhs)) else None
