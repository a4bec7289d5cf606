"""Orbits over Q in normal form: every plane by itself, x put together when asked for."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from flint import fmpq

from kahanmaps.algebra.fields import QQ
from kahanmaps.family.system_normal_form import SystemNormalForm
from kahanmaps.maps.normal_form.planar_algebra import AlgebraBlock
from kahanmaps.maps.normal_form.planar_integers import IntegerBlock
from kahanmaps.maps.normal_form.planes_point import Assembly, Block, PlanesPoint
from kahanmaps.maps.normal_form.splitting import Splitting
from kahanmaps.maps.normal_form.tau import triples


class NormalSteps:
    """Steps of Phi(., eps) over Q in a normal form; the time step is 2 eps.

    >>> from itertools import islice
    >>> from kahanmaps.family.draw import draw_with_eigenvalues
    >>> from kahanmaps.family.system_normal_form import system_normal_form
    >>> from kahanmaps.maps.kahan import KahanMap
    >>> system = draw_with_eigenvalues([1, -2], seed=7).chosen.system
    >>> first, second = islice(NormalSteps(system_normal_form(system), fmpq(1, 10)).points([1, 0, "1/2", 0]), 2)
    >>> second.rationals() == KahanMap(system, "1/10").step(first.rationals())
    True
    """

    def __init__(self, normal_form: SystemNormalForm, eps: fmpq) -> None:
        self.splitting = Splitting(normal_form.form, QQ, eps, normal_form.T)
        self._eps = eps

    def blocks(self, start: Sequence[Any]) -> tuple[list[Block], Assembly]:
        """The planes with the triples of the start, and the way back to x."""
        planes, scale = self.splitting.planes, 2 * self._eps
        blocks: list[Block] = []
        triples = self.splitting.triples([QQ.convert(entry) for entry in start])
        for plane, (U, V, W) in zip(planes, triples, strict=True):
            cubic = plane.block
            if plane.degree > 1:
                blocks.append(AlgebraBlock(cubic, (U, V, W), scale))
            else:
                blocks.append(IntegerBlock([cubic.a, cubic.b, cubic.c, cubic.d], self._eps, U / scale, V / scale))
        return blocks, Assembly(blocks, [self.splitting.matrix(i) for i in range(len(planes))])

    def points(self, start: Sequence[Any]) -> Iterator[PlanesPoint]:
        """The orbit, as long as the map has a value."""
        blocks, assembly = self.blocks(start)
        for found in zip(*(triples(block) for block in blocks), strict=False):
            yield PlanesPoint(assembly, found)
