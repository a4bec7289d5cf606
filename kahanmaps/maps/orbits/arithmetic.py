"""The arithmetic of an orbit: exact, modulo a prime, in balls, or in floating point."""

from __future__ import annotations

from typing import Any, NamedTuple

from kahanmaps.errors import InputError, quoted

_MAX_DIGITS = 4000  # maximal number of digits of a prime, or of the number of bits of a precision


class Arithmetic(NamedTuple):
    """A number system: "exact", "float", "mod" with the prime `number`, or "ball" with `number` bits (0: automatic).

    >>> Arithmetic.parse("mod:101"), str(Arithmetic.parse("ball:auto"))
    (Arithmetic(kind='mod', number=101), 'ball:auto')
    """

    kind: str
    number: int = 0

    @classmethod
    def parse(cls, text: str) -> Arithmetic:
        """Parse exact, float, mod:P, ball:BITS or ball:auto. Raises InputError for any other text."""
        kind, colon, number = text.partition(":")
        if kind in ("exact", "float") and not colon:
            return cls(kind)
        if text == "ball:auto":
            return cls("ball")
        is_integer = number.isascii() and number.isdigit() and len(number) <= _MAX_DIGITS
        if kind in ("mod", "ball") and is_integer and int(number) > 0:
            return cls(kind, int(number))
        raise InputError(f"found {quoted(text)}, expected exact, float, mod:P with a prime P, ball:BITS or ball:auto")

    @classmethod
    def of(cls, value: Any) -> Arithmetic:
        """Return the arithmetic for a text, a field or the type `float`. Raises InputError for any other value.

        >>> str(Arithmetic.of("exact")), str(Arithmetic.of(float))
        ('exact', 'float')
        """
        from kahanmaps.algebra.etale import EtaleAlgebra
        from kahanmaps.algebra.fields import QQ, BallField, ComplexBallField, PrimeField

        if isinstance(value, Arithmetic):
            return value
        if isinstance(value, str):
            return cls.parse(value)
        if isinstance(value, PrimeField):
            return cls("mod", value.characteristic)
        if isinstance(value, BallField | ComplexBallField):
            return cls("ball", value.bits)
        if value is QQ or value is float or isinstance(value, EtaleAlgebra):
            return cls("float" if value is float else "exact")
        raise InputError(
            f"found the arithmetic {value!r}, expected exact, float, mod:P, ball:BITS or ball:auto as text, or a field"
            ": QQ, GF(p), RR(bits), CC(bits) or a number field"
        )

    @property
    def field(self) -> Any:
        """The field, for example GF(p). Raises InputError for floats, and if P is not a prime."""
        from kahanmaps.algebra.fields import GF, QQ, RR  # imported here, so that parsing an option stays fast

        if self.kind == "exact":
            return QQ
        if self.kind == "mod":
            return GF(self.number)
        if self.kind == "ball":
            return RR(self.number)
        raise InputError("floating-point numbers are not a field: use exact, mod:P or ball:BITS")

    def __str__(self) -> str:
        if self.kind in ("exact", "float"):
            return self.kind
        return f"{self.kind}:{self.number or 'auto'}"
