"""In which numbers an orbit is computed."""

from __future__ import annotations

from typing import Any, NamedTuple

from kahanmaps.errors import InputError, quoted

_LONGEST = 4000  # digits of a prime or of a number of bits


class Arithmetic(NamedTuple):
    """A kind of numbers: "exact", "float", "mod" with a prime, "ball" with a number of bits (0: as many as needed).

    >>> Arithmetic.parse("mod:101"), str(Arithmetic.parse("ball:auto"))
    (Arithmetic(kind='mod', number=101), 'ball:auto')
    """

    kind: str
    number: int = 0

    @classmethod
    def parse(cls, text: str) -> Arithmetic:
        """The arithmetic written as exact, float, mod:P, ball:BITS or ball:auto. Raises InputError for other text."""
        kind, colon, number = text.partition(":")
        if kind in ("exact", "float") and not colon:
            return cls(kind)
        if text == "ball:auto":
            return cls("ball")
        is_whole = number.isascii() and number.isdigit() and len(number) <= _LONGEST
        if kind in ("mod", "ball") and is_whole and int(number) > 0:
            return cls(kind, int(number))
        raise InputError(f"found {quoted(text)}, expected exact, float, mod:P with a prime P, ball:BITS or ball:auto")

    @classmethod
    def of(cls, given: Any) -> Arithmetic:
        """The arithmetic that a text, a field or `float` stands for. Raises InputError for anything else.

        >>> str(Arithmetic.of("exact")), str(Arithmetic.of(float))
        ('exact', 'float')
        """
        from kahanmaps.algebra.etale import EtaleAlgebra
        from kahanmaps.algebra.fields import QQ, BallField, ComplexBallField, PrimeField

        if isinstance(given, Arithmetic):
            return given
        if isinstance(given, str):
            return cls.parse(given)
        if isinstance(given, PrimeField):
            return cls("mod", given.characteristic)
        if isinstance(given, BallField | ComplexBallField):
            return cls("ball", given.bits)
        if given is QQ or given is float or isinstance(given, EtaleAlgebra):
            return cls("float" if given is float else "exact")
        raise InputError(
            f"found the arithmetic {given!r}, expected exact, float, mod:P, ball:BITS or ball:auto as text, or a field"
            ": QQ, GF(p), RR(bits), CC(bits) or a number field"
        )

    @property
    def field(self) -> Any:
        """The field, GF(p) for example. Raises InputError where there is none: for a P that is no prime, and floats."""
        from kahanmaps.algebra.fields import GF, QQ, RR  # here, so that reading an option loads no arithmetic

        if self.kind == "exact":
            return QQ
        if self.kind == "mod":
            return GF(self.number)
        if self.kind == "ball":
            return RR(self.number)
        raise InputError("machine numbers are no field: take exact, mod:P or ball:BITS")

    def __str__(self) -> str:
        if self.kind in ("exact", "float"):
            return self.kind
        return f"{self.kind}:{self.number or 'auto'}"
