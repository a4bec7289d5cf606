"""The options of all tasks: an option of one name has the same meaning in every task, and its values are exact.

An option converts a value in a spec to canonical plain data: exact numbers become text, so that 0.1 and 1/10 give the
same task. In the worker process it converts these data to an argument of a library function.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from flint import fmpq

from kahanmaps.algebra.fields import GF, RR, rational
from kahanmaps.algebra.parsing import parse_number, parse_point
from kahanmaps.algebra.printing import format_number, format_point, format_univariate
from kahanmaps.algebra.work import LEAST_EFFORT, MOST_EFFORT
from kahanmaps.errors import InputError, show, suggestion
from kahanmaps.family.random_members import MAX_M, parse_chi

_MAX_INTEGER = 2**63 - 1
_MAX_PRIME_BITS = 192  # maximal number of bits of the option prime
_TIME_UNITS = {"s": 1, "min": 60, "h": 3600, "d": 86400}
_MEMORY_UNITS = {"kB": 10**3, "MB": 10**6, "GB": 10**9, "TB": 10**12, "KiB": 2**10, "MiB": 2**20, "GiB": 2**30}
_MAX_SECONDS, _MAX_BYTES = 10**9, 10**18  # upper bounds of time and memory limits; system calls accept these
_NO_LIMIT = "none"
_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]{0,99}")
_ARITHMETIC = re.compile(r"exact|float|(mod|ball):[1-9][0-9]{0,1999}")


@dataclass(frozen=True)
class Option:
    """An option of tasks.

    `read` converts a value in a spec to plain data, or raises InputError. `make` converts these data to an argument of
    a library function. The plain value None means that the option is not given. If `numbers`, values may be ranges
    "a..b step c".
    """

    name: str
    help: str
    read: Callable[[Any], Any]
    make: Callable[[Any], Any]
    numbers: bool = False


def exact(name: str, help: str, *, zero: bool = True) -> Option:
    """Return an option whose value is rational (0 is allowed if `zero`); its canonical form is text in lowest terms."""

    def read(value: Any) -> str:
        number = number_of(value)
        if number == 0 and not zero:
            raise InputError("found 0, expected another number: at eps = 0 the Kahan map is the identity")
        return format_number(number)

    return Option(name, help, read, parse_number, numbers=True)


def integer(name: str, help: str, minimum: int = 0, maximum: int = _MAX_INTEGER) -> Option:
    """Return an option whose value is an integer from `minimum` to `maximum`."""

    def read(value: Any) -> int:
        return _read_integer(value, f"an integer from {minimum} to {maximum}", range(minimum, maximum + 1))

    return Option(name, help, read, int, numbers=True)


def flag(name: str, help: str) -> Option:
    """Return an option whose value is true or false."""

    def read(value: Any) -> bool:
        if not isinstance(value, bool):
            raise InputError(f"found {show(value)}, expected true or false")
        return value

    return Option(name, help, read, bool)


def choice(name: str, help: str, choices: Sequence[str]) -> Option:
    """Return an option whose value is one of `choices`."""

    def read(value: Any) -> str:
        if value not in choices:
            raise InputError(f"found {show(value)}, expected one of {', '.join(choices)}{suggestion(value, choices)}")
        return str(value)

    return Option(name, help, read, str)


def point(name: str, help: str, max_count: int | None = None) -> Option:
    """Return an option whose value is a text with numbers separated by commas; a list would mean several points."""

    def read(value: Any) -> str:
        numbers = parse_point(_require_text(value, 'numbers separated by commas in one text, e.g. "1/2,-1/3"'))
        if max_count is not None and len(numbers) > max_count:
            raise InputError(f"found {len(numbers)} numbers, expected at most {max_count}")
        return format_point(numbers)

    return Option(name, help, read, parse_point)


def integers(name: str, help: str, expected: str, allowed: Sequence[int], is_ordered: bool = False) -> Option:
    """Return an option whose value is a text of integers separated by commas, or a single integer.

    Unless `is_ordered`, the integers form a set, whose canonical form is increasing and without repetitions.
    """

    def read(value: Any) -> str:
        items = parse_point(value) if isinstance(value, str) else (value,)
        numbers = [_read_integer(number, f"{expected}, separated by commas in one text", allowed) for number in items]
        return ",".join(map(str, numbers if is_ordered else sorted(set(numbers))))

    return Option(name, help, read, lambda value: tuple(int(number) for number in value.split(",")))


def _read_arithmetic(value: Any) -> str:
    if not isinstance(value, str) or not _ARITHMETIC.fullmatch(value):
        raise InputError(f"found {show(value)}, expected exact, float, mod:P or ball:BITS")
    kind, _, number = value.partition(":")
    if kind == "mod":
        GF(int(number))
    if kind == "ball":
        RR(int(number))
    return value


def _read_prime(value: Any) -> str:
    expected = f"a prime of at most {_MAX_PRIME_BITS} bits"
    number = _read_integer(value, expected, range(2, 1 << _MAX_PRIME_BITS))
    GF(number)
    return str(number)  # a text, since JSON and databases may be unable to represent a long integer


def _read_names(value: Any) -> str:
    if "eps" in (names := _read_names_or_eps(value)).split(","):
        raise InputError("found eps, expected names of parameters: eps is symbolic whenever it has no value")
    return names


def _read_names_or_eps(value: Any) -> str:
    expected = 'names of parameters in one text, e.g. "a1,a2"'
    names = sorted({name.strip() for name in _require_text(value, expected).split(",")})
    for name in names:
        if not _NAME.fullmatch(name):
            raise InputError(f"found the name {show(name)}, expected {expected}")
    return ",".join(names)


def _read_chi(value: Any) -> str:
    polynomial = parse_chi(_require_text(value, 'a polynomial in t, as text, e.g. "t^2 - 2"'))
    if polynomial.degree() > MAX_M:
        raise InputError(f"found a polynomial of degree {polynomial.degree()}, expected at most {MAX_M}")
    return format_univariate(polynomial / polynomial.leading_coefficient())


def _require_text(value: Any, expected: str) -> str:
    if not isinstance(value, str):
        raise InputError(f"found {show(value)}, expected {expected}")
    return value


def _read_integer(value: Any, expected: str, allowed: Sequence[int]) -> int:
    number = number_of(value)
    if number.q != 1 or int(number.p) not in allowed:
        raise InputError(f"found {show(number)}, expected {expected}")
    return int(number.p)


def number_of(value: Any) -> fmpq:
    """Return the exact number that a value of a spec denotes. Raises InputError for tables, lists, dates and flags."""
    if isinstance(value, bool) or not isinstance(value, int | str | fmpq):
        raise InputError(f"found {show(value)}, expected a number")
    return rational(value)


def read_time(value: Any) -> float | None:
    """Return a time in seconds, read from a number of seconds or a text such as "90 s", "2 h"; None for "none".

    >>> read_time("1.5 min"), read_time("none")
    (90.0, None)
    """
    expected = "seconds, or a text like 90 s, 5 min, 2 h, none"
    seconds = _read_amount(value, _TIME_UNITS, expected, Fraction(1, 1000), _MAX_SECONDS)
    return None if seconds is None else float(seconds)


def read_memory(value: Any) -> int | None:
    """Return a memory size in bytes, read from a number of bytes or a text such as "2 GiB"; None for "none".

    >>> read_memory("1.5 GB")
    1500000000
    """
    expected = "bytes, or a text like 500 MB, 2 GB, 1 GiB, none"
    size = _read_amount(value, _MEMORY_UNITS, expected, Fraction(1), _MAX_BYTES)
    return None if size is None else int(size)


def _read_amount(value: Any, units: Mapping[str, int], expected: str, least: Fraction, maximum: int) -> Fraction | None:
    if value == _NO_LIMIT:
        return None
    text = value if isinstance(value, str) else show(value)
    match = re.fullmatch(r"\s*([0-9]{1,18}(?:\.[0-9]{1,9})?(?:[eE][+-]?[0-9]{1,2})?)\s*([A-Za-z]*)\s*", text)
    if match is None or (match[2] and match[2] not in units):
        raise ValueError(f"found {show(value)}, expected {expected}")
    amount = Fraction(match[1]) * units.get(match[2], 1)
    if not least <= amount <= maximum:
        unit = "s" if units is _TIME_UNITS else "bytes"
        raise ValueError(f"found {show(value)}, expected {float(least):g} to {float(maximum):g} {unit}, or none")
    return amount


EFFORT = "effort"
OTHER = "other"  # a second system: paths are relative to the folder of the spec; its canonical form is a system spec

VOCABULARY = {
    option.name: option
    for option in (
        exact("eps", "half the time step (exact number): h = 2 eps", zero=False),
        exact("eps2", "half the time step of the second map", zero=False),
        Option(OTHER, "a second system: a file or a name of the catalogue", str, str),
        point("start", "initial point of the orbit (default: random)"),
        integer("steps", "number of steps of the orbit", maximum=10**9),
        integer("orbits", "number of orbits", 1, 10**6),
        exact("box", "bound R for the coordinates of random initial points, from -R to R"),
        integer("every", "measure every N-th point only", 1, 10**9),
        integers("at", "numbers of the iterates to compute", "integers from 0 to 10^18", range(10**18 + 1)),
        integer("seed", "random seed"),
        integer("error_bits", "test random points until the error probability is below 2^-BITS", 1, 10_000),
        integer("max_digits", "stop an orbit at longer numbers", minimum=1),
        choice("method", "method of exact orbits", ("generic", "normal-form", "doubling")),
        Option("arithmetic", "exact, float, mod:P or ball:BITS", _read_arithmetic, str),
        Option("prime", "prime of modular arithmetic", _read_prime, int),
        integers(
            "sections",
            "sections of the paper, 1 to 9; 10 is beyond the paper, 11 the question of its conclusions",
            "integers from 1 to 11",
            range(1, 12),
        ),
        integer("order", "number of terms of the series of integrals in eps^2", 1, 20),
        integer("ball_bits", "also compute over complex balls of this number of bits", 32, 100_000),
        flag("controls", "also check every claim on input that violates one hypothesis"),
        flag("report", "store the full report, as printed by --json"),
        integer("m", "half the dimension", 1, 16),
        integer(EFFORT, "work limit of the search: each increment by 1 doubles it", LEAST_EFFORT, MOST_EFFORT),
        integer("terms", "number of degrees to compute (default: until a recurrence is certain)", 1, 10_000),
        integer("max_degree", "largest degree that is searched or measured", maximum=10**6),
        Option(
            "symbolic",
            "parameters that stay symbolic in formulas, e.g. a1,a2",
            _read_names,
            lambda text: text.split(","),
        ),
        Option("over", "parameters that vary, e.g. a1,a2", _read_names_or_eps, lambda text: text.split(",")),
        choice("by", "criterion of a scan: smaller degrees", ("degrees",)),
        integers(
            "primes", "primes modulo which members are tried, at least three", "primes from 5 on", range(5, 1 << 13)
        ),
        choice("shape", "linear: g = B f with a constant B; quadratic: any g", ("linear", "quadratic")),
        integer("samples", "follow this number of random points instead of all points", 1, 100_000),
        integer("transient", "steps before those averaged (default: steps/10)", maximum=10**9),
    )
}

CHI_CHOICES = ("eigenvalues", "generic")
# Options of a random member of the family, except the option seed, which is in VOCABULARY.
FAMILY = {
    option.name: option
    for option in (
        VOCABULARY["m"],
        choice("draw", "eigenvalues (the default): distinct integers; generic: random chi over Z", CHI_CHOICES),
        point("eigenvalues", "the eigenvalues of A", MAX_M),
        Option("chi", "the polynomial chi in t", _read_chi, parse_chi),
        integer("size", "bound for the random integers that give H (default 2, or 1 for generic and chi)", 1, 10**6),
        integers(
            "signs",
            "signs of the associated system: 1 or -1 for each factor of chi",
            "1 or -1",
            (1, -1),
            is_ordered=True,
        ),
    )
}
