#!/usr/bin/env bash
# Factorization of constants in polynomial rings of SageMath (passagemath), in one and in two variables over a field.
#
# Expected: 4 is a unit of QQ[x,y]: its factorization is the unit 4 alone, as in QQ[x], it is square-free, and the
#           least common multiple of 4 and 6 is a unit.
# Seen:     4 = 2^2 in QQ[x,y], and 4 is not square-free; 4/9 = 2^2 * 3^-2. A constant is factored in the field, whose
#           own factorization is that of integers and fractions. 4*x is the unit 4 times x again, and square-free:
#           a divisor of a square-free polynomial is not. lcm(4, 6) is 24, which is neither 1 nor 12.
# So a loop over prime factors that is right for every other polynomial finds "2, twice" in a constant, for example in a
# discriminant that turns out to be constant. is_unit is right. No report of this was found.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/python" -m pip install --quiet --disable-pip-version-check passagemath-singular==10.8.13
"$folder/venv/bin/python" - <<'PYTHON'
from sage.all__sagemath_singular import *
from sage.rings.polynomial.polynomial_ring_constructor import PolynomialRing
from sage.rings.rational_field import QQ
from sage.version import version

print("passagemath-singular", version)
one, two = PolynomialRing(QQ, "x"), PolynomialRing(QQ, ["x", "y"])
print(f"{'':14} {'factor':>10} {'primes':>24} {'square-free':>12} {'unit':>6}")
seen = {}
for label, f in {
    "4 in QQ[x]": one(4),
    "4 in QQ[x,y]": two(4),
    "4/9 in QQ[x,y]": two(QQ(4) / 9),
    "4*x in QQ[x,y]": 4 * two.gen(0),
}.items():
    primes = list(f.factor())
    seen[label] = (primes, f.is_squarefree())
    print(f"{label:14} {str(f.factor()):>10} {str(primes):>24} {str(f.is_squarefree()):>12} {str(f.is_unit()):>6}")
print("expected: the same answers in the first two rows; seen: 2, twice, as a prime factor of a unit")
print("lcm(4, 6) in QQ[x]:", one(4).lcm(one(6)), "  in QQ[x,y]:", two(4).lcm(two(6)), "  gcd:", two(4).gcd(two(6)))
assert seen["4 in QQ[x]"] == ([], True)
assert seen["4 in QQ[x,y]"] == ([(2, 2)], False) and two(4).is_unit()
assert seen["4/9 in QQ[x,y]"][0] == [(2, 2), (3, -2)]
assert seen["4*x in QQ[x,y]"] == ([(two.gen(0), 1)], True)
assert one(4).lcm(one(6)) == 1 and two(4).lcm(two(6)) == 24
PYTHON
# Here: nothing depends on it; content and factors of a polynomial are kept apart.
