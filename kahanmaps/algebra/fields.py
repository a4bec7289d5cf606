"""The fields of numbers: the rationals QQ, the prime fields GF(p), real balls RR(bits) and complex balls CC(bits).

These fields, and those in duals.py, etale.py, functions.py and bounds.py, implement one protocol, `Field`, so that the
Kahan map is written once for all fields. Elements of the fields in this file are FLINT's numbers with the usual
operators (`fmpq`, `nmod` for p < 2^63, `fmpz_mod` for larger p, `arb`, `acb`); the methods of a field are operations
that have different names for these types. `convert` accepts exact numbers only: text, integers and fractions, not
floats. `Element` is the base class of elements that are not FLINT's.
"""

from __future__ import annotations

import random
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext
from decimal import Decimal
from functools import lru_cache
from numbers import Rational
from operator import index
from typing import Any, Self

import flint
from flint import acb, acb_mat, arb, arb_mat, fmpq, fmpq_mat, fmpz, fmpz_mod, fmpz_mod_ctx, fmpz_mod_mat, nmod, nmod_mat

from kahanmaps.algebra.parsing import parse_number
from kahanmaps.algebra.printing import format_number
from kahanmaps.errors import BadPrime, InexactNumber, InputError, PrecisionLost

# FLINT proves that a number of 512 bits is prime in about 0.1 s; the time grows steeply with the number of bits.
MAX_PRIME_BITS = 512
MAX_BALL_BITS = 1_000_000  # largest precision of balls


def rational(value: Any) -> fmpq:
    """Convert a value to an exact rational number.

    Accepts int, Fraction, Decimal, text (`"1/3"`, `"0.1"`), fmpz, fmpq, and every `numbers.Rational`, such as rational
    numbers of SymPy and integers of numpy. Raises `InexactNumber` for floats: the float 0.1 is not 1/10.

    >>> rational("0.1")
    1/10
    >>> rational(0.1)  # doctest: +ELLIPSIS
    Traceback (most recent call last):
        ...
    kahanmaps.errors.InexactNumber: found the floating-point number 0.1, expected an exact one: write an integer, ...
    """
    if isinstance(value, fmpq):
        return value
    if isinstance(value, str):
        return parse_number(value)
    if isinstance(value, bool):
        raise InputError(f"found {value}, expected a number")
    if isinstance(value, int | fmpz):
        return fmpq(value)
    numpy_kind = _numpy_kind(value)
    if numpy_kind and numpy_kind in "biuO":
        return rational(value.item())
    if numpy_kind and numpy_kind not in "fc":
        raise InputError(f"found {value!r} of numpy, expected one exact number")
    if isinstance(value, Decimal) and value.is_finite():
        return fmpq(*value.as_integer_ratio())
    if isinstance(value, Rational):
        return fmpq(int(value.numerator), int(value.denominator))
    if isinstance(value, float | complex) or numpy_kind:
        example = str(value)  # the example in the message is 1/10 for nan, inf and 1j
        try:
            parse_number(example)
        except InputError:
            example = "1/10"
        raise InexactNumber(
            f"found the floating-point number {value!s}, expected an exact one: "
            f'write an integer, p/q or a decimal as text, e.g. "{example}"'
        )
    if value is None:
        raise InputError('found None, expected an exact number, e.g. eps="1/10"')
    raise InputError(f"found {value!r} of type {type(value).__name__}, expected an exact number")


def integer(value: Any, name: str) -> int:
    """Convert an integer of Python, FLINT, numpy or SymPy to int. Raises InputError, which names `name`, for others.

    >>> integer(7, "m")
    7
    >>> integer(True, "m")
    Traceback (most recent call last):
        ...
    kahanmaps.errors.InputError: found m = True, expected an integer
    """
    if not isinstance(value, bool) and _numpy_kind(value) in ("", "i", "u"):
        try:
            return index(value)
        except TypeError:
            pass
    raise InputError(f"found {name} = {value!r}, expected an integer")


def _numpy_kind(value: Any) -> str:
    """Return the kind of a numpy scalar (b, i, u, f, c, O, ...), "array" for an array, "" for other objects."""
    if not hasattr(value, "dtype") or not hasattr(value, "ndim"):
        return ""
    return str(value.dtype.kind) if value.ndim == 0 else "array"


class Field(ABC):
    """A field of numbers; `exact` is True if equality of two elements is decidable."""

    name: str
    characteristic: int
    exact: bool = True

    @property
    @abstractmethod
    def zero(self) -> Any:
        """The element 0."""

    @property
    @abstractmethod
    def one(self) -> Any:
        """The element 1."""

    @abstractmethod
    def convert(self, value: Any) -> Any:
        """Convert an exact number (int, Fraction, text, fmpz, fmpq), or an element, to an element of this field."""

    def format(self, element: Any) -> str:
        """Return the element as text. In exact fields `convert` accepts this text."""
        return str(element)

    def random(self, rng: random.Random, height: int = 10) -> Any:
        """Return a random element: a rational number of height at most `height`, or any residue modulo p."""
        return self.convert(fmpq(rng.randint(-height, height), rng.randint(1, height)))

    def value(self, polynomial: Any, point: Sequence[Any]) -> Any:
        """Return the value of a polynomial at `point`; None if the field leaves this to `polynomials.evaluate`."""
        return None

    @abstractmethod
    def matrix(self, rows: int, columns: int, entries: Sequence[Any]) -> Any:
        """Return a matrix over this field with these entries (row by row), of FLINT's type or an `EntryMatrix`."""

    def column(self, entries: Sequence[Any]) -> Any:
        """Return the entries as a matrix with one column."""
        return self.matrix(len(entries), 1, entries)

    def identity(self, size: int) -> Any:
        """Return the identity matrix."""
        return self.matrix(size, size, [self.one if i == j else self.zero for i in range(size) for j in range(size)])

    def convert_matrix(self, matrix: fmpq_mat) -> Any:
        """Convert a matrix of rational numbers to this field."""
        return self.matrix(matrix.nrows(), matrix.ncols(), [self.convert(entry) for entry in matrix.entries()])

    def is_zero(self, element: Any) -> bool:
        """Whether the element is certainly zero."""
        return bool(element == 0)

    def equal(self, left: Any, right: Any) -> bool:
        """Whether two elements are equal; for balls, whether they overlap (the enclosed numbers may be equal)."""
        return bool(left == right)

    def working(self) -> AbstractContextManager[Any]:
        """Return the context in which the arithmetic of this field must run; for balls, it sets the precision."""
        return nullcontext()

    def __repr__(self) -> str:
        return self.name


def operand(field: Field, value: Any) -> Any:
    """Convert an operand of + - * / to an element of `field`; return None for text, matrices and other objects.

    Raises `InexactNumber` and `BadPrime` like `convert`.
    """
    if isinstance(value, str):
        return None
    try:
        return field.convert(value)
    except (InexactNumber, BadPrime):
        raise
    except InputError:
        return None


class Element(ABC):
    """An element of a type that FLINT lacks. Subclasses define sum, product, quotient and equality of two elements.

    The second operand may be any number or element that `field.convert` accepts, but not text.
    """

    __slots__ = ("field",)

    field: Any

    @abstractmethod
    def _add(self, other: Self) -> Self:
        """Return the sum of two elements of one field."""

    @abstractmethod
    def _multiply(self, other: Self) -> Self:
        """Return the product of two elements of one field."""

    @abstractmethod
    def _divide(self, other: Self) -> Self:
        """Return the quotient of two elements of one field. Raises ZeroDivisionError."""

    @abstractmethod
    def _equals(self, other: Self) -> bool:
        """Whether two elements of one field are equal."""

    @abstractmethod
    def __neg__(self) -> Self: ...

    def _common_operands(self, other: Any) -> tuple[Self, Self] | None:
        """Return self and other as elements of one of their two fields; None if neither field accepts both."""
        if isinstance(other, type(self)) and other.field is self.field:
            return self, other
        right = operand(self.field, other)
        if right is not None:
            return self, right
        # Python calls no reflected method for operands of equal types, so the field of `other` is tried here.
        left = operand(other.field, self) if isinstance(other, type(self)) else None
        return None if left is None else (left, other)

    def __add__(self, other: Any) -> Self:
        operands = self._common_operands(other)
        return NotImplemented if operands is None else operands[0]._add(operands[1])

    __radd__ = __add__

    def __sub__(self, other: Any) -> Self:
        operands = self._common_operands(other)
        return NotImplemented if operands is None else operands[0]._add(-operands[1])

    def __rsub__(self, other: Any) -> Self:
        operands = self._common_operands(other)
        return NotImplemented if operands is None else operands[1]._add(-operands[0])

    def __mul__(self, other: Any) -> Self:
        operands = self._common_operands(other)
        return NotImplemented if operands is None else operands[0]._multiply(operands[1])

    __rmul__ = __mul__

    def __truediv__(self, other: Any) -> Self:
        operands = self._common_operands(other)
        return NotImplemented if operands is None else operands[0]._divide(operands[1])

    def __rtruediv__(self, other: Any) -> Self:
        operands = self._common_operands(other)
        return NotImplemented if operands is None else operands[1]._divide(operands[0])

    def __pow__(self, exponent: int) -> Self:
        if isinstance(exponent, bool) or not isinstance(exponent, int):
            return NotImplemented
        one: Self = self.field.one
        if exponent < 0:
            return one._divide(self) ** -exponent
        power, square = one, self
        while exponent:
            if exponent % 2:
                power = power._multiply(square)
            exponent //= 2
            if exponent:
                square = square._multiply(square)
        return power

    def __eq__(self, other: object) -> bool:
        try:
            operands = self._common_operands(other)
        except InputError:
            return NotImplemented
        return NotImplemented if operands is None else operands[0]._equals(operands[1])

    __hash__ = None  # type: ignore[assignment]  # an element may equal a number that has another hash

    def __repr__(self) -> str:
        text: str = self.field.format(self)
        return text


class RationalField(Field):
    """The field of rational numbers; elements are fmpq.

    >>> QQ.convert("0.5") + QQ.one
    3/2
    """

    name = "QQ"

    def __reduce__(self) -> str:
        return "QQ"  # unpickling returns the same object, since code tests `field is QQ`

    characteristic = 0

    @property
    def zero(self) -> fmpq:
        return fmpq(0)

    @property
    def one(self) -> fmpq:
        return fmpq(1)

    def convert(self, value: Any) -> fmpq:
        return rational(value)

    def format(self, element: fmpq) -> str:
        return format_number(element)

    def matrix(self, rows: int, columns: int, entries: Sequence[Any]) -> fmpq_mat:
        return fmpq_mat(rows, columns, [rational(entry) for entry in entries])

    def convert_matrix(self, matrix: fmpq_mat) -> fmpq_mat:
        return matrix


class PrimeField(Field):
    """The field of p elements, made by `GF`. Elements are nmod for p < 2^63, and fmpz_mod for larger p."""

    def __reduce__(self) -> tuple[Any, ...]:
        return GF, (self.characteristic,)

    def __init__(self, prime: int) -> None:
        self.prime = prime
        self.characteristic = prime
        self.name = f"GF({prime})"
        self._context = fmpz_mod_ctx(prime) if prime >= 2**63 else None
        self._zero = self._element(0)
        self._one = self._element(1)

    def _element(self, value: int | fmpz) -> Any:
        if self._context is not None:
            return self._context(value)
        return nmod(value, self.prime)

    @property
    def zero(self) -> Any:
        return self._zero

    @property
    def one(self) -> Any:
        return self._one

    def convert(self, value: Any) -> Any:
        if isinstance(value, nmod):
            if self._context is None and value.modulus() == self.prime:
                return value
            raise InputError(f"found an element of another field, expected one of {self.name}")
        if isinstance(value, fmpz_mod):
            try:
                return value + self._zero  # raises if the moduli differ; FLINT has no function to read a modulus
            except (TypeError, ValueError) as error:
                raise InputError(f"found an element of another field, expected one of {self.name}") from error
        if isinstance(value, int | fmpz) and not isinstance(value, bool):
            return self._element(value)
        number = rational(value)
        try:
            return (
                self._element(number.p) / self._element(number.q)
                if self._context is not None
                else nmod(number, self.prime)
            )
        except ZeroDivisionError:
            text = format_number(number)
            text = text if len(text) <= 40 else f"{text[:20]}...{text[-20:]}"
            raise BadPrime(
                f"the prime {self.prime} divides the denominator of {text}: use another prime", self.prime
            ) from None

    def random(self, rng: random.Random, height: int = 10) -> Any:
        return self._element(rng.randrange(self.prime))

    def matrix(self, rows: int, columns: int, entries: Sequence[Any]) -> Any:
        if self._context is not None:
            return fmpz_mod_mat(rows, columns, [self.convert(entry) for entry in entries], self._context)
        p, convert = self.prime, self.convert  # local names: large systems spend much time in the next loop
        elements = [e if type(e) is nmod and e.modulus() == p else convert(e) for e in entries]
        return nmod_mat(rows, columns, elements, p)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, PrimeField) and other.prime == self.prime

    def __hash__(self) -> int:
        return hash(("GF", self.prime))


class _Balls(Field):
    """The common base class of the fields of real and complex balls: each result encloses the exact number.

    A ball that contains zero and other numbers is neither zero nor invertible: `is_zero` raises `PrecisionLost`.
    """

    exact = False
    characteristic = 0
    _symbol: str
    _element_type: Callable[..., Any]
    _matrix_type: Callable[..., Any]

    def __init__(self, bits: int) -> None:
        self.bits = bits
        self.name = f"{self._symbol}({bits})"

    @property
    def zero(self) -> Any:
        return self._element_type(0)

    @property
    def one(self) -> Any:
        return self._element_type(1)

    def matrix(self, rows: int, columns: int, entries: Sequence[Any]) -> Any:
        return self._matrix_type(rows, columns, [self.convert(entry) for entry in entries])

    def format(self, element: Any) -> str:
        """Return midpoint and radius as text, e.g. `[0.333333 +/- 1.0e-6]`."""
        with self.working():
            return str(element.str(max(1, int(self.bits * 0.30103))))

    def is_zero(self, element: Any) -> bool:
        if element.is_zero():
            return True
        if element.contains(0):
            raise PrecisionLost(f"a number with {self.bits} bits cannot be distinguished from zero: use more bits")
        return False

    def equal(self, left: Any, right: Any) -> bool:
        if not (left.is_finite() and right.is_finite()):  # for FLINT, infinite balls and nan overlap everything
            raise PrecisionLost(f"a ball with {self.bits} bits has become infinite: use more bits")
        return bool(left.overlaps(right))

    def working(self) -> AbstractContextManager[Any]:
        # flint.ctx.prec is global to the process, so it is set only during each computation.
        return flint.ctx.workprec(self.bits)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Balls) and (other._symbol, other.bits) == (self._symbol, self.bits)

    def __hash__(self) -> int:
        return hash((self._symbol, self.bits))


class BallField(_Balls):
    """The field of real balls with `bits` bits of precision, made by `RR`; elements are arb."""

    _symbol, _element_type, _matrix_type = "RR", arb, arb_mat

    def convert(self, value: Any) -> arb:
        if isinstance(value, arb):
            return value
        with self.working():
            return arb(rational(value))


class ComplexBallField(_Balls):
    """The field of complex balls, made by `CC`; an element (acb) is a rectangle given by two real balls."""

    _symbol, _element_type, _matrix_type = "CC", acb, acb_mat

    def convert(self, value: Any) -> acb:
        """Convert an exact number, a real ball or a complex ball to an element."""
        if isinstance(value, acb):
            return value
        return acb(RR(self.bits).convert(value))


QQ = RationalField()


def GF(prime: int) -> PrimeField:
    """Return the field of `prime` elements.

    Raises InputError if the number is not a prime: FLINT would abort the process for a composite modulus.

    >>> GF(7).convert("1/3")
    5
    >>> GF(91)
    Traceback (most recent call last):
        ...
    kahanmaps.errors.InputError: found the modulus 91, expected a prime: 91 is composite
    """
    return _prime_field(integer(prime, "the modulus"))


@lru_cache(maxsize=256)
def _prime_field(prime: int) -> PrimeField:
    if prime < 2:
        raise InputError(f"found the modulus {prime}, expected a prime, at least 2")
    if prime.bit_length() > MAX_PRIME_BITS:
        raise InputError(f"found a modulus of {prime.bit_length()} bits, expected at most {MAX_PRIME_BITS}")
    if not fmpz(prime).is_prime():
        raise InputError(f"found the modulus {prime}, expected a prime: {prime} is composite")
    return PrimeField(prime)


@lru_cache(maxsize=64)
def RR(bits: int) -> BallField:
    """Return the field of real balls with `bits` bits of precision (2 to 1,000,000).

    >>> RR(64).convert("1/3") * 3 == 1, RR(64).equal(RR(64).convert("1/3") * 3, RR(64).one)
    (False, True)
    """
    _check_bits(bits)
    return BallField(bits)


@lru_cache(maxsize=64)
def CC(bits: int) -> ComplexBallField:
    """Return the field of complex balls with `bits` bits of precision (2 to 1,000,000).

    >>> CC(64).equal(CC(64).convert(acb(1, 2)) * CC(64).convert(acb(1, -2)), CC(64).convert(5))
    True
    """
    _check_bits(bits)
    return ComplexBallField(bits)


def _check_bits(bits: int) -> None:
    if isinstance(bits, bool) or not isinstance(bits, int) or not 2 <= bits <= MAX_BALL_BITS:
        raise InputError(f"found the precision {bits!r}, expected an integer from 2 to {MAX_BALL_BITS} bits")
