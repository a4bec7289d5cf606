"""What a task can be asked with: the options of all tasks, one meaning for each name, read exactly.

An option reads what a spec says into canonical plain data (exact numbers as text, so that 0.1 and 1/10 are the same
task), and makes of it, in the child that does the task, what the library wants.
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

_LARGEST = 2**63 - 1
_PRIME_BITS = 192
_TIME_UNITS = {"s": 1, "min": 60, "h": 3600, "d": 86400}
_MEMORY_UNITS = {"kB": 10**3, "MB": 10**6, "GB": 10**9, "TB": 10**12, "KiB": 2**10, "MiB": 2**20, "GiB": 2**30}
_MOST_SECONDS, _MOST_BYTES = 10**9, 10**18  # what system calls take
_NONE = "none"
_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]{0,99}")
_ARITHMETIC = re.compile(r"exact|float|(mod|ball):[1-9][0-9]{0,1999}")


@dataclass(frozen=True)
class Option:
    """An option of tasks: its name, what it is, `read` for what a spec says, `make` for what the library wants.

    `read` gives plain data, or raises InputError; None always stands for "not given". `numbers` says whether ranges
    "a..b step c" may be written.
    """

    name: str
    help: str
    read: Callable[[Any], Any]
    make: Callable[[Any], Any]
    numbers: bool = False


def exact(name: str, help: str, *, zero: bool = True) -> Option:
    """A rational number: canonical is its text in lowest terms."""

    def read(value: Any) -> str:
        number = number_of(value)
        if number == 0 and not zero:
            raise InputError("found 0, expected another number: at eps = 0 the Kahan map is the identity")
        return format_number(number)

    return Option(name, help, read, parse_number, numbers=True)


def whole(name: str, help: str, least: int = 0, most: int = _LARGEST) -> Option:
    """A whole number from `least` to `most`."""

    def read(value: Any) -> int:
        return _whole(value, f"a whole number from {least} to {most}", range(least, most + 1))

    return Option(name, help, read, int, numbers=True)


def flag(name: str, help: str) -> Option:
    """true or false."""

    def read(value: Any) -> bool:
        if not isinstance(value, bool):
            raise InputError(f"found {show(value)}, expected true or false")
        return value

    return Option(name, help, read, bool)


def choice(name: str, help: str, words: Sequence[str]) -> Option:
    """One of some words."""

    def read(value: Any) -> str:
        if value not in words:
            raise InputError(f"found {show(value)}, expected one of {', '.join(words)}{suggestion(value, words)}")
        return str(value)

    return Option(name, help, read, str)


def point(name: str, help: str, most: int | None = None) -> Option:
    """Numbers separated by commas, in one text: a list would be several values."""

    def read(value: Any) -> str:
        numbers = parse_point(_text(value, 'numbers separated by commas in one text, e.g. "1/2,-1/3"'))
        if most is not None and len(numbers) > most:
            raise InputError(f"found {len(numbers)} numbers, expected at most {most}")
        return format_point(numbers)

    return Option(name, help, read, parse_point)


def whole_numbers(name: str, help: str, expected: str, allowed: Sequence[int], ordered: bool = False) -> Option:
    """Whole numbers separated by commas, in one text; a single one may stand without quotes.

    Without `ordered` they are a set: canonical is then in increasing order, every number once.
    """

    def read(value: Any) -> str:
        given = parse_point(value) if isinstance(value, str) else (value,)
        numbers = [_whole(number, f"{expected}, separated by commas in one text", allowed) for number in given]
        return ",".join(map(str, numbers if ordered else sorted(set(numbers))))

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
    expected = f"a prime of at most {_PRIME_BITS} bits"
    number = _whole(value, expected, range(2, 1 << _PRIME_BITS))
    GF(number)
    return str(number)  # not an integer: JSON and databases may hold no long ones


def _read_names(value: Any) -> str:
    if "eps" in (found := _read_names_or_eps(value)).split(","):
        raise InputError("found eps, expected names of parameters: without a value of eps it is in all formulas")
    return found


def _read_names_or_eps(value: Any) -> str:
    expected = 'names of parameters in one text, e.g. "a1,a2"'
    names = sorted({name.strip() for name in _text(value, expected).split(",")})
    for name in names:
        if not _NAME.fullmatch(name):
            raise InputError(f"found the name {show(name)}, expected {expected}")
    return ",".join(names)


def _read_chi(value: Any) -> str:
    polynomial = parse_chi(_text(value, 'a polynomial in t, as text, e.g. "t^2 - 2"'))
    if polynomial.degree() > MAX_M:
        raise InputError(f"found a polynomial of degree {polynomial.degree()}, expected at most {MAX_M}")
    return format_univariate(polynomial / polynomial.leading_coefficient())


def _text(value: Any, expected: str) -> str:
    if not isinstance(value, str):
        raise InputError(f"found {show(value)}, expected {expected}")
    return value


def _whole(value: Any, expected: str, allowed: Sequence[int]) -> int:
    number = number_of(value)
    if number.q != 1 or int(number.p) not in allowed:
        raise InputError(f"found {show(number)}, expected {expected}")
    return int(number.p)


def number_of(value: Any) -> fmpq:
    """The exact number that a value of a spec spells. Raises InputError for tables, lists, dates and flags."""
    if isinstance(value, bool) or not isinstance(value, int | str | fmpq):
        raise InputError(f"found {show(value)}, expected a number")
    return rational(value)


def read_time(value: Any) -> float | None:
    """Seconds, from a number or a text such as "90 s", "5 min", "2 h"; "none" for no limit.

    >>> read_time("1.5 min"), read_time("none")
    (90.0, None)
    """
    expected = "seconds, or a text like 90 s, 5 min, 2 h, none"
    found = _with_unit(value, _TIME_UNITS, expected, Fraction(1, 1000), _MOST_SECONDS)
    return None if found is None else float(found)


def read_memory(value: Any) -> int | None:
    """Bytes, from a number or a text such as "500 MB", "2 GiB"; "none" for no limit.

    >>> read_memory("1.5 GB")
    1500000000
    """
    expected = "bytes, or a text like 500 MB, 2 GB, 1 GiB, none"
    found = _with_unit(value, _MEMORY_UNITS, expected, Fraction(1), _MOST_BYTES)
    return None if found is None else int(found)


def _with_unit(value: Any, units: Mapping[str, int], expected: str, least: Fraction, most: int) -> Fraction | None:
    if value == _NONE:
        return None
    text = value if isinstance(value, str) else show(value)
    found = re.fullmatch(r"\s*([0-9]{1,18}(?:\.[0-9]{1,9})?(?:[eE][+-]?[0-9]{1,2})?)\s*([A-Za-z]*)\s*", text)
    if found is None or (found[2] and found[2] not in units):
        raise ValueError(f"found {show(value)}, expected {expected}")
    amount = Fraction(found[1]) * units.get(found[2], 1)
    if not least <= amount <= most:
        unit = "s" if units is _TIME_UNITS else "bytes"
        raise ValueError(f"found {show(value)}, expected {float(least):g} to {float(most):g} {unit}, or none")
    return amount


EFFORT = "effort"
OTHER = "other"  # read by the spec, which knows where files are; canonical is a recipe like that of the system

VOCABULARY = {
    option.name: option
    for option in (
        exact("eps", "the paper's epsilon; the time step is 2 eps", zero=False),
        exact("eps2", "another eps for the second map", zero=False),
        Option(OTHER, "a second system: a file or a name of the catalogue", str, str),
        point("start", "where the orbit starts (default: drawn from the seed)"),
        whole("steps", "steps of the orbit", most=10**9),
        whole("orbits", "how many orbits", 1, 10**6),
        exact("box", "coordinates of random starts are drawn from -R to R"),
        whole("every", "take every so many steps only", 1, 10**9),
        whole_numbers("at", "iterates to reach directly", "whole numbers from 0 to 10^18", range(10**18 + 1)),
        whole("seed", "seed of everything drawn at random"),
        whole("error_bits", "random points until the probability of error is below 2^-BITS", 1, 10_000),
        whole("max_digits", "digit budget of exact orbits", least=1),
        choice("method", "how an exact orbit is computed", ("generic", "normal-form", "doubling")),
        Option("arithmetic", "exact, float, mod:P or ball:BITS", _read_arithmetic, str),
        Option("prime", "the prime of modular arithmetic", _read_prime, int),
        whole_numbers(
            "sections",
            "sections of the paper, 1 to 9, 10: beyond the paper",
            "whole numbers from 1 to 10",
            range(1, 11),
        ),
        whole("order", "order in eps^2 of the series of the integrals", 1, 20),
        whole("ball_bits", "also over complex balls of so many bits", 32, 100_000),
        flag("controls", "run every claim on input that breaks one hypothesis"),
        flag("report", "keep the whole report, as --json prints it"),
        whole("m", "half the dimension", 1, 16),
        whole(EFFORT, "how much work: each more doubles it, each less halves it", LEAST_EFFORT, MOST_EFFORT),
        whole("terms", "measure so many degrees (default: until a recurrence is certain)", 1, 10_000),
        whole("max_degree", "the largest degree that is tried", most=10**6),
        Option("symbolic", "parameters that formulas contain, e.g. a1,a2", _read_names, lambda text: text.split(",")),
        Option("over", "parameters that vary, e.g. a1,a2", _read_names_or_eps, lambda text: text.split(",")),
        choice("by", "what a scan looks for: smaller degrees", ("degrees",)),
        whole_numbers(
            "primes", "modulo which members are tried, three at least", "primes from 5 on", range(5, 1 << 13)
        ),
        choice("shape", "linear: g = B f with a constant B; quadratic: any g", ("linear", "quadratic")),
        whole("samples", "follow so many random points instead of all", 1, 100_000),
        whole("transient", "steps before those that count (default: a tenth)", most=10**9),
    )
}

DRAWS = ("eigenvalues", "generic")
# What a random member of the family is drawn with; the seed is the one of VOCABULARY.
FAMILY = {
    option.name: option
    for option in (
        VOCABULARY["m"],
        choice("draw", "eigenvalues (the default): distinct integers; generic: a random integer chi", DRAWS),
        point("eigenvalues", "the eigenvalues of A", MAX_M),
        Option("chi", "chi itself, a polynomial in t", _read_chi, parse_chi),
        whole("size", "bound for the integer coefficients drawn (default 2, or 1 for generic and chi)", 1, 10**6),
        whole_numbers(
            "signs",
            "which associated system: 1 or -1 for each factor of chi",
            "1 or -1",
            (1, -1),
            ordered=True,
        ),
    )
}
