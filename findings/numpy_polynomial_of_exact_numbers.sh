#!/usr/bin/env bash
# numpy's Polynomial with exact coefficients, which it keeps as objects.
#
# Expected: a Polynomial of fractions, whose sums, products, quotients and remainders are exact, has exact values and
#           derivatives, as the functions polyval and polyder of the same module and the old poly1d have; if integers
#           of 65 bits are kept exactly, so are those of 61.
# Seen:     values, derivatives and compositions are floats: each goes through the map of [-1., 1.] to [-1., 1.],
#           which is multiplied out in floats. Integers become floats as long as they fit into 64 bits; larger ones,
#           and small ones beside larger ones, are kept exactly, until they meet one that was not.
# With a domain and a window of fractions everything is exact. numpy tests sums and products of fractions; an open
# report says that Decimal coefficients cannot be evaluated; none was found for fractions or integers.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/python" -m pip install --quiet --disable-pip-version-check numpy==2.4.6
"$folder/venv/bin/python" - <<'PYTHON'
from fractions import Fraction as F

import numpy as np
from numpy.polynomial import Polynomial
from numpy.polynomial import polynomial as functions

print("numpy", np.__version__)
coefficients = [F(1, 3), F(1, 2), F(1, 7)]
p = Polynomial(coefficients)
exact = F(1, 3) + F(1, 2) * F(1, 3) + F(1, 7) * F(1, 9)
assert all(isinstance(c, F) for q in (p + p, p * p, p // Polynomial([F(1), F(2)])) for c in q.coef)
print("product:                      ", list(map(str, (p * p).coef)))
print("p(1/3), expected", exact, "  seen:", repr(p(F(1, 3))))
print("p'    , expected 1/2, 2/7  seen:", p.deriv().coef, "of dtype", p.deriv().coef.dtype)
print("polyval:", functions.polyval(F(1, 3), coefficients), " poly1d:", np.poly1d(coefficients[::-1])(F(1, 3)))
assert functions.polyval(F(1, 3), coefficients) == np.poly1d(coefficients[::-1])(F(1, 3)) == exact
assert type(p(F(1, 3))) is np.float64 and all(type(c) is float for c in p.deriv().coef)
ends = [F(-1), F(1)]
q = Polynomial(coefficients, domain=ends, window=ends)
assert q(F(1, 3)) == exact and list(q.deriv().coef) == [F(1, 2), F(2, 7)]
for bits in (53, 60, 63, 64, 70):
    kept = Polynomial([2**bits + 1]).coef[0]
    is_exact = int(kept) == 2**bits + 1
    print(f"2**{bits} + 1, expected exact  seen: {type(kept).__name__:8} {'exact' if is_exact else 'rounded'}")
    assert is_exact == (bits >= 64)
beside = Polynomial([2**60 + 1, 2**64 + 1]).coef[0]
product = (Polynomial([2**64 + 1]) * Polynomial([1, 1])).coef[0]
print("2**60 + 1 beside 2**64 + 1:", beside, "  (2**64 + 1) * (1 + x):", product)
assert beside == 2**60 + 1 and int(product) != 2**64 + 1
PYTHON
# Here: nothing depends on it; polynomials with exact coefficients are those of FLINT.
