#!/usr/bin/env bash
# Formal power series of rational functions in SymPy: the generating functions of linear recurrences.
#
# Expected: the coefficients of 1/(1 - x - x^2) are the Fibonacci numbers 1, 1, 2, 3, 5, 8, ...; those of P/Q satisfy the
#           linear recurrence with the coefficients of Q, and agree with series(), for all P/Q alike.
# Seen:     fps() drops terms of some denominators: 1/(1 - x - x^2) and 1/(1 - x - x^3) become 1 + x + x^2 + x^3 + ...,
#           the series of 1/(1 - x), and 1/(1 + 2 x + 5 x^2) that of 1/(1 + 2 x), with a closed formula for the general
#           coefficient. x/(1 - x - x^2), (1 + x)/(1 - x - x^2) and 1/(1 - 3 x + x^2) are right.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/python" -m pip install --quiet --disable-pip-version-check sympy==1.14.0
"$folder/venv/bin/python" - <<'PYTHON'
import sympy
from sympy import cancel, fps, symbols

print("SymPy", sympy.__version__)
x = symbols("x")


def coefficients(function, count=7):
    """The first coefficients by the recurrence of the denominator, and those of fps."""
    numerator, denominator = (sympy.Poly(part, x) for part in cancel(function).as_numer_denom())
    P, Q = (part.all_coeffs()[::-1] + [0] * count for part in (numerator, denominator))
    true = []
    for k in range(count):
        true.append((P[k] - sum(Q[j] * true[k - j] for j in range(1, k + 1))) / Q[0])
    result = sympy.Poly(fps(function, x).truncate(count).removeO(), x)
    return true, [result.coeff_monomial(x**k) for k in range(count)]


wrong = {
    1 / (1 - x - x**2): 1 / (1 - x),
    1 / (1 - x - x**3): 1 / (1 - x),
    1 / (1 + x + x**2): 1 / (1 + x),
    1 / (1 + 2 * x + 5 * x**2): 1 / (1 + 2 * x),
}
for function, other in wrong.items():
    true, seen = coefficients(function)
    print(f"{function}: expected {true}, seen {seen}, general coefficient {fps(function, x).ak.formula}")
    assert seen != true
    assert seen == coefficients(other)[0]
for function in (x / (1 - x - x**2), (1 + x) / (1 - x - x**2), 1 / (1 - 3 * x + x**2), 1 / (1 - 2 * x - x**2)):
    true, seen = coefficients(function)  # the control
    assert seen == true, function
print("seen: the series of a shorter denominator; right for the same denominator with numerator x or 1 + x")
PYTHON
# Here: generating functions are those of exact recurrences (kahanmaps/laboratory/growth/recurrences.py).
