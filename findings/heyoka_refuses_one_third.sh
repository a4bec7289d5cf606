#!/usr/bin/env bash
# An exact rational number of SymPy on its way into heyoka, whose numbers are floats.
#
# Expected: from_sympy rounds 1/3 to the nearest double, as it does for sqrt(2), pi and Float('0.1', 30).
# Seen:     ValueError for every rational number whose denominator is no power of 2, as a coefficient and as an
#           exponent, while irrational numbers are rounded without a word.
# So the right-hand sides of textbooks pass or not by their fractions: 3*x/4 does, 8*x/3 of the Lorenz system does not.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/python" -m pip install --quiet --disable-pip-version-check heyoka==7.13.2 sympy==1.14.0
"$folder/venv/bin/python" - <<'PYTHON'
import heyoka
import sympy

x = sympy.Symbol("x")


def converted(expression):
    try:
        return str(heyoka.from_sympy(expression))
    except ValueError as error:
        return f"ValueError: {error}"


print("heyoka", heyoka.__version__, "SymPy", sympy.__version__)
print("expected: each is rounded to a double")
names = ("3*x/4", "8*x/3", "x/10", "x**(1/3)", "sqrt(2)*x", "pi*x", "0.1*x")
seen = {name: converted(sympy.sympify(name)) for name in names}
for name, text in seen.items():
    print(f"{name:10} -> {text}")
refused = [name for name, text in seen.items() if text.startswith("ValueError")]
assert refused == ["8*x/3", "x/10", "x**(1/3)"], refused
print("also:", heyoka.expression(8.0) / 3.0, "by division in heyoka itself")
print("seen: the irrational ones are rounded, the rational ones refused")
PYTHON
# Here: nothing depends on it; SymPy code that `convert` writes keeps fractions exact, so that its users can meet this.
