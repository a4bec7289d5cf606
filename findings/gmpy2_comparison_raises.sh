#!/usr/bin/env bash
# gmpy2's rational numbers beside those of the standard library.
#
# Expected: mpq -> Fraction -> mpq is the identity; == between an mpq and a Fraction or a Decimal is True or False, as
#           it is between a Fraction and a Decimal; statistics.mean of mpq is the mean, as its median is the median.
# Seen:     a Fraction made of an mpq prints and hashes like every other, and mpq() of it is a SystemError, as are sums
#           and == with it: its numerator is an mpz, and the reader wants an int. statistics.mean makes such a
#           Fraction. == with a Decimal is a TypeError, although mpq(Decimal) works; so a dictionary with a Decimal as
#           a key raises at the look-up of an equal mpq, whose hash is the same, and at no other.
# No report of either was found; the documentation calls mpq a replacement for Fraction.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/python" -m pip install --quiet --disable-pip-version-check gmpy2==2.3.2
"$folder/venv/bin/python" - <<'PYTHON'
import statistics
from decimal import Decimal
from fractions import Fraction

import gmpy2
from gmpy2 import mpq, mpz

print("gmpy2", gmpy2.version())


def attempt(label, call, expected):
    try:
        seen = repr(call())
    except Exception as error:
        seen = f"{type(error).__name__}: {error}"
    print(f"  {label:46} expected {expected!r:16} seen {seen}")
    return seen


third, half = mpq(1, 3), mpq(1, 2)
fraction = Fraction(third)
assert fraction == Fraction(1, 3) and hash(fraction) == hash(Fraction(1, 3))
assert type(fraction.numerator) is type(mpz(1))
assert mpq(Fraction(1, 3)) == third and mpq(Decimal("0.5")) == half and Fraction(1, 2) == Decimal("0.5")
assert statistics.median([third, mpq(2, 3)]) == half and half not in {Decimal("0.25"): 1}
keys = {Decimal("0.5"): 1}
internal = [
    attempt("mpq(Fraction(mpq(1, 3)))", lambda: mpq(fraction), third),
    attempt("mpq(1, 3) == Fraction(mpq(1, 3))", lambda: third == fraction, True),
    attempt("mpq(1, 3) + Fraction(mpq(1, 3))", lambda: third + fraction, mpq(2, 3)),
    attempt("statistics.mean([mpq(1, 3), mpq(2, 3)])", lambda: statistics.mean([third, mpq(2, 3)]), half),
]
refused = [
    attempt("mpq(1, 2) == Decimal('0.5')", lambda: half == Decimal("0.5"), True),
    attempt("mpz(1) == Decimal(1)", lambda: mpz(1) == Decimal(1), True),
    attempt("mpq(1, 2) in {Decimal('0.5'): 1}", lambda: half in keys, True),
]
assert set(internal) == {"SystemError: Object does not appear to be Fraction"}
assert set(refused) == {"TypeError: argument must be an integer"}
print("seen: comparisons that raise")
PYTHON
# Here: nothing depends on it; the rational numbers are those of FLINT, and Fraction where they leave the library.
