"""Rational points stored as primitive triples in the planes; x is computed from the triples only on demand.

x_r = sum over i of (alpha_{ri} U_i + beta_{ri} V_i) / W_i with fixed rational alpha and beta. The numerators over the
product of the W_i take a few multiplications. For fractions in lowest terms, three kinds of common factors must be
removed. First, the gcds of the W_i with each other. Second, the primes of the fixed numbers, i.e. the denominators of
alpha, beta and the level, and h_i(beta, -alpha): a prime that divides alpha U + beta V and W divides h(U, V), hence
h(beta, -alpha). Third, if h_i(beta, -alpha) = 0, the gcd of alpha U + beta V and W. Orbits are computed plane by plane.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property, reduce
from itertools import accumulate, chain
from operator import mul
from typing import Any

from flint import fmpq, fmpz, fmpz_mat

from kahanmaps.algebra.fields import QQ
from kahanmaps.algebra.integers import content, divide_exactly, has_full_multiplicity, over_common_denominator, radical
from kahanmaps.family.system_normal_form import SystemNormalForm
from kahanmaps.maps.normal_form.planar_algebra import AlgebraBlock
from kahanmaps.maps.normal_form.planar_block import Triple
from kahanmaps.maps.normal_form.planar_integers import IntegerBlock
from kahanmaps.maps.normal_form.splitting import Splitting
from kahanmaps.maps.normal_form.tau import triples

Block = IntegerBlock | AlgebraBlock

# Powers of the fixed primes up to this exponent are found from one residue.
_PRIME_POWER = 3


@dataclass(frozen=True)
class _Coordinate:
    """A coordinate: the sum of (alpha_i U_i + beta_i V_i)/(denominator W_i) over the planes of `support`."""

    support: tuple[int, ...]
    forms: tuple[tuple[fmpz, ...], ...]
    denominator: fmpz
    fixed_number: fmpz  # divisible by the fixed primes that numerator and denominator may have in common
    divisor_planes: tuple[int, ...]  # the planes in which the form alpha U + beta V divides h


class Assembly:
    """The conversion of triples to points x, the sum over the blocks of R (u, v) with the matrix R of each block."""

    def __init__(self, blocks: Sequence[Block], matrices: Sequence[Sequence[Sequence[fmpq]]]) -> None:
        self.blocks = blocks
        self.dim = len(matrices[0])
        self.rows: list[_Coordinate] = []
        for r in range(self.dim):
            forms = [
                [entry / planar_block.scale for entry in table[r]]
                for planar_block, table in zip(blocks, matrices, strict=True)
            ]
            support = tuple(i for i, form in enumerate(forms) if any(entry != 0 for entry in form))
            _, denominator = over_common_denominator(chain(*forms))
            integers = [tuple((entry * denominator).p for entry in forms[i]) for i in support]
            factors, divisor_planes = [denominator], []
            for i, form in zip(support, integers, strict=True):
                block = blocks[i]
                if block.is_constant:
                    factors.append(block.fraction(block.start)[1])
                    continue
                factors.append(content(form))
                if block.level is not None:
                    factors += block.primes
                value = None if block.level is None else block.fixed_number(form)
                if value is None:
                    divisor_planes.append(i)
                else:
                    factors.append(value)
            self.rows.append(
                _Coordinate(support, tuple(integers), denominator, radical(*factors), tuple(divisor_planes))
            )
        self.fixed_number = radical(*(row.fixed_number for row in self.rows))
        # The indices of the rows with the same support, and the integer coefficients of their forms.
        self.by_support: dict[tuple[int, ...], tuple[list[int], fmpz_mat]] = {}
        for support in dict.fromkeys(row.support for row in self.rows):
            row_indices = [k for k, row in enumerate(self.rows) if row.support == support]
            table = [list(chain(*self.rows[k].forms)) for k in row_indices]
            self.by_support[support] = row_indices, fmpz_mat(len(table), len(table[0]), list(chain(*table)))
        self.denominator = reduce(fmpz.lcm, (row.denominator for row in self.rows), fmpz(1))
        zeros = [[fmpz(0)] * len(matrix[0]) for matrix in matrices]
        table_rows = []
        for row in self.rows:
            forms_by_plane, factor = dict(zip(row.support, row.forms, strict=True)), self.denominator // row.denominator
            table_rows += [entry * factor for i, zero in enumerate(zeros) for entry in forms_by_plane.get(i, zero)]
        self.forms = fmpz_mat(self.dim, len(table_rows) // self.dim, table_rows)  # of all rows, with one denominator
        # The number of bits by which numerators may be longer than the products of triples that give them.
        largest = max(map(abs, table_rows))
        self.extra_bits = int(max(self.denominator.bit_length(), (self.dim * largest).bit_length()))
        self.extra_bits += sum(block.slack for block in blocks)


class PlanesPoint:
    """A point of Q^{2m}, given by primitive triples in the planes of an assembly."""

    def __init__(self, assembly: Assembly, triples: Sequence[Triple]) -> None:
        self._assembly = assembly
        self._height: int | None = None
        self.triples = tuple(triples)

    @property
    def bits(self) -> int:
        """The approximate bit length of the largest integer, with all coordinates over one common denominator."""
        pairs = [block.bits(triple) for block, triple in zip(self._assembly.blocks, self.triples, strict=True)]
        return sum(denominator_bits for _, denominator_bits in pairs) + max(
            0, *(numerator_bits - denominator_bits for numerator_bits, denominator_bits in pairs)
        )

    @cached_property
    def _fractions(self) -> list[tuple[list[fmpz], fmpz, fmpz]]:
        """Return the results of `fraction` for each plane: numerators of the coordinates, denominator, third number."""
        return [block.fraction(triple) for block, triple in zip(self._assembly.blocks, self.triples, strict=True)]

    @property
    def height(self) -> int:
        """The bit length of the largest integer, with x over its least common denominator; computing it takes a gcd.

        `bits` differs by a few bits, but is much too large if denominators of planes have common factors.
        """
        if self._height is None:
            numerators, denominator = self.over_common_denominator()
            largest = max(map(abs, [*numerators, denominator]))
            self._height = int((largest // content([denominator, *numerators])).bit_length())
        return self._height

    def exceeding(self, limit: int) -> int:
        """Return the height if it exceeds the limit, otherwise 0; a gcd is computed only if `bits` does not decide."""
        if self.bits + self._assembly.extra_bits <= limit:
            return 0
        return self.height if self.height > limit else 0

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, PlanesPoint):
            return NotImplemented
        pairs = zip(self._assembly.blocks, self.triples, other.triples, strict=True)
        return all(block.is_same_point(P, Q) for block, P, Q in pairs)

    def __hash__(self) -> int:
        # Triples over an extension field are not unique.
        return hash(tuple(abs(W) for _, _, W in self.triples if isinstance(W, fmpz)))

    def over_common_denominator(self) -> tuple[list[fmpz], fmpz]:
        """Return the numerators of all coordinates and a common denominator; common factors of the W_i remain."""
        column, product = _scale_to_common_denominator([(numerators, W) for numerators, W, _ in self._fractions])
        return (self._assembly.forms * column).entries(), self._assembly.denominator * product

    def lowest_terms(self) -> list[tuple[fmpz, fmpz]]:
        """Return numerator and denominator of each coordinate in lowest terms, with positive denominators."""
        planes = [(numerator, W) for numerator, W, _ in self._fractions]
        possible_primes = fmpz(1)  # divisible by all primes that divide two of the W_i
        *denominators, product = sorted((W for _, W in planes), key=fmpz.bit_length)  # `product` is first the longest W
        while denominators:
            longest = denominators.pop()
            possible_primes = possible_primes * longest.gcd(product % longest)
            if denominators:
                product = product * longest
        for _, _, primes in self._fractions:
            possible_primes = possible_primes * primes
        modulus = (self._assembly.fixed_number * possible_primes) ** _PRIME_POWER
        residues = [([entry % modulus for entry in numerator], W % modulus) for numerator, W in planes]
        fractions, residue_pairs = self._fractions_of(planes), self._fractions_of(residues)
        divisors: dict[tuple[int, ...], fmpz] = {}  # one gcd suffices for all rows with the same form
        pairs = []
        for row, (numerator, denominator), residue in zip(self._assembly.rows, fractions, residue_pairs, strict=True):
            if numerator == 0:
                pairs.append((numerator, fmpz(1)))
                continue
            common_factor = fmpz(1)
            for i, form in zip(row.support, row.forms, strict=True):
                if i in row.divisor_planes:  # gcd(alpha U + beta V, W) up to fixed primes, if the form divides h
                    factor = content(form)
                    key = (i, *(int(entry // factor) for entry in form))
                    if key not in divisors:
                        divisors[key] = sum(map(mul, map(fmpz, key[1:]), planes[i][0]), fmpz(0)).gcd(planes[i][1])
                    common_factor = common_factor * divisors[key]
            if common_factor != 1:
                numerator, denominator = divide_exactly((numerator, denominator), common_factor)
                common_factor = _common_part(numerator, denominator, modulus)
            else:
                common_factor = _common_part(*residue, modulus)
            power = modulus
            while common_factor != 1:
                numerator, denominator = numerator // common_factor, denominator // common_factor
                if has_full_multiplicity(common_factor, power):
                    break
                power = power * power  # a prime may occur with a high exponent
                common_factor = _common_part(numerator, denominator, power)
            pairs.append((numerator, denominator) if denominator > 0 else (-numerator, -denominator))
        return pairs

    def _fractions_of(self, planes: Sequence[tuple[Sequence[fmpz], fmpz]]) -> list[tuple[fmpz, fmpz]]:
        """Return numerators and denominators of all coordinates, from those of the planes or from their residues."""
        fractions: dict[int, tuple[fmpz, fmpz]] = {}
        rows = self._assembly.rows
        for support, (row_indices, forms) in self._assembly.by_support.items():
            column, product = _scale_to_common_denominator([planes[i] for i in support])
            numerators = (forms * column).entries()
            fractions |= {
                k: (entry, rows[k].denominator * product) for k, entry in zip(row_indices, numerators, strict=True)
            }
        return [fractions[k] for k in range(len(rows))]

    def rationals(self) -> tuple[fmpq, ...]:
        """Return the coordinates as fmpq; the constructor of fmpq computes another gcd."""
        return tuple(fmpq(numerator, denominator) for numerator, denominator in self.lowest_terms())


def _scale_to_common_denominator(planes: Sequence[tuple[Sequence[fmpz], fmpz]]) -> tuple[fmpz_mat, fmpz]:
    """Return the numerators of each plane times the W of all other planes, in one column, and the product of all W."""
    *products_before, product = accumulate((W for _, W in planes), mul, initial=fmpz(1))
    products_after = [*accumulate((W for _, W in planes[:0:-1]), mul, initial=fmpz(1))][::-1]
    factors = (before * after for before, after in zip(products_before, products_after, strict=True))
    column = [entry * factor for (numerators, _), factor in zip(planes, factors, strict=True) for entry in numerators]
    return fmpz_mat(len(column), 1, column), product


def _common_part(numerator: fmpz, denominator: fmpz, modulus: fmpz) -> fmpz:
    """Return the greatest common factor of two numbers and the modulus; high powers of a prime may be missed."""
    gcd = modulus.gcd(numerator % modulus)
    return gcd if gcd == 1 else gcd.gcd(denominator % gcd)


class NormalSteps:
    """Orbits of Phi(., eps) over Q in a normal form; the time step is 2 eps.

    >>> from itertools import islice
    >>> from kahanmaps.family.random_members import random_member_with_eigenvalues
    >>> from kahanmaps.family.system_normal_form import system_normal_form
    >>> from kahanmaps.maps.kahan import KahanMap
    >>> system = random_member_with_eigenvalues([1, -2], seed=7).chosen.system
    >>> first, second = islice(NormalSteps(system_normal_form(system), fmpq(1, 10)).points([1, 0, "1/2", 0]), 2)
    >>> second.rationals() == KahanMap(system, "1/10").step(first.rationals())
    True
    """

    def __init__(self, normal_form: SystemNormalForm, eps: fmpq) -> None:
        self.splitting = Splitting(normal_form.form, QQ, eps, normal_form.T)
        self._eps = eps

    def blocks(self, start: Sequence[Any]) -> tuple[list[Block], Assembly]:
        """Return the blocks of the planes, with the initial point in each, and the conversion of triples to x."""
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
        """Yield the points of the orbit of `start`, as long as the map is defined."""
        blocks, assembly = self.blocks(start)
        for triples_at_step in zip(*(triples(block) for block in blocks), strict=False):
            yield PlanesPoint(assembly, triples_at_step)
