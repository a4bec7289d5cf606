#!/usr/bin/env bash
# Expressions that SymPy writes for Rust.
#
# Expected: rust_code prints an expression in floating-point numbers, so that its literals are floats: 2.0*x.
# Seen:     For a symbol without assumptions integers stay integers, 2*x, which Rust refuses to multiply with an f64;
#           with real=True they become 2.0*x. Rationals are floats in both. C and Fortran, which convert, hide the
#           difference.
# A polynomial whose coefficients are rationals that happen to be integers compiles or not, by an assumption on a
# symbol.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/python" -m pip install --quiet --disable-pip-version-check \
    sympy==1.14.0
"$folder/venv/bin/python" - <<'PYTHON'
import sympy as sp

print("SymPy", sp.__version__)
print("expected: 2.0*x + 1.0 and x.powi(2) + 1.0, whatever is known of x")
plain, real = sp.Symbol("x"), sp.Symbol("x", real=True)
for name, x in (("no assumption", plain), ("real=True", real)):
    print(f"  {name:<13} {sp.rust_code(2 * x + 1):<16} {sp.rust_code(x**2 + 1):<18} {sp.rust_code(x / 3 + 1)}")
assert (sp.rust_code(2 * plain), sp.rust_code(2 * real)) == ("2*x", "2.0*x")
assert (sp.rust_code(plain**2 + 1), sp.rust_code(real**2 + 1)) == ("x.powi(2) + 1", "x.powi(2) + 1.0")
assert sp.rust_code(plain / 3 + 1) == "(1_f64/3.0)*x + 1" and sp.rust_code(real / 3 + 1) == "(1_f64/3.0)*x + 1.0"
print("seen: integer literals beside floats unless the symbol is declared real")
PYTHON
# Here: symbols handed to printers of programs are declared real.
